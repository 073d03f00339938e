"""How much of a spine tile is on rock that stands off its face."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array

__all__ = ["engaged_share"]

LEAST: Final = 1e-6
"""Share that counts as none: far less than one spine, and too little to divide loads by."""


def engaged_share(gap: ArrayLike, travel: float) -> Array:
    """Return what share of a tile's spines are on the rock, φ = 1 − gap / travel in [0, 1].

    Spines slide out of their tile by up to their travel; the farther they have to, the fewer find
    an asperity that is near enough. All are on the rock where the tile itself is; a millionth of
    them counts as none.

    Parameters
    ----------
    gap : array_like
        From the tile's face to the rock, infinite where there is none [m].
    travel : float
        How far spines reach, ``spine_travel`` of ``hand.toml`` [m].

    Returns
    -------
    ndarray
        The shape of ``gap``.
    """
    off = np.asarray(gap, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(off > 0.0, np.minimum(1.0 - off / travel, 1.0), 1.0)
    return np.where(share > LEAST, share, 0.0)
