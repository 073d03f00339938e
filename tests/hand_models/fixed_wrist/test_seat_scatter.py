"""What a hand can carry over a scatter of its place: drawn as told, and no more than anywhere."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Grasp, InvalidInputError, Plane, Pose
from hand_models.fixed_wrist import robustness, scattered_places, wrench_space
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


def test_without_scatter_it_is_the_nominal_capability():
    settled = pinch()
    found = robustness(HAND, settled, BOTH, draws=3, scatter=(0.0, 0.0))
    nominal = [wrench_space(settled).support(way) for way in BOTH]
    np.testing.assert_allclose(found.hundredth, nominal, rtol=1e-9)
    np.testing.assert_allclose(found.tenth, nominal, rtol=1e-9)


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
