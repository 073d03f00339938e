"""A stance that is known: settled once, and asked about body wrench after body wrench."""

from __future__ import annotations

import time
from dataclasses import replace

from hand_models.base import Array, finite_vector
from planner.question import Question, checked_body_wrench
from planner.result import Plan
from planner.solving.prepared_checks import prepare_checks
from planner.solving.prepared_stance import checked_question, prepare_stance
from planner.solving.solve import plan_on

__all__ = ["KnownStance"]


class KnownStance:
    """A stance on its holds, for a planner that asks about one body wrench after the other.

    Hands are settled, joints found and sets computed once; a query pays for its solver and for the
    check of its plan.

    Parameters
    ----------
    question : Question
        The stance, and what is asked of it; limits, objective and extras hold for every wrench.
        Its joints' torques stay those of its load.

    Raises
    ------
    InvalidInputError
        If the question cannot be understood; its ``field`` is relative to the question.
    """

    def __init__(self, question: Question) -> None:
        prepared = prepare_stance(checked_question(question))
        hands = prepared.hands
        # what joints bear changes with the wrench
        if prepared.where is None and question.stance.joints is None and not hands.floating:
            checks = prepare_checks(question, None, prepared.batch, hands)
            prepared = prepared._replace(checks=checks)
        self.prepared = prepared

    def plan(self, body_wrench: Array) -> Plan:
        """Answer for another body wrench, as `planner.solving.plan` would.

        Parameters
        ----------
        body_wrench : ndarray, shape (6,)
            In B [N, N·m].

        Raises
        ------
        InvalidInputError
            If it is not six finite numbers, or absurdly large.
        """
        start = time.perf_counter()
        wrench = checked_body_wrench(finite_vector(body_wrench, 6, "body_wrench"), "body_wrench")
        prepared = self.prepared
        question = replace(prepared.question, body_wrench=wrench)
        hands = prepared.hands.turned(wrench)
        return plan_on(prepared._replace(question=question, hands=hands, wrench=wrench), start)
