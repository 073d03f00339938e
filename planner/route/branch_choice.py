"""Choose joint angles of hands on their holds that a climb can keep until the limb lifts again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from hand_models.base import Array, Pose
from planner.motion import (
    BranchEndError,
    CollisionScene,
    JointSpace,
    branches,
    follow_poses,
    pose_between,
)
from planner.robots import Robot, scene_number
from planner.route.climb import Move, Route

__all__ = ["bodies_until_lifted", "candidates_on", "lasting", "start_joints"]


def bodies_until_lifted(body: Pose, moves: Iterable[Move], limb: str) -> tuple[list[Pose], bool]:
    """Return poses of the body, in W, while a limb's hand stays on its hold, the present one first.

    Between those of the moves are some halfway. The second is whether the hand leaves its hold at
    the last of them.

    Parameters
    ----------
    body : Pose
        Present pose of the body.
    moves : iterable of Move
        The moves that are left; in that of the limb itself the body shifts before it lifts.
    limb : str
    """
    found = [body]
    for move in moves:
        if move.body is not None:
            found += [pose_between(found[-1], move.body, 0.5), move.body]
        if move.hand.limb == limb:
            return found, True
    return found, False


def lasting(
    scene: CollisionScene,
    limb: str,
    hand: Pose,
    bodies: Sequence[Pose],
    joints: Mapping[str, Array],
    candidates: Iterable[Array],
    *,
    lifts: bool,
) -> Iterator[Array]:
    """Yield those of a limb's joint angles that are clear, and stay so while the body moves.

    Last come those that keep but the margin of hands at their holds.

    Parameters
    ----------
    scene : CollisionScene
    limb : str
    hand : Pose
        Pose of H on its hold, in W.
    bodies : sequence of Pose
        Poses of B in W, the present one first.
    joints : mapping of str to ndarray, shape (n,)
        Angles of the other limbs' joints [rad].
    candidates : iterable of ndarray, shape (n,)
        Angles that put the hand on its hold [rad].
    lifts : bool
        Whether the hand leaves its hold at the last of the bodies.
    """
    robot, margin = scene.robot, scene_number("motion", "margin")
    inside = [body.inverse() @ hand for body in bodies]
    others, ways = [each for each in robot.limbs if each != limb], [robot.limbs] * len(bodies)
    if lifts:
        # and back from the hold at last
        back = scene_number("motion", "stand_off") * inside[-1].rotation[:, 2]
        inside.append(Pose(inside[-1].position - back, inside[-1].rotation))
        bodies, ways = [*bodies, bodies[-1]], [*ways, tuple(others)]
    # the other limbs as they are now, though they will move with the body
    spaces = [
        JointSpace(scene, [body], joints, (limb,), touching=touching)
        for body, touching in zip(bodies, ways, strict=True)
    ]
    near: list[Array] = []
    for angles in candidates:
        try:
            after = [*follow_poses(robot, limb, angles, inside[1:])] if inside[1:] else []
        except BranchEndError:
            continue
        pairs = zip(spaces, [angles, *after], strict=True)
        least = min(float(space.clearances(at[None]).min()) for space, at in pairs)
        if least >= margin:
            yield angles
        elif least >= scene_number("motion", "margin_at_hold"):
            near.append(angles)
    yield from near


def candidates_on(
    robot: Robot, limb: str, hand: Pose, bodies: Sequence[Pose], near: Array
) -> list[Array]:
    """Return joint angles of several kinds that put a hand on its hold, the nearest first [rad].

    Some are found where the body is now, some where it is at last and followed back.

    Parameters as in `lasting`; ``near``, shape (n,), are the angles that others are compared with.
    """
    count = 32
    inside = [body.inverse() @ hand for body in bodies]
    found = list(branches(robot, limb, inside[0], near, count))
    if len(bodies) > 1:
        for angles in branches(robot, limb, inside[-1], near, count):
            try:
                found.append(follow_poses(robot, limb, angles, inside[-2::-1])[-1])
            except BranchEndError:
                continue
    return sorted(found, key=lambda each: float(np.abs(each - near).max()))


def start_joints(
    route: Route, scene: CollisionScene, found: Mapping[str, Array]
) -> dict[str, Array]:
    """Return joint angles of the start stance of limbs whose joints are to be found.

    Parameters
    ----------
    route : Route
    scene : CollisionScene
    found : mapping of str to ndarray, shape (n,)
        Angles of all limbs, those to be found with low torques [rad]. They are kept where nothing
        better is found.
    """
    joints, start = dict(found), route.start
    for place in start.hands:
        if place.limb not in start.solved_limbs:
            continue
        limb, near = place.limb, found[place.limb]
        whole, lifts = bodies_until_lifted(start.body, route.moves, limb)
        others = [near, *candidates_on(scene.robot, limb, place.pose, whole, near)]
        for until, leaves in ((whole, lifts), ([start.body], False)):
            clear = lasting(scene, limb, place.pose, until, joints, others, lifts=leaves)
            best = next(clear, None)
            if best is not None:
                joints[limb] = best
                break
    return joints
