"""Moves that may not be made: the search goes round them, and its bound stays that of the loads."""

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


@pytest.mark.parametrize("at", [0, 2, 5])
def test_a_blocked_move_is_gone_round_and_leaves_the_bound(at, monkeypatch):
    """A shift at the start, a lift on the way, and a shift at the goal."""
    climb = random_climb(34, placements=5, bodies=3, reach=0.6)
    factors = {state: solved_state(climb, state)[0] for state in every_state(climb)}
    best, route = best_climb(climb, factors)
    blocked = list(pairwise(route))[at]
    monkeypatch.setattr(
        certificates,
        "is_move",
        lambda c, a, b, other=certificates.is_move: other(c, a, b) and (a, b) != blocked,
    )
    around, _ = best_climb(climb, factors)
    assert around < best
    wall, start, goal = wall_of(climb)
    found = search(wall, start, goal, blocked=frozenset([tuple(State(*each) for each in blocked)]))
    np.testing.assert_allclose(found.least, around, rtol=1e-7)
    assert found.bound >= best * (1.0 - 1e-9)
