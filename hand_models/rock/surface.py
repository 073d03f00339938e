"""Surfaces as triangles: between points of a grid, and of outlines that are drawn out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices

__all__ = ["Triangles", "drawn_out", "grid"]


class Triangles(NamedTuple):
    """Vertices, shape (n, 3) [m], and faces, shape (m, 3), counterclockwise from outside."""

    vertices: Array
    faces: Indices


def grid(points: Array) -> Triangles:
    """Return the triangles between points (n, m, 3), two for each cell."""
    rows, columns, _ = points.shape
    place = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (
        part.ravel() for part in (place[:-1, :-1], place[1:, :-1], place[:-1, 1:], place[1:, 1:])
    )
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([b, d, c])])
    return Triangles(points.reshape(-1, 3), faces)


def drawn_out(outline: Array, low: float, high: float) -> Triangles:
    """Return the surface of an outline (x, z), shape (n, 2), drawn out from y = low to high.

    The rock is on its left, seen along y.
    """
    return grid(np.stack([np.insert(outline, 1, y, axis=1) for y in (low, high)]))
