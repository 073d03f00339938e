"""Evenly spaced quantiles for Monte Carlo samples of several ranges, of low discrepancy.

u = (r + ½) / n with r = 0 … n − 1 the rank of the sample's term in an additive recurrence,

    x_kj = k φ⁻ʲ mod 1,    φ^(d+1) = φ + 1,    k = 1 … n samples,  j = 1 … d ranges,

whose normal scores are made uncorrelated, each range's with those before it (Iman and Conover,
1982): effects of two ranges are not mixed up.
"""

from __future__ import annotations

import numpy as np
import scipy

from hand_models.base import Array

__all__ = ["even_quantiles"]


def even_quantiles(count: int, ranges: int) -> Array:
    """Return evenly spaced quantiles for Monte Carlo samples of several ranges.

    Each range has every (r + ½) / count once; the module's text says in which order. No more than
    ``count`` − 1 ranges can be uncorrelated; with more, none are made so.

    Parameters
    ----------
    count, ranges : int
        Numbers of samples and of ranges.

    Returns
    -------
    ndarray, shape (count, ranges)
        In (0, 1).
    """
    ratio = 1.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (ranges + 1))
    terms = np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, ranges + 1)) % 1.0
    # ranks of scores that are not correlated have small correlations, and smaller ones again
    for _ in range(3 if count > ranges else 1):
        found = (terms.argsort(axis=0, kind="stable").argsort(axis=0) + 0.5) / count
        scores = scipy.special.ndtri(found)
        if count > ranges:
            factor = np.linalg.cholesky(scores.T @ scores)
            terms = scipy.linalg.solve_triangular(factor, scores.T, lower=True).T
    return np.asarray(found)
