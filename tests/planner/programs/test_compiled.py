"""Compiled programs: CVXPY's own data to the last bit, whatever came before, from every thread."""

import os
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import product

import clarabel
import cvxpy as cp
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, strategies as st

from planner import deadline
from planner.programs import compiled, cvxpy_internals, program, solvers, stance_data
from planner.programs.stance_data import Shape
from planner.programs.stance_program import SETTINGS, StanceProgram
from planner.question import Load
from planner.solving import plan
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.stances import PLACES, ask, on_wall, program_data

FIXED = (10, 95, 20, 4)
WITH_JOINTS = (10, 109, 20, 11)
FLOATING = (6, 137, 62, 4)
CLINGING = (8, 24, 28, 4)
BARE = (4, 12, 4, 4)
HANDS = (FIXED, WITH_JOINTS, FLOATING, CLINGING, BARE)

SHAPES = [
    Shape(6, (FIXED,)),
    Shape(6, (FIXED,) * 4),
    Shape(6, (WITH_JOINTS,) * 4),
    Shape(9, (WITH_JOINTS, FLOATING, CLINGING, BARE)),
    Shape(6, (FLOATING, FLOATING)),
    *(Shape(6 + count % 3, tuple(HANDS[i % 5] for i in range(count))) for count in (3, 8)),
]

SIXTEEN = Shape(7, tuple(HANDS[i % 5] for i in range(16)))
"""Of as many hands as there may be."""

KINDS = {
    "Unique": program.Unique,
    "Margin": program.Margin,
    "Curved": program.Curved,
    "TieBreak": program.TieBreak,
    "Effort": program.Effort,
    "LoadFactor": program.LoadFactor,
    "Reach": lambda shape: program.Reach(shape, 3),
    "Nearest": program.Nearest,
    "Nearest, two kept": lambda shape: program.Nearest(shape, shape.balance - 6),
}


def random_values(parameters, rng):
    """Values of every parameter, about half of them zero."""
    for parameter in parameters:
        value = rng.normal(size=parameter.shape) * rng.integers(0, 2, parameter.shape)
        yield np.abs(value) if parameter.is_nonneg() else value


def cvxpy_data(problem, parameters, values):
    for parameter, value in zip(parameters, values, strict=True):
        parameter.value = value
    data, _, _ = problem.get_problem_data(cp.CLARABEL, enforce_dpp=True, solver_opts={})
    A, n = sp.csc_array(data["A"]), len(data["c"])
    A.eliminate_zeros()
    P = sp.csc_array(sp.triu(data.get("P", sp.csc_array((n, n)))))
    return P, data["c"], A, data["b"]


def is_the_same(ours, theirs):
    ours, theirs = sp.csc_array(ours), sp.csc_array(theirs)
    ours.sort_indices()
    theirs.sort_indices()
    return all(
        np.array_equal(getattr(ours, name), getattr(theirs, name))
        for name in ("indptr", "indices", "data")
    )


def test_every_program_is_compared():
    kinds = {kind for kind in vars(program).values() if isinstance(kind, type)}
    programs = {kind for kind in kinds if issubclass(kind, StanceProgram)} - {StanceProgram}
    assert {kind.__name__ for kind in programs} == {name.partition(",")[0] for name in KINDS}


@pytest.mark.parametrize(
    "shapes", [SHAPES, pytest.param([SIXTEEN], marks=pytest.mark.slow)], ids=["few", "sixteen"]
)
@pytest.mark.parametrize("kind", KINDS)
def test_the_solver_has_the_data_of_cvxpy_to_the_last_bit(kind, shapes):
    rng = np.random.default_rng(3)
    for shape in shapes:
        built = KINDS[kind](shape)
        parameters = built.compiled.parameters
        # what serves it: a program with room for more
        serving = KINDS[kind](shape.with_room()).compiled
        first = list(random_values(parameters, rng))
        # the same pattern with other numbers, and half of the arrays the same: an update
        second = [value if i % 2 else 1.5 * value for i, value in enumerate(first)]
        third = [np.zeros(p.shape) for p in parameters]
        for values in (first, second, third, first):
            solver = serving.ready(values, built.extent(shape), SETTINGS)
            P, q, A, b = solver.data()
            P_cvxpy, q_cvxpy, A_cvxpy, b_cvxpy = cvxpy_data(built.problem, parameters, values)
            assert is_the_same(A, A_cvxpy)
            assert is_the_same(P, P_cvxpy)
            np.testing.assert_array_equal(q, q_cvxpy)
            np.testing.assert_array_equal(b, b_cvxpy)
            assert [(type(c), c.dim) for c in solver.layout.cones] == [
                (type(c), c.dim) for c in built.compiled.map.cones
            ]
            serving.put_back(solver)
        assert len(serving.idle) == 2


@pytest.fixture(scope="module")
def data():
    return program_data(ask(on_wall()))


def test_an_answer_does_not_depend_on_the_questions_before(data):
    other = program_data(ask(on_wall(overhang=0.2, off=0.25)))
    fresh = program.Unique(data.shape).solve(data)
    built = program.Unique(data.shape)
    for before in (other, data, other.turned(1.2 * other.wrench), data.turned(other.wrench)):
        built.solve(before)
    again = built.solve(data)
    assert again.value == fresh.value
    for one, two in zip(again.loads, fresh.loads, strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_new_wrench_refreshes_nothing_but_the_right_side(data, monkeypatch):
    given = []

    class Spy:
        def __init__(self, *problem, original=clarabel.DefaultSolver):
            self.solver = original(*problem)

        def update(self, **blocks):
            given.append(set(blocks))
            self.solver.update(**blocks)

        def solve(self):
            return self.solver.solve()

    built = program.Unique(data.shape)
    with monkeypatch.context() as patch:
        patch.setattr(clarabel, "DefaultSolver", Spy)
        built.solve(data)
    assert given == []
    turned = built.solve(data.turned(1.1 * data.wrench))
    assert given == [{"b"}]
    assert turned.value == program.Unique(data.shape).solve(data.turned(1.1 * data.wrench)).value
    built.solve(program_data(ask(on_wall())))
    assert given[1] == {"P", "A", "b"}


def test_threads_do_not_disturb_each_other(data):
    built = program.Unique(data.shape)
    wrenches = [data.wrench * (1.0 + 0.02 * i) for i in range(24)]
    alone = [program.Unique(data.shape).solve(data.turned(w)).value for w in wrenches]
    with ThreadPoolExecutor(6) as pool:
        together = list(pool.map(lambda w: built.solve(data.turned(w)).value, wrenches * 4))
    assert together == alone * 4
    assert len(built.compiled.idle) <= compiled.KEPT


def test_the_solvers_that_wait_are_bounded(data):
    built = program.Margin(data.shape)
    for i, j in product(range(10), range(6)):
        hand = data.hands[0]
        # another entry that is zero: another pattern
        G = hand.G.copy()
        G[j, i] = 0.0
        built.solve(type(data)((hand._replace(G=G), *data.hands[1:]), data.wrench))
    assert len(built.compiled.idle) == compiled.KEPT


def test_numbers_that_are_none_cost_only_their_own_question(data):
    built = program.Unique(data.shape)
    honest = built.solve(data)
    lost = built.solve(data.turned(data.wrench * np.nan))
    assert not lost.solved
    assert np.isnan(lost.value)
    assert built.solve(data).value == honest.value
    # in the weights, too: what a solver keeps of them it takes along
    for number in (np.nan, np.inf):
        hands = tuple(hand._replace(tie=hand.tie * number) for hand in data.hands)
        assert not built.solve(type(data)(hands, data.wrench)).solved
        again = built.solve(data)
        for one, two in zip(again.loads, honest.loads, strict=True):
            np.testing.assert_array_equal(one, two)


def test_a_solver_is_stopped_at_the_deadline_and_goes_on_after(data):
    built = program.Unique(data.shape)
    honest = built.solve(data)
    with deadline.within(0.0):
        late = built.solve(data)
    assert late.status == compiled.OUT_OF_TIME
    assert not late.solved
    with deadline.within(1e4):
        assert built.solve(data).value == honest.value
    assert built.solve(data).value == honest.value


def test_an_inner_deadline_cannot_put_off_an_outer_one():
    with deadline.within(0.0), deadline.within(1e4):
        assert deadline.expired()
    with deadline.within(1e4), deadline.within(None):
        assert deadline.seconds() == 1e4
        assert 0.0 < deadline.left() <= 1e4
    assert deadline.left() is None


def changed_map(*_):
    raise cvxpy_internals.ChangedError("no attribute reduced_A")


@pytest.mark.parametrize("kind", [program.Unique, program.Margin, program.LoadFactor])
def test_where_cvxpy_has_changed_answers_are_the_same(data, monkeypatch, kind):
    fast = kind(data.shape).solve(data)
    monkeypatch.setattr(compiled, "cone_map", changed_map)
    with pytest.warns(RuntimeWarning, match="plans take longer"):
        built = kind(data.shape)
    slow = built.solve(data)
    assert slow.value == pytest.approx(fast.value, rel=1e-6)
    for one, two in zip(slow.loads, fast.loads, strict=True):
        np.testing.assert_allclose(one, two, atol=0.1)
    assert [dual.shape for dual in slow.hard_duals] == [dual.shape for dual in fast.hard_duals]
    np.testing.assert_allclose(slow.balance_dual, fast.balance_dual, atol=1e-3)
    with deadline.within(0.0):
        assert not built.solve(data).solved


class Without:
    """An object of CVXPY's that lacks an attribute."""

    def __init__(self, whole, lost=None):
        self.whole, self.lost = whole, lost

    def __getattr__(self, name):
        if name == self.lost:
            raise AttributeError(name)
        return getattr(self.whole, name)


def change_cvxpy(monkeypatch, changed):
    """Let the compiled problem that CVXPY gives away be another."""
    original = cp.Problem.get_problem_data

    def problem_data(*asked, **options):
        data, *others = original(*asked, **options)
        key = cp.settings.PARAM_PROB
        return data | {key: changed(data[key])}, *others

    monkeypatch.setattr(cp.Problem, "get_problem_data", problem_data)


@pytest.mark.parametrize("lost", ["reduced_A", "param_id_to_col", "q"])
def test_an_attribute_that_is_gone_is_noticed(monkeypatch, lost):
    change_cvxpy(monkeypatch, lambda whole: Without(whole, lost))
    with pytest.warns(RuntimeWarning, match=lost):
        assert program.Margin(SHAPES[0]).compiled.map is None


def test_a_map_that_gives_other_data_is_noticed(monkeypatch):
    def twisted(whole):
        changed = Without(whole)
        changed.q = 2.0 * whole.q
        return changed

    change_cvxpy(monkeypatch, twisted)
    with pytest.warns(RuntimeWarning, match="other data"):
        program.Margin(SHAPES[0])


def test_infeasible_comes_with_its_proof():
    """Farkas: ν·(W − g) + λ·h < 0 with λ ≥ 0 and Gᵀν + Hᵀλ = 0, no weight on limits."""
    data = program_data(ask(on_wall(palm=False)))
    outcome = solvers.unique(data)
    assert outcome.status == cp.INFEASIBLE
    nu = outcome.balance_dual
    value = float(nu @ data.offset)
    for hand, limit, hard in zip(data.hands, outcome.limit_duals, outcome.hard_duals, strict=True):
        assert hard.min() >= 0.0
        value += float(hard @ hand.h - limit @ hand.l0)
        np.testing.assert_allclose(
            hand.G.T @ nu + hand.H.T @ hard + hand.L.T @ limit, 0.0, atol=1e-6
        )
        assert np.abs(limit).max() < 1e-6
    assert value < -1e-3


def test_compiling_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        program.Unique(SHAPES[1])


def test_what_is_raised_while_a_deadline_runs_is_raised(data, monkeypatch):
    built = program.Unique(data.shape)
    honest = built.solve(data)

    def interrupted():
        raise KeyboardInterrupt

    with deadline.within(1e4), monkeypatch.context() as patch:
        patch.setattr(deadline, "expired", interrupted)
        with pytest.raises(KeyboardInterrupt):
            built.solve(data)
    assert built.solve(data).value == honest.value


FORKED = """
import os
from tests.suite.helpers.stances import PLACES, ask, on_wall
from planner.solving.solve import plan
plan(ask(on_wall()))
child = os.fork()
if not child:
    os._exit(0 if plan(ask(on_wall(limbs=tuple(PLACES)[:3]))).verified else 1)
_, status = os.waitpid(child, 0)
raise SystemExit(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_builds_programs_of_its_own():
    ended = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORKED],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=PATIENCE,
        check=False,
    )
    assert ended.returncode == 0


def test_what_is_built_ahead_is_what_plans_need():
    solvers.building.cache_clear()
    solvers.build_ahead(4)
    before = solvers.building.cache_info().misses
    for count in (4, 3):
        question = ask(on_wall(limbs=tuple(PLACES)[:count]), load=Load(50.0))
        answer = plan(replace(question, want=frozenset(["load_factor"])))
        assert answer.status == "optimal"
    assert solvers.building.cache_info().misses == before


@given(
    st.lists(
        st.tuples(*(st.integers(0, 3 * most) for most in stance_data.ROOM)),
        min_size=1,
        max_size=6,
    )
)
def test_there_is_room_for_every_hand_of_a_shape(hands):
    shape = Shape(6, tuple(hands))
    room = shape.with_room()
    assert len(room.hands) == len(hands)
    for k, least in enumerate(stance_data.ROOM):
        largest = max(hand[k] for hand in hands)
        for most in (hand[k] for hand in room.hands):
            assert most >= largest
            assert most == least or most < 2 * largest
    assert room.with_room() == room
