"""Strength of single tiles as Weibull distributions about their mean, and the hazard of a slip.

A tile that carries the share u of its mean strength holds with the probability

    exp(−(u Γ(1 + 1/m))^m),

with the Weibull modulus m: the smaller, the more strengths scatter. Of independent tiles, none
slips with the probability exp(−H), where the hazard H is the sum of those exponents.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError

__all__ = ["hazards", "mean_factor", "weibull_modulus"]

SCATTER_RANGE: Final = (0.05, 0.9)
"""Least and largest ratio of standard deviation to mean: moduli of 25 and 1.1. A power of a larger
modulus is beyond a solver's digits, and with one below 1 the hazard is not convex."""


@lru_cache(maxsize=256)
def weibull_modulus(scatter_ratio: float) -> float:
    """Return the Weibull modulus m of strengths whose standard deviation over mean is given.

    Parameters
    ----------
    scatter_ratio : float
        √(Γ(1 + 2/m) / Γ(1 + 1/m)² − 1), in [0.05, 0.9].

    Raises
    ------
    InvalidInputError
        If the ratio is out of that range.
    """
    least, most = SCATTER_RANGE
    if not least <= scatter_ratio <= most:
        raise InvalidInputError(
            f"a standard deviation of {least:g} to {most:g} times the mean is needed, got "
            f"{scatter_ratio:g}"
        )
    wanted, low, high = math.log1p(scatter_ratio**2), 1.0, 32.0
    while high - low > 1e-12 * high:
        m = 0.5 * (low + high)
        found = math.lgamma(1.0 + 2.0 / m) - 2.0 * math.lgamma(1.0 + 1.0 / m)
        low, high = (m, high) if found > wanted else (low, m)
    return low


def mean_factor(modulus: ArrayLike) -> Array:
    """Return Γ(1 + 1/m): the mean strength over the Weibull distribution's scale."""
    given = np.asarray(modulus, dtype=float)
    found = [math.gamma(1.0 + 1.0 / m) for m in given.ravel().tolist()]
    return np.array(found).reshape(given.shape)


def hazards(uses: ArrayLike, modulus: ArrayLike) -> Array:
    """Return each tile's part of the hazard, (u Γ(1 + 1/m))^m; zero without a load.

    Parameters
    ----------
    uses : array_like
        u, load over mean strength.
    modulus : array_like
        m of each tile; the arguments broadcast.
    """
    return np.asarray((np.maximum(uses, 0.0) * mean_factor(modulus)) ** np.asarray(modulus))
