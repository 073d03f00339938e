"""Obstacles as shapes of the collision library `coal`, in B: capsules, hands, rock.

A wall is unbounded; logs, edges and outlines are extended along y as far as limbs reach.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, Final, NamedTuple

import coal
import numpy as np

from hand_models.base import Array, BoundedStore, Indices, Pose
from hand_models.rock import Hold
from hand_models.sections import Swept
from planner.scene.scene import SCENE_SETTINGS, Scene

__all__ = ["Solid", "capsule_solids", "distance_between", "hand_solids", "rock_solids"]

ROCK_SHAPES: Final[BoundedStore[Hold, Any]] = BoundedStore("rock as shapes", 64)
"""Shapes of holds that were asked for last."""


class Solid(NamedTuple):
    """A solid with its pose, for distances.

    Attributes
    ----------
    name : str
        Name of the solid in messages.
    shape
        Shape of the library `coal`.
    place : coal.Transform3s
        Pose of the shape in B.
    middle : ndarray, shape (3,)
        Centre of a bounding sphere, in B [m].
    bound : float
        Radius of the bounding sphere [m]; infinite for rock.
    assumed : float
        Radius, if it is assumed because the robot's file has none; otherwise zero [m].
    """

    name: str
    shape: Any
    place: Any
    middle: Array
    bound: float
    assumed: float = 0.0


def capsule_solids(names: Iterable[str], ends: Array, radii: Array) -> tuple[Solid, ...]:
    """Return capsules as solids.

    Parameters
    ----------
    names : iterable of str, length n
        Names of the capsules in messages.
    ends : ndarray, shape (n, 2, 3)
        Ends of the capsules' segments, in B [m].
    radii : ndarray, shape (n,)
        Radii of the capsules [m].
    """
    along, middles = ends[:, 1] - ends[:, 0], 0.5 * (ends[:, 0] + ends[:, 1])
    lengths = np.linalg.norm(along, axis=1)
    turns = _along_z(along, lengths)
    bounds = 0.5 * lengths + radii
    return tuple(
        Solid(name, coal.Capsule(radius, length), coal.Transform3s(turn, middle), middle, bound)
        for name, radius, length, turn, middle, bound in zip(
            names, radii.tolist(), lengths.tolist(), turns, middles, bounds.tolist(), strict=True
        )
    )


def _along_z(along: Array, lengths: Array) -> Array:
    """Return axes whose z is along vectors (n, 3), shape (n, 3, 3)."""
    size = np.where(lengths > 0.0, lengths, 1.0)[:, None]
    z = np.where(lengths[:, None] > 0.0, along / size, [0.0, 0.0, 1.0])
    least = np.eye(3)[np.abs(z).argmin(axis=1)]
    x = np.cross(least, z)
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2)


def hand_solids(scene: Scene) -> tuple[Solid, ...]:
    """Return a capsule for every hand, as a solid."""
    segments, radius = scene.palms
    names = [f"hand of {limb}" for limb in scene.limbs]
    return capsule_solids(names, segments, np.full(len(names), radius))


def rock_solids(scene: Scene) -> tuple[Solid, ...]:
    """Return the rock of every hand, as a solid."""
    found = []
    for hand, rock in zip(scene.hands, scene.rocks, strict=True):
        shape, centre = ROCK_SHAPES.get(hand.hold, partial(_rock, hand.hold))
        place = rock.inverse() @ centre
        found.append(
            Solid(
                f"rock of {hand.limb}",
                shape,
                coal.Transform3s(place.rotation, place.position),
                place.position,
                np.inf,
            )
        )
    return tuple(found)


def _rock(hold: Hold) -> tuple[Any, Pose]:
    """Return a hold's shape, and where that is in the hold's frame.

    A smooth hold's is exact where `coal` has such a shape; of any other the triangles of its
    surface.
    """
    swept, far = hold.swept, SCENE_SETTINGS.rock_length
    if swept is not None:
        scales = np.array([swept.scale_x, swept.scale_y, swept.scale_z])
        centre = np.array([0.0, 0.0, swept.depth])
        if not swept.scale_x:
            return coal.Halfspace(np.array([0.0, 0.0, -1.0]), 0.0), Pose.identity()
        if swept.sine:
            return _wedge(swept), Pose.identity()
        if scales.all():
            alike = np.ptp(scales) == 0.0
            size = swept.radius / scales
            return coal.Sphere(size[0]) if alike else coal.Ellipsoid(*size), Pose(centre, np.eye(3))
        if swept.scale_x == swept.scale_z:
            radius = swept.radius / swept.scale_x
            # `coal` has a log along z, a hold's frame has it along y
            turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
            return coal.Cylinder(radius, 2.0 * far), Pose(centre, turn)
    return _surface(*hold.surface(np.full(3, -far), np.full(3, far))), Pose.identity()


def _wedge(edge: Swept) -> Any:
    """Return an edge's rock: all within the fillet's radius of a sharp one."""
    radius, far = edge.radius, SCENE_SETTINGS.rock_length
    aside, deep = far * edge.sine, radius + far * edge.cosine
    section = [(0.0, radius), (aside, deep), (-aside, deep)]
    points = coal.StdVec_Vec3s()
    points.extend([np.array([x, y, z]) for x, z in section for y in (-far, far)])
    shape = coal.ConvexBase.convexHull(points, True, "Qt")
    shape.setSweptSphereRadius(radius)
    return shape


def _surface(vertices: Array, faces: Indices) -> Any:
    """Return triangles, of many no more than `SCENE_SETTINGS` says."""
    if len(faces) > SCENE_SETTINGS.rock_triangles:
        x, y, z = np.floor((vertices - vertices.min(axis=0)) / SCENE_SETTINGS.rock_cube).T
        cubes = (x * (y.max() + 1.0) + y) * (z.max() + 1.0) + z
        _, kept, cube = np.unique(cubes, return_index=True, return_inverse=True)
        vertices, faces = vertices[kept], cube[faces]
        faces = faces[(faces != faces[:, [1, 2, 0]]).all(axis=1)]
    shape = coal.BVHModelOBBRSS()
    shape.beginModel(len(faces), len(vertices))
    shape.addVertices(np.ascontiguousarray(vertices, dtype=float))
    shape.addTriangles(np.ascontiguousarray(faces, dtype=np.int64))
    shape.endModel()
    return shape


def distance_between(first: Solid, second: Solid) -> tuple[float, Sequence[Array]]:
    """Return the distance between two solids, and their nearest points.

    Returns
    -------
    distance : float
        Distance [m]; below zero, the depth of penetration.
    points : sequence of ndarray, shape (3,)
        The nearest point of each solid, in B [m].
    """
    # with the nearest points, too
    request, result = coal.DistanceRequest(True), coal.DistanceResult()
    away = coal.distance(first.shape, first.place, second.shape, second.place, request, result)
    return float(away), (result.getNearestPoint1(), result.getNearestPoint2())
