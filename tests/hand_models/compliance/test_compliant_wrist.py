"""Hands whose tendons are driven while their wrists settle: loads, palm and linearised sets."""

import math
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.base import InvalidFieldError
from hand_models.compliance import CompliantHand, CompliantWrist, CompliantWrists, Gripper
from hand_models.compliance.compliant_hand import CompliantHands
from hand_models.hand import FINGERS, Grasp, SpinyHand, WristTravel
from hand_models.parameters import ParameterTable, Quantity, experiment_table, hand_table
from hand_models.rock import Cylinder
from hand_models.tile import Surface
from tests.hand_models.compliance.test_compliant_hand import compliant

NAMES = ("pinch", "plane")
tensions = st.lists(st.floats(0.0, 150.0), min_size=4, max_size=4)


def driven(name: str) -> CompliantHand:
    return CompliantHand(compliant(name).settled, scheme="tension")


@pytest.mark.parametrize("name", NAMES)
@given(f=tensions)
def test_at_rest_fingers_carry_what_a_fixed_wrist_gives_them(name: str, f: list[float]) -> None:
    hand = driven(name)
    found = hand.loads(np.zeros((1, 6)), np.array([f]))
    settled = hand.settled
    fixed = settled.loads[..., 0] + settled.loads[..., 1] * np.array(f)[settled.finger_of, None]
    np.testing.assert_allclose(found.tile_loads[0, :, :2], fixed, atol=1e-9)
    np.testing.assert_allclose(found.tensions[0], f, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_at_the_closing_tension_it_is_the_hand_that_keeps_its_tension(name: str) -> None:
    hand, twists = driven(name), 1e-3 * np.random.default_rng(0).normal(size=(5, 6))
    kept = CompliantHand(hand.settled, scheme="tension").loads(twists)
    found = hand.loads(twists, np.tile(hand.preload, (5, 1)))
    np.testing.assert_allclose(found.tile_loads, kept.tile_loads, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_at_a_pose_loads_are_affine_in_the_tensions_in_few_pieces(name: str) -> None:
    """Between two of them a tendon begins to slip or to stick at a tile."""
    hand, rng = driven(name), np.random.default_rng(2)
    tiles = len(hand.settled.tiles)
    for _ in range(10):
        twist = rng.uniform(-1.0, 1.0, 6) * [4e-3, 2e-3, 1e-3, 0.02, 0.04, 0.02]
        ends = rng.uniform(0.0, 60.0, 4), rng.uniform(60.0, 150.0, 4)
        along = np.linspace(0.0, 1.0, 401)[:, None]
        found = hand.loads(np.tile(twist, (401, 1)), (1.0 - along) * ends[0] + along * ends[1])
        bent = np.abs(np.diff(found.tile_loads, 2, axis=0)).max(axis=(1, 2)) > 1e-8
        # a bend between two of the points shows at both
        assert bent.sum() <= 4 * tiles


def of_a_test(values: Mapping[str, tuple[float, str]]) -> dict[str, Quantity]:
    return {name: Quantity(*value, "assumed", "of a test") for name, value in values.items()}


@pytest.mark.parametrize("diameter", [0.3, 0.7])
def test_inner_fingers_whose_tensions_are_kept_carry_what_those_of_a_gripper_do(
    diameter: float,
) -> None:
    """The gripper has the hand's numbers here; the beds under its tiles are always hard."""
    hard = of_a_test({"bed_stiffness": (1e9, "N/m")})
    table = hand_table().replaced(ParameterTable({"tile": hard}))
    hand = SpinyHand(table)
    grasp = Grasp(outer_rotation=math.pi, palm=False)
    settled = hand.settle(Cylinder(diameter), Surface.named("sandpaper-36"), grasp)
    driven_hand = CompliantHand(settled, scheme="tension")
    joints = dict(zip(FINGERS, (frame.joint for frame in driven_hand.frames), strict=True))
    inner, outer = joints["inner_left"], joints["outer_left"]
    own = of_a_test(
        {
            "base_half_spacing": (0.5 * float(inner[0] - outer[0]), "m"),
            "added_radius": (0.0, "m"),
            "origin_height": (0.0, "m"),
            "entry_friction": (driven_hand.fingers[1].tendon.entry_friction, "1"),
        }
    )
    sections = dict(table.sections)
    sections["gripper"] = {**experiment_table().sections["gripper"], **own}
    gripper = Gripper(diameter, settled.closing_tension, table=ParameterTable(sections))
    # in the plane, about the point midway between the proximal joints
    moved = np.array([[0, 0, 0], [8e-4, 0, 0], [0, -4e-4, 0], [0, 0, 2e-4], [-4e-4, -3e-4, 1e-4]])
    middle = 0.5 * (inner + outer)
    twists = np.zeros((len(moved), 6))
    twists[:, [0, 2, 4]] = moved
    turn = moved[:, 2]
    # H turns about its origin: the middle has to be where the gripper's frame goes
    twists[:, 0] -= np.sin(turn) * middle[2] + (np.cos(turn) - 1.0) * middle[0]
    twists[:, 2] -= (np.cos(turn) - 1.0) * middle[2] - np.sin(turn) * middle[0]
    found, (right, _) = driven_hand.loads(twists), gripper.finger_loads(moved)
    for i in (FINGERS.index("inner_left"), FINGERS.index("inner_right")):
        tiles = driven_hand.tiles_of(i)
        np.testing.assert_allclose(found.shears[:, tiles], right.shears, atol=1e-9)
        np.testing.assert_allclose(found.normals[:, tiles], right.normals, atol=1e-9)
    assert np.abs(right.normals[1:] - right.normals[0]).max(axis=1).min() > 0.05  # [N]


def test_many_hands_at_once_are_each_alone() -> None:
    rng = np.random.default_rng(1)
    hands = [driven(name) for name in NAMES]
    twists = [1e-3 * rng.normal(size=(4, 6)) for _ in hands]
    given_tensions = [rng.uniform(10.0, 100.0, (4, 4)) for _ in hands]
    together = CompliantHands(hands).loads(twists, given_tensions)
    for hand, own, f, found in zip(hands, twists, given_tensions, together, strict=True):
        for part, alone in zip(found, hand.loads(own, f), strict=True):
            np.testing.assert_allclose(part, alone, atol=1e-10)


def test_no_twists_have_no_loads() -> None:
    found = driven("pinch").loads(np.zeros((0, 6)))
    assert {len(part) for part in found} == {0}
    assert found.axes.shape[1:] == (14, 3, 3)


def test_a_palm_presses_past_its_gap_and_shears_by_its_travel() -> None:
    hand = driven("pinch")
    gaps = hand.settled.palm.gaps[list(hand.settled.palm.engaged)]
    travel = np.zeros((3, 6))
    # away, to half of the nearest gap, and half a millimetre past the farthest
    travel[:, 2] = -1e-3, 0.5 * gaps.min(), gaps.max() + 5e-4
    away, short, past = hand.loads(travel).palm[:, 1]
    assert away == short == 0.0
    share = np.array(hand.settled.palm.engagement)
    # beyond 0.02 mm, in which its stiffness rises from nothing
    compressed = gaps.max() + 5e-4 - gaps - 1e-5
    by_hand = hand.settled.hand.palm_pressing_stiffness * share @ compressed
    assert past == pytest.approx(by_hand, rel=1e-9)
    sliding = np.zeros((2, 6))
    sliding[:, 0] = -3e-3, 3e-3
    toward, back = hand.loads(sliding).palm[:, 0]
    # likewise within 0.1 mm
    assert toward == pytest.approx(2.95e-3 * hand.settled.palm_shear_stiffness, rel=1e-9)
    assert back == 0.0


@pytest.mark.parametrize("name", NAMES)
def test_a_set_touches_the_model_where_it_is_linearised(name: str) -> None:
    wrist = CompliantWrist(driven(name))
    y = np.array([40.0, 60.0, 50.0, 45.0, 1e-4, -5e-5, -2e-4, 1e-3, -2e-3, 5e-4])
    space = wrist.linearised(y)
    found = wrist.loads_at(y[None])
    np.testing.assert_allclose(space.wrench(y), found.wrenches[0], atol=1e-8)
    small = np.array([1e-2] * 4 + [1e-7] * 3 + [1e-6] * 3)
    ends = [wrist.loads_at(y + sign * np.diag(small)).wrenches for sign in (1.0, -1.0)]
    slopes = ((ends[0] - ends[1]) / (2.0 * small[:, None])).T
    scale = np.abs(space.generators).max(axis=0)
    np.testing.assert_allclose(space.generators / scale, slopes / scale, atol=2e-4)


def test_sets_found_together_are_those_found_alone() -> None:
    wrists = [CompliantWrist(driven(name)) for name in NAMES]
    alone = [CompliantWrist(driven(name)) for name in NAMES]
    poses = [wrist.at_rest[None] + 1e-4 for wrist in wrists]
    CompliantWrists(wrists).prepare(poses)
    for one, other, at in zip(wrists, alone, poses, strict=True):
        assert one.knows(at)
        np.testing.assert_allclose(one.linearised(at[0]).L, other.linearised(at[0]).L, atol=1e-9)


def test_hard_rows_keep_the_wrist_within_its_travel() -> None:
    travel = WristTravel(position=2e-3, inward=5e-4, angle=0.01)
    wrist = CompliantWrist(driven("pinch"), travel=travel)
    space = wrist.linearised()
    rows = [row.limit == "wrist_travel" for row in space.rows[len(space.s) :]]
    H, h = space.H[rows], space.h[rows]
    inside = wrist.at_rest + np.array([0, 0, 0, 0, 2e-3, -2e-3, 5e-4, 0.01, -0.01, 0.0])
    assert (inside @ H.T <= h + 1e-9).all()
    for component, past in ((4, 2.1e-3), (6, 5.1e-4), (6, -2.1e-3), (9, -0.0101)):
        outside = wrist.at_rest.copy()
        outside[component] += past
        assert (outside @ H.T > h).sum() == 1


@pytest.mark.parametrize(
    ("name", "value"), [("position", -1e-3), ("inward", float("nan")), ("angle", 4.0)]
)
def test_an_impossible_travel_is_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidFieldError) as caught:
        WristTravel(**{name: value})
    assert caught.value.field == name
