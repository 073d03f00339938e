"""Irreducible sets of constraints: all of them together leave no loads, any fewer do."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy.optimize import linprog, nnls

from planner.explanation.infeasibility import HELD_WRENCH, HardRowSystem
from planner.explanation.irreducible_infeasible_set import (
    blocks_up_to,
    irreducible_set,
    sufficient_alone,
)
from planner.programs import LOAD_BOX
from planner.result import LimitName
from planner.solving import plan
from tests.suite.helpers.named_rows import have_loads, named_rows
from tests.suite.helpers.random_questions import explained, few_and_all
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.stances import random_question

LIMB = "front_left"


def named(*names: str) -> tuple[LimitName, ...]:
    return tuple(LimitName(LIMB, None, None, name) for name in names)


def changed(parts: HardRowSystem, **new) -> HardRowSystem:
    """The same system but for some of what it is made of."""
    names = ("G", "g", "wrench", "H", "h", "names", "given")
    return HardRowSystem(**{name: getattr(parts, name) for name in names} | new)


def system(rows, bounds, names, *, goal=0.0, given=(), values=()) -> HardRowSystem:
    """Loads z whose sum is the body's fx, with rows · z ≤ bounds, and given · z = values."""
    rows = np.array(rows, dtype=float)
    size = rows.shape[1]
    G = np.zeros((6 + len(given), size))
    G[0] = 1.0
    G[6:] = np.array(given, dtype=float).reshape(len(given), size)
    return HardRowSystem(
        G=G,
        g=np.zeros(len(G)),
        wrench=np.array([goal, *np.zeros(5), *values], dtype=float),
        H=rows,
        h=np.array(bounds, dtype=float),
        names=named(*names),
        given=(LimitName(LIMB, None, None, HELD_WRENCH),) * len(given),
    )


def test_of_four_rows_the_two_that_keep_a_sum_small_are_found():
    """z1 ≤ 1 and z2 ≤ 1 keep z1 + z2 from 3; z1 ≤ 5 and z1 ≥ 0 do not."""
    found = irreducible_set(
        parts := system(
            [[1, 0], [0, 1], [1, 0], [-1, 0]], [1, 1, 5, 0], ("a", "b", "far", "other"), goal=3.0
        ),
        parts.constraints,
    )
    assert set(found) == set(named("a", "b"))


def test_rows_of_one_name_are_one_barrier():
    """The two rows named a contradict each other; b, which the first contradicts, is not needed."""
    parts = system([[1], [-1], [-1]], [-1, -1, 0], ("a", "a", "b"))
    assert irreducible_set(parts, parts.constraints) == named("a")


def test_a_given_load_is_a_barrier():
    """z1 = 2 is given, z2 ≤ 0, and z1 + z2 is to be 3."""
    parts = system([[0, 1], [1, 0]], [0, 9], ("low", "far"), goal=3.0, given=[[1, 0]], values=[2.0])
    assert set(irreducible_set(parts, parts.constraints)) == set(named("low", HELD_WRENCH))


def test_a_balance_that_no_loads_give_needs_no_barrier():
    parts = system([[1]], [1], ("a",))
    parts = changed(parts, wrench=parts.wrench + np.eye(6)[3])
    assert irreducible_set(parts, parts.constraints) == ()


def test_rows_that_say_nothing_of_each_other_contradict_only_the_box(monkeypatch):
    """z1 + z2 is to be half as much again as the box allows, with z2 ≤ 0; five other loads are 0.

    Of SciPy's nnls, some versions of which write beyond their memory then, nothing is asked.
    """

    def with_equations(A, b):
        assert A.size
        return nnls(A, b)

    monkeypatch.setattr("scipy.optimize.nnls", with_equations)
    parts = system([[0, 1, 0, 0, 0, 0, 0]], [0], ("low",), goal=1.5 * LOAD_BOX)
    G = np.delete(np.eye(7), 1, axis=0)
    G[0, 1] = 1.0
    parts = changed(parts, G=G)
    assert np.linalg.matrix_rank(np.vstack([parts.G, parts.H])) == 7
    assert irreducible_set(parts, parts.constraints) == named("low")


def test_where_there_are_loads_there_is_no_set():
    parts = system([[1, 0], [0, 1]], [2, 2], ("a", "b"), goal=3.0)
    assert irreducible_set(parts, parts.constraints) is None


def test_what_is_weightier_comes_first():
    """10 z1 ≤ 1 weighs a tenth of z2 ≤ 1 in the proof that z1 + z2 < 3."""
    parts = system([[10, 0], [0, 1]], [1, 1], ("slight", "weighty"), goal=3.0)
    assert irreducible_set(parts, parts.constraints) == named("weighty", "slight")


def test_without_one_of_two_that_nothing_else_repeats_there_are_loads():
    """z1 + z2 = 3 with z1 ≤ 1, z2 ≤ 1 and −9 ≤ z1: either upper bound alone is in the way."""
    parts = system([[1, 0], [0, 1], [-1, 0]], [1, 1, 9], ("a", "b", "far"), goal=3.0)
    assert set(sufficient_alone(parts, named("a", "b"))) == set(named("a", "b"))


def test_one_that_another_repeats_does_not_do():
    """z1 ≤ 1 is there twice, as a and as again: only leaving out b leaves loads."""
    parts = system([[1, 0], [0, 1], [1, 0]], [1, 1, 1.5], ("a", "b", "again"), goal=3.0)
    assert sufficient_alone(parts, named("a", "b")) == named("b")


def test_where_two_sets_have_nothing_in_common_no_single_one_does():
    """z1 = 0 and z2 = 0 are each asked for beyond a bound: z1 ≤ −1, −z1 ≤ −1, the same of z2."""
    rows = [[1, 0], [-1, 0], [0, 1], [0, -1]]
    parts = system(rows, [-1, -1, -1, -1], ("a", "b", "c", "d"))
    assert sufficient_alone(parts, irreducible_set(parts, parts.constraints)) == ()


def test_of_no_set_and_of_a_large_one_nothing_is_said():
    """Thirty loads up to 1 do not add up to 31."""
    names = tuple(f"row {i}" for i in range(30))
    parts = system(np.eye(30), np.ones(30), names, goal=31.0)
    found = irreducible_set(parts, parts.constraints)
    assert set(found) == set(parts.constraints)
    assert sufficient_alone(parts, found) is None
    assert sufficient_alone(parts, None) is None


def has_loads(parts: HardRowSystem, names) -> bool:
    kept = np.array([name in names for name in parts.names], dtype=bool)
    tied = np.array([True] * 6 + [name in names for name in parts.given])
    result = linprog(
        np.zeros(parts.H.shape[1]),
        A_ub=parts.H[kept],
        b_ub=parts.h[kept],
        A_eq=parts.G[tied],
        b_eq=parts.wrench[tied],
        bounds=(-LOAD_BOX, LOAD_BOX),
    )
    return result.status == 0


whole = st.integers(-3, 3)


@given_some(8, 60, st.data())
def test_every_smaller_set_of_small_systems_has_loads(data):
    """Against a look at every subset."""
    size = data.draw(st.integers(1, 3))
    count = data.draw(st.integers(1, 6))
    row = st.lists(whole, min_size=size, max_size=size)
    rows = data.draw(st.lists(row, min_size=count, max_size=count))
    bounds = data.draw(st.lists(whole, min_size=count, max_size=count))
    names = data.draw(st.lists(st.sampled_from("abcd"), min_size=count, max_size=count))
    tied = data.draw(st.booleans())
    parts = system(
        rows,
        bounds,
        names,
        goal=float(data.draw(whole)),
        given=[rows[0]] if tied else (),
        values=[float(data.draw(whole))] if tied else (),
    )
    found = irreducible_set(parts, parts.constraints)
    if has_loads(parts, parts.constraints):
        assert found is None
        return
    assert found is not None
    assert not has_loads(parts, found)
    for fewer in range(len(found)):
        assert all(has_loads(parts, subset) for subset in combinations(found, fewer))
    alone = {
        name
        for name in parts.constraints
        if has_loads(parts, [other for other in parts.constraints if other != name])
    }
    assert set(sufficient_alone(parts, found)) == alone


def proofs(status, seeds):
    """Of random stances: label, certificate, and rows by their names."""
    for label, question, answer in explained(status, seeds):
        proof = answer.certificate
        assert proof is not None, label
        assert proof.irreducible is not None, label
        yield label, proof, named_rows(question, proof.utilisation)


@pytest.mark.parametrize("status", ["infeasible", "overloaded"])
@few_and_all
def test_random_stances_lack_loads_with_their_set_and_have_some_without_any_one_of_it(
    status, seeds
):
    sizes = []
    for label, proof, parts in proofs(status, seeds):
        assert set(proof.irreducible) <= parts.constraints, label
        assert not have_loads(parts, proof.irreducible), label
        for name in proof.irreducible:
            others = [other for other in proof.irreducible if other != name]
            assert have_loads(parts, others), f"{label}: {name} is not needed"
        sizes.append(len(proof.irreducible))
    assert max(sizes) > 3


def test_what_programs_leave_undecided_is_guessed_at():
    for seed in [7028, 7103]:
        asked = random_question(seed, "load_factor")
        question = replace(asked, body_wrench=2.0 * plan(asked).load_factor * asked.needed_wrench())
        found = plan(question).certificate.irreducible
        assert found
        parts = named_rows(question, 1.0)
        assert not have_loads(parts, found)
        for name in found:
            assert have_loads(parts, [other for other in found if other != name]), name


@pytest.mark.parametrize("status", ["infeasible", "overloaded"])
@few_and_all
def test_of_random_stances_those_are_told_that_would_do_alone(status, seeds):
    """Of the other constraints that the proof weighs none does, either."""
    told = []
    for label, proof, parts in proofs(status, seeds):
        if proof.sufficient is None:
            assert len(proof.irreducible) > 16, label
            continue
        told.append(proof.sufficient)
        alone = {
            name
            for name in {*proof.irreducible, *proof.blocking}
            if have_loads(parts, parts.constraints - {name})
        }
        assert set(proof.sufficient) == alone, label
    assert told
    assert not all(told)


# How far a set blocks ---------------------------------------------------------------------------


def test_rows_that_are_all_but_parallel_block_up_to_the_loads_where_they_meet():
    """z₁ + z₂ = 1 with z₂ ≤ 0 and z₁ + (1 − 1/size) z₂ ≤ 0 has loads from z₁ = size on."""
    for size in [1.5e4, 2e4, 4e4, 1e5, 3e5]:
        slope = 1.0 - 1.0 / size
        parts = system(
            [[0.0, 1.0], [-1.0, -slope], [1.0, slope]],
            [2e9, 0.0, 0.0],
            ["far", "low", "high"],
            goal=1.0,
        )
        names = irreducible_set(parts, parts.constraints)
        assert names is not None
        found = blocks_up_to(parts, names)
        assert LOAD_BOX <= found <= size * (1.0 + 1e-6)
        assert not loads_within(parts, names, 0.999 * found)
        assert loads_within(parts, names, 1.01 * size)


def test_rows_that_contradict_each_other_block_whatever_the_loads():
    parts = system([[1.0], [-1.0]], [1.0, -2.0], ["most", "least"], goal=1.5)
    names = irreducible_set(parts, parts.constraints)
    assert names is not None
    assert blocks_up_to(parts, names) > 1e3 * LOAD_BOX


def loads_within(parts: HardRowSystem, names, most: float) -> bool:
    """Whether constraints have loads up to a size, as HiGHS says."""
    tied, rows = parts.rows_of(names)
    found = linprog(
        np.zeros(parts.G.shape[1]),
        A_ub=parts.H[rows] if rows.any() else None,
        b_ub=parts.h[rows] / most if rows.any() else None,
        A_eq=parts.G[tied],
        b_eq=parts.goal[tied] / most,
        bounds=(-1.0, 1.0),
        options={"primal_feasibility_tolerance": 1e-10, "presolve": False},
    )
    assert found.status in (0, 2)
    return found.status == 0


@pytest.mark.parametrize("status", ["infeasible", "overloaded"])
@few_and_all
def test_certificates_say_up_to_which_loads_their_set_blocks(status, seeds):
    """Beyond the box in which it was found, HiGHS finds none up to there, either."""
    for label, proof, parts in proofs(status, seeds):
        up_to = proof.irreducible_up_to
        assert up_to is None or up_to >= 1e6, label
        most = min(up_to or np.inf, 1e8)
        rows = [name in proof.irreducible for name in parts.names]
        tied = [name in proof.irreducible for name in parts.owners]
        scale = 1e3
        found = linprog(
            np.zeros(parts.A.shape[1]),
            A_ub=scale * parts.A[rows] / np.abs(parts.A[rows]).max(axis=1, initial=1.0)[:, None],
            b_ub=parts.b[rows] / np.abs(parts.A[rows]).max(axis=1, initial=1.0),
            A_eq=scale * np.vstack([parts.B, parts.E[tied]]),
            b_eq=np.concatenate([parts.wrench - parts.o, parts.e[tied]]),
            bounds=(-0.99 * most / scale, 0.99 * most / scale),
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        assert found.status == 2, f"{label}: {found.message}"
