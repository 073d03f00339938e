"""The last digits of a plan: exact where found, and the same by both ways."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs

from hand_models.base import InvalidInputError
from planner.programs import solvers
from planner.question import Load
from planner.solving import KnownStance
from planner.solving.unique_plan import active_set_optimum
from tests.suite.helpers.stances import CALIBRATION_LOAD, ask, on_wall, program_data, random_stance


def problems(count):
    """Data of random stances, and of the wall under an uneven load, within their limits."""
    rng = np.random.default_rng(5)
    found = [
        program_data(ask(on_wall(), load=structs.replace(CALIBRATION_LOAD, com=(0.0, 0.05, 0.0))))
    ]
    while len(found) < count:
        stance = random_stance(rng)
        try:
            data = program_data(ask(stance, load=Load(float(rng.uniform(5.0, 60.0)))))
        except InvalidInputError:
            continue
        outcome = solvers.unique(data)
        if outcome.solved and outcome.value < 1.1:
            found.append(data)
    return found


@pytest.fixture(scope="module", params=[2, pytest.param(12, marks=pytest.mark.slow)])
def data_of_all(request):
    return problems(request.param)


def test_polished_tensions_are_those_of_the_tie_break(data_of_all):
    """Against the second program, at a cap as close as its solver bears; most can be polished."""
    count = 0
    for data in data_of_all:
        outcome = solvers.unique(data)
        exact = active_set_optimum(data, outcome)
        if exact is None:
            continue
        count += 1
        assert exact.outcome.value == pytest.approx(solvers.margin(data).value, abs=1e-6)
        assert solvers.beyond(data, exact.outcome.loads, exact.outcome.value) <= 1e-8
        balance = solvers.body_wrench(data, exact.outcome.loads)
        np.testing.assert_allclose(balance, data.wrench, atol=1e-8)
        other = solvers.tie_break(data, outcome.value + 1e-10)
        if not other.solved:
            continue
        for mine, theirs in zip(exact.outcome.loads, other.loads, strict=True):
            np.testing.assert_allclose(mine[:4], theirs[:4], atol=0.02)
    assert count >= 0.7 * len(data_of_all)


def test_loads_far_from_the_optimum_are_not_polished(data_of_all):
    data = data_of_all[0]
    outcome = solvers.unique(data)
    lost = replace(
        outcome,
        limit_duals=tuple(np.zeros_like(dual) for dual in outcome.limit_duals),
        hard_duals=tuple(np.zeros_like(dual) for dual in outcome.hard_duals),
        loads=tuple(np.full_like(y, 1e3) for y in outcome.loads),
    )
    found = active_set_optimum(data, lost)
    assert found is None or found.outcome.value == pytest.approx(outcome.value, abs=1e-6)


SHARES = np.linspace(0.95, 1.1, 60)


@pytest.mark.parametrize(
    "shares",
    [SHARES[20:40], pytest.param(SHARES, marks=pytest.mark.slow)],
    ids=["near", "far"],
)
def test_tensions_change_continuously_where_plans_become_overloaded(shares):
    """Across 1.25, where the bound of one solve no longer suffices."""
    known = KnownStance(ask(on_wall(overhang=0.5)))
    before = None
    for share in shares:
        answer = known.plan(share * known.prepared.wrench)
        tensions = np.array([[f.tendon_tension for f in hand.fingers] for hand in answer.hands])
        if before is not None:
            assert np.abs(tensions - before).max() < 2.0
        before = tensions
    assert answer.utilisation > 1.26
