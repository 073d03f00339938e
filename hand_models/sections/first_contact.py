"""First contact of turning faces with a boundary of short segments, for many faces at once.

A face that turns about a joint at the distance h above it meets such rock first either

(a) at a vertex of the boundary: a vertex at the distance ρ and bearing β from the joint is on the
    face at ``a = √(ρ² − h²)`` along it, when the phalanx is at the angle ``θ = β − atan2(h, a)``;
(b) or with one of its ends, whose circle about the joint cuts a segment of the boundary.

The face comes to rest at the first of all these angles. It touches at the lowest point of a
parabola fitted to the rock near that contact (at the contact itself, of facets), or in the middle
of the stretch that touches if that is longer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.sections.boundary import Boundary, Window, stretch_minima
from hand_models.sections.section import Complexes, Face, Flags
from hand_models.sections.settings import SECTION_SETTINGS

__all__ = ["TurningFaces"]

FACE_PARTS: Final = np.linspace(0.0, 1.0, 17)[:, None]
"""Places along a face, as shares of its length, at which its distance from the rock is computed."""


Meetings = tuple[Array, Indices]
"""First contact of n faces, or of their ends, with a boundary, shape (n,) each: the angle by
which the phalanx turns until then, infinite without contact [rad]; and the index of the vertex, or
of the vertex after an end's contact.
"""


class TurningFaces:
    """Faces that turn over a boundary about n joints, starting at one angle.

    Parameters
    ----------
    boundary : Boundary
    joint : ndarray of complex, shape (n,)
        Joints about which the faces turn [m].
    face : Face
    low : float
        Angle of the phalanges at the start [rad].
    """

    def __init__(self, boundary: Boundary, joint: Complexes, face: Face, low: float) -> None:
        self._boundary, self._joint, self._face, self._low = boundary, joint, face, low
        self._ends = np.array([complex(along, face.height) for along in face[:2]])
        self._window = boundary.window(joint, float(np.abs(self._ends).max()))
        self._s = self._window.vertices.real - joint.real[:, None]
        self._t = self._window.vertices.imag - joint.imag[:, None]
        self._square = self._s * self._s + self._t * self._t
        # along the phalanges where they begin, and above them
        self._along, self._above = _turned(self._s, self._t, np.array([low]))

    def clearances(self) -> Array:
        """Return the distance of each face from the rock at the start, shape (n,) [m].

        Negative where a face cuts the rock; for other faces the distance of the nearer end.
        """
        start, end = self._face[:2]
        along, gap = self._along, self._above - self._face.height
        cuts = np.zeros(len(along), dtype=bool)
        if along.size:
            below = gap < 0.0
            row, first = ((below[:, :-1] != below[:, 1:]) & self._window.goes_on[:-1]).nonzero()
            part = gap[row, first] / (gap[row, first] - gap[row, first + 1])
            crossing = along[row, first]
            crossing = crossing + part * (along[row, first + 1] - crossing)
            cuts[row[(crossing >= start) & (crossing <= end)]] = True
        points = self._joint + self._ends[:, None] * np.exp(1j * self._low)
        clear = self._boundary.clearances(points).min(axis=0)
        cut = cuts.nonzero()[0]
        if len(cut):
            points = points[0, cut] + FACE_PARTS * (points[1, cut] - points[0, cut])
            clear[cut] = self._boundary.clearances(points).min(axis=0)
        return np.asarray(clear)

    def contacts(self, high: float, faceted: bool) -> tuple[Array, Array, Flags]:
        """Return the first contact of each face with the rock.

        Parameters
        ----------
        high : float
            Angle up to which the phalanges turn [rad].
        faceted : bool
            True if vertices are corners of the rock, False if they are places on a smooth curve.

        Returns
        -------
        angle, distance : ndarray, shape (n,)
            Angle of the phalanx [rad], and distance of the contact along it [m]; NaN without
            contact.
        flat : ndarray of bool, shape (n,)
            True where the face lies flat.
        """
        count = len(self._joint)
        angle, distance = np.full((2, count), np.nan)
        flat = np.zeros(count, dtype=bool)
        if not self._square.size:
            return angle, distance, flat
        # with one of their ends, or a vertex on them
        meetings = zip(self._with_ends(), self._on_face(), strict=True)
        turns, vertices = (np.concatenate(each).reshape(3, -1) for each in meetings)
        which, rows = turns.argmin(axis=0), np.arange(count)
        turn = turns[which, rows]
        met = (self._low + turn <= high).nonzero()[0]
        angle[met] = self._low + turn[met]
        if len(met):
            distance[met], flat[met] = self._touching(
                met, angle[met], vertices[which, rows][met], which[met], faceted
            )
        return angle, distance, flat

    def _with_ends(self) -> Meetings:
        """Return where both ends of faces are first on the boundary, shape (2 n,)."""
        window, shape = self._window, self._square.shape
        arm, phase = np.abs(self._ends), np.angle(self._ends)
        # a segment that an end meets begins no farther from its circle than it is long
        least, most = np.maximum(arm - window.longest, 0.0) ** 2, (arm + window.longest) ** 2
        near = (self._square >= least[:, None, None]) & (self._square <= most[:, None, None])
        row, first = (near.reshape(-1, shape[1]) & window.goes_on).nonzero()
        place = row % shape[0] * shape[1] + first
        x, y = self._along.ravel()[place], self._above.ravel()[place]
        d_x, d_y = self._along.ravel()[place + 1] - x, self._above.ravel()[place + 1] - y
        square, which = self._square.ravel()[place], row // shape[0]
        arm, phase = arm[which], phase[which]
        long, b = d_x * d_x + d_y * d_y, x * d_x + y * d_y
        root = np.sqrt(b * b - long * (square - arm * arm))
        part = np.stack([-b - root, root - b], axis=1) / long[:, None]
        cut, side = ((part >= 0.0) & (part <= 1.0)).nonzero()
        part, row, phase = part[cut, side], row[cut], phase[cut]
        x, y = x[cut] + part * d_x[cut], y[cut] + part * d_y[cut]
        u, v = np.cos(phase), np.sin(phase)
        return _first(2 * shape[0], row, x * u + y * v, y * u - x * v, first[cut] + 1)

    def _on_face(self) -> Meetings:
        """Return where a vertex is first on a face."""
        start, end, h, _ = self._face
        slack = 1e-12  # [m²] for rounding, vertices beside the face are looked at as well
        nearest, farthest = start * start + h * h - slack, end * end + h * h + slack
        near = (self._square >= nearest) & (self._square <= farthest)
        row, vertex = near.nonzero()
        place = row * near.shape[1] + vertex
        x, y = self._along.ravel()[place], self._above.ravel()[place]
        along = np.sqrt(self._square.ravel()[place] - h * h)
        on = ((along >= start) & (along <= end)).nonzero()[0]
        row, x, y, along = row[on], x[on], y[on], along[on]
        return _first(len(near), row, x * along + y * h, y * along - x * h, vertex[on])

    def _touching(
        self, met: Indices, angle: Array, vertex: Indices, which: Indices, faceted: bool
    ) -> tuple[Array, Flags]:
        """Return where along faces that rest at angles they touch, and whether they lie flat.

        Each met a vertex, or with one of its ends (``which`` of them) a place before it.
        """
        rows = np.arange(len(met))
        start, end, height, _ = self._face
        along, gap = _turned(self._s[met], self._t[met], angle)
        gap -= height
        by_end = which < 2
        here = np.where(by_end, np.where(which == 0, start, end), along[rows, vertex])
        level = np.where(by_end, 0.0, gap[rows, vertex])
        sides = _Sides.of(self._window, vertex, by_end)
        # how far the rock stays at the face on both sides, the last step of it taken as straight
        limit = level + 5e-7  # [m] so near rock counts as touched
        apart = (gap > limit[:, None]) | (along < start) | (along > end)
        reaches = []
        for out, inner, own, ends in sides.stretches(apart):
            near = np.where(own, here, along[rows, inner])
            low, high = np.where(own, level, gap[rows, inner]), gap[rows, out]
            part = np.minimum(np.maximum((limit - low) / (high - low), 0.0), 1.0)
            reach = near + np.where(high > low, part, 1.0) * (along[rows, out] - near)
            reach = np.minimum(np.maximum(reach, start), end)
            reaches.append(np.where(ends, near, reach))
        near, far = np.minimum(*reaches), np.maximum(*reaches)
        fitted = SECTION_SETTINGS.fitted_length
        flat, short = (near <= start) & (far >= end), far - near < 2.0 * fitted
        place = np.where(short, here, 0.5 * (near + far))
        if not faceted:
            few = (short & ~flat & ~(by_end & (far - near < fitted))).nonzero()[0]
            place[few] = _lowest(sides.take(few), along[few], gap[few], here[few], by_end[few])
        return np.minimum(np.maximum(place, start), end), flat


def _first(count: int, row: Indices, x: Array, y: Array, vertex: Indices) -> Meetings:
    """Return the first of some directions (x, y) in each row, from where phalanges begin."""
    turn, first = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    if not len(row):
        return turn, first
    begin = np.append(0, np.diff(row).nonzero()[0] + 1)
    # grows with the angle, from 0 to 4 in a turn
    quarter = 1.0 - x / np.maximum(np.abs(x) + np.abs(y), np.finfo(float).tiny)
    rounding = BASE_TOLERANCES.rounding  # [rad] an angle may fall short of the bound by it
    at = stretch_minima(np.where(y < -rounding * x, 4.0 - quarter, quarter), begin)
    row = row[at]
    angle = (np.arctan2(y[at], x[at]) + rounding) % math.tau
    turn[row] = np.maximum(angle - rounding, 0.0)
    first[row] = vertex[at]
    return turn, first


def _turned(s: Array, t: Array, angle: Array) -> tuple[Array, Array]:
    """Return the components of vectors (n, v) along directions at angles, and across them."""
    u, v = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return s * u + t * v, t * u - s * v


class _Sides(NamedTuple):
    """Vertices on both sides of places on a boundary, shape (n,) each.

    Attributes
    ----------
    before, after : ndarray of int
        Next to the place.
    first, last : ndarray of int
        Up to which the boundary goes on.
    """

    before: Indices
    after: Indices
    first: Indices
    last: Indices

    @classmethod
    def of(cls, window: Window, vertex: Indices, between: Flags) -> _Sides:
        """Return those of vertices, or of places between vertices and the ones before them."""
        return cls(vertex - 1, vertex + ~between, window.first[vertex], window.last[vertex])

    def take(self, rows: Indices) -> _Sides:
        return _Sides(*(value[rows] for value in self))

    def nearest(self, apart: Flags) -> tuple[Indices, Indices]:
        """Return the nearest vertices apart, of (n, v), on both sides.

        Where there are none, the ones that would follow the ends of the boundary.
        """
        column = np.arange(apart.shape[1])
        before = np.where(apart & (column <= self.before[:, None]), column, -1).max(axis=1)
        after = np.where(apart & (column >= self.after[:, None]), column, len(column)).min(axis=1)
        return np.maximum(before, self.first - 1), np.minimum(after, self.last + 1)

    def stretches(self, apart: Flags) -> Iterator[tuple[Indices, Indices, Flags, Flags]]:
        """Yield of both sides the nearest vertex apart, and the one before it.

        And whether that is the place itself, and whether the boundary ends first.
        """
        before, after = self.nearest(apart)
        ends = before < self.first
        yield np.where(ends, 0, before), before + 1, before == self.before, ends
        ends = after > self.last
        yield np.where(ends, 0, after), after - 1, after == self.after, ends


def _lowest(sides: _Sides, along: Array, gap: Array, here: Array, by_end: Flags) -> Array:
    """Return where parabolas fitted to the rock near places on it are lowest."""
    fitted = SECTION_SETTINGS.fitted_length
    low, high = sides.nearest(np.abs(along - here[:, None]) > fitted)
    count = high - low - 1
    row = np.repeat(np.arange(len(here)), count)
    column = np.arange(len(row)) + np.repeat(low + 1 - (np.cumsum(count) - count), count)
    t, g = (along[row, column] - here[row]) / fitted, gap[row, column]
    # the place itself, at zero, counts too where it is no vertex
    square = t * t
    s_0, s_1, s_2, s_3, s_4, g_0, g_1, g_2 = (
        np.bincount(row, each, len(here))
        for each in (None, t, square, t * square, square * square, g, g * t, g * square)
    )
    s_0 = s_0 + by_end
    # bend and slope of the normal equations, by Cramer's rule, but for their determinant, above 0
    c_0, c_1, c_2 = s_2 * s_0 - s_1 * s_1, s_1 * s_2 - s_3 * s_0, s_3 * s_1 - s_2 * s_2
    bend = g_2 * c_0 + g_1 * c_1 + g_0 * c_2
    slope = g_2 * c_1 + g_1 * (s_4 * s_0 - s_2 * s_2) + g_0 * (s_3 * s_2 - s_4 * s_1)
    way = np.minimum(np.maximum(-0.5 * slope / bend, -1.0), 1.0)
    return np.where((bend > 0.0) & (s_0 >= 3.0), here + fitted * way, here)
