"""Climbs without a lift, where the body alone is shifted: against exhaustion."""

from itertools import pairwise

import pytest

from planner.certification import check_bound
from planner.search import climb_certificate, search
from tests.suite.helpers.certificates import (
    best_climb,
    every_state,
    random_climb,
    solved_state,
    wall_of,
)


@pytest.mark.parametrize("seed", [7, pytest.param(0, marks=pytest.mark.slow)])
def test_the_best_climb_may_be_without_a_lift(seed):
    climb = random_climb(seed, placements=5, bodies=3, reach=0.7)
    factors = {state: solved_state(climb, state)[0] for state in every_state(climb)}
    best, route = best_climb(climb, factors)
    assert all(-1 not in members for _, members in route)
    wall, start, goal = wall_of(climb)
    found = search(wall, start, goal)
    assert found.finished
    assert found.least == pytest.approx(best, rel=1e-7)
    assert found.bound == pytest.approx(best, rel=1e-7)
    assert all(-1 not in state.members for state in found.states)
    assert check_bound(climb_certificate(wall, start, goal, found)).proven
    # without it, another one at most, and the same bound
    blocked = frozenset(pairwise(found.states))
    around = search(wall, start, goal, blocked=blocked)
    assert around.least <= best * (1.0 + 1e-9)
    assert around.bound >= best * (1.0 - 1e-9)
    assert not blocked & set(pairwise(around.states))


def test_a_climb_that_holds_too_little_does_not_count():
    climb = random_climb(2, placements=5, bodies=3, reach=0.7)
    wall, start, goal = wall_of(climb)
    best = search(wall, start, goal).least
    found = search(wall, start, goal, at_least=1.1 * best)
    assert found.states == ()
    assert found.bound == pytest.approx(1.1 * best)
    assert check_bound(climb_certificate(wall, start, goal, found)).proven
