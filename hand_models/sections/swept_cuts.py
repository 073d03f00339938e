"""Rock in a finger's plane as it is cut from a swept hold, and where that has flat faces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

from hand_models.sections.ellipses import Ellipse
from hand_models.sections.smooth_cuts import Disc, Face, SmoothCut, Tangent, Wall
from hand_models.sections.swept_ball import PARALLEL, Swept

__all__ = ["FingerPlane", "cut_of"]

FingerPlane = tuple[float, float, float, float, float, float, float, float, float]
"""Axes of a finger's plane, along the finger and into the rock, and its origin from the centre of
the hold's ball, all scaled."""

SKEW: Final = 1e-3
"""Square of the least sine of the angle between a finger's plane and the axis of what it cuts."""

ROUND: Final = 1e-12
"""Unevenness, relative to the mean, up to which an ellipse counts as a circle."""

BESIDE: Final = -1e-9
"""How far on the inner side of a line through the ball's centre counts as beside it [m]."""


def cut_of(shape: Swept, plane: FingerPlane) -> SmoothCut | None:
    """Return the rock in a plane; None if the plane misses it, or runs along its axis."""
    a, b, c, d, e, f, x, y, z = plane
    if not shape.radius:
        steep = math.hypot(c, f)
        return None if steep < PARALLEL else Wall(complex(c, f) / steep, -z / steep)
    g11, g12, g22 = a * a + b * b + c * c, a * d + b * e + c * f, d * d + e * e + f * f
    b1, b2 = a * x + b * y + c * z, d * x + e * y + f * z
    determinant = g11 * g22 - g12 * g12
    if determinant <= SKEW * (0.5 * (g11 + g22)) ** 2:
        return None
    centre = complex(g12 * b2 - g22 * b1, g12 * b1 - g11 * b2) / determinant
    square = shape.radius**2 - (x * x + y * y + z * z) - b1 * centre.real - b2 * centre.imag
    if square <= 0.0:
        return None
    mean, uneven = 0.5 * (g11 + g22), complex(0.5 * (g11 - g22), -g12)
    core: Disc | Ellipse
    if abs(uneven) <= ROUND * mean:
        core = Disc(centre, math.sqrt(square / mean))
    else:
        # distances to an ellipsoid's section are told in metres by its mean radius
        size = determinant**-0.25 if shape.scale_y else 1.0
        core = Ellipse(centre, mean, uneven, determinant, square, size)
    if not shape.sine:
        return core
    return _Edge(core, _line(shape, plane, 1.0), _line(shape, plane, -1.0))


class _Line(NamedTuple):
    """A flat face of the rock: it is where out · q = ball, from where ahead · q ≥ 0 on.

    Attributes
    ----------
    out : complex
        Out of the rock, conjugated; from the ball's centre.
    out_offset : float
    ahead : complex
        Along the face, conjugated; from where it begins.
    ahead_offset : float
    ball : float
        How far the face is from the ball's centre [m].
    way : complex
        Along the line in the plane, on the side of the face, conjugated.
    """

    out: complex
    out_offset: float
    ahead: complex
    ahead_offset: float
    ball: float
    way: complex

    def beyond(self, point: complex) -> float:
        """Return how far a point is beyond the face's line."""
        return (self.out * point).real + self.out_offset - self.ball

    def beside(self, point: complex) -> float:
        """Return how far a point is along the face from where it begins."""
        return (self.ahead * point).real + self.ahead_offset

    def entry(self, joint: complex, arm: float) -> complex | None:
        """Return the direction in which a point that turns about a joint crosses the face."""
        steep = abs(self.out)
        cosine = self.beyond(joint) / (steep * arm)
        if abs(cosine) > 1.0:
            return None
        way = self.out.conjugate() / -steep * complex(cosine, -math.sqrt(1.0 - cosine * cosine))
        return way if self.beside(joint + arm * way) >= 0.0 else None


def _line(shape: Swept, plane: FingerPlane, side: float) -> _Line:
    """Return the face on one side of a hold."""
    a, _, c, d, _, f, x, _, z = plane
    sine, cosine = side * shape.sine, side * shape.cosine
    out = complex(cosine * a - shape.sine * c, shape.sine * f - cosine * d)
    ahead = complex(sine * a + shape.cosine * c, -sine * d - shape.cosine * f)
    way = 1j * out
    return _Line(
        out=out,
        out_offset=cosine * x - shape.sine * z,
        ahead=ahead,
        ahead_offset=sine * x + shape.cosine * z,
        ball=shape.radius,
        way=way if (way.conjugate() * ahead).real >= 0.0 else -way,
    )


class _Edge(SmoothCut):
    """A disc or an ellipse of rock that is swept along two faces."""

    faced = True

    def __init__(self, core: Disc | Ellipse, first: _Line, second: _Line) -> None:
        self._core, self._first, self._second = core, first, second

    def _bounded(self, normal: complex) -> bool:
        """Whether a line of that normal, into the rock, can be beside it: no face crosses it."""
        return (self._first.way * normal).real >= 0.0 and (self._second.way * normal).real >= 0.0

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        found = self._core.tangent(joint, height)
        return found if found is not None and self._bounded(1j * found[0]) else None

    def entries(self, joint: complex, arm: float) -> list[complex]:
        first, second = self._first, self._second
        ways = []
        for way in self._core.entries(joint, arm):
            point = joint + arm * way
            if first.beside(point) <= 0.0 and second.beside(point) <= 0.0:
                ways.append(way)
        for line in (first, second):
            on_face = line.entry(joint, arm)
            if on_face is not None:
                ways.append(on_face)
        return ways

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        begin, end = (joint + complex(along, face.height) * u for along in (face.start, face.end))
        for line in (self._first, self._second):
            if line.beyond(begin) > 0.0 and line.beyond(end) > 0.0:
                yield -line.out.conjugate()
        for normal in self._core.partings(joint, u, face):
            if self._bounded(normal):
                yield normal

    def distance(self, point: complex) -> float:
        first, second = self._first, self._second
        ball, beyond = first.ball, (first.beyond(point), second.beyond(point))
        if max(beyond) <= -ball:
            return max(beyond)
        away = self._core.distance(point)
        for line, far in zip((first, second), beyond, strict=True):
            if far >= -ball and line.beside(point) >= 0.0:
                away = min(away, far)
        return away

    def straight(self, point: complex) -> bool:
        return any(
            line.beside(point) >= 0.0 and line.beyond(point) + line.ball >= BESIDE
            for line in (self._first, self._second)
        )
