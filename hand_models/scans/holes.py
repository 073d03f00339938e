"""Gaps between triangulated points: triangles that bridge too much, and the holes that they leave.

A triangle bridges its circumscribed circle, in which no point lies, and the distance between its
corners in space. A hole is as wide as the largest circle without points whose centre is in the
hole. Triangles on the outline have circles that reach beyond it, however short their edges: those
are no holes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.rock import connected, grouped

__all__ = ["Gaps", "Hole", "Step", "empty_circles"]


class Hole(NamedTuple):
    """Part of the rock without points, seen along the view.

    Attributes
    ----------
    width : float
        Diameter of the widest circle without points whose centre is in the hole, across the
        view [m].
    place : ndarray, shape (3,)
        Mean of the hole's corners, in the rock's frame [m].
    """

    width: float
    place: Array


class Step(NamedTuple):
    """Jump along the view between neighbouring points, so large that it may hide rock.

    Attributes
    ----------
    height : float
        Height of the jump along the view [m].
    place : ndarray, shape (3,)
        Mean of the step's corners, in the rock's frame [m].
    """

    height: float
    place: Array


@dataclass(frozen=True, eq=False)
class Gaps:
    """Triangles of a Delaunay triangulation across z, with the width that each bridges.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        The points, z along the view [m].
    corners : ndarray of int, shape (m, 3)
        Indices of each triangle's points.
    beside : ndarray of int, shape (m, 3)
        Indices of each triangle's neighbours, −1 for none.
    bridged : ndarray, shape (m,)
        Width that each triangle bridges [m]; infinite for slivers of the outline.
    area : ndarray, shape (m,)
        Area of each triangle across z [m²].
    """

    points: Array
    corners: Indices
    beside: Indices
    bridged: Array
    area: Array

    @classmethod
    def between(cls, points: Array, corners: Indices, beside: Indices) -> Gaps:
        """Return the gaps of triangles; the arguments are the attributes of the same names."""
        from hand_models.scans.compiled_triangulation import bridged_widths

        return cls(points, corners, beside, *bridged_widths(points, corners, beside))

    def open_(self, hole: float) -> NDArray[np.bool_]:
        """Return True for each triangle that bridges more than ``hole`` [m], shape (m,)."""
        return np.asarray(self.bridged > hole)

    def covered(self, hole: float) -> float:
        """Return the share of the area across z that closed triangles cover.

        Closed are the triangles that bridge no more than ``hole`` [m].
        """
        return float(self.area[~self.open_(hole)].sum() / self.area.sum())

    def gap(self, hole: float) -> float:
        """Return the median width, by area, of what is open between the points [m]; 0 if nothing.

        Open are the triangles that bridge more than ``hole`` [m].
        """
        wide = np.flatnonzero(self.open_(hole) & np.isfinite(self.bridged))
        wide = wide[np.argsort(self.bridged[wide])]
        covered = np.cumsum(self.area[wide])
        if not len(wide):
            return 0.0
        return float(self.bridged[wide[np.searchsorted(covered, 0.5 * covered[-1])]])

    def alone(self, hole: float) -> int:
        """Return the number of points that no closed triangle joins, with a step around them.

        Stray points are such: across the view others are near, and along it more than ``hole`` [m]
        away.
        """
        open_ = self.open_(hole)
        lone = np.ones(len(self.points), dtype=bool)
        lone[self.corners[~open_]] = False
        about = self.corners[lone[self.corners].any(axis=1)]
        triangles = self.points[about]
        step = (empty_circles(triangles) <= hole) & (np.ptp(triangles[..., 2], axis=1) > hole)
        beside = about[step]
        return int(np.count_nonzero(lone[np.unique(beside)]))

    def left(self, hole: float) -> tuple[tuple[Hole, ...], tuple[Step, ...]]:
        """Return the open holes and steps that are not connected to the outline.

        Parameters
        ----------
        hole : float
            Largest width of a hole, and largest height of a step, that is bridged [m].

        Returns
        -------
        tuple of (tuple of Hole, tuple of Step)
            The widest hole and the highest step first.
        """
        open_ = self.open_(hole)
        corners, beside = self.corners[open_], self.beside[open_]
        number = np.cumsum(open_) - 1
        rows, side = np.nonzero((beside >= 0) & open_[beside])
        part = connected(np.column_stack([rows, number[beside[rows, side]]]), len(corners))
        outside = np.zeros(len(corners), dtype=bool)
        outside[part[(beside < 0).any(axis=1)]] = True
        groups = grouped(np.flatnonzero(~outside[part]), part)
        holes: list[Hole] = []
        steps: list[Step] = []
        for group in groups:
            triangles = self.points[corners[group]]
            place, circle = triangles.mean(axis=(0, 1)), float(empty_circles(triangles).max())
            rise = float(np.ptp(triangles[..., 2], axis=1).max())
            if circle > hole:
                holes.append(Hole(circle, place))
            elif rise > hole:
                steps.append(Step(rise, place))
        return (
            tuple(sorted(holes, key=lambda each: -each.width)),
            tuple(sorted(steps, key=lambda each: -each.height)),
        )


def empty_circles(triangles: Array) -> Array:
    """Return the diameter of the largest empty circle with its centre in each triangle.

    An empty circle has no corner inside. It is the circumscribed circle, unless the triangle is
    obtuse; then its centre is on the longest edge, equally far from two corners.

    Parameters
    ----------
    triangles : ndarray, shape (m, 3, 3)
        Triangles of a Delaunay triangulation across z [m].

    Returns
    -------
    ndarray, shape (m,)
        Diameters [m].
    """
    edges = triangles[:, [1, 2, 0], :2] - triangles[:, :, :2]
    a, b, c = np.sort(np.linalg.norm(edges, axis=2), axis=1).T
    twice = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    obtuse = a**2 + b**2 <= c**2
    tiny = np.finfo(float).tiny
    near = [
        2.0 * one**2 * c / np.maximum(one**2 + c**2 - other**2, tiny)
        for one, other in ((a, b), (b, a))
    ]
    circle = a * b * c / np.where(obtuse, 1.0, np.maximum(twice, tiny))
    return np.asarray(np.where(obtuse, np.maximum(*near), circle))
