"""Hold geometry, and the section of rock that a finger's plane meets.

A hold has its own frame: origin on the rock at the crest (the point nearest the palm), z into the
rock, y along the axis of a cylinder or an edge. Every hold here is convex and is described by a
*profile* in its x-z plane: a disc of radius r that touches the origin, swept along a cone of
directions (none for a round hold, two faces for an edge). A finger plane cuts it in an affine image
of that profile.

A section answers the two questions that settling asks of rock:

``tangent``
    at which angle does the face of a tile touch the curved part of the section,
``touch``
    at which angle does a given point of a tile reach the rock.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from hand_models.errors import InvalidInputError
from hand_models.frames import Array

__all__ = ["Cylinder", "Edge", "Ellipsoid", "Hold", "Plane", "Section", "Sphere", "Tangency"]

Vector2 = tuple[float, float]

PARALLEL: Final = 1e-3
"""Below this sine, a finger plane counts as parallel to the axis of an extruded hold."""

LARGEST: Final = 1e6
"""Size of a hold above which its curve is lost in rounding [m]."""

SAMPLES: Final = 48
"""Angles tried to bracket a root where there is no closed form."""

ZOOMS: Final = 6
"""How often the samples near a root that may hide between two of them are refined, 8 to 1."""


class Tangency(NamedTuple):
    """A tile's face tangent to the rock.

    Attributes
    ----------
    angle : float
        Of the phalanx, from the section's first axis toward its second [rad].
    distance : float
        Of the contact from the joint, along the phalanx [m].
    """

    angle: float
    distance: float


class Section(ABC):
    """Rock in a plane with coordinates (s, t); t grows into the rock."""

    flat = False
    """Whether (part of) the section is straight, so that a face may lie on it anywhere."""

    @abstractmethod
    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Tangency | None:
        """Return where a face, ``height`` above a phalanx, first touches the section's curve.

        The phalanx turns about ``joint`` from the angle ``low`` to ``high``.
        """

    @abstractmethod
    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        """Return the first angle at which the point (along, height) of a phalanx is on the rock."""

    @abstractmethod
    def clearance(self, point: Vector2) -> float:
        """Return about how far a point is from the rock, negative inside [m].

        Exact on flat and round sections, and everywhere its sign is.
        """


def _within(angle: float, low: float, high: float) -> float | None:
    """Return ``angle`` plus the whole turns that bring it into [low, high], if any do."""
    angle = low + (angle - low) % math.tau
    return angle if angle <= high else None


@dataclass(frozen=True)
class FlatSection(Section):
    """Rock ``normal · q ≥ offset`` with a unit normal."""

    normal: Vector2
    offset: float
    flat = True

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Tangency | None:
        return None

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        distance = self.offset - self.normal[0] * joint[0] - self.normal[1] * joint[1]
        radius = math.hypot(along, height)
        if abs(distance) > radius:
            return None
        # n · (cos ψ, sin ψ) = distance / radius, coming from outside
        toward = math.atan2(self.normal[1], self.normal[0])
        angle = toward - math.acos(distance / radius) - math.atan2(height, along)
        return _within(angle, low, high)

    def clearance(self, point: Vector2) -> float:
        return self.offset - self.normal[0] * point[0] - self.normal[1] * point[1]


@dataclass(frozen=True)
class RoundSection(Section):
    """A disc of rock."""

    centre: Vector2
    radius: float

    def _polar(self, joint: Vector2) -> tuple[float, float]:
        dx, dz = self.centre[0] - joint[0], self.centre[1] - joint[1]
        return math.hypot(dx, dz), math.atan2(dz, dx)

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Tangency | None:
        distance, bearing = self._polar(joint)
        offset = self.radius + height
        if distance <= offset:
            return None
        angle = _within(bearing - math.asin(offset / distance), low, high)
        if angle is None:
            return None
        return Tangency(angle, math.sqrt(distance**2 - offset**2))

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        distance, bearing = self._polar(joint)
        arm = math.hypot(along, height)
        if distance == 0.0:
            return None
        cosine = (arm**2 + distance**2 - self.radius**2) / (2.0 * arm * distance)
        if abs(cosine) > 1.0:
            return None
        return _within(bearing - math.acos(cosine) - math.atan2(height, along), low, high)

    def clearance(self, point: Vector2) -> float:
        distance = math.hypot(point[0] - self.centre[0], point[1] - self.centre[1])
        return distance - self.radius


@dataclass(frozen=True, eq=False)
class ProfileSection(Section):
    """The preimage of a profile (a disc swept along a cone) under ``p = M q + m``.

    Attributes
    ----------
    M : ndarray, shape (2, 2)
    m : ndarray, shape (2,)
        From the section's coordinates to the profile's.
    radius : float
        Of the disc, which touches the profile's origin from below [m].
    faces : ndarray, shape (k, 2)
        Directions that span the cone; none for a round profile.
    """

    M: Array
    m: Array
    radius: float
    faces: Array

    @property
    def flat(self) -> bool:  # type: ignore[override]
        return len(self.faces) > 0

    def _clearance(self, normal: Array, joint: Vector2, height: float) -> Array:
        """Distance from a face with the given normals (2, n) to the rock, −∞ if it cuts a face."""
        dual = np.linalg.solve(self.M.T, normal)
        support = dual[1] * self.radius - self.radius * np.hypot(dual[0], dual[1])
        support = support - self.m @ dual
        if self.flat:
            support = np.where((self.faces @ dual >= 0.0).all(axis=0), support, -np.inf)
        return np.asarray(support - normal.T @ np.asarray(joint) - height)

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Tangency | None:
        def clearance(angle: Array) -> Array:
            return self._clearance(np.stack([-np.sin(angle), np.cos(angle)]), joint, height)

        angle = _descent(clearance, low, high)
        if angle is None:
            return None
        # the derivative of the clearance is minus the distance of the contact along the phalanx
        normal = np.array([-math.sin(angle), math.cos(angle)])
        dual = np.linalg.solve(self.M.T, normal)
        contact = np.array([0.0, self.radius]) - self.radius * dual / np.hypot(*dual)
        point = np.linalg.solve(self.M, contact - self.m) - np.asarray(joint)
        distance = float(point[0] * math.cos(angle) + point[1] * math.sin(angle))
        return Tangency(angle, distance) if distance > 0.0 else None

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        arm, phase = math.hypot(along, height), math.atan2(height, along)

        def clearance(angle: Array) -> Array:
            turned = np.stack([np.cos(angle + phase), np.sin(angle + phase)])
            q = np.asarray(joint)[:, None] + arm * turned
            return _profile_distance(self.M @ q + self.m[:, None], self.radius, self.faces)

        return _descent(clearance, low, high)

    def clearance(self, point: Vector2) -> float:
        q = self.M @ np.asarray(point) + self.m
        return float(_profile_distance(q[:, None], self.radius, self.faces)[0])


def _descent(function: Callable[[Array], Array], low: float, high: float) -> float | None:
    """Return the first angle where a sampled function falls through zero.

    Between two samples it may rise above zero and fall again (a face on rock that curves little),
    or dip below: peaks below zero and troughs above it are therefore sampled more closely.
    """
    angles = np.linspace(low, high, SAMPLES)
    values = function(angles)
    for _ in range(ZOOMS):
        above = values > 0.0
        falls = np.flatnonzero(above[:-1] & ~above[1:])
        height = np.where(above, -values, values)
        beside = np.pad(height, 1, constant_values=-np.inf)
        alike = np.pad(above, 1, mode="edge")
        peaks = (height >= beside[:-2]) & (height >= beside[2:])
        peaks &= (above == alike[:-2]) & (above == alike[2:])
        # a smooth peak rises above its highest sample by no more than the samples differ there
        steps = np.abs(np.diff(np.where(np.isfinite(height), height, 0.0)))
        peaks &= height + np.maximum(np.append(steps, steps[-2]), np.append(steps[1], steps)) > 0.0
        places = np.flatnonzero(peaks[: falls[0] if len(falls) else None])
        if not len(places):
            break
        left = angles[np.maximum(places - 1, 0)]
        right = angles[np.minimum(places + 1, len(angles) - 1)]
        angles = np.unique(np.concatenate([angles, np.linspace(left, right, 17)[1:-1].ravel()]))
        values = function(angles)
    falls = np.flatnonzero((values[:-1] > 0.0) & (values[1:] <= 0.0))
    if not len(falls):
        return None
    start, end = float(angles[falls[0]]), float(angles[falls[0] + 1])

    def scalar(angle: float) -> float:
        return float(function(np.array([angle]))[0])

    if not math.isfinite(values[falls[0] + 1]):
        # the function ends in −∞: find the last finite value, and see whether it fell before
        for _ in range(60):
            middle = 0.5 * (start + end)
            value = scalar(middle)
            if value > 0.0:
                start = middle
            elif math.isfinite(value):
                end = middle
                break
            else:
                end = middle
        else:
            return None
    return float(brentq(scalar, start, end, xtol=1e-14, rtol=1e-14))


def _outward(faces: Array) -> Array:
    """Return the unit normals, out of the rock, of the two faces of a cone, shape (2, 2)."""
    normals = faces * (faces[0] @ faces[1]) - faces[::-1]
    return np.asarray(normals / np.hypot(normals[:, 0], normals[:, 1])[:, None])


def _profile_distance(points: Array, radius: float, faces: Array) -> Array:
    """Distance of points (2, n) from the profile, negative inside."""
    q = points - np.array([[0.0], [radius]])
    distance = np.hypot(q[0], q[1])
    if len(faces):
        sides = _outward(faces) @ q
        beside = (faces @ q >= 0.0) & (sides >= 0.0)
        outside = np.where(beside, sides, np.inf).min(axis=0, initial=np.inf)
        distance = np.where(
            (sides <= 0.0).all(axis=0), sides.max(axis=0), np.minimum(distance, outside)
        )
    return np.asarray(distance - radius)


class Hold(ABC):
    """A piece of rock that a hand may take."""

    shape: str

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

    @abstractmethod
    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        """Return how far from a point, along a unit direction, the rock begins [m].

        Negative where the point is inside; infinite where the line misses the rock.
        """

    @abstractmethod
    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        """Return depth of the centre [m] and radius [m] of the crest's circle at y = ``offset``.

        None where the plane at that offset meets nothing round.
        """

    def tangent_point(self, offset: float, angle: float) -> Vector2 | None:
        """Return the point (x, z) at y = ``offset`` where rock runs at an angle from x toward z.

        Only of a hold that is smooth but not round there; None elsewhere.
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

    def section(self, origin: ArrayLike, s_axis: ArrayLike, t_axis: ArrayLike) -> Section | None:
        s, t = float(np.asarray(s_axis)[2]), float(np.asarray(t_axis)[2])
        norm = math.hypot(s, t)
        if norm < PARALLEL:
            return None
        return FlatSection((s / norm, t / norm), -float(np.asarray(origin)[2]) / norm)

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        slope = float(np.asarray(direction)[2])
        return -float(np.asarray(point)[2]) / slope if slope > PARALLEL else math.inf

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        return None


class _Extruded(Hold):
    """A profile drawn out along y."""

    @property
    @abstractmethod
    def profile_radius(self) -> float:
        """Radius of the profile's disc [m]."""

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
        if not len(self.faces) and abs(abs(determinant) - 1.0) < 1e-12:
            centre = M.T @ (np.array([0.0, self.profile_radius]) - m)
            return RoundSection((float(centre[0]), float(centre[1])), self.profile_radius)
        return ProfileSection(M, m, self.profile_radius, self.faces)

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
        return self.profile_radius, self.profile_radius


def _profile_entry(p: Vector2, d: Vector2, radius: float, faces: Array) -> float:
    """Return the first parameter at which p + λ d meets a disc at the origin swept along a cone."""
    candidates: list[float] = []
    a = d[0] ** 2 + d[1] ** 2
    b = p[0] * d[0] + p[1] * d[1]
    discriminant = b**2 - a * (p[0] ** 2 + p[1] ** 2 - radius**2)
    if a > 0.0 and discriminant >= 0.0:
        candidates.append((-b - math.sqrt(discriminant)) / a)
    if len(faces):
        for direction, outward in zip(faces, _outward(faces), strict=True):
            closing = float(outward @ np.asarray(d))
            if closing < 0.0:
                hit = (radius - float(outward @ np.asarray(p))) / closing
                where = np.asarray(p) + hit * np.asarray(d)
                if float(direction @ where) >= 0.0:
                    candidates.append(hit)
    return min(candidates, default=math.inf)


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
    def profile_radius(self) -> float:
        return self.fillet_radius

    @property
    def faces(self) -> Array:
        half = self.angle / 2.0
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
        return ProfileSection(M, np.array([0.0, rho * size]) - M @ q0, rho * size, np.zeros((0, 2)))

    def entry(self, point: ArrayLike, direction: ArrayLike) -> float:
        scale = 1.0 / np.asarray(self.semi_axes)
        p = scale * (np.asarray(point, dtype=float) - np.array([0.0, 0.0, self.semi_axes[2]]))
        d = scale * np.asarray(direction, dtype=float)
        a, b = float(d @ d), float(p @ d)
        discriminant = b**2 - a * (float(p @ p) - 1.0)
        return (-b - math.sqrt(discriminant)) / a if discriminant >= 0.0 else math.inf

    def crest_circle(self, offset: float) -> tuple[float, float] | None:
        return None

    def tangent_point(self, offset: float, angle: float) -> Vector2 | None:
        a, b, c = self.semi_axes
        if abs(offset) >= b:
            return None
        shrink = math.sqrt(1.0 - (offset / b) ** 2)
        x, z = a * shrink * math.sin(angle), -c * shrink * math.cos(angle)
        length = math.hypot(x, z)
        return a * shrink * x / length, c + c * shrink * z / length
