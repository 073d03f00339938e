"""The program of multipliers: against linear programs in loads, whatever was asked before."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog

from planner.explanation.infeasibility import FarkasProgram
from planner.programs import LOAD_BOX

ROWS, LOADS = 9, 4


def rows_of(seed: int):
    """A balance of six and a given component, rows, and what both are to be."""
    draw = np.random.default_rng(seed)
    G, H = draw.normal(size=(7, LOADS)), draw.normal(size=(ROWS, LOADS))
    # few of the balance, so that there may be loads
    G[2:6] = 0.0
    goal = G @ draw.normal(size=LOADS) + np.append(draw.normal(size=2), np.zeros(5))
    return G, goal, H, draw.normal(size=ROWS)


def least_t(G, goal, H, h, tied, rows) -> float:
    """By how much rows must be broken at least: the same program, in loads."""
    G, goal, H, h = G[tied], goal[tied], H[rows], h[rows]
    A = np.column_stack([np.vstack([G, -G, H]), -np.ones(2 * len(G) + len(H))])
    result = linprog(
        np.append(np.zeros(LOADS), 1.0),
        A_ub=A,
        b_ub=np.concatenate([goal, -goal, h]),
        bounds=[(-LOAD_BOX, LOAD_BOX)] * LOADS + [(0.0, None)],
    )
    assert result.status == 0
    return float(result.fun)


@given(
    st.integers(0, 10**6),
    st.lists(st.lists(st.booleans(), min_size=7 + ROWS, max_size=7 + ROWS), min_size=1, max_size=4),
)
def test_the_gain_is_by_how_much_rows_must_be_broken(seed, chosen):
    """One question after the other, as if each were the first."""
    parts = G, goal, H, h = rows_of(seed)
    program = FarkasProgram(*parts)
    for each in np.array(chosen):
        tied, rows = each[:7], each[7:]
        found = program.least_violation(tied, rows)
        least = least_t(*parts, tied, rows)
        assert found.gain == pytest.approx(least, abs=1e-8)
        d, multipliers = found.direction, found.multipliers
        assert not d[~tied].any()
        assert not multipliers[~rows].any()
        assert multipliers.min() >= 0.0
        assert np.abs(d).sum() + multipliers.sum() <= 1.0 + 1e-9
        # the multipliers prove what they gain
        leak = np.abs(G.T @ d - H.T @ multipliers).sum()
        assert d @ goal - multipliers @ h - LOAD_BOX * leak == pytest.approx(least, abs=1e-6)


def test_near_a_start_turns_only_where_that_gains_more():
    """One load up to 1, of which (3, 1) is wanted: along the second axis nothing is to be had."""
    G = np.zeros((6, 1))
    G[0] = 1.0
    goal = np.array([3.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    program = FarkasProgram(G, goal, np.array([[1.0]]), np.array([1.0]))
    start = np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0])
    for turn, expected in ((9.0, start), (1.5, [1.0, 0.8, 0, 0, 0, 0]), (0.5, [1, 1, 0, 0, 0, 0])):
        found = program.near(start, turn, 1.0)
        np.testing.assert_allclose(found.direction, expected, atol=1e-9)
        # λ takes what d gives the load, which the box would pay for dearly
        np.testing.assert_allclose(found.multipliers, found.direction[:1], atol=1e-9)
        gain = found.direction @ goal - found.multipliers[0]
        assert found.gain == pytest.approx(gain - turn * np.abs(found.direction - start).sum())


def test_what_is_given_may_be_as_large_as_it_likes():
    """z = 2 is given and z ≤ 1: its d is no part of the start, nor bound by 1."""
    G = np.zeros((7, 1))
    G[0] = G[6] = 1.0
    goal = np.array([4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    program = FarkasProgram(G, goal, np.array([[0.1]]), np.array([9.0]))
    found = program.near(np.eye(6)[0], 9.0, 1.0)
    # d = (1, …, −1) has no leak: 1 · 4 − 1 · 2
    np.testing.assert_allclose(found.direction, [1.0, 0, 0, 0, 0, 0, -1.0], atol=1e-9)
    assert found.gain == pytest.approx(2.0)


def test_the_solver_is_silent_and_goes_with_its_program(capfd):
    gc.disable()
    try:
        program = FarkasProgram(*rows_of(1))
        program.least_violation(np.ones(7, dtype=bool), np.ones(ROWS, dtype=bool))
        solver = weakref.ref(program._solver)
        del program
        assert solver() is None
    finally:
        gc.enable()
    told = capfd.readouterr()
    assert told.out == told.err == ""


def test_a_bad_place_to_begin_is_left(monkeypatch):
    """Once the solver comes to no end, and is asked again from the beginning."""
    every = np.ones(7, dtype=bool), np.ones(ROWS, dtype=bool)
    program = FarkasProgram(*rows_of(2))
    expected, ends = program.least_violation(*every), [False]
    solve = type(program._solver).optimal
    monkeypatch.setattr(
        type(program._solver), "optimal", lambda solver: ends.pop() if ends else solve(solver)
    )
    assert program.least_violation(*every).gain == pytest.approx(expected.gain, rel=1e-9)
    ends.extend([False, False])
    assert program.least_violation(*every) is None
