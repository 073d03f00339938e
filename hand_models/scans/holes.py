"""Gaps between triangulated points: triangles that bridge too much, and the holes that they leave.

A triangle bridges its circumscribed circle, in which no point lies, and the distance between its
corners in space. A hole is as wide as the largest circle without points whose centre is in the
hole. Triangles on the outline have circles that reach beyond it, however short their edges: those
are no holes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.rock import connected, grouped
from hand_models.scans.rock import Hole, Step

__all__ = ["Gaps", "empty_circles"]


@dataclass(frozen=True, eq=False)
class Gaps:
    """Triangles of a Delaunay triangulation across z, with the width that each bridges.

    Attributes
    ----------
    triangles : ndarray, shape (m, 3, 3)
        Corners of each triangle [m].
    beside : ndarray of int, shape (m, 3)
        Neighbour opposite to each corner, −1 for none.
    bridged : ndarray, shape (m,)
        Width that each triangle bridges [m]; infinite for slivers of the outline.
    area : ndarray, shape (m,)
        Area across z [m²].
    """

    triangles: Array
    beside: NDArray[np.int32]
    bridged: Array
    area: Array

    @classmethod
    def between(cls, triangles: Array, beside: NDArray[np.int32]) -> Gaps:
        """Compute the width that each triangle bridges, and its area.

        Parameters
        ----------
        triangles : ndarray, shape (m, 3, 3)
            Corners of each triangle [m].
        beside : ndarray of int, shape (m, 3)
            Neighbour opposite to each corner, −1 for none.
        """
        edges = _edges(triangles)
        across, area = np.hypot(edges[..., 0], edges[..., 1]), _areas(edges)
        # hardly any area, as a part of the longest edge's square
        sliver = 2.0 * area <= 1e-6 * across.max(axis=1) ** 2
        circle = np.where(sliver, 0.0, across.prod(axis=1) / np.where(sliver, 1.0, 2.0 * area))
        width = np.maximum(circle, np.linalg.norm(edges, axis=2).max(axis=1))
        width[sliver & (beside < 0).any(axis=1)] = np.inf
        return cls(triangles, beside, width, area)

    def open_(self, hole: float) -> NDArray[np.bool_]:
        """Return True for each triangle that bridges more than ``hole`` [m], shape (m,)."""
        return np.asarray(self.bridged > hole)

    def covered(self, hole: float) -> float:
        """Return the share of the area across z that closed triangles cover.

        Closed are the triangles that bridge no more than ``hole`` [m].
        """
        return float(self.area[~self.open_(hole)].sum() / self.area.sum())

    def left(self, hole: float) -> tuple[tuple[Hole, ...], tuple[Step, ...]]:
        """Return the open holes and steps that are not connected to the outline.

        Parameters
        ----------
        hole : float
            Largest width, and largest height, that is bridged [m].

        Returns
        -------
        tuple of (tuple of Hole, tuple of Step)
            The widest hole and the highest step first.
        """
        open_, beside, count = self.open_(hole), self.beside, len(self.triangles)
        rows, side = np.nonzero(open_[:, None] & (beside >= 0) & open_[beside])
        part = connected(np.column_stack([rows, beside[rows, side]]), count)
        outside = np.zeros(count, dtype=bool)
        outside[part[(beside < 0).any(axis=1)]] = True
        groups = grouped(np.flatnonzero(open_ & ~outside[part]), part)
        circle, rise = (
            empty_circles(self.triangles),
            np.abs(_edges(self.triangles)[..., 2]).max(axis=1),
        )
        holes: list[Hole] = []
        steps: list[Step] = []
        for group in groups:
            place = self.triangles[group].mean(axis=(0, 1))
            if circle[group].max() > hole:
                holes.append(Hole(float(circle[group].max()), place))
            elif rise[group].max() > hole:
                steps.append(Step(float(rise[group].max()), place))
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
        [m]
    """
    edges = _edges(triangles[:, :, :2])
    a, b, c = np.sort(np.linalg.norm(edges, axis=2), axis=1).T
    twice = 2.0 * _areas(edges)
    obtuse = a**2 + b**2 <= c**2
    tiny = np.finfo(float).tiny
    near = [
        2.0 * one**2 * c / np.maximum(one**2 + c**2 - other**2, tiny)
        for one, other in ((a, b), (b, a))
    ]
    circle = a * b * c / np.where(obtuse, 1.0, np.maximum(twice, tiny))
    return np.asarray(np.where(obtuse, np.maximum(*near), circle))


def _edges(triangles: Array) -> Array:
    return triangles[:, [1, 2, 0]] - triangles


def _areas(edges: Array) -> Array:
    """Return areas across z of triangles, by their edges (m, 3, 2 or 3), shape (m,)."""
    cross = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    return np.asarray(0.5 * np.abs(cross))
