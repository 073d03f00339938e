"""Climbs that are found: against exhaustion, and whatever way the wall is described."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from hand_models.base import InvalidInputError, turns_about
from planner import deadline
from planner.certification import check_bound
from planner.screening import ScreeningTable, StanceIndices, WorldHands, solve_stance
from planner.search import Ends, climb_certificate, search
from planner.search.programs import Programs
from tests.suite.helpers.exhaustion import all_factors, best_of_all
from tests.suite.helpers.walls import climbing_wall

SMALL = {"columns": 2, "rows": 5, "radius": 0.42}


@cache
def some_wall(seed, count, rows):
    wall, _ = climbing_wall(seed, count, **{**SMALL, "rows": rows})
    heights = np.array([body.position[2] for body in wall.bodies])
    start = Ends(bodies=heights < heights.min() + 0.01)
    return wall, start, Ends(bodies=heights > heights.max() - 0.01)


@cache
def solved(seed, count, rows):
    return all_factors(some_wall(seed, count, rows)[0])


def test_a_wall_that_no_three_hands_can_hold_has_no_climb():
    wall, start, goal = some_wall(3, 14, 5)
    wall = replace(wall, apart=np.zeros_like(wall.apart))
    found = search(wall, start, goal)
    assert found.finished
    assert found.states == ()
    assert found.bound == -np.inf
    assert check_bound(climb_certificate(wall, start, goal, found)).proven


def check_climb(wall, start, goal, found):
    """One move between two states, each within reach, from the start to the goal."""
    for state in found.states:
        on = [(p, limb) for limb, p in enumerate(state.members) if p >= 0]
        assert len(on) >= 3
        assert all(wall.reach.reached[p, state.body, limb] for p, limb in on)
        assert all(wall.apart[p, q] for p, _ in on for q, _ in on if p != q)
    shifts = {tuple(sorted(pair)) for pair in np.asarray(wall.shifts).tolist()}
    for a, b in pairwise(found.states):
        changed = [limb for limb in range(4) if a.members[limb] != b.members[limb]]
        if a.body != b.body:
            assert not changed
            assert -1 not in a.members
            assert tuple(sorted((a.body, b.body))) in shifts
        else:
            (limb,) = changed
            assert -1 in (a.members[limb], b.members[limb])
    assert start.bodies[found.states[0].body]
    assert goal.bodies[found.states[-1].body]
    assert -1 not in found.states[0].members + found.states[-1].members
    assert found.factors.min() == found.least


@pytest.mark.parametrize(
    ("seed", "count", "rows"),
    [
        (1, 15, 5),
        pytest.param(3, 14, 5, marks=pytest.mark.slow),
        pytest.param(2, 13, 5, marks=pytest.mark.slow),
        *(pytest.param(s, 21, 7, marks=pytest.mark.slow) for s in range(20)),
    ],
)
def test_the_best_of_all_climbs_is_found_and_proven(seed, count, rows):
    wall, start, goal = some_wall(seed, count, rows)
    factors = solved(seed, count, rows)
    best = best_of_all(wall, start, goal, factors)
    found = search(wall, start, goal)
    assert found.finished
    if best == -np.inf:
        assert found.states == ()
        assert found.least == found.bound == -np.inf
        return
    assert found.least == pytest.approx(best, rel=1e-9)
    assert found.bound == pytest.approx(best, rel=3e-9)
    assert found.gap < 3e-9
    check_climb(wall, start, goal, found)
    np.testing.assert_allclose(found.factors, [factors[each] for each in found.states], rtol=1e-9)
    # no state that holds enough was ruled out, and what was suffices
    held = [state for state, factor in factors.items() if factor >= found.proof.multiple]
    bodies, members = (np.array(column) for column in zip(*held, strict=True))
    table = replace(
        wall.screening,
        directions=found.proof.directions,
        supports=wall.screening.hands.supports(found.proof.directions),
    )
    assert (table.bounds(StanceIndices(bodies, members)) >= found.proof.multiple).all()
    assert check_bound(climb_certificate(wall, start, goal, found)).proven


def wall_with_a_climb():
    return (*some_wall(1, 15, 5), solved(1, 15, 5))


@cache
def found_on_it():
    return search(*some_wall(1, 15, 5))


def test_a_refused_move_gives_the_next_best_climb():
    wall, start, goal, factors = wall_with_a_climb()
    first = found_on_it()
    worst = int(np.argmin(first.factors))
    pair = first.states[worst - 1 : worst + 1]
    for blocked in ({tuple(pair)}, {(pair[1], pair[1])}):
        again = search(wall, start, goal, blocked=frozenset(blocked))
        expected = best_of_all(wall, start, goal, factors, blocked)
        assert again.least == pytest.approx(expected, rel=1e-9)
        assert again.least <= first.least * (1.0 + 1e-9)
        assert again.bound >= first.least
        assert not blocked & {*pairwise(again.states), *((s, s) for s in again.states)}
    # a whole move, lift and place
    lift = next(i for i, state in enumerate(first.states) if -1 in state.members)
    move = first.states[lift - 1], first.states[lift + 1]
    around = search(wall, start, goal, blocked=frozenset([move]))
    assert move not in set(zip(around.states[:-2], around.states[2:], strict=True))


@pytest.mark.slow
def test_a_given_start_and_an_early_end():
    wall, start, goal, factors = wall_with_a_climb()
    best = found_on_it()
    given = Ends(bodies=start.bodies, members=best.states[0].members)
    assert search(wall, given, goal).least == pytest.approx(best.least, rel=1e-9)
    back = search(wall, goal, given)
    assert back.least == pytest.approx(best.least, rel=1e-9)
    rough = search(wall, start, goal, within=0.3)
    assert rough.finished
    assert rough.least <= best.least <= rough.bound <= 1.3 * rough.least * 1.01
    enough = search(wall, start, goal, at_least=0.9 * best.least)
    assert enough.finished
    assert enough.least >= 0.9 * best.least
    none = search(wall, start, goal, at_least=1.1 * best.least)
    assert none.finished
    assert none.states == ()
    assert none.bound <= 1.1 * best.least * (1.0 + 1e-9)
    assert check_bound(climb_certificate(wall, start, goal, none)).proven
    unheld = min(factors, key=factors.__getitem__).members
    if -1 not in unheld:
        assert search(wall, Ends(bodies=start.bodies, members=unheld), goal).least <= best.least


def test_time_that_is_over_leaves_the_bound_open():
    wall, start, goal, _ = wall_with_a_climb()
    said = []
    nothing = search(wall, start, goal, seconds=0.0, progress=lambda *row: said.append(row))
    assert not nothing.finished
    assert nothing.states == ()
    assert nothing.bound == np.inf
    with deadline.within(0.0):
        assert not search(wall, start, goal).finished
    search(wall, start, goal, progress=lambda *row: said.append(row))
    phases, least, bound, programs = zip(*said, strict=True)
    assert "directions" in phases
    assert len(set(phases)) > 2
    assert list(least) == sorted(least)
    assert list(programs) == sorted(programs)
    assert all(a <= b for a, b in zip(least, bound, strict=True))
    for name, value in (("within", -0.1), ("at_least", np.inf), ("seconds", np.nan)):
        with pytest.raises(InvalidInputError) as caught:
            search(wall, start, goal, **{name: value})
        assert caught.value.field == name


def mapped(wall, M):
    """The wall with all wrenches mapped: by a motion of the world, or a mirror."""
    table = wall.screening
    hands = replace(table.hands, points=table.hands.points @ M.T, base=table.hands.base @ M.T)
    return replace(
        wall,
        screening=ScreeningTable.of(hands, table.wrenches @ M.T, table.moments @ M[3:, 3:].T),
    )


@pytest.mark.parametrize("kind", ["moved", "mirrored"])
def test_a_wall_that_is_moved_or_mirrored_has_the_same_climbs(kind):
    wall, start, goal, _ = wall_with_a_climb()
    if kind == "moved":
        turn, (x, y, z) = turns_about(np.array([0.4, -0.8, 1.1])), (0.3, -0.2, 0.5)
        M = np.kron(np.eye(2), turn)
        M[3:, :3] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ turn
    else:
        M = np.diag([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    expected, found = found_on_it(), search(mapped(wall, M), start, goal)
    assert found.least == pytest.approx(expected.least, rel=1e-9)
    assert found.bound == pytest.approx(expected.bound, rel=1e-9)


def test_the_order_of_placements_and_bodies_does_not_matter():
    wall, start, goal, _ = wall_with_a_climb()
    rng, hands, table = np.random.default_rng(0), wall.screening.hands, wall.screening
    order, bodies = rng.permutation(len(hands)), rng.permutation(len(wall.bodies))
    slices = [hands.part_of(p)[0] for p in order]
    sizes = np.concatenate(
        [np.diff(hands.parts)[hands.hands[p] : hands.hands[p + 1]] for p in order]
    )
    shuffled = WorldHands(
        points=np.concatenate([hands.points[each] for each in slices]),
        rows=np.concatenate([hands.rows[each] for each in slices]),
        parts=np.cumsum([0, *sizes]),
        hands=np.cumsum([0, *np.diff(hands.hands)[order]]),
        base=hands.base[order],
        room=hands.room[order],
        about=hands.about,
    )
    again = replace(
        wall,
        bodies=tuple(wall.bodies[i] for i in bodies),
        shifts=np.argsort(bodies)[wall.shifts],
        reach=replace(wall.reach, entry=wall.reach.entry[order][:, bodies]),
        screening=ScreeningTable.of(
            shuffled, table.wrenches[bodies], table.moments[bodies][:, :, order]
        ),
        apart=wall.apart[np.ix_(order, order)],
    )
    expected = found_on_it()
    found = search(again, Ends(bodies=start.bodies[bodies]), Ends(bodies=goal.bodies[bodies]))
    assert found.least == pytest.approx(expected.least, rel=1e-9)
    assert found.bound == pytest.approx(expected.bound, rel=1e-9)


def test_compiled_programs_are_those_of_the_definition():
    """Load factors, and the directions that prove them, against another solver."""
    wall, _, _, factors = wall_with_a_climb()
    states = list(factors)[:: max(1, len(factors) // 300)]
    bodies, members = (np.array(column) for column in zip(*states, strict=True))
    found = Programs(wall.screening).solve(bodies, members)
    expected = np.array([factors[state] for state in states])
    np.testing.assert_allclose(found.factors, expected, rtol=1e-9)
    needed = wall.screening.needed(StanceIndices(bodies, members))
    for row, factor, direction, held, wrench in zip(
        members, found.factors, found.directions, found.held, needed, strict=True
    ):
        total = wall.screening.hands.supports(direction[None])[row[row >= 0]].sum()
        assert total == pytest.approx(held, rel=1e-6, abs=1e-9)
        assert direction @ wrench >= -1e-12
        if np.isfinite(factor):
            assert held / (direction @ wrench) == pytest.approx(factor, rel=1e-9)
        else:
            assert held < 0.0
    # a method that does not end is no answer: the other solver steps in
    few = Programs(wall.screening)
    row = members[0][members[0] >= 0]
    assert few.stance(states[0]) == pytest.approx(
        solve_stance(wall.screening.hands, row, needed[0]).factor, rel=1e-9
    )
