"""A scan: points in metres with z up, from where they were seen, and the frame of its rock."""

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
    "in_scan",
    "start_on",
]

Unit = Literal["m", "cm", "mm"]
Up = Literal["x", "y", "z", "-x", "-y", "-z"]

UNIT_METRES: Final[Mapping[Unit, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres in a unit."""

UP_ROTATIONS: Final[Mapping[Up, Array]] = {
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-z": np.diag([1.0, -1.0, -1.0]),
}
"""Rotation that turns the axis of a file that points up to z, by that axis."""


@dataclass(frozen=True, slots=True)
class ScanSettings:
    """Numbers that several functions of the scans have in common."""

    mesh_steps: int = 3
    """Steps that are reported: thinned, triangulated, parted from holes."""
    smallest_rock: float = 0.1
    """Size of the smallest rock that is scanned to be held, about a palm's length [m]."""


SCAN_SETTINGS: Final = ScanSettings()

AXIS_NAMES: Final = ("x", "y", "z")


def areas_of(points: Array, faces: Indices) -> Array:
    """Return the areas of triangles along their outward normals, shape (m, 3) [m²]."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    return np.asarray(0.5 * np.cross(b - a, c - a))


class RawScan(NamedTuple):
    """Content of a scan file.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        In the file's axes and unit; not finite where nothing was measured.
    scanner : Pose or None
        Where the scanner was, if the file says; if it was turned, the points are in its frame.
    heights : bool
        Whether z is a height over a grid, seen from above.
    faces : ndarray of int, shape (m, 3), or None
        Triangles of the points, if the file has any.
    """

    points: Array
    scanner: Pose | None = None
    heights: bool = False
    faces: Indices | None = None


@dataclass(frozen=True, eq=False)
class Scan:
    """Points of rock as they were seen.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Finite, z up [m].
    read : int
        Points of the file, those that are left out, too.
    view : ndarray, shape (3,), or None
        In which direction it was looked at, of length one; None if that follows from the points.
    viewpoint : ndarray, shape (3,)
        Where the scanner was [m].
    origin : ndarray, shape (3,), or None
        Where the rock's frame is to begin; None for the middle [m].
    assumed : bool
        Whether the viewpoint is the file's origin because nothing says where the scanner was.
    heights : bool
        Whether the points are a grid of heights.
    faces : ndarray of int, shape (m, 3), or None
        Triangles of the points, counterclockwise seen from outside, if the file has any.
    outliers : int
        Points that were left out because they stand alone (`drop_outliers`).
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
        """Points of the file that are not finite."""
        return self.read - len(self.points) - self.outliers

    def direction(self) -> Array:
        """Return in which direction the rock was looked at, shape (3,), of length one.

        That is `view`; else that against which its triangles face, or downward if these close; else
        the direction in which the points vary least, away from the viewpoint, or downward where the
        viewpoint is among the points and the rock is ground.

        Raises
        ------
        InvalidInputError
            If it is unknown from which side, or the viewpoint is assumed and so far away that
            no scanner can have been there; the field is ``view``.
        """
        if self.view is not None:
            return self.view
        if self.faces is not None:
            shown = self.shown()
            return np.array([0.0, 0.0, -1.0]) if shown is None else -shown
        middle = self.points.mean(axis=0)
        if self.assumed:
            self._check_origin(middle)
        normal = np.asarray(np.linalg.eigh(np.cov((self.points - middle).T))[1][:, 0])
        depth = (self.points - self.viewpoint) @ normal
        if depth.min() > 0.0:
            return normal
        if depth.max() < 0.0:
            return -normal
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
        """Return toward which side triangles face together, of length one, None if they close."""
        assert self.faces is not None
        areas = areas_of(self.points, self.faces)
        total = areas.sum(axis=0)
        length = float(np.linalg.norm(total))
        # a surface that shows less than 5 % of its area to any side is taken to be closed
        if length <= 0.05 * float(np.linalg.norm(areas, axis=1).sum()):
            return None
        return np.asarray(total / length)

    def _check_origin(self, middle: Array) -> None:
        """Refuse the file's origin as the scanner's place if no scanner can have been there."""
        size = float(np.ptp(self.points, axis=0).max())
        away = float(np.linalg.norm(middle - self.viewpoint))
        if away > scan_table().scalar("scan", "farthest_scanner") * size:
            raise InvalidInputError(
                "the scanner's position is unknown: the file does not give it, and its origin is "
                f"{away:,.0f} m from rock of {size:.3g} m (map coordinates?): give --view X,Y,Z, "
                "the direction in which the scanner looked, or --viewpoint",
                field="view",
            )


def axes_along(view: Array) -> Array:
    """Return the axes of scanned rock as columns: z along the view, x up as far as it can be.

    Where the view is up or down, x is along y.
    """
    for upward in (np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])):
        x = upward - (upward @ view) * view
        length = np.linalg.norm(x)
        if length > 0.1:  # enough of the axis is across the view to point up in a picture
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
