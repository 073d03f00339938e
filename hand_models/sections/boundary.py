"""Polylines that bound the rock in a finger's plane: nearest segments, distances, windows.

A boundary is one or more polylines, open or closed, that have the rock on their left (turning from
s toward t), convex or not. Places are complex numbers s + i t [m].
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, Indices
from hand_models.sections.section import Complexes, Flags

__all__ = ["Boundary", "Window", "stretch_minima"]


class Window(NamedTuple):
    """The part of a boundary near some places, as runs of consecutive vertices.

    Attributes
    ----------
    vertices : ndarray of complex, shape (v,)
        Places of the vertices, run by run [m].
    first, last : ndarray of int, shape (v,)
        Indices of the first and the last vertex of each vertex's run.
    goes_on : ndarray of bool, shape (v,)
        True where a segment leads from the vertex to the next one.
    longest : float
        Upper bound of the segments' lengths [m].
    """

    vertices: Complexes
    first: Indices
    last: Indices
    goes_on: Flags
    longest: float


class Boundary:
    """Polylines with rock on their left, prepared for searches.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n, 2)
        Points (s, t) in order, each different from the one before it; a closed piece ends where it
        begins. Rock ends where an open piece ends [m].
    """

    def __init__(self, pieces: Sequence[Array]) -> None:
        points = np.concatenate(pieces)
        self._vertices: Complexes = points[:, 0] + 1j * points[:, 1]
        self._ends = np.cumsum([len(piece) for piece in pieces])
        self._starts = np.delete(np.arange(len(points)), self._ends - 1)
        self._is_end = np.zeros(len(points), dtype=bool)
        self._is_end[self._ends - 1] = True
        self._start = self._vertices[self._starts]
        self._step = self._vertices[self._starts + 1] - self._start
        self._half = 0.5 * np.abs(self._step)
        self._middle = self._start + 0.5 * self._step

    @cached_property
    def _outward(self) -> Complexes:
        """Normals out of the rock at the start, in the middle and at the end of segments, (3, s).

        Zero at the ends where rock ends.
        """
        middle = -0.5j * self._step / self._half
        first, last = np.zeros((2, len(middle)), dtype=complex)
        begin = 0
        for end in (self._ends - np.arange(1, len(self._ends) + 1)).tolist():
            between = middle[begin : end - 1] + middle[begin + 1 : end]
            first[begin + 1 : end] = last[begin : end - 1] = between
            ends = self._starts[begin], self._starts[end - 1] + 1
            if self._vertices[ends[0]] == self._vertices[ends[1]]:
                first[begin] = last[end - 1] = middle[begin] + middle[end - 1]
            begin = end
        return np.stack([first, middle, last])

    def window(self, places: Complexes, reach: float) -> Window:
        """Return the part of the boundary near places, to search less of it.

        Parameters
        ----------
        places : ndarray of complex
            s + i t [m].
        reach : float
            All of the boundary within this distance of a place is in the window, and some more [m].
        """
        centre, spread = _middle(places)
        near = np.abs(self._middle - centre) <= reach + spread + self._half
        kept = np.zeros(len(self._vertices), dtype=bool)
        starts = self._starts[near]
        kept[starts] = kept[starts + 1] = True
        vertices = kept.nonzero()[0]
        # a run ends where the next vertex is left out, or belongs to another piece
        broken = self._is_end[vertices]
        broken[:-1] |= np.diff(vertices) != 1
        broken[-1:] = True
        ends = broken.nonzero()[0]
        begins = np.append(0, ends + 1)[:-1]
        first, last = np.repeat([begins, ends], ends + 1 - begins, axis=1)
        longest = 2.0 * float(self._half[near].max(initial=0.0)) + BASE_TOLERANCES.length
        return Window(self._vertices[vertices], first, last, ~broken, longest)

    def nearest(self, points: Complexes) -> tuple[Indices, Array, Complexes]:
        """Return the nearest segment to each of n points.

        Returns
        -------
        segment : ndarray of int, shape (n,)
        part : ndarray, shape (n,)
            Place nearest to the point as a share of the segment's length, in [0, 1].
        away : ndarray of complex, shape (n,)
            Vector from that place to the point [m].
        """
        points = points.ravel()
        # a segment is at least as far as its middle, less half its length
        centre, spread = _middle(points)
        far = np.abs(self._middle - centre)
        few = (far - self._half <= (far + self._half).min() + 2.0 * spread).nonzero()[0]
        middle, longest = self._middle[few], float(self._half[few].max())
        s, t = points.real[:, None] - middle.real, points.imag[:, None] - middle.imag
        square = s * s + t * t
        # for rounding, segments a little beside the nearest are looked at as well
        least = (np.sqrt(square.min(axis=1)) + 2.0 * longest + BASE_TOLERANCES.length) ** 2
        row, segment = (square <= least[:, None]).nonzero()
        segment = few[segment]
        away, step = points[row] - self._start[segment], self._step[segment]
        part = (away * step.conj()).real / (step * step.conj()).real
        part = np.minimum(np.maximum(part, 0.0), 1.0)
        away -= part * step
        first = np.append(0, np.diff(row).nonzero()[0] + 1)
        at = stretch_minima(away.real**2 + away.imag**2, first)
        return segment[at], part[at], away[at]

    def clearances(self, points: Complexes) -> Array:
        """Return the signed distance of each point s + i t from the rock [m].

        Negative inside the rock; of the same shape as the points.
        """
        segment, part, away = self.nearest(points)
        normal = self._outward[np.where(part <= 0.0, 0, np.where(part >= 1.0, 2, 1)), segment]
        distance = np.abs(away)
        inside = (away * normal.conj()).real < 0.0
        return np.where(inside, -distance, distance).reshape(points.shape)

    def normal(self, point: complex) -> complex:
        """Return the unit normal, out of the rock, of the segment nearest a point."""
        segment, _, _ = self.nearest(np.array([point]))
        return complex(self._outward[1, segment[0]])


def _middle(places: Complexes) -> tuple[complex, float]:
    """Return a place amid others, and how far they are from it at most."""
    centre = complex(places.mean())
    return centre, float(np.abs(places - centre).max())


def stretch_minima(values: Array, first: Indices) -> Indices:
    """Return the index of the least value in each of several stretches of an array.

    Parameters
    ----------
    values : ndarray, shape (n,)
    first : ndarray of int, shape (k,)
        Index at which each stretch begins; the first is 0.

    Returns
    -------
    ndarray of int, shape (k,)
    """
    least = np.minimum.reduceat(values, first)
    lengths = np.diff(first, append=len(values))
    at = (values == np.repeat(least, lengths)).nonzero()[0]
    chosen = np.searchsorted(at, first)
    return np.asarray(at[chosen])
