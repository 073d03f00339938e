"""Half-spaces of a zonotope { o + G x : lower ≤ x ≤ upper } in closed form.

Every facet is spanned by r − 1 independent generators, r the set's dimension, and its normal is
their cross product. Several choices of generators may span the same facet: then the same generators
lie in it, and by these it is known. Its offset is the support function along the normal, so that no
half-space cuts the set, however little its generators differ from dependent ones.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, InvalidInputError, UnsupportedError
from hand_models.wrench_spaces.cross_products import Expansion, cross_products, expansion
from hand_models.wrench_spaces.half_spaces import Facets, HalfSpaces, affine_hull, lifted
from hand_models.wrench_spaces.polytopes import TOLERANCE

__all__ = ["facets", "half_spaces"]

MOST_CHOICES: Final = 250_000
"""Choices of generators that are looked through: of 32 in 6 dimensions there are 201376."""

DEPENDENT: Final = 1e-8
"""Unit vectors that span no more volume than this count as dependent."""

CERTAIN: Final = 1e-6
"""Volume of unit vectors below which rounding of their cross product shows."""


def half_spaces(
    generators: ArrayLike, lower: ArrayLike, upper: ArrayLike, origin: ArrayLike | None = None
) -> HalfSpaces:
    """Return the set { o + G x : lower ≤ x ≤ upper } as inequalities and, where flat, equations.

    Dimension, lengths and angles are judged in the units that are given: where these differ much,
    scale first (`WrenchSpace.half_spaces` does).

    Parameters
    ----------
    generators : array_like, shape (d, n)
        G.
    lower, upper : array_like, shape (n,)
    origin : array_like, shape (d,), optional
        o; zero by default.

    Returns
    -------
    HalfSpaces
        With normals of unit length; each facet once.

    Raises
    ------
    InvalidInputError
        If shapes differ, a number is not finite or a lower bound is above its upper one.
    UnsupportedError
        If there are too many choices of generators.
    """
    G, low, high = (np.asarray(each, dtype=float) for each in (generators, lower, upper))
    if G.ndim != 2:
        raise InvalidInputError(f"shape (d, n) is needed, got {G.shape}", field="generators")
    d, n = G.shape
    o = np.zeros(d) if origin is None else np.asarray(origin, dtype=float)
    for name, each, shape in (
        ("generators", G, (d, n)),
        ("lower", low, (n,)),
        ("upper", high, (n,)),
        ("origin", o, (d,)),
    ):
        if each.shape != shape:
            raise InvalidInputError(f"shape {shape} is needed, got {each.shape}", field=name)
        if not np.isfinite(each).all():
            raise InvalidInputError("every number must be finite", field=name)
    if (low > high).any():
        k = int(np.argmax(low > high))
        raise InvalidInputError(
            f"must not be above upper ({high[k]:g}), got {low[k]:g}", field=f"lower[{k}]"
        )
    edges = (G * (high - low)).T
    directions, reach = affine_hull(edges)
    return lifted(facets(edges @ directions.T / reach), directions, reach, o + G @ low)


def facets(edges: Array) -> Facets:
    """Return the facets of the sum of segments from zero to each edge, which span R^r.

    Parameters
    ----------
    edges : ndarray, shape (n, r)

    Raises
    ------
    UnsupportedError
        If there are too many choices of edges.
    """
    lengths = np.linalg.norm(edges, axis=1)
    edges = edges[lengths > TOLERANCE * lengths.max(initial=0.0)]
    n, r = edges.shape
    if r == 0:
        return Facets(np.zeros((0, 0)), np.zeros(0))
    if r == 1:
        normals = np.ones((1, 1))
    else:
        choices = math.comb(n, r - 1)
        if choices > MOST_CHOICES:
            raise UnsupportedError(
                f"{choices} choices of {r - 1} of {n} generators are too many (at most "
                f"{MOST_CHOICES})"
            )
        normals = _normals(edges, _choices(n, r))
    slopes = normals @ edges.T
    up = np.maximum(slopes, 0.0).sum(axis=1)
    down = up - slopes.sum(axis=1)
    return Facets(np.vstack([normals, -normals]), np.concatenate([up, down]))


def _normals(edges: Array, choices: Expansion) -> Array:
    """Return one unit normal (k, r) of each pair of opposite facets, r ≥ 2."""
    units = edges / np.linalg.norm(edges, axis=1)[:, None]
    normals = cross_products(units, choices)
    volumes = np.sqrt(np.einsum("nr,nr->n", normals, normals))
    # the roundest choice first: of those that span the same facet it is taken
    order = np.argsort(-volumes, kind="stable")
    order = order[volumes[order] > DEPENDENT]
    volumes = volumes[order]
    normals = normals[order] / volumes[:, None]
    slack = TOLERANCE * np.maximum(1.0, CERTAIN / volumes)
    inside = np.abs(normals @ units.T) <= slack[:, None]
    words = np.zeros((len(order), 8 * math.ceil(len(edges) / 64)), dtype=np.uint8)
    packed = np.packbits(inside, axis=1)
    words[:, : packed.shape[1]] = packed
    keys = words.view(np.uint64)
    if keys.shape[1] == 1:
        _, first = np.unique(keys[:, 0], return_index=True)
    else:
        _, first = np.unique(keys, axis=0, return_index=True)
    return np.asarray(normals[np.sort(first)])


@lru_cache(maxsize=16)
def _choices(n: int, r: int) -> Expansion:
    """Return how the cross products of all choices of r − 1 of n vectors are expanded."""
    listed = itertools.chain.from_iterable(itertools.combinations(range(n), r - 1))
    return expansion(np.fromiter(listed, dtype=np.intp).reshape(-1, r - 1), r)
