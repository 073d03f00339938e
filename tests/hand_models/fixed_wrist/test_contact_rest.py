"""Hands placed by contact: where they rest nothing pulls or pushes them, wherever they began."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from hand_models import Cylinder, Edge, Grasp, InvalidInputError, Plane, Pose, SettledHand, Sphere
from hand_models.base import turns_about
from hand_models.compliance import CompliantHand
from hand_models.fixed_wrist import (
    CONTACT_SETTINGS,
    ContactSettings,
    closed_about,
    contact_rest,
    placed_by_contact,
    robustness,
)
from hand_models.hand import Placement, SpinyHand, spiny_hand
from hand_models.wrench_spaces import WRENCH_SCALE
from tests.suite.helpers.hands import HAND, PINCH, ROCK, pinch

UNLOADED = [2, 3, 4]
"""The components of a wrench that are zero at rest: f_z, m_x, m_y."""

OFFSET = Pose(np.array([0.001, 0.0, -0.0007]), turns_about([0.0, 0.01, 0.02]))


def rest(settled: SettledHand, offset: Pose | None = None) -> SettledHand:
    (found,) = placed_by_contact(HAND, [settled], None if offset is None else [offset])
    assert isinstance(found, SettledHand), found
    return found


def again(settled: SettledHand, moved: Pose) -> SettledHand:
    """The same hand, closed where it has moved to."""
    pose = moved.inverse() @ settled.seating.pose
    return HAND.settle(settled.hold, settled.surface, settled.grasp, pose)


def along_z(settled: SettledHand, distance: float) -> SettledHand:
    return again(settled, Pose(np.array([0.0, 0.0, distance]), np.eye(3)))


def net(settled: SettledHand) -> np.ndarray:
    """Net wrench in newtons, by the compliant hand, whose fingers and palm no wrist has moved."""
    hand = CompliantHand(settled)
    wrench = hand.loads(np.zeros((1, 6))).wrenches[0]
    for i, share in zip(settled.palm.engaged, settled.palm.engagement, strict=True):
        depth = max(-settled.palm.gaps[i], 0.0)
        force = np.array([0.0, 0.0, HAND.palm_pressing_stiffness * share * depth])
        wrench += np.concatenate([force, np.cross(HAND.palm_tiles[i], force)])
    return wrench * WRENCH_SCALE


@pytest.mark.parametrize(("diameter", "deeper"), [(0.3, 0.72e-3), (0.7, 0.0)])
def test_where_a_hand_rests_its_net_wrench_is_zero(diameter: float, deeper: float) -> None:
    seat = pinch(diameter)
    there = rest(seat)
    assert there.seating.rule == "contact"
    assert np.abs(net(there)[UNLOADED]).max() <= CONTACT_SETTINGS.force
    moved = seat.seating.pose @ there.seating.pose.inverse()
    assert moved.position == pytest.approx([0.0, 0.0, deeper], abs=1e-5)
    # its turn about z stays
    assert moved.rotation[0, 1] == pytest.approx(moved.rotation[1, 0], abs=1e-12)


def test_a_hand_that_is_moved_off_its_rest_is_brought_back() -> None:
    """Pushed in it pushes the rock, drawn off it pulls; tilted it turns the rock with it."""
    there = rest(pinch())
    assert net(along_z(there, 1e-4))[2] > 1.0
    assert net(along_z(there, -1e-4))[2] < -1.0
    for axis, component in ((0, 3), (1, 4)):
        tilted = again(there, Pose(np.zeros(3), turns_about(2e-3 * np.eye(3)[axis])))
        assert net(tilted)[component] > 0.1


@pytest.mark.parametrize(
    "moved",
    [
        Pose(np.array([0.0, 0.0, 0.0015]), np.eye(3)),
        Pose(np.array([0.0, 0.0, -0.003]), np.eye(3)),
        Pose(np.zeros(3), turns_about([0.004, -0.006, 0.0])),
    ],
    ids=["deeper", "off", "tilted"],
)
def test_from_another_start_a_hand_comes_to_the_same_rest(moved: Pose) -> None:
    seat = pinch()
    one, other = rest(seat), rest(again(seat, moved))
    # where it starts tilted, its way along z is tilted, too
    tolerance = 1e-6 + 1e-3 * np.abs(moved.rotation - np.eye(3)).max()
    apart = one.seating.pose @ other.seating.pose.inverse()
    assert np.abs(apart.position).max() < tolerance
    assert np.abs(apart.rotation - np.eye(3)).max() < 5e-5


@pytest.mark.slow
def test_a_palm_that_meets_the_rock_holds_the_hand_off() -> None:
    seat = HAND.settle(Sphere(0.22), ROCK, Grasp(closing_tension=15.0))
    there = rest(seat)
    assert -2e-5 < there.palm.gaps.min() < 0.0
    assert np.abs(net(there)[UNLOADED]).max() <= CONTACT_SETTINGS.force
    # the fingers alone would draw it in and turn it over
    bare = HAND.settle(Sphere(0.22), ROCK, Grasp(closing_tension=15.0, palm=False))
    assert isinstance(placed_by_contact(HAND, [bare])[0], InvalidInputError)


@pytest.mark.slow
def test_a_palm_on_an_edge_rests_on_it_wherever_it_is() -> None:
    """On a rounded edge some or all of four palm tiles meet the rock: each begins to press."""
    seat = HAND.settle(Edge(0.1, math.pi / 2.0), ROCK, Grasp())
    there = rest(seat)
    places = np.array([[0.55, -0.13, 0, 0, 0, -0.71], [0.28, 0.12, 0, 0, 0, 0.51]])
    (outcomes,) = closed_about(HAND, there, places, HAND.seat_scatter)
    for each in (there, *outcomes):
        assert isinstance(each, SettledHand)
        assert -1e-4 < each.palm.gaps.min() < 0.0
        assert np.abs(net(each)[UNLOADED]).max() <= CONTACT_SETTINGS.force


def test_an_offset_is_taken_in_the_frame_of_the_rest() -> None:
    seat = pinch()
    there, moved = rest(seat), rest(seat, OFFSET)
    expected = OFFSET.inverse() @ there.seating.pose
    np.testing.assert_allclose(moved.seating.pose.position, expected.position, atol=1e-12)
    np.testing.assert_allclose(moved.seating.pose.rotation, expected.rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("hold", "grasp", "why"),
    [
        (Plane(), Grasp(), "comes to rest nowhere from 8 mm off its pose to 5 mm deeper"),
        (Plane(), Grasp(fingernail=True), "grasp.fingernail"),
    ],
)
def test_a_hand_without_a_rest_is_refused(hold, grasp: Grasp, why: str) -> None:
    (error,) = placed_by_contact(HAND, [HAND.settle(hold, ROCK, grasp)])
    assert isinstance(error, InvalidInputError)
    assert error.field == "placing"
    assert why in error.message
    assert "'given'" in error.message


@pytest.mark.slow
def test_a_search_without_a_rest_ends_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a ball of 130 mm a pinch is tilted as far as it may be, and has no rest on the way."""
    hand, closed = spiny_hand(), 0
    settle = SpinyHand.settle_each

    def counted(self: SpinyHand, placements: Sequence[Placement]) -> object:
        nonlocal closed
        closed += len(placements)
        return settle(self, placements)

    seats = [hand.settle(Sphere(diameter), ROCK, PINCH) for diameter in (0.13, 0.2)]
    monkeypatch.setattr(SpinyHand, "settle_each", counted)
    (outcome,) = placed_by_contact(hand, seats[:1])
    assert isinstance(outcome, InvalidInputError)
    assert closed <= 140
    # with too few closings a rest is not found
    monkeypatch.setattr(contact_rest, "CONTACT_SETTINGS", ContactSettings(closings=20))
    closed = 0
    (outcome,) = placed_by_contact(hand, seats[1:])
    assert isinstance(outcome, InvalidInputError)
    assert outcome.field == "placing"
    assert closed < 40


def test_one_without_a_rest_does_not_keep_others_from_theirs() -> None:
    flat, round_one = HAND.settle(Plane(), ROCK, Grasp()), pinch()
    error, there = placed_by_contact(HAND, [flat, round_one])
    assert isinstance(error, InvalidInputError)
    assert isinstance(there, SettledHand)
    np.testing.assert_allclose(
        there.seating.pose.position, rest(round_one).seating.pose.position, atol=1e-9
    )


@pytest.mark.parametrize("offset", [None, OFFSET], ids=["at rest", "off it"])
def test_a_hand_elsewhere_comes_to_rest_anew_and_is_left_off_it_by_what_contact_leaves(
    offset: Pose | None,
) -> None:
    there = rest(pinch(), offset)
    back = (offset or Pose.identity()).inverse()
    wrist = np.array([[0.7, -0.3, 0.0, 0.0, 0.0, 0.9], [-1.0, 0.0, 0.0, 0.0, 0.0, -0.4]])
    position, angle = HAND.seat_scatter
    (outcomes,) = closed_about(HAND, there, wrist, (position, angle))
    for each, by in zip(outcomes, wrist, strict=True):
        assert isinstance(each, SettledHand)
        at_rest = again(each, back)
        assert np.abs(net(at_rest)[UNLOADED]).max() <= CONTACT_SETTINGS.force
        # along the cylinder, which is y of H, nothing else moves it
        moved = (there.seating.pose @ each.seating.pose.inverse()).position
        if offset is None:
            assert moved[1] == pytest.approx(position * by[1], abs=1e-6)
            assert moved[0] == pytest.approx(position * by[0], abs=1e-6)
    left = wrist + np.array([0.0, 0.0, 1.0, 0.0, -1.0, 0.0])
    (farther,) = closed_about(HAND, there, left, (position, angle))
    deep, turn = HAND.contact_scatter
    for each, other in zip(outcomes, farther, strict=True):
        assert isinstance(each, SettledHand)
        assert isinstance(other, SettledHand)
        moved_rest = again(each, back).seating.pose @ again(other, back).seating.pose.inverse()
        np.testing.assert_allclose(moved_rest.position, [0.0, 0.0, deep], atol=1e-9)
        tilt = turns_about([0.0, -turn, 0.0])
        np.testing.assert_allclose(moved_rest.rotation, tilt, atol=1e-9)


def test_what_contact_leaves_is_less_than_a_given_pose() -> None:
    """Over its scatter a hand by contact loses less of what it has where it rests."""
    shear = [[-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]
    given = pinch()
    contact = rest(given)
    one, other = (robustness(HAND, each, shear, draws=8) for each in (given, contact))
    assert one.contact is None
    assert other.contact == HAND.contact_scatter == (0.00025, 0.003)
    assert (one.position, one.angle) == (other.position, other.angle) == (0.002, 0.02)
    assert other.hundredth[0] > 2.0 * one.hundredth[0]


def test_mirrored_hands_rest_at_mirrored_poses() -> None:
    """On a cylinder that is tilted about z of H, and the other way."""
    poses = []
    for turn in (0.1, -0.1):
        tilted = pinch().seating.pose.rotation @ turns_about([0.0, 0.0, turn])
        start = HAND.settle(Cylinder(0.3), ROCK, PINCH, Pose(pinch().seating.pose.position, tilted))
        poses.append(rest(start).seating.pose)
    mirror = np.diag([1.0, -1.0, 1.0])
    np.testing.assert_allclose(poses[1].position, mirror @ poses[0].position, atol=1e-6)
    np.testing.assert_allclose(poses[1].rotation, mirror @ poses[0].rotation @ mirror, atol=1e-5)
    assert math.isclose(net(rest(pinch()))[3], 0.0, abs_tol=CONTACT_SETTINGS.force)


def test_an_offset_into_the_rock_is_blamed_on_the_offset() -> None:
    (refused,) = placed_by_contact(
        HAND, [pinch(0.3)], [Pose(np.array([0.0, 0.0, 0.05]), np.eye(3))]
    )
    assert isinstance(refused, InvalidInputError)
    assert refused.field == "contact_offset"
