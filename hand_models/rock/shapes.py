"""Shapes of holds that a few numbers describe: a wall, a log, an edge, a ball and a boulder."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, check_positive
from hand_models.rock.holds import Hold
from hand_models.rock.surface import Triangles, drawn_out, grid
from hand_models.sections import (
    SECTION_SETTINGS,
    FingerRock,
    FingerSize,
    Section,
    Swept,
    alike_across,
    cut_of,
    entry_distances,
    rock_across,
)

__all__ = ["Cylinder", "Edge", "Ellipsoid", "Plane", "Sphere", "SweptHold"]

Angle = TypeVar("Angle", float, Array)

CURVE_PIECES: Final = 28
"""Pieces of a curve in a hold's surface."""


class SweptHold(Hold):
    """A smooth hold: base class of shapes described as a ball that is swept along two faces."""

    @property
    @abstractmethod
    def swept(self) -> Swept: ...

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        plane = (
            *self._scaled(s_axis),
            *self._scaled(t_axis),
            *self._scaled(origin, self.swept.depth),
        )
        return cut_of(self.swept, plane)

    def finger_rock(
        self,
        origin: ArrayLike,
        s_axis: ArrayLike,
        t_axis: ArrayLike,
        size: FingerSize,
        *,
        tiles_only: bool = False,
    ) -> FingerRock:
        """Return the rock that a finger meets with its width: all beside its plane that it reaches.

        Arguments are those of `Hold.finger_rock`.
        """
        plane = np.array([origin, s_axis, t_axis], dtype=float)
        if alike_across(np.array(self.swept[:3]), np.cross(plane[2], plane[1])):
            return FingerRock(self.section(origin, s_axis, t_axis))
        return rock_across(self.swept, plane, size, tiles_only=tiles_only)

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        place = self._scaled(point, self.swept.depth)
        return float(entry_distances(self.swept, place, self._scaled(direction)))

    def surface(self, low: Array, high: Array) -> Triangles:
        middle, reach = 0.5 * (low + high), 0.5 * float((high - low).max())
        if self.swept.scale_y:
            return self._cap(middle, reach)
        return drawn_out(self._outline(middle, reach), float(low[1]), float(high[1]))

    def _outline(self, middle: Array, reach: float) -> Array:
        """Return the outline (x, z) of a hold without end along y, about a place."""
        shape = self.swept
        stretch = np.array([shape.scale_x or 1.0, shape.scale_z])
        # points of the circle are at angles from the crest; flat faces begin where it ends
        end = math.pi / 2.0 - math.atan2(shape.sine, shape.cosine) if shape.sine else math.inf
        aside, below = stretch * (middle[[0, 2]] - (0.0, shape.depth))
        over = min(max(math.atan2(aside, -below), -end), end)
        size = shape.radius / float(stretch.max())
        half = min(math.pi, reach / size) if size else 0.0
        count = CURVE_PIECES + 1 if size else 1
        t = np.linspace(max(over - half, -end), min(over + half, end), count)
        circle = shape.radius * np.column_stack([np.sin(t), -np.cos(t)])
        arc: Array = circle / stretch + (0.0, shape.depth)
        if not shape.sine:
            return arc
        far = float(np.abs(middle).max()) + 2.0 * reach
        sides = far * np.array([[-shape.sine, shape.cosine], [shape.sine, shape.cosine]])
        return np.vstack([arc[0] + sides[0], arc, arc[-1] + sides[1]])

    def _cap(self, middle: Array, reach: float) -> Triangles:
        """Return a ball's surface, or a boulder's, about the place nearest to another."""
        shape = self.swept
        semi_axes = shape.radius / np.array([shape.scale_x, shape.scale_y, shape.scale_z])
        centre = np.array([0.0, 0.0, shape.depth])
        pole = (middle - centre) / semi_axes
        length = float(np.linalg.norm(pole))
        pole = pole / length if length > 0.0 else np.array([0.0, 0.0, -1.0])
        aside = np.linalg.svd(pole[None])[2][1]
        across = np.array([aside, np.cross(pole, aside)])
        t = np.linspace(0.0, min(math.pi, reach / float(semi_axes.min())), CURVE_PIECES + 1)
        turn = np.linspace(0.0, 2.0 * math.pi, CURVE_PIECES + 1)
        around = np.column_stack([np.cos(turn), np.sin(turn)]) @ across
        unit = np.cos(t)[:, None, None] * pole + np.sin(t)[:, None, None] * around
        return grid(centre + unit * semi_axes)

    def _scaled(self, vector: ArrayLike, depth: float = 0.0) -> tuple[float, float, float]:
        """Return a direction, or a place from the centre of the ball, scaled."""
        x, y, z = np.asarray(vector, dtype=float).tolist()
        shape = self.swept
        return shape.scale_x * x, shape.scale_y * y, shape.scale_z * (z - depth)


@dataclass(frozen=True)
class Plane(SweptHold):
    """A flat wall: the rock is z ≥ 0."""

    shape = "plane"

    @property
    def swept(self) -> Swept:
        return Swept(0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, SECTION_SETTINGS.parallel_sine)


@dataclass(frozen=True)
class Cylinder(SweptHold):
    """A round log of rock along y.

    Attributes
    ----------
    diameter : float
        Diameter of the log, above 0 [m].
    """

    diameter: float
    shape = "cylinder"

    def __post_init__(self) -> None:
        _check_size(self.diameter, "diameter")

    @property
    def largest_sizes(self) -> Mapping[str, float]:
        return {"diameter": self.diameter}

    @property
    def swept(self) -> Swept:
        radius = self.diameter / 2.0
        return Swept(1.0, 0.0, 1.0, radius, radius)

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        return self.diameter / 2.0, self.diameter / 2.0


@dataclass(frozen=True)
class Edge(SweptHold):
    """Two flat faces that meet in a fillet, symmetric about z and endless along y.

    Attributes
    ----------
    fillet_radius : float
        Radius of the rounded edge between the faces, above 0 [m].
    angle : float
        Angle of the rock between the faces, in (0, π): π/2 for a square edge [rad].
    """

    fillet_radius: float
    angle: float
    shape = "edge"

    def __post_init__(self) -> None:
        _check_size(self.fillet_radius, "fillet_radius")
        if not 0.0 < self.angle < math.pi:
            raise InvalidInputError(f"must be in (0, pi) rad, got {self.angle:g}", field="angle")

    @property
    def largest_sizes(self) -> Mapping[str, float]:
        return {"fillet_radius": self.fillet_radius}

    @property
    def swept(self) -> Swept:
        radius, half = self.fillet_radius, self.angle / 2.0
        return Swept(1.0, 0.0, 1.0, radius, radius, math.sin(half), math.cos(half))

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        return self.fillet_radius, self.fillet_radius


@dataclass(frozen=True)
class Sphere(SweptHold):
    """A ball of rock.

    Attributes
    ----------
    diameter : float
        Diameter of the ball, above 0 [m].
    """

    diameter: float
    shape = "sphere"

    def __post_init__(self) -> None:
        _check_size(self.diameter, "diameter")

    @property
    def largest_sizes(self) -> Mapping[str, float]:
        return {"diameter": self.diameter}

    @property
    def swept(self) -> Swept:
        radius = self.diameter / 2.0
        return Swept(1.0, 1.0, 1.0, radius, radius)

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        radius = self.diameter / 2.0
        return (radius, math.sqrt(radius**2 - offset**2)) if abs(offset) < radius else None


@dataclass(frozen=True)
class Ellipsoid(SweptHold):
    """A rounded boulder: an ellipsoid.

    Attributes
    ----------
    semi_axes : tuple of float
        Semi-axes along x, y and z of the hold's frame, each above 0; the crest is an end of the
        third [m].
    """

    semi_axes: tuple[float, float, float]
    shape = "ellipsoid"

    def __post_init__(self) -> None:
        if len(self.semi_axes) != 3:
            raise InvalidInputError(
                f"three numbers are needed, got {len(self.semi_axes)}", field="semi_axes"
            )
        for i, value in enumerate(self.semi_axes):
            _check_size(value, f"semi_axes[{i}]")

    @property
    def largest_sizes(self) -> Mapping[str, float]:
        return {"semi_axes": max(self.semi_axes)}

    @property
    def swept(self) -> Swept:
        a, b, c = self.semi_axes
        return Swept(1.0 / a, 1.0 / b, 1.0 / c, c, 1.0)

    def tangent_point(self, offset: float, angle: Angle) -> tuple[Angle, Angle] | None:
        a, b, c = self.semi_axes
        if abs(offset) >= b:
            return None
        shrink = math.sqrt(1.0 - (offset / b) ** 2)
        x, z = a * shrink * np.sin(angle), -c * shrink * np.cos(angle)
        length = np.hypot(x, z)
        return a * shrink * x / length, c + c * shrink * z / length


def _check_size(value: float, field: str) -> None:
    """Refuse a size [m] that is not positive, or above which a hold's curve is lost in rounding."""
    check_positive(value, "m", field, 1e6)
