"""How far segments are from each other."""

from __future__ import annotations

from typing import Final

import numpy as np

from hand_models.base import Array

__all__ = ["segment_distances"]

FLAT: Final = 1e-18
"""Square of a length, or of one times a sine, that counts as none [m², m⁴]."""


def segment_distances(first: Array, second: Array) -> Array:
    """Return the distances between segments, pair by pair, shape (n,) [m].

    Where the nearest points of both lines are within the segments they are it; otherwise one of
    them is an end, nearest to which the other is.

    Parameters
    ----------
    first, second : ndarray, shape (n, 2, 3)
        Their ends [m].
    """
    ends = np.concatenate(
        [
            _from_point(first[:, 0], second),
            _from_point(first[:, 1], second),
            _from_point(second[:, 0], first),
            _from_point(second[:, 1], first),
        ]
    )
    nearest = ends.reshape(4, -1).min(axis=0)
    u, v, w = first[:, 1] - first[:, 0], second[:, 1] - second[:, 0], first[:, 0] - second[:, 0]
    a, b, c, d, e = (
        np.einsum("nx,nx->n", *pair) for pair in ((u, u), (u, v), (v, v), (u, w), (v, w))
    )
    across = a * c - b * b
    safe = np.where(across > FLAT, across, 1.0)
    s, t = (b * e - c * d) / safe, (a * e - b * d) / safe
    inside = (across > FLAT) & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    between = np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)
    return np.asarray(np.where(inside, np.minimum(between, nearest), nearest))


def _from_point(points: Array, segments: Array) -> Array:
    """Return the distances of points (n, 3) from segments (n, 2, 3)."""
    along, to = segments[:, 1] - segments[:, 0], points - segments[:, 0]
    square = np.einsum("nx,nx->n", along, along)
    part = np.einsum("nx,nx->n", to, along) / np.where(square > FLAT, square, 1.0)
    off = to - np.clip(part, 0.0, 1.0)[:, None] * along
    return np.asarray(np.linalg.norm(off, axis=1))
