"""Put placements, bodies and a reach table together to what a climb is searched on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from planner.question import HandOnHold
from planner.reach import ReachTable, body_wrenches, limb_moments
from planner.robots import Robot
from planner.screening import HandParts, ScreeningTable, WorldHands
from planner.search import Wall
from planner.walls.bodies import BodyPoses
from planner.walls.places import palms_apart

__all__ = ["assemble_wall"]


def assemble_wall(
    robot: Robot,
    places: Sequence[HandOnHold],
    parts: Sequence[HandParts],
    bodies: BodyPoses,
    reach: ReachTable,
    *,
    apart: float,
    gravity: Array | None = None,
) -> Wall:
    """Return placements and bodies with all tables that a search needs.

    Parameters
    ----------
    robot : Robot
    places : sequence of HandOnHold, length P
    parts : sequence of HandParts, length P
        Their sets.
    bodies : BodyPoses
    reach : ReachTable
        Of these placements and bodies, and all limbs.
    apart : float
        Least distance of two palms that are on the rock together [m].
    gravity : ndarray, shape (3,), optional
        Acceleration of gravity, in W; the Earth's by default [m/s²].
    """
    poses = [place.pose for place in places]
    about = np.array([pose.position for pose in poses]).reshape(-1, 3).mean(axis=0)
    hands = WorldHands.of(parts, poses, about)
    wrenches = body_wrenches(robot, bodies.poses, about, gravity)
    moments = limb_moments(robot, reach, bodies.poses, gravity)
    return Wall(
        robot=robot,
        places=tuple(places),
        bodies=bodies.poses,
        shifts=bodies.shifts,
        reach=reach,
        screening=ScreeningTable.of(hands, wrenches, moments),
        apart=palms_apart(places, apart),
    )
