"""A stance that is known: settled once, and asked about body wrench after body wrench."""

from __future__ import annotations

import time

from hand_models.base import Array, finite_vector
from planner import deadline
from planner.prepare import prepare_stance
from planner.question import Question, checked_body_wrench
from planner.result import Plan
from planner.solving.prepared_checks import PreparedChecks, prepare_checks
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
        self.prepared = prepared = prepare_stance(question)
        self._checks: PreparedChecks | None = None
        # what joints bear changes with the wrench
        if prepared.where is None and question.stance.joints is None and not prepared.floating:
            self._checks = prepare_checks(prepared)

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
        with deadline.within(self.prepared.question.deadline, started=start):
            return plan_on(self.prepared.turned(wrench), start, self._checks)
