"""Rock in a finger's plane: what settling asks of it.

A section has coordinates (s, t), t growing into the rock. The convex ones are a half-plane, a disc,
or the affine image of a *profile* (`hand_models.sections.profile_section`): a disc of radius r that
touches the origin, swept along a cone of directions (none for a round hold, two faces for an edge).

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
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array

__all__ = [
    "Complexes",
    "FlatSection",
    "Rest",
    "RoundSection",
    "Section",
    "Vector2",
]

Vector2 = tuple[float, float]

Complexes = NDArray[np.complex128]

LEVEL: Final = 1e-4
"""A face both of whose ends are this close to the rock when the first touches lies flat [m]."""

FACE_SAMPLES: Final = 9
"""Points of a face at which its distance from the rock is taken."""

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
    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        """Return the boundary of the rock as chains of points s + i t, rock on their left [m].

        Parameters
        ----------
        reach : float
            From the origin; what is farther off may be missing [m].
        spacing : float
            Of points along curved rock, about [m].
        """

    @abstractmethod
    def clearance(self, point: Vector2) -> float:
        """Return about how far a point is from the rock, negative inside [m].

        Exact on flat and round sections, and everywhere its sign is.
        """

    def clearances(self, places: Complexes) -> Array:
        """Return about how far places (...) are from the rock, negative inside [m]."""
        each = [self.clearance((place.real, place.imag)) for place in places.ravel().tolist()]
        return np.array(each).reshape(places.shape)

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

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        into = complex(*self.direction)
        if abs(self.offset) >= reach:
            return []
        return [into * (self.offset + 1j * reach * np.array([1.0, -1.0]))]

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

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        centre = complex(*self.centre)
        away = abs(centre)
        if not abs(away - self.radius) < reach:
            return []
        # as seen from the centre, the origin's side of the disc
        half = math.pi
        if away > 0.0 and self.radius + away > reach:
            cosine = (away**2 + self.radius**2 - reach**2) / (2.0 * away * self.radius)
            half = math.acos(min(max(cosine, -1.0), 1.0))
        count = max(math.ceil(2.0 * half * self.radius / spacing), 16)
        turns = np.linspace(-half, half, count + 1)
        toward = -centre / away if away > 0.0 else 1.0
        return [centre + self.radius * toward * np.exp(1j * turns)]

    def clearance(self, point: Vector2) -> float:
        distance = math.hypot(point[0] - self.centre[0], point[1] - self.centre[1])
        return distance - self.radius

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        dx, dz = self.centre[0] - joint[0], self.centre[1] - joint[1]
        nearest = dx * math.cos(angle) + dz * math.sin(angle)
        return self.clearance(_on_face(joint, min(max(nearest, start), end), height, angle))
