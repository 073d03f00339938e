"""What a program's multipliers prove of every wrench, against another solver."""

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from hand_models.rock import Cylinder
from planner.programs import WRENCH_UNIT, solvers
from planner.streaming.affine_bounds import affine_bound
from tests.suite.helpers import peer
from tests.suite.helpers.stances import ask, on_wall, program_data, random_question

# made where they are asked, not in each process that collects tests
QUESTIONS = {
    "wall": cache(lambda: ask(on_wall())),
    "overloaded": cache(lambda: ask(on_wall(Cylinder(0.7)))),
    **{f"random {seed}": cache(partial(random_question, seed)) for seed in (1, 2, 8, 11)},
}


@pytest.mark.parametrize("solve", [solvers.margin, solvers.unique])
@pytest.mark.parametrize("name", QUESTIONS)
def test_a_cut_is_the_least_utilisation_at_its_wrench_and_below_it_elsewhere(name, solve):
    question = QUESTIONS[name]()
    data = program_data(question)
    outcome = solve(data)
    found = affine_bound(data, outcome)
    least = peer.least_utilisation(question).fun
    assert found.slope @ question.needed_wrench() + found.constant == pytest.approx(least, rel=1e-6)
    rng = np.random.default_rng(5)
    for size in (0.01, 0.1, 1.0):
        wrench = question.needed_wrench() + rng.normal(0.0, size, 6) * WRENCH_UNIT
        there = peer.least_utilisation(replace(question, body_wrench=wrench))
        if there.status != peer.INFEASIBLE:
            assert found.slope @ wrench + found.constant <= there.fun + 1e-7


@pytest.mark.parametrize("noise", [1e-6, 1e-4, 1e-2])
def test_a_cut_of_spoilt_multipliers_is_still_none_too_many(noise):
    question = QUESTIONS["wall"]()
    data = program_data(question)
    outcome = solvers.margin(data)
    rng = np.random.default_rng(7)

    def spoilt(parts):
        return tuple(part * (1.0 + noise * rng.normal(size=part.shape)) for part in parts)

    found = affine_bound(
        data,
        replace(
            outcome,
            limit_duals=spoilt(outcome.limit_duals),
            hard_duals=spoilt(outcome.hard_duals),
            balance_dual=spoilt((outcome.balance_dual,))[0],
        ),
    )
    least = peer.least_utilisation(question).fun
    assert found.slope @ question.needed_wrench() + found.constant <= least + 1e-7


def test_multipliers_that_prove_nothing_give_no_cut():
    data = program_data(QUESTIONS["wall"]())
    outcome = solvers.margin(data)
    # the limits of one hand alone cannot keep the balance from being had otherwise
    limits = (outcome.limit_duals[0], *(0.0 * part for part in outcome.limit_duals[1:]))
    hard = tuple(0.0 * part for part in outcome.hard_duals)
    assert affine_bound(data, replace(outcome, limit_duals=limits, hard_duals=hard)) is None
