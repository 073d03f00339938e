"""Hands whose tendons are driven while their wrists settle: loads, palm and linearised sets."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.base import InvalidFieldError
from hand_models.compliance import CompliantHand, CompliantWrist, CompliantWrists
from hand_models.compliance.compliant_hand import CompliantHands
from hand_models.hand import WristTravel
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
