"""The swing of a hand from one hold to the next, as joint angles that are proven to be clear.

The hand goes straight back from its old hold, along −z of H, then along a way in joint space, and
straight on to the new hold, along z of H.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose
from planner.motion.branch import BranchEndError, branches, follow_poses
from planner.motion.collisions import CollisionScene, JointSpace, NearestPair
from planner.motion.settings import MOTION_SETTINGS
from planner.motion.ways import Clear, check_way, search_way, way_length
from planner.robots import Robot, scene_number

__all__ = ["NoWayError", "Swing", "clear_branches", "straight_off", "swing"]


class NoWayError(InvalidInputError):
    """Error of a limb for which no clear way to its new hold was found.

    Parameters
    ----------
    limb : str
    where : str
        Part of the swing, as a clause.
    nearest : NearestPair
        What meets there.
    margin : float
        Distance that is needed [m].

    Attributes
    ----------
    limb, where, nearest, margin
        The parameters.
    """

    kind = "unreachable"

    def __init__(self, limb: str, where: str, nearest: NearestPair, margin: float) -> None:
        super().__init__(
            f"{limb} has no way to its new hold: {where}, {nearest}, and {1e3 * margin:.3g} mm "
            "are needed; shift the body, or choose another hold"
        )
        self.limb, self.where, self.nearest, self.margin = limb, where, nearest, margin


@dataclass(frozen=True, eq=False)
class Swing:
    """Joint angles of a limb on the way from one hold to the next.

    Attributes
    ----------
    limb : str
    path : ndarray, shape (m, n)
        Joint angles at the corners of the way [rad]; between two of them joints turn in proportion.
    retreat, approach : int
        Index of the corner at which the hand has gone back from its old hold, and from which it
        goes straight on to the new one.
    nearest : NearestPair
        The least distance that was met between those two corners.
    bound : float
        Proven lower bound of all distances between them [m].
    how : {'straight', 'searched'}
        Whether the way between them is one straight line in joint space.
    """

    limb: str
    path: Array
    retreat: int
    approach: int
    nearest: NearestPair
    bound: float
    how: Literal["straight", "searched"]


def swing(
    scene: CollisionScene,
    body: Pose,
    joints: Mapping[str, Array],
    limb: str,
    goals: Sequence[Array],
    *,
    stand_off: float | None = None,
    margin: float | None = None,
    seed: int = 0,
) -> Swing:
    """Find a short swing of a limb's hand from its hold to the next one, while all else stays.

    Parameters
    ----------
    scene : CollisionScene
        The robot and all rock; both holds of the limb have it among their ``limbs``.
    body : Pose
        Pose of B in W.
    joints : mapping of str to ndarray, shape (n,)
        Joint angles of every limb at the start [rad]; a limb left out is not measured.
    limb : str
        The limb that swings.
    goals : sequence of ndarray, shape (n,)
        Joint angles with the hand on its new hold [rad]. The swing ends at that of them to which
        the shortest way in joint space was found.
    stand_off : float, optional
        Distance of the hand from its holds in the swing [m]; that of ``parameters/scene.toml`` by
        default.
    margin : float, optional
        Least distance of links and hands from each other and from rock [m]; that of
        ``parameters/scene.toml`` by default.
    seed : int
        Seed of the search's random directions.

    Raises
    ------
    NoWayError
        If no clear way was found; the error says which link meets what.
    BranchEndError
        If the hand cannot go straight back from its hold, or onto the new one.
    DeadlineError
        If the deadline passes first.
    """
    if not goals:
        raise InvalidInputError("at least one is needed", field="goals")
    robot, start = scene.robot, np.asarray(joints[limb], dtype=float)
    stand_off = scene_number("motion", "stand_off") if stand_off is None else stand_off
    margin = scene_number("motion", "margin") if margin is None else margin
    near = min(margin, scene_number("motion", "margin_at_hold"))
    others = [each for each in joints if each != limb]
    free = JointSpace(scene, [body], joints, (limb,), touching=others)

    def leaving(angles: Array, which: str) -> Array:
        """Return joint angles, shape (m, n), with which the hand goes straight back from a hold."""
        held = JointSpace(scene, [body], {**joints, limb: angles}, (limb,), touching=robot.limbs)
        way = straight_off(robot, limb, angles, stand_off)
        _require(limb, check_way(held, way, near), f"beside its {which} hold", near)
        _require(limb, check_way(free, way[-1:], margin), f"in front of its {which} hold", margin)
        return way

    back = leaving(start, "old")
    onto: list[Array] = []
    refused: list[BranchEndError | NoWayError] = []
    for goal in goals:
        try:
            onto.append(leaving(np.asarray(goal, dtype=float), "new")[::-1])
        except (BranchEndError, NoWayError) as error:
            refused.append(error)
    if not onto:
        raise refused[0]
    way = _shortest(free, back[-1], onto, margin, seed)
    if isinstance(way, NearestPair):
        where = "on the straight way in joint space, around which none was found"
        raise NoWayError(limb, where, way, margin)
    path = np.vstack([back, way.corners[1:], way.onto[1:]])
    retreat = len(back) - 1
    approach = retreat + len(way.corners) - 1
    return Swing(limb, path, retreat, approach, way.seen.nearest, way.seen.bound, way.how)


class _Way(NamedTuple):
    """A way through the air, shape (m, n), and one of those onto the new hold, shape (k, n)."""

    corners: Array
    onto: Array
    seen: Clear
    how: Literal["straight", "searched"]


def _shortest(
    space: JointSpace, start: Array, onto: Sequence[Array], margin: float, seed: int
) -> _Way | NearestPair:
    """Return the shortest way found to the begin of one onto the new hold, or what is met."""
    best, length, met = None, np.inf, None
    # no way to an end is shorter than the straight one: the nearest end first
    for end in sorted(onto, key=lambda each: float(np.linalg.norm(each[0] - start))):
        line = np.array([start, end[0]])
        if length <= way_length(line):
            break
        seen = check_way(space, line, margin)
        if seen.clear:
            best = _Way(line, end, seen, "straight")
            break
        met = met or seen.nearest
        found = search_way(space, start, line[1:], margin, seed, MOTION_SETTINGS.first_tries)
        if found is not None and way_length(found[0]) < length:
            best, length = _Way(found[0], end, found[1], "searched"), way_length(found[0])
    if best is not None:
        return best
    ends = np.array([each[0] for each in onto])
    found = search_way(space, start, ends, margin, seed, MOTION_SETTINGS.tries)
    if found is None:
        assert met is not None  # on the way to the nearest end
        return met
    which = int(np.abs(ends - found[0][-1]).max(axis=1).argmin())
    return _Way(found[0], onto[which], found[1], "searched")


def straight_off(robot: Robot, limb: str, angles: Array, stand_off: float) -> Array:
    """Return joint angles with which a hand goes straight back from its hold, shape (m, n) [rad].

    Parameters
    ----------
    robot : Robot
    limb : str
    angles : ndarray, shape (n,)
        On the hold, the first of those returned [rad].
    stand_off : float
        Distance along −z of H [m].

    Raises
    ------
    BranchEndError
        If the limb cannot follow.
    """
    pose = robot.hand_poses({limb: angles})[limb]
    away = np.linspace(0.0, stand_off, 6)[1:, None] * -pose.rotation[:, 2]
    poses = [Pose(pose.position + each, pose.rotation) for each in away]
    return np.vstack([angles, follow_poses(robot, limb, angles, poses)])


def _require(limb: str, seen: Clear, where: str, margin: float) -> None:
    if not seen.clear:
        raise NoWayError(limb, where, seen.nearest, margin)


def clear_branches(
    scene: CollisionScene,
    body: Pose,
    joints: Mapping[str, Array],
    limb: str,
    pose: Pose,
    *,
    margin: float | None = None,
    count: int = 8,
) -> tuple[Array, ...]:
    """Return joint angles of several kinds that put a hand on its hold, clear of all else.

    Parameters
    ----------
    scene : CollisionScene
    body : Pose
        Pose of B in W.
    joints : mapping of str to ndarray, shape (n,)
        Joint angles of the other limbs, of which one left out is not measured, and if known those
        of this one that the first ones are to be nearest to [rad].
    limb : str
    pose : Pose
        Pose of H in W, closed on its hold.
    margin : float, optional
        As of `swing`.
    count : int
        Number of kinds that are looked at, at most.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Joint angles in the order of `branches` [rad]; none if no clear ones were found.

    Raises
    ------
    DeadlineError
        If the deadline passes first.
    """
    margin = scene_number("motion", "margin") if margin is None else margin
    robot, found = scene.robot, []
    for angles in branches(robot, limb, body.inverse() @ pose, joints.get(limb), count):
        held = JointSpace(scene, [body], {**joints, limb: angles}, (limb,), touching=robot.limbs)
        if held.clearances(angles[None], margin).min() >= margin:
            found.append(angles)
    return tuple(found)
