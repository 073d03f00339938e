"""The programs' optima, against HiGHS on the same sets."""

import itertools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.optimize import minimize

from hand_models.hand import FINGERS
from hand_models.rock import Cylinder, Plane, Sphere
from planner.programs import solvers
from planner.question import Load
from planner.result import Plan
from planner.solving import plan
from tests.suite.helpers import peer
from tests.suite.helpers.least import is_meant
from tests.suite.helpers.stances import (
    CALIBRATION_LOAD,
    ask,
    on_wall,
    program_data,
    random_answer,
    random_question,
)

SEEDS = range(16)

many = pytest.mark.parametrize(
    "seeds", [SEEDS, pytest.param(range(200), marks=pytest.mark.slow)], ids=["few", "many"]
)
AGREE = 1e-5


def tensions(answer: Plan) -> np.ndarray:
    """All tendon tensions, shape (hands, 4)."""
    return np.array([[finger.tendon_tension for finger in hand.fingers] for hand in answer.hands])


def test_random_stances_reach_every_kind_of_answer():
    found = {random_answer(seed)[1].status for seed in SEEDS}
    assert found == {"optimal", "overloaded", "infeasible"}
    assert {len(random_answer(seed)[0].stance.hands) for seed in SEEDS} == {1, 2, 3, 4}


@many
def test_least_utilisation_is_that_of_highs_and_infeasible_exactly_where_highs_says(seeds):
    wrong = []
    for seed in seeds:
        question, answer = random_answer(seed)
        # of more, the answer says nothing
        other = peer.least_utilisation(question, largest=peer.largest_load(question))
        if other.status == peer.INFEASIBLE:
            agrees = answer.status == "infeasible" and answer.utilisation is None
        else:
            assert other.status == 0, other.message
            agrees = answer.utilisation is not None and is_meant(
                answer.utilisation, other.fun, agree=AGREE
            )
        if not agrees:
            wrong.append((seed, answer.status, answer.utilisation, other.fun))
    assert not wrong


@many
def test_load_factor_is_that_of_highs(seeds):
    wrong = []
    for seed in seeds:
        question, answer = random_answer(seed)
        other = peer.largest_load_factor(question)
        if answer.load_factor != (
            None if other is None else pytest.approx(other, rel=AGREE, abs=AGREE)
        ):
            wrong.append((seed, answer.status, answer.load_factor, other))
    assert not wrong


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1.0, 1e6])
def test_load_factor_goes_as_one_over_the_wrench(size):
    stance = on_wall()
    wrench = CALIBRATION_LOAD.body_wrench(stance)
    reference = plan(ask(stance, "load_factor", body_wrench=wrench)).load_factor
    answer = plan(ask(stance, "load_factor", body_wrench=wrench * size))
    assert answer.load_factor == pytest.approx(reference / size, rel=AGREE)


def test_threads_that_share_a_program_get_the_answers_of_one_thread():
    questions = [ask(on_wall(overhang=angle), "load_factor") for angle in (-0.6, -0.3, 0.0, 0.2)]
    alone = [plan(question) for question in questions]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(plan, questions * 4))
    for one, other in zip(itertools.cycle(alone), together, strict=False):
        assert other.utilisation == one.utilisation
        assert other.load_factor == one.load_factor
        np.testing.assert_array_equal(tensions(other), tensions(one))


@pytest.mark.parametrize(
    "question",
    [
        ask(on_wall(), load=Load()),
        pytest.param(ask(on_wall(Cylinder(0.7), overhang=-0.3)), marks=pytest.mark.slow),
        ask(on_wall(Sphere(0.5), lateral=False)),
        pytest.param(
            ask(on_wall(Plane(), overhang=-0.7, outer_rotation=0.0)), marks=pytest.mark.slow
        ),
        pytest.param(random_question(10), marks=pytest.mark.slow),
        random_question(18),
    ],
)
def test_among_the_optima_the_plan_has_the_least_effort(question):
    """Against sequential least squares from HiGHS's vertex, within 1 %."""
    answer = plan(question)
    r = peer.rows(question)
    start = peer.least_utilisation(question).x[:-1]
    maximum = question.stance.robot.hand.maximum_tension
    column_names = [name for space in peer.spaces(question) for name in space.columns]
    is_tension = np.array([name.endswith("/tension") for name in column_names])
    cap = answer.utilisation + 1e-6
    size, unit = maximum, np.array([300.0] * 3 + [30.0] * 3)
    # what no hand can give at all would be equations that say nothing
    left, singular, _ = np.linalg.svd(r.B * size / unit[:, None], full_matrices=False)
    said = left[:, singular > 1e-12 * singular[0]].T / unit

    def effort(y):
        return float(np.sum(y[is_tension] ** 2))

    result = minimize(
        effort,
        start / size,
        jac=lambda y: np.where(is_tension, 2.0 * y, 0.0),
        method="SLSQP",
        constraints=[
            {
                "type": "ineq",
                "fun": lambda y: cap - (r.L @ (y * size) + r.l0) / r.s,
                "jac": lambda y: -r.L * size / r.s[:, None],
            },
            {
                "type": "ineq",
                "fun": lambda y: (r.h - r.H @ (y * size)) / 100.0,
                "jac": lambda y: -r.H * size / 100.0,
            },
            {
                "type": "eq",
                "fun": lambda y: said @ (r.B @ (y * size) + r.b - question.needed_wrench()),
                "jac": lambda y: said @ r.B * size,
            },
        ],
        options={"ftol": 1e-10, "maxiter": 300},
    )
    assert result.success, result.message
    mine = float(np.sum((tensions(answer) / maximum) ** 2))
    assert mine <= 1.01 * result.fun + 1e-9
    # and HiGHS's own optimum, with as little utilisation, need not be any better
    assert mine <= effort(start / size) + 1e-6


@pytest.mark.parametrize("hold", [Cylinder(0.3), Cylinder(0.7), Sphere(0.5)])
@pytest.mark.parametrize("lateral", [True, False])
def test_a_symmetric_stance_has_a_symmetric_plan(hold, lateral):
    answer = plan(ask(on_wall(hold, lateral=lateral)))
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    hands = {hand.limb: hand for hand in answer.hands}
    for end in ("front", "rear"):
        left, right = hands[f"{end}_left"], hands[f"{end}_right"]
        np.testing.assert_allclose(left.wrench * mirror, right.wrench, atol=1e-3)
        for name, other in zip(FINGERS, reversed(FINGERS), strict=True):
            one = left.fingers[FINGERS.index(name)].tendon_tension
            assert one == pytest.approx(
                right.fingers[FINGERS.index(other)].tendon_tension, abs=1e-3
            )


@pytest.mark.parametrize("solve", [solvers.margin, solvers.vertex])
@many
def test_dual_bound_of_the_margin_proves_its_optimum(seeds, solve):
    """The multipliers of a linear program bound its optimum from below; the gap is nothing."""
    for seed in seeds[:60]:
        question, answer = random_answer(seed)
        if answer.utilisation is None:
            continue
        data = program_data(question)
        outcome = solve(data)
        weight = sum(duals.sum() for duals in outcome.limit_duals)
        assert weight == pytest.approx(1.0, abs=1e-6)
        stationary = [
            hand.L.T @ limit + hand.H.T @ hard + hand.G.T @ outcome.balance_dual
            for hand, limit, hard in zip(
                data.hands, outcome.limit_duals, outcome.hard_duals, strict=True
            )
        ]
        assert max(np.abs(each).max() for each in stationary) < 1e-5
        bound = -outcome.balance_dual @ (data.wrench - sum(hand.g for hand in data.hands))
        for hand, limit, hard in zip(
            data.hands, outcome.limit_duals, outcome.hard_duals, strict=True
        ):
            bound += limit @ hand.l0 - hard @ hand.h
        assert bound == pytest.approx(outcome.value, rel=1e-5, abs=1e-6)
