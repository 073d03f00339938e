"""Hold geometry: pieces of rock that a hand may take.

A hold has its own frame: origin on the rock at the crest (the point nearest the palm), z into the
rock, y along the axis of a cylinder or an edge. A finger plane cuts it in a section.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, Pose
from hand_models.parameters import scan_table
from hand_models.sections import (
    PARALLEL,
    FlatSection,
    ProfileSection,
    RoundSection,
    Section,
    Swept,
    Vector2,
)

__all__ = ["Cylinder", "Edge", "Ellipsoid", "Hold", "Plane", "Section", "Sphere"]

Angle = TypeVar("Angle", float, Array)

LARGEST: Final = 1e6
"""Size of a hold above which its curve is lost in rounding [m]."""


class Hold(ABC):
    """A piece of rock that a hand may take."""

    shape: str

    scanned = False
    """Whether it is known by much data, rather than by a few numbers."""

    nbytes = 0
    """Of that data, if it may be large."""

    @property
    def border(self) -> Array:
        """Edges where what is known of the rock ends, shape (n, 2, 3), in the hold's frame [m]."""
        return np.zeros((0, 2, 3))

    @property
    def oddities(self) -> tuple[str, ...]:
        """What is odd about that data, which is used all the same; each begins with its field."""
        return ()

    @property
    def swept(self) -> Swept | None:
        """The hold as a ball that is swept along faces, if it is one."""
        return None

    @abstractmethod
    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        """Return the rock in a plane, or None where the plane misses it.

        Parameters
        ----------
        origin : array_like, shape (3,)
            Of the plane's coordinates, in the hold's frame [m].
        s_axis, t_axis : array_like, shape (3,)
            Orthonormal axes of the plane, in the hold's frame.
        """

    def raw_section(
        self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike
    ) -> Section | None:
        """Return the same with the steps and edges that are smaller than a finger's tile."""
        return self.section(origin, s_axis, t_axis)

    @abstractmethod
    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        """Return how far from a point, along a unit direction, the rock begins [m].

        Negative where the point is inside; infinite where the line misses the rock.
        """

    def check_place(self, at: Pose | None = None) -> None:
        """Refuse a frame that a palm is to be at, unless there is rock that faces it.

        Parameters
        ----------
        at : Pose, optional
            In the hold's frame, z into the rock; by default the hold's frame itself.

        Raises
        ------
        InvalidInputError
            If no rock is near its origin, or what is there faces away.
        """
        if at is None:
            return
        near = scan_table().scalar("scan", "place")
        depth = self.entry(at.position, at.rotation[:, 2])
        if not abs(depth) <= near:
            where = f"begins {depth:.3g} m from it" if math.isfinite(depth) else "is not there"
            raise InvalidInputError(
                f"along the approach the rock {where}; at most {near:g} m is possible: is the "
                "point in the frame that is named, and the approach into the rock?",
                field="place.point",
            )

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        """Return depth of the centre [m] and radius [m] of the crest's circle at y = ``offset``.

        None where the plane at that offset meets nothing round.
        """
        return None

    def tangent_point(self, offset: float, angle: Angle) -> tuple[Angle, Angle] | None:
        """Return the point (x, z) at y = ``offset`` where rock runs at an angle from x toward z.

        Or points at angles. Only of a hold that is smooth but not round there; None elsewhere.
        """
        return None


def _positive(value: float, field: str, unit: str = "m") -> None:
    if not 0.0 < value <= LARGEST:
        raise InvalidInputError(
            f"must be above 0 and at most {LARGEST:g} {unit}, got {value:g}", field=field
        )


@dataclass(frozen=True)
class Plane(Hold):
    """A flat wall: the rock is z ≥ 0."""

    shape = "plane"

    @property
    def swept(self) -> Swept:
        return Swept(0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, PARALLEL)

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        s, t = float(np.asarray(s_axis)[2]), float(np.asarray(t_axis)[2])
        norm = math.hypot(s, t)
        if norm < PARALLEL:
            return None
        return FlatSection((s / norm, t / norm), -float(np.asarray(origin)[2]) / norm)

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        slope = float(np.asarray(direction)[2])
        return -float(np.asarray(point)[2]) / slope if slope > PARALLEL else math.inf


class _Extruded(Hold):
    """A profile drawn out along y."""

    @property
    @abstractmethod
    def profile_radius(self) -> float:
        """Radius of the profile's disc [m]."""

    @property
    def half_angle(self) -> float | None:
        """Half the angle of the rock between the flat faces; None without any [rad]."""
        return None

    @property
    def faces(self) -> Array:
        """Directions of the flat faces in the profile, shape (k, 2)."""
        return np.zeros((0, 2))

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        o, s, t = (np.asarray(v, dtype=float) for v in (origin, s_axis, t_axis))
        M = np.array([[s[0], t[0]], [s[2], t[2]]])
        m = np.array([o[0], o[2]])
        determinant = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        if abs(determinant) < PARALLEL:
            return self._along_axis(o, s, t)
        if self.half_angle is None and abs(abs(determinant) - 1.0) < 1e-12:
            centre = M.T @ (np.array([0.0, self.profile_radius]) - m)
            return RoundSection((float(centre[0]), float(centre[1])), self.profile_radius)
        return ProfileSection(M, m, self.profile_radius, self.half_angle)

    def _along_axis(self, o: Array, s: Array, t: Array) -> Section | None:
        """Return the straight rock in a plane that holds the axis of the extrusion."""
        depth = self.entry(o, t)
        if not math.isfinite(depth):
            return None
        along = np.array([s[1], t[1]]) / math.hypot(s[1], t[1])
        normal = np.array([-along[1], along[0]]) * (1.0 if along[0] >= 0.0 else -1.0)
        return FlatSection((float(normal[0]), float(normal[1])), float(normal[1] * depth))

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        p, d = np.asarray(point, dtype=float), np.asarray(direction, dtype=float)
        return _profile_entry(
            (float(p[0]), float(p[2]) - self.profile_radius),
            (float(d[0]), float(d[2])),
            self.profile_radius,
            self.faces,
        )

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        radius = self.profile_radius
        return radius, radius


def _profile_entry(p: Vector2, d: Vector2, radius: float, faces: Array) -> float:
    """Return the first parameter at which p + λ d meets a disc at the origin swept along a cone."""
    candidates: list[float] = []
    a = d[0] ** 2 + d[1] ** 2
    b = p[0] * d[0] + p[1] * d[1]
    discriminant = b**2 - a * (p[0] ** 2 + p[1] ** 2 - radius**2)
    if a > 0.0 and discriminant >= 0.0:
        candidates.append((-b - math.sqrt(discriminant)) / a)
    if len(faces):
        for direction, normal in zip(faces, _outward(faces), strict=True):
            closing = float(normal @ np.asarray(d))
            if closing < 0.0:
                hit = (radius - float(normal @ np.asarray(p))) / closing
                where = np.asarray(p) + hit * np.asarray(d)
                if float(direction @ where) >= 0.0:
                    candidates.append(hit)
    return min(candidates, default=math.inf)


def _outward(faces: Array) -> Array:
    """Return the unit normals, out of the rock, of the two faces of a cone, shape (2, 2)."""
    turned = np.column_stack([faces[:, 1], -faces[:, 0]])
    return np.asarray(np.sign(faces[:, :1]) * turned)


@dataclass(frozen=True)
class Cylinder(_Extruded):
    """A round log of rock along y.

    Attributes
    ----------
    diameter : float
        [m]
    """

    diameter: float
    shape = "cylinder"

    def __post_init__(self) -> None:
        _positive(self.diameter, "diameter")

    @property
    def swept(self) -> Swept:
        radius = self.profile_radius
        return Swept(1.0, 0.0, 1.0, radius, radius)

    @property
    def profile_radius(self) -> float:
        return self.diameter / 2.0


@dataclass(frozen=True)
class Edge(_Extruded):
    """Two flat faces that meet in a fillet, symmetric about z, drawn out along y.

    Attributes
    ----------
    fillet_radius : float
        [m]
    angle : float
        Of the rock between the faces, in (0, π): π/2 for a square edge [rad].
    """

    fillet_radius: float
    angle: float
    shape = "edge"

    def __post_init__(self) -> None:
        _positive(self.fillet_radius, "fillet_radius")
        if not 0.0 < self.angle < math.pi:
            raise InvalidInputError(f"must be in (0, pi) rad, got {self.angle:g}", field="angle")

    @property
    def swept(self) -> Swept:
        radius, half = self.fillet_radius, self.angle / 2.0
        return Swept(1.0, 0.0, 1.0, radius, radius, math.sin(half), math.cos(half))

    @property
    def profile_radius(self) -> float:
        return self.fillet_radius

    @property
    def half_angle(self) -> float:
        return self.angle / 2.0

    @property
    def faces(self) -> Array:
        half = self.half_angle
        return np.array([[math.sin(half), math.cos(half)], [-math.sin(half), math.cos(half)]])


@dataclass(frozen=True)
class Sphere(Hold):
    """A ball of rock.

    Attributes
    ----------
    diameter : float
        [m]
    """

    diameter: float
    shape = "sphere"

    def __post_init__(self) -> None:
        _positive(self.diameter, "diameter")

    @property
    def swept(self) -> Swept:
        radius = self.diameter / 2.0
        return Swept(1.0, 1.0, 1.0, radius, radius)

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        o, s, t = (np.asarray(v, dtype=float) for v in (origin, s_axis, t_axis))
        radius = self.diameter / 2.0
        toward = np.array([0.0, 0.0, radius]) - o
        centre = (float(s @ toward), float(t @ toward))
        cut = radius**2 - (float(toward @ toward) - centre[0] ** 2 - centre[1] ** 2)
        return RoundSection(centre, math.sqrt(cut)) if cut > 0.0 else None

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        p, d = np.asarray(point, dtype=float), np.asarray(direction, dtype=float)
        radius = self.diameter / 2.0
        q = p - np.array([0.0, 0.0, radius])
        b = float(q @ d)
        discriminant = b**2 - (float(q @ q) - radius**2)
        return -b - math.sqrt(discriminant) if discriminant >= 0.0 else math.inf

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        radius = self.diameter / 2.0
        return (radius, math.sqrt(radius**2 - offset**2)) if abs(offset) < radius else None


@dataclass(frozen=True)
class Ellipsoid(Hold):
    """A rounded boulder.

    Attributes
    ----------
    semi_axes : tuple of float
        Along x, y and z of the hold's frame; the crest is an end of the last [m].
    """

    semi_axes: tuple[float, float, float]
    shape = "ellipsoid"

    def __post_init__(self) -> None:
        if len(self.semi_axes) != 3:
            raise InvalidInputError(
                f"three numbers are needed, got {len(self.semi_axes)}", field="semi_axes"
            )
        for i, value in enumerate(self.semi_axes):
            _positive(value, f"semi_axes[{i}]")

    @property
    def swept(self) -> Swept:
        a, b, c = self.semi_axes
        return Swept(1.0 / a, 1.0 / b, 1.0 / c, c, 1.0)

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        scale = 1.0 / np.asarray(self.semi_axes)
        start = scale * (np.asarray(origin, dtype=float) - np.array([0.0, 0.0, self.semi_axes[2]]))
        span = scale[:, None] * np.column_stack([s_axis, t_axis])
        # |start + span q| = 1 is |R (q − q0)| = rho
        R = np.linalg.cholesky(span.T @ span).T
        q0 = -np.linalg.lstsq(span, start, rcond=None)[0]
        left = 1.0 - float(np.sum((start + span @ q0) ** 2))
        if left <= 0.0:
            return None
        rho = math.sqrt(left)
        # in metres again, so that the profile's disc is as large as the section
        size = 1.0 / math.sqrt(float(np.linalg.det(R)))
        M = R * size
        return ProfileSection(M, np.array([0.0, rho * size]) - M @ q0, rho * size)

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        scale = 1.0 / np.asarray(self.semi_axes)
        p = scale * (np.asarray(point, dtype=float) - np.array([0.0, 0.0, self.semi_axes[2]]))
        d = scale * np.asarray(direction, dtype=float)
        a, b = float(d @ d), float(p @ d)
        discriminant = b**2 - a * (float(p @ p) - 1.0)
        return (-b - math.sqrt(discriminant)) / a if discriminant >= 0.0 else math.inf

    def tangent_point(self, offset: float, angle: Angle) -> tuple[Angle, Angle] | None:
        a, b, c = self.semi_axes
        if abs(offset) >= b:
            return None
        shrink = math.sqrt(1.0 - (offset / b) ** 2)
        x, z = a * shrink * np.sin(angle), -c * shrink * np.cos(angle)
        length = np.hypot(x, z)
        return a * shrink * x / length, c + c * shrink * z / length
