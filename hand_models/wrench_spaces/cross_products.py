"""Generalised cross products: the vectors orthogonal to r − 1 of a few vectors in r dimensions.

Many choices of r − 1 vectors begin alike. Minors are expanded along the last vector of a choice, so
those of a common beginning are computed once.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices

__all__ = ["Expansion", "cross_products", "expansion"]


class _Level(NamedTuple):
    """From the minors of one vector fewer to those of some beginnings of choices.

    Attributes
    ----------
    beginning, last : ndarray of int, shapes (n,), (n,)
        Of each: which one of one vector fewer it goes on from, and with which vector.
    entries, minors : ndarray of int, shapes (c, p), (c, p)
        For each of the c sets of p coordinates: entries of the last vector, counted r on where
        their sign is minus, and the minors that they are multiplied by.
    """

    beginning: Indices
    last: Indices
    entries: Indices
    minors: Indices


Expansion = tuple[_Level, ...]
"""How the cross products of some choices are expanded, vector by vector."""


def expansion(choices: Indices, r: int) -> Expansion:
    """Return how the cross products of choices of vectors are expanded.

    Parameters
    ----------
    choices : ndarray of int, shape (n, r − 1)
        Into the vectors, r ≥ 2.
    r : int
        Dimension.
    """
    levels = []
    of_choice = np.zeros(len(choices), dtype=np.intp)
    for size in range(1, r):
        first = np.arange(len(choices))
        beginnings = first
        if size < r - 1:
            _, first, beginnings = np.unique(
                choices[:, :size], axis=0, return_index=True, return_inverse=True
            )
        levels.append(_Level(of_choice[first], choices[first, size - 1], *_entries(r, size)))
        of_choice = beginnings.reshape(-1)
    return tuple(levels)


def _entries(r: int, size: int) -> tuple[Indices, Indices]:
    """Return `_Level.entries` and `_Level.minors` for minors of that size."""
    before = {columns: k for k, columns in enumerate(itertools.combinations(range(r), size - 1))}
    entries, minors = [], []
    for columns in itertools.combinations(range(r), size):
        minus = [(size - 1 + place) % 2 for place in range(size)]
        entries.append([j + r * sign for j, sign in zip(columns, minus, strict=True)])
        minors.append([before[columns[:k] + columns[k + 1 :]] for k in range(size)])
    return np.array(entries, dtype=np.intp), np.array(minors, dtype=np.intp)


def cross_products(vectors: Array, expansion: Expansion) -> Array:
    """Return the vectors orthogonal to each choice, as long as the volume that it spans.

    Parameters
    ----------
    vectors : ndarray, shape (k, r)
    expansion : Expansion
        Of the choices, for that r.

    Returns
    -------
    ndarray, shape (n, r)
    """
    signed = np.vstack([vectors.T, -vectors.T])
    minors = np.ones((1, 1))
    for level in expansion:
        entries = signed[:, level.last][level.entries]
        minors = np.einsum("cpn,cpn->cn", entries, minors[:, level.beginning][level.minors])
    # minors leave out the coordinates from the last to the first
    normals = minors[::-1].T.copy()
    normals[:, 1::2] *= -1.0
    return normals
