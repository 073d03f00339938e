"""Joint angles for poses of the hands: first any that put them there, then such that bear less.

The second is Gauss–Newton on ``Σ (τ / τ_max)²`` over the directions in which a redundant limb can
move without moving its hand, with each step's error of the pose taken back in the next.
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
            if limb in turned and distance <= TOLERANCES.place_error:
                said.append(f"{limb} cannot be turned as asked, by {turned[limb]:.2g} rad")
                continue
            near = f" (turned by {turned[limb]:.2g} rad it is there)" if limb in turned else ""
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
    near : tuple of float, float, optional
        Distance [m] and angle [rad] up to which a hand may be off a pose that no angles solve; then
        it is put where it comes nearest, as if that were its pose. By default it may not be off.

    Raises
    ------
    UnreachableError
        That names every limb whose pose is not solved, nor come near to.
    DeadlineError
        If the time is over before.
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
    """Return angles for the same poses, within the limits, with joint torques no higher.

    Parameters
    ----------
    batch : LimbBatch
    angles : ndarray, shape (L, m)
        Limbs whose poses they do not solve are left as they are.

    Returns
    -------
    ndarray, shape (L, m)
        Σ (τ / τ_max)² of each limb is at most that at ``angles``, and near a local minimum.

    Raises
    ------
    DeadlineError
        If the time is over before.
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
