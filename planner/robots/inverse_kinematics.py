"""Joint angles for poses of the hands: first any that put them there, then such that bear less."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, InvalidInputError, Pose
from planner import deadline
from planner.robots.limb_batch import LimbBatch
from planner.robots.nearest_pose import PLACED, angles_near, lacking, starts_beside
from planner.robots.pose_search import TOLERANCE, find_angles
from planner.robots.robot import Robot
from planner.robots.torque_lowering import lower_torques

__all__ = ["UnreachableError", "solve_limbs"]


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
        deadline.check("it was known how far a hand is out of reach")
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
    return angles, np.abs(batch.errors(angles[None])[0][0]).max(axis=1) <= TOLERANCE


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
