"""Programs as they are solved: CVXPY's own data, whatever came before, from every thread."""

import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import cvxpy as cp
import numpy as np
import pytest
from cvxpy.reductions.solvers.conic_solvers.clarabel_conif import CLARABEL
from scipy.sparse import csc_matrix

from hand_models.base import stores
from hand_models.rock import Cylinder
from planner import deadline
from planner.programs import TensionTrade, conic, hazard, program, solvers, stance_program
from planner.programs.conic import Columns, ConicProgram, ConicSolver, Solvers
from planner.programs.stance_data import HandData, StanceData
from planner.programs.stance_program import CLARABEL_SETTINGS, StanceProgram
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.named_programs import program_of
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.stances import ask, on_wall, program_data

FIXED = (10, 95, 20, 4)
WITH_JOINTS = (10, 109, 20, 11)
FLOATING = (6, 137, 62, 4)
CLINGING = (8, 24, 28, 4)
BARE = (4, 12, 4, 4)
HANDS = (FIXED, WITH_JOINTS, FLOATING, CLINGING, BARE)

SHAPES = [
    (6, (FIXED,)),
    (6, (FIXED,) * 4),
    (6, (WITH_JOINTS,) * 4),
    (9, (WITH_JOINTS, FLOATING, CLINGING, BARE)),
    (6, (FLOATING, FLOATING)),
    *((6 + count % 3, tuple(HANDS[i % 5] for i in range(count))) for count in (3, 8)),
]
"""Rows of balance, and loads, limits, hard rows and efforts of each hand."""

SIXTEEN = (7, tuple(HANDS[i % 5] for i in range(16)))
"""Of as many hands as there may be."""

Draw = Callable[..., np.ndarray]

KINDS: dict[str, Callable[[StanceData, Draw], StanceProgram]] = {
    "Unique": lambda data, draw: program_of(solvers.unique, data),
    "LessTension": lambda data, draw: program_of(
        solvers.less_tension, data, TensionTrade(0.3, 1.3)
    ),
    "Margin": lambda data, draw: program_of(solvers.margin, data),
    "Curved": lambda data, draw: program_of(
        solvers.curved,
        data,
        draw(*2 * data.rows.unit.shape),
        [draw(len(hand.unit)) for hand in data.hands],
    ),
    "TieBreak": lambda data, draw: program_of(solvers.tie_break, data, 1.3),
    "Effort": lambda data, draw: program_of(solvers.effort, data, 1.3),
    "LoadFactor": lambda data, draw: program_of(solvers.load_factor, data),
    "Reach": lambda data, draw: program.Reach(
        data,
        draw(3),
        draw(len(data.wrench), 3),
        0.7,
        [draw(len(hand.l0), 3) for hand in data.hands],
    ),
    "Nearest": lambda data, draw: program.Nearest(data),
    "Elastic": lambda data, draw: program_of(
        solvers.elastic,
        data,
        2.0,
        [draw(len(hand.unit)) for hand in data.hands],
        np.arange(len(hard_rows(data))) % 3 == 0,
    ),
    "Hazard": lambda data, draw: hazard.Hazard(data, 1.3, every_third(data)),
    "Nearest, some kept": lambda data, draw: program.Nearest(data, len(data.wrench) - 6),
}


def every_third(data: StanceData) -> hazard.TilePowers:
    """Tiles of two rows each, which are every third of a stance's limits, with other moduli."""
    rows = np.arange(0, data.rows.limits - 3, 3)
    tile_of = np.arange(len(rows)) // 2
    moduli = 2.0 + np.arange(tile_of[-1] + 1) % 4
    return hazard.TilePowers(rows, tile_of, np.full(len(moduli), 1.0 / len(moduli)), moduli)


def drawn(rng: np.random.Generator) -> Draw:
    """Arrays of which about half is zero."""
    return lambda *shape: rng.normal(size=shape) * rng.integers(0, 2, shape)


def random_data(shape: tuple, draw: Draw) -> StanceData:
    count, hands = shape
    return StanceData.of(
        tuple(
            HandData(
                G=draw(count, m),
                g=draw(count),
                L=draw(nl, m),
                l0=draw(nl),
                H=draw(nh, m),
                h=draw(nh),
                E=draw(ne, m),
                e0=draw(ne),
                tie=np.abs(draw(m)) + np.eye(m)[0],
                rest=np.abs(draw(m)),
                unit=np.full(m, 2.0),
            )
            for m, nl, nh, ne in hands
        ),
        draw(count) + np.eye(count)[0],
    )


def dense(asked: ConicProgram) -> np.ndarray:
    """The matrix A."""
    shape = len(asked.b), len(asked.q)
    return csc_matrix(Columns.beside(asked.A), shape).toarray()


def test_every_program_is_compared():
    kinds = {kind for kind in vars(program).values() if isinstance(kind, type)}
    kinds.add(hazard.Hazard)
    programs = {kind for kind in kinds if issubclass(kind, StanceProgram)} - {StanceProgram}
    of_each = [
        KINDS[name](
            random_data(SHAPES[0], drawn(np.random.default_rng(0))), drawn(np.random.default_rng(1))
        )
        for name in KINDS
    ]
    assert {type(asked) for asked in of_each} == programs


@pytest.mark.parametrize(
    "shapes", [SHAPES, pytest.param([SIXTEEN], marks=pytest.mark.slow)], ids=["few", "sixteen"]
)
@pytest.mark.parametrize("kind", KINDS)
def test_the_solver_gets_what_cvxpy_would_give_it(kind, shapes):
    draw = drawn(np.random.default_rng(3))
    for shape in shapes:
        asked = KINDS[kind](random_data(shape, draw), draw)
        ours = asked.conic()
        theirs, _, _ = asked.define().problem.get_problem_data(cp.CLARABEL, solver_opts={})
        np.testing.assert_array_equal(dense(ours), theirs["A"].toarray())
        np.testing.assert_array_equal(ours.b, theirs["b"])
        np.testing.assert_array_equal(ours.q, theirs["c"])
        # they leave a P out that is zero
        P = theirs["P"].toarray() if "P" in theirs else np.zeros((len(ours.q),) * 2)
        np.testing.assert_allclose(np.diag(ours.P), P, rtol=1e-15)
        dims = theirs["dims"]
        cones = ours.zero, len(ours.b) - ours.zero - ours.second_order - 3 * len(ours.powers)
        assert cones == (dims.zero, dims.nonneg)
        assert dims.soc == [ours.second_order] * bool(ours.second_order)
        assert list(dims.p3d) == list(ours.powers)


def hard_rows(data: StanceData) -> np.ndarray:
    """Right-hand sides of all hard rows."""
    return np.concatenate([hand.h for hand in data.hands])


def real_programs(data: StanceData) -> dict[str, StanceProgram]:
    """All of a stance that can be held."""
    loads = solvers.unique(data).loads
    root = 0.1 * np.eye(len(data.rows.unit))
    up = np.eye(6)[:, 2:3]
    return {
        "Unique": program_of(solvers.unique, data),
        "LessTension": program_of(solvers.less_tension, data, TensionTrade(0.3, 1.1)),
        "Margin": program_of(solvers.margin, data),
        "Curved": program_of(solvers.curved, data, root, loads),
        "TieBreak": program_of(solvers.tie_break, data, 1.1),
        "Effort": program_of(solvers.effort, data, 1.1),
        "LoadFactor": program_of(solvers.load_factor, data),
        "Reach": program.Reach(data, np.ones(1), up),
        "Elastic": program_of(
            solvers.elastic, data, 2.0, loads, np.zeros(len(hard_rows(data)), dtype=bool)
        ),
        # beyond what the largest loads that count can turn
        "Nearest": program.Nearest(data.turned(np.repeat([0.0, 1e6], 3))),
        "Hazard": hazard.Hazard(data, 1.1, every_third(data)),
    }


@pytest.fixture(scope="module")
def data():
    return program_data(ask(on_wall()))


@pytest.mark.parametrize("kind", [name for name in KINDS if "," not in name])
def test_where_the_solver_gives_up_cvxpy_comes_to_the_same(data, monkeypatch, kind):
    asked = real_programs(data)[kind]
    fast, further = asked.run()
    assert fast.solved
    gives_up = conic.ConicSolution(conic.SOLVER_ERROR)
    monkeypatch.setattr(stance_program.WAITING_SOLVERS, "solve", lambda *_: gives_up)
    monkeypatch.setattr(ConicSolver, "solve", lambda _: gives_up)
    slow, theirs = asked.run()
    assert slow.solved
    ours, value = (
        (fast.value, slow.value) if further is None or not len(further) else (further[0], theirs[0])
    )
    assert value == pytest.approx(ours, rel=1e-6)
    for one, two in zip(slow.loads, fast.loads, strict=True):
        assert one.shape == two.shape
    if kind in ("Unique", "TieBreak", "Effort", "Curved"):
        for one, two in zip(slow.loads, fast.loads, strict=True):
            np.testing.assert_allclose(one, two, atol=0.1)
    for name in ("limit_duals", "hard_duals"):
        shapes = [[dual.shape for dual in getattr(each, name)] for each in (slow, fast)]
        assert shapes[0] == shapes[1]
    np.testing.assert_allclose(slow.balance_dual, fast.balance_dual, atol=2e-3)
    with deadline.within(0.0):
        assert not asked.run()[0].solved


def test_an_answer_does_not_depend_on_the_questions_before(data):
    other = program_data(ask(on_wall(overhang=0.2, off=0.25)))
    conic.WAITING_SOLVERS.clear()
    fresh = solvers.unique(data)
    for before in (other, data, other.turned(1.2 * other.wrench), data.turned(other.wrench)):
        solvers.unique(before)
    again = solvers.unique(data)
    assert again.value == fresh.value
    for one, two in zip(again.loads, fresh.loads, strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("kind", KINDS)
def test_a_solver_that_is_kept_answers_as_a_new_one(kind):
    draw = drawn(np.random.default_rng(5))
    data = random_data(SHAPES[3], draw)
    first = KINDS[kind](data, draw).conic()
    # the same pattern with other numbers, and another with none
    A = dense(first)
    second = first._replace(A=(Columns.of(1.5 * A),), b=0.5 * first.b, P=2.0 * first.P)
    third = first._replace(b=np.zeros_like(first.b), q=3.0 * first.q)
    fourth = first._replace(A=(Columns.of(np.where(np.abs(A) < 0.3, 0.0, A)),))
    kept = Solvers(2)
    for asked in (first, second, third, fourth, first):
        found = kept.solve(asked, CLARABEL_SETTINGS)
        fresh = ConicSolver(asked, CLARABEL_SETTINGS).solve()
        assert found.status == fresh.status
        for name in ("x", "multipliers"):
            np.testing.assert_array_equal(getattr(found, name), getattr(fresh, name))
    assert kept.info().kept <= 2


def test_threads_do_not_disturb_each_other(data):
    conic.WAITING_SOLVERS.clear()
    wrenches = [data.wrench * (1.0 + 0.02 * i) for i in range(24)]
    alone = [solvers.unique(data.turned(w)).value for w in wrenches]
    with ThreadPoolExecutor(6) as pool:
        together = list(pool.map(lambda w: solvers.unique(data.turned(w)).value, wrenches * 4))
    assert together == alone * 4
    assert conic.WAITING_SOLVERS.info().kept <= 6


def test_the_solvers_that_wait_are_bounded(data):
    for i, j in product(range(10), range(7)):
        hand = data.hands[0]
        # another entry that is zero: another pattern
        L = hand.L.copy()
        L[j, i] = 0.0 if L[j, i] else 1.0
        solvers.margin(StanceData.of((hand._replace(L=L), *data.hands[1:]), data.wrench))
    assert conic.WAITING_SOLVERS.info()[2:] == (64, 64)
    conic.WAITING_SOLVERS.clear()
    assert conic.WAITING_SOLVERS.info() == stores()["solvers"] == (0, 0, 0, 64)


def test_numbers_that_are_none_cost_only_their_own_question(data):
    honest = solvers.unique(data)
    lost = solvers.unique(data.turned(data.wrench * np.nan))
    assert not lost.solved
    assert np.isnan(lost.value)
    assert solvers.unique(data).value == honest.value
    # in the weights, too: what a solver keeps of them it takes along
    for number in (np.nan, np.inf):
        hands = tuple(hand._replace(tie=hand.tie * number) for hand in data.hands)
        assert not solvers.unique(StanceData.of(hands, data.wrench)).solved
        again = solvers.unique(data)
        for one, two in zip(again.loads, honest.loads, strict=True):
            np.testing.assert_array_equal(one, two)


def test_a_solver_is_stopped_at_the_deadline_and_goes_on_after(data):
    honest = solvers.unique(data)
    with deadline.within(0.0):
        late = solvers.unique(data)
    assert late.status == conic.OUT_OF_TIME
    assert not late.solved
    with deadline.within(1e4):
        assert solvers.unique(data).value == honest.value
    assert solvers.unique(data).value == honest.value


def test_an_inner_deadline_cannot_put_off_an_outer_one():
    with deadline.within(0.0), deadline.within(1e4):
        assert deadline.expired()
    with deadline.within(1e4), deadline.within(None):
        assert deadline.seconds() == 1e4
        assert 0.0 < deadline.left() <= 1e4
    assert deadline.left() is None


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


def test_the_solvers_words_are_cvxpys():
    theirs = CLARABEL.STATUS_MAP
    known = conic.CLARABEL_STATUSES
    assert {word: theirs.get(word) for word in known if word in theirs} == {
        word: status for word, status in known.items() if status != conic.OUT_OF_TIME
    }
    assert {theirs[word] for word in theirs if word not in known} <= {conic.SOLVER_ERROR}


def test_what_is_raised_while_a_deadline_runs_is_raised(data, monkeypatch):
    honest = solvers.unique(data)

    def interrupted():
        raise KeyboardInterrupt

    with deadline.within(1e4), monkeypatch.context() as patch:
        patch.setattr(deadline, "expired", interrupted)
        with pytest.raises(KeyboardInterrupt):
            solvers.unique(data)
    assert solvers.unique(data).value == honest.value


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
def test_a_forked_process_plans():
    ended = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FORKED],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        timeout=PATIENCE,
        check=False,
    )
    assert ended.returncode == 0


def test_a_program_of_one_row_is_solved_by_hand():
    """min x + ½ (2 x²) with x ≥ −1 as −x ≤ 1: at −½, of value −¼."""
    A = (Columns.of(np.array([[-1.0]])),)
    asked = ConicProgram(np.array([2.0]), np.array([1.0]), A, np.array([1.0]), 0)
    found = Solvers(1).solve(asked, CLARABEL_SETTINGS)
    assert found.value == pytest.approx(-0.25, abs=1e-8)
    assert found.x == pytest.approx([-0.5], abs=1e-6)


def test_where_zeros_are_does_not_hang_on_rounding():
    """Pinches of a wall's logs differ in nothing but numbers: one solver serves them all."""
    found = set()
    for diameter in np.linspace(0.27, 0.33, 24):
        rows = program_data(ask(on_wall(Cylinder(float(diameter))))).rows.columns
        found.add((rows.rows.tobytes(), rows.starts.tobytes()))
    assert len(found) == 1
