"""A scan: points in metres with z up, the place from which they were seen, and the rock's frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, Pose
from hand_models.parameters import scan_table
from hand_models.rock import FilledCells

__all__ = [
    "AXIS_NAMES",
    "SCAN_SETTINGS",
    "UNIT_METRES",
    "UP_ROTATIONS",
    "RawScan",
    "Scan",
    "Unit",
    "Up",
    "areas_of",
    "axes_along",
    "box_about",
    "in_scan",
    "start_on",
]

Unit = Literal["m", "cm", "mm"]
Up = Literal["x", "y", "z", "-x", "-y", "-z"]

UNIT_METRES: Final[Mapping[Unit, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Length of each unit [m]."""

UP_ROTATIONS: Final[Mapping[Up, Array]] = {
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-z": np.diag([1.0, -1.0, -1.0]),
}
"""Rotation matrix (3, 3) that turns a file's axes so that z is up, by the axis that points up."""


@dataclass(frozen=True, slots=True)
class ScanSettings:
    """Settings that functions for scans share: steps of progress, size of the smallest rock."""

    mesh_steps: int = 3
    """Steps of meshing that are reported to a progress callback: thin, triangulate, find holes."""
    smallest_rock: float = 0.1
    """Size of the smallest rock that a hand is to grip, about a palm's length [m]."""
    finest: float = 2.0**-30
    """Part of the points' extent below which differences across the view are not seen."""


SCAN_SETTINGS: Final = ScanSettings()

AXIS_NAMES: Final = ("x", "y", "z")


def areas_of(points: Array, faces: Indices) -> Array:
    """Return the area vectors of triangles: outward normals as long as the triangle's area.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Corners of the triangles [m].
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's corners, counterclockwise seen from outside.

    Returns
    -------
    ndarray, shape (m, 3)
        Area vectors [m²].
    """
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.asarray(0.5 * np.cross(b - a, c - a))


def box_about(points: Array) -> tuple[Array, Array]:
    """Return the least and the largest coordinates of points (n, 3), shape (3,) each [m].

    Column by column: a sixth of the time of ``points.min(axis=0)``, which goes by rows of three.
    """
    low, high = np.array([(column.min(), column.max()) for column in points.T]).T
    return low, high


class RawScan(NamedTuple):
    """Content of a scan file.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Points in the file's axes and unit; not finite where nothing was measured.
    scanner : Pose or None
        Pose of the scanner, if the file has one; if the pose is turned, the points are in the
        scanner's frame.
    heights : bool
        True if z is a height over a grid, seen from above.
    faces : ndarray of int, shape (m, 3), or None
        Triangles of the points, if the file has any.
    """

    points: Array
    scanner: Pose | None = None
    heights: bool = False
    faces: Indices | None = None


@dataclass(frozen=True, eq=False)
class Scan:
    """Points of rock as a scanner saw them.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        The finite points, z up [m].
    read : int
        Number of points in the file, including those that were left out.
    view : ndarray, shape (3,), or None
        Unit vector in which the scanner looked; None to find the direction from the points.
    viewpoint : ndarray, shape (3,)
        Position of the scanner [m].
    origin : ndarray, shape (3,), or None
        Wanted origin of the rock's frame; None for the middle of the points [m].
    assumed : bool
        True if the viewpoint is the file's origin because the scanner's position is unknown.
    heights : bool
        True if the points are a grid of heights.
    faces : ndarray of int, shape (m, 3), or None
        Triangles of the points, counterclockwise seen from outside, if the file has any.
    outliers : int
        Number of points that were left out because they stand alone (`drop_outliers`).
    """

    points: Array
    read: int
    view: Array | None
    viewpoint: Array
    origin: Array | None
    assumed: bool = False
    heights: bool = False
    faces: Indices | None = None
    outliers: int = 0

    @property
    def dropped(self) -> int:
        """Number of points in the file that were left out because they are not finite."""
        return self.read - len(self.points) - self.outliers

    def direction(self) -> Array:
        """Return the unit vector in which the scanner looked at the rock, shape (3,).

        The vector is `view` if given. With triangles it is opposite to the side that they face
        together, or downward if they form a closed surface. Else it is the direction in which the
        points vary least, away from the viewpoint, or downward where the viewpoint is among the
        points and the rock is ground.

        Raises
        ------
        InvalidInputError
            If the side is ambiguous, or the viewpoint is assumed and too far away, too near or too
            far to the side for a scanner; the field is ``view``.
        """
        if self.view is not None:
            return self.view
        if self.faces is not None:
            shown = self.shown()
            return np.array([0.0, 0.0, -1.0]) if shown is None else -shown
        bulk = self._bulk()
        middle = bulk.mean(axis=0)
        low, high = box_about(bulk)
        size = float((high - low).max())
        if self.assumed:
            self._check_origin(middle, size)
        normal = np.asarray(np.linalg.eigh(np.cov((bulk - middle).T))[1][:, 0])
        depth = (bulk - self.viewpoint) @ normal
        if depth.min() > 0.0 or depth.max() < 0.0:
            side = np.sign(depth.mean())
            if self.assumed:
                self._check_place(middle, size, side * normal)
            return np.asarray(side * normal)
        # rock whose normal is that steep is taken to be ground, seen from above
        if abs(normal[2]) >= 0.7:
            return np.asarray(-normal * np.sign(normal[2]))
        whose = "the file's origin, as it names none" if self.assumed else "the scanner's place"
        raise InvalidInputError(
            f"the viewing direction is ambiguous: the viewpoint ({whose}) is among the points; "
            "give --view or --viewpoint",
            field="view",
        )

    def shown(self) -> Array | None:
        """Return the unit vector toward the side that most of the triangles' area faces.

        Returns
        -------
        ndarray, shape (3,), or None
            None if the triangles form a closed surface.
        """
        assert self.faces is not None
        areas = areas_of(self.points, self.faces)
        total = areas.sum(axis=0)
        length = float(np.linalg.norm(total))
        # a surface that shows less than 5 % of its area to any side is taken to be closed
        if length <= 0.05 * float(np.linalg.norm(areas, axis=1).sum()):
            return None
        return np.asarray(total / length)

    def _bulk(self) -> Array:
        """Return the points without the few that are far off: one would turn the view."""
        low, high = np.percentile(self.points, (1.0, 99.0), axis=0)
        # twice as far from the middle as 98 in a hundred points are
        near = np.abs(self.points - 0.5 * (low + high)).max(axis=1) <= float((high - low).max())
        return self.points if near.all() else self.points[near]

    def _check_origin(self, middle: Array, size: float) -> None:
        """Refuse the file's origin as the scanner's place if no scanner can have been there."""
        away = float(np.linalg.norm(middle - self.viewpoint))
        if away > scan_table().scalar("scan", "farthest_scanner") * size:
            raise InvalidInputError(
                "the scanner's position is unknown: the file has none, and the file's origin is "
                f"{away:,.0f} m from rock of {size:.3g} m (map coordinates?): give --view X,Y,Z, "
                "the direction in which the scanner looked, or --viewpoint",
                field="view",
            )

    def _check_place(self, middle: Array, size: float, view: Array) -> None:
        """Refuse the file's origin as the scanner's place if it looks like one of rock's own."""
        middle = middle - self.viewpoint
        depth, away = float(middle @ view), float(np.linalg.norm(middle))
        table = scan_table()
        nearest = table.scalar("scan", "nearest_scanner")
        # smaller rock is in another unit, which is warned of
        small = size < SCAN_SETTINGS.smallest_rock
        least = 0.0 if small else table.scalar("scan", "closest")
        # rock that is met from above is ground, on whichever of its sides the axes begin
        if view[2] <= -0.7 or depth >= max(nearest * max(size, away), least):
            return
        raise InvalidInputError(
            "the scanner's position is unknown: the file has none, and the file's origin is "
            f"{depth:.2g} m before or behind rock of {size:.3g} m"
            + (f", and {away:.3g} m from its middle" if away > 2.0 * depth else "")
            + " (was an offset subtracted?): give --view X,Y,Z, the direction in which the "
            "scanner looked, or --viewpoint",
            field="view",
        )


def axes_along(view: Array) -> Array:
    """Return the axes of a frame for scanned rock: z along the view, x as upward as can be.

    Where the view is up or down, x is as nearly along y as can be.

    Parameters
    ----------
    view : ndarray, shape (3,)
        Unit vector in which the scanner looked, z up.

    Returns
    -------
    ndarray, shape (3, 3)
        Unit vectors x, y and z as columns, in the scan's axes.
    """
    for upward in (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])):
        x = upward - (upward @ view) * view
        length = np.linalg.norm(x)
        if length > 0.1:  # enough of the axis is across the view to point up in a picture
            break
    x = x / length
    return np.column_stack([x, np.cross(view, x), view])


def in_scan(cells: FilledCells, middle: Array, axes: Array) -> FilledCells:
    """Convert filled cells from the rock's axes to the scan's axes.

    Parameters
    ----------
    cells : FilledCells
        Filled cells, in coordinates from ``middle`` along ``axes``.
    middle : ndarray, shape (3,)
        Origin of these coordinates, in the scan's axes [m].
    axes : ndarray, shape (3, 3)
        Columns: axes of these coordinates, in the scan's axes.

    Returns
    -------
    FilledCells
        Its axis is the scan's axis nearest to that of ``cells``.
    """
    axis = int(np.abs(axes[:, cells.axis]).argmax())
    value = float(middle[axis] + axes[axis, cells.axis] * cells.value)
    return FilledCells(axis, value, cells.cells)


def start_on(points: Array, scan: Scan, middle: Array, axes: Array) -> Array:
    """Return the origin of the rock's frame: the point nearest, across the view, to a target.

    The target is the scan's wanted origin, or the middle of the points.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Coordinates from ``middle`` along ``axes`` [m].
    scan : Scan
    middle : ndarray, shape (3,)
        Origin of the points' coordinates, in the scan's axes [m].
    axes : ndarray, shape (3, 3)
        Columns: axes of the points' coordinates, in the scan's axes; z along the view.

    Returns
    -------
    ndarray, shape (3,)
        One of ``points`` [m].

    Raises
    ------
    InvalidInputError
        If no point is near the wanted origin; the field is ``origin``.
    """
    wanted = None if scan.origin is None else (scan.origin - middle) @ axes
    target = 0.5 * np.add(*box_about(points)) if wanted is None else wanted
    distance = np.hypot(*(points[:, :2] - target[:2]).T)
    nearest = int(distance.argmin())
    near = scan_table().scalar("scan", "near")
    if wanted is not None and distance[nearest] > near:
        raise InvalidInputError(
            f"the nearest rock is {distance[nearest]:.3g} m away, across the view; at most "
            f"{near:g} m is possible: give a point on the rock, in the file's axes and unit",
            field="origin",
        )
    return np.asarray(points[nearest])
