"""Triangle meshes of grids of points, and of outlines extruded along y."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices

__all__ = ["Triangles", "drawn_out", "grid"]


class Triangles(NamedTuple):
    """A triangle mesh.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        Corners [m].
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's corners, counterclockwise seen from outside.
    """

    vertices: Array
    faces: Indices


def grid(points: Array) -> Triangles:
    """Return a grid of points as a triangle mesh, two triangles for each cell of the grid.

    Parameters
    ----------
    points : ndarray, shape (n, m, 3)
        Points of the grid by row and column [m].

    Returns
    -------
    Triangles
        n m vertices in the order of the points, row by row, and 2 (n − 1) (m − 1) faces.
    """
    rows, columns, _ = points.shape
    place = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        part.ravel() for part in (place[:-1, :-1], place[1:, :-1], place[:-1, 1:], place[1:, 1:])
    )
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([b, d, c])])
    return Triangles(points.reshape(-1, 3), faces)


def drawn_out(outline: Array, low: float, high: float) -> Triangles:
    """Extrude an outline along y into a triangle mesh.

    Parameters
    ----------
    outline : ndarray, shape (n, 2)
        Points (x, z) in order, with the rock on their left seen along y [m].
    low, high : float
        Least and largest y of the extrusion [m].
    """
    return grid(np.stack([np.insert(outline, 1, y, axis=1) for y in (low, high)]))
