"""Wrist pose for a given wrench: the inverse of a hand's compliance, by least squares (5.4.2).

    min |w − w_g(ξ)|² over ξ, forces in newtons and moments over a length,

with w the given wrench and w_g(ξ) that of the wrist's pose ξ, by Powell's dogleg steps (a trust
region method) with the exact stiffness K_g. They converge quadratically where the paper's gradient
descent creeps, and turn toward the gradient at a kink (a contact that runs out of its tile, a
tendon that begins to slip). Where steps go back and forth over the kink of the palm, the palm is
taken as carrying or free throughout, in each combination in turn. Where all that fails, steps
start again at a few other poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, finite_vector
from hand_models.compliance.compliant_hand import CompliantHand
from hand_models.compliance.directional_limit import pose_units
from hand_models.compliance.floating_wrist import WRIST_COLUMNS
from hand_models.compliance.grasp import complex_steps, slopes
from hand_models.compliance.link import Numbers
from hand_models.wrench_spaces import WRENCH_SCALE

__all__ = ["WristPose", "wrist_pose"]


@dataclass(frozen=True, eq=False)
class WristPose:
    """Pose of the wrist that was found for a wrench.

    Attributes
    ----------
    twist : ndarray, shape (6,)
        ξ, twist of the hand frame H about its origin at rest [m, rad].
    residual : ndarray, shape (6,)
        Given wrench minus the wrench at the pose, w − w_g(ξ) [N, N·m].
    converged : bool
        Whether the residual is below the tolerance of forces.
    """

    twist: Array
    residual: Array
    converged: bool


def wrist_pose(hand: CompliantHand, wrench: ArrayLike) -> WristPose:
    """Return the pose of the wrist at which a hand exerts a wrench on the rock.

    Parameters
    ----------
    hand : CompliantHand
    wrench : array_like, shape (6,)
        Wrench on the rock, in the hand frame H at rest [N, N·m].

    Returns
    -------
    WristPose
        The first pose at which the search converges, begun at rest and then farther out; if it
        never does, the pose of least residual. Limits are not checked.

    Raises
    ------
    InvalidInputError
        If the wrench is not six finite numbers.
    """
    wanted = finite_vector(wrench, 6, "wrench")
    # poses that steps begin anew at, up to so far from the first in `pose_units`
    other_starts, farthest_start = 8, 2.0
    directions = np.random.default_rng(0).normal(size=(other_starts, 6)) * pose_units(WRIST_COLUMNS)
    shares = np.linspace(0.0, farthest_start, other_starts + 1)[1:]
    palm, found = hand.settled.palm, list[WristPose]()
    nearest = [max(0.0, palm.nearest_gap)] if palm.engaged else []
    for start in (np.zeros(6), *(shares[:, None] * directions)):
        # from there, and where the palm's springs begin
        for inward in (0.0, *nearest):
            found.append(_nearest(hand, wanted, start + inward * np.eye(6)[2]))
            if found[-1].converged:
                return found[-1]
    return min(found, key=lambda pose: float(np.abs(pose.residual * WRENCH_SCALE).max()))


def _nearest(hand: CompliantHand, wanted: Array, first: Array) -> WristPose:
    """Return the pose of least residual that steps from a first pose lead to."""
    units = pose_units(WRIST_COLUMNS)

    def wrenches(twists: Numbers) -> Numbers:
        return np.asarray(hand.loads(twists).wrenches * WRENCH_SCALE)

    def residual(x: Array) -> Array:
        left = wrenches((x * units)[None])[0] - wanted * WRENCH_SCALE
        return np.asarray(np.where(np.isfinite(left), left, 1e6))  # where a phalanx finds no rock

    def jacobian(x: Array) -> Array:
        return np.nan_to_num(slopes(wrenches(complex_steps(x * units)))) * units

    at = first
    if np.abs(residual(first / units)).max() > BASE_TOLERANCES.force:
        finest = 1e-14  # relative change of pose or residual at which steps end
        found = scipy.optimize.least_squares(
            residual,
            first / units,
            jacobian,
            method="dogbox",
            ftol=finest,
            xtol=finest,
            gtol=finest,
            max_nfev=40,
        )
        at = found.x * units
    left = wanted - hand.loads(at[None]).wrenches[0]
    return WristPose(at, left, float(np.abs(left * WRENCH_SCALE).max()) <= BASE_TOLERANCES.force)
