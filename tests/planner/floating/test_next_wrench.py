"""The plan of the next body wrench, beside the whole search for it."""

from dataclasses import replace

import numpy as np
import pytest

from planner.deadline import Budget
from planner.floating import SETTINGS, next_plan
from planner.question import Question
from planner.solving import KnownStance, plan
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.stances import complying


def known(name: str) -> tuple[KnownStance, Question]:
    question = complying(questions.question(read_request(name)))
    stance = KnownStance(question)
    assert stance.plan(stance.prepared.wrench).status == "optimal"
    return stance, question


def random_wrench(rng: np.random.Generator, base: np.ndarray, part: float) -> np.ndarray:
    return base * (1.0 + part * rng.uniform(-1.0, 1.0, 6))


@pytest.mark.parametrize("name", ["wall-300", pytest.param("overhang", marks=pytest.mark.slow)])
def test_the_next_plan_is_exact_and_as_good_as_a_new_search(name):
    stance, question = known(name)
    prepared, rng = stance.prepared, np.random.default_rng(1)
    now = stance.answer(prepared.wrench, 0.0).answer.solution.search
    for _ in range(3):
        wrench = random_wrench(rng, prepared.wrench, 0.04)
        hands = prepared.hands.turned(wrench)
        found = next_plan(hands, now, Budget(50))
        assert found is not None
        now = found
        # on sets linearised anew, with nothing of the step in them
        measure = hands.sets(now.point).measure(now.point.loads)
        assert measure.exact(hands)
        assert measure.utilisation == pytest.approx(now.measure.utilisation, rel=1e-12)
        assert measure.utilisation - now.outcome.value <= SETTINGS.next_gap
        whole = plan(replace(question, body_wrench=wrench))
        assert measure.utilisation == pytest.approx(whole.utilisation, rel=0.01)


@pytest.mark.slow
def test_where_few_limits_bind_the_next_plan_is_found_all_the_same():
    question = complying(questions.question(read_request("boulders")))
    stance = KnownStance(question)
    base = 0.6 * stance.prepared.wrench
    now = stance.answer(base, 0.0).answer.solution.search
    for i in range(8):
        hands = stance.prepared.hands.turned(base + (1.0 + i) * np.eye(6)[0])
        found = next_plan(hands, now, Budget(50))
        assert found is not None
        assert hands.step(now.point, found.point.loads) < 0.3  # mm
        now = found


def test_a_wrench_far_away_has_no_plan_close_by():
    stance, _ = known("wall-300")
    now = stance.answer(stance.prepared.wrench, 0.0).answer.solution.search
    hands = stance.prepared.hands.turned(-3.0 * stance.prepared.wrench)
    assert next_plan(hands, now, Budget(50)) is None


def test_a_spent_budget_ends_it():
    stance, _ = known("wall-300")
    now = stance.answer(stance.prepared.wrench, 0.0).answer.solution.search
    assert next_plan(stance.prepared.hands, now, Budget(0)) is None


@pytest.mark.slow
def test_a_known_stance_turns_back_to_a_whole_search_beyond_the_cap():
    stance, question = known("wall-300")
    heavy = 1.3 * stance.prepared.wrench
    found, whole = stance.plan(heavy), plan(replace(question, body_wrench=heavy))
    assert (found.status, whole.status) == ("overloaded", "overloaded")
    assert found.utilisation == pytest.approx(whole.utilisation, rel=1e-9)
    # and what is within it begins at the last plan within it
    again = stance.plan(stance.prepared.wrench)
    assert (again.status, again.verified) == ("optimal", True)
    assert again.utilisation == pytest.approx(plan(question).utilisation, rel=1e-3)
