"""Random questions of each kind by seed, and those of them that have no plan within the limits."""

from __future__ import annotations

from functools import cache

import pytest
from msgspec import convert

from planner.question import Question
from planner.result import Plan
from planner.solving import plan
from service.answering import questions
from service.requests import PlanRequest
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.stances import random_question
from tests.suite.helpers.stances_with_joints import random_question_with_joints


def requested(seed: int) -> Question:
    """A random request as a question."""
    return questions.question(convert(random_request(seed), PlanRequest))


KINDS = {"plain": random_question, "with joints": random_question_with_joints, "request": requested}

SEEDS = {
    "infeasible": {
        "plain": (3, 5, 12, 58, 98),
        "with joints": (24, 36),
        "request": (3, 5, 54, 60, 82, 90, 93),
    },
    "overloaded": {
        "plain": (7, 32, 46),
        "with joints": (0, 3, 7, 37),
        "request": (6, 9, 28, 55, 75, 97),
    },
}
"""Random questions that were answered so: with joints, caps, given wrenches, single hands."""

FEW = {
    "infeasible": {"plain": (5, 58), "with joints": (24, 36), "request": (3, 82, 90, 93)},
    "overloaded": {"plain": (7, 46), "with joints": (0, 7, 37), "request": (6, 55)},
}
"""Of them some that stand for all, where all would take long."""

BEYOND_HELP = (23, 44, 46, 91, 102, 109, 124, 126)
"""Of the first thirty plain ones of three or four hands that are overloaded, those that no advice
helps, as no combination of all that is tried holds."""

OUT_OF_PLANS = (85, 119)
"""Of the same, those for which all plans of advice are made before its search has ended."""

few_and_all = pytest.mark.parametrize(
    "seeds", [FEW, pytest.param(SEEDS, marks=pytest.mark.slow)], ids=["few", "all"]
)


@cache
def _answered(kind: str, seed: int) -> tuple[str, Question, Plan]:
    question = KINDS[kind](seed)
    return f"{kind} {seed}", question, plan(question)


def explained(
    status: str, seeds: dict[str, dict[str, tuple[int, ...]]]
) -> list[tuple[str, Question, Plan]]:
    """Random questions that are answered with a status, and their answers."""
    answers = [_answered(kind, seed) for kind, some in seeds[status].items() for seed in some]
    found = [each for each in answers if each[2].status == status]
    assert len(found) >= 0.8 * len(answers)
    return found
