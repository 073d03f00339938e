"""Minkowski sums of small polytopes, without double description.

The facets of a sum of segments and polygons are spanned by edges of these: every choice of them
gives a candidate normal, by a cross product, and those that make each edge extreme in its polygon
are the facets. Other summands go through a hull of the sums of their vertices.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.wrench_spaces.cross_products import Expansion, cross_products, expansion
from hand_models.wrench_spaces.polytopes import TOLERANCE, hull

__all__ = [
    "Summand",
    "about_facets",
    "extreme_points",
    "sum_normals",
    "sum_vertices",
    "sums",
]


class Summand(NamedTuple):
    """Extreme points (n, 6) of one block's image in scaled wrenches; polygons are in order."""

    points: Array
    dimension: int


def extreme_points(image: Array, columns: int) -> Summand:
    """Return the extreme points of a few points (n, 6), in order around a polygon.

    They are the image of a block's vertices under a linear map of so many columns. Where that is
    one to one they are all extreme: of many in a space of many dimensions a hull may lose some, as
    it merges facets that are wide by rounding.
    """
    centred = image - image.mean(axis=0)
    size = 1.0 + float(np.abs(image).max())
    if len(image) == 2:
        apart = float(np.linalg.norm(centred)) > TOLERANCE * size
        return Summand(image, 1) if apart else Summand(image[:1], 0)
    _, values, basis = np.linalg.svd(centred, full_matrices=False)
    rank = int((values > TOLERANCE * size).sum())
    if rank == 0:
        return Summand(image[:1], 0)
    flat = centred @ basis[:rank].T
    if rank == 1:
        return Summand(image[[flat[:, 0].argmin(), flat[:, 0].argmax()]], 1)
    if rank == columns > 2:
        return Summand(image, rank)
    return Summand(image[hull(flat).vertices], rank)


def about_facets(parts: Sequence[Summand], r: int) -> int:
    """Return about how many facets a sum of segments and polygons has, from their sizes alone.

    A choice of r − 1 edges spans two facets; an edge of a polygon is extreme along one normal in
    two. So it is in general position; parallel edges make it fewer.
    """
    choices = np.ones(1)
    for part in parts:
        own = [1.0, 1.0] if part.dimension == 1 else [1.0, 0.5 * len(part.points), 1.0]
        choices = np.convolve(choices, own)
    return math.ceil(2.0 * choices[r - 1]) if 1 <= r <= len(choices) else 0


def sum_normals(parts: list[Summand], r: int, rounding: float) -> Array:
    """Return the unit facet normals (k, r) of a sum of segments and polygons.

    A facet is spanned by r − 1 independent edges: one of a segment or polygon, or two (its whole
    plane) of a polygon; an edge counts only where the normal makes it extreme in its polygon.
    """
    if r == 1:
        return np.array([[1.0], [-1.0]])
    edges = []
    for part in parts:
        around = np.diff(np.vstack([part.points, part.points[:1]]), axis=0)
        edges.append(around[:1] if part.dimension == 1 else around)
    shapes = tuple((len(e), part.dimension) for e, part in zip(edges, parts, strict=True))
    spanning, chosen = _choices(shapes, r)
    directions = np.vstack(edges)
    directions = directions / np.linalg.norm(directions, axis=1)[:, None]
    normals = cross_products(directions, spanning)
    lengths = np.linalg.norm(normals, axis=1)
    independent = lengths > 1e-8
    normals = normals[independent] / lengths[independent, None]
    normals = np.vstack([normals, -normals])
    chosen = np.vstack([chosen[independent]] * 2)
    keep = np.ones(len(normals), dtype=bool)
    for k, part in enumerate(parts):
        if part.dimension == 2:
            one_edge = np.flatnonzero(chosen[:, k] >= 0)
            # thin products: a threaded BLAS would spend more on waking its threads
            heights = np.einsum("nr,pr->pn", normals[one_edge], part.points)
            here = heights[chosen[one_edge, k], np.arange(len(one_edge))]
            top = heights.max(axis=0)
            keep[one_edge] &= here >= top - rounding * (1.0 + np.abs(top))
    normals = normals[keep]
    _, first = np.unique(np.round(normals, 7) + 0.0, axis=0, return_index=True)
    return np.asarray(normals[np.sort(first)])


@lru_cache(maxsize=16)
def _choices(shapes: tuple[tuple[int, int], ...], r: int) -> tuple[Expansion, Indices]:
    """List every choice of r − 1 edges from parts of given (edges, dimension).

    Returns
    -------
    spanning : Expansion
        Of the cross products of all parts' edges, one after another.
    chosen : ndarray of int, shape (n, parts)
        Which edge of a part is used alone; −1 where none, or its whole plane, is.
    """
    firsts = np.cumsum([0, *(count for count, _ in shapes)])
    spanning, chosen = [], []
    for use in itertools.product(*(range(dimension + 1) for _, dimension in shapes)):
        if sum(use) != r - 1:
            continue
        options = [
            range(count) if u == 1 else (-1,) for u, (count, _) in zip(use, shapes, strict=True)
        ]
        picks = np.array(list(itertools.product(*options)))
        columns = []
        for k, u in enumerate(use):
            if u == 1:
                columns.append(firsts[k] + picks[:, k])
            elif u == 2:
                columns += [np.full(len(picks), firsts[k] + i) for i in range(2)]
        spanning.append(np.column_stack(columns))
        chosen.append(picks)
    return expansion(np.vstack(spanning), r), np.vstack(chosen)


def sums(parts: list[Summand]) -> Array:
    """Return every sum of one point of each part, shape (n, r)."""
    total = np.zeros((1, parts[0].points.shape[1]))
    for part in parts:
        total = (total[:, None, :] + part.points[None, :, :]).reshape(-1, total.shape[1])
    return total


def sum_vertices(parts: list[Summand], normals: Array, offsets: Array, rounding: float) -> Array:
    """Return the vertices (n, r) of a sum, given its facets.

    A sum of points is a vertex if the mean normal of the facets it lies on makes each of them the
    only highest point of its part.
    """
    candidates = sums(parts)
    choice = np.indices([len(part.points) for part in parts]).reshape(len(parts), -1)
    size = 1.0 + float(np.abs(offsets).max())
    chunk = max(1, 2_000_000 // max(1, len(normals)))
    chosen = []
    for start in range(0, len(candidates), chunk):
        piece = candidates[start : start + chunk]
        active = piece @ normals.T >= offsets - 10.0 * rounding * size
        outer = np.flatnonzero(active.any(axis=1))
        piece, mine = piece[outer], choice[:, start + outer]
        outward = active[outer].astype(float) @ normals
        keep = np.ones(len(piece), dtype=bool)
        for k, part in enumerate(parts):
            heights = np.einsum("pr,nr->pn", part.points, outward)
            index = np.arange(len(piece))
            here = heights[mine[k], index]
            heights[mine[k], index] = -np.inf
            keep &= here > heights.max(axis=0) + 1e-9 * size
        chosen.append(piece[keep])
    return np.vstack(chosen)
