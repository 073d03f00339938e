"""Rows that a hand's set gains in a stance: its limb's joints, a cap on its force, small changes.

All are rows of the hand's `WrenchSpace { o + V y }`, so programs, prices and proofs treat them like
any other:

- a joint bears ``|τ_g + Jᵀ (o + V y)| ≤ u τ_max``, τ_g from gravity and acceleration, J of H;
- a hand's force on the rock, in a named frame, is at most u times a cap;
- a tendon's tension changes by no more than so much from what it is now (hard).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS, HELD
from hand_models.wrench_spaces import Row, WrenchSpace
from planner.programs import JOINT_TORQUE

__all__ = ["FORCE_CAP", "NOTHING", "TENSION_CHANGE", "JointLoads", "StanceConstraints"]

FORCE_CAP: Final = "force_cap"
"""Name of the limit rows of a cap on a hand's force."""

TENSION_CHANGE: Final = "tension_change"
"""Name of the hard rows that keep tensions near the present ones."""

KEPT: Final = 256
"""Lists of names that are kept."""

AXES: Final = ("fx", "fy", "fz")

BALL: Final = np.vstack([HELD, HELD[8:] * [1.0, 1.0, -1.0]])
"""Directions (26, 3) whose largest product with a force is at least its size: `HELD` and, toward
the rock, its mirror image."""

BALL_ROWS: Final = tuple(
    Row(None, None, FORCE_CAP, "limit", f"{FORCE_CAP}/{k + 1}") for k in range(len(BALL))
)
"""Names of the limit rows of a cap whatever the direction."""


class JointLoads(NamedTuple):
    """What a limb's joints bear: ``gravity + Jᵀ w`` for the hand's wrench w on the rock, in H.

    Attributes
    ----------
    names : tuple of str, length n
    gravity : ndarray, shape (n,)
        Torque at no wrench, from gravity and the body's acceleration [N·m].
    jacobian : ndarray, shape (6, n)
        Of H, in H.
    limits : ndarray, shape (n,)
        [N·m]
    """

    names: tuple[str, ...]
    gravity: Array
    jacobian: Array
    limits: Array

    def torques(self, wrench: Array) -> Array:
        """Return the joints' torques for a hand's wrench on the rock, shape (n,) [N·m]."""
        return np.asarray(self.gravity + self.jacobian.T @ wrench)


class _Block(NamedTuple):
    """Limit rows ``D w + d0 ≤ u s`` of a hand's wrench w, and hard rows ``C w ≤ 0``."""

    rows: tuple[Row, ...]
    D: Array
    d0: Array
    s: Array
    hard: tuple[Row, ...] = ()
    C: Array = np.zeros((0, 6))


@dataclass(frozen=True, eq=False)
class StanceConstraints:
    """What a stance adds to the set of one hand.

    Attributes
    ----------
    joints : JointLoads or None
    cap : tuple of (float, float) of length 3, or float, or None
        Least and largest force along each axis of a frame, or the largest force whatever its
        direction [N].
    frame : ndarray, shape (3, 3)
        Axes of that frame in H, as columns.
    present : ndarray, shape (4,), or None
        Present tensions [N].
    change : float
        Largest change from those [N].
    """

    joints: JointLoads | None = None
    cap: tuple[tuple[float, float], ...] | float | None = None
    frame: Array | None = None
    present: Array | None = None
    change: float = np.inf

    def on(self, space: WrenchSpace) -> WrenchSpace:
        """Return a hand's set with these rows."""
        if self.joints is None and self.cap is None and not self._keeps_tensions:
            return space
        blocks = [block for block in (self._joint_rows(), self._cap_rows()) if block is not None]
        hard, H, h = self._change_rows(space)
        # wrench rows stay last among the limit rows
        apart = len(space.s) - len(space.D)
        D = np.concatenate([np.zeros((0, 6)), *(block.D for block in blocks)])
        d0 = np.concatenate([np.zeros(0), *(block.d0 for block in blocks)])
        s = np.concatenate([np.zeros(0), *(block.s for block in blocks)])
        C = np.concatenate([np.zeros((0, 6)), *(block.C for block in blocks)])
        limits = tuple(row for block in blocks for row in block.rows)
        constraints = tuple(row for block in blocks for row in block.hard)
        return WrenchSpace(
            origin=space.origin,
            generators=space.generators,
            columns=space.columns,
            rows=_joined(space.rows, apart, limits, constraints + hard),
            L=np.concatenate([space.L[:apart], D @ space.generators, space.L[apart:]]),
            l0=np.concatenate([space.l0[:apart], D @ space.origin + d0, space.l0[apart:]]),
            s=np.concatenate([space.s[:apart], s, space.s[apart:]]),
            H=np.concatenate([space.H, C @ space.generators, H]),
            h=np.concatenate([space.h, -(C @ space.origin), h]),
            D=space.D,
        )

    @property
    def _keeps_tensions(self) -> bool:
        return self.present is not None and math.isfinite(self.change)

    def _joint_rows(self) -> _Block | None:
        joints = self.joints
        if joints is None:
            return None
        turned = joints.jacobian.T
        return _Block(
            rows=_joint_names(joints.names),
            D=np.concatenate([turned, -turned]),
            d0=np.concatenate([joints.gravity, -joints.gravity]),
            s=np.concatenate([joints.limits, joints.limits]),
        )

    def _cap_rows(self) -> _Block | None:
        if self.cap is None:
            return None
        if not isinstance(self.cap, tuple):
            sizes = np.full(len(BALL), float(self.cap))
            return _Block(BALL_ROWS, _of_force(BALL), np.zeros(len(BALL)), sizes)
        assert self.frame is not None
        limits: list[tuple[Row, Array, float]] = []
        hard: list[tuple[Row, Array]] = []
        for name, axis, (low, high) in zip(AXES, self.frame.T, self.cap, strict=True):
            for sign, direction, most in (("+", axis, high), ("-", -axis, -low)):
                label = f"{FORCE_CAP}/{name}{sign}"
                if most == 0.0:
                    hard.append((Row(None, None, FORCE_CAP, "hard", label), direction))
                elif np.isfinite(most):
                    limits.append((Row(None, None, FORCE_CAP, "limit", label), direction, most))
        return _Block(
            rows=tuple(row for row, _, _ in limits),
            D=_of_force(np.array([d for _, d, _ in limits]).reshape(-1, 3)),
            d0=np.zeros(len(limits)),
            s=np.array([most for _, _, most in limits]),
            hard=tuple(row for row, _ in hard),
            C=_of_force(np.array([d for _, d in hard]).reshape(-1, 3)),
        )

    def _change_rows(self, space: WrenchSpace) -> tuple[tuple[Row, ...], Array, Array]:
        rows: list[Row] = []
        entries: list[tuple[int, float]] = []
        most: list[float] = []
        if self.present is not None and self._keeps_tensions:
            for i, finger in enumerate(FINGERS):
                if f"{finger}/tension" not in space.columns:
                    continue
                column = space.columns.index(f"{finger}/tension")
                for kind, sign in (("up", 1.0), ("down", -1.0)):
                    label = f"{finger}/{TENSION_CHANGE}/{kind}"
                    rows.append(Row(finger, None, TENSION_CHANGE, "hard", label))
                    entries.append((column, sign))
                    most.append(self.change + sign * float(self.present[i]))
        H = np.zeros((len(rows), len(space.columns)))
        for row, (column, sign) in enumerate(entries):
            H[row, column] = sign
        return tuple(rows), H, np.array(most)


NOTHING: Final = StanceConstraints()
"""No rows."""


@lru_cache(maxsize=KEPT)
def _joined(
    names: tuple[Row, ...], apart: int, limits: tuple[Row, ...], hard: tuple[Row, ...]
) -> tuple[Row, ...]:
    """Return the names of a set's rows with further limit rows, after so many, and hard rows."""
    return (*names[:apart], *limits, *names[apart:], *hard)


@lru_cache(maxsize=KEPT)
def _joint_names(joints: tuple[str, ...]) -> tuple[Row, ...]:
    return tuple(
        Row(None, None, JOINT_TORQUE, "limit", f"{JOINT_TORQUE}/{name}{sign}", name)
        for sign in "+-"
        for name in joints
    )


def _of_force(directions: Array) -> Array:
    """Return rows (n, 6) of a wrench that take directions (n, 3) of its force."""
    rows = np.zeros((len(directions), 6))
    rows[:, :3] = directions
    return rows
