"""Moves that may not be made: the search goes round them, and its bound stays that of the loads."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from planner.search import State, search
from tests.suite.helpers import certificates
from tests.suite.helpers.certificates import (
    best_climb,
    every_state,
    random_climb,
    solved_state,
    wall_of,
)


@cache
def climb_and_factors():
    """A climb of seven states at best, and the load factor of each state of its wall."""
    climb = random_climb(34, placements=5, bodies=3, reach=0.6)
    return climb, {state: solved_state(climb, state)[0] for state in every_state(climb)}


@cache
def best_route():
    climb, factors = climb_and_factors()
    return best_climb(climb, factors)


@cache
def gone_round(at):
    """What the search finds where a move of the best climb may not be made."""
    climb, _ = climb_and_factors()
    wall, start, goal = wall_of(climb)
    pair = tuple(State(*each) for each in list(pairwise(best_route()[1]))[at])
    return search(wall, start, goal, blocked=frozenset([pair]))


@pytest.mark.parametrize("at", [2, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 5))])
def test_a_blocked_move_is_gone_round_and_leaves_the_bound(at, monkeypatch):
    """A shift at the start, a lift on the way, and a shift at the goal."""
    climb, factors = climb_and_factors()
    best, route = best_route()
    blocked = list(pairwise(route))[at]
    monkeypatch.setattr(
        certificates,
        "is_move",
        lambda c, a, b, other=certificates.is_move: other(c, a, b) and (a, b) != blocked,
    )
    around, _ = best_climb(climb, factors)
    assert around < best
    # its wall is made without what is patched
    found = gone_round(at)
    np.testing.assert_allclose(found.least, around, rtol=1e-7)
    assert found.bound >= best * (1.0 - 1e-9)


@pytest.mark.slow
def test_moves_that_do_not_pass_are_gone_round_as_blocked_ones_are():
    climb, _ = climb_and_factors()
    _, route = best_route()
    wall, start, goal = wall_of(climb)
    for at in (0, 2, 5):
        first, second = (State(*each) for each in list(pairwise(route))[at])
        pair = first, second
        around = gone_round(at)
        asked = search(wall, start, goal, passes=lambda a, b, pair=pair: (a, b) != pair)
        np.testing.assert_allclose(asked.least, around.least, rtol=1e-9)
        assert asked.bound >= around.bound * (1.0 - 1e-9)


@pytest.mark.slow
def test_below_the_floor_nothing_counts_and_above_it_nothing_changes():
    climb, _ = climb_and_factors()
    best, _ = best_route()
    wall, start, goal = wall_of(climb)
    np.testing.assert_allclose(search(wall, start, goal, floor=0.9 * best).least, best, rtol=1e-7)
    over = search(wall, start, goal, floor=1.01 * best)
    assert over.finished
    assert not over.states
    assert best <= over.bound <= 1.01 * best * (1.0 + 1e-9)
