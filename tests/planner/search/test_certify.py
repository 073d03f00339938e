"""Certificates of searches: the check accepts what a search has proven, and no more."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError
from planner.certification import check_bound, check_route
from planner.search import climb_certificate, search
from planner.search.searching import _Search, _TimeOverError
from tests.suite.helpers.certificates import (
    best_climb,
    every_state,
    random_climb,
    solved_state,
    wall_of,
)


def certified(climb):
    wall, start, goal = wall_of(climb)
    return climb_certificate(wall, start, goal, search(wall, start, goal))


def best_of(climb):
    factors = {state: solved_state(climb, state)[0] for state in every_state(climb)}
    return best_climb(climb, factors)


@pytest.mark.parametrize(
    ("seed", "sizes"),
    [
        (34, {"placements": 5, "bodies": 3, "reach": 0.6}),
        pytest.param(4, {"placements": 5, "bodies": 3, "reach": 0.7}, marks=pytest.mark.slow),
    ],
)
def test_of_a_climb_and_its_bound_is_accepted(seed, sizes):
    climb = random_climb(seed, **sizes)
    best, route = best_of(climb)
    assert any(-1 in members for _, members in route)
    found = certified(climb)
    checked = check_route(found)
    assert checked.fault is None
    assert checked.least == pytest.approx(best, rel=1e-7)
    assert best < found.multiple <= best * (1.0 + 1e-7)
    assert check_bound(found).proven
    assert check_bound(replace(found, backward=not found.backward)).proven
    # what is not true is not accepted
    assert not check_bound(replace(found, multiple=best * (1.0 - 1e-9))).proven
    assert len(found.own_members)
    none = {"own_members": found.own_members[:0], "own_directions": found.own_directions[:0]}
    assert not check_bound(replace(found, directions=found.directions[:1], **none)).proven


def test_that_there_is_no_climb_is_accepted():
    climb = random_climb(9, placements=5, bodies=3, reach=0.7)
    assert best_of(climb)[1] == []
    found = certified(climb)
    assert not len(found.route_bodies)
    assert check_bound(found).proven
    # all hands stronger, and all placements within reach: there is one
    stronger = climb.base + np.array([0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    wider = {"base": stronger, "reached": np.ones_like(climb.reached)}
    assert not check_bound(replace(found, **wider)).proven


def broken_off_at(monkeypatch, wall, start, goal, phase):
    """Search until a phase begins, as if time were over then."""
    with monkeypatch.context() as patch:
        report = _Search._report

        def late(self, said):
            if said.startswith(phase):
                raise _TimeOverError
            report(self, said)

        patch.setattr(_Search, "_report", late)
        return search(wall, start, goal)


def test_the_bound_of_a_search_that_has_decided_nothing_yet_is_accepted(monkeypatch):
    climb = random_climb(34, placements=5, bodies=3, reach=0.6)
    wall, start, goal = wall_of(climb)
    found = broken_off_at(monkeypatch, wall, start, goal, "lifts")
    certificate = climb_certificate(wall, start, goal, found)
    assert found.states == ()
    assert best_of(climb)[0] < found.bound < np.inf
    assert certificate.multiple == found.bound
    assert check_bound(certificate).proven
    # all three hands together hold so much in no direction
    assert not check_bound(replace(certificate, multiple=0.1 * found.bound)).proven


def test_a_search_without_a_proof_has_none():
    wall, start, goal = wall_of(random_climb(34, placements=5, bodies=3, reach=0.6))
    found = search(wall, start, goal, seconds=0.0)
    assert found.proof is None
    with pytest.raises(InvalidInputError, match=r"found\.proof: the search has no proof"):
        climb_certificate(wall, start, goal, found)
