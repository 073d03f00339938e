"""Few knots of a path: between neighbours it stays near the straight line."""

from __future__ import annotations

import numpy as np

from hand_models.base import Array, Indices

__all__ = ["deviations", "few_knots"]


def few_knots(at: Array, values: Array, tolerance: Array) -> Indices:
    """Return the indices of few knots of a path, the first and the last among them.

    Greedy: each knot is the farthest from the one before it to which the straight line stays
    within the tolerance of the path.

    Parameters
    ----------
    at : ndarray, shape (n,)
        Path parameter, strictly increasing.
    values : ndarray, shape (n, m)
    tolerance : ndarray, shape (m,)
        Largest distance from the straight line, by component.

    Returns
    -------
    ndarray of int, shape (k,)
    """
    chosen, last = [0], len(at) - 1
    while chosen[-1] < last:
        here = chosen[-1]
        reach = np.arange(here + 1, last + 1)
        # slopes from here that keep all points between within the tolerance
        ahead = (at[reach] - at[here])[:, None]
        low = np.maximum.accumulate((values[reach] - tolerance - values[here]) / ahead)
        high = np.minimum.accumulate((values[reach] + tolerance - values[here]) / ahead)
        slope = (values[reach] - values[here]) / ahead
        fits = ((slope >= low) & (slope <= high)).all(axis=1)
        chosen.append(int(reach[fits][-1]))
    return np.array(chosen)


def deviations(at: Array, values: Array, knots: Indices) -> Array:
    """Return how far a path is from straight lines between knots, shape (k − 1, m).

    Parameters
    ----------
    at, values : ndarray
        The path, as of `few_knots`.
    knots : ndarray of int, shape (k,)
    """
    line = np.column_stack([np.interp(at, at[knots], each[knots]) for each in values.T])
    return np.maximum.reduceat(np.abs(values - line), knots[:-1])
