"""Choose joint angles of hands on their holds that a climb can keep until the limb lifts again."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice

import numpy as np

from hand_models.base import Array, Pose
from planner.motion import (
    BranchEndError,
    CollisionScene,
    JointSpace,
    NoWayError,
    Swing,
    branches,
    follow_poses,
    pose_between,
    swing,
)
from planner.question import HandOnHold
from planner.robots import Robot, scene_number
from planner.route.climb import Move, Route

__all__ = [
    "bodies_until_lifted",
    "candidates_on",
    "ends_of_swing",
    "start_joints",
    "swing_to",
]


def bodies_until_lifted(
    body: Pose, moves: Iterable[Move], limb: str, end: Pose | None = None
) -> tuple[list[Pose], bool]:
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
    end : Pose, optional
        Pose of the body after all moves.
    """
    found = [body]
    for move in moves:
        if move.body is not None:
            found += [pose_between(found[-1], move.body, 0.5), move.body]
        if move.hand.limb == limb:
            return found, True
    if end is not None:
        found += [pose_between(found[-1], end, 0.5), end]
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
) -> Iterator[tuple[Array, bool]]:
    """Yield those of a limb's joint angles that are clear, and stay so while the body moves.

    With each comes whether it keeps the whole margin. Last come those that do not: they keep but
    the margin of hands at their holds, until they leave them.

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
    at_hold = scene_number("motion", "margin_at_hold")
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
        least = [float(space.clearances(at[None]).min()) for space, at in pairs]
        if min(least) >= margin:
            yield angles, True
        elif min(least) >= at_hold and (not lifts or least[-1] >= margin):
            near.append(angles)
    yield from ((angles, False) for angles in near)


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
    return _nearest(found, near)


def ends_of_swing(
    route: Route,
    done: int,
    scene: CollisionScene,
    body: Pose,
    joints: Mapping[str, Array],
) -> list[list[Array]]:
    """Return joint angles with which the hand of a move may come to its new hold, by kinds [rad].

    First those that are clear until the limb lifts again, or for as long as any are, then those
    that keep but the margin of hands at their holds; if there are none, those that are clear of
    nothing. The list is empty if no joint angles were found.

    Parameters
    ----------
    route : Route
    done : int
        Number of the move, from one.
    scene : CollisionScene
    body : Pose
        Pose of B in W.
    joints : mapping of str to ndarray, shape (n,)
        Present angles of all limbs [rad].
    """
    limb, place = route.moves[done - 1].hand.limb, route.moves[done - 1].hand.pose
    bodies, lifts = bodies_until_lifted(body, route.moves[done:], limb, route.end)
    most, near = 6, joints[limb]

    def clear(angles: Sequence[Array], until: Sequence[Pose], leaves: bool) -> list[list[Array]]:
        found = lasting(scene, limb, place, until, joints, angles, lifts=leaves)
        kinds: list[list[Array]] = [[], []]
        for each, whole in islice(found, most):
            kinds[0 if whole else 1].append(each)
        return [kind for kind in kinds if kind]

    others = _nearest(candidates_on(scene.robot, limb, place, bodies, near), near)
    for until in (bodies, bodies[: (len(bodies) + 1) // 2], bodies[:1]):
        found = clear(others, until, lifts and until is bodies)
        if found:
            return found
    return [others[:most]] if others else []


def _nearest(angles: Iterable[Array], near: Array) -> list[Array]:
    return sorted(angles, key=lambda each: float(np.abs(each - near).max()))


def swing_to(
    scene: CollisionScene,
    body: Pose,
    joints: Mapping[str, Array],
    limb: str,
    kinds: Sequence[Sequence[Array]],
) -> Swing:
    """Return the swing of a limb to an end of the first kind that has a way.

    Parameters
    ----------
    scene, body, joints, limb
        As of `swing`.
    kinds : sequence of sequence of ndarray, shape (n,)
        Joint angles with the hand on its next hold [rad], as of `ends_of_swing`.

    Raises
    ------
    NoWayError, BranchEndError
        That of the first kind, if none has a way.
    """
    refused: list[NoWayError | BranchEndError] = []
    for ends in kinds:
        try:
            return swing(scene, body, joints, limb, ends)
        except (NoWayError, BranchEndError) as error:
            refused.append(error)
    raise refused[0]


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

    def best(
        hand: HandOnHold, angles: Sequence[Array], until: Sequence[Pose], leaves: bool
    ) -> Array | None:
        clear = lasting(scene, hand.limb, hand.pose, until, joints, angles, lifts=leaves)
        return next((each for each, _ in clear), None)

    for place in start.hands:
        if place.limb not in start.solved_limbs:
            continue
        limb, near = place.limb, joints[place.limb]
        whole, lifts = bodies_until_lifted(start.body, route.moves, limb, route.end)
        chosen = best(place, [near], whole, lifts)
        if chosen is None:
            others = [near, *candidates_on(scene.robot, limb, place.pose, whole, near)]
            chosen = best(place, others, whole, lifts)
            if chosen is None:
                chosen = best(place, others, [start.body], False)
        if chosen is not None:
            joints[limb] = chosen
    return joints
