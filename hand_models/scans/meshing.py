"""Points to triangles: projected along the view, thinned, and joined where they are near.

Rock that was seen from one side is a height over the plane across the view. There the points are
triangulated (Delaunay), and triangles that would bridge more than a finger does not care for are
left out: those whose circle, in which no point lies, is wider than a hole may be, and those with an
edge longer than that, which are steps that hide rock.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import Array, Indices, InvalidInputError, Pose, Progress
from hand_models.parameters import scan_table
from hand_models.rock import FilledCells, Triangles, filled_cells
from hand_models.scans.rock import Hole, ScannedRock
from hand_models.scans.scan import Scan

__all__ = ["mesh_scan"]

STEPS: Final = 3
"""Steps that are told: thinned, triangulated, parted from holes."""

SAMPLE: Final = 20_000
"""Points whose neighbours tell the spacing."""

FLAT: Final = 1e-9
"""Width of points on a line, of their length."""

GROWTH: Final = 1.15
"""By how much squares grow at least until few enough points are left."""

STEEP: Final = 0.1
"""Across the view, what is left of an axis that may point up in a picture."""

SLIVER: Final = 1e-6
"""Area of a triangle without one, of its longest edge's square."""


def mesh_scan(
    scan: Scan,
    *,
    spacing: float | None = None,
    hole: float | None = None,
    tell: Progress = lambda done, total: None,
) -> ScannedRock:
    """Return a scan as triangles, seen from where it was scanned.

    Parameters
    ----------
    scan : Scan
    spacing : float, optional
        Side of the squares across the view of which each keeps one point, that of median depth. By
        default half the median distance between neighbours, or as much more as leaves no more
        points than ``scan.toml`` says [m].
    hole : float, optional
        The widest hole that is bridged, by default as ``scan.toml`` says [m].
    tell : callable, optional
        Told how far the work is.

    Raises
    ------
    InvalidInputError
        If a length is not above zero, points are on a line, nothing is left, or the frame's origin
        is not on the rock.
    """
    table = scan_table()
    hole = _length(table.scalar("mesh", "hole") if hole is None else hole, "hole")
    tell(0, STEPS)
    axes = _axes(scan.direction())
    middle = 0.5 * (scan.points.min(axis=0) + scan.points.max(axis=0))
    points = (scan.points - middle) @ axes
    _check_spread(points)
    if spacing is None:
        points = _fewer(points, 0.5 * _spacing(points), int(table.scalar("mesh", "vertices")))
    else:
        points = points[_kept(points, _length(spacing, "spacing"))]
    tell(1, STEPS)
    _check_spread(points)
    try:
        flat = scipy.spatial.Delaunay(points[:, :2])
    except scipy.spatial.QhullError as error:
        raise InvalidInputError(
            f"no triangles: {str(error).splitlines()[0]}", field="file"
        ) from None
    tell(2, STEPS)
    corners, beside = flat.simplices.astype(np.intp), flat.neighbors
    width, open_ = _widths(points[corners], beside)
    open_ |= width > hole
    faces = corners[~open_]
    if not len(faces):
        raise InvalidInputError(
            f"points are {1e3 * _spacing(points):.3g} mm apart, and holes wider than "
            f"{1e3 * hole:.3g} mm stay open: no triangle is left; is the unit right?",
            field="hole",
        )
    filled = filled_cells(Triangles(points, corners))
    holes = _holes(points[corners], beside, width, open_)
    used, faces = np.unique(faces, return_inverse=True)
    points, faces = points[used], faces.reshape(-1, 3)
    start = _start(points, None if scan.origin is None else (scan.origin - middle) @ axes)
    tell(STEPS, STEPS)
    return ScannedRock(
        vertices=points - start,
        # counterclockwise for who looks along z
        faces=_clockwise(points, faces),
        pose=Pose(middle + axes @ start, axes),
        holes=tuple(Hole(wide, place - start) for wide, place in holes),
        read=scan.read,
        dropped=scan.dropped,
        spacing=_spacing(points),
        filled=tuple(_in_scan(cells, middle, axes) for cells in filled),
    )


def _in_scan(cells: FilledCells, middle: Array, axes: Array) -> FilledCells:
    """Return cells in the scan's axes: where any are found, the rock's axes are along them."""
    axis = int(np.abs(axes[:, cells.axis]).argmax())
    value = float(middle[axis] + axes[axis, cells.axis] * cells.value)
    return FilledCells(axis, value, cells.cells)


def _length(value: float, field: str) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InvalidInputError(f"must be finite and above zero, got {value:g}", field=field)
    return value


def _axes(view: Array) -> Array:
    """Return the rock's axes as columns: z along the view, x up, or along y if that is the view."""
    for upward in (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])):
        x = upward - (upward @ view) * view
        length = np.linalg.norm(x)
        if length > STEEP:
            break
    x = x / length
    return np.column_stack([x, np.cross(view, x), view])


def _check_spread(points: Array) -> None:
    """Refuse points that are on a line across the view."""
    across = points[:, :2] - points[:, :2].mean(axis=0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(across.T @ across), 0.0))
    if spread[0] <= math.sqrt(FLAT) * spread[1]:
        raise InvalidInputError(
            "seen along the view, the points lie on one line: they are no surface", field="file"
        )


def _spacing(points: Array) -> float:
    """Return the median distance of a point to the nearest one across the view [m]."""
    across = np.unique(points[:, :2], axis=0)
    some = across[:: max(1, len(across) // SAMPLE)]
    distance = np.asarray(scipy.spatial.cKDTree(across).query(some, k=2)[0])
    return float(np.median(distance[:, 1]))


def _fewer(points: Array, side: float, most: int) -> Array:
    """Return points one a square, of squares so large that no more than ``most`` are left."""
    while True:
        kept = points[_kept(points, side)]
        if len(kept) <= most:
            return kept
        side *= max(GROWTH, math.sqrt(len(kept) / most))


def _kept(points: Array, side: float) -> Indices:
    """Return the point of median depth of each square that has any."""
    place = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / side)
    order = np.lexsort([points[:, 2], place[:, 1], place[:, 0]])
    new = (np.diff(place[order], axis=0) != 0.0).any(axis=1)
    begins = np.concatenate([[0], np.flatnonzero(new) + 1])
    ends = np.append(begins[1:], len(order))
    return np.sort(order[(begins + ends - 1) // 2])


def _widths(triangles: Array, beside: NDArray[np.int32]) -> tuple[Array, NDArray[np.bool_]]:
    """Return what each triangle bridges [m], and which ones are slivers of the outline.

    Parameters
    ----------
    triangles : ndarray, shape (m, 3, 3)
    beside : ndarray of int, shape (m, 3)
        Neighbours, −1 for none.
    """
    edges = triangles[:, [1, 2, 0]] - triangles
    across = np.hypot(edges[..., 0], edges[..., 1])
    twice = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    sliver = twice <= SLIVER * across.max(axis=1) ** 2
    circle = np.where(sliver, 0.0, across.prod(axis=1) / np.where(sliver, 1.0, twice))
    step = np.linalg.norm(edges, axis=2).max(axis=1)
    return np.maximum(circle, step), sliver & (beside < 0).any(axis=1)


def _holes(
    triangles: Array, beside: NDArray[np.int32], width: Array, open_: NDArray[np.bool_]
) -> list[tuple[float, Array]]:
    """Return width and middle of each hole that the outline does not reach, the widest first."""
    count = len(triangles)
    rows, side = np.nonzero(open_[:, None] & (beside >= 0) & open_[beside])
    graph = scipy.sparse.coo_matrix(
        (np.ones(len(rows)), (rows, beside[rows, side])), (count, count)
    )
    number, part = scipy.sparse.csgraph.connected_components(graph, directed=False)
    outside = np.zeros(number, dtype=bool)
    outside[part[(beside < 0).any(axis=1)]] = True
    inside = np.flatnonzero(open_ & ~outside[part])
    order = inside[np.argsort(part[inside], kind="stable")]
    groups = np.split(order, np.flatnonzero(np.diff(part[order])) + 1) if len(order) else []
    found = [(float(width[g].max()), triangles[g].mean(axis=(0, 1))) for g in groups]
    return sorted(found, key=lambda entry: -entry[0])


def _start(points: Array, wanted: Array | None) -> Array:
    """Return the point where the frame begins: the nearest, across the view, to what is wanted."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    target = middle if wanted is None else wanted
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


def _clockwise(points: Array, faces: Indices) -> Indices:
    """Return faces that run clockwise over x and y."""
    a, b, c = (points[faces[:, i], :2] for i in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.asarray(np.where(area[:, None] > 0.0, faces[:, ::-1], faces))
