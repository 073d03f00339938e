"""A robot on a wall in W, x up, z out of the rock, and the postures from which its limbs swing."""

from functools import cache

import numpy as np

from hand_models.base import Pose
from hand_models.rock import Hold, Mesh, Plane, Sphere
from planner.motion import CollisionScene, Rock, clear_branches
from planner.robots import robosimian
from tests.suite.helpers.rocks import fractal_wall
from tests.suite.helpers.stances import PALM_TO_WALL, wall

BODY = Pose(0.5 * wall()[:, 2], wall())
"""B, parallel to the wall and 0.5 m off it."""

PLACES = {
    "front_right": (0.65, -0.5),
    "rear_right": (-0.4, -0.6),
    "rear_left": (-0.4, 0.6),
    "front_left": (0.65, 0.5),
}
"""Of the hands on the wall [m]."""

ROBOT = robosimian()


def rock(hold: Hold | None = None, name: str = "wall") -> Rock:
    """The wall: z of its frame into the rock."""
    pose = Pose(np.zeros(3), wall() @ PALM_TO_WALL)
    return Rock(name, Plane() if hold is None else hold, pose, frozenset(ROBOT.limbs))


def ball(place, diameter: float = 0.16) -> Rock:
    """A ball whose middle is at a place (x, y, z) of the wall."""
    x, y, z = place
    crest = wall() @ [x, y, z + 0.5 * diameter]
    return Rock("boulder", Sphere(diameter), Pose(crest, wall() @ PALM_TO_WALL), frozenset())


@cache
def rough() -> Mesh:
    """A rough wall of 1.8 m."""
    return Mesh(*fractal_wall(3, size=1.8, count=181, height=0.004))


def palm(x: float, y: float, off: float = 0.0) -> Pose:
    """H on the wall, or so far off it."""
    return Pose(wall() @ [x, y, off], wall() @ PALM_TO_WALL)


@cache
def posture() -> dict[str, np.ndarray]:
    """Joint angles with all hands on a flat wall, clear of it and of each other."""
    scene, joints = CollisionScene(ROBOT, [rock()]), {}
    for limb, (x, y) in PLACES.items():
        found = clear_branches(scene, BODY, joints, limb, palm(x, y), margin=0.03, count=24)
        joints[limb] = found[0]
    return joints
