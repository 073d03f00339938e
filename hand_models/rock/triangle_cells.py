"""Triangles by the cells of a grid that they are in, so that what is far away is not looked at."""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.rock.triangles import Triangles

__all__ = ["TriangleCells"]

SIDE: Final = 0.03
"""Of a cell; what is found does not depend on it [m]."""


class TriangleCells:
    """Triangles, found again by where they are.

    Parameters
    ----------
    triangles : Triangles
    """

    def __init__(self, triangles: Triangles) -> None:
        corners = triangles.vertices[triangles.faces]
        low, high = corners.min(axis=1), corners.max(axis=1)
        where = np.floor(0.5 * (low + high) / SIDE).astype(np.intp)
        where -= where.min(axis=0)
        name = np.ravel_multi_index(tuple(where.T), tuple(where.max(axis=0) + 1))
        self._order = np.argsort(name, kind="stable")
        begins = np.flatnonzero(np.diff(name[self._order], prepend=-1))
        self._begins, self._ends = begins, np.append(begins[1:], len(name))
        low = np.minimum.reduceat(low[self._order], begins)
        high = np.maximum.reduceat(high[self._order], begins)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)

    def within(self, axes: Array, low: Array, high: Array) -> Indices:
        """Return, in order, triangles among which are all that reach into a box.

        Parameters
        ----------
        axes : ndarray, shape (k, 3)
            Unit vectors.
        low, high : ndarray, shape (k,)
            Of the box along these; without end in other directions [m].
        """
        middle, half = self._middle @ axes.T, self._half @ np.abs(axes).T
        # rounding must not leave one out
        half += 1e-9
        cells = np.flatnonzero(((middle - half <= high) & (middle + half >= low)).all(axis=1))
        parts = [self._order[self._begins[i] : self._ends[i]] for i in cells.tolist()]
        return np.sort(np.concatenate(parts)) if parts else np.zeros(0, dtype=np.intp)
