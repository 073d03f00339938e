"""Rows that a hand's set gains in a stance: its limb's joints, a cap on its force, small changes.

All are rows of the hand's `WrenchSpace { o + V y }`, so programs, prices and proofs treat them like
any other:

- a joint bears ``|τ_g + Jᵀ (o + V y)| ≤ u τ_max``, τ_g from gravity and acceleration, J of H; of
  one without a motor it is zero (hard);
- a hand's force on the rock, in a named frame, is at most u times a cap;
- a tendon's tension changes by no more than so much from what it is now (hard).

A margin on what holds at zero, and a least tension, tighten hard rows that the set has.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.hand import FINGERS, HELD_DIRECTIONS
from hand_models.wrench_spaces import Row, WrenchSpace
from planner.programs import JOINT_FORCE, JOINT_TORQUE

__all__ = [
    "FORCE_CAP",
    "NO_CONSTRAINTS",
    "PASSIVE_JOINT",
    "TENSION_CHANGE",
    "TOLERANCES",
    "JointLoads",
    "PrepareTolerances",
    "StanceConstraints",
]

FORCE_CAP: Final = "force_cap"
"""Name of the limit rows of a cap on a hand's force."""

TENSION_CHANGE: Final = "tension_change"
"""Name of the hard rows that keep tensions near the present ones."""

PASSIVE_JOINT: Final = "passive_joint"
"""Name of the hard rows of a joint without a motor."""

FORCE_DIRECTIONS: Final = np.vstack([HELD_DIRECTIONS, HELD_DIRECTIONS[8:] * [1.0, 1.0, -1.0]])
"""Directions (26, 3) whose largest product with a force is at least its size: `HELD_DIRECTIONS`
and, toward the rock, its mirror image: that of those after the first eight, which lie in the palm's
plane."""

CHANGE_ROWS: Final = tuple(
    Row(finger, None, TENSION_CHANGE, "hard", f"{finger}/{TENSION_CHANGE}/{way}")
    for finger in FINGERS
    for way in ("up", "down")
)
"""Names of the hard rows of a change of tensions."""


@dataclass(frozen=True, slots=True)
class PrepareTolerances:
    """Least size of numbers of a stance that mean something."""

    hand_offset: float = 0.01  # [m] of a hand's pose from where its joints put it
    hand_turn: float = 0.05  # [rad] of its axes from those that its joints give
    body_wrench: float = 1e-9
    """In `WRENCH_UNIT`; a smaller one is none, every multiple of it is the same."""


TOLERANCES: Final = PrepareTolerances()


class JointLoads(NamedTuple):
    """Loads of a limb's joints: ``gravity + Jᵀ w`` for the hand's wrench w on the rock, in H.

    Torques [N·m] are forces [N] of joints that slide.

    Attributes
    ----------
    names : tuple of str, length n
    sliding : ndarray of bool, shape (n,)
    gravity : ndarray, shape (n,)
        Torque at no wrench, from gravity and the body's acceleration [N·m].
    jacobian : ndarray, shape (6, n)
        Jacobian of H, in H.
    limits : ndarray, shape (n,)
        Torque limits [N·m]; zero of a joint without a motor.
    """

    names: tuple[str, ...]
    sliding: NDArray[np.bool_]
    gravity: Array
    jacobian: Array
    limits: Array

    def of(self, which: NDArray[np.bool_]) -> JointLoads:
        """Return some of the joints."""
        names = tuple(compress(self.names, which.tolist()))
        return JointLoads(
            names,
            self.sliding[which],
            self.gravity[which],
            self.jacobian[:, which],
            self.limits[which],
        )

    @property
    def driven(self) -> JointLoads:
        """Loads of the joints with a motor."""
        return self.of(self.limits > 0.0)

    @property
    def passive(self) -> JointLoads:
        """Loads of the joints without a motor."""
        return self.of(self.limits == 0.0)

    def torques(self, wrench: Array) -> Array:
        """Return the joints' torques for a hand's wrench on the rock, shape (n,) [N·m]."""
        return np.asarray(self.gravity + self.jacobian.T @ wrench)


@dataclass(frozen=True, eq=False)
class StanceConstraints:
    """Constraints that a stance adds to the set of one hand.

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
    margin : float
        Force by which tiles and bare frames are to hold [N].
    least : float
        Tension of every tendon [N].
    """

    joints: JointLoads | None = None
    cap: tuple[tuple[float, float], ...] | float | None = None
    frame: Array | None = None
    present: Array | None = None
    change: float = np.inf
    margin: float = 0.0
    least: float = 0.0

    def on(self, space: WrenchSpace) -> WrenchSpace:
        """Return a hand's set with these rows.

        Limit rows are ``D w + d0 ≤ u s`` of the hand's wrench w, hard rows ``C w ≤ 0`` or of its
        tensions.
        """
        if self.margin or self.least:
            space = self._tightened(space)
        D, d0, s = [np.zeros((0, 6))], [np.zeros(0)], [np.zeros(0)]
        H, h = [space.H], [space.h]
        limits, hard = list[Row](), list[Row]()
        if self.joints is not None:
            joints, passive = self.joints.driven, self.joints.passive
            slides = [JOINT_FORCE if each else JOINT_TORQUE for each in joints.sliding.tolist()]
            kinds = list(zip(slides, joints.names, strict=True))
            limits += _joint_rows("limit", kinds)
            hard += _joint_rows("hard", [(PASSIVE_JOINT, name) for name in passive.names])
            D += [joints.jacobian.T, -joints.jacobian.T]
            d0 += [joints.gravity, -joints.gravity]
            s += [joints.limits, joints.limits]
            C, c0 = passive.jacobian.T @ space.generators, passive.torques(space.origin)
            H += [C, -C]
            h += [-c0, c0]
        if self.cap is not None:
            ways, directions, most = self._cap()
            bounded, closed = np.isfinite(most) & (most > 0.0), most == 0.0
            limits += _force_rows("limit", compress(ways, bounded.tolist()))
            hard += _force_rows("hard", compress(ways, closed.tolist()))
            forces = np.hstack([directions, np.zeros_like(directions)])
            D.append(forces[bounded])
            d0.append(np.zeros(len(most[bounded])))
            s.append(most[bounded])
            C = forces[closed]
            H.append(C @ space.generators)
            h.append(-(C @ space.origin))
        if self.present is not None and math.isfinite(self.change):
            hard += CHANGE_ROWS
            columns = np.repeat([space.columns.index(f"{finger}/tension") for finger in FINGERS], 2)
            signs = np.tile([1.0, -1.0], len(FINGERS))
            H.append(signs[:, None] * np.eye(len(space.columns))[columns])
            h.append(self.change + signs * np.repeat(self.present, 2))
        if not (limits or hard):
            return space
        # wrench rows stay last among the limit rows
        apart, added = len(space.s) - len(space.D), np.concatenate(D)
        l0 = added @ space.origin + np.concatenate(d0)
        return WrenchSpace(
            origin=space.origin,
            generators=space.generators,
            columns=space.columns,
            rows=(*space.rows[:apart], *limits, *space.rows[apart:], *hard),
            L=np.concatenate([space.L[:apart], added @ space.generators, space.L[apart:]]),
            l0=np.concatenate([space.l0[:apart], l0, space.l0[apart:]]),
            s=np.concatenate([space.s[:apart], *s, space.s[apart:]]),
            H=np.concatenate(H),
            h=np.concatenate(h),
            D=space.D,
        )

    def _tightened(self, space: WrenchSpace) -> WrenchSpace:
        """Return a set whose hard rows hold by what the stance asks for."""
        by = {
            "slack_tendon": self.least,
            "dragged_backwards": self.margin,
            "frame_pulled": self.margin,
        }
        room = [by.get(row.limit, 0.0) for row in space.rows[len(space.s) :]]
        return replace(space, h=space.h - np.array(room))

    def _cap(self) -> tuple[tuple[str, ...], Array, Array]:
        """Return names, directions (n, 3) and sizes (n,) of what caps the hand's force."""
        if not isinstance(self.cap, tuple):
            count = len(FORCE_DIRECTIONS)
            ways = tuple(map(str, range(1, count + 1)))
            return ways, FORCE_DIRECTIONS, np.full(count, self.cap)
        assert self.frame is not None
        axes = np.stack([self.frame.T, -self.frame.T], axis=1).reshape(-1, 3)
        ways = ("fx+", "fx-", "fy+", "fy-", "fz+", "fz-")
        return ways, axes, np.array([most for low, high in self.cap for most in (high, -low)])


def _joint_rows(kind: Literal["limit", "hard"], names: Sequence[tuple[str, str]]) -> list[Row]:
    """Return rows of joints, by limit and name, turned either way."""
    return [
        Row(None, None, limit, kind, f"{limit}/{name}{sign}", name)
        for sign in "+-"
        for limit, name in names
    ]


def _force_rows(kind: Literal["limit", "hard"], ways: Iterable[str]) -> list[Row]:
    """Return rows of a cap on a hand's force."""
    return [Row(None, None, FORCE_CAP, kind, f"{FORCE_CAP}/{way}") for way in ways]


NO_CONSTRAINTS: Final = StanceConstraints()
"""No rows."""
