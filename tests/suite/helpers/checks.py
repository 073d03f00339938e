"""The check of plans, asked about a whole plan."""

from __future__ import annotations

from collections.abc import Sequence

from hand_models.hand import SettledHand
from planner.prepare import HandBatch, Posture, settle_hand
from planner.question import Question
from planner.result import Plan, PlanArrays
from planner.verification import Check


def problems(
    question: Question,
    answer: Plan,
    *,
    where: Posture | None = None,
    settled: Sequence[SettledHand] | None = None,
) -> list[str]:
    """What is wrong with a plan, for hands that are settled anew by default."""
    if settled is None:
        settled = [settle_hand(hand, question.stance) for hand in question.stance.hands]
    check = Check(question, HandBatch.of(settled), where)
    told = PlanArrays.of(answer.hands), answer.utilisation
    return check.problems(*told, answer.body_wrench, answer.effort)
