"""Rock in a finger's plane that is an ellipse: the oblique cut of a log, or that of a boulder.

About a centre c it is

    G(q − c) ≤ ρ²,   G(v) = m |v|² + Re(κ v²),

with the mean m and the unevenness κ of its quadratic form. What laying asks of it follows from the
circle that fits it best where the last one led: at its point foremost in the direction n, with the
support h = √(n·En) and E = ρ² G⁻¹, it bends with the radius det E / h³. From one circle to the next
the mistake is squared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from hand_models.sections.conics import circle_crossings
from hand_models.sections.smooth_cuts import (
    Face,
    SmoothCut,
    Tangent,
    into_circle,
    past_circle,
    to_face,
)

__all__ = ["Ellipse"]

LAST_STEP: Final = 1e-8
"""Change of a direction after which the next one would be lost in rounding."""

NEAR: Final = 1e-5
"""The same for a distance, which changes with the square of the direction."""

CIRCLES: Final = 10
"""How many circles are fitted in turn, at most; two or three are mostly enough."""

STEPS: Final = 60
"""How many points are tried in turn where circles do not lead on."""


class _Nearest(NamedTuple):
    """An ellipse where it is nearest a joint.

    Attributes
    ----------
    distance : float
        Of that place from the joint [m].
    normal : complex
        Into the rock there.
    middle : complex
        Of the circle that fits it there, from the joint [m].
    radius : float
        Of that circle [m].
    """

    distance: float
    normal: complex
    middle: complex
    radius: float


class Ellipse(SmoothCut):
    """An ellipse of rock that is no circle.

    Parameters
    ----------
    centre : complex
        c [m].
    mean : float
        m.
    uneven : complex
        κ.
    determinant : float
        Of G, m² − |κ|².
    square : float
        ρ².
    size : float
        What distances in the quadratic form are multiplied by.
    """

    def __init__(
        self,
        centre: complex,
        mean: float,
        uneven: complex,
        determinant: float,
        square: float,
        size: float,
    ) -> None:
        self.centre = centre
        self._mean, self._uneven, self._size = mean, uneven, size
        self._rho = math.sqrt(square)
        self._dual = square / determinant
        self._bend = square * self._dual
        most = mean + abs(uneven)
        self._sharpest = self._rho * math.sqrt(determinant / most) / most
        self._joint: complex | None = None
        self._near: _Nearest | None = None

    def _foremost(self, normal: complex) -> tuple[complex, float]:
        """Return the point first met against a normal, from the centre, and the bend there."""
        turned = self._mean * normal - (self._uneven * normal).conjugate()
        support = math.sqrt(self._dual * (normal.conjugate() * turned).real)
        return -self._dual / support * turned, self._bend / support**3

    def _nearest(self, joint: complex) -> _Nearest | None:
        """Return the ellipse where it is nearest a joint; None if that is not found."""
        if joint == self._joint:
            return self._near
        away = self.centre - joint
        normal = away / abs(away) if self._near is None else self._near.normal
        near = None
        for _ in range(CIRCLES):
            point, bend = self._foremost(normal)
            place = away + point
            middle = place + bend * normal
            before, normal = normal, middle / abs(middle)
            if abs(normal - before) < NEAR:
                distance = (normal.conjugate() * place).real
                near = _Nearest(distance, normal, middle, bend)
                break
        self._joint, self._near = joint, near
        return near

    def tangent(self, joint: complex, height: float) -> Tangent | None:
        away = self.centre - joint
        near = self._nearest(joint)
        if near is None:
            found = away / abs(away), 0.0
        elif near.distance > height:
            found = past_circle(near.middle, near.radius + height) or (near.normal, 0.0)
        else:
            # no line at that height parts the joint from rock that comes nearer to it
            return None
        for step in range(STEPS):
            normal = 1j * found[0]
            point, bend = self._foremost(normal)
            point += away
            circle = past_circle(point + bend * normal, bend + height) if step < CIRCLES else None
            if circle is None:
                # past the point alone: from there on each is met sooner than the last one
                square = abs(point) ** 2
                if square <= height * height:
                    return None
                reach = math.sqrt(square - height * height)
                circle = point * complex(reach, -height) / square, reach
            before, found = found, circle
            if abs(found[0] - before[0]) < LAST_STEP:
                return found
        return None

    def entries(self, joint: complex, arm: float) -> list[complex]:
        away = self.centre - joint
        near = self._nearest(joint)
        if near is not None and near.distance > arm:
            return []
        way = None if near is None else into_circle(near.middle, near.radius, arm)
        # a point's circle that curves less than the ellipse may enter it twice
        if way is None or self._sharpest < arm:
            return self._crossings(away, arm)
        mean, uneven, rho = self._mean, self._uneven, self._rho
        for _ in range(CIRCLES):
            there = arm * way
            v = there - away
            w = mean * v.conjugate() + uneven * v
            inward = (w * there).imag
            if inward <= 0.0:
                break
            root = math.sqrt((w * v).real)
            step = (rho - root) * root / inward
            way *= complex(math.cos(step), -math.sin(step))
            if abs(step) < LAST_STEP:
                return [way]
        return self._crossings(away, arm)

    def _crossings(self, away: complex, arm: float) -> list[complex]:
        """Return all entries, in closed form."""
        spread = abs(self._uneven)
        axis = (spread / self._uneven) ** 0.5
        large, small = arm * (self._mean + spread), arm * (self._mean - spread)
        x, z = (axis.conjugate() * away).real, (axis.conjugate() * away).imag
        rest = (large * x * x + small * z * z) / arm - self._rho**2
        numbers = [arm * large, arm * small, -large * x, -small * z, rest]
        with np.errstate(invalid="ignore", divide="ignore"):
            angles, slopes = circle_crossings(*np.array(numbers)[:, None])
        return [
            axis * complex(math.cos(angle), math.sin(angle))
            for angle, slope in zip(angles.ravel().tolist(), slopes.ravel().tolist(), strict=True)
            if slope < 0.0 and not math.isnan(angle)
        ]

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        near = self._nearest(joint)
        if near is not None:
            start, end, height = face
            across = u * near.normal.conjugate()
            nearest = max(start * across.real, end * across.real) - height * across.imag
            if nearest < near.distance:
                yield near.normal
        way = to_face(self.centre - joint, u, face)
        length = abs(way)
        normal = way * u / length
        nearer = self._mean - (self._uneven * normal * normal).real
        if length * length > self._dual * nearer:
            yield normal

    def distance(self, point: complex) -> float:
        v = point - self.centre
        square = self._mean * abs(v) ** 2 + (self._uneven * v * v).real
        return self._size * (math.sqrt(square) - self._rho)
