"""How deep places are in the rock of holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from hand_models.rock import Hold
from hand_models.sections import Swept

__all__ = ["bounded", "depth", "smooth_depths"]


def bounded(hold: Hold) -> bool:
    """Whether a hold's rock is known to end: a ball, a boulder or, across its axis, a log."""
    return hold.swept is not None and not hold.swept.sine


def depth(hold: Hold, point: Array) -> float:
    """Return how far above a point in a hold's frame, along −z of it, its rock ends [m].

    Negative outside: how far below it begins.
    """
    return -hold.entry(point, (0.0, 0.0, 1.0))


def smooth_depths(shapes: Sequence[Swept], points: Array) -> Array:
    """Return how deep points are in smooth holds, shape (k, n) [m].

    That is the distance from their surface, of an ellipsoid no more than that; negative outside.

    Parameters
    ----------
    shapes : sequence of Swept, length k
        Balls that are swept along faces (`hand_models.sections.Swept`).
    points : ndarray, shape (k, n, 3)
        In each hold's frame [m].
    """
    numbers = np.array(shapes)
    scales, (middle, radius, sine, cosine) = numbers[:, None, :3], numbers[:, 3:7].T[:, :, None]
    scaled = points * scales
    scaled[:, :, 2] -= scales[:, :, 2] * middle
    away = np.sqrt(np.einsum("knx,knx->kn", scaled, scaled))
    if sine.any():
        x, z = np.abs(scaled[:, :, 0]), scaled[:, :, 2]
        beside = (sine > 0.0) & (sine * x + cosine * z >= 0.0)
        away = np.where(beside, cosine * x - sine * z, away)
    return np.asarray((radius - away) / scales.max(axis=2))
