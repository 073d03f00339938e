"""Rock from the outside: how far points are from a hold, without the code's sections.

Distances are signed, negative inside the rock, and exact for every hold here, so that a point is on
the rock exactly where its distance is zero.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from hand_models.frames import Pose
from hand_models.holds import Cylinder, Edge, Hold, Plane, Sphere


def distance(hold: Hold, points: np.ndarray) -> np.ndarray:
    """Of points (..., 3) in the hold's frame [m]."""
    x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
    if isinstance(hold, Plane):
        return -z
    if isinstance(hold, Sphere):
        radius = hold.diameter / 2.0
        return np.sqrt(x**2 + y**2 + (z - radius) ** 2) - radius
    if isinstance(hold, Cylinder):
        return np.hypot(x, z - hold.diameter / 2.0) - hold.diameter / 2.0
    assert isinstance(hold, Edge)
    # in polar coordinates about the fillet's centre, the angle taken from the edge's bisector
    radius = hold.fillet_radius
    length, beside = np.hypot(x, z - radius), np.arctan2(np.abs(x), z - radius) - hold.angle / 2.0
    to_face = length * np.sin(np.minimum(beside, math.pi / 2.0))
    return np.where(beside >= math.pi / 2.0, length, to_face) - radius


def in_hand(hold: Hold, pose: Pose, points: np.ndarray) -> np.ndarray:
    """Distances of points in H of a hold placed at ``pose`` in H [m]."""
    return distance(hold, pose.inverse().apply(points))


def random_round(rng: np.random.Generator) -> Hold:
    """A cylinder or a ball."""
    diameter = 10.0 ** rng.uniform(-1.0, 0.5)
    return Cylinder(diameter) if rng.random() < 0.5 else Sphere(diameter)


def random_hold(rng: np.random.Generator) -> Hold:
    if rng.random() < 0.6:
        return random_round(rng)
    return Plane() if rng.random() < 0.3 else Edge(rng.uniform(0.01, 0.3), rng.uniform(0.3, 3.0))


def random_axes(rng: np.random.Generator, tilt: float = 0.5) -> np.ndarray:
    """Axes whose z is within ``tilt`` of the parent's and whose x points anywhere [rad]."""
    across = rng.normal(size=2)
    lean = Rotation.from_rotvec([*(across / np.hypot(*across) * rng.uniform(0.0, tilt)), 0.0])
    turn = Rotation.from_rotvec([0.0, 0.0, rng.uniform(-math.pi, math.pi)])
    return (lean * turn).as_matrix()
