"""Small polytopes: their vertices from their inequalities, and convex hulls of points."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices, SolverError, go_on
from hand_models.wrench_spaces.linear_programs import linear_program
from hand_models.wrench_spaces.settings import SETTINGS

__all__ = ["Polytope", "distinct", "hull", "hull_facets", "largest_ball", "polytope"]


class Polytope(NamedTuple):
    """A bounded set { y : A y ≤ b } by its vertices and its facets.

    Attributes
    ----------
    vertices : ndarray, shape (n, d)
        Vertices; n = 0 if the set is empty.
    facets : ndarray of int
        Indices of the rows of A that are enough to describe the set: in more than two dimensions
        no redundant row, in one or two every row that touches the set.
    """

    vertices: Array
    facets: Indices


def polytope(A: Array, b: Array) -> Polytope:
    """Return the vertices and facets of the bounded polytope { y : A y ≤ b } (vertex enumeration).

    Parameters
    ----------
    A, b : ndarray, shapes (k, d), (k,)

    Raises
    ------
    SolverError
        If the set is unbounded or, in more than two dimensions, has no interior.
    """
    d = A.shape[1]
    everything = np.arange(len(b))
    norms = np.linalg.norm(A, axis=1)
    A, b = A / norms[:, None], b / norms
    unbounded = SolverError(f"no limit bounds {d} coupled loads: vertices cannot be listed")
    if d == 1:
        if (A > 0.0).all() or (A < 0.0).all():
            raise unbounded
        upper = b[A[:, 0] > 0.0].min()
        lower = -b[A[:, 0] < 0.0].min()
        slack = SETTINGS.tolerance * (1.0 + abs(lower) + abs(upper))
        if lower > upper + slack:
            return Polytope(np.zeros((0, 1)), everything)
        ends = [[lower], [upper]] if upper > lower + slack else [[lower]]
        return _touching(np.array(ends), A, b)
    if d == 2:
        turns = np.sort(np.arctan2(A[:, 1], A[:, 0]))
        if np.diff(turns, append=turns[0] + math.tau).max() >= math.pi:
            raise unbounded
        return _touching(_corners(A, b), A, b)
    box = _bounding_box(A, b)
    if box is None:
        return Polytope(np.zeros((0, d)), everything)
    middle, half = box
    if not (half > 0.0).all():
        raise _flat(d)
    # in a box of unit half widths, where a thin or skew set is as round as any other
    A, b = A * half, b - A @ middle
    norms = np.linalg.norm(A, axis=1)
    A, b = A / norms[:, None], b / norms
    rows = _irredundant(A, b)
    A, b = A[rows], b[rows]
    ball = largest_ball(A, b, f"a block of {d} columns")
    if ball is None or ball[-1] <= SETTINGS.tolerance:
        raise _flat(d)
    go_on()
    cut = scipy.spatial.HalfspaceIntersection(np.column_stack([A, -b]), ball[:-1])
    return Polytope(middle + half * distinct(cut.intersections, SETTINGS.tolerance), rows)


def largest_ball(A: Array, b: Array, what: str) -> Array | None:
    """Return centre and radius of the largest ball in { y : A y ≤ b }, shape (d + 1,), or None.

    Parameters
    ----------
    A : ndarray, shape (n, d)
        Rows of unit length.
    b : ndarray, shape (n,)
    what : str
        Name of the set, for errors.

    Raises
    ------
    SolverError
        If the program is not solved.
    """
    d = A.shape[1]
    cost, bounds = np.append(np.zeros(d), -1.0), [(None, None)] * d + [(0.0, None)]
    return linear_program(cost, np.column_stack([A, np.ones(len(b))]), b, what, bounds=bounds)


def _flat(d: int) -> SolverError:
    return SolverError(
        f"limits leave {d} coupled loads no room in some direction, vertices cannot be listed: "
        "loosen a limit slightly"
    )


def _touching(vertices: Array, A: Array, b: Array) -> Polytope:
    """Return a polytope with all rows that touch it; with all of them if it is empty."""
    slack = SETTINGS.row_clearance * (1.0 + np.abs(b) + np.max(np.abs(vertices), initial=0.0))
    reach = np.max(vertices @ A.T, axis=0, initial=-np.inf)
    return Polytope(vertices, np.flatnonzero((reach >= b - slack) | (len(vertices) == 0)))


def _corners(A: Array, b: Array) -> Array:
    """Return the corners (n, 2) of { y : A y ≤ b }, bounded; rows of unit length."""
    # each row by its own size: one that is far away must not loosen the others
    loosened = b + SETTINGS.tolerance * (1.0 + np.abs(b))
    found = []
    first, second = _meeting(A, b, loosened)
    at_once = max(1, SETTINGS.numbers_at_once // len(b))
    for start in range(0, len(first), at_once):
        go_on()
        one, two = (each[start : start + at_once] for each in (first, second))
        det = A[one, 0] * A[two, 1] - A[one, 1] * A[two, 0]
        points = np.column_stack(
            [
                (b[one] * A[two, 1] - b[two] * A[one, 1]) / det,
                (A[one, 0] * b[two] - A[two, 0] * b[one]) / det,
            ]
        )
        found.append(points[(points @ A.T <= loosened).all(axis=1)])
    points = np.vstack([np.zeros((0, 2)), *found])
    return distinct(points, SETTINGS.tolerance * (1.0 + np.max(np.abs(points), initial=0.0)))


def _meeting(A: Array, b: Array, loosened: Array) -> tuple[Indices, Indices]:
    """Return the pairs of rows whose lines cross on what the others leave of the first, or nearly.

    So n² numbers, and not n³, decide which crossings may be corners.
    """
    first, second = np.triu_indices(len(b), 1)
    # along the line of row i, b_i A_i + t (−A_i1, A_i0), row j asks for slope_ij t ≤ room_ij
    slope = A[:, :1] * A[:, 1] - A[:, 1:] * A[:, 0]
    across = A @ A.T * b[:, None]
    slanted = np.abs(slope) > SETTINGS.tolerance
    steep = np.where(slanted, slope, 1.0)
    room = (loosened + SETTINGS.tolerance * (1.0 + np.abs(b)) - across) / steep
    upper = np.where(slanted & (slope > 0.0), room, np.inf).min(axis=1)
    lower = np.where(slanted & (slope < 0.0), room, -np.inf).max(axis=1)
    t = ((b - across) / steep)[first, second]
    size = SETTINGS.tolerance * (1.0 + np.abs(t))
    left = slanted[first, second] & (t >= lower[first] - size) & (t <= upper[first] + size)
    return first[left], second[left]


def _bounding_box(A: Array, b: Array) -> tuple[Array, Array] | None:
    """Return the middle and the half widths of { y : A y ≤ b }; None if it is empty."""
    d = A.shape[1]
    # rows in units of the largest offset: a solver's tolerances are about 1e-7
    unit = float(np.abs(b).max()) or 1.0
    ends = np.empty((2, d))
    for j in range(d):
        for k, sign in enumerate((1.0, -1.0)):
            go_on()
            # tighter than the polytope that it measures
            found = linear_program(
                sign * np.eye(d)[j], A, b / unit, f"a block of {d} columns", tolerance=1e-10
            )
            if found is None:
                return None
            ends[k, j] = unit * found[j]
    return 0.5 * (ends[0] + ends[1]), 0.5 * (ends[1] - ends[0])


def _irredundant(A: Array, b: Array) -> Indices:
    """Return rows of { y : A y ≤ b }, within the box |y| ≤ 1, that are enough for it."""
    # the others hold in the whole box, and a little beyond
    rows = list(np.flatnonzero(np.abs(A).sum(axis=1) >= b - SETTINGS.row_clearance))
    for row in list(rows):
        go_on()
        others = [k for k in rows if k != row]
        result = scipy.optimize.linprog(
            -A[row],
            A_ub=A[others],
            b_ub=b[others],
            bounds=[(-2.0, 2.0)] * A.shape[1],
            method="highs",
        )
        most = b[row] + SETTINGS.tolerance
        if result.status == 0 and result.fun is not None and -result.fun <= most:
            rows.remove(row)
    return np.array(rows, dtype=np.intp)


def distinct(points: Array, slack: float) -> Array:
    """Return points (n, d) without near duplicates.

    Points are duplicates if all their coordinates differ by no more than about 10 ``slack``.
    """
    if len(points) < 2:
        return points
    # of very many alike the tree would list all pairs
    cells = np.round(points / (10.0 * slack))
    _, first = np.unique(cells, axis=0, return_index=True)
    points = points[np.sort(first)]
    pairs = scipy.spatial.KDTree(points).query_pairs(10.0 * slack, p=np.inf, output_type="ndarray")
    keep = np.ones(len(points), dtype=bool)
    keep[pairs[:, 1]] = False
    return points[keep]


def hull(points: Array, options: str | None = None) -> scipy.spatial.ConvexHull:
    """Return the convex hull of points (n, r); points are joggled where no exact hull is found.

    Parameters
    ----------
    points : ndarray, shape (n, r)
    options : str, optional
        Qhull's options for the first attempt.

    Raises
    ------
    SolverError
        If the hull of the joggled points fails as well.
    """
    failed = ""
    # not merged where they are wide (Q12), which costs vertices and makes facets that are none
    for tried in (options, "QJ"):  # at last with points moved a little until it succeeds
        go_on()
        try:
            return scipy.spatial.ConvexHull(points, qhull_options=tried)
        except scipy.spatial.QhullError as error:
            failed = str(error).splitlines()[0]
    raise SolverError(f"no convex hull of {len(points)} points found (Qhull said {failed})")


def hull_facets(points: Array) -> tuple[Array, Array]:
    """Return the facets of the convex hull of points (n, r): normals · x ≤ offsets.

    Returns
    -------
    normals, offsets : ndarray, shapes (k, r), (k,)
        Unit outward normals, and their product with the facet's points.
    """
    if points.shape[1] == 1:
        return np.array([[1.0], [-1.0]]), np.array([points.max(), -points.min()])
    try:
        equations = scipy.spatial.ConvexHull(points).equations
    except scipy.spatial.QhullError:
        equations = _planes(points, hull(points, "QJ"))
    _, first = np.unique(np.round(equations, 7) + 0.0, axis=0, return_index=True)
    equations = equations[np.sort(first)]
    return equations[:, :-1], -equations[:, -1]


def _planes(points: Array, found: scipy.spatial.ConvexHull) -> Array:
    """Return the facets' equations of points of which a hull was found joggled.

    Each by the points themselves; slivers, whose corners span no plane of their own or one that
    cuts the hull, are left out.
    """
    corners = points[found.simplices]
    _, sizes, axes = np.linalg.svd(corners[:, 1:] - corners[:, :1])
    normals = axes[:, -1]
    offsets = np.einsum("fi,fi->f", normals, corners[:, 0])
    inside = normals @ points.mean(axis=0) > offsets
    normals[inside] *= -1.0
    offsets[inside] *= -1.0
    # edges of slivers do not span a plane
    spans = sizes[:, -1] > 1e-6 * sizes[:, 0]
    chunk, reach = max(1, SETTINGS.numbers_at_once // len(points)), []
    for k in range(0, len(normals), chunk):
        go_on()
        reach.append(np.max(normals[k : k + chunk] @ points.T, axis=1))
    beyond = np.concatenate(reach) - offsets
    spans &= beyond <= SETTINGS.tolerance * np.abs(points).max()
    return np.column_stack([normals, -offsets])[spans]
