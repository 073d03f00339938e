"""Set-points of compliant wrists: solved one after the other, each beginning at the last."""

from __future__ import annotations

import time

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.question import Question
from planner.result import SetPoints
from planner.solving import Infeasible, KnownStance, Verified

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

    def close(self) -> None:
        """Do nothing: there is no thread to end."""

    def find(self, wrench: Array) -> SetPoints:
        """Return the set-points for a body wrench.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            Wrench that the rock must exert on the robot, in B [N, N·m].
        """
        found = self._known.answer(wrench, time.perf_counter())
        answer = found.answer
        if isinstance(answer, Infeasible):
            return SetPoints("infeasible", wrench, verified=True, reason=found.reason)
        if not isinstance(answer, Verified):
            return SetPoints("failed", wrench, verified=False, reason=found.reason)
        arrays = answer.arrays
        torque, current, angle = arrays.drives.reshape(3, -1, len(FINGERS))
        loads = np.zeros((len(self.columns), max(map(len, self.columns))))
        for row, y in zip(loads, answer.solution.loads, strict=True):
            row[: len(y)] = y
        return SetPoints(
            status="optimal" if found.optimal else "overloaded",
            body_wrench=wrench,
            verified=True,
            utilisation=answer.whole,
            gap=max(answer.whole - max(answer.solution.least.value, found.checks.idle_use), 0.0),
            tensions=arrays.tensions.reshape(-1, len(FINGERS)),
            wrenches=arrays.wrenches,
            loads=loads,
            winch_angle=angle,
            motor_torque=torque,
            motor_current=current,
            reason=found.reason,
            wrists=arrays.wrists,
        )
