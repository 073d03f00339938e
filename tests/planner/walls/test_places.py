"""Placements on a rock: the hands that lift most, with the sets that planning gives them."""

import numpy as np
import pytest
import scipy

from hand_models.base import InvalidInputError
from hand_models.fixed_wrist import closed_holds, wrench_space, wrench_spaces
from hand_models.hand import SettledHand
from hand_models.tile import Surface
from planner.prepare import settle_each
from planner.robots import robosimian
from planner.screening import WorldHands
from planner.walls import PlaceGrid, best_places, hand_at, palms_apart, place_trials
from tests.suite.helpers.climbing_walls import rock_of

ROBOT, ROCK = robosimian(), Surface.named("rock")


@pytest.fixture(scope="module")
def tried():
    rock, pose = rock_of(1)
    points = place_trials(PlaceGrid(spacing=0.45, angles=2), rock, ROBOT.hand)
    up = pose.rotation.T @ [0.0, 0.0, 1.0]
    return rock, pose, points, up


def largest_force(settled, up):
    """Largest force of rock on a hand along a direction of the rock's frame alone [N], by HiGHS.

    None if every force has components across.
    """
    space, axes = wrench_space(settled), settled.seating.pose.rotation
    way = axes @ up
    across = scipy.linalg.null_space(way[None]).T
    generators, origin = space.generators[:3], space.origin[:3]
    found = scipy.optimize.linprog(
        way @ generators,
        A_ub=space.A,
        b_ub=space.b,
        A_eq=across @ generators,
        b_eq=-across @ origin,
        bounds=[(None, None)] * len(space.columns),
    )
    assert found.status in (0, 2)
    return None if found.status else -found.fun - way @ origin


def test_the_hands_that_lift_most_are_kept_at_each_point(tried):
    rock, _, points, up = tried
    outcomes = closed_holds(ROBOT.hand, rock, ROCK, [each for trials in points for each in trials])
    values = [
        largest_force(each, up) if isinstance(each, SettledHand) else None for each in outcomes
    ]
    at, expected = 0, []
    for trials in points:
        here = [v for v in values[at : at + len(trials)] if v is not None and v > 0.0]
        expected += sorted(here, reverse=True)[:2]
        at += len(trials)
    found, refused = best_places(ROBOT.hand, rock, ROCK, points, up, 2)
    assert len(found) > 8
    np.testing.assert_allclose([place.lift for place in found], expected, rtol=1e-7)
    # every trial is kept, or has a reason
    assert len(found) + refused.total() == sum(map(len, points))
    assert refused["scan_border"] == sum(
        getattr(each, "reason", "") == "scan_border" for each in outcomes
    )
    best, _ = best_places(ROBOT.hand, rock, ROCK, points, up, 1)
    lifts = [place.lift for place in best]
    assert len(lifts) > 4
    assert set(lifts) < {place.lift for place in found}


def test_planning_gives_a_placement_the_same_set(tried):
    rock, pose, points, up = tried
    found, _ = best_places(ROBOT.hand, rock, ROCK, points, up, 1)
    hands = [hand_at(place, rock, pose, ROCK, "rear_left") for place in found]
    closed = settle_each(ROBOT.hand, hands)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(20, 6))
    poses = [hand.pose for hand in hands]
    world = WorldHands.of([place.parts for place in found], poses, np.zeros(3))
    again = WorldHands.of([type(found[0].parts).of(s) for s in wrench_spaces(closed)], poses, 0.0)
    np.testing.assert_allclose(
        world.supports(directions), again.supports(directions), rtol=0.0, atol=0.0
    )
    for hand, settled in zip(hands, closed, strict=True):
        # the rock is where it stands
        there = hand.pose @ settled.seating.pose
        np.testing.assert_allclose(there.position, pose.position, atol=1e-12)
        np.testing.assert_allclose(there.rotation, pose.rotation, atol=1e-12)


def test_hands_are_apart_by_their_palms(tried):
    rock, pose, points, up = tried
    found, _ = best_places(ROBOT.hand, rock, ROCK, points, up, 4)
    hands = [hand_at(place, rock, pose, ROCK, "rear_left") for place in found]
    apart = palms_apart(hands, 0.3)
    assert not apart.diagonal().any()
    assert (apart == apart.T).all()
    for i, j in np.ndindex(apart.shape):
        away = np.linalg.norm(hands[i].pose.position - hands[j].pose.position)
        assert apart[i, j] == (away >= 0.3)
    assert 0.1 < apart.mean() < 1.0


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"spacing": 0.001}, r"spacing: must be 0\.005 to 10 m, got 0\.001"),
        ({"angles": 0}, "angles: must be 1 to 360, got 0"),
        ({"rotations": (4.0,)}, r"^rotations: must be in \[0, pi\] rad, got 4"),
        ({"rotations": (1.0, 1.0)}, "rotations: must be at least one number, and no number twice"),
    ],
)
def test_impossible_grids(numbers, said):
    with pytest.raises(InvalidInputError, match=said):
        PlaceGrid(**numbers)


def test_a_mesh_that_is_turned_over():
    rock, _ = rock_of()
    turned = type(rock)(rock.triangles.vertices, rock.triangles.faces[:, ::-1], anywhere=True)
    with pytest.raises(InvalidInputError, match="no grid point is on rock that faces"):
        place_trials(PlaceGrid(), turned, ROBOT.hand)
