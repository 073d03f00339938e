"""Shapes of holds: a wall, a log, an edge, a ball, a boulder, and the base class of all holds.

A hold has its own frame: origin on the rock at the crest (the point nearest the palm), z into the
rock, y along the axis of a cylinder or an edge. The rock in a finger's plane is a `Section`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, Pose, check_positive
from hand_models.parameters import scan_table
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

__all__ = ["Cylinder", "Edge", "Ellipsoid", "Hold", "Plane", "Section", "Sphere"]

Angle = TypeVar("Angle", float, Array)

CURVE_PIECES: Final = 28
"""Pieces of a curve in a hold's surface."""


class Hold(ABC):
    """A piece of rock that a hand may grip: base class of the shapes, of meshes and of profiles."""

    shape: str

    scanned = False
    """True if the hold consists of measured data, False if a few numbers describe its shape."""

    nbytes = 0
    """Memory that the hold's data takes [bytes]; 0 for a shape of a few numbers."""

    @property
    def border(self) -> Array:
        """Edges where the known rock ends, as pairs of end points, in the hold's frame [m].

        Returns
        -------
        ndarray, shape (n, 2, 3)
            Empty, (0, 2, 3), for a shape without border.
        """
        return np.zeros((0, 2, 3))

    @property
    def oddities(self) -> tuple[str, ...]:
        """Warnings about the hold's data, which is used nevertheless; each begins with a field."""
        return ()

    @property
    def swept(self) -> Swept | None:
        """A smooth hold as numbers: a ball swept along two faces; None for other holds."""
        return None

    @abstractmethod
    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        """Cut the hold with a finger's plane and return the rock in the plane.

        Parameters
        ----------
        origin : array_like, shape (3,)
            Origin of the plane's coordinates (s, t), in the hold's frame [m].
        s_axis, t_axis : array_like, shape (3,)
            Orthonormal axes of the plane, in the hold's frame; t into the rock.

        Returns
        -------
        Section or None
            None where the plane misses the rock.
        """

    def raw_section(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike
    ) -> Section | None:
        """Cut the hold as `section` does, but keep steps and edges smaller than a finger's tile.

        Arguments are those of `section`.

        Returns
        -------
        Section or None
            None where the plane misses the rock. For a smooth shape the same as `section`.
        """
        return self.section(origin, s_axis, t_axis)

    def finger_rock(
        self,
        origin: ArrayLike,
        s_axis: ArrayLike,
        t_axis: ArrayLike,
        size: FingerSize,
        *,
        tiles_only: bool = False,
    ) -> FingerRock:
        """Return the rock that a finger meets with its width, in its plane; in this class alike.

        Parameters
        ----------
        origin, s_axis, t_axis
            The finger's plane, as of `section`.
        size : FingerSize
            Widths of the finger.
        tiles_only : bool, optional
            True to leave out the rock beside the tiles, and the strips across them.
        """
        return FingerRock(self.section(origin, s_axis, t_axis))

    @abstractmethod
    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        """Cast a ray: return the distance from a point, along a direction, at which rock begins.

        Parameters
        ----------
        point, direction : array_like, shape (3,)
            In the hold's frame [m]; the direction has length one.

        Returns
        -------
        float
            Negative where the point is inside the rock; infinite where the ray's line misses the
            rock [m].
        """

    def entries(self, points: ArrayLike, direction: ArrayLike) -> list[float]:
        """Return the distance of `entry` for each of n points, shape (n, 3), as a list [m]."""
        return [self.entry(point, direction) for point in np.asarray(points, dtype=float)]

    def surface(self, low: Array, high: Array) -> Triangles:
        """Return the rock's surface as triangles in the hold's frame, at least within a region.

        Pictures show this surface, and limbs are kept clear of it. In this base class the surface
        is where a grid of 41 × 41 rays along z enters the rock, without overhangs.

        Parameters
        ----------
        low, high : ndarray, shape (3,)
            Opposite corners of the region [m].

        Returns
        -------
        Triangles
            Counterclockwise from outside; none where there is no rock.
        """
        x, y = np.meshgrid(*np.linspace(low[:2], high[:2], 41).T)
        begins = [(*place, low[2]) for place in zip(x.flat, y.flat, strict=True)]
        z = low[2] + np.array([self.entry(place, (0.0, 0.0, 1.0)) for place in begins])
        found = grid(np.stack([x, y, z.reshape(x.shape)], axis=2))
        whole = np.isfinite(z[found.faces]).all(axis=1)
        return Triangles(
            np.where(np.isfinite(found.vertices), found.vertices, 0.0), found.faces[whole]
        )

    def check_place(self, at: Pose | None = None) -> None:
        """Check that rock lies at the origin of the frame in which a palm is to be placed.

        Nothing is checked where no frame is given.

        Parameters
        ----------
        at : Pose, optional
            The palm's frame in the hold's frame, z into the rock.

        Raises
        ------
        InvalidInputError
            If no rock begins near the frame's origin along its z axis; the field is
            ``place.point``.
        """
        if at is None:
            return
        near = scan_table().scalar("scan", "place")
        depth = self.entry(at.position, at.rotation[:, 2])
        if not abs(depth) <= near:
            rock = f"the rock begins {depth:.3g} m" if math.isfinite(depth) else "there is no rock"
            raise InvalidInputError(
                f"{rock} from this point along the approach; at most {near:g} m is possible: is "
                "the point in the frame that is named, and the approach into the rock?",
                field="place.point",
            )

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        """Return the circle that the rock's outline has at its crest in the plane y = ``offset``.

        Returns
        -------
        tuple of (float, float) or None
            Depth of the centre and radius [m]; None if the outline is not round there.
        """
        return None

    def tangent_point(self, offset: float, angle: Angle) -> tuple[Angle, Angle] | None:
        """Return the point of the outline in the plane y = ``offset`` where it has a given slope.

        None from other holds than an ellipsoid, and where the plane misses it. ``angle``: of the
        tangent from x toward z [rad], one or an array; the result is x and z of that shape [m].
        """
        return None


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
        if alike_across(self.swept, np.cross(plane[2], plane[1])):
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
