"""Small polytopes and their Minkowski sums, without double description.

The facets of a sum of segments and polygons are spanned by edges of these: every choice of them
gives a candidate normal, by a cross product, and those that make each edge extreme in its polygon
are the facets. Other summands go through a hull of the sums of their vertices.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array, hstack, vstack
from scipy.spatial import ConvexHull, HalfspaceIntersection, KDTree, QhullError

from hand_models.base import Array, Indices, SolverError
from hand_models.wrench_spaces.cross_products import Expansion, cross_products, expansion
from hand_models.wrench_spaces.half_spaces import Faces

__all__ = [
    "TOLERANCE",
    "Summand",
    "clipped",
    "extreme_points",
    "hull",
    "hull_facets",
    "polytope_vertices",
    "sum_normals",
    "sum_vertices",
    "sums",
]

TOLERANCE: Final = 1e-9
"""Relative tolerance of the geometry in this module."""


TIGHT: Final = 1e-10
"""Tolerance of linear programs that measure a polytope."""

BEYOND: Final = 1e-6
"""By how much a row must clear a bounding box to be left out at once."""

TOLERANCES: Final = ("primal_feasibility_tolerance", "dual_feasibility_tolerance")

SPANNING: Final = 1e-13
"""Squares of unit normals that span a direction sum to more than this in it."""


class Summand(NamedTuple):
    """Extreme points (n, 6) of one block's image in scaled wrenches; polygons are in order."""

    points: Array
    dimension: int


def polytope_vertices(A: Array, b: Array) -> Array:
    """Return the vertices (n, d) of { y : A y ≤ b }, bounded; none if it is empty."""
    d = A.shape[1]
    norms = np.linalg.norm(A, axis=1)
    A, b = A / norms[:, None], b / norms
    unbounded = SolverError(f"a block of {d} columns is not bounded")
    if d == 1:
        if (A > 0.0).all() or (A < 0.0).all():
            raise unbounded
        upper = b[A[:, 0] > 0.0].min()
        lower = -b[A[:, 0] < 0.0].min()
        slack = TOLERANCE * (1.0 + abs(lower) + abs(upper))
        if lower > upper + slack:
            return np.zeros((0, 1))
        return np.array([[lower], [upper]]) if upper > lower + slack else np.array([[lower]])
    if d == 2:
        turns = np.sort(np.arctan2(A[:, 1], A[:, 0]))
        if np.diff(turns, append=turns[0] + math.tau).max() >= math.pi:
            raise unbounded
        first, second = np.triu_indices(len(b), 1)
        det = A[first, 0] * A[second, 1] - A[first, 1] * A[second, 0]
        crossing = np.abs(det) > TOLERANCE
        first, second, det = first[crossing], second[crossing], det[crossing]
        points = np.column_stack(
            [
                (b[first] * A[second, 1] - b[second] * A[first, 1]) / det,
                (A[first, 0] * b[second] - A[second, 0] * b[first]) / det,
            ]
        )
        # each row by its own size: one that is far away must not loosen the others
        points = points[(points @ A.T <= b + TOLERANCE * (1.0 + np.abs(b))).all(axis=1)]
        return _distinct(points, TOLERANCE * (1.0 + np.max(np.abs(points), initial=0.0)))
    box = _bounding_box(A, b)
    if box is None:
        return np.zeros((0, d))
    middle, half = box
    if not (half > 0.0).all():
        raise SolverError(f"a block of {d} columns has no interior")
    # in a box of unit half widths, where a thin or skew set is as round as any other
    A, b = A * half, b - A @ middle
    norms = np.linalg.norm(A, axis=1)
    A, b = A / norms[:, None], b / norms
    rows = _irredundant(A, b)
    A, b = A[rows], b[rows]
    # the centre of the largest ball inside
    cost = np.zeros(d + 1)
    cost[-1] = -1.0
    ball = linprog(
        cost,
        A_ub=np.column_stack([A, np.ones(len(b))]),
        b_ub=b,
        bounds=[(None, None)] * d + [(0.0, None)],
        method="highs",
    )
    if ball.status != 0 or ball.x is None:
        raise SolverError(f"a block of {d} columns: {ball.message}")
    if ball.x[-1] <= TOLERANCE:
        raise SolverError(f"a block of {d} columns has no interior")
    cut = HalfspaceIntersection(np.column_stack([A, -b]), ball.x[:-1])
    return middle + half * _distinct(cut.intersections, TOLERANCE)


def _bounding_box(A: Array, b: Array) -> tuple[Array, Array] | None:
    """Return the middle and the half widths of { y : A y ≤ b }; None if it is empty."""
    d = A.shape[1]
    # rows in units of the largest offset: a solver's tolerances are about 1e-7
    unit = float(np.abs(b).max()) or 1.0
    ends = np.empty((2, d))
    for j in range(d):
        for k, sign in enumerate((1.0, -1.0)):
            result = linprog(
                sign * np.eye(d)[j],
                A_ub=A,
                b_ub=b / unit,
                bounds=[(None, None)] * d,
                method="highs",
                options={
                    "primal_feasibility_tolerance": TIGHT,
                    "dual_feasibility_tolerance": TIGHT,
                },
            )
            if result.status == 2:
                return None
            if result.status != 0 or result.x is None:
                raise SolverError(f"a block of {d} columns is not bounded: {result.message}")
            ends[k, j] = unit * result.x[j]
    return 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])


def _irredundant(A: Array, b: Array) -> Indices:
    """Return rows of { y : A y ≤ b }, within the box |y| ≤ 1, that are enough for it."""
    # the others hold in the whole box, and a little beyond
    rows = list(np.flatnonzero(np.abs(A).sum(axis=1) >= b - BEYOND))
    for row in list(rows):
        others = [k for k in rows if k != row]
        result = linprog(
            -A[row],
            A_ub=A[others],
            b_ub=b[others],
            bounds=[(-2.0, 2.0)] * A.shape[1],
            method="highs",
        )
        if result.status == 0 and result.fun is not None and -result.fun <= b[row] + TOLERANCE:
            rows.remove(row)
    return np.array(rows, dtype=np.intp)


def _distinct(points: Array, slack: float) -> Array:
    """Return the points that differ by more than ``slack`` in some coordinate."""
    if len(points) < 2:
        return points
    pairs = KDTree(points).query_pairs(10.0 * slack, p=np.inf, output_type="ndarray")
    keep = np.ones(len(points), dtype=bool)
    keep[pairs[:, 1]] = False
    return points[keep]


def clipped(
    vertices: Array, faces: Faces, cuts: Faces, rounding: float
) -> tuple[Array, Faces] | None:
    """Return the vertices (n, r) and facets of a polytope that is cut with half-spaces.

    One after another: vertices beyond a cut go, and every edge that crosses it gets a new one. Two
    vertices are the ends of an edge where the normals of the facets that both lie on span all
    directions but one.

    Parameters
    ----------
    vertices : ndarray, shape (n, r)
    faces : Faces
        All facets of the polytope.
    cuts : Faces
    rounding : float
        How far rounding may move points.

    Returns
    -------
    tuple or None
        None if nothing, or nothing with an interior, is left.
    """
    if not len(cuts.offsets):
        return vertices, faces
    slack = 10.0 * rounding * (1.0 + float(np.abs(faces.offsets).max()))
    lies = _incidence(vertices, faces, slack)
    beyond = vertices @ cuts.normals.T > cuts.offsets
    # those that take most away first: what is gone need not be cut again
    for k in np.argsort(-beyond.sum(axis=0)):
        normal, offset = cuts.normals[k], cuts.offsets[k]
        height = vertices @ normal - offset
        inside, outside = np.flatnonzero(height < -slack), np.flatnonzero(height > slack)
        if not len(outside):
            continue
        if not len(inside):
            return None
        near, far = _edges(lies, inside, outside, faces)
        part = (height[near] / (height[near] - height[far]))[:, None]
        crossings = _distinct(vertices[near] + part * (vertices[far] - vertices[near]), slack)
        kept = height <= slack
        vertices = np.vstack([vertices[kept], crossings])
        on_cut = np.append(height[kept] >= -slack, np.ones(len(crossings)))[:, None]
        lies = vstack([lies[kept], _incidence(crossings, faces, slack)])
        lies = hstack([lies, csr_array(on_cut)], format="csr")
        met = np.asarray(lies.sum(axis=0)).ravel() >= vertices.shape[1]
        lies = lies[:, met]
        normals, offsets = np.vstack([faces.normals, normal]), np.append(faces.offsets, offset)
        faces = Faces(normals[met], offsets[met])
    return vertices, faces


def _edges(
    lies: csr_array, starts: Indices, ends: Indices, faces: Faces
) -> tuple[Indices, Indices]:
    """Return the ends of all edges that lead from some vertices to some others."""
    r = faces.normals.shape[1]
    if r == 1:
        return starts, ends
    one, other = lies[starts], lies[ends]
    shared = (one @ other.T).tocoo()
    enough = shared.data >= r - 1
    i, j = shared.row[enough], shared.col[enough]
    squares = np.einsum("kr,ks->krs", faces.normals, faces.normals).reshape(-1, r * r)
    spans = np.linalg.eigvalsh((one[i].multiply(other[j]) @ squares).reshape(-1, r, r))
    edge = spans[:, 1] > SPANNING
    return starts[i[edge]], ends[j[edge]]


def _incidence(points: Array, faces: Faces, slack: float) -> csr_array:
    """Return which points (rows) lie on which facets (columns), as ones."""
    chunk = max(1, 2_000_000 // len(faces.offsets))
    parts = [
        csr_array((points[k : k + chunk] @ faces.normals.T >= faces.offsets - slack).astype(float))
        for k in range(0, max(len(points), 1), chunk)
    ]
    lies: csr_array = vstack(parts, format="csr")
    return lies


def extreme_points(image: Array) -> Summand:
    """Return the extreme points of a few points (n, 6), in order around a polygon."""
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
    return Summand(image[hull(flat).vertices], rank)


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


def hull(points: Array, options: str | None = None) -> ConvexHull:
    """Return the convex hull of points (n, r), joggled where it cannot be found exactly.

    Raises
    ------
    SolverError
        If that fails as well.
    """
    try:
        return ConvexHull(points, qhull_options=options)
    except QhullError:
        try:
            return ConvexHull(points, qhull_options="QJ")
        except QhullError as error:
            raise SolverError(f"convex hull: {str(error).splitlines()[0]}") from None


def hull_facets(points: Array) -> tuple[Array, Array]:
    """Return unit normals and offsets of the hull of points (n, r)."""
    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]]), np.array([points.max(), -points.min()])
    equations = hull(points).equations
    _, first = np.unique(np.round(equations, 7) + 0.0, axis=0, return_index=True)
    equations = equations[np.sort(first)]
    return equations[:, :-1], -equations[:, -1]
