"""From a wrench to the pose of the wrist that gives it: least squares on exact stiffnesses (5.4.2).

    min |w − w_g(ξ)|² over ξ, forces in newtons and moments over a length,

by Powell's dogleg steps with the exact K_g, which converge quadratically where the paper's gradient
descent creeps, and turn toward the gradient at a kink (a contact that runs out of its tile, a
tendon that begins to slip). Where steps go back and forth over the kink of the palm, which carries
much or nothing, it is taken as carrying or free throughout, in each way in turn. Where all that
fails, steps begin anew at a few other poses.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from hand_models.base import Array, finite_vector
from hand_models.compliance.compliant_hand import CompliantHand
from hand_models.compliance.directional_limit import pose_units
from hand_models.compliance.floating_wrist import WRIST
from hand_models.compliance.grasp import complex_steps, slopes
from hand_models.compliance.rolling import Numbers
from hand_models.wrench_spaces import SCALE

__all__ = ["WristPose", "wrist_pose"]

TOLERANCE: Final = 1e-9
"""Largest residual of a converged pose, in newtons (moments over a length), over 1 N."""

STEPS: Final = 40
"""Of one way of taking the palm, at most."""

FINEST: Final = 1e-14
"""Relative change of pose or residual at which steps end."""

LOST: Final = 1e6
"""Residual where a phalanx finds no rock [N]."""

OTHER_STARTS: Final = 8
"""Poses that steps begin anew at, up to `FARTHEST_START` from the first in `pose_units`."""

FARTHEST_START: Final = 2.0


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
    """Return what steps find from a pose, taking the palm in each way in turn."""
    ways: list[Array | None] = [None]
    if hand.settled.palm.engaged:
        ways += [np.array(way) for way in itertools.product((False, True), repeat=2)]
    found: list[WristPose] = []
    steps = 0
    for carries in ways:
        at, taken = _least(hand, wanted, first, carries)
        steps += taken
        residual = wanted - hand.wrenches(hand.loads(at[None]))[0]
        exact = float(np.abs(residual * SCALE).max()) <= TOLERANCE
        found.append(WristPose(at, residual, steps, exact))
        if exact:
            return found[-1]
    return replace(min(found, key=_size), steps=steps)


def _size(pose: WristPose) -> float:
    return float(np.abs(pose.residual * SCALE).max())


def _least(
    hand: CompliantHand, wanted: Array, first: Array, carries: Array | None
) -> tuple[Array, int]:
    """Return the pose of least residual that steps lead to, and their number.

    Of a hand whose palm's shear and pressing carry both ways, or not at all, each as ``carries``
    says; with None as they are, only against the rock.
    """
    units = pose_units(WRIST)

    def wrenches(twists: Numbers) -> Numbers:
        loads = hand.loads(twists)
        if carries is not None:
            loads = loads._replace(palm=hand.palm_loads(twists) * carries)
        return np.asarray(hand.wrenches(loads) * SCALE)

    def residual(x: Array) -> Array:
        left = wrenches((x * units)[None])[0] - wanted * SCALE
        return np.asarray(np.where(np.isfinite(left), left, LOST))

    def jacobian(x: Array) -> Array:
        return np.nan_to_num(slopes(wrenches(complex_steps(x * units)))) * units

    start = first / units
    if np.abs(residual(start)).max() <= TOLERANCE:
        return first, 0
    found = least_squares(
        residual,
        start,
        jacobian,
        method="dogbox",
        ftol=FINEST,
        xtol=FINEST,
        gtol=FINEST,
        max_nfev=STEPS,
    )
    return found.x * units, found.nfev
