"""Set-points from whole answers of a stance: of compliant wrists, and after tiles have slipped."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.prepare import PreparedStance
from planner.question import LostTile
from planner.recovery import Recovery
from planner.result import SetPoints
from planner.solving import Infeasible, StanceAnswer, Verified

__all__ = ["PointsAfterSlips", "answered_points"]


def answered_points(
    found: StanceAnswer, wrench: Array, columns: Sequence[tuple[str, ...]]
) -> SetPoints:
    """Return the set-points of an answer.

    Parameters
    ----------
    found : StanceAnswer
    wrench : ndarray, shape (6,)
        Body wrench that is planned for, in B [N, N·m].
    columns : sequence of tuple of str
        Names of each hand's loads.
    """
    answer = found.answer
    if isinstance(answer, Infeasible):
        return SetPoints("infeasible", wrench, verified=True, reason=found.reason)
    if not isinstance(answer, Verified):
        return SetPoints("failed", wrench, verified=False, reason=found.reason)
    arrays = answer.arrays
    torque, current, angle = arrays.drives.reshape(3, -1, len(FINGERS))
    loads = np.zeros((len(columns), max(map(len, columns))))
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
        wrists=arrays.wrists if any(arrays.wrists) else None,
    )


class PointsAfterSlips:
    """Set-points of a stance with fixed wrists, without tiles that have slipped.

    Parameters
    ----------
    prepared : PreparedStance
        The stance before tiles slipped.

    Raises
    ------
    UnsupportedError
        As by `Recovery`.
    """

    def __init__(self, prepared: PreparedStance) -> None:
        self._recovery = Recovery(prepared)
        self._columns = tuple([space.columns for space in prepared.hands.spaces])
        # the first program sets up the solver
        self._recovery.plan(())

    @property
    def tiles(self) -> tuple[LostTile, ...]:
        """All tiles that can slip."""
        return self._recovery.tiles

    def look_ahead(self) -> None:
        """Work out what the loss of two tiles of a finger takes, before it is asked for."""
        self._recovery.look_ahead()

    def find(self, wrench: Array, lost: Sequence[LostTile]) -> SetPoints:
        """Return the set-points for a body wrench (6,) in B [N, N·m], without lost tiles.

        Raises
        ------
        InvalidInputError
            If a tile is not on the rock in this stance; the field is ``lost[i]``.
        """
        found = self._recovery.plan(lost, wrench)
        points = answered_points(found.found, wrench, self._columns)
        return replace(
            points, lost=found.lost, released=found.released, save_first=found.save_first
        )
