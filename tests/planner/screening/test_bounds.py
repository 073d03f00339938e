"""Bounds of load factors: never below the load factor, equal to it where directions are learnt."""

from itertools import combinations, product

import numpy as np
import pytest

from hand_models.base import LimitError, Pose, turns_about, wrench_transport
from planner.programs import HandData, StanceData, load_factor
from planner.programs.program import Reach
from planner.screening import (
    HandParts,
    ScreeningTable,
    StanceIndices,
    WorldHands,
    learn,
    solve_stance,
)
from tests.suite.helpers.walls import random_wall

COMS = np.array([[-0.35, 0.0, 0.0], [-0.35, 0.2, 0.1]])


def some_triples(count, bodies=2):
    chosen = np.array(list(combinations(range(count), 3)))
    every = np.tile(chosen, (bodies, 1))
    return StanceIndices(np.repeat(np.arange(bodies), len(chosen)), every)


def tabled(wall, bodies=COMS, moments=None):
    wrenches = np.array([wall.wrench(com) for com in bodies])
    return ScreeningTable.of(wall.hands, wrenches, moments)


def exact(wall, table, stances):
    """Load factors of stances by another solver, −∞ where there is none."""
    found = [
        wall.load_factor(row[row >= 0], wrench)
        for row, wrench in zip(stances.members, table.needed(stances), strict=True)
    ]
    return np.array([-np.inf if each is None else each for each in found])


@pytest.mark.parametrize(
    ("seed", "lean", "count"),
    [(0, 0.7, 7), *(pytest.param(s, 0.2 * s, 10, marks=pytest.mark.slow) for s in range(1, 6))],
)
def test_never_rule_out_what_is_held(seed, lean, count):
    wall, stances = random_wall(seed, count, lean), some_triples(count)
    first = tabled(wall)
    factors = exact(wall, first, stances)
    slack = 1e-6 * (1.0 + np.abs(factors))
    assert (first.bounds(stances) >= factors - np.where(np.isfinite(slack), slack, 0.0)).all()
    learnt = learn(first, stances, count=3)
    held = np.isfinite(factors)
    assert (learnt.bounds[held] >= (factors - slack)[held]).all()
    # the three best are found and proven
    known = np.sort(learnt.factors[np.isfinite(learnt.factors)])[::-1][:3]
    np.testing.assert_allclose(known, np.sort(factors)[::-1][:3], rtol=1e-6)
    assert learnt.best == pytest.approx(factors.max(), rel=1e-6)
    assert (learnt.bounds[np.isnan(learnt.factors)] <= known[-1] * (1.0 + 1e-5)).all()
    assert learnt.solved < len(factors) / 2


def test_are_exact_once_all_programs_are_solved():
    wall, stances = random_wall(11, 6, 0.0), some_triples(6)
    table = tabled(wall)
    factors = exact(wall, table, stances)
    learnt = learn(table, stances, count=len(factors))
    np.testing.assert_allclose(learnt.bounds, factors, rtol=1e-6)
    assert np.isneginf(factors).any()


def test_of_a_stance_are_those_of_the_planners_program():
    wall = random_wall(6, 6)
    hands, wrench = wall.hands, wall.wrench(COMS[0])
    for members in (np.array([0, 1, 2]), np.array([1, 3, 4, 5])):
        data = StanceData.of(
            tuple(HandData.of(wall.spaces[p], wrench_transport(wall.poses[p])) for p in members),
            wrench,
        )
        program, found = Reach.load_factor(data), solve_stance(hands, members, wrench)
        definition = program.define().problem
        definition.solve(solver="CLARABEL")
        assert found.factor == pytest.approx(definition.value / program.unit, rel=1e-6)
        assert found.factor == pytest.approx(load_factor(data).value, rel=1e-6)
        # the direction proves it
        total = hands.supports(found.direction[None])[members].sum()
        assert total / (found.direction @ wrench) == pytest.approx(found.factor, rel=1e-6)


def test_of_what_nothing_holds_prove_so():
    """Where there is no load factor, one direction rules out every multiple."""
    wall, stances = random_wall(11, 6, 0.0), some_triples(6, 1)
    hands, wrench = wall.hands, wall.wrench(COMS[0])
    factors = exact(wall, tabled(wall), stances)
    none = np.flatnonzero(np.isneginf(factors))
    assert len(none)
    for members in stances.members[none]:
        found = solve_stance(hands, members, wrench)
        total = hands.supports(found.direction[None])[members].sum()
        assert np.isnan(found.factor)
        for factor in (0.0, 0.5, 1.0, 10.0):
            assert total < factor * (found.direction @ wrench)


def test_take_the_moments_of_limbs_into_account():
    """A limb's moment counts as if the body wrench had it."""
    wall, rng = random_wall(2, 6), np.random.default_rng(8)
    moments = rng.normal(size=(2, 3, 6, 3))
    stances = some_triples(6)
    table = learn(tabled(wall, moments=moments), stances, count=5).table
    wrenches = table.needed(stances)
    np.testing.assert_allclose(
        wrenches[0, 3:], wall.wrench(COMS[0])[3:] + sum(moments[0, [0, 1, 2], [0, 1, 2]])
    )
    each = ScreeningTable(
        table.hands, wrenches, np.zeros((0, 0, 0, 0)), table.directions, table.supports
    )
    alone = StanceIndices(np.arange(len(wrenches)), stances.members)
    np.testing.assert_allclose(table.bounds(stances), each.bounds(alone), rtol=1e-12)
    factors = exact(wall, table, stances)
    assert (table.bounds(stances) >= factors - 1e-6).all()


@pytest.mark.parametrize("factor", [0.3, 0.8, 1.2])
def test_choices_that_pass_are_those_that_no_direction_rules_out(factor):
    wall, rng = random_wall(4, 14), np.random.default_rng(5)
    moments = 0.3 * rng.normal(size=(2, 4, 14, 3))
    candidates = [
        np.array([0, 1, 2, 3]),
        np.array([4, 5, 6]),
        np.array([7, 8, 9]),
        np.arange(10, 14),
    ]
    every = np.array(list(product(*candidates)))
    stances = StanceIndices(np.ones(len(every), dtype=int), every)
    table = learn(tabled(wall, moments=moments), stances, count=20).table.reordered(stances, factor)
    needs, held = table.needed(stances) @ table.directions.T, table.supports[every].sum(axis=1)
    # no load factor is larger than this one, of the most that is held and the least that is needed
    most = sum(table.supports[each].max(axis=0) for each in candidates)
    least = table.directions @ table.wrenches[1] + sum(
        (moments[1, limb, each] @ table.directions[:, 3:].T).min(axis=0)
        for limb, each in enumerate(candidates)
    )
    end = (most[least > 0.0] / least[least > 0.0]).min()
    ruled = (held < factor * (1.0 - 1e-6) * needs) & (held < end * (1.0 + 1e-6) * needs)
    passing = every[~ruled.any(axis=1)]
    bounds = table.bounds(stances)
    assert {tuple(row) for row in every[bounds >= factor]} <= {tuple(row) for row in passing}
    found = table.passing(1, candidates, factor)
    assert {tuple(row) for row in found} == {tuple(row) for row in passing}
    assert len(found) == len(passing)
    if len(passing) > 1:
        with pytest.raises(LimitError, match="learn more"):
            table.passing(1, candidates, factor, most=len(passing) - 1)
    assert len(table.passing(1, [candidates[0], candidates[1][:0]], factor)) == 0


def test_choices_that_hold_larger_multiples_only_pass():
    """Closed hands press on their rock: these hold 0.016 to 0.496 times the body wrench."""
    wall, members = random_wall(5, 8, 0.8), np.array([4, 5, 6])
    wrench = wall.wrench(COMS[0])
    held, against = (solve_stance(wall.hands, members, each) for each in (wrench, -wrench))
    table = ScreeningTable.of(wall.hands, wrench[None]).extended(
        np.array([held.direction, against.direction])
    )
    low, high = table.ends(StanceIndices(np.zeros(1, dtype=int), members[None]))[0]
    assert 0.0 < low < high == pytest.approx(held.factor, rel=1e-6)
    candidates = list(members[:, None])
    for factor in (0.0, 0.5 * low, 0.99 * high):
        assert len(table.passing(0, candidates, factor)) == 1
    assert len(table.passing(0, candidates, 1.01 * high)) == 0


def test_do_not_depend_on_the_order_of_directions_or_stances():
    wall, stances = random_wall(9, 7), some_triples(7)
    table = learn(tabled(wall), stances, count=4).table
    order = np.random.default_rng(0).permutation(len(stances.bodies))
    expected = table.bounds(stances)
    np.testing.assert_allclose(table.bounds(stances.of(order)), expected[order])
    np.testing.assert_allclose(table.reordered(stances, 1.0).bounds(stances), expected)
    # a floor leaves those above it as they are
    floor = float(np.median(expected[np.isfinite(expected)]))
    with_floor = table.bounds(stances, floor)
    np.testing.assert_array_equal(with_floor[expected >= floor], expected[expected >= floor])
    assert (with_floor[expected < floor] < floor).all()


def test_do_not_change_if_the_world_is_moved():
    wall, stances = random_wall(10, 6), some_triples(6)
    table = learn(tabled(wall), stances, count=3).table
    turn = turns_about(np.array([0.4, -0.8, 1.1]))
    moved = Pose(np.array([3.0, -1.0, 2.0]), turn)
    parts = [HandParts.of(space) for space in wall.spaces]
    hands = WorldHands.of(parts, [moved @ pose for pose in wall.poses], moved.position)
    both = np.kron(np.eye(2), turn)
    again = ScreeningTable.of(hands, table.wrenches @ both.T).extended(table.directions @ both.T)
    again = again.latest(len(table.directions))
    np.testing.assert_allclose(again.supports, table.supports, atol=1e-9)
    np.testing.assert_allclose(again.bounds(stances), table.bounds(stances), rtol=1e-9)


def test_with_few_directions_are_looser_but_valid():
    wall, stances = random_wall(12, 7), some_triples(7)
    whole = learn(tabled(wall), stances, count=20)
    few = learn(tabled(wall), stances, count=20, directions=14)
    assert len(few.table.directions) == 14 < len(whole.table.directions)
    assert few.best == pytest.approx(whole.best, rel=1e-6)
    # bounds of the stances themselves keep what dropped directions have shown
    loose = few.table.bounds(stances)
    assert (loose >= few.bounds - 1e-9).all()
    assert (loose > few.bounds + 1e-3).any()
    solved = np.isfinite(whole.factors)
    assert (loose[solved] >= whole.factors[solved] - 1e-6).all()
