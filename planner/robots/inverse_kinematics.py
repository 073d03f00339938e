"""Inverse kinematics: joint angles for poses of the hands, with low joint torques.

First any angles that solve the poses are found. Then, for limbs with more than six joints, Gauss–
Newton steps lower ``Σ (τ / τ_max)²`` (τ: joint torques, τ_max: their limits) along the motions that
leave the hand in place (its null space). The next step corrects the error of the pose that one
makes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError, Pose
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.nearest_pose import angles_near, lacking, starts_beside
from planner.robots.pose_search import damped_step, find_angles
from planner.robots.robot import Robot
from planner.robots.tolerances import TOLERANCES

__all__ = ["UnreachableError", "lower_torques", "solve_limbs"]


class UnreachableError(InvalidInputError):
    """Error of hand poses for which no joint angles were found.

    Parameters
    ----------
    missing : mapping of str to float
        Distance by which the hand does not reach its position, by limb [m].
    turned : mapping of str to float
        Angle to the given orientation, by limb, for hands that reach only their position [rad].
    field : str, optional
        Field of the question that has the poses.
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
            if limb in turned and distance <= TOLERANCES.place_error:
                said.append(f"{limb} cannot be turned as asked, by {turned[limb]:.2g} rad")
                continue
            near = f" (in reach turned by {turned[limb]:.2g} rad)" if limb in turned else ""
            said.append(f"{limb} is out of reach by {distance:.2g} m{near}")
        super().__init__("; ".join(said), field=field)
        self.missing = dict(missing)
        self.turned = dict(turned)


def solve_limbs(
    robot: Robot,
    poses: Mapping[str, Pose],
    loads: Mapping[str, Array],
    gravity: Array,
    near: tuple[float, float] | None = None,
) -> dict[str, Array]:
    """Solve the inverse kinematics: return joint angles, within limits, for poses of the hands.

    The result is deterministic. A limb of more than six joints uses its redundancy to lower
    Σ (τ / τ_max)², its torques over their limits; a limb of fewer than six reaches few poses.

    Parameters
    ----------
    robot : Robot
        Robot whose limbs carry the hands.
    poses : mapping of str to Pose
        Target pose of H in B, by limb.
    loads : mapping of str to ndarray, shape (6,)
        Wrench of a hand on the rock, in H [N, N·m]; zero for a limb that is left out.
    gravity : ndarray, shape (3,)
        Acceleration of gravity, in B [m/s²]. Without gravity and loads no torque is to be lowered.
    near : tuple of float, float, optional
        Distance [m] and angle [rad] by which a hand may miss a pose that no angles solve. The hand
        is then put as near to its pose as was found. By default no pose may be missed.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        Joint angles, by limb [rad].

    Raises
    ------
    UnreachableError
        If a pose is neither solved nor approached within ``near``; the error names every such limb.
    DeadlineError
        If the deadline passes first.
    """
    batch = LimbBatch(robot, poses, loads, gravity)
    angles, solved = _solved(batch)
    found = {limb: angles[i, : batch.joints[i]] for i, limb in enumerate(poses)}
    missing, turned, approached = {}, {}, {}
    for i in np.flatnonzero(~solved).tolist():
        deadline.check("the distance of a hand out of reach was found")
        limb = batch.limbs[i]
        alone, starts = starts_beside(batch, i, found[limb])
        nearest = None if near is None else angles_near(alone, starts, near)
        if nearest is not None:
            approached[limb] = nearest
            continue
        missing[limb], angle = lacking(alone, starts)
        if angle is not None:
            turned[limb] = angle
    if missing:
        raise UnreachableError(missing, turned)
    return found | (_lowered(batch, approached) if approached else {})


def _solved(batch: LimbBatch) -> tuple[Array, NDArray[np.bool_]]:
    """Return angles (L, m) with low torques, and which limbs' poses they solve, shape (L,)."""
    angles = lower_torques(batch, find_angles(batch))
    return angles, np.abs(batch.errors(angles[None])[0][0]).max(axis=1) <= TOLERANCES.pose_error


def _lowered(batch: LimbBatch, angles: Mapping[str, Array]) -> dict[str, Array]:
    """Return angles that put hands where these do, found as if that had been asked for.

    So a pose a little beyond reach is held as one that is just within.
    """
    robot = batch.robot
    there = robot.hand_poses(angles)
    again = LimbBatch(robot, {limb: there[limb] for limb in angles}, batch.loads, batch.gravity)
    found, solved = _solved(again)
    parts = zip(angles.items(), found, solved, again.joints, strict=True)
    return {limb: mine[:n] if met else given for (limb, given), mine, met, n in parts}


def lower_torques(batch: LimbBatch, angles: Array) -> Array:
    """Return joint angles for the same hand poses, within limits, with joint torques no higher.

    Parameters
    ----------
    batch : LimbBatch
        L limbs of up to m joints, with the target poses of their hands.
    angles : ndarray, shape (L, m)
        Joint angles [rad]. A limb of at most six joints is returned unchanged, and so is a limb
        whose target pose these angles do not solve.

    Returns
    -------
    ndarray, shape (L, m)
        Joint angles [rad]. The cost Σ (τ / τ_max)² of each limb is at most that at ``angles``.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    now = _measured(batch, angles.copy())
    movable = np.abs(now.errors).max(axis=1) <= TOLERANCES.pose_error
    movable &= np.array(batch.joints) > 6  # a pose takes up six joints
    if not movable.any():
        return angles
    # damping over the sum of the curvatures falls with steps kept and grows with others
    first, damping, going = now.cost.copy(), np.full(len(angles), 1e-3), movable
    longest = 0.35  # [rad] that a joint turns in a step of lowering
    for _ in range(6):  # steps, kept or not
        deadline.check("the joint angles were found")
        back = damped_step(batch, now.angles, now.errors, now.jacobians) - now.angles
        along = _along(_idle(now.jacobians), now.efforts, now.slopes, damping)
        along *= (longest / np.maximum(np.abs(along).max(axis=1), longest))[:, None]
        along *= _room(batch, now.angles, along)[:, None]
        tried = np.minimum(np.maximum(now.angles + along + back, batch.lower), batch.upper)
        new = _measured(batch, np.where(going[:, None], tried, now.angles))
        # in the terms of `LimbBatch.errors`: the next step takes that back
        kept = going & (new.cost < now.cost) & (np.abs(new.errors).max(axis=1) <= 0.1)
        for before, after in zip(now, new, strict=True):
            before[kept] = after[kept]
        damping = np.where(kept, damping / 10.0, damping * 10.0)
        going = going & (np.abs(along).max(axis=1) > 1e-3)  # [rad] of a step; less lowers no more
        if not going.any():
            break
    for _ in range(6):  # steps back onto the pose
        if np.abs(now.errors[movable]).max() <= TOLERANCES.pose_error:
            break
        moved = damped_step(batch, now.angles, now.errors, now.jacobians)
        now = _measured(batch, np.where(movable[:, None], moved, now.angles))
    good = movable & (np.abs(now.errors).max(axis=1) <= TOLERANCES.pose_error) & (now.cost <= first)
    return np.where(good[:, None], now.angles, angles)


class _Posture(NamedTuple):
    """Angles of the limbs, with what `LimbBatch` says of them."""

    angles: Array
    errors: Array
    jacobians: Array
    efforts: Array
    slopes: Array
    cost: Array


def _measured(batch: LimbBatch, angles: Array) -> _Posture:
    (errors,), (jacobians,) = batch.errors(angles[None])
    (efforts,), (slopes,) = batch.efforts(angles[None])
    return _Posture(angles, errors, jacobians, efforts, slopes, (efforts * efforts).sum(axis=1))


def _idle(jacobians: Array) -> Array:
    """Return projectors (L, m, m) onto the motions that leave the hands alone."""
    transposed = jacobians.transpose(0, 2, 1)
    # J Jᵀ is singular where a limb is stretched
    inner = jacobians @ transposed + 1e-8 * np.eye(jacobians.shape[1])
    return np.eye(jacobians.shape[2]) - transposed @ np.linalg.solve(inner, jacobians)


def _along(idle: Array, effort: Array, slopes: Array, damping: Array) -> Array:
    """Return the Gauss–Newton step, shape (L, m), among the motions that a projector leaves."""
    S = slopes @ idle
    transposed = S.transpose(0, 2, 1)
    curvature = transposed @ S
    # joints that bear nothing have no curvature
    added = damping * np.einsum("lkk->l", curvature) + 1e-12
    uphill = transposed @ effort[:, :, None]
    x = np.linalg.solve(curvature + added[:, None, None] * np.eye(idle.shape[1]), -uphill)
    return np.asarray((idle @ x)[:, :, 0])


def _room(batch: LimbBatch, angles: Array, step: Array) -> Array:
    """Return how much of a step stays within the limits, from 0 to 1, shape (L,)."""
    gap = np.where(step > 0.0, batch.upper - angles, angles - batch.lower)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(np.abs(step) > 0.0, gap / np.abs(step), 1.0)
    return np.asarray(np.clip(parts.min(axis=1), 0.0, 1.0))
