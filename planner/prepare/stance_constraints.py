"""Rows that a stance adds to a hand's wrench space: joint torques, force caps, tension changes.

Each is a row of the hand's `WrenchSpace { o + V y }` (wrench o + V y on the rock for loads y), so
programs, shadow prices and certificates treat them like any other row. u is the utilisation:

- a joint's torque is within ``|τ_g + Jᵀ (o + V y)| ≤ u τ_max``, τ_g from gravity and acceleration,
  J the limb's Jacobian in the hand frame H; a joint without a motor has torque zero (hard row);
- a hand's force on the rock, in a named frame, is at most u times a cap;
- a tendon's tension differs from its present value by at most a given change (hard row).

A hold margin and a least tension tighten hard rows that the set already has.
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
"""Name of the limit rows that cap a hand's force."""

TENSION_CHANGE: Final = "tension_change"
"""Name of the hard rows that keep tensions near the present ones."""

PASSIVE_JOINT: Final = "passive_joint"
"""Name of the hard rows of a joint without a motor."""

FORCE_DIRECTIONS: Final = np.vstack([HELD_DIRECTIONS, HELD_DIRECTIONS[8:] * [1.0, 1.0, -1.0]])
"""Directions (26, 3), little longer than unit vectors, whose largest product with a force is at
least the force's size.

They are `HELD_DIRECTIONS` and their mirror images toward the rock, except for the first eight,
which lie in the palm's plane."""


@dataclass(frozen=True, slots=True)
class PrepareTolerances:
    """Tolerances below which numbers of a stance count as zero."""

    hand_offset: float = 0.01  # [m] of a hand's pose from where its joints put it
    hand_turn: float = 0.05  # [rad] of its axes from those that its joints give
    body_wrench: float = 1e-9
    """Largest body wrench, in `WRENCH_UNIT`, that counts as zero: it has no load factor."""


TOLERANCES: Final = PrepareTolerances()


class JointLoads(NamedTuple):
    """Loads of a limb's joints as a function of the hand's wrench w: ``gravity + Jᵀ w``.

    w is the wrench on the rock, in the hand frame H. Of prismatic joints, loads are forces [N].

    Attributes
    ----------
    names : tuple of str, length n
        Names of the joints, from the body outward.
    sliding : ndarray of bool, shape (n,)
        True for prismatic joints.
    gravity : ndarray, shape (n,)
        Torques for no wrench, from gravity and the body's acceleration [N·m].
    jacobian : ndarray, shape (6, n)
        Jacobian J of the hand frame H, in H.
    limits : ndarray, shape (n,)
        Torque limits [N·m]; zero for a joint without a motor.
    """

    names: tuple[str, ...]
    sliding: NDArray[np.bool_]
    gravity: Array
    jacobian: Array
    limits: Array

    def of(self, which: NDArray[np.bool_]) -> JointLoads:
        """Return the loads of the joints selected by a boolean mask, shape (n,)."""
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
        """Return the joint torques for a hand's wrench on the rock in H, shape (n,) [N·m]."""
        return np.asarray(self.gravity + self.jacobian.T @ wrench)


@dataclass(frozen=True, eq=False)
class StanceConstraints:
    """Constraints that a stance adds to the wrench space of one hand.

    Attributes
    ----------
    joints : JointLoads or None
        Loads and limits of the limb's joints; None if joints are not known.
    cap : tuple of (float, float) of length 3, or float, or None
        Least and largest force along each axis of ``frame``, or the largest force in any direction
        [N]; None: no cap.
    frame : ndarray, shape (3, 3), or None
        Axes of the cap's frame, as columns in the hand frame H.
    present : ndarray, shape (4,), or None
        Present tensions of the tendons [N].
    change : float
        Largest change from the present tensions [N].
    margin : float
        Force by which each tile must stay short of being dragged backward, and each bare frame must
        press on the rock [N].
    least : float
        Least tension of every tendon [N].
    palm : float
        Force with which the palm must press on the rock [N].
    """

    joints: JointLoads | None = None
    cap: tuple[tuple[float, float], ...] | float | None = None
    frame: Array | None = None
    present: Array | None = None
    change: float = np.inf
    margin: float = 0.0
    least: float = 0.0
    palm: float = 0.0

    def on(self, space: WrenchSpace) -> WrenchSpace:
        """Return a hand's wrench space with the constraints added as rows.

        Limit rows are ``D w + d0 ≤ u s``, of the hand's wrench w, utilisation u and capacities s.
        Hard rows bound w or the tensions.
        """
        if self.margin or self.least or self.palm:
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
            hard += [
                Row(finger, None, TENSION_CHANGE, "hard", f"{finger}/{TENSION_CHANGE}/{way}")
                for finger in FINGERS
                for way in ("up", "down")
            ]
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
            "palm_pressing_reversed": self.palm,
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
"""Constraints that add no rows."""
