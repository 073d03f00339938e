"""Convex hulls of a planar gripper's wrenches: extents, cuts, sections, limits along directions.

Wrenches are rows (F_x, F_z, M_y) in the paper's signs: its M_y is minus the contract's. A hull is
given by any points whose convex hull it is; what comes back are vertices.

A cut through the origin leaves the origin on a face, where "inside" and "beyond" differ by rounding
alone. So what is within the base tolerance of a plane, as a share of the hull's size, counts as
lying on it, and what lies on a face counts as within: nothing jumps where a wrench crosses a face
by less.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.compliance import PLANAR_COMPONENTS
from hand_models.wrench_spaces import WRENCH_SCALE, hull, hull_facets

__all__ = [
    "PLANAR_SCALE",
    "Extents",
    "clipped_vertices",
    "distance_along",
    "edge",
    "extents",
    "in_paper_signs",
    "section",
    "vertices",
    "volume",
    "with_mirrored",
]

PLANAR_SCALE: Final = WRENCH_SCALE[list(PLANAR_COMPONENTS)]
"""Per newton, newton and newton metre: what makes wrenches commensurate."""


class Extents(NamedTuple):
    """Extents of a set of wrenches: largest |F_x|, least F_z, largest |M_y| [N, N, N·m]."""

    force_x: float
    force_z: float
    moment: float


def in_paper_signs(wrenches: Array) -> Array:
    """Return (F_x, F_z, M_y) in the paper's signs of wrenches (n, 6) in the contract's."""
    return wrenches[:, PLANAR_COMPONENTS] * (1.0, 1.0, -1.0)


def extents(points: Array) -> Extents:
    """Return how far some wrenches, shape (n, 3), go."""
    largest = np.abs(points).max(axis=0)
    return Extents(float(largest[0]), float(points[:, 1].min()), float(largest[2]))


def with_mirrored(points: Array) -> Array:
    """Return wrenches (n, 3) of a symmetric gripper, and their images (−F_x, F_z, −M_y)."""
    return np.vstack([points, points * (-1.0, 1.0, -1.0)])


def edge(points: Array, at: Array) -> Array:
    """Return the largest second coordinate of a plane hull at some first ones.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Whose hull it is.
    at : ndarray, shape (m,)

    Returns
    -------
    ndarray, shape (m,)
        Not a number beside the hull.
    """
    size = np.abs(points).max(axis=0)
    normals, offsets = hull_facets(points / size)
    above = normals[:, 1] > BASE_TOLERANCES.relative
    heights = (offsets[above] - at[:, None] / size[0] * normals[above, 0]) / normals[above, 1]
    inside = (at >= points[:, 0].min()) & (at <= points[:, 0].max())
    return np.where(inside, heights.min(axis=1) * size[1], np.nan)


def vertices(points: Array) -> Array:
    """Return the vertices of a hull, shape (k, 3).

    Raises
    ------
    SolverError
        If the points span no volume.
    """
    return points[hull(points * PLANAR_SCALE).vertices]


def volume(points: Array) -> float:
    """Return the volume of a hull over F_x, F_z and M_y [N³·m]."""
    return float(hull(points * PLANAR_SCALE).volume / np.prod(PLANAR_SCALE))


def clipped_vertices(points: Array) -> Array:
    """Return the vertices of the part of a hull with F_z ≤ 0, which the paper shows, shape (k, 3).

    None, shape (0, 3), if no vertex of the hull is below.
    """
    height, slack = points[:, 1], _slack(points)
    if not (height < -slack).any():
        return np.zeros((0, 3))
    if (height <= slack).all():
        return vertices(points)
    # exactly on the plane: the part's face there is one face
    face = _met(points, height, slack) * (1.0, 0.0, 1.0)
    return vertices(np.vstack([points[height < -slack], face]))


def section(points: Array, normal: ArrayLike) -> Array:
    """Return the polygon in which the plane normal · w = 0 meets a hull, in order, shape (k, 3).

    A face, an edge's two ends or one vertex where the plane only touches the hull; no corners,
    shape (0, 3), if it misses it.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches [N, N, N·m].
    normal : array_like, shape (3,)
    """
    way = np.asarray(normal, dtype=float) / PLANAR_SCALE
    slack = _slack(points)
    met = _met(points, (points * PLANAR_SCALE) @ way / np.linalg.norm(way), slack)
    if not len(met):
        return met
    # coordinates in the plane, of commensurate units
    basis = np.linalg.svd(way[None])[2][1:]
    return met[_outermost(met * PLANAR_SCALE @ basis.T, slack)]


def distance_along(points: Array, directions: Array, start: ArrayLike = 0.0) -> Array:
    """Return the largest s ≥ 0 with start + s · direction in a hull, shape (m,).

    Not a number where the line misses the hull, or meets it only behind. A start on a face counts
    as within it: along the face, rounding decides neither whether the line is in the hull nor where
    it ends.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches [N, N, N·m].
    directions : ndarray, shape (m, 3)
        In the wrenches' units, of any length.
    start : array_like, shape (3,) or (m, 3), optional
        The origin by default [N, N, N·m].
    """
    normals, offsets = hull_facets(points * PLANAR_SCALE)
    slack = _slack(points)
    gaps = offsets - np.broadcast_to(start, directions.shape) * PLANAR_SCALE @ normals.T
    gaps = np.where(gaps < -slack, gaps, np.maximum(gaps, slack))
    slopes = (directions * PLANAR_SCALE) @ normals.T
    with np.errstate(divide="ignore", over="ignore"):
        ratios = gaps / slopes
    most = np.where(slopes > 0.0, ratios, np.inf).min(axis=1)
    least = np.where(slopes < 0.0, ratios, -np.inf).max(axis=1)
    blocked = ((slopes == 0.0) & (gaps < 0.0)).any(axis=1)
    return np.where((most >= np.maximum(least, 0.0)) & ~blocked, most, np.nan)


def _slack(points: Array) -> float:
    """Return how near wrenches of a hull are that rounding alone may part [N]."""
    return BASE_TOLERANCES.relative * float(np.abs(points * PLANAR_SCALE).max(initial=0.0))


def _met(points: Array, height: Array, slack: float) -> Array:
    """Return where a hull meets the plane at which its height is zero, shape (k, 3).

    Vertices no farther than ``slack`` from it, and where edges cross it between the others.
    """
    triangles = hull(points * PLANAR_SCALE).simplices
    pairs = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    near, far = np.unique(np.sort(pairs), axis=0).T
    side = np.where(np.abs(height) <= slack, 0.0, np.sign(height))
    across = side[near] * side[far] < 0.0
    near, far = near[across], far[across]
    part = height[near] / (height[near] - height[far])
    crossings = points[near] + part[:, None] * (points[far] - points[near])
    return np.vstack([points[side == 0.0], crossings])


def _outermost(flat: Array, slack: float) -> Indices:
    """Return which of some points (n, 2) are corners of their hull, two ends of it, or one."""
    _, widths, axes = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    if len(widths) > 1 and widths[1] > slack:
        return np.asarray(hull(flat).vertices, dtype=np.intp)
    along = flat @ axes[0]
    return np.unique([along.argmin(), along.argmax()] if widths[0] > slack else [0])
