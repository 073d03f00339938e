"""Directions of a tile's load in boxes, and the largest value of a function over them, bounded.

A direction is seen from the side at ω and out of the finger plane by η,

    d = (cos η cos ω, cos η sin ω, sin η),    sin φ = cos η sin ω,

so that the trigonometric factors of a box each lie between their values at two of its corners. A
function that is bounded in each box is bounded over all of them: those boxes are divided whose
bound is above what was found by more than is allowed for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hand_models.base import Array

__all__ = ["DirectionBoxes", "bounded"]


class DirectionBoxes(NamedTuple):
    """Directions seen from the side at ω and out of the finger plane by η, in n boxes of them.

    Attributes
    ----------
    first, last : ndarray, shape (n,)
        Bounds of ω [rad].
    near, far : ndarray, shape (n,)
        Bounds of η [rad].
    """

    first: Array
    last: Array
    near: Array
    far: Array

    @classmethod
    def over(cls, sides: tuple[float, float], turns: tuple[float, float]) -> DirectionBoxes:
        """Return boxes that fill two ranges, of ω and of η; either may be one value."""
        wide = [low < high for low, high in (sides, turns)]
        # side by side, to begin with; of rectangles the square root of it along each side
        count = round(256 ** (1.0 / sum(wide)))
        ends = [
            np.linspace(*pair, count + 1) if each else np.array(pair)
            for pair, each in zip((sides, turns), wide, strict=True)
        ]
        lows, highs = (
            [part.ravel() for part in np.meshgrid(*(each[cut] for each in ends))]
            for cut in (slice(-1), slice(1, None))
        )
        return cls(lows[0], highs[0], lows[1], highs[1])

    @property
    def flat(self) -> Array:
        """The least φ in each box [rad]."""
        return _steepness(self.first, self.far)

    @property
    def steep(self) -> Array:
        """The largest φ in each box [rad]."""
        return _steepness(self.last, self.near)

    def line(self, a: float, b: float) -> tuple[Array, Array]:
        """Return the least and the largest ``a cos ω + b sin ω``, where it is positive."""
        ends = [a * np.cos(side) + b * np.sin(side) for side in (self.first, self.last)]
        top = math.atan2(b, a)
        within = (self.first < top) & (top < self.last)
        return np.minimum(*ends), np.where(within, math.hypot(a, b), np.maximum(*ends))

    def aside(self) -> tuple[Array, Array]:
        """Return the least and the largest cos φ (1 − cos θ) / sin η, which is at most 1."""
        least = np.sin(self.near) / (np.cos(self.flat) + np.cos(self.near) * np.cos(self.first))
        with np.errstate(divide="ignore", invalid="ignore"):
            most = np.sin(self.far) / (np.cos(self.steep) + np.cos(self.far) * np.cos(self.last))
        return least, np.fmin(most, 1.0)

    def divided(self, count: int) -> DirectionBoxes:
        """Return so many parts of each box, across its longer side."""
        flat = self.last - self.first > self.far - self.near
        w, e = (
            low + np.where(along, high - low, 0.0) * np.arange(count + 1)[:, None] / count
            for low, high, along in (
                (self.first, self.last, flat),
                (self.near, self.far, ~flat),
            )
        )
        last, far = np.where(flat, w[1:], self.last), np.where(flat, self.far, e[1:])
        parts = w[:-1], last, e[:-1], far
        return DirectionBoxes(*(np.broadcast_to(part, far.shape).ravel() for part in parts))


def _steepness(side: Array, turn: Array) -> Array:
    """Return φ at ω and η; exact near π/2 as well, where its sine hardly changes."""
    along = np.hypot(np.cos(turn) * np.cos(side), np.sin(turn))
    return np.asarray(np.arctan2(np.cos(turn) * np.sin(side), along))


def bounded(bound: Callable[[DirectionBoxes], Array], boxes: DirectionBoxes, most: float) -> float:
    """Return what no value of a function over boxes is larger than: ``most``, or more if need be.

    Parameters
    ----------
    bound : callable
        Not less than any value in each box, and the nearer to them the smaller it is.
    boxes : DirectionBoxes
    most : float
        What the values are thought not to be larger than, by a margin.
    """
    parts, most_boxes = 8, 20_000
    # what is still open after 24 divisions is bounded all the same
    for _ in range(24):
        upper = bound(boxes)
        left = upper > most
        if not left.any():
            return most
        if parts * left.sum() > most_boxes:
            break
        boxes = DirectionBoxes(*np.array(boxes)[:, left]).divided(parts)
    return float(upper.max())
