"""Envelopes of rock across a finger: what stands out first in strips side by side.

The rock in each strip is given by its outlines in the plane through the strip's middle. Seen along
t, into the rock, each strip begins at a height t over every s; the least of them is the envelope.
What an overhang hides has no envelope.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array

__all__ = ["Heights", "alike", "envelope_outlines", "overhangs"]


class Heights(NamedTuple):
    """Heights t at which the rock of k strips begins, over places along s.

    Attributes
    ----------
    s : ndarray, shape (g,)
        Ascending [m].
    t : ndarray, shape (k, g)
        Infinite where a strip has no rock [m].
    """

    s: Array
    t: Array

    @classmethod
    def of(cls, strips: Sequence[Sequence[Array]], spacing: float) -> Heights:
        """Return the heights of strips over all points of their outlines.

        Parameters
        ----------
        strips : sequence of sequence of ndarray, shape (n, 2)
            Outlines (s, t) of each strip, rock on their left [m].
        spacing : float
            Largest distance of neighbouring places [m].
        """
        points = np.concatenate([piece[:, 0] for strip in strips for piece in strip])
        between = np.arange(points.min(), points.max(), spacing)
        s = np.unique(np.concatenate([points, between]))
        s = s[np.diff(s, prepend=-np.inf) > BASE_TOLERANCES.rounding]
        t = np.array([_first(strip, s) for strip in strips])
        return cls(s, t)

    def least(self, chosen: slice = slice(None)) -> tuple[Array, Array]:
        """Return where the envelope of some strips has corners, and its t there, (m,) each [m].

        ``chosen``: strips that count; all by default. Where the envelope passes from one strip to
        another between two places, it has a corner.
        """
        t = self.t[chosen]
        first = t.argmin(axis=0)
        at = np.flatnonzero((first[1:] != first[:-1]) & np.isfinite(t.min(axis=0)[1:]))
        at = at[np.isfinite(t[first[at], at + 1]) & np.isfinite(t[first[at + 1], at])]
        here, there = first[at], first[at + 1]
        before = t[there, at] - t[here, at]
        after = t[here, at + 1] - t[there, at + 1]
        crossing = before + after > 0.0
        at, part = at[crossing], (before[crossing] / (before + after)[crossing])
        left, right = t[:, at], t[:, at + 1]
        with np.errstate(invalid="ignore"):
            between = np.where(part > 0.0, left + part * (right - left), left)
        between = np.where(np.isfinite(between), between, np.inf).min(axis=0)
        s = np.concatenate([self.s, self.s[at] + part * (self.s[at + 1] - self.s[at])])
        order = np.argsort(s, kind="stable")
        return s[order], np.concatenate([t.min(axis=0), between])[order]


def _first(pieces: Sequence[Array], at: Array) -> Array:
    """Return the least t of outlines over places along s; infinite without rock [m]."""
    least = np.full(len(at), np.inf)
    for piece in pieces:
        # what is seen along t runs forward, with the rock on its left
        back = np.flatnonzero(np.diff(piece[:, 0]) < 0.0)
        for run in np.split(np.arange(len(piece)), back + 1):
            s, t = piece[run].T
            if len(run) > 1 and s[-1] > s[0]:
                slack = BASE_TOLERANCES.length
                low, high = np.searchsorted(at, [s[0] - slack, s[-1] + slack])
                np.minimum(least[low:high], np.interp(at[low:high], s, t), out=least[low:high])
    return least


def alike(strips: Sequence[Sequence[Array]]) -> bool:
    """Return True if all strips have the same outlines, but for rounding."""
    first, *others = strips
    return all(
        len(strip) == len(first)
        and all(
            piece.shape == own.shape and np.abs(piece - own).max() <= BASE_TOLERANCES.length
            for piece, own in zip(strip, first, strict=True)
        )
        for strip in others
    )


def envelope_outlines(s: Array, t: Array) -> list[Array]:
    """Return the outlines (s, t) of an envelope (`Heights.least`), rock on their left [m]."""
    there = np.isfinite(t)
    ends = np.flatnonzero(there[1:] != there[:-1]) + 1
    return [
        np.column_stack([s[run], t[run]])
        for run in np.split(np.arange(len(s)), ends)
        if len(run) > 1 and there[run].all()
    ]


def overhangs(pieces: Sequence[Array], gap: float) -> bool:
    """Return True if an outline reaches back under what is seen by more than ``gap`` [m]."""
    return any(_hidden(piece, gap) for piece in pieces)


def _hidden(piece: Array, gap: float) -> bool:
    if (np.diff(piece[:, 0]) >= 0.0).all():
        return False
    under = piece[:, 1] > _first([piece], piece[:, 0]) + BASE_TOLERANCES.length
    edges = np.flatnonzero(np.diff(under.astype(np.int8), prepend=0, append=0))
    return any(
        float(np.ptp(piece[max(begin - 1, 0) : end + 1, 0])) > gap
        for begin, end in edges.reshape(-1, 2).tolist()
    )
