"""Set-points of compliant wrists: solved one after the other, each beginning at the last."""

from __future__ import annotations

import time

from hand_models.base import Array, UnsupportedError
from planner.question import Question
from planner.result import Finding, SetPoints
from planner.solving import KnownStance
from planner.streaming.answered_points import PointsAfterSlips, answered_points

__all__ = ["CompliantPoints"]


class CompliantPoints:
    """Set-points of a stance with compliant wrists. Not thread-safe: `WrenchStream` has a lock.

    A small change of the wrench takes few linearisations of the sets at the last set-point
    (`planner.floating.next_plan`), a large one a search. Each set-point is a verified plan.

    Parameters
    ----------
    question : Question
        The stance, with compliant, or compliant and fixed wrists, and its limits.

    Attributes
    ----------
    limbs : tuple of str
        Limbs of the hands, in the order of all arrays.
    columns : tuple of tuple of str
        Names of each hand's loads: of a compliant hand the tensions and the wrist's twist.
    first : ndarray, shape (6,)
        Body wrench of the question, in B [N, N·m].
    """

    newest = None
    """Plans are not interpolated."""
    coming = None
    """No thread solves anything ahead."""

    def __init__(self, question: Question) -> None:
        self._known = known = KnownStance(question)
        self.first = known.prepared.wrench
        self.limbs = known.prepared.limbs
        self.columns = tuple([space.columns for space in known.prepared.hands.spaces])

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the stance and the numbers of its question."""
        return self._known.findings

    def close(self) -> None:
        """Do nothing: there is no thread to end."""

    def after_slips(self) -> PointsAfterSlips:
        """Refuse tiles that have slipped."""
        raise UnsupportedError(
            "not available with compliant wrists, which then go elsewhere: valid is fixed",
            field="lost",
        )

    def find(self, wrench: Array) -> SetPoints:
        """Return the set-points for a body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        found = self._known.answer(wrench, time.perf_counter())
        return answered_points(found, wrench, self.columns)
