"""Body wrenches of many bodies, and what the posture of each limb changes in their moments.

The weight of a posture is that of the robot with all limbs at rest, and of each limb what its own
joint angles change: so a limb's part does not depend on what the others do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array, Pose
from planner.limbs import LimbChain
from planner.programs import WRENCH_UNIT
from planner.question import EARTH_GRAVITY
from planner.reach.table import ReachTable
from planner.robots import Robot

__all__ = ["body_wrenches", "limb_moments"]


def body_wrenches(
    robot: Robot, bodies: Sequence[Pose], about: Array, gravity: Array | None = None
) -> Array:
    """Return the wrenches that bodies need with all limbs at rest angles, shape (B, 6).

    Parameters
    ----------
    robot : Robot
    bodies : sequence of Pose, length B
        Poses of B in W.
    about : ndarray, shape (3,)
        Point about which moments are, in W [m].
    gravity : ndarray, shape (3,), optional
        Acceleration of gravity, in W; the Earth's by default [m/s²].

    Returns
    -------
    ndarray, shape (B, 6)
        Wrenches in the axes of W, in `WRENCH_UNIT`.
    """
    force = -robot.mass * np.asarray(EARTH_GRAVITY if gravity is None else gravity)
    com = robot.com_at({})
    arms = np.array([body.apply(com) - about for body in bodies]).reshape(-1, 3)
    forces = np.broadcast_to(force, arms.shape)
    return np.asarray(np.hstack([forces, np.cross(arms, force)]) / WRENCH_UNIT)


def limb_moments(
    robot: Robot,
    table: ReachTable,
    bodies: Sequence[Pose],
    gravity: Array | None = None,
    limbs: Sequence[str] | None = None,
) -> Array:
    """Return what limbs at placements change in the moments of `body_wrenches`, (B, L, P, 3).

    The first solution of each entry counts; where there is none, nothing changes.

    Parameters
    ----------
    robot : Robot
    table : ReachTable
    bodies : sequence of Pose, length B
        Poses of B in W that the table was made for.
    gravity : ndarray, shape (3,), optional
        Acceleration of gravity, in W; the Earth's by default [m/s²].
    limbs : sequence of str, optional
        Limbs that the table was made for; all by default.

    Returns
    -------
    ndarray, shape (B, L, P, 3)
        Moments in the axes of W, in `WRENCH_UNIT`.
    """
    pull = -np.asarray(EARTH_GRAVITY if gravity is None else gravity)
    axes = np.array([body.rotation for body in bodies]).reshape(-1, 3, 3)
    placements, count, width = table.entry.shape
    found = np.zeros((count, width, placements, 3))
    for i, limb in enumerate(robot.limbs if limbs is None else limbs):
        chain = LimbChain.of(robot, limb)
        on, at = np.nonzero(table.entry[:, :, i] >= 0)
        first = table.angles[table.starts[table.entry[on, at, i]], : len(chain.lower)]
        away = chain.centres(first) - chain.centres(robot.chains[limb].rest[None])
        shifted = (axes[at] @ away[:, :, None])[:, :, 0]
        moments = np.cross(chain.masses.sum() * shifted, pull) / WRENCH_UNIT[3:]
        found[at, i, on] = moments
    return found
