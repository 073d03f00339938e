"""Rock in a finger's plane, where it cuts a smooth hold: what laying a phalanx on it asks.

The questions are those of `hand_models.sections.section`, and so are the answers; but hands that
close ask them some hundred times, so that here they are put to plain numbers. Places in the plane
are complex numbers x + i z in the finger's coordinates F [m], and directions complex numbers of
length one.

Here are the kinds that need no more than a circle or a line; the others are in
`hand_models.sections.ellipses` and `hand_models.sections.swept_cuts`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import NamedTuple

from hand_models.sections.section import FACE_SAMPLES

__all__ = ["Disc", "Face", "SmoothCut", "Tangent", "Wall", "into_circle", "past_circle", "to_face"]

Tangent = tuple[complex, float]
"""Direction of a phalanx whose face's line touches the rock, and how far along it that is [m]."""


class Face(NamedTuple):
    """The face of a phalanx: where it begins and ends along it, and its height above it [m]."""

    start: float
    end: float
    height: float


class SmoothCut(ABC):
    """Rock in a finger's plane.

    Attributes
    ----------
    faced : bool
        Whether it has flat faces.
    """

    faced = False

    @abstractmethod
    def tangent(self, joint: complex, height: float) -> Tangent | None:
        """Return where a turning phalanx first touches the curved rock with its face's line."""

    @abstractmethod
    def entries(self, joint: complex, arm: float) -> list[complex]:
        """Return the directions in which a point that turns about a joint enters the rock."""

    @abstractmethod
    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        """Yield normals, into the rock, of lines that part it from the face of a phalanx along u.

        As far as is known without search.
        """

    @abstractmethod
    def distance(self, point: complex) -> float:
        """Return about how far a point is from the rock, as `Section.clearance` [m]."""

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        """Whether the face of a phalanx along u is clear of the rock."""
        for _ in self.partings(joint, u, face):
            return True
        step = (face.end - face.start) / (FACE_SAMPLES - 1)
        begin = joint + complex(face.start, face.height) * u
        return all(self.distance(begin + i * step * u) > 0.0 for i in range(FACE_SAMPLES))

    def straight(self, point: complex) -> bool:
        """Whether the rock beside a point is straight, so that a face may lie flat on it."""
        return False


class Disc(SmoothCut):
    """A disc of rock."""

    def __init__(self, centre: complex, radius: float) -> None:
        self.centre, self._radius = centre, radius

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        return past_circle(self.centre - joint, self._radius + height)

    def entries(self, joint: complex, arm: float) -> list[complex]:
        way = into_circle(self.centre - joint, self._radius, arm)
        return [] if way is None else [way]

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        way = to_face(self.centre - joint, u, face)
        if abs(way) > self._radius:
            yield way * u / abs(way)

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        return abs(to_face(self.centre - joint, u, face)) > self._radius

    def distance(self, point: complex) -> float:
        return abs(point - self.centre) - self._radius


class Wall(SmoothCut):
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

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        if self.clear(joint, u, face):
            yield self._into

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        start, end, height = face
        slope = self._out * u
        nearest = min(start * slope.real, end * slope.real) - height * slope.imag
        return self.distance(joint) + nearest > 0.0

    def distance(self, point: complex) -> float:
        return (self._out * point).real + self._offset

    def straight(self, point: complex) -> bool:
        return True


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
    start, end, height = face
    nearest = start if along < start else end if along > end else along
    return complex(along - nearest, place.imag - height)
