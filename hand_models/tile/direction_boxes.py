"""Boxes of load directions, and a bound on the largest value of a function over them.

A direction of a tile's load is given by two angles: ω, seen from the side in the finger's plane
(from shear toward pull-off), and η, out of that plane,

    d = (cos η cos ω, cos η sin ω, sin η),    sin φ = cos η sin ω,

with φ the angle from the tile's plane toward pull-off, so that each trigonometric factor of a box
lies between its values at two of the box's corners. A function that is bounded in each box is
bounded over all of them. Branch and bound: boxes are divided whose bound is larger than allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hand_models.base import Array

__all__ = ["DirectionBoxes", "bounded"]


class DirectionBoxes(NamedTuple):
    """n boxes of load directions, each a range of ω (in the finger's plane) and of η (out of it).

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
        """Return boxes that fill a range of ω and a range of η, 256 in all.

        Parameters
        ----------
        sides, turns : tuple of float
            Least and largest ω, and least and largest η [rad]; one of the two ranges may be one
            value.
        """
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
        """Least φ (angle from the tile's plane toward pull-off) in each box, shape (n,) [rad]."""
        return _steepness(self.first, self.far)

    @property
    def steep(self) -> Array:
        """Largest φ (angle from the tile's plane toward pull-off) in each box, shape (n,) [rad]."""
        return _steepness(self.last, self.near)

    def line(self, a: float, b: float) -> tuple[Array, Array]:
        """Return bounds of ``a cos ω + b sin ω`` in each box, valid where this is positive.

        Parameters
        ----------
        a, b : float
            Coefficients of shear and pull-off, seen from the side.

        Returns
        -------
        least, largest : ndarray, shape (n,)
        """
        ends = [a * np.cos(side) + b * np.sin(side) for side in (self.first, self.last)]
        top = math.atan2(b, a)
        within = (self.first < top) & (top < self.last)
        return np.minimum(*ends), np.where(within, math.hypot(a, b), np.maximum(*ends))

    def aside(self) -> tuple[Array, Array]:
        """Return bounds of cos φ (1 − cos θ) / sin η in each box, at most 1.

        φ: angle from the tile's plane toward pull-off; θ: azimuth in that plane, from the drag to
        the side.

        Returns
        -------
        least, largest : ndarray, shape (n,)
        """
        least = np.sin(self.near) / (np.cos(self.flat) + np.cos(self.near) * np.cos(self.first))
        with np.errstate(divide="ignore", invalid="ignore"):
            most = np.sin(self.far) / (np.cos(self.steep) + np.cos(self.far) * np.cos(self.last))
        return least, np.fmin(most, 1.0)

    def divided(self, count: int) -> DirectionBoxes:
        """Return ``count`` parts of each box, divided along its longer side."""
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
    """Return an upper bound of a function over boxes by branch and bound.

    Parameters
    ----------
    bound : callable
        Returns for each box a number that the function does not exceed in it; the smaller the box,
        the closer the number is.
    boxes : DirectionBoxes
    most : float
        Proposed bound, a little above the function's values: boxes whose number exceeds it are
        divided.

    Returns
    -------
    float
        ``most`` if no box exceeds it, else the larger bound that was proved.
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
