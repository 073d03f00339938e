"""Sections that are ellipses: oblique cuts of a log, and cuts of a boulder.

About a centre c an ellipse is the preimage of a disc,

    abs(A v + B v̄) ≤ ρ,   v = q − c,

whose square is ``G(v) = m |v|² + Re(κ v²)``, with ``m = |A|² + |B|²`` and κ = 2 A B̄. Contacts are
found by iteration over circles fitted to the ellipse: at the point foremost in the direction n,
with the support h = √(n·En) and E = ρ² G⁻¹, the ellipse has the radius of curvature det E / h³.
From one circle to the next the error is squared.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array
from hand_models.sections.section import Complexes, Face
from hand_models.sections.settings import SECTION_SETTINGS
from hand_models.sections.smooth import (
    SmoothSection,
    Tangent,
    into_circle,
    past_circle,
    to_face,
)

__all__ = ["Ellipse", "arc", "radii", "rock_left"]


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


class Ellipse(SmoothSection):
    """An ellipse of rock: points q = s + i t with ``|A v + B v̄| ≤ ρ``, where v = q − c.

    Parameters
    ----------
    centre : complex
        c [m].
    linear : tuple of complex
        A and B, which map the ellipse to a disc.
    rho : float
        ρ, radius of that disc.
    size : float
        Factor by which a distance from that disc becomes an approximate one from the ellipse.
    """

    def __init__(
        self, centre: complex, linear: tuple[complex, complex], rho: float, size: float
    ) -> None:
        self.centre, self._linear, self._rho, self._size = centre, linear, rho, size
        A, B = linear
        first, second = abs(A) ** 2, abs(B) ** 2
        self._mean, self._uneven = first + second, 2.0 * A * B.conjugate()
        self._dual = (rho / (first - second)) ** 2
        self._bend = rho**2 * self._dual
        # its least radius
        self._sharpest = rho * abs(abs(A) - abs(B)) / (abs(A) + abs(B)) ** 2
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
        for _ in range(SECTION_SETTINGS.most_circles):
            point, bend = self._foremost(normal)
            place = away + point
            middle = place + bend * normal
            before, normal = normal, middle / abs(middle)
            # a distance changes with the square of the direction [rad]
            if abs(normal - before) < 1e-5:
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
        for step in range(60):  # points in turn, where circles do not lead on
            normal = 1j * found[0]
            point, bend = self._foremost(normal)
            point += away
            circle = None
            if step < SECTION_SETTINGS.most_circles:
                circle = past_circle(point + bend * normal, bend + height)
            if circle is None:
                # past the point alone: from there on each is met sooner than the last one
                square = abs(point) ** 2
                if square <= height * height:
                    return None
                reach = math.sqrt(square - height * height)
                circle = point * complex(reach, -height) / square, reach
            before, found = found, circle
            if abs(found[0] - before[0]) < SECTION_SETTINGS.last_turn:
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
        for _ in range(SECTION_SETTINGS.most_circles):
            there = arm * way
            v = there - away
            w = mean * v.conjugate() + uneven * v
            inward = (w * there).imag
            if inward <= 0.0:
                break
            root = math.sqrt((w * v).real)
            step = (rho - root) * root / inward
            way *= complex(math.cos(step), -math.sin(step))
            if abs(step) < SECTION_SETTINGS.last_turn:
                return [way]
        return self._crossings(away, arm)

    def _crossings(self, away: complex, arm: float) -> list[complex]:
        """Return all entries: where a conic crosses the unit circle, inward.

        In G's own axes a place of the circle is e = exp(iφ) from the joint, and G − ρ² a polynomial
        of fourth degree in e over e².
        """
        spread = abs(self._uneven)
        axis = (spread / self._uneven) ** 0.5 if spread else 1.0
        large, small = arm * (self._mean + spread), arm * (self._mean - spread)
        x, z = (axis.conjugate() * away).real, (axis.conjugate() * away).imag
        rest = (large * x * x + small * z * z) / arm - self._rho**2
        A, B, D, E = arm * large, arm * small, -large * x, -small * z
        ends, beside = 0.25 * (A - B), complex(D, -E)
        middle = 0.5 * (A + B) + rest
        e = np.roots([ends, beside, middle, beside.conjugate(), ends])
        off = 1e-3  # from the unit circle, as far as rounding may have moved a root
        angles = np.angle(e[np.abs(np.abs(e) - 1.0) < off])
        for _ in range(3):  # steps of Newton's method
            f, slope = _conic(A, B, D, E, rest, angles)
            angles = angles - np.clip(f / slope, -off, off)
        f, slope = _conic(A, B, D, E, rest, angles)
        rounding = 0.1 * BASE_TOLERANCES.rounding
        crosses = (np.abs(f) <= rounding * (A + abs(D) + abs(E) + abs(rest))) & (slope < 0.0)
        return [axis * complex(math.cos(t), math.sin(t)) for t in angles[crosses].tolist()]

    def partings(self, joint: complex, u: complex, face: Face) -> Iterator[complex]:
        near = self._nearest(joint)
        if near is not None:
            start, end, height = face[:3]
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
        A, B = self._linear
        return self._size * (abs(A * v + B * v.conjugate()) - self._rho)

    def outline(self, reach: float, spacing: float) -> Sequence[Complexes]:
        axes = radii(self._linear, self._rho)
        return [rock_left(arc(self.centre, axes, math.pi, reach, spacing), axes)]


def arc(
    centre: complex, axes: tuple[complex, complex], most: float, reach: float, spacing: float
) -> Complexes:
    """Return points centre + e₁ sin φ − e₂ cos φ of an ellipse, dense where they are within reach.

    Parameters
    ----------
    centre : complex
        Centre s + i t [m].
    axes : tuple of complex
        Half-diameters e₁ and e₂ [m].
    most : float
        φ goes from −most to most [rad].
    reach : float
        Distance from the origin within which points are dense [m].
    spacing : float
        Approximate distance of neighbouring points there [m].

    Returns
    -------
    ndarray of complex
        Points s + i t, φ ascending [m].
    """

    def places(turns: Array) -> Complexes:
        return np.asarray(centre + axes[0] * np.sin(turns) - axes[1] * np.cos(turns))

    # 256 parts, of which those near a finger are looked at closely
    turns = np.linspace(-most, most, 257)
    rough = places(turns)
    steps = np.abs(np.diff(rough))
    near = np.abs(rough[:-1]) <= reach + steps
    parts = np.where(near, np.ceil(steps / spacing), 1.0).clip(1.0)
    at = np.append(0.0, np.cumsum(parts))
    return places(np.interp(np.arange(at[-1] + 1.0), at, turns))


def radii(linear: tuple[complex, complex], rho: float) -> tuple[complex, complex]:
    """Return two conjugate half-diameters of the ellipse ``|A v + B v̄| = ρ``, as complex numbers.

    Parameters
    ----------
    linear : tuple of complex
        A and B of the ellipse (see `Ellipse`).
    rho : float
        ρ of the ellipse.

    Returns
    -------
    tuple of complex
        Vectors v from the centre for which A v + B v̄ is ρ, and iρ [m].
    """
    A, B = linear
    part = rho / (abs(A) ** 2 - abs(B) ** 2)
    return part * (A.conjugate() - B), 1j * part * (A.conjugate() + B)


def rock_left(places: Complexes, axes: tuple[complex, complex]) -> Complexes:
    """Return points of an ellipse in the order in which the ellipse is on their left.

    Parameters
    ----------
    places : ndarray of complex
        Result of `arc`.
    axes : tuple of complex
        Half-diameters e₁ and e₂ that the arc was made with.
    """
    return places if (axes[0].conjugate() * axes[1]).imag > 0.0 else places[::-1]


def _conic(A: float, B: float, D: float, E: float, F: float, angles: Array) -> tuple[Array, Array]:
    """Return A x² + B y² + 2 D x + 2 E y + F at angles on the unit circle, and its slope."""
    x, y = np.cos(angles), np.sin(angles)
    slope = 2.0 * ((B * y + E) * x - (A * x + D) * y)
    return (A * x + 2.0 * D) * x + (B * y + 2.0 * E) * y + F, slope
