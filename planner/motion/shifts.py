"""Shifts of the body while all hands stay on their holds: whether they are clear, what is met.

A shift that a limb cannot follow may end in rock all the same: what is met comes first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hand_models.base import Array, Pose
from planner.motion.branch import BranchEndError, pose_between, shift_postures
from planner.motion.collisions import CollisionScene, JointSpace, NearestPair
from planner.motion.settings import MOTION_SETTINGS
from planner.motion.ways import Clear, check_way
from planner.robots import scene_number

__all__ = ["check_shift", "met_in_shift"]


def check_shift(
    scene: CollisionScene,
    bodies: Sequence[Pose],
    joints: Mapping[str, Array],
    *,
    margin: float | None = None,
) -> Clear:
    """Prove that the robot is clear while its body shifts on hands that stay, or find where not.

    Parameters
    ----------
    scene : CollisionScene
    bodies : sequence of Pose, length m, at least 2
        Poses of B in W, from the first one on; between two of them position and joint angles change
        linearly, and the orientation along the shortest turn.
    joints : mapping of str to ndarray, shape (m, n)
        Angles of the limbs' joints [rad]; a limb left out is not measured.
    margin : float, optional
        As of `swing`.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    margin = scene_number("motion", "margin") if margin is None else margin
    first = {limb: angles[0] for limb, angles in joints.items()}
    space = JointSpace(scene, bodies, first, tuple(joints), touching=scene.robot.limbs)
    progress = np.arange(float(len(bodies)))[:, None]
    return check_way(space, np.hstack([*joints.values(), progress]), margin)


def met_in_shift(
    scene: CollisionScene,
    hands: Mapping[str, Pose],
    first: Pose,
    goal: Pose,
    joints: Mapping[str, Array],
    *,
    margin: float | None = None,
) -> NearestPair | None:
    """Return what is met on a shift that a limb cannot follow; None if nothing is.

    It is met by the body anywhere on its way to the goal, or by a link as far as all limbs follow.

    Parameters
    ----------
    scene : CollisionScene
    hands : mapping of str to Pose
        Pose of H in W of the hands that stay, by limb.
    first, goal : Pose
        Poses of B in W; between them the body's position is on a straight line, and its orientation
        turns the shortest way.
    joints : mapping of str to ndarray, shape (n,)
        Joint angles of every limb at the first pose [rad].
    margin : float, optional
        As of `swing`.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    alone = check_shift(scene, [first, goal], {}, margin=margin)
    if not alone.clear:
        return alone.nearest
    share, steps = 1.0, MOTION_SETTINGS.shift_steps
    # each limb may end the way once more
    for _ in range(len(hands) + 1):
        bodies = [pose_between(first, goal, share * k / steps) for k in range(1, steps + 1)]
        try:
            found = shift_postures(scene.robot, hands, bodies, joints)
        except BranchEndError as error:
            share *= MOTION_SETTINGS.short_of * error.share
            continue
        still = {limb: np.tile(angles, (steps + 1, 1)) for limb, angles in joints.items()}
        ways = {limb: np.vstack([joints[limb], each]) for limb, each in found.items()}
        seen = check_shift(scene, [first, *bodies], {**still, **ways}, margin=margin)
        return None if seen.clear else seen.nearest
    return None
