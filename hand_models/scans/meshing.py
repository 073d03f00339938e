"""Mesh a scan: points are projected along the view, thinned, and joined where they are near.

Rock seen from one side is a height over the plane across the view. There the points are
triangulated (Delaunay), and triangles that bridge too much are left out: those whose circumscribed
circle, in which no point lies, is wider than a hole may be, and those with an edge longer than
that, which are steps that hide rock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices, InvalidInputError, Pose, Progress
from hand_models.parameters import scan_table
from hand_models.rock import Triangles, filled_cells
from hand_models.scans.holes import Gaps
from hand_models.scans.kept import keep_triangles
from hand_models.scans.rock import ScannedRock
from hand_models.scans.scan import (
    SCAN_SETTINGS,
    UNIT_METRES,
    Scan,
    Unit,
    axes_along,
    box_about,
    in_scan,
    start_on,
)

__all__ = ["Triangulated", "mesh_scan", "too_large", "too_small", "triangulated", "wider_holes"]


def mesh_scan(
    scan: Scan,
    *,
    spacing: float | None = None,
    hole: float | None = None,
    report: Progress = lambda done, total: None,
) -> ScannedRock:
    """Convert a scan to triangles in a frame on the rock; a file's triangles are kept.

    Parameters
    ----------
    scan : Scan
    spacing : float, optional
        Side of the squares across the view each of which keeps one point, that of median depth. By
        default half the median distance between neighbours, or more by ``scan.toml`` [m].
    hole : float, optional
        Width of the widest hole that is bridged, by default as in ``scan.toml`` [m]. In a file's
        triangles no hole is bridged, and wider ones are reported.
    report : callable, optional
        Called with (steps done, steps in all).

    Returns
    -------
    ScannedRock

    Raises
    ------
    InvalidInputError
        If a length is not above zero, points are on a line, no triangle is left, the frame's
        origin is not on the rock, or a spacing is given for triangles that are kept.
    """
    table, steps = scan_table(), SCAN_SETTINGS.mesh_steps
    hole = _length(table.scalar("mesh", "hole") if hole is None else hole, "hole")
    report(0, steps)
    if scan.faces is not None:
        if spacing is not None:
            raise InvalidInputError(
                "is for points, and the file has triangles, which are kept: leave spacing out",
                field="spacing",
            )
        rock = keep_triangles(scan, hole)
        report(steps, steps)
        return rock
    made = triangulated(scan, spacing, report=report)
    points, axes, middle = made.points, made.axes, made.middle
    faces = made.corners[~made.gaps.open_(hole)]
    if not len(faces):
        raise _nothing_left(scan, made, hole)
    filled = filled_cells(Triangles(points, made.corners))
    holes, drops = made.gaps.left(hole)
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    points, faces = points[used], (np.cumsum(used) - 1)[faces]
    start = start_on(points, scan, middle, axes)
    report(steps, steps)
    return ScannedRock(
        vertices=points - start,
        # counterclockwise for who looks along z
        faces=faces[:, ::-1],
        pose=Pose(middle + axes @ start, axes),
        holes=tuple(each._replace(place=each.place - start) for each in holes),
        steps=tuple(each._replace(place=each.place - start) for each in drops),
        read=scan.read,
        dropped=scan.dropped,
        covered=made.gaps.covered(hole),
        outliers=scan.outliers,
        alone=made.gaps.alone(hole),
        spacing=_spacing(points),
        filled=tuple(in_scan(cells, middle, axes) for cells in filled),
        gaps=made.gaps,
    )


class Triangulated(NamedTuple):
    """Thinned points of a scan, and the triangles between them.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Coordinates from ``middle`` along ``axes`` [m].
    corners : ndarray of int, shape (m, 3)
        Indices of each triangle's points, counterclockwise over x and y.
    gaps : Gaps
        The width that each triangle bridges.
    middle : ndarray, shape (3,)
        Origin of the points' coordinates, in the scan's axes [m].
    axes : ndarray, shape (3, 3)
        Columns: axes of the points' coordinates, in the scan's axes; z along the view.
    """

    points: Array
    corners: Indices
    gaps: Gaps
    middle: Array
    axes: Array


def triangulated(
    scan: Scan, spacing: float | None, *, report: Progress = lambda done, total: None
) -> Triangulated:
    """Thin a scan's points and triangulate them across the view (Delaunay).

    Parameters
    ----------
    scan : Scan
    spacing : float or None
        Side of the squares across the view each of which keeps one point; None for the default of
        `mesh_scan` [m].
    report : callable, optional
        Called with (steps done, steps of `mesh_scan`).

    Raises
    ------
    InvalidInputError
        If the spacing is not above zero, points are on a line, or points are farther than
        ``farthest`` of ``scan.toml`` from the median point.
    """
    _check_strays(scan.points)
    axes = axes_along(scan.direction())
    middle = 0.5 * np.add(*box_about(scan.points))
    # along the axes, but from the scan's origin: a crop of the scan has the same squares
    points = scan.points @ axes
    _check_spread(points)
    side = _usual_side(points) if spacing is None else _length(spacing, "spacing")
    points = points[_kept(points, side)] - middle @ axes
    report(1, SCAN_SETTINGS.mesh_steps)
    _check_spread(points, spacing)
    corners, beside = _joined(points)
    report(2, SCAN_SETTINGS.mesh_steps)
    return Triangulated(points, corners, Gaps.between(points, corners, beside), middle, axes)


def _joined(points: Array) -> tuple[Indices, Indices]:
    """Return the Delaunay triangles of points across the view, and the neighbours of each."""
    from hand_models.scans.compiled_triangulation import delaunay_triangles

    across = points[:, :2] - points[:, :2].min(axis=0)
    whole = np.rint(across / (across.max() * SCAN_SETTINGS.finest)).astype(np.intp)
    centre = whole.mean(axis=0).astype(np.intp)
    order = np.argsort(((whole - centre) ** 2).sum(axis=1), kind="stable")
    corners, beside = delaunay_triangles(whole[order], centre)
    return order[corners], beside


def _nothing_left(scan: Scan, made: Triangulated, hole: float) -> InvalidInputError:
    """Return an error that names why every triangle bridges more than a hole may be wide."""
    table, apart = scan_table(), _spacing(made.points)
    extent = float(np.ptp(made.points, axis=0).max())
    rise = float(np.median(np.ptp(made.points[made.corners, 2], axis=1)))
    what = "cells" if scan.heights else "points"
    message = f"{what} are {1e3 * apart:.3g} mm apart"
    open_ = f"and holes wider than {1e3 * hole:.3g} mm stay open: no triangle is left"
    if apart <= hole < rise:
        message = f"{message} across the view and {1e3 * rise:.3g} mm along it: no triangle is left"
        if scan.heights:
            cause = "is the cell in degrees, or in another unit than the heights?"
            return InvalidInputError(f"{message}; {cause}", field="cell")
        return InvalidInputError(f"{message}; was the rock seen from another side?", field="view")
    if extent > table.scalar("scan", "largest"):
        return InvalidInputError(f"{message}, {open_}; {too_large(extent)}", field="hole")
    for wider in wider_holes(hole):
        if made.gaps.open_(wider).mean() <= table.scalar("mesh", "left_holes"):
            return InvalidInputError(
                f"{message}, {open_}; --hole {wider:g} bridges them", field="hole"
            )
        covered = made.gaps.covered(wider)
        if covered >= table.scalar("mesh", "least_covered"):
            return InvalidInputError(
                f"{message}, {open_}; --hole {wider:g} bridges {100.0 * covered:.0f} % of the area",
                field="hole",
            )
    return InvalidInputError(
        f"{message}, {open_}; scan the rock with points nearer to each other", field="hole"
    )


def too_large(extent: float) -> str:
    """Return a warning, in words, about rock larger than a hold may be, with its probable cause.

    Parameters
    ----------
    extent : float
        Length of the rock's longest side [m].
    """
    largest = scan_table().scalar("scan", "largest")
    unit = _fitting(extent)
    return (
        f"{extent:.4g} m across, and a hold may be {largest:g} m; is it {unit}to be "
        "scaled (--width), or cut to what hands reach?"
    )


def too_small(extent: float, unit: Unit) -> str:
    """Return a warning about rock smaller than a palm, with its probable cause; else an empty text.

    Parameters
    ----------
    extent : float
        Length of the longest side [m].
    unit : {'m', 'cm', 'mm'}
        Unit in which the file was read.
    """
    if extent >= SCAN_SETTINGS.smallest_rock:
        return ""
    asked = _fitting(extent / UNIT_METRES[unit])
    return f"{extent:.3g} m across, less than a palm is long; is it {asked}to be scaled (--width)?"


def _fitting(number: float) -> str:
    """Return in words in which units a number is the size of rock that may be held, if in any."""
    least, most = SCAN_SETTINGS.smallest_rock, scan_table().scalar("scan", "largest")
    fit = [unit for unit, metres in UNIT_METRES.items() if least <= number * metres <= most]
    return f"in {' or '.join(fit)} (--unit), or " if fit else ""


def wider_holes(hole: float) -> list[float]:
    """Return the hole widths above ``hole`` that are worth a trial, ascending [m].

    Each is a fifth more than the one before, up to ``widest_bridge`` of ``scan.toml``.
    """
    widest = scan_table().scalar("mesh", "widest_bridge")
    found, wider = [], hole
    # by a fifth each, up to the next millimetre
    while (wider := math.ceil(1e3 * 1.2 * wider - 1e-9) / 1e3) < widest:
        found.append(wider)
    return [*found, widest] if hole < widest else []


def _length(value: float, field: str) -> float:
    if not (math.isfinite(value) and value > 0.0):
        raise InvalidInputError(f"must be finite and above zero, got {value:g} m", field=field)
    return value


def _check_strays(points: Array) -> None:
    """Refuse points that are so far from the others that no triangulation resolves both."""
    farthest = scan_table().scalar("scan", "farthest")
    distances = np.abs(points - np.median(points, axis=0)).max(axis=1)
    far = points[distances > farthest]
    strays = len(far)
    places, counts = np.unique(far[:1000], axis=0, return_counts=True)
    if strays and counts.max() > 1:
        place = ", ".join(f"{x:g}" for x in places[counts.argmax()])
        raise InvalidInputError(
            f"{strays} of {len(points)} points are more than {farthest:g} m from the median point, "
            f"several at exactly ({place}) m, as if they stood for points that were not measured: "
            "leave them out of the export, or write nan",
            field="file",
        )
    if strays:
        raise InvalidInputError(
            f"{strays} of {len(points)} points are more than {farthest:g} m from the median point, "
            f"the farthest {distances.max():.3g} m: drop them (--std-ratio), or cut the scan to "
            "the rock",
            field="file",
        )


def _check_spread(points: Array, spacing: float | None = None) -> None:
    """Refuse points that are on a line across the view; ``spacing``: to which they were thinned."""
    across = points[:, :2] - points[:, :2].mean(axis=0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(across.T @ across), 0.0))
    if spread[0] <= math.sqrt(1e-9) * spread[1]:  # width of their length
        if spacing is not None:
            raise InvalidInputError(
                f"must leave points that are not on a line across the view, got {spacing:g} m; "
                "give a smaller one",
                field="spacing",
            )
        sizes = np.linalg.svd(np.cov(points.T), compute_uv=False)
        if sizes[1] <= 1e-9 * sizes[0]:
            raise InvalidInputError(
                "the points lie on one line, not on a surface: export the whole scan",
                field="file",
            )
        raise InvalidInputError(
            "the points lie on one line across the view, not on a surface: give another view",
            field="file",
        )


def _spacing(points: Array) -> float:
    """Return the median distance of a point to the nearest one across the view [m]."""
    # points at one place count once
    across = points[_kept(points, 0.0), :2]
    some = across[:: max(1, len(across) // 20_000)]  # so many or some more are enough
    # few of them are asked for: leaves so large are sooner made
    tree = scipy.spatial.cKDTree(across, 64, compact_nodes=False, balanced_tree=False)
    distance = np.asarray(tree.query(some, k=2)[0])
    return float(np.median(distance[:, 1]))


def _usual_side(points: Array) -> float:
    """Return the side of the squares that keep one point each if no spacing is asked for [m]."""
    table = scan_table()
    few, finest, most = (table.scalar("mesh", key) for key in ("vertices", "spacing", "most"))
    side = 0.5 * _spacing(points)
    while True:
        limit = few if side < finest else most
        count = 1 + np.count_nonzero(np.diff(np.sort(_squares(points, side))))
        if count <= limit:
            return side
        wider = side * max(1.15, math.sqrt(count / limit))
        side = min(wider, finest) if side < finest else wider


def _squares(points: Array, side: float) -> Indices:
    """Return the number of the square across the view in which each point is, shape (n,)."""
    side = max(side, SCAN_SETTINGS.finest * max(np.ptp(points[:, 0]), np.ptp(points[:, 1])))
    # a quarter of a side from the origin, rows of a grid are rarely on the squares' sides
    x, y = (np.floor(points[:, k] / side + 0.25).astype(np.intp) for k in range(2))
    return np.asarray((x - x.min()) * (np.ptp(y) + 1) + y - y.min())


def _kept(points: Array, side: float) -> Indices:
    """Return the point of median depth of each square that has any, square by square."""
    from hand_models.scans.compiled_triangulation import median_points

    square = _squares(points, side)
    # tilted by so little that only of points at one depth another comes first, whatever their order
    depths = points @ np.array([1e-6, 1.7e-6, 1.0])
    return median_points(depths, square, np.argsort(square))
