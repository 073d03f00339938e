"""WrenchSpace: everything that one hand on one hold can exert, as one object with named rows.

    { o + V y : L y + l0 ≤ u s,  H y ≤ h }      at utilisation u;   A y ≤ b at u = 1

Its views (vertices, half-spaces, support function, …) are of the set at u = 1. The inequalities of
a fixed-wrist hand couple no finger to another, so the set is a Minkowski sum of small polytopes,
one for each block of coupled columns; the views use that, and need no double description.

Directions and distances that mix forces and moments are taken in *scaled* wrenches, whose moments
are divided by `MOMENT_ARM`, so that all six components are newtons.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from hand_models.errors import EmptySetError, InvalidInputError, SolverError, UnsupportedError
from hand_models.frames import Array, Indices, finite_vector

__all__ = ["MOMENT_ARM", "SCALE", "HalfSpaces", "Row", "WrenchSpace"]

MOMENT_ARM: Final = 0.1
"""Makes newton-metres commensurate with newtons: about the size of a hand [m]."""

SCALE: Final = np.array([1.0, 1.0, 1.0, *[1.0 / MOMENT_ARM] * 3])
"""From a wrench to a scaled wrench [N]."""

TOLERANCE: Final = 1e-9
"""Relative tolerance of the geometry in this module."""

FLATNESS: Final = 1e-9
"""A set is flat in a direction in which it reaches less than this times its longest reach."""

MOST_CANDIDATES: Final = 500_000
"""How many sums of the blocks' vertices are looked through; that many take some 20 s."""


class Row(NamedTuple):
    """The name of an inequality.

    Attributes
    ----------
    finger, phalanx : str or None
        Whose it is; None where it is the palm's, or a whole finger's.
    limit : str
        What it limits.
    kind : {'limit', 'hard'}
    label : str
        Unique in its set.
    """

    finger: str | None
    phalanx: str | None
    limit: str
    kind: Literal["limit", "hard"]
    label: str


class HalfSpaces(NamedTuple):
    """``normals @ w ≤ offsets`` and, for a flat set, ``equation_normals @ w = equation_offsets``.

    Normals have unit length as functions of the scaled wrench, so a violation is a distance [N].
    """

    normals: Array
    offsets: Array
    equation_normals: Array
    equation_offsets: Array


class _Summand(NamedTuple):
    """Extreme points (n, 6) of one block's image in scaled wrenches; polygons are in order."""

    points: Array
    dimension: int


@dataclass(frozen=True, eq=False)
class WrenchSpace:
    """Wrenches on the rock, in H, that a hand can carry.

    Attributes
    ----------
    origin : ndarray, shape (6,)
        o [N, N·m].
    generators : ndarray, shape (6, m)
        V, a column for each of `columns`.
    columns : tuple of str, length m
        Names of the entries of y.
    rows : tuple of Row
        Limit rows, then hard rows.
    L, l0, s : ndarray, shapes (nl, m), (nl,), (nl,)
        Limit rows: the load ``L y + l0`` against the capacity ``s`` > 0.
    H, h : ndarray, shapes (nh, m), (nh,)
        Hard rows ``H y ≤ h``, whatever the utilisation.
    """

    origin: Array
    generators: Array
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    L: Array
    l0: Array
    s: Array
    H: Array
    h: Array

    def __post_init__(self) -> None:
        m = len(self.columns)
        shapes = {
            "origin": (6,),
            "generators": (6, m),
            "L": (len(self.s), m),
            "l0": (len(self.s),),
            "H": (len(self.h), m),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InvalidInputError(
                    f"shape {shape} is needed, got {getattr(self, name).shape}", field=name
                )
        if len(self.rows) != len(self.s) + len(self.h):
            raise InvalidInputError("one name for each row is needed", field="rows")
        if not (self.s > 0.0).all():
            raise InvalidInputError("every capacity must be above zero", field="s")

    @property
    def A(self) -> Array:
        """All rows at u = 1, shape (nl + nh, m)."""
        return np.vstack([self.L, self.H])

    @property
    def b(self) -> Array:
        """Right-hand sides at u = 1, shape (nl + nh,)."""
        return np.concatenate([self.s - self.l0, self.h])

    def wrench(self, y: ArrayLike) -> Array:
        """Return o + V y, shape (6,)."""
        return np.asarray(self.origin + self.generators @ np.asarray(y, dtype=float))

    def utilisations(self, y: ArrayLike) -> Array:
        """Return load over capacity of each limit row, shape (nl,)."""
        return np.asarray((self.L @ np.asarray(y, dtype=float) + self.l0) / self.s)

    # Views at u = 1 -----------------------------------------------------------------------------

    @cached_property
    def _blocks(self) -> tuple[tuple[Indices, Array], ...]:
        """Columns of each block and the vertices of its polytope, (indices, (n, d))."""
        A, b = self.A, self.b
        used = np.abs(A) > 0.0
        idle = ~used.any(axis=1)
        if (b[idle] < -TOLERANCE * (1.0 + np.abs(b[idle]))).any():
            raise self._empty()
        m = len(self.columns)
        if not m:
            return ()
        incidence = csr_array((used.T.astype(int) @ used.astype(int)) > 0)
        _, labels = connected_components(incidence, directed=False)
        blocks: list[tuple[Indices, Array]] = []
        for label in range(labels.max() + 1):
            columns: Indices = np.flatnonzero(labels == label)
            mine = used[:, columns].any(axis=1)
            vertices = _polytope_vertices(A[np.ix_(mine, columns)], b[mine])
            if not len(vertices):
                raise self._empty(columns)
            blocks.append((columns, vertices))
        return tuple(blocks)

    def _empty(self, columns: Indices | None = None) -> EmptySetError:
        names = "" if columns is None else " of " + ", ".join(self.columns[i] for i in columns)
        return EmptySetError(
            f"no wrench is left at utilisation 1: the limits{names} contradict the hard rows"
        )

    @cached_property
    def _summands(self) -> tuple[_Summand, ...]:
        """The blocks' images that are more than a point, about `_base`."""
        summands = []
        for columns, vertices in self._blocks:
            image = (vertices @ self.generators[:, columns].T) * SCALE
            summands.append(_extreme_points(image))
        return tuple(summands)

    @cached_property
    def _base(self) -> Array:
        """A scaled wrench of the set."""
        start = self.origin * SCALE
        return np.asarray(sum((summand.points[0] for summand in self._summands), start=start))

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """Directions (r, 6) of the affine hull, orthonormal, and the edges' reach along each, (r,).

        Facets and vertices are found in coordinates along these, divided by the reach: there a
        thin set is as round as any other, and the normals of its facets are well apart.
        """
        edges = [s.points[1:] - s.points[0] for s in self._summands if s.dimension]
        if not edges:
            return np.zeros((0, 6)), np.zeros(0)
        _, reach, directions = np.linalg.svd(np.vstack(edges), full_matrices=False)
        rank = int((reach > FLATNESS * reach[0]).sum())
        return directions[:rank], reach[:rank]

    @cached_property
    def _parts(self) -> list[_Summand]:
        """The summands that are more than a point, about `_base`, in the coordinates of `_axes`."""
        directions, reach = self._axes
        summands = [s for s in self._summands if s.dimension]
        candidates = math.prod(len(s.points) for s in summands)
        if candidates > MOST_CANDIDATES:
            raise UnsupportedError(
                f"{candidates} candidate vertices are too many (at most {MOST_CANDIDATES}): "
                "use fewer half_planes, or leave lateral out"
            )
        return [
            _Summand((s.points - s.points[0]) @ directions.T / reach, s.dimension) for s in summands
        ]

    @property
    def _rounding(self) -> float:
        """How far rounding may move points in the coordinates of `_axes`: more in a thin set."""
        reach = self._axes[1]
        return max(TOLERANCE, 16.0 * np.finfo(float).eps * float(reach[0] / reach[-1]))

    @property
    def dimension(self) -> int:
        """Of the set's affine hull, from 0 to 6."""
        return len(self._axes[1])

    @cached_property
    def _facets(self) -> tuple[Array, Array]:
        """Unit normals (k, r) and offsets (k,) in the coordinates of `_axes`, about `_base`."""
        parts, r = self._parts, self.dimension
        if r == 0:
            return np.zeros((0, 0)), np.zeros(0)
        if all(part.dimension <= 2 for part in parts):
            normals = _sum_normals(parts, r, self._rounding)
            offsets = sum(
                ((part.points @ normals.T).max(axis=0) for part in parts),
                start=np.zeros(len(normals)),
            )
            return normals, np.asarray(offsets)
        return _hull_facets(_sums(parts))

    def half_spaces(self) -> HalfSpaces:
        """Return the set at u = 1 as inequalities and, where it is flat, equations.

        Raises
        ------
        EmptySetError
            If nothing is left at u = 1.
        """
        normals, offsets = self._facets
        directions, reach = self._axes
        lifted = (normals / reach) @ directions
        lengths = np.linalg.norm(lifted, axis=1)
        lifted, offsets = lifted / lengths[:, None], offsets / lengths
        _, _, full = np.linalg.svd(np.vstack([directions, np.zeros((1, 6))]))
        flat = full[len(directions) :]
        return HalfSpaces(
            normals=lifted * SCALE,
            offsets=offsets + lifted @ self._base,
            equation_normals=flat * SCALE,
            equation_offsets=flat @ self._base,
        )

    def vertices(self) -> Array:
        """Return the extreme wrenches of the set at u = 1, shape (n, 6).

        Raises
        ------
        EmptySetError
            If nothing is left at u = 1.
        """
        directions, reach = self._axes
        return np.asarray(((self._vertices * reach) @ directions + self._base) / SCALE)

    @cached_property
    def _vertices(self) -> Array:
        """Vertices (n, r) in the coordinates of `_axes`, about `_base`."""
        if not self._parts:
            return np.zeros((1, 0))
        return _sum_vertices(self._parts, *self._facets, self._rounding)

    def support(self, direction: ArrayLike) -> float:
        """Return max { d · w : w in the set at u = 1 }, for d of shape (6,).

        Raises
        ------
        EmptySetError
            If nothing is left at u = 1.
        """
        d = finite_vector(direction, 6, "direction")
        slopes = self.generators.T @ d
        reach = sum(float((v @ slopes[columns]).max()) for columns, v in self._blocks)
        return float(d @ self.origin) + reach

    def contains(self, wrench: ArrayLike, tolerance: float = 1e-6) -> bool:
        """Whether a wrench is in the set at u = 1, or within ``tolerance`` of each of its faces.

        Parameters
        ----------
        wrench : array_like, shape (6,)
            [N, N·m]
        tolerance : float, optional
            Distance in scaled wrenches [N].
        """
        w = finite_vector(wrench, 6, "wrench")
        faces = self.half_spaces()
        beyond = np.max(faces.normals @ w - faces.offsets, initial=-math.inf)
        off = np.max(np.abs(faces.equation_normals @ w - faces.equation_offsets), initial=0.0)
        return bool(max(beyond, off) <= tolerance)

    def capability(self, direction: ArrayLike) -> tuple[float, float] | None:
        """Return the least and the largest t for which t·d is in the set at u = 1.

        None where the line through zero along d, of shape (6,), misses the set.

        Raises
        ------
        SolverError
            If the linear program fails.
        """
        d = finite_vector(direction, 6, "direction")
        m = len(self.columns)
        equations = np.hstack([self.generators, -d[:, None]]) * SCALE[:, None]
        bounds = [(None, None)] * (m + 1)
        rows = np.hstack([self.A, np.zeros((len(self.b), 1))])
        ends = []
        for sign in (1.0, -1.0):
            cost = np.zeros(m + 1)
            cost[-1] = sign
            result = linprog(
                cost,
                A_ub=rows,
                b_ub=self.b,
                A_eq=equations,
                b_eq=-self.origin * SCALE,
                bounds=bounds,
                method="highs",
            )
            if result.status == 2:
                return None
            if result.status != 0 or result.x is None:
                raise SolverError(f"capability: {result.message}")
            ends.append(float(result.x[-1]))
        return ends[0], ends[1]

    def volume(self) -> tuple[float, int]:
        """Return the volume of the set at u = 1 in its affine hull, and that hull's dimension r.

        Measured in scaled wrenches, so its unit is N^r, to about 1e-4 of it. Thousands of vertices
        take seconds.

        Raises
        ------
        EmptySetError
            If nothing is left at u = 1.
        SolverError
            If the hull of the vertices cannot be found.
        """
        r = self.dimension
        stretch = float(np.prod(self._axes[1]))
        if r == 0:
            return 0.0, 0
        if r == 1:
            return float(np.ptp(self._vertices)) * stretch, 1
        # joggled: merged facets may be so wide in a set of fine facets that volume is lost
        return float(_hull(self._vertices, "QJ").volume) * stretch, r


def _polytope_vertices(A: Array, b: Array) -> Array:
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
    slack = TOLERANCE * (1.0 + float(np.abs(b).max()))
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
    if ball.status == 2:
        return np.zeros((0, d))
    if ball.status != 0 or ball.x is None:
        raise SolverError(f"a block of {d} columns is not bounded: {ball.message}")
    if ball.x[-1] <= slack:
        raise SolverError(f"a block of {d} columns has no interior")
    cut = HalfspaceIntersection(np.column_stack([A, -b]), ball.x[:-1])
    return _distinct(cut.intersections, slack)


def _distinct(points: Array, slack: float) -> Array:
    """Return the points that differ by more than ``slack`` in some coordinate."""
    if len(points) < 2:
        return points
    close = (np.abs(points[:, None, :] - points[None, :, :]) <= 10.0 * slack).all(axis=2)
    return points[~np.triu(close, 1).any(axis=0)]


def _extreme_points(image: Array) -> _Summand:
    """Return the extreme points of a few points (n, 6), in order around a polygon."""
    centred = image - image.mean(axis=0)
    _, values, basis = np.linalg.svd(centred, full_matrices=False)
    size = 1.0 + float(np.abs(image).max())
    rank = int((values > TOLERANCE * size).sum())
    if rank == 0:
        return _Summand(image[:1], 0)
    flat = centred @ basis[:rank].T
    if rank == 1:
        return _Summand(image[[flat[:, 0].argmin(), flat[:, 0].argmax()]], 1)
    hull = _hull(flat)
    return _Summand(image[hull.vertices], rank)


def _sum_normals(parts: list[_Summand], r: int, rounding: float) -> Array:
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
    spanning, chosen = _choices(shapes, r - 1)
    directions = np.vstack(edges)
    directions = directions / np.linalg.norm(directions, axis=1)[:, None]
    normals = _cross(directions[spanning])
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
def _choices(shapes: tuple[tuple[int, int], ...], total: int) -> tuple[Indices, Indices]:
    """List every choice of ``total`` edges from parts of given (edges, dimension).

    Returns
    -------
    spanning : ndarray of int, shape (n, total)
        Into all parts' edges, one after another.
    chosen : ndarray of int, shape (n, parts)
        Which edge of a part is used alone; −1 where none, or its whole plane, is.
    """
    firsts = np.cumsum([0, *(count for count, _ in shapes)])
    spanning, chosen = [], []
    for use in itertools.product(*(range(dimension + 1) for _, dimension in shapes)):
        if sum(use) != total:
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
    return np.vstack(spanning), np.vstack(chosen)


def _cross(spans: Array) -> Array:
    """Return the vectors (n, r) orthogonal to stacks (n, r − 1, r), by Laplace expansion."""
    count, rows, r = spans.shape
    minors: dict[tuple[int, ...], Array] = {(j,): spans[:, 0, j] for j in range(r)}
    for row in range(1, rows):
        grown: dict[tuple[int, ...], Array] = {}
        for columns in itertools.combinations(range(r), row + 1):
            total = np.zeros(count)
            for place, j in enumerate(columns):
                rest = columns[:place] + columns[place + 1 :]
                total += (-1.0) ** (row + place) * spans[:, row, j] * minors[rest]
            grown[columns] = total
        minors = grown
    return np.column_stack(
        [(-1.0) ** j * minors[tuple(i for i in range(r) if i != j)] for j in range(r)]
    )


def _sums(parts: list[_Summand]) -> Array:
    """Return every sum of one point of each part, shape (n, r)."""
    total = np.zeros((1, parts[0].points.shape[1]))
    for part in parts:
        total = (total[:, None, :] + part.points[None, :, :]).reshape(-1, total.shape[1])
    return total


def _sum_vertices(parts: list[_Summand], normals: Array, offsets: Array, rounding: float) -> Array:
    """Return the vertices (n, r) of a sum, given its facets.

    A sum of points is a vertex if the mean normal of the facets it lies on makes each of them the
    only highest point of its part.
    """
    sums = _sums(parts)
    choice = np.indices([len(part.points) for part in parts]).reshape(len(parts), -1)
    size = 1.0 + float(np.abs(offsets).max())
    chunk = max(1, 2_000_000 // max(1, len(normals)))
    chosen = []
    for start in range(0, len(sums), chunk):
        piece = sums[start : start + chunk]
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


def _hull(points: Array, options: str | None = None) -> ConvexHull:
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


def _hull_facets(points: Array) -> tuple[Array, Array]:
    """Return unit normals and offsets of the hull of points (n, r)."""
    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]]), np.array([points.max(), -points.min()])
    equations = _hull(points).equations
    _, first = np.unique(np.round(equations, 7) + 0.0, axis=0, return_index=True)
    equations = equations[np.sort(first)]
    return equations[:, :-1], -equations[:, -1]
