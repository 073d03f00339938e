"""What a hand can carry over a scatter of its place: drawn as told, and no more than anywhere."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Grasp, InvalidInputError, Plane, Pose
from hand_models.fixed_wrist import (
    force_directions,
    pure_reaches,
    robustness,
    scattered_places,
    wrench_space,
)
from tests.suite.helpers.hands import HAND, ROCK, pinch

BOTH = np.vstack([np.eye(6), -np.eye(6)])


def test_it_is_what_hands_put_at_its_places_reach():
    settled = pinch()
    found = robustness(HAND, settled, BOTH, draws=8, seed=3)
    assert (found.draws, found.without, found.seed) == (8, 0, 3)
    assert (found.position, found.angle) == HAND.seat_scatter == (0.002, 0.02)
    drawn = scattered_places("", 8, 3)
    reaches = []
    for each in drawn:
        frame = Pose(0.002 * each[:3], Rotation.from_rotvec(0.02 * each[3:]).as_matrix())
        there = frame.inverse() @ settled.seating.pose
        space = wrench_space(HAND.settle(settled.hold, ROCK, settled.grasp, there))
        reaches.append([space.support(way) for way in BOTH])
    np.testing.assert_array_equal(found.hundredth, np.percentile(reaches, 1.0, axis=0))
    np.testing.assert_array_equal(found.worst, found.hundredth)
    np.testing.assert_array_equal(found.tenth, np.percentile(reaches, 10.0, axis=0))


def test_pure_forces_are_those_of_hands_put_at_its_places():
    """Half-spaces have the line of a force: no linear program is needed to compute its ends."""
    settled, ways = pinch(), force_directions(("-fz", "+fx", "-fx"))
    found = robustness(HAND, settled, BOTH[:1], draws=16, seed=3, pure=ways, force=20.0)
    held = []
    for each in scattered_places("", 16, 3):
        frame = Pose(0.002 * each[:3], Rotation.from_rotvec(0.02 * each[3:]).as_matrix())
        there = frame.inverse() @ settled.seating.pose
        faces = wrench_space(HAND.settle(settled.hold, ROCK, settled.grasp, there)).half_spaces()
        assert not len(faces.equation_offsets)
        slopes = ways @ faces.normals.T
        with np.errstate(divide="ignore"):
            ends = faces.offsets / slopes
        high = np.where(slopes > 0.0, ends, np.inf).min(axis=1)
        low = np.where(slopes < 0.0, ends, -np.inf).max(axis=1)
        held.append(np.where(low <= high, np.maximum(high, 0.0), 0.0))
    ranked = np.sort(held, axis=0)
    # 2 of 16 places are the first tenth
    np.testing.assert_allclose(found.pure_tenth, ranked[1], rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(found.share, (ranked >= 20.0).mean(axis=0))
    assert 0.0 < found.share[0] < 1.0


def test_a_pure_force_is_an_end_of_its_line_and_opposite_ones_share_it():
    space = wrench_space(pinch())
    ways = ("+fx", "-fx", "+fz", "-fz")
    reaches = dict(zip(ways, pure_reaches(space, force_directions(ways)), strict=True))
    for axis, unit in (("fx", np.eye(6)[0]), ("fz", np.eye(6)[2])):
        low, high = space.capability(unit)
        assert (reaches[f"+{axis}"], reaches[f"-{axis}"]) == (high, -low)
        assert space.contains(high * unit)
        assert not space.contains((high + 0.01) * unit)


def test_without_scatter_it_is_the_nominal_capability():
    settled = pinch()
    found = robustness(HAND, settled, BOTH, draws=3, scatter=(0.0, 0.0))
    nominal = [wrench_space(settled).support(way) for way in BOTH]
    np.testing.assert_allclose(found.hundredth, nominal, rtol=1e-9)
    np.testing.assert_allclose(found.tenth, nominal, rtol=1e-9)


def test_a_force_of_zero_is_none_to_hold():
    with pytest.raises(InvalidInputError) as caught:
        robustness(HAND, pinch(), BOTH, draws=1, force=0.0)
    assert caught.value.field == "force"


def test_it_is_the_same_each_time():
    one, again = (robustness(HAND, pinch(), BOTH, draws=8) for _ in range(2))
    np.testing.assert_array_equal(one.tenth, again.tenth)
    assert (one.hundredth <= one.tenth).all()


@pytest.mark.slow
def test_it_is_steady_under_another_scramble():
    settled = HAND.settle(Cylinder(0.4), ROCK, Grasp(math.pi))
    one, other = (robustness(HAND, settled, BOTH, seed=seed) for seed in (0, 1))
    assert not np.array_equal(one.tenth, other.tenth)
    np.testing.assert_allclose(other.tenth, one.tenth, rtol=0.1, atol=0.1 * np.abs(one.tenth).max())


def test_places_where_the_hand_cannot_be_count_as_a_reach_of_zero():
    """On a plane with its palm on it, half of the places are in the rock."""
    settled = HAND.settle(Plane(), ROCK, Grasp(), Pose.identity())
    found = robustness(HAND, settled, BOTH, draws=16)
    assert 2 < found.without < 16
    # more than a tenth of them reach nowhere
    pure = robustness(HAND, settled, BOTH[:1], draws=16, pure=force_directions())
    np.testing.assert_array_equal(pure.pure_tenth, 0.0)
    assert (pure.share <= 1.0 - found.without / 16).all()
    np.testing.assert_array_equal(found.tenth[found.tenth > 0.0], [])
    alone = [robustness(HAND, settled, BOTH, draws=1, seed=seed) for seed in range(4)]
    assert {each.without for each in alone} == {0, 1}
    for each in alone:
        assert (each.tenth == 0.0).all() == (each.without == 1)


@pytest.mark.parametrize(
    ("draws", "scatter", "field"),
    [
        (0, None, "draws"),
        (5, (-0.001, 0.0), "scatter"),
        (5, (math.nan, 0.0), "scatter"),
        (5, (0.0, 4.0), "scatter"),
    ],
)
def test_impossible_scatters_are_refused(draws, scatter, field):
    with pytest.raises(InvalidInputError) as caught:
        robustness(HAND, pinch(), BOTH, draws=draws, scatter=scatter)
    assert caught.value.field == field
