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

__all__ = ["Boundary", "strung"]


class Boundary:
    """Polylines with rock on their left, prepared for searches.

    Parameters
    ----------
    pieces : sequence of ndarray, shape (n, 2)
        Points (s, t) in order, each different from the one before it; a closed piece ends where it
        begins. Rock ends where an open piece ends [m].

    Attributes
    ----------
    places : ndarray, shape (n, 2)
        Points of the pieces, one after another [m].
    ends : ndarray of int
        Index at which each piece ends.
    """

    def __init__(self, pieces: Sequence[Array]) -> None:
        self.places, self.ends = strung(pieces)

    @cached_property
    def runs(self) -> tuple[Array, Indices, Indices]:
        """Vertices (n, 2) [m], and indices (n,) of the first and last of each one's polyline."""
        lengths = np.diff(self.ends, prepend=0)
        bounds = self.ends - lengths, self.ends - 1
        first, last = np.repeat(bounds, lengths, axis=1)
        return self.places, first, last

    @cached_property
    def blocks(self) -> tuple[Indices, Array, Array]:
        """Neighbouring segments in blocks, and what bounds them, of `segment_blocks`."""
        from hand_models.sections.compiled_polylines import segment_blocks

        return segment_blocks(self.places, self.ends)

    def clearances(self, points: Complexes) -> Array:
        """Return the signed distance of each point s + i t from the rock [m].

        Negative inside the rock; of the same shape as the points.
        """
        from hand_models.sections.compiled_polylines import signed_distances

        places = np.ascontiguousarray(points).view(float).reshape(-1, 2)
        return signed_distances(self.places, self.ends, self.blocks, places).reshape(points.shape)

    def normal(self, point: complex) -> complex:
        """Return the unit normal, out of the rock, of the segment nearest a point."""
        from hand_models.sections.compiled_polylines import nearest_segments

        at, _, _ = nearest_segments(self.places, self.blocks, np.array([[point.real, point.imag]]))
        (s, t), after = self.places[at[0] : at[0] + 2]
        step = complex(*after) - complex(s, t)
        return -1j * step / abs(step)


def strung(pieces: Sequence[Array]) -> tuple[Array, Indices]:
    """Join the points of polylines to one array, (n, 2), with the index at which each ends."""
    whole = pieces[0] if len(pieces) == 1 else np.concatenate(pieces)
    return np.ascontiguousarray(whole), np.cumsum([len(each) for each in pieces])
