"""Joint angles for poses of the hands: first any that put them there, then such that bear less."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from hand_models.base import Array, InvalidInputError, Pose
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.pose_search import TOLERANCE, find_angles, starts_near
from planner.robots.robot import Robot
from planner.robots.torque_lowering import lower_torques

__all__ = ["UnreachableError", "solve_limbs"]

STARTS: Final = 2
"""Postures from which a pose out of reach is approached, beside the best found."""

FIRST: Final = 300.0
"""How much heavier what comes first counts than what comes second."""

STEPS: Final = 40
"""Most steps from a start."""

PLACED: Final = 1e-3
"""Distance up to which a hand counts as in its place [m]."""

TURNED: Final = 2e-3
"""Angle up to which it counts as turned as asked [rad]."""


class UnreachableError(InvalidInputError):
    """Poses of hands that no joint angles were found for.

    Parameters
    ----------
    missing : mapping of str to float
        By limb: the distance that is missing [m].
    turned : mapping of str to float
        By limb, of those whose place is within reach, but not with these axes: the angle that is
        missing there [rad].
    field : str, optional
    """

    kind = "unreachable"

    def __init__(
        self,
        missing: Mapping[str, float],
        turned: Mapping[str, float],
        *,
        field: str | None = None,
    ) -> None:
        said = []
        for limb, distance in missing.items():
            if limb in turned and distance <= PLACED:
                said.append(f"{limb} cannot be turned as asked, by {turned[limb]:.2g} rad")
                continue
            near = f" (turned by {turned[limb]:.2g} rad it is there)" if limb in turned else ""
            said.append(f"{limb} is out of reach by {distance:.2g} m{near}")
        super().__init__("; ".join(said), field=field)
        self.missing = dict(missing)
        self.turned = dict(turned)


def solve_limbs(
    robot: Robot, poses: Mapping[str, Pose], loads: Mapping[str, Array], gravity: Array
) -> dict[str, Array]:
    """Return joint angles for poses of the hands, within the joints' limits, shape (n,) each [rad].

    The same question always has the same answer. A limb of more than six joints uses what its pose
    leaves open to lower Σ (τ / τ_max)²; one of fewer than six reaches few poses.

    Parameters
    ----------
    robot : Robot
    poses : mapping of str to Pose
        H in B, by limb.
    loads : mapping of str to ndarray, shape (6,)
        Wrench that a hand is to exert on the rock, in H [N, N·m]; none where it is left out.
    gravity : ndarray, shape (3,)
        In B [m/s²]. Without gravity and loads there is no torque to lower.

    Raises
    ------
    UnreachableError
        That names every limb whose pose is not solved.
    DeadlineError
        If the time is over before.
    """
    batch = LimbBatch(robot, poses, loads, gravity)
    angles = lower_torques(batch, find_angles(batch))
    solved = np.abs(batch.errors(angles[None])[0][0]).max(axis=1) <= TOLERANCE
    if solved.all():
        parts = zip(poses, angles, batch.joints, strict=True)
        return {limb: mine[:n] for limb, mine, n in parts}
    missing, turned = {}, {}
    for i in np.flatnonzero(~solved).tolist():
        deadline.check("it was known how far a hand is out of reach")
        limb = batch.limbs[i]
        missing[limb], angle = _lacking(batch, i, angles[i, : batch.joints[i]])
        if angle is not None:
            turned[limb] = angle
    raise UnreachableError(missing, turned)


def _lacking(batch: LimbBatch, i: int, best: Array) -> tuple[float, float | None]:
    """Return what a pose lacks that no joint angles give.

    From several starts, the hand is put in its place and turned as far as that lets it; and it is
    turned as asked and brought as near as that lets it.

    Returns
    -------
    missing : float
        How far away the hand stays, turned as asked if it can be, and not less than the pose is
        beyond the stretched limb [m].
    turned : float or None
        Where the place is within reach, but not with these axes: the angle that is missing there
        [rad].
    """
    part = batch.part(np.array([i]))
    starts = [best, *starts_near(batch, i, 0)[:STARTS, : batch.joints[i]]]
    place, turn = _nearest(part, starts, FIRST, 1.0)
    way, askew = _nearest(part, starts, 1.0, FIRST)
    # without a posture that is turned as asked, what is told is how far away the place is
    missing = way if askew <= TURNED else place
    beyond = float(batch.beyond[i])
    if beyond > 0.0 and missing <= beyond + PLACED:
        missing = beyond
    return missing, turn if place <= PLACED else None


def _nearest(
    limb: LimbBatch, starts: Sequence[Array], place: float, turn: float
) -> tuple[float, float]:
    """Return a hand's distance [m] and angle [rad] where their weighted sum of squares is least."""
    (pose,), (reach,) = limb.poses.values(), limb.reach.tolist()

    def weighed(angles: Array) -> Array:
        way, turned = limb.errors(angles[None, None])[0].reshape(2, 3)
        return np.concatenate([place * reach * _axes(pose, turned) @ way, turn * turned])

    def slope(angles: Array) -> Array:
        errors, jacobians = limb.errors(angles[None, None])
        turned, (linear, angular) = errors[0, 0, 3:], np.split(jacobians[0, 0], 2)
        # Jₗ⁻¹(r), which is Jᵣ⁻¹(r)ᵀ, is how a rotation vector r changes with a rotation before it
        turning = pin.Jlog3(pin.exp3(turned)).T
        return -np.vstack([place * reach * _axes(pose, turned) @ linear, turn * turning @ angular])

    low, high = limb.lower[0], limb.upper[0]
    ends = [
        least_squares(weighed, np.clip(start, low, high), slope, bounds=(low, high), max_nfev=STEPS)
        for start in starts
    ]
    way, turned = weighed(min(ends, key=lambda end: float(end.cost)).x).reshape(2, 3)
    return float(np.linalg.norm(way)) / place, float(np.linalg.norm(turned)) / turn


def _axes(pose: Pose, turned: Array) -> Array:
    """Return a hand's axes in B, shape (3, 3), that lack a turn (3,) in H to those of a pose."""
    return np.asarray(pose.rotation @ pin.exp3(-turned))
