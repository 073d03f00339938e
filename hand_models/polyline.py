"""Rock in a finger's plane whose surface is a chain of short straight pieces.

Its boundary is one or more polylines, open or closed, that have the rock on their left (turning
from s toward t), convex or not. A face that turns about a joint at the distance h above it meets
such rock first either

(a) at a vertex of the boundary: a vertex at the distance ρ and bearing β from the joint is on the
    face at ``a = √(ρ² − h²)`` along it, when the phalanx stands at ``θ = β − atan2(h, a)``; or
(b) with one of its ends, whose circle about the joint cuts a piece of the boundary.

The first of all these angles is where the face comes to rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.frames import Array
from hand_models.sections import Rest, Section, Vector2

__all__ = ["PolylineSection"]

FLAT: Final = 5e-7
"""Rock within this of a face that rests on it counts as touched [m]."""

FITTED: Final = 2e-3
"""How far on both sides of a contact the rock is fitted with a parabola to place it [m]."""

ROUNDING: Final = 1e-12
"""By how much an angle may fall short of a bound [rad]."""

FACE_SAMPLES: Final = 17
"""Points of a face at which its distance from the rock is taken."""


class _Meeting(NamedTuple):
    """Where a face first meets a boundary.

    Attributes
    ----------
    angle : float
        Of the phalanx, or infinity [rad].
    vertex : int
        That it meets, or the one after the place that its end meets.
    end : float or None
        Where along the phalanx that end is [m].
    """

    angle: float
    vertex: int
    end: float | None


class PolylineSection(Section):
    """Rock on the left of polylines.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n, 2)
        Points (s, t) in order, each unlike the one before it; a closed piece ends where it begins.
        Where an open one ends, rock ends: nothing is touched beyond [m].
    faceted : bool, optional
        Whether the points are corners of the rock, not places on a smooth curve, so that what rests
        on a corner touches there and not at the lowest place of a fit.
    """

    def __init__(self, pieces: Sequence[Array], *, faceted: bool = False) -> None:
        self.pieces = tuple(pieces)
        self._faceted = faceted
        self._points = np.concatenate(pieces)
        ends = np.cumsum([len(piece) for piece in pieces])
        self._pieces = list(zip([0, *ends[:-1].tolist()], ends.tolist(), strict=True))
        self._vertex = np.delete(np.arange(len(self._points)), ends - 1)
        self._start = np.concatenate([piece[:-1] for piece in pieces])
        self._step = np.concatenate([np.diff(piece, axis=0) for piece in pieces])
        self._square = np.einsum("ij,ij->i", self._step, self._step)
        self._middle = self._start + 0.5 * self._step
        self._half = 0.5 * np.sqrt(self._square)
        right = np.column_stack([self._step[:, 1], -self._step[:, 0]])
        self._outward = right / np.sqrt(self._square)[:, None]
        self._corner_out, self._corner_in = self._corners()

    def _corners(self) -> tuple[Array, Array]:
        """Return the outward normals at both ends of each segment; zero where an open one ends."""
        first = np.zeros_like(self._outward)
        last = np.zeros_like(self._outward)
        begin = 0
        for piece in self.pieces:
            normals = self._outward[begin : begin + len(piece) - 1]
            between = normals[:-1] + normals[1:]
            first[begin + 1 : begin + len(normals)] = between
            last[begin : begin + len(normals) - 1] = between
            if np.array_equal(piece[0], piece[-1]):
                first[begin] = last[begin + len(normals) - 1] = normals[0] + normals[-1]
            begin += len(normals)
        return first, last

    # What settling asks -------------------------------------------------------------------------

    def rest(
        self, joint: Vector2, start: float, end: float, height: float, low: float, high: float
    ) -> Rest | None:
        met = min(
            self._circle(joint, start, height, low),
            self._circle(joint, end, height, low),
            self._vertices(joint, start, end, height, low),
            key=lambda meeting: meeting.angle,
        )
        if met.angle > high:
            return None
        return self._contact(joint, start, end, height, met)

    def touch(
        self, joint: Vector2, along: float, height: float, low: float, high: float
    ) -> float | None:
        met = self._circle(joint, along, height, low)
        return met.angle if met.angle <= high else None

    def clearance(self, point: Vector2) -> float:
        return float(self.clearances(np.array([point]))[0])

    def face_clearance(
        self, joint: Vector2, start: float, end: float, height: float, angle: float
    ) -> float:
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        # the boundary in the face's own coordinates
        away = (self._start - np.asarray(joint)) @ turn - np.array([0.0, height])
        step = self._step @ turn
        after = away + step
        across = np.flatnonzero((away[:, 1] < 0.0) != (after[:, 1] < 0.0))
        part = away[across, 1] / (away[across, 1] - after[across, 1])
        crossing = away[across, 0] + part * step[across, 0]
        cuts = bool(((crossing >= start) & (crossing <= end)).any())
        face = np.linspace(start, end, FACE_SAMPLES if cuts else 2)
        own = self.clearances(
            np.asarray(joint) + np.column_stack([face, np.full(len(face), height)]) @ turn.T
        )
        if cuts or own.min() <= 0.0:
            return float(own.min())
        beside = away[:, 0] - np.clip(away[:, 0], start, end)
        return min(float(own.min()), math.sqrt(float((beside**2 + away[:, 1] ** 2).min())))

    def normal(self, point: Vector2) -> Vector2:
        s, t = self._outward[int(self._nearest(np.array([point]))[0][0])]
        return float(s), float(t)

    # Distances ----------------------------------------------------------------------------------

    def _nearest(self, points: Array) -> tuple[Array, Array, Array]:
        """Return the nearest segment to each point, where on it in [0, 1], and the way from it."""
        # a segment is at least as far as its middle, less half its length
        middle = np.hypot(points[:, :1] - self._middle[:, 0], points[:, 1:] - self._middle[:, 1])
        farthest = (middle + self._half).min(axis=1)
        few = np.flatnonzero((middle - self._half <= farthest[:, None]).any(axis=0))
        step = self._step[few]
        away = points[:, None, :] - self._start[few]
        part = np.clip(np.einsum("nki,ki->nk", away, step) / self._square[few], 0.0, 1.0)
        away -= part[..., None] * step
        index = np.einsum("nki,nki->nk", away, away).argmin(axis=1)
        row = np.arange(len(points))
        return few[index], part[row, index], away[row, index]

    def clearances(self, points: Array) -> Array:
        """Return the distances of points (n, 2) from the rock, negative inside [m]."""
        index, part, away = self._nearest(points)
        normal = self._outward[index]
        normal = np.where((part <= 0.0)[:, None], self._corner_out[index], normal)
        normal = np.where((part >= 1.0)[:, None], self._corner_in[index], normal)
        side = np.einsum("ni,ni->n", away, normal)
        length = np.hypot(away[:, 0], away[:, 1])
        return np.asarray(np.where(side < 0.0, -length, length))

    def highest(self, low: float, high: float) -> float | None:
        """Return the least t of the rock between two values of s; None if there is none [m]."""
        least = math.inf
        for piece in self.pieces:
            s, t = piece[:, 0], piece[:, 1]
            least = min(least, float(t[(s >= low) & (s <= high)].min(initial=math.inf)))
            for bound in (low, high):
                crossing = np.flatnonzero((s[:-1] < bound) != (s[1:] < bound))
                part = (bound - s[crossing]) / (s[crossing + 1] - s[crossing])
                there = t[crossing] + part * (t[crossing + 1] - t[crossing])
                least = min(least, float(there.min(initial=math.inf)))
        return least if math.isfinite(least) else None

    # First contact ------------------------------------------------------------------------------

    def _vertices(
        self, joint: Vector2, start: float, end: float, height: float, low: float
    ) -> _Meeting:
        """Return where from ``low`` on a vertex is first on the face."""
        x, y = self._points[:, 0] - joint[0], self._points[:, 1] - joint[1]
        square = x * x + y * y - height * height
        reached = np.flatnonzero((square >= 0.0) & (square <= max(start * start, end * end)))
        x, y, root = x[reached], y[reached], np.sqrt(square[reached])
        bearing = np.arctan2(y, x)
        first = _Meeting(math.inf, 0, None)
        for along in (root, -root) if start < 0.0 else (root,):
            on = np.flatnonzero((along >= start) & (along <= end))
            angle, i = _first(bearing[on] - np.arctan2(height, along[on]), low)
            if angle < first.angle:
                first = _Meeting(angle, int(reached[on[i]]), None)
        return first

    def _circle(self, joint: Vector2, along: float, height: float, low: float) -> _Meeting:
        """Return where from ``low`` on a point of a face is first on the boundary."""
        x, y = self._start[:, 0] - joint[0], self._start[:, 1] - joint[1]
        b = x * self._step[:, 0] + y * self._step[:, 1]
        root = b * b - self._square * (x * x + y * y - (along * along + height * height))
        cut = np.flatnonzero(root >= 0.0)
        b, square, root = b[cut], self._square[cut], np.sqrt(root[cut])
        part = np.concatenate([-b - root, root - b]) / np.concatenate([square, square])
        cut = np.concatenate([cut, cut])
        on = (part >= 0.0) & (part <= 1.0)
        cut, part = cut[on], part[on]
        place_x = x[cut] + part * self._step[cut, 0]
        place_y = y[cut] + part * self._step[cut, 1]
        angle, i = _first(np.arctan2(place_y, place_x) - math.atan2(height, along), low)
        if math.isinf(angle):
            return _Meeting(angle, 0, None)
        return _Meeting(angle, int(self._vertex[cut[i]]) + 1, along)

    def _contact(
        self, joint: Vector2, start: float, end: float, height: float, met: _Meeting
    ) -> Rest:
        """Return where along a face that rests at an angle it touches.

        That is the lowest point of a parabola fitted to the rock near the place that it meets (the
        place itself, of facets), or the middle of the stretch that touches if that is longer.
        """
        u, v = math.cos(met.angle), math.sin(met.angle)
        first, last = next((a, b) for a, b in self._pieces if met.vertex < b)
        x, y = (self._points[first:last, i] - joint[i] for i in range(2))
        along, gap, i = x * u + y * v, y * u - x * v - height, met.vertex - first
        if met.end is not None:
            along = np.concatenate([along[:i], [met.end], along[i:]])
            gap = np.concatenate([gap[:i], [0.0], gap[i:]])
        near, far = (
            _reach(along[::way], gap[::way], j, start, end)
            for way, j in ((-1, len(gap) - 1 - i), (1, i))
        )
        near, far = min(near, far), max(near, far)
        if near <= start and far >= end:
            return Rest(met.angle, 0.5 * (start + end), flat=True)
        if met.end is not None and far - near < FITTED:
            return Rest(met.angle, met.end)
        short = far - near < 2.0 * FITTED
        if short:
            place = float(along[i]) if self._faceted else _lowest(along, gap, i)
        else:
            place = 0.5 * (near + far)
        return Rest(met.angle, min(max(place, start), end))


def _first(angles: Array, low: float) -> tuple[float, int]:
    """Return the least of some angles, each turned to lie from ``low`` on, and which it is."""
    if not len(angles):
        return math.inf, 0
    turned = (angles - low + ROUNDING) % math.tau
    i = int(turned.argmin())
    return low + max(float(turned[i]) - ROUNDING, 0.0), i


def _reach(along: Array, gap: Array, i: int, start: float, end: float) -> float:
    """Return how far from vertex i on a boundary stays within `FLAT` of a face, and before it."""
    level = float(gap[i]) + FLAT
    apart = (gap[i:] > level) | (along[i:] < start) | (along[i:] > end)
    apart[0] = False
    j = i + int(apart.argmax())
    if j == i:
        return float(along[-1])
    rise = float(gap[j] - gap[j - 1])
    part = min(max((level - float(gap[j - 1])) / rise, 0.0), 1.0) if rise > 0.0 else 1.0
    return min(max(float(along[j - 1] + part * (along[j] - along[j - 1])), start), end)


def _lowest(along: Array, gap: Array, i: int) -> float:
    """Return where the parabola fitted to the rock near vertex i is lowest."""
    here = float(along[i])
    apart = np.abs(along - here) > FITTED
    before, after = apart[:i][::-1], apart[i:]
    first = i - int(before.argmax()) if before.any() else 0
    last = i + int(after.argmax()) if after.any() else len(along)
    if last - first < 3:
        return here
    moments = np.vander((along[first:last] - here) / FITTED, 3)
    bend, slope, _ = np.linalg.solve(moments.T @ moments, moments.T @ gap[first:last])
    return here + FITTED * float(np.clip(-0.5 * slope / bend, -1.0, 1.0)) if bend > 0.0 else here
