"""Choose joint angles of hands on their holds that a climb can keep until the limb lifts again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from hand_models.base import Array, Pose
from planner.motion import BranchEndError, CollisionScene, JointSpace, branches, follow_poses
from planner.robots import scene_number
from planner.route.climb import Move, Route

__all__ = ["bodies_until_lifted", "lasting", "start_joints"]


def bodies_until_lifted(moves: Iterable[Move], limb: str) -> list[Pose]:
    """Return the poses of the body, in W, while a limb's hand stays on its hold.

    Parameters
    ----------
    moves : iterable of Move
        The moves that are left; in that of the limb itself the body shifts before it lifts.
    limb : str
    """
    found: list[Pose] = []
    for move in moves:
        if move.body is not None:
            found.append(move.body)
        if move.hand.limb == limb:
            break
    return found


def lasting(
    scene: CollisionScene,
    limb: str,
    hand: Pose,
    bodies: Sequence[Pose],
    joints: Mapping[str, Array],
    candidates: Iterable[Array],
) -> Iterator[Array]:
    """Yield those of a limb's joint angles that are clear, and stay so while the body moves.

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
    """
    robot, margin = scene.robot, scene_number("motion", "margin")
    for angles in candidates:
        inside = [body.inverse() @ hand for body in bodies[1:]]
        try:
            after = follow_poses(robot, limb, angles, inside) if inside else []
        except BranchEndError:
            continue
        # the other limbs as they are now, though they will move with the body
        spaces = [
            JointSpace(scene, body, {**joints, limb: at}, (limb,), touching=robot.limbs)
            for body, at in zip(bodies, [angles, *after], strict=True)
        ]
        if all(space.clearances(space.start[None]).min() >= margin for space in spaces):
            yield angles


def start_joints(route: Route, scene: CollisionScene, found: Mapping[str, Array]) -> dict[str, Array]:
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
        limb, here = place.limb, start.body.inverse() @ place.pose
        near = found[limb]
        bodies = [start.body, *bodies_until_lifted(route.moves, limb)]
        others = branches(scene.robot, limb, here, near, count=32)
        best = next(lasting(scene, limb, place.pose, bodies, joints, [near, *others]), None)
        joints[limb] = near if best is None else best
    return joints
