"""Sections of smooth holds: convex rock in a finger's plane, bounded by a curve.

Closing a hand asks some hundred times where a phalanx meets such rock (`SmoothSection.turned`), so
the code uses plain numbers. Two simpler functions answer,

``tangent``
    the direction of a phalanx in which the line of its face touches the curved part of the rock,
``entries``
    the directions in which a given point that turns about the joint enters the rock.

Here are the discs and the half-planes; the other sections are in `hand_models.sections.ellipses`
and `hand_models.sections.swept_cuts`.
"""

from __future__ import annotations

import cmath
import math
from abc import abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np

from hand_models.sections.section import Complexes, Face, Rest, Section, Turned

__all__ = ["Disc", "FlatRock", "SmoothSection", "into_circle", "past_circle", "to_face"]

Tangent = tuple[complex, float]
"""Direction of a phalanx whose face's line touches the rock, and the contact's distance along the
phalanx [m].
"""


class SmoothSection(Section):
    """Convex rock in a finger's plane.

    Attributes
    ----------
    faced : bool
        True if the rock has flat faces.
    """

    faced = False

    @abstractmethod
    def tangent(self, joint: complex, height: float) -> Tangent | None:
        """Return the direction of a phalanx in which its face's line touches the curved rock.

        Parameters
        ----------
        joint : complex
            Joint about which the phalanx turns [m].
        height : float
            Distance of the face from the phalanx's axis [m].

        Returns
        -------
        tuple of (complex, float), or None
            Direction of the phalanx, and the contact's distance along it [m]; None without tangent.
        """

    @abstractmethod
    def entries(self, joint: complex, arm: float) -> list[complex]:
        """Return the directions in which a point that turns about a joint enters the rock.

        Parameters
        ----------
        joint : complex
            Joint, s + i t [m].
        arm : float
            Distance of the point from the joint [m].

        Returns
        -------
        list of complex
            Unit vectors from the joint to the places of entry; empty if the point meets no rock.
        """

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        """Yield normals of lines that may separate the rock from the face of a phalanx.

        Only lines that are known without search are tried.

        Parameters
        ----------
        joint : complex
            Joint of the phalanx, s + i t [m].
        u : complex
            Unit direction of the phalanx.
        face : Face

        Yields
        ------
        complex
            Unit normal of a line, into the rock.
        """
        return iter(())

    def clear(self, joint: complex, u: complex, face: Face) -> bool:
        for _ in self.partings(joint, u, face):
            return True
        return super().clear(joint, u, face)

    def straight(self, point: complex) -> bool:
        """Return True if the rock beside a point s + i t is flat: a face may lie flat there."""
        return False

    def rest(self, joint: complex, face: Face, low: float, high: float) -> Rest | None:
        found = self.turned(joint, face, cmath.rect(1.0, low), high - low)
        return None if found is None else Rest(low + found[0], found[2], found[3])

    def turned(self, joint: complex, face: Face, low: complex, span: float) -> Turned | None:
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
    """A disc of rock.

    Parameters
    ----------
    centre : complex
        Centre s + i t [m].
    radius : float
        Radius [m].
    """

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


class FlatRock(SmoothSection):
    """A half-plane of rock.

    Parameters
    ----------
    into : complex
        Unit direction into the rock.
    offset : float
        Distance of the origin from the rock [m].
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
    """Return the direction of a line from a joint that passes a circle's centre at an offset.

    Parameters
    ----------
    away : complex
        Vector from the joint to the centre [m].
    offset : float
        Distance of the line from the centre, which is on its left (s toward t) [m].

    Returns
    -------
    tuple of (complex, float), or None
        Unit direction, and the distance along the line to the place nearest the centre [m]; None
        if the centre is not farther than the offset.
    """
    distance = abs(away)
    if distance <= offset:
        return None
    reach = math.sqrt((distance - offset) * (distance + offset))
    return away * complex(reach, -offset) / (distance * distance), reach


def into_circle(away: complex, radius: float, arm: float) -> complex | None:
    """Return the direction in which a point that turns about a joint enters a circle.

    Parameters
    ----------
    away : complex
        Vector from the joint to the circle's centre [m].
    radius, arm : float
        Radius of the circle, and distance of the point from the joint [m].

    Returns
    -------
    complex or None
        Unit direction from the joint; None if the point's path does not meet the circle.
    """
    distance = abs(away)
    if arm * distance == 0.0:
        return None
    cosine = (arm * arm + distance * distance - radius * radius) / (2.0 * arm * distance)
    if abs(cosine) > 1.0:
        return None
    return away / distance * complex(cosine, -math.sqrt(1.0 - cosine * cosine))


def to_face(away: complex, u: complex, face: Face) -> complex:
    """Return the vector to a circle's centre from the place of a face that is nearest to it.

    Parameters
    ----------
    away : complex
        Vector from the joint to the centre [m].
    u : complex
        Unit direction of the phalanx.
    face : Face

    Returns
    -------
    complex
        The vector in the phalanx's axes: real part along it, imaginary part across it [m].
    """
    place = u.conjugate() * away
    along = place.real
    nearest = face.start if along < face.start else face.end if along > face.end else along
    return complex(along - nearest, place.imag - face.height)
