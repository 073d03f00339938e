"""An objective that is defined here, from its program to what a plan says of it."""

from dataclasses import replace
from typing import get_args

import cvxpy as cp
import numpy as np
import pytest
from msgspec import structs

from hand_models.base import InvalidInputError, UnsupportedError
from planner.programs import CAP_SLACK
from planner.programs.conic import ConicProgram
from planner.programs.stance_program import Definition, StanceProgram
from planner.question import MOVING_WRIST_OBJECTIVES, Limits, Load, Objective
from planner.question.objectives import OBJECTIVE_NEEDS
from planner.solving import NAMED_OBJECTIVES, CappedObjective, plan
from planner.streaming import WrenchStream
from tests.suite.helpers.stances import ask, on_wall, program_data

CAP = 0.9


class LeastSumProgram(StanceProgram):
    """min Σ tension / maximum, under a cap on the utilisation."""

    def __init__(self, data, cap):
        super().__init__(data)
        self.cap, self.weights = cap, np.sqrt(data.rows.tie)

    def define(self):
        z = self.loads()
        rows = self.rows(z, self.cap)
        return Definition(cp.Problem(cp.Minimize(self.weights @ z), [*rows]), (z,), rows)

    def conic(self):
        _, loads, b = self.blocks(0)
        b[self.of_limits] += self.cap
        return ConicProgram(np.zeros(self.size), self.weights, (loads,), b, len(self.G))


class LeastSum(CappedObjective):
    """Least sum of relative loads, tensions above all."""

    name = "least_sum"
    words = "sum"

    def solve(self, data, cap):
        return LeastSumProgram(data, cap).solve()

    def value(self, data, loads):
        return float(self.slopes(data, loads) @ (np.concatenate(loads) / data.rows.unit))

    def slopes(self, data, loads):
        return np.sqrt(data.rows.tie)

    def reported(self, binding, cap):
        return {"prices": binding.prices(cap)}


class Boasting(LeastSum):
    """One whose value is not what its plan's numbers say."""

    def problems(self, arrays, value):
        return ["sum is not what the tensions say"]


class Unproven(LeastSum):
    """One whose multipliers prove nothing: its slopes are wrong."""

    def slopes(self, data, loads):
        return np.ones(data.rows.whole.shape[1])


QUESTION = ask(on_wall(), load=Load(mass=60.0), limits=Limits(utilisation=CAP))


def test_plans_are_the_best_in_it_within_the_cap():
    answer, data = plan(replace(QUESTION, objective=LeastSum())), program_data(QUESTION)
    assert answer.status == "optimal"
    assert answer.utilisation <= CAP + CAP_SLACK

    tensions = [float(hand.tensions.sum()) for hand in answer.hands]
    for other in NAMED_OBJECTIVES:
        there = plan(replace(QUESTION, objective=other))
        assert sum(tensions) <= sum(float(hand.tensions.sum()) for hand in there.hands) + 1e-3
    defined, _ = LeastSumProgram(data, CAP).by_definition()
    assert sum(tensions) == pytest.approx(sum(float(y[:4].sum()) for y in defined.loads), rel=1e-4)
    # its own multipliers, by name
    assert answer.prices
    assert answer.effort_prices is None


@pytest.mark.parametrize(
    ("objective", "words"), [(Boasting(), "tensions say"), (Unproven(), "only proven to be above")]
)
def test_a_plan_that_it_finds_wrong_or_does_not_prove_never_leaves(objective, words):
    answer = plan(replace(QUESTION, objective=objective))
    assert answer.status == "failed"
    assert not answer.verified
    assert words in answer.reason


def test_where_the_limits_cannot_be_kept_the_plan_of_least_utilisation_leaves():
    heavy = replace(QUESTION, load=structs.replace(QUESTION.load, mass=400.0))
    answer, least = plan(replace(heavy, objective=LeastSum())), plan(heavy)
    assert answer.status == least.status == "overloaded"
    assert answer.utilisation == least.utilisation


def test_what_it_does_not_do_is_refused_by_name():
    first, *others = QUESTION.stance.hands
    first = replace(first, wrist="floating", tendon_preload=np.full(4, 70.0))
    floating = replace(QUESTION, stance=replace(QUESTION.stance, hands=(first, *others)))
    with pytest.raises(UnsupportedError, match="least_sum requires fixed wrists"):
        plan(replace(floating, objective=LeastSum(), limits=Limits()))
    with pytest.raises(UnsupportedError, match="least_sum is not available for streams"):
        WrenchStream(replace(QUESTION, objective=LeastSum()))
    for wrong in ("most", 3, None):
        with pytest.raises(InvalidInputError) as caught:
            replace(QUESTION, objective=wrong)
        assert caught.value.field == "objective"


def test_a_named_objective_and_its_object_need_the_same():
    assert set(get_args(Objective)) == set(NAMED_OBJECTIVES) == set(OBJECTIVE_NEEDS)
    first, *others = QUESTION.stance.hands
    hands = replace(first, wrist="compliant"), *others
    moving = replace(QUESTION, stance=replace(QUESTION.stance, hands=hands))
    for name, objective in NAMED_OBJECTIVES.items():
        for asked in (name, objective):
            if name in MOVING_WRIST_OBJECTIVES:
                assert replace(moving, objective=asked).objective_name == name
                continue
            with pytest.raises(UnsupportedError, match=f"{name} requires fixed wrists"):
                replace(moving, objective=asked)
