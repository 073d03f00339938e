"""From a wrench to the pose of the wrist that gives it: damped Newton steps (Section 5.4.2).

    ξ ← ξ + t K_g(ξ)⁺ (w − w_g(ξ)),

with K_g exact, so that steps converge quadratically where the paper's gradient descent creeps, and
with the share t halved until the residual falls, so that they do not overshoot where the contacts'
forces change fast. At a kink (a contact that runs out of its tile, a tendon that begins to slip) a
step may not help whatever its length; then the damping of Levenberg and Marquardt turns it toward
the gradient. Where steps go back and forth over the kink of the palm, which carries much or
nothing, it is taken as carrying or free throughout, in each way in turn. Where all that fails,
steps begin anew at a few other poses.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, finite_vector
from hand_models.compliance.compliant_finger import STEP
from hand_models.compliance.compliant_hand import CompliantHand
from hand_models.compliance.directional_limit import pose_units
from hand_models.compliance.floating_wrist import WRIST
from hand_models.compliance.rolling import Numbers
from hand_models.wrench_spaces import SCALE

__all__ = ["WristPose", "wrist_pose"]

TOLERANCE: Final = 1e-9
"""Largest residual of a converged pose, in newtons (moments over a length), over 1 N."""

STEPS: Final = 25
"""Of one way of taking the palm, at most."""

SHORTEST: Final = 2.0**-8
"""The least share of a Newton step that is tried before damping."""

DAMPING: Final = (1e-6, 1e-4, 1e-2, 1.0)
"""Levenberg's, relative to the largest singular value, tried in turn."""

RANK: Final = 1e-9
"""Singular values below this share of the largest count as zero: motions that load nothing."""

OTHER_STARTS: Final = 8
"""Poses that steps begin anew at, up to `FARTHEST_START` from the first in `pose_units`."""

FARTHEST_START: Final = 2.0

TINY: Final = float(np.finfo(float).tiny)

LONGEST: Final = 5.0
"""Of a step, in millimetres or in hundredths of a radian."""


@dataclass(frozen=True, eq=False)
class WristPose:
    """A pose of the wrist found for a wrench.

    Attributes
    ----------
    twist : ndarray, shape (6,)
        ξ about H at rest [m, rad].
    residual : ndarray, shape (6,)
        w − w_g(ξ) [N, N·m].
    steps : int
        Taken.
    converged : bool
    """

    twist: Array
    residual: Array
    steps: int
    converged: bool


def wrist_pose(hand: CompliantHand, wrench: ArrayLike, start: ArrayLike | None = None) -> WristPose:
    """Return the pose of the wrist at which a hand exerts a wrench on the rock.

    Parameters
    ----------
    hand : CompliantHand
    wrench : array_like, shape (6,)
        In H at rest [N, N·m].
    start : array_like, shape (6,), optional
        Pose to begin at [m, rad]; rest by default.

    Returns
    -------
    WristPose
        The nearest that was found, if none is exact; limits are not looked at.
    """
    wanted = finite_vector(wrench, 6, "wrench")
    first = np.zeros(6) if start is None else finite_vector(start, 6, "start")
    found = _reached(hand, wanted, first)
    steps = found.steps
    ways = np.random.default_rng(0).normal(size=(OTHER_STARTS, 6)) * pose_units(WRIST)
    for share, way in zip(
        np.linspace(0.0, FARTHEST_START, OTHER_STARTS + 1)[1:], ways, strict=True
    ):
        if found.converged:
            break
        tried = _reached(hand, wanted, first + share * way)
        steps += tried.steps
        found = min(found, tried, key=_size)
    return replace(found, steps=steps)


def _reached(hand: CompliantHand, wanted: Array, first: Array) -> WristPose:
    """Return what Newton's steps find from a pose, taking the palm in each way in turn."""
    ways: list[Array | None] = [None]
    if hand.settled.palm.engaged:
        ways += [np.array(way) for way in itertools.product((False, True), repeat=2)]
    found: list[WristPose] = []
    steps = 0
    for carries in ways:
        at, taken = _Problem(hand, wanted, carries).solve(first)
        steps += taken
        residual = wanted - hand.wrenches(hand.loads(at[None]))[0]
        exact = float(np.abs(residual * SCALE).max()) <= TOLERANCE
        found.append(WristPose(at, residual, steps, exact))
        if exact:
            return found[-1]
    return replace(min(found, key=_size), steps=steps)


def _size(pose: WristPose) -> float:
    return float(np.abs(pose.residual * SCALE).max())


class _Problem:
    """The residuals of a hand whose palm's shear and pressing carry both ways, or not at all.

    Each as ``carries`` says; with None as they are, only against the rock.
    """

    def __init__(self, hand: CompliantHand, wanted: Array, carries: Array | None) -> None:
        self._hand, self._wanted, self._carries = hand, wanted, carries
        self._units = pose_units(WRIST)

    def _wrenches(self, twists: Numbers) -> Numbers:
        loads = self._hand.loads(twists)
        if self._carries is None:
            return self._hand.wrenches(loads)
        palm = self._hand.palm_loads(twists) * self._carries
        return self._hand.wrenches(loads._replace(palm=palm))

    def solve(self, at: Array) -> tuple[Array, int]:
        """Return the pose that Newton's steps lead to, and their number."""
        residual = self._residual(at)
        for step in range(STEPS):
            if np.abs(residual).max() <= TOLERANCE:
                return at, step
            found = self._better(at, residual)
            if found is None:
                return at, step
            at, residual = found
        return at, STEPS

    def _residual(self, at: Array) -> Array:
        return np.asarray((self._wanted - self._wrenches(at[None])[0]) * SCALE)

    def _better(self, at: Array, residual: Array) -> tuple[Array, Array] | None:
        """Return a pose with a smaller residual, and that; None if no step gives one."""
        units = self._units
        slopes = self._wrenches(at + 1j * STEP * np.eye(6)).imag.T / STEP
        left, values, right = np.linalg.svd(slopes * SCALE[:, None] * units)
        inverse = np.where(values > RANK * values[0], 1.0 / np.maximum(values, TINY), 0.0)
        across = left.T @ residual
        size = float(np.linalg.norm(residual))
        step = right.T @ (inverse * across)
        share = min(1.0, LONGEST / max(float(np.abs(step).max()), TINY))
        while share >= SHORTEST:
            tried = at + share * step * units
            there = self._residual(tried)
            if np.linalg.norm(there) <= (1.0 - 0.25 * share) * size:
                return tried, there
            share *= 0.5
        for damping in DAMPING:
            weak = values / np.maximum(values**2 + (damping * values[0]) ** 2, TINY)
            step = right.T @ (weak * across)
            share = min(1.0, LONGEST / max(float(np.abs(step).max()), TINY))
            tried = at + share * step * units
            there = self._residual(tried)
            if np.linalg.norm(there) < size:
                return tried, there
        return None
