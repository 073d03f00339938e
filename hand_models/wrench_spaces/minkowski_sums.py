"""Minkowski sums of small polytopes, without double description.

The facets of a sum of segments (a zonotope) and polygons are spanned by edges of these: every
choice of them gives a candidate normal, orthogonal to all, and those along which each edge is
extreme in its part are the facets. Other summands go through a hull of the sums of their vertices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, go_on
from hand_models.wrench_spaces.half_spaces import Facets
from hand_models.wrench_spaces.polytopes import hull
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["Summand", "about_facets", "extreme_points", "facets", "sum_vertices", "sums"]


class Summand(NamedTuple):
    """Extreme points of one block's image in wrenches.

    Attributes
    ----------
    points : ndarray, shape (n, d)
        Extreme points; those of a polygon in order around it.
    dimension : int
        Dimension of their affine hull: 0 for a point, 1 for a segment, 2 for a polygon, …
    """

    points: Array
    dimension: int


def extreme_points(image: Array, columns: int) -> Summand:
    """Return the extreme points of the image of a block's vertices under a linear map.

    Parameters
    ----------
    image : ndarray, shape (n, 6)
        Images of the vertices, such as wrenches.
    columns : int
        Number of the block's columns. Where the map is one to one on more than two columns, all
        images are extreme, and no hull is computed: it might merge facets and lose some of them.
    """
    centred = image - image.mean(axis=0)
    size = 1.0 + float(np.abs(image).max())
    if len(image) == 2:
        apart = float(np.linalg.norm(centred)) > SETTINGS.tolerance * size
        return Summand(image, 1) if apart else Summand(image[:1], 0)
    _, values, basis = np.linalg.svd(centred, full_matrices=False)
    rank = int((values > SETTINGS.tolerance * size).sum())
    if rank == 0:
        return Summand(image[:1], 0)
    flat = centred @ basis[:rank].T
    if rank == 1:
        return Summand(image[[flat[:, 0].argmin(), flat[:, 0].argmax()]], 1)
    if rank == columns > 2:
        return Summand(image, rank)
    return Summand(image[hull(flat).vertices], rank)


def about_facets(parts: Sequence[Summand], r: int) -> int:
    """Estimate how many facets a Minkowski sum of segments and polygons has, from sizes alone.

    The estimate is for parts in general position: a choice of r − 1 edges spans two facets, and an
    edge of a polygon is extreme along one normal in two. Parallel edges make fewer facets.

    Parameters
    ----------
    parts : sequence of Summand
        Segments and polygons.
    r : int
        Dimension of the sum.
    """
    choices = np.ones(1)
    for part in parts:
        own = [1.0, 1.0] if part.dimension == 1 else [1.0, 0.5 * len(part.points), 1.0]
        choices = np.convolve(choices, own)
    return math.ceil(2.0 * choices[r - 1]) if 1 <= r <= len(choices) else 0


def facets(parts: Sequence[Summand], r: int, rounding: float) -> Facets:
    """Return the facets of a Minkowski sum of segments and polygons that spans R^r, r ≥ 1.

    A facet is spanned by r − 1 independent edges: one of a segment or polygon, or two (its whole
    plane) of a polygon; an edge counts only where the normal makes it extreme in its polygon. The
    offset is the support function along the normal, so that no half-space cuts the set, even
    where its edges are nearly dependent.

    Parameters
    ----------
    parts : sequence of Summand
        Segments and polygons with points in r dimensions.
    r : int
        Dimension of the sum.
    rounding : float
        Distance that rounding may move points, in units of the points.
    """
    shapes = tuple([(len(part.points), part.dimension) for part in parts])
    ends, whole, choices = _choices(shapes, r)
    points = np.vstack([part.points for part in parts])
    edges = points[ends[:, 1]] - points[ends[:, 0]]
    normals = _cross_products(edges / np.linalg.norm(edges, axis=1)[:, None], choices)
    lengths = np.linalg.norm(normals, axis=1)
    # of choices that span the same facet, or nearly, the roundest: its normal is the most exact
    order = np.argsort(-lengths, kind="stable")
    order = order[lengths[order] > 1e-8]  # unit vectors that span less volume are dependent
    normals, choices = normals[order] / lengths[order, None], choices[order]
    normals, choices = np.vstack([normals, -normals]), np.vstack([choices, choices])
    offsets, lie = np.zeros(len(normals)), []
    for part in parts:
        go_on()
        # thin products: a threaded BLAS would spend more on waking its threads
        heights = np.einsum("pr,nr->pn", part.points, normals)
        top = heights.max(axis=0)
        lie.append(heights >= top - rounding * (1.0 + np.abs(top)))
        offsets += top
    extreme = np.vstack(lie)[ends].all(axis=1) | whole[:, None]
    found = np.flatnonzero(extreme[choices, np.arange(len(normals))[:, None]].all(axis=1))
    _, first = np.unique(np.round(normals[found], 7) + 0.0, axis=0, return_index=True)
    found = found[np.sort(first)]
    return Facets(normals[found], offsets[found])


def _cross_products(vectors: Array, choices: Indices) -> Array:
    """Return the vectors (n, r) orthogonal to choices (n, r − 1) of vectors.

    Each is as long as the volume that they span.
    """
    found = [np.zeros((0, vectors.shape[1]))]
    at_once = 10_000  # choices of edges: some hundredths of a second's work
    for start in range(0, len(choices), at_once):
        go_on()
        some = vectors[choices[start : start + at_once]]
        turned, spread = np.linalg.qr(some.swapaxes(1, 2), mode="complete")
        volumes = np.abs(np.diagonal(spread, axis1=1, axis2=2).prod(axis=1))
        found.append(volumes[:, None] * turned[:, :, -1])
    return np.vstack(found)


def _choices(
    shapes: tuple[tuple[int, int], ...], r: int
) -> tuple[Indices, NDArray[np.bool_], Indices]:
    """Return the edges of parts, and every choice of r − 1 of them that may span a facet.

    Parameters
    ----------
    shapes : tuple of (int, int)
        Points and dimension of each part.
    r : int

    Returns
    -------
    ends : ndarray of int, shape (k, 2)
        Points of each edge, those of all parts counted one after another.
    whole : ndarray of bool, shape (k,)
        Whether it stands for its whole part, which then lies in the facet: a segment, or one of two
        edges of a polygon, which are listed again after all of them.
    choices : ndarray of int, shape (n, r − 1)
        Into the edges: of each part none, one, or those two.
    """
    ends: list[tuple[int, int]] = []
    whole: list[bool] = []
    # of the parts so far, by how many edges are chosen
    choices: list[list[tuple[int, ...]]] = [[()], *[[] for _ in range(r - 1)]]
    start = 0
    for points, dimension in shapes:
        first, count = len(ends), points if dimension == 2 else 1
        own = [(start + i, start + (i + 1) % points) for i in range(count)]
        options: list[list[tuple[int, ...]]] = [[()], [(first + i,) for i in range(count)]]
        ends += own
        whole += [dimension == 1] * count
        if dimension == 2:
            options.append([(len(ends), len(ends) + 1)])
            ends += own[:2]
            whole += [True, True]
        start += points
        choices = [
            [
                begun + more
                for used, each in enumerate(options[: size + 1])
                for begun in choices[size - used]
                for more in each
            ]
            for size in range(r)
        ]
    listed = np.array(choices[-1], dtype=np.intp).reshape(len(choices[-1]), r - 1)
    return np.array(ends, dtype=np.intp), np.array(whole), listed


def sums(parts: list[Summand]) -> Array:
    """Return all sums of one point from each part: candidates for the vertices of a Minkowski sum.

    Parameters
    ----------
    parts : list of Summand
        Points in r dimensions.

    Returns
    -------
    ndarray, shape (n, r)
        n is the product of the parts' numbers of points.
    """
    total = np.zeros((1, parts[0].points.shape[1]))
    for part in parts:
        total = (total[:, None, :] + part.points[None, :, :]).reshape(-1, total.shape[1])
    return total


def sum_vertices(parts: list[Summand], normals: Array, offsets: Array, rounding: float) -> Array:
    """Return the vertices (n, r) of a Minkowski sum, given its facets.

    A sum of points is a vertex if the mean normal of the facets it lies on makes each of the
    points the only highest one of its part.

    Parameters
    ----------
    parts : list of Summand
        Points in r dimensions.
    normals, offsets : ndarray, shapes (k, r), (k,)
        Facets of the sum.
    rounding : float
        Distance that rounding may move points, in units of the points.
    """
    candidates = sums(parts)
    choice = np.indices([len(part.points) for part in parts]).reshape(len(parts), -1)
    size = 1.0 + float(np.abs(offsets).max())
    chunk = max(1, 2_000_000 // max(1, len(normals)))
    chosen = []
    for start in range(0, len(candidates), chunk):
        go_on()
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
