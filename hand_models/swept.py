"""Smooth holds in one form: a ball, stretched along the axes, that is swept along two faces.

With x from the hold's frame, its centre c at (0, 0, depth) and the scales S on the diagonal, the
rock is every point y that a point of the ball ``|S (x − c)| ≤ radius`` gets to along the directions
of the faces, (± sine, 0, cosine):

- a ball and a boulder have no faces;
- a log is a ball without its scale along y, so that every plane across y cuts the same disc;
- an edge is a log swept along its two faces;
- a wall is an edge of half a turn whose log has no size, and of which only z counts.

So what many holds ask is the same arithmetic on arrays, whatever their kinds.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from hand_models.frames import Array

__all__ = ["Swept", "entries"]

SIDES: Final = np.array([1.0, -1.0]).reshape(2, 1, 1)
"""Of the faces along x."""


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


def entries(shapes: Array, points: Array, directions: Array) -> Array:
    """Return how far from points, along unit directions, the rock of each hold begins.

    Parameters
    ----------
    shapes : ndarray, shape (n, 8)
        Numbers of a `Swept` in each row.
    points : ndarray, shape (n, k, 3)
        From the centre of each hold's ball, scaled.
    directions : ndarray, shape (n, 3)
        Scaled.

    Returns
    -------
    ndarray, shape (n, k)
        Negative where a point is inside; infinite where a line misses the rock [m].
    """
    radius = shapes[:, 4:5]
    a = (directions * directions).sum(axis=1)[:, None]
    b = (points @ directions[:, :, None])[..., 0]
    discriminant = b * b - a * ((points * points).sum(axis=2) - radius * radius)
    first = (-b - np.sqrt(discriminant)) / a
    # the square root of what is negative, or nothing over nothing
    first[~((discriminant >= 0.0) & (radius > 0.0))] = np.inf
    if shapes[:, 5].any():
        sine, cosine, grazing = shapes[:, 5:6], shapes[:, 6:7], shapes[:, 7:8]
        x, z = points[..., 0], points[..., 2]
        dx, dz = directions[:, 0:1], directions[:, 2:3]
        # both faces, each on its side
        aside, sunk = SIDES * cosine, sine * dz
        closing = aside * dx - sunk
        hit = (radius - aside * x + sine * z) / closing
        beyond = SIDES * sine * (x + hit * dx) + cosine * (z + hit * dz) >= 0.0
        hit[~(beyond & (closing < -grazing))] = np.inf
        first = np.minimum(first, np.minimum(hit[0], hit[1]))
    return np.asarray(first)
