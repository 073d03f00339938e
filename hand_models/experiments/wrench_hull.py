"""Convex hulls of a planar gripper's wrenches: extents, cuts, sections, limits along directions.

Wrenches are rows (F_x, F_z, M_y) in the paper's signs: its M_y is minus that of other modules.
A hull is given by any points whose convex hull it is; results are vertices.

A cut through the origin leaves the origin on a face, where "inside" and "beyond" differ by rounding
alone. So points within the base tolerance of a plane, as a share of the hull's size, count as lying
on the plane, and points on a face count as inside: no result jumps where a wrench crosses a face by
less.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.compliance import PLANAR_COMPONENTS
from hand_models.wrench_spaces import WRENCH_SCALE, hull, hull_facets

__all__ = [
    "PLANAR_SCALE",
    "Extents",
    "best_moments",
    "clipped_vertices",
    "distance_along",
    "edge",
    "extents",
    "in_paper_signs",
    "loading_planes",
    "pull_off_map",
    "reach_toward",
    "section",
    "strongest",
    "vertices",
    "volume",
    "with_mirrored",
]

PLANAR_SCALE: Final = WRENCH_SCALE[list(PLANAR_COMPONENTS)]
"""Factors for F_x, F_z and M_y that make wrenches commensurate: moments over 0.1 m [N]."""


class Extents(NamedTuple):
    """Extents of a set of wrenches.

    Attributes
    ----------
    force_x : float
        Largest magnitude of F_x [N].
    force_z : float
        Least F_z [N].
    moment : float
        Largest magnitude of M_y [N·m].
    """

    force_x: float
    force_z: float
    moment: float


def in_paper_signs(wrenches: Array) -> Array:
    """Convert wrenches to the paper's planar components and signs: M_y changes its sign.

    Parameters
    ----------
    wrenches : ndarray, shape (n, 6)
        Forces and moments [N, N·m].

    Returns
    -------
    ndarray, shape (n, 3)
        F_x, F_z, M_y [N, N, N·m].
    """
    return wrenches[:, PLANAR_COMPONENTS] * (1.0, 1.0, -1.0)


def extents(points: Array) -> Extents:
    """Return the extents of a set of wrenches.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        F_x, F_z, M_y [N, N, N·m].
    """
    largest = np.abs(points).max(axis=0)
    return Extents(float(largest[0]), float(points[:, 1].min()), float(largest[2]))


def with_mirrored(points: Array) -> Array:
    """Return wrenches of a symmetric gripper together with their mirror images.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches F_x, F_z, M_y [N, N, N·m].

    Returns
    -------
    ndarray, shape (2 n, 3)
        The wrenches, then (−F_x, F_z, −M_y) of each.
    """
    return np.vstack([points, points * (-1.0, 1.0, -1.0)])


def edge(points: Array, at: Array) -> Array:
    """Return the largest second coordinate of a hull in the plane, at given first coordinates.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Points whose convex hull is taken.
    at : ndarray, shape (m,)
        First coordinates.

    Returns
    -------
    ndarray, shape (m,)
        Second coordinates; NaN beside the hull.
    """
    size = np.abs(points).max(axis=0)
    normals, offsets = hull_facets(points / size)
    above = normals[:, 1] > BASE_TOLERANCES.relative
    heights = (offsets[above] - at[:, None] / size[0] * normals[above, 0]) / normals[above, 1]
    inside = (at >= points[:, 0].min()) & (at <= points[:, 0].max())
    return np.where(inside, heights.min(axis=1) * size[1], np.nan)


def reach_toward(points: Array, places: Array) -> Array:
    """Return how far a plane hull about the origin reaches toward places, over their distances.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Points whose hull it is.
    places : ndarray, shape (m, 2)

    Returns
    -------
    ndarray, shape (m,)
        1 for a place on the edge, more for one inside.
    """
    size = np.abs(points).max(axis=0)
    normals, offsets = hull_facets(np.vstack([points, 0.0 * points[:1]]) / size)
    slopes = places / size @ normals.T
    least = BASE_TOLERANCES.relative
    return np.asarray(
        np.where(slopes > least, offsets / np.maximum(slopes, least), np.inf).min(axis=1)
    )


def vertices(points: Array) -> Array:
    """Return the vertices of the convex hull of wrenches (n, 3), shape (k, 3).

    Raises
    ------
    SolverError
        If the points span no volume.
    """
    return points[hull(points * PLANAR_SCALE).vertices]


def volume(points: Array) -> float:
    """Return the volume of the convex hull of wrenches, over F_x, F_z and M_y [N³·m].

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        F_x, F_z, M_y [N, N, N·m].
    """
    return float(hull(points * PLANAR_SCALE).volume / np.prod(PLANAR_SCALE))


def clipped_vertices(points: Array) -> Array:
    """Return the vertices of the part of a convex hull with F_z ≤ 0, which the paper shows.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches F_x, F_z, M_y whose hull it is [N, N, N·m].

    Returns
    -------
    ndarray, shape (k, 3)
        Vertices [N, N, N·m]; empty, (0, 3), if no vertex of the hull has F_z < 0.
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
    """Return the polygon in which the plane normal · w = 0 cuts a hull of wrenches w, in order.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches [N, N, N·m].
    normal : array_like, shape (3,)
        Normal of the plane through the origin, of any length.

    Returns
    -------
    ndarray, shape (k, 3)
        Corners of the polygon. Where the plane only touches the hull: the corners of a face, the
        two ends of an edge, or one vertex. Empty, (0, 3), if the plane misses the hull.
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
    """Return the largest s ≥ 0 with start + s · direction in a hull, for each direction.

    A start on a face counts as inside: along the face, rounding decides neither whether the line is
    in the hull nor where the line ends.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches [N, N, N·m].
    directions : ndarray, shape (m, 3)
        Directions in the wrenches' units, of any length.
    start : array_like, shape (3,) or (m, 3), optional
        Wrench at which the line starts; zero by default [N, N, N·m].

    Returns
    -------
    ndarray, shape (m,)
        Largest s of each direction; NaN where the line misses the hull, or meets it only for s < 0.
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


def loading_planes(points: Array) -> dict[str, Any]:
    """Return the greatest force and moment of a hull in planes M_y = a F_x, and the best planes.

    Both √(F_x² + F_z²) and the magnitude of M_y are convex, so that the best are at vertices of the
    hull.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches of the part F_z ≤ 0 [N, N, N·m].

    Returns
    -------
    dict
        ``arm``: values of a, one for each plane [m]; ``force`` [N] and ``moment`` [N·m]: the
        greatest in each plane;
        ``best_for_force`` and ``best_for_moment``: the best over all planes, with
        ``arms_as_good``, the range of arms within 1 % of the best.
    """
    size = np.abs(points).max(axis=0)
    turns = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)[1:-1]
    arms = np.tan(turns) * size[2] / size[0]
    slices = [_strengths(section(points, (arm, 0.0, -1.0))) for arm in arms]
    planes: dict[str, Any] = {"arm": arms}
    for name in ("force", "moment"):
        planes[name] = np.array([strengths[name].max(initial=0.0) for strengths in slices])
    for name, best in strongest(points).items():
        good = arms[planes[name] >= (1.0 - 0.01) * best[name]]  # within 1 % of the best
        alike = [good.min(), good.max()] if len(good) else None
        planes[f"best_for_{name}"] = {**best, "arms_as_good": alike}
    return planes


def strongest(points: Array) -> dict[str, dict[str, Any]]:
    """Return the wrenches of the greatest force and of the greatest moment, and their planes.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches [N, N, N·m].

    Returns
    -------
    dict
        For ``force`` and ``moment`` the ``wrench`` and its strength; ``arm``: M_y over F_x [m];
        ``ratio``: F_x over M_y [1/m].
    """
    found = {}
    for name, strengths in _strengths(points).items():
        # of a wrench and its mirror image, which are as strong, that to the right
        most = strengths.max()
        alike = points[strengths >= (1.0 - BASE_TOLERANCES.relative) * most]
        best = alike[alike[:, 0].argmax()]
        arm, ratio = best[2] / best[0], best[0] / best[2]
        found[name] = {"wrench": best, name: most, "arm": arm, "ratio": ratio}
    return found


def _strengths(points: Array) -> dict[str, Array]:
    """Return what wrenches count for, by force and by moment."""
    return {"force": np.hypot(points[:, 0], points[:, 1]), "moment": np.abs(points[:, 2])}


def pull_off_map(points: Array, force_x: Array, moment: Array) -> dict[str, Array]:
    """Return the least F_z of a hull (n, 3) over (F_x, M_y), a row for each M_y; NaN outside."""
    x, m = np.meshgrid(force_x, moment)
    start = np.column_stack([x.ravel(), 0.0 * x.ravel(), m.ravel()])
    down = np.tile([0.0, -1.0, 0.0], (len(start), 1))
    least = -distance_along(points, down, start).reshape(x.shape)
    return {"force_x": force_x, "moment": moment, "force_z": least}


def best_moments(points: Array, force_x: Array) -> dict[str, Array]:
    """Return, for each F_x > 0, the best M_y for pulling off, the strength there and at M_y = 0.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Wrenches whose hull it is [N, N, N·m].
    force_x : ndarray, shape (m,)
        Ascending values of F_x; those from which on no wrench pulls off are left out [N].
    """
    found = []
    for force in force_x[force_x > 0.0]:
        at = np.array([force, 0.0, 0.0])
        cut = section(points - at, (1.0, 0.0, 0.0))
        if not len(cut) or cut[:, 1].min() >= 0.0:
            break
        _, least, best = cut[cut[:, 1].argmin()]
        without = distance_along(points, np.array([[0.0, -1.0, 0.0]]), at)[0]
        found.append((force, best, -least, without))
    names = ("force_x", "best_moment", "strength", "strength_without")
    return dict(zip(names, np.reshape(found, (-1, len(names))).T, strict=True))


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
