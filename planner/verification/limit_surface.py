"""The limit surface of tiles (Eq. 21 and what stands beside it), load by load, for the check.

The same surface as `Surface.strength`, written in the load itself instead of its direction: with a
the load in the tile's plane and r its size, cos φ = a / r and cos θ = T / a, so that

    f_s(φ) [1 − (1 − λ(φ)) cos φ (1 − cos θ)] = f_s(φ) [1 − (1 − λ(φ)) (a − T) / r].
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.tile import Surface
from planner.prepare import KEPT_NAMES

__all__ = ["LimitCurves"]

SMALL: Final = 1e-300
"""In place of a load that is zero, where something is divided by it [N]."""


class LimitCurves:
    """The limit surfaces of some tiles, each on its own rock.

    Parameters
    ----------
    surfaces : sequence of Surface
        Some of them, in any order.
    of_tile : ndarray of int, shape (n,)
        Which of them each tile has.
    shares : ndarray, shape (n,), optional
        Part of each tile's spines that are on the rock: that of a whole tile's strength; by default
        all.
    """

    def __init__(
        self, surfaces: Sequence[Surface], of_tile: Indices, shares: Array | None = None
    ) -> None:
        flat, loss, per_radian, gain = (
            numbers.take(of_tile, -1) for numbers in _numbers(tuple(surfaces))
        )
        if shares is not None:
            flat[0] *= shares
            loss[0] *= shares
        self._numbers = _Numbers(flat, loss, per_radian, gain)

    def excess(self, shear: Array, normal: Array, lateral: Array, relative: float) -> Array:
        """Return how far loads are beyond their surfaces, pressing ones in the tiles' planes [N].

        Parameters
        ----------
        shear, normal, lateral : ndarray, shape (n,)
            The last of either sign. Shear is not below zero but by rounding.
        relative : float
            Part of its strength by which a load may exceed it.

        Returns
        -------
        ndarray, shape (n,)
            Negative inside.
        """
        flat, loss, per_radian, gain = self._numbers
        along = np.hypot(shear, lateral)
        pull = np.minimum(normal, 0.0)
        # pressed, a tile holds what it does in its own plane, and more by the gain
        size = np.hypot(along, pull)
        ratio = np.minimum(np.arctan2(pull, along) * per_radian, 1.0)
        straight, aside = flat - loss * ratio
        strength = straight * (1.0 - aside * ((along - shear) / (size + SMALL)))
        return np.asarray(size - gain * (normal - pull) - (1.0 + relative) * strength)


class _Numbers(NamedTuple):
    """The numbers of some surfaces.

    Attributes
    ----------
    flat, loss : ndarray, shape (2, n)
        f_s, and 1 − λ: at φ = 0, and what they lose up to φ_max.
    per_radian : ndarray, shape (n,)
        −1 / φ_max.
    gain : ndarray, shape (n,)
        γ.
    """

    flat: Array
    loss: Array
    per_radian: Array
    gain: Array


@lru_cache(maxsize=KEPT_NAMES)
def _numbers(surfaces: tuple[Surface, ...]) -> _Numbers:
    flat, loss = np.zeros((2, 2, len(surfaces)))
    for i, surface in enumerate(surfaces):
        share = surface.lateral_limit / surface.shear_limit
        flat[:, i] = surface.shear_limit, 1.0 - share
        loss[:, i] = (
            surface.shear_limit - surface.pull_off_limit,
            share * (surface.lateral_pull_off_ratio - 1.0),
        )
    return _Numbers(
        flat,
        loss,
        np.array([-1.0 / surface.pull_off_angle for surface in surfaces]),
        np.array([surface.compression_gain for surface in surfaces]),
    )
