"""Frame of scanned rock: on it, z along the view, x up as far as it can be."""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array, InvalidInputError
from hand_models.parameters import scan_table
from hand_models.rock import FilledCells
from hand_models.scans.scan import Scan

__all__ = ["axes_along", "in_scan", "start_on"]

STEEP: Final = 0.1
"""Across the view, what is left of an axis that may point up in a picture."""


def axes_along(view: Array) -> Array:
    """Return the rock's axes as columns: z along the view, x up, or along y if that is the view."""
    for upward in (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])):
        x = upward - (upward @ view) * view
        length = np.linalg.norm(x)
        if length > STEEP:
            break
    x = x / length
    return np.column_stack([x, np.cross(view, x), view])


def in_scan(cells: FilledCells, middle: Array, axes: Array) -> FilledCells:
    """Return cells in the scan's axes: where any are found, the rock's axes are along them."""
    axis = int(np.abs(axes[:, cells.axis]).argmax())
    value = float(middle[axis] + axes[axis, cells.axis] * cells.value)
    return FilledCells(axis, value, cells.cells)


def start_on(points: Array, scan: Scan, middle: Array, axes: Array) -> Array:
    """Return the point where the frame begins: the nearest, across the view, to what is wanted.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        From ``middle`` along ``axes`` [m].
    scan : Scan
        That may say where it is to begin.
    middle : ndarray, shape (3,)
    axes : ndarray, shape (3, 3)
        Columns, in the scan's axes.
    """
    wanted = None if scan.origin is None else (scan.origin - middle) @ axes
    target = 0.5 * (points.min(axis=0) + points.max(axis=0)) if wanted is None else wanted
    distance = np.hypot(*(points[:, :2] - target[:2]).T)
    nearest = int(distance.argmin())
    near = scan_table().scalar("scan", "near")
    if wanted is not None and distance[nearest] > near:
        raise InvalidInputError(
            f"the nearest rock is {distance[nearest]:.3g} m away, across the view; at most "
            f"{near:g} m is possible",
            field="origin",
        )
    return np.asarray(points[nearest])
