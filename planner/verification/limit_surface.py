"""The limits of tiles, for the check: the plan's half-planes, and Eq. 21 itself, load by load.

The same surface as `Surface.strength`, written in the load itself instead of its direction: with a
the load in the tile's plane and r its size, cos φ = a / r and cos θ = T / a, so that

    f_s(φ) [1 − (1 − λ(φ)) cos φ (1 − cos θ)] = f_s(φ) [1 − (1 − λ(φ)) (a − T) / r].
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.tile import HalfPlane, Surface
from planner.prepare import KEPT, TileIndex

__all__ = ["LimitCurves", "planes_of"]

SMALL: Final = 1e-300
"""In place of a load that is zero, where something is divided by it [N]."""


@lru_cache(maxsize=KEPT)
def planes_of(pieces: tuple[tuple[HalfPlane, ...], ...], places: TileIndex) -> Array:
    """Return hands' half-planes over their capacities, of each tile if all its spines hold.

    Shape (T, 2 p, 3), for lateral loads of either sign; zero where a hand has fewer than others.
    """
    most = max(map(len, pieces))
    tables = [
        [
            (p.a_shear / p.capacity, p.a_normal / p.capacity, side * p.a_lateral / p.capacity)
            for side in (1.0, -1.0)
            for p in own
        ]
        + [(0.0, 0.0, 0.0)] * 2 * (most - len(own))
        for own in pieces
    ]
    return np.array(tables).take(places.hand, 0)


class LimitCurves:
    """The limit surfaces of some tiles, each on its own rock.

    Parameters
    ----------
    surfaces : sequence of Surface
        Some of them, in any order.
    of_tile : ndarray of int, shape (n,)
        Which of them each tile has.
    shares : ndarray, shape (n,) or ()
        Part of each tile's spines that are on the rock: that of a whole tile's strength.
    """

    def __init__(self, surfaces: Sequence[Surface], of_tile: Indices, shares: Array) -> None:
        numbers = [_numbers(surface) for surface in surfaces]
        of_each = np.array(numbers).T.take(of_tile, 1)
        of_each[[0, 2]] *= shares
        # f_s, and 1 − λ: at φ = 0, and what they lose up to φ_max; −1 / φ_max; γ
        self._flat, self._loss, (self._per_radian, self._gain) = np.split(of_each, [2, 4])

    def excess(self, shear: Array, normal: Array, lateral: Array, relative: float) -> Array:
        """Return how far loads are beyond their surfaces, pressing ones in the tiles' planes [N].

        Parameters
        ----------
        shear, normal, lateral : ndarray, shape (n,)
            The last of either sign. Shear below zero is Coulomb friction's, not the spines'.
        relative : float
            Part of its strength by which a load may exceed it.

        Returns
        -------
        ndarray, shape (n,)
            Negative inside.
        """
        shear = np.maximum(shear, 0.0)
        along = np.hypot(shear, lateral)
        pull = np.minimum(normal, 0.0)
        # pressed, a tile holds what it does in its own plane, and more by the gain
        size = np.hypot(along, pull)
        ratio = np.minimum(np.arctan2(pull, along) * self._per_radian, 1.0)
        straight, aside = self._flat - self._loss * ratio
        strength = straight * (1.0 - aside * ((along - shear) / (size + SMALL)))
        return np.asarray(size - self._gain * (normal - pull) - (1.0 + relative) * strength)


def _numbers(surface: Surface) -> tuple[float, ...]:
    """Return f_s and 1 − λ at φ = 0, what they lose up to φ_max, −1 / φ_max, γ."""
    share = surface.lateral_limit / surface.shear_limit
    return (
        surface.shear_limit,
        1.0 - share,
        surface.shear_limit - surface.pull_off_limit,
        share * (surface.lateral_pull_off_ratio - 1.0),
        -1.0 / surface.pull_off_angle,
        surface.compression_gain,
    )
