"""Polylines that bound the rock in a finger's plane: nearest segments, distances.

A boundary is one or more polylines, open or closed, that have the rock on their left (turning from
s toward t), convex or not. Places are complex numbers s + i t [m].
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from hand_models.base import Array, Indices
from hand_models.sections.section import Complexes

__all__ = ["Boundary", "stretch_minima", "strung"]


class Boundary:
    """Polylines with rock on their left, prepared for searches.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n, 2)
        Points (s, t) in order, each different from the one before it; a closed piece ends where it
        begins. Rock ends where an open piece ends [m].
    """

    def __init__(self, pieces: Sequence[Array]) -> None:
        self._places, self._ends = strung(pieces)
        self._vertices: Complexes = self._places.view(complex)[:, 0]
        self._starts = np.delete(np.arange(len(self._places)), self._ends - 1)
        self._step = self._vertices[self._starts + 1] - self._vertices[self._starts]

    @cached_property
    def _outward(self) -> Complexes:
        """Normals out of the rock at the start, in the middle and at the end of segments, (3, s).

        Zero at the ends where rock ends.
        """
        middle = -1j * self._step / np.abs(self._step)
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

    @cached_property
    def runs(self) -> tuple[Array, Indices, Indices]:
        """Vertices (n, 2) [m], and indices (n,) of the first and last of each one's polyline."""
        lengths = np.diff(self._ends, prepend=0)
        bounds = self._ends - lengths, self._ends - 1
        first, last = np.repeat(bounds, lengths, axis=1)
        return self._places, first, last

    def nearest(self, points: Complexes) -> tuple[Indices, Array, Complexes]:
        """Return the nearest segment to each of n points s + i t [m].

        Returns
        -------
        segment : ndarray of int, shape (n,)
            Index of the segment, counted through all polylines.
        part : ndarray, shape (n,)
            Place nearest to the point as a share of the segment's length, in [0, 1].
        away : ndarray of complex, shape (n,)
            Vector s + i t from that place to the point [m].
        """
        from hand_models.sections.compiled_polylines import nearest_segments

        places = np.ascontiguousarray(points).view(float).reshape(-1, 2)
        segment, part, away = nearest_segments(self._places, self._ends, places)
        return segment, part, away.view(complex)[:, 0]

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


def strung(pieces: Sequence[Array]) -> tuple[Array, Indices]:
    """Join the points of polylines to one array, (n, 2), with the index at which each ends."""
    return np.ascontiguousarray(np.concatenate(pieces)), np.cumsum([len(each) for each in pieces])


def stretch_minima(values: Array, first: Indices) -> Indices:
    """Return the index of the least value in each of several runs of an array.

    Parameters
    ----------
    values : ndarray, shape (n,)
        k runs of values, one after another.
    first : ndarray of int, shape (k,)
        Index at which each run begins; the first is 0.

    Returns
    -------
    ndarray of int, shape (k,)
        Indices into ``values``.
    """
    least = np.minimum.reduceat(values, first)
    lengths = np.diff(first, append=len(values))
    at = (values == np.repeat(least, lengths)).nonzero()[0]
    chosen = np.searchsorted(at, first)
    return np.asarray(at[chosen])
