"""Find the triangle that is seen in each pixel of a picture (compiled)."""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["seen_triangles"]


@compiled()
def _area(a: Array, b: Array, row: float, column: float) -> float:
    return float((a[0] - row) * (b[1] - column) - (a[1] - column) * (b[0] - row))


@compiled("f3", "i0", "i0")
def seen_triangles(triangles: Array, rows: int, columns: int) -> Indices:
    """Return the triangle of least z at each pixel's middle.

    Parameters
    ----------
    triangles : ndarray, shape (m, 3, 3)
        Corners (x, y, z) of each triangle; x counts rows and y columns of pixels, from the middle
        of the first.
    rows, columns : int
        Number of pixels along x and y.

    Returns
    -------
    ndarray of int, shape (rows, columns)
        Index of the triangle; −1 where none covers the pixel's middle.
    """
    seen, depth = np.full((rows, columns), -1), np.full((rows, columns), math.inf)
    for i in range(len(triangles)):
        a, b, c = triangles[i]
        area = _area(b, c, a[0], a[1])
        if area == 0.0:
            continue
        top, bottom = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        left, right = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        for row in range(max(math.ceil(top), 0), min(math.floor(bottom), rows - 1) + 1):
            for column in range(max(math.ceil(left), 0), min(math.floor(right), columns - 1) + 1):
                u, v = _area(b, c, row, column) / area, _area(c, a, row, column) / area
                # a middle on an edge is in one of the triangles beside it, however it is rounded
                if min(u, v, 1.0 - u - v) < -1e-9:
                    continue
                z = u * a[2] + v * b[2] + (1.0 - u - v) * c[2]
                if z < depth[row, column]:
                    seen[row, column], depth[row, column] = i, z
    return seen
