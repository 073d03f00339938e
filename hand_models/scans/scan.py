"""A scan: points in metres with z up, and from where they were seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError

__all__ = ["UNITS", "UPS", "RawScan", "Scan", "Unit", "Up"]

Unit = Literal["m", "cm", "mm"]
Up = Literal["x", "y", "z", "-x", "-y", "-z"]

UNITS: Final[Mapping[Unit, float]] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres in a unit."""

UPS: Final[Mapping[Up, Array]] = {
    "x": np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
    "-x": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "-y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "-z": np.diag([1.0, -1.0, -1.0]),
}
"""By the axis of a file that points up, the rotation that turns it to z."""

UPRIGHT: Final = 0.7
"""Least |z| of a normal of rock that is taken to be ground, seen from above."""


class RawScan(NamedTuple):
    """What a file has.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        In the file's axes and unit; not finite where nothing was measured.
    viewpoint : ndarray, shape (3,), or None
        Where the scanner was, if the file tells.
    heights : bool
        Whether z is a height over a grid, seen from above.
    """

    points: Array
    viewpoint: Array | None = None
    heights: bool = False


@dataclass(frozen=True, eq=False)
class Scan:
    """Points of rock as they were seen.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Finite, z up [m].
    read : int
        Points of the file, those that are not finite, too.
    view : ndarray, shape (3,), or None
        In which direction it was looked at, of length one; None if that follows from the points.
    viewpoint : ndarray, shape (3,)
        Where the scanner was, the file's origin by default [m].
    origin : ndarray, shape (3,), or None
        Where the rock's frame is to begin; None for the middle [m].
    """

    points: Array
    read: int
    view: Array | None
    viewpoint: Array
    origin: Array | None

    @property
    def dropped(self) -> int:
        """Points of the file that are not finite."""
        return self.read - len(self.points)

    def direction(self) -> Array:
        """Return in which direction the rock was looked at, shape (3,), of length one.

        That is `view`; else the direction in which the points vary least, away from the viewpoint,
        or downward where the viewpoint is among the points and the rock is ground.

        Raises
        ------
        InvalidInputError
            If it cannot be told from which side; the field is ``view``.
        """
        if self.view is not None:
            return self.view
        middle = self.points.mean(axis=0)
        normal = np.asarray(np.linalg.eigh(np.cov((self.points - middle).T))[1][:, 0])
        depth = (self.points - self.viewpoint) @ normal
        if depth.min() > 0.0:
            return normal
        if depth.max() < 0.0:
            return -normal
        if abs(normal[2]) >= UPRIGHT:
            return np.asarray(-normal * np.sign(normal[2]))
        raise InvalidInputError(
            "from which side the rock was seen does not follow from the points, as the viewpoint "
            "(the file's origin by default) is among them; give a direction or a viewpoint",
            field="view",
        )
