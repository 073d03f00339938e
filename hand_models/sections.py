"""Rock in a finger's plane: what settling asks of it.

A section has coordinates (s, t), t growing into the rock. The convex ones are a half-plane, a disc,
or the affine image of a *profile*: a disc of radius r that touches the origin, swept along a cone
of directions (none for a round hold, two faces for an edge).

Settling asks one question: at which angle does the face of a phalanx that turns about its joint
first meet the rock (`Section.rest`). It is answered from two simpler ones,

``tangent``
    at which angle does the whole line of the face touch the curved part of the section,
``touch``
    at which angle does a given point of the face reach the rock.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import brentq

from hand_models.frames import Array

__all__ = [
    "FlatSection",
    "ProfileSection",
    "Rest",
    "RoundSection",
    "Section",
    "Vector2",
    "outward",
]

Vector2 = tuple[float, float]

SAMPLES: Final = 48
"""Angles tried to bracket a root where there is no closed form."""

ZOOMS: Final = 6
"""How often the samples near a root that may hide between two of them are refined, 8 to 1."""

LEVEL: Final = 1e-4
"""A face both of whose ends are this close to the rock when the first touches lies flat [m]."""

FACE_SAMPLES: Final = 9
"""Points of a face at which its distance from the rock is taken."""

CHORD: Final = 2e-6
"""How far a polyline that stands for a curve may be from it [m]."""

STEP: Final = 1e-7
"""For the gradient of a distance [m]."""


class Rest(NamedTuple):
    """A face at rest on the rock.

    Attributes
    ----------
    angle : float
        Of the phalanx, from the section's first axis toward its second [rad].
    distance : float
        Of the contact from the joint, along the phalanx [m].
    flat : bool
        Whether the face lies flat, so that it touches all along.
    """

    angle: float
    distance: float
    flat: bool = False


class Section(ABC):
    """Rock in a plane with coordinates (s, t); t grows into the rock."""

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Rest | None:
        """Return where a face, ``height`` above a phalanx, first touches the section's curve.

        The phalanx turns about ``joint`` from the angle ``low`` to ``high``; its face goes on
        without end in its own direction. None where the section has no curve that it touches.
        """
        return None

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

    def rest(
        self, joint: Vector2, start: float, end: float, height: float, low: float, high: float
    ) -> Rest | None:
        """Return where a face first meets the rock as its phalanx turns.

        Parameters
        ----------
        joint : tuple of float
            About which the phalanx turns [m].
        start, end : float
            Where along the phalanx the face begins and ends [m].
        height : float
            Of the face above the phalanx, on the side of the rock [m].
        low, high : float
            The angle grows from one to the other; at ``low`` the face is free [rad].

        Returns
        -------
        Rest or None
            None if it meets no rock on its way.
        """
        tangency = self.tangent(joint, height, low, high)
        if tangency is not None and start <= tangency.distance <= end:
            return tangency
        ends = [
            Rest(angle, along)
            for along in (start, end)
            if (angle := self.touch(joint, along, height, low, high)) is not None
        ]
        if len(ends) == 2 and abs(ends[0].angle - ends[1].angle) * (end - start) <= LEVEL:
            angle = min(ends).angle
            if all(self.straight(_on_face(joint, r.distance, height, angle)) for r in ends):
                return Rest(angle, 0.5 * (start + end), flat=True)
        return min(ends, default=None)

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        """Return about how far a face is from the rock, negative where it cuts into it [m].

        Parameters as of `rest`.
        """
        return min(
            self.clearance(_on_face(joint, a, height, angle))
            for a in np.linspace(start, end, FACE_SAMPLES).tolist()
        )

    def sketch(self, reach: float) -> Section:
        """Return this section, or about the same within ``reach`` of the origin, quicker to lay on.

        Rests on it are as far off as a polyline is from its curve (`CHORD`).
        """
        return self

    def straight(self, point: Vector2) -> bool:
        """Whether the rock nearest a point is straight, so that a face may lie flat on it."""
        return False

    def normal(self, point: Vector2) -> Vector2:
        """Return the unit vector out of the rock at the place nearest a point."""
        s, t = point
        ds = self.clearance((s + STEP, t)) - self.clearance((s - STEP, t))
        dt = self.clearance((s, t + STEP)) - self.clearance((s, t - STEP))
        length = math.hypot(ds, dt)
        return (ds / length, dt / length) if length > 0.0 else (0.0, -1.0)


def _on_face(joint: Vector2, along: float, height: float, angle: float) -> Vector2:
    """Return the point (along, height) of a phalanx at an angle."""
    u, v = math.cos(angle), math.sin(angle)
    return joint[0] + along * u - height * v, joint[1] + along * v + height * u


def _within(angle: float, low: float, high: float) -> float | None:
    """Return ``angle`` plus the whole turns that bring it into [low, high], if any do."""
    angle = low + (angle - low) % math.tau
    return angle if angle <= high else None


@dataclass(frozen=True)
class FlatSection(Section):
    """Rock ``direction · q ≥ offset``, with a unit direction into the rock."""

    direction: Vector2
    offset: float

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        distance = self.clearance(joint)
        radius = math.hypot(along, height)
        if abs(distance) > radius:
            return None
        # direction · (cos ψ, sin ψ) = distance / radius, coming from outside
        toward = math.atan2(self.direction[1], self.direction[0])
        angle = toward - math.acos(distance / radius) - math.atan2(height, along)
        return _within(angle, low, high)

    def clearance(self, point: Vector2) -> float:
        return self.offset - self.direction[0] * point[0] - self.direction[1] * point[1]

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        return min(self.clearance(_on_face(joint, a, height, angle)) for a in (start, end))

    def straight(self, point: Vector2) -> bool:
        return True

    def normal(self, point: Vector2) -> Vector2:
        return -self.direction[0], -self.direction[1]


@dataclass(frozen=True)
class RoundSection(Section):
    """A disc of rock."""

    centre: Vector2
    radius: float

    def _polar(self, joint: Vector2) -> tuple[float, float]:
        dx, dz = self.centre[0] - joint[0], self.centre[1] - joint[1]
        return math.hypot(dx, dz), math.atan2(dz, dx)

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Rest | None:
        distance, bearing = self._polar(joint)
        offset = self.radius + height
        if distance <= abs(offset):
            return None
        angle = _within(bearing - math.asin(offset / distance), low, high)
        if angle is None:
            return None
        return Rest(angle, math.sqrt(distance**2 - offset**2))

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

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        dx, dz = self.centre[0] - joint[0], self.centre[1] - joint[1]
        nearest = dx * math.cos(angle) + dz * math.sin(angle)
        return self.clearance(_on_face(joint, min(max(nearest, start), end), height, angle))


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

    def _clearance(self, normal: Array, joint: Vector2, height: float) -> Array:
        """Distance from a face with the given normals (2, n) to the rock, −∞ if it cuts a face."""
        dual = np.linalg.solve(self.M.T, normal)
        support = dual[1] * self.radius - self.radius * np.hypot(dual[0], dual[1])
        support = support - self.m @ dual
        if len(self.faces):
            support = np.where((self.faces @ dual >= 0.0).all(axis=0), support, -np.inf)
        return np.asarray(support - normal.T @ np.asarray(joint) - height)

    def tangent(self, joint: Vector2, height: float, low: float, high: float) -> Rest | None:
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
        return Rest(angle, distance) if distance > 0.0 else None

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

    def sketch(self, reach: float) -> Section:
        from hand_models.polyline import PolylineSection

        return PolylineSection([self.outline(reach)])

    def outline(self, reach: float) -> Array:
        """Return the boundary within about ``reach`` of the origin as a polyline, shape (n, 2).

        Rock is on its left, turning from s toward t; chords are within `CHORD` of the curve.
        """
        step = math.sqrt(8.0 * self.radius * CHORD)
        centre = np.array([0.0, self.radius])
        toward = self.m - centre
        middle = math.atan2(toward[1], toward[0])
        half = min(math.pi, 2.0 * reach / self.radius)
        if len(self.faces):
            # the arc between the two tangent points, the crest (−π/2) in its middle
            ends = np.arctan2(*outward(self.faces)[:, ::-1].T)
            middle, half = -math.pi / 2, float(np.abs(ends + math.pi / 2).max())
        angles = np.linspace(middle - half, middle + half, 3 + int(2.0 * half * self.radius / step))
        arc = centre + self.radius * np.column_stack([np.cos(angles), np.sin(angles)])
        if len(self.faces):
            # counterclockwise about the rock: from the face at negative x to the one at positive x
            first, last = self.faces[np.argsort(self.faces[:, 0])]
            arc = np.vstack([arc[0] + 2.0 * reach * first, arc, arc[-1] + 2.0 * reach * last])
        points = np.linalg.solve(self.M, (arc - self.m).T).T
        return np.asarray(points if np.linalg.det(self.M) > 0.0 else points[::-1])

    def straight(self, point: Vector2) -> bool:
        if not len(self.faces):
            return False
        q = self.M @ np.asarray(point) + self.m - np.array([0.0, self.radius])
        return bool(((self.faces @ q >= 0.0) & (outward(self.faces) @ q >= 0.0)).any())

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        along = np.linspace(start, end, FACE_SAMPLES)
        points = np.array(_on_face(joint, 0.0, height, angle))[:, None]
        points = points + along * np.array([[math.cos(angle)], [math.sin(angle)]])
        q = self.M @ points + self.m[:, None]
        return float(_profile_distance(q, self.radius, self.faces).min())


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


def outward(faces: Array) -> Array:
    """Return the unit normals, out of the rock, of the two faces of a cone, shape (2, 2)."""
    turned = np.column_stack([faces[:, 1], -faces[:, 0]])
    return np.asarray(np.sign(faces[:, :1]) * turned)


def _profile_distance(points: Array, radius: float, faces: Array) -> Array:
    """Distance of points (2, n) from the profile, negative inside."""
    q = points - np.array([[0.0], [radius]])
    distance = np.hypot(q[0], q[1])
    if len(faces):
        sides = outward(faces) @ q
        beside = (faces @ q >= 0.0) & (sides >= 0.0)
        outside = np.where(beside, sides, np.inf).min(axis=0, initial=np.inf)
        distance = np.where(
            (sides <= 0.0).all(axis=0), sides.max(axis=0), np.minimum(distance, outside)
        )
    return np.asarray(distance - radius)
