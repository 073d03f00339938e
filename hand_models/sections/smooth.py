"""Rock in a finger's plane, where it cuts a smooth hold: convex, and bounded by a curve.

Hands that close ask some hundred times how a phalanx comes to it (`SmoothSection.turned`), so it is
put to plain numbers. That is answered from two simpler questions,

``tangent``
    in which direction of a phalanx the whole line of its face touches the curved part of the rock,
``entries``
    in which directions a given point that turns about the joint enters the rock.

Here are the kinds that need no more than a circle or a line; the others are in
`hand_models.sections.ellipses` and `hand_models.sections.swept_cuts`.
"""

from __future__ import annotations

import cmath
import math
from abc import abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np

from hand_models.sections.section import Complexes, Face, Rest, Section

__all__ = ["Disc", "SmoothSection", "Wall", "into_circle", "past_circle", "to_face"]

Tangent = tuple[complex, float]
"""Direction of a phalanx whose face's line touches the rock, and how far along it that is [m]."""

Turned = tuple[float, complex, float, bool]
"""How far a phalanx turns till it rests [rad], its direction and its contact, and if it is flat."""


class SmoothSection(Section):
    """Convex rock in a finger's plane.

    Attributes
    ----------
    faced : bool
        Whether it has flat faces.
    skew : bool
        Whether the plane runs nearly along the axis of what it cuts.
    """

    faced = False
    skew = False

    @abstractmethod
    def tangent(self, joint: complex, height: float) -> Tangent | None:
        """Return where a turning phalanx first touches the curved rock with its face's line."""

    @abstractmethod
    def entries(self, joint: complex, arm: float) -> list[complex]:
        """Return the directions in which a point that turns about a joint enters the rock."""

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        """Yield normals, into the rock, of lines that part it from the face of a phalanx along u.

        As far as is known without search.
        """
        return iter(())

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        """Return True if the face of a phalanx along u is clear of the rock."""
        for _ in self.partings(joint, u, face):
            return True
        return self.face_clearance(joint, u, face) > 0.0

    def straight(self, point: complex) -> bool:
        """Return True if the rock beside a point is straight: a face may lie flat on it."""
        return False

    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        found = self.turned(joint, face, cmath.rect(1.0, low), high - low)
        return None if found is None else Rest(low + found[0], found[2], found[3])

    def turned(self, joint: complex, face: Face, low: complex, span: float) -> Turned | None:
        """Return where a phalanx that turns by up to ``span`` from ``low`` rests, if it does."""
        tangent = self.tangent(joint, face.height)
        if tangent is not None:
            u, along = tangent
            turn = cmath.phase(u / low) % math.tau
            if turn <= span:
                if face.start <= along <= face.end:
                    return turn, u, along, False
                if not self.faced:
                    # the face's line touches the rock beyond this end, which is first on it
                    along = face.end if along > face.end else face.start
                    turn, u = self._entered(joint, complex(along, face.height), low, span)
                    return None if turn > span else (turn, u, along, False)
        ends = [complex(along, face.height) for along in face[:2]]
        first, last = (self._entered(joint, end, low, span) for end in ends)
        turn, u = first if first[0] <= last[0] else last
        if turn > span:
            return None
        level = abs(first[0] - last[0]) * (face.end - face.start) <= face.level
        if level and all(self.straight(joint + end * u) for end in ends):
            return turn, u, 0.5 * (face.start + face.end), True
        return turn, u, face.start if first[0] <= last[0] else face.end, False

    def _entered(
        self, joint: complex, end: complex, low: complex, span: float
    ) -> tuple[float, complex]:
        """Return how far a phalanx turns till an end of its face is on the rock, and to where.

        Infinitely far where it is not within the span.
        """
        arm = abs(end)
        back = end.conjugate() / arm
        first = math.inf, low
        for way in self.entries(joint, arm):
            u = way * back
            turn = cmath.phase(u / low) % math.tau
            if turn <= span and turn < first[0]:
                first = turn, u
        return first


class Disc(SmoothSection):
    """A disc of rock."""

    def __init__(self, centre: complex, radius: float) -> None:
        self.centre, self.radius = centre, radius

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        return past_circle(self.centre - joint, self.radius + height)

    def entries(self, joint: complex, arm: float) -> list[complex]:
        way = into_circle(self.centre - joint, self.radius, arm)
        return [] if way is None else [way]

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        way = to_face(self.centre - joint, u, face)
        if abs(way) > self.radius:
            yield way * u / abs(way)

    def face_clearance(self, joint: complex, u: complex, face: Face) -> float:
        return abs(to_face(self.centre - joint, u, face)) - self.radius

    def distance(self, point: complex) -> float:
        return abs(point - self.centre) - self.radius

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        centre, radius = self.centre, self.radius
        away = abs(centre)
        if not abs(away - radius) < reach:
            return []
        # as seen from the centre, the origin's side of the disc
        half = math.pi
        if away > 0.0 and radius + away > reach:
            cosine = (away**2 + radius**2 - reach**2) / (2.0 * away * radius)
            half = math.acos(min(max(cosine, -1.0), 1.0))
        count = max(math.ceil(2.0 * half * radius / spacing), 16)
        turns = np.linspace(-half, half, count + 1)
        toward = -centre / away if away > 0.0 else 1.0
        return [centre + radius * toward * np.exp(1j * turns)]


class Wall(SmoothSection):
    """A half-plane of rock.

    Parameters
    ----------
    into : complex
        Direction into the rock.
    offset : float
        How far the origin is from it [m].
    """

    faced = True

    def __init__(self, into: complex, offset: float) -> None:
        self._into, self._out, self._offset = into, -into.conjugate(), offset

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        return None

    def entries(self, joint: complex, arm: float) -> list[complex]:
        cosine = self.distance(joint) / arm
        if abs(cosine) > 1.0:
            return []
        return [self._into * complex(cosine, -math.sqrt(1.0 - cosine * cosine))]

    def face_clearance(self, joint: complex, u: complex, face: Face) -> float:
        slope = self._out * u
        nearest = min(face.start * slope.real, face.end * slope.real) - face.height * slope.imag
        return self.distance(joint) + nearest

    def distance(self, point: complex) -> float:
        return (self._out * point).real + self._offset

    def straight(self, point: complex) -> bool:
        return True

    def normal(self, point: tuple[float, float]) -> tuple[float, float]:
        return -self._into.real, -self._into.imag

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        if abs(self._offset) >= reach:
            return []
        return [self._into * (self._offset + 1j * reach * np.array([1.0, -1.0]))]


def past_circle(away: complex, offset: float) -> Tangent | None:
    """Return the direction, and how far, to where a line passes a centre at an offset."""
    distance = abs(away)
    if distance <= offset:
        return None
    reach = math.sqrt((distance - offset) * (distance + offset))
    return away * complex(reach, -offset) / (distance * distance), reach


def into_circle(away: complex, radius: float, arm: float) -> complex | None:
    """Return the direction in which a point that turns enters a circle about a centre."""
    distance = abs(away)
    if arm * distance == 0.0:
        return None
    cosine = (arm * arm + distance * distance - radius * radius) / (2.0 * arm * distance)
    if abs(cosine) > 1.0:
        return None
    return away / distance * complex(cosine, -math.sqrt(1.0 - cosine * cosine))


def to_face(away: complex, u: complex, face: Face) -> complex:
    """Return the way to a centre from the place of a face nearest it, in the phalanx's axes."""
    place = u.conjugate() * away
    along = place.real
    nearest = face.start if along < face.start else face.end if along > face.end else along
    return complex(along - nearest, place.imag - face.height)
