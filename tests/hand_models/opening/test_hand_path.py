"""Hands that open and close: ends, order, mirror images, moved rock, jams, and few knots."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models import Cylinder, Grasp, Pose, SettledHand, Sphere, wrench_space
from hand_models.base import InvalidFieldError, UnsupportedError
from hand_models.fixed_wrist import slipped_hand
from hand_models.hand import FINGERS
from hand_models.opening import HandPath, clear_retreat, closing_path, opening_path
from hand_models.opening.knots import deviations, few_knots
from tests.suite.helpers.fingernails import step
from tests.suite.helpers.hands import HAND, ROCK, changed_hand, settled_at
from tests.suite.helpers.moved_hands import gentle_profile, random_placement
from tests.suite.helpers.shares import some_and_all

MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""Of a wrench, in the plane y = 0 of H."""

INTO = np.array([0.0, 0.0, 1.0])


def closed_wrench(hand: SettledHand, axials: np.ndarray | None = None) -> np.ndarray:
    """Return the wrench of a hand at its closing tension, without palm and lateral loads."""
    loads = hand.tile_loads(np.full(len(FINGERS), hand.closing_tension), None, axials)
    forces = np.einsum("tk,tkx->tx", loads, hand.axes)
    moment = np.cross(hand.positions, forces).sum(axis=0)
    return np.concatenate([forces.sum(axis=0), moment])


def hand_of(seed: int) -> SettledHand:
    return on_rough_rock(seed) if seed % 2 else hands(4)[seed // 2]


def hands(count: int) -> list[SettledHand]:
    found = [settled_at(seed) for seed in range(2 * count)]
    return [hand for hand in found if hand is not None][:count]


def on_rough_rock(seed: int) -> SettledHand:
    placement, _ = random_placement(seed)
    return HAND.settle(*placement[:4])


def wrench_at(path: HandPath, tension: float) -> np.ndarray:
    rising = path.tensions[:, 0] if path.tensions[0, 0] == 0.0 else -path.tensions[:, 0]
    at = tension if path.tensions[0, 0] == 0.0 else -tension
    return np.array([np.interp(at, rising, each) for each in path.wrenches.T])


@pytest.mark.parametrize("seed", range(6))
def test_opening_starts_at_the_wrench_of_the_closed_hand_in_its_space(seed):
    hand = hand_of(seed)
    path = opening_path(hand)
    np.testing.assert_allclose(path.wrenches[0], closed_wrench(hand), atol=1e-9)
    space = wrench_space(hand)
    tendons = [f"{name}/tension" for name in FINGERS]
    y = np.where(np.isin(space.columns, tendons), hand.closing_tension, 0.0)
    assert np.count_nonzero(y) == len(FINGERS)
    np.testing.assert_allclose(path.wrenches[0], space.origin + space.generators @ y, atol=1e-9)
    np.testing.assert_array_equal(path.tensions[0], hand.closing_tension)
    np.testing.assert_array_equal(path.tensions[-1], 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_closing_ends_at_the_closed_hand(seed):
    hand = hand_of(seed)
    path = closing_path(hand)
    np.testing.assert_allclose(path.wrenches[-1], closed_wrench(hand), atol=1e-9)
    np.testing.assert_array_equal(path.tensions[-1], hand.closing_tension)
    np.testing.assert_array_equal(path.joints[-1], [finger.joint_angles for finger in hand.fingers])
    caught = {(event.finger, event.phalanx) for event in path.events}
    assert caught <= {tile[:2] for tile, on in zip(hand.tiles, hand.holding, strict=True) if on}


@some_and_all("seeds", range(60), 12)
def test_at_zero_tension_nothing_pulls_and_nothing_is_left_but_springs_on_rock(seeds):
    for hand in map(on_rough_rock, seeds):
        path = opening_path(hand)
        assert path.jammed == ()
        left = np.linalg.norm(path.wrenches[-1, :3])
        assert left == pytest.approx(0.0, abs=1e-4) or path.resting
        # a finger's springs have 50 N·mm a radian
        assert left < 6.0 * max(len(path.resting), 1)


def test_nothing_is_caught_anew_and_tiles_let_go_once_in_falling_order():
    for hand in hands(8):
        path = opening_path(hand)
        assert (np.diff(path.engagement, axis=0) <= 1e-12).all()
        tensions = [event.tension for event in path.events]
        assert np.diff(tensions).max(initial=0.0) < 1e-5
        assert len({event[:2] for event in path.events}) == len(path.events)


def test_on_300_mm_tiles_let_go_middle_first_then_proximal_then_distal():
    """By hand: the middle tile's shear 6.664 − 0.7253 (37 − f) is μ times its pull at 28.5 N.

    Its pull then is 1.12 N; a base tile, which is not pressed, lets go where
    0.1317 · 37 N = 0.5397 (37 N − f).
    """
    hand = HAND.settle(Cylinder(0.3), ROCK, Grasp())
    path = opening_path(hand)
    inner = [event for event in path.events if event.finger == "inner_left"]
    assert [event.phalanx for event in inner] == ["middle", "proximal", "distal"]
    shear = 6.664 - 0.7253 * (37.0 - inner[0].tension)
    middle = next(i for i, tile in enumerate(hand.tiles) if tile[:2] == ("inner_left", "middle"))
    pull = -(hand.loads[middle, 1] @ [1.0, inner[0].tension])
    # in closed form a tile's contact is some micrometres elsewhere: 0.1 N
    assert shear == pytest.approx(ROCK.friction * pull, abs=0.1)
    base = next(event for event in path.events if event.phalanx == "base")
    assert base.tension == pytest.approx(37.0 * (1.0 - 0.1317 / 0.53968), abs=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_between_knots_the_wrench_is_near_the_straight_line(seed):
    hand = on_rough_rock(seed)
    fine, coarse = opening_path(hand, force=1e-3), opening_path(hand)
    assert len(coarse.tensions) <= len(fine.tensions)
    assert (coarse.deviation <= [0.5] * 3 + [0.05] * 3).all()
    # the fine path is at most a thousandth off the law
    off = [
        wrench_at(coarse, f) - w for f, w in zip(fine.tensions[:, 0], fine.wrenches, strict=True)
    ]
    assert (np.abs(off).max(axis=0) <= coarse.deviation.max(axis=0) + 2e-3).all()


def test_a_hand_on_its_mirror_image_opens_in_its_mirror_image():
    rotation = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(0.1), -math.sin(0.1)],
                         [0.0, math.sin(0.1), math.cos(0.1)]])  # fmt: skip
    place = np.array([0.03, 0.006, 0.002])
    across = np.diag([1.0, -1.0, 1.0])
    paths = [
        opening_path(HAND.settle(Sphere(0.4), ROCK, Grasp(), Pose(at, turn)))
        for at, turn in ((place, rotation), (across @ place, across @ rotation @ across))
    ]
    here, there = paths
    np.testing.assert_allclose(there.tensions, here.tensions, atol=1e-6)
    np.testing.assert_allclose(there.wrenches, here.wrenches * MIRROR, atol=1e-5)
    np.testing.assert_allclose(there.joints, here.joints[:, ::-1], atol=1e-6)
    other = dict(zip(FINGERS, FINGERS[::-1], strict=True))
    assert {(other[e.finger], e.phalanx, round(e.tension, 4)) for e in here.events} == {
        (e.finger, e.phalanx, round(e.tension, 4)) for e in there.events
    }


@pytest.mark.parametrize("seed", range(4))
def test_rock_that_moves_by_a_micrometre_changes_the_path_a_little(seed):
    hold = gentle_profile(np.random.default_rng(seed))
    hand = HAND.settle(hold, ROCK, Grasp())
    seat = hand.seating.pose
    paths = [
        opening_path(
            HAND.settle(hold, ROCK, Grasp(), Pose(seat.position + off * INTO, seat.rotation))
        )
        for off in (0.0, 1e-6)
    ]
    f = np.linspace(0.0, 37.0, 38)
    before, after = (np.array([wrench_at(path, each) for each in f]) for path in paths)
    largest = np.abs(paths[0].wrenches[:, :3]).max()
    # at a snap a knot may move by what the snap does
    apart = np.abs(after - before)[:, :3].max(axis=1) / largest
    assert np.median(apart) < 0.005
    assert np.quantile(apart, 0.9) < 0.05
    let_go = [sorted(event[:2] for event in path.events) for path in paths]
    assert let_go[0] == let_go[1]


def test_a_hand_whose_springs_cannot_push_tiles_back_says_that_it_jams():
    """Tiles on soft contacts keep most of their shear at zero tension: g < τ."""
    soft = changed_hand("tile", "contact_stiffness", [300.0] * 3)
    assert max(soft.finger.shear_gain) < min(soft.finger.engagement)
    hand = soft.settle(Cylinder(0.7), ROCK, Grasp())
    path = opening_path(hand)
    assert path.jammed
    for jam in path.jammed:
        assert jam.friction is not None
        assert jam.friction > ROCK.friction
        assert f"{jam.friction:.3g}" in jam.reason
    # with more friction than that the first of them let go
    left = [
        np.count_nonzero(opening_path(replace(hand, surface=surface)).engagement[-1])
        for surface in (
            replace(ROCK, friction=part * min(jam.friction or 0.0 for jam in path.jammed))
            for part in (0.999, 1.001)
        )
    ]
    assert left[1] < left[0] == np.count_nonzero(path.engagement[-1])


def test_nails_let_go_where_they_can_stay_no_longer():
    hand = HAND.settle(
        step(0.005),
        ROCK,
        Grasp(fingernail=True, palm=False),
        Pose(0.001 * INTO, np.eye(3)),
    )
    hooked = hand.nails.nonzero()[0]
    assert len(hooked)
    path = opening_path(hand)
    assert {event.phalanx for event in path.events} == {"nail"}
    assert len(path.events) == len(hooked)
    np.testing.assert_allclose(path.wrenches[-1], 0.0, atol=1e-12)
    np.testing.assert_array_equal(path.joints, 0.0)
    assert [event[:2] for event in closing_path(hand).events] == [e[:2] for e in path.events]


def test_of_a_hand_whose_tiles_have_slipped_no_path_is_known():
    hand = HAND.settle(Cylinder(0.3), ROCK, Grasp())
    with pytest.raises(UnsupportedError, match="slipped"):
        opening_path(slipped_hand(hand, [int(hand.touching.nonzero()[0][0])]))


def test_a_hand_retreats_until_its_straight_fingers_are_clear():
    assert clear_retreat(HAND.settle(Cylinder(0.3), ROCK, Grasp())) == 0.0
    found = [(hand, clear_retreat(hand)) for hand in map(on_rough_rock, range(12))]
    far = [(hand, retreat) for hand, retreat in found if retreat]
    assert far
    for hand, retreat in far[:2]:
        pose = hand.seating.pose
        for off, clear in ((retreat + 1e-4, True), (retreat - 2e-4, False)):
            # the rock moves away along z of H
            moved = Pose(pose.position + off * INTO, pose.rotation)
            there = [
                frame.rock(hand.hold, moved.inverse()).tile
                for frame in hand.hand.frames(hand.grasp.outer_rotation)
            ]
            x = np.linspace(0.009, 3.0 * hand.hand.finger.joint_spacing, 400)
            depth = min(
                each.clearances(x + 1j * z).min()
                for each in there
                for z in (-hand.hand.finger.frame_radius, hand.hand.finger.tile_height)
                if each is not None
            )
            assert (depth > -5e-4) if clear else True


def test_few_knots_are_few_and_keep_within_the_tolerance():
    at = np.linspace(0.0, 10.0, 201)
    values = np.column_stack([np.abs(at - 4.0), 0.1 * at])
    knots = few_knots(at, values, np.array([1e-6, 1e-6]))
    np.testing.assert_allclose(at[knots], [0.0, 4.0, 10.0])
    assert deviations(at, values, knots).max() < 1e-12
    waves = np.column_stack([np.sin(at), np.cos(2.0 * at)])
    tolerance = np.array([0.05, 0.1])
    knots = few_knots(at, waves, tolerance)
    assert (deviations(at, waves, knots) <= tolerance + 1e-12).all()
    assert len(knots) < 30


@pytest.mark.parametrize("force", [-1.0, math.nan])
def test_a_distance_from_straight_lines_below_zero_is_refused(force):
    with pytest.raises(InvalidFieldError, match="force: must be 0 N or more"):
        opening_path(hand_of(0), force=force)
