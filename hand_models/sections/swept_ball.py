"""Smooth holds in one form: a ball, stretched along the axes, that is swept along two faces.

With x from the hold's frame, its centre c at (0, 0, depth) and the scales S on the diagonal, the
rock is every point y that a point of the ball ``|S (x − c)| ≤ radius`` gets to along the directions
of the faces, (± sine, 0, cosine):

- a ball and a boulder have no faces;
- a log is a ball without its scale along y, so that every plane across y cuts the same disc;
- an edge is a log swept along its two faces;
- a wall is an edge of half a turn whose log has no size, and of which only z counts.

So what many holds ask is the same arithmetic, whatever their kinds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

__all__ = ["PARALLEL", "Swept", "Vector3", "entry_distances"]

PARALLEL: Final = 1e-3
"""Below this sine, a finger plane counts as parallel to the axis of an extruded hold."""

Vector3 = Sequence[float]
"""Three numbers."""


class Swept(NamedTuple):
    """A smooth hold.

    Attributes
    ----------
    scale_x, scale_y, scale_z : float
        S; of an ellipsoid in 1/m, of others 1, or 0 for what does not count.
    depth : float
        Of the ball's centre [m].
    radius : float
        Of the scaled ball; of an ellipsoid 1, of others in m, of a wall 0.
    sine, cosine : float
        Of half the angle between the faces; both 0 where there are none.
    grazing : float
        Slope up to which a line counts as parallel to a face.
    """

    scale_x: float
    scale_y: float
    scale_z: float
    depth: float
    radius: float
    sine: float = 0.0
    cosine: float = 0.0
    grazing: float = 0.0


def entry_distances(shape: Swept, points: Sequence[Vector3], direction: Vector3) -> list[float]:
    """Return how far from points, along a unit direction, the rock of a hold begins.

    Parameters
    ----------
    shape : Swept
    points : sequence of (float, float, float)
        From the centre of the hold's ball, scaled.
    direction : (float, float, float)
        Scaled.

    Returns
    -------
    list of float
        Negative where a point is inside; infinite where a line misses the rock [m].
    """
    dx, dy, dz = direction
    a = dx * dx + dy * dy + dz * dz
    radius = shape.radius
    found = []
    for x, y, z in points:
        b = x * dx + y * dy + z * dz
        discriminant = b * b - a * (x * x + y * y + z * z - radius * radius)
        meets = discriminant >= 0.0 and radius > 0.0 and a > 0.0
        found.append((-b - math.sqrt(discriminant)) / a if meets else math.inf)
    if shape.sine:
        faces = [_entries_of_face(shape, points, direction, side) for side in (1.0, -1.0)]
        found = [min(each) for each in zip(found, *faces, strict=True)]
    return found


def _entries_of_face(
    shape: Swept, points: Sequence[Vector3], direction: Vector3, side: float
) -> list[float]:
    """Do the same for the face of a hold on one side along x."""
    dx, _, dz = direction
    sine, cosine = shape.sine, side * shape.cosine
    closing = cosine * dx - sine * dz
    found = []
    for x, _, z in points:
        hit = math.inf
        if closing < -shape.grazing:
            hit = (shape.radius - cosine * x + sine * z) / closing
            if side * sine * (x + hit * dx) + shape.cosine * (z + hit * dz) < 0.0:
                hit = math.inf
        found.append(hit)
    return found
