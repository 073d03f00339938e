"""Triangles of rock: repair a scan's mesh, and cut it with planes.

Scans come open, with holes, spikes and double vertices, and some triangles turned over. They are
welded, freed of degenerate triangles and wound alike. In a cut, every edge that the plane crosses
gives a point, and every crossed triangle links two such edges: the cut's polylines follow from the
edges' names, without comparing coordinates.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

from hand_models.base import BASE_TOLERANCES, Array, Indices, InvalidInputError, go_on
from hand_models.rock.surface import Triangles
from hand_models.sections import strung

__all__ = [
    "TriangleCells",
    "around_holes",
    "border_pairs",
    "bridge",
    "connected",
    "cut",
    "edges_of",
    "grouped",
    "unstrung",
    "weld",
    "without_spikes",
    "wound_alike",
]


def edges_of(faces: Indices) -> Indices:
    """Return the three directed edges of each of ``faces`` (m, 3), as pairs of vertex indices.

    Returns
    -------
    ndarray of int, shape (3 m, 2)
        The first edges of all triangles, then the second, then the third.
    """
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def connected(pairs: Indices, count: int) -> Indices:
    """Return the connected component of each of ``count`` nodes of a graph, numbered from 0.

    The graph's edges are ``pairs`` of nodes, shape (n, 2); the result has shape (count,).
    """
    graph = scipy.sparse.coo_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])


def grouped(some: Indices, parts: Indices) -> list[Indices]:
    """Return items grouped by the part that each belongs to: one array for each part, ascending.

    ``some`` (n,) are the items, which are indices into ``parts``: the part of every item, as
    `connected` returns it. The items of a part stay in the order given.
    """
    order = some[np.argsort(parts[some], kind="stable")]
    return np.split(order, np.flatnonzero(np.diff(parts[order])) + 1) if len(order) else []


def weld(triangles: Triangles) -> Triangles:
    """Merge coinciding vertices of a mesh, and drop triangles without area and duplicates.

    Vertices coincide if their coordinates are equal when rounded to 1e-8 m. A triangle has no area
    if it is no higher than that over its longest edge. Of duplicates the first is kept.
    """
    from hand_models.rock.compiled_cells import solid_triangles

    # [m] far below what any scan resolves, above the rounding of coordinates of 10⁴ m
    finest = 1e-8
    vertices, faces = _merged(_used(triangles), finest)
    go_on()
    faces = faces[solid_triangles(vertices, np.ascontiguousarray(faces), finest)]
    go_on()
    corners = np.sort(faces, axis=1)
    if _repeated(corners):
        faces = faces[np.sort(np.unique(corners, axis=0, return_index=True)[1])]
    go_on()
    return _used(Triangles(vertices, faces))


def _used(triangles: Triangles) -> Triangles:
    """Return a mesh without the vertices that no triangle has."""
    vertices, faces = triangles
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return Triangles(vertices[used], (np.cumsum(used) - 1)[faces])


def _repeated(rows: Indices) -> bool:
    """Return True if any two rows (n, 3) may be equal: these have equal sums, and hardly others."""
    # large odd numbers; products that overflow do so alike
    weights = np.array([0x1E3779B97F4A7C15, 0x3C6EF372FE94F82B, 0x2545F4914F6CDD1D])
    sums = np.sort(rows @ weights)
    return bool((sums[1:] == sums[:-1]).any())


def _merged(triangles: Triangles, finest: float) -> Triangles:
    """Return triangles with one vertex, the first, in place of those that coincide.

    Sorted by one coordinate after another, so that no step takes long.
    """
    vertices, faces = triangles
    cells = np.round(vertices / finest).astype(np.int64)
    go_on()
    if not _repeated(cells):
        return triangles
    order = np.arange(len(vertices))
    for column in cells.T:
        go_on()
        order = order[np.argsort(column[order], kind="stable")]
    go_on()
    begins = np.append(True, (np.diff(cells[order], axis=0) != 0).any(axis=1))
    # of each group the vertex that comes first: sorting has left equals in their order
    first = order[begins]
    place = np.empty(len(vertices), dtype=np.intp)
    place[order] = first[np.cumsum(begins) - 1]
    go_on()
    return _used(Triangles(vertices, place[faces]))


def wound_alike(triangles: Triangles) -> Triangles:
    """Return a mesh of consistent winding: neighbours run along their edge in opposite directions.

    In each connected part the minority of triangles is turned over. Three or more triangles at an
    edge are not neighbours.

    Raises
    ------
    InvalidInputError
        If a part is not orientable, as a Möbius strip; the field is ``faces``.
    """
    faces = triangles.faces
    ends, count = edges_of(faces), len(faces)
    ways = np.sort(ends[:, 0] * len(triangles.vertices) + ends[:, 1])
    # where no edge runs the same way twice, all are wound alike
    if (ways[1:] != ways[:-1]).all():
        return triangles
    first, second, alike = _neighbours(faces)
    if alike.all():
        return triangles
    # a graph of triangles as they are (i) and turned over (count + i)
    turned = np.where(alike, 0, count)
    rows = np.concatenate([first, first + count])
    columns = np.concatenate([second + turned, second + count - turned])
    part = connected(np.column_stack([rows, columns]), 2 * count)
    as_is, over = part[:count], part[count:]
    if (as_is == over).any():
        raise InvalidInputError(
            "the mesh is not orientable: its surface has only one side; cut it where it twists",
            field="faces",
        )
    # of the two ways to wind a part, one keeps more triangles than the other
    kept = np.bincount(as_is, minlength=2 * count)
    flip = kept[over] > kept[as_is]
    ties = kept[over] == kept[as_is]
    flip |= ties & (over < as_is)
    return Triangles(triangles.vertices, np.where(flip[:, None], faces[:, ::-1], faces))


def _neighbours(faces: Indices) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Return pairs of triangles that alone share an edge, and whether they are wound alike."""
    edges = edges_of(faces)
    owner = np.tile(np.arange(len(faces)), 3)
    names = _edge_names(edges[:, 0], edges[:, 1], int(faces.max()) + 1)
    order = np.argsort(names, kind="stable")
    names, owner, ascending = names[order], owner[order], (edges[:, 0] < edges[:, 1])[order]
    # where three or more meet, as where boulders touch, none is the other's neighbour
    alike = np.concatenate([[False], names[:-1] == names[1:], [False]])
    pairs = np.flatnonzero(alike[1:-1] & ~alike[:-2] & ~alike[2:])
    return owner[pairs], owner[pairs + 1], ascending[pairs] != ascending[pairs + 1]


def _edge_names(a: Indices, b: Indices, count: int) -> Indices:
    """Return a number for each edge, the same in both directions."""
    return np.asarray(np.minimum(a, b) * count + np.maximum(a, b))


def without_spikes(triangles: Triangles, ratio: float) -> Triangles:
    """Return a mesh in which each vertex that is a spike is moved to the mean of its neighbours.

    A spike is a single vertex, not on a border, that is farther from the mean of its neighbours
    than ``ratio`` times their root mean square distance from that mean: a needle too steep to be
    rock at the scan's resolution. A peak of several vertices is rock.
    """
    from hand_models.rock.compiled_cells import neighbour_means

    vertices, faces = triangles
    mean, spread = neighbour_means(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    spike = np.linalg.norm(vertices - mean, axis=1) > ratio * spread
    return Triangles(np.where(spike[:, None], mean, vertices), faces)


def border_pairs(triangles: Triangles, gap: float) -> Indices:
    """Return the border edges of a mesh, those that only one triangle has, as pairs of vertices.

    Borders of holes no wider than ``gap`` [m] along every axis are left out. Shape (n, 2).
    """
    vertices, faces = triangles
    ends, count = edges_of(faces), len(vertices)
    names, number = np.unique(_edge_names(ends[:, 0], ends[:, 1], count), return_counts=True)
    edges = np.column_stack(np.divmod(names[number == 1], count))
    part = connected(edges, count)
    low, high = np.full((2, part.max() + 1, 3), np.inf) * np.array([1.0, -1.0])[:, None, None]
    np.minimum.at(low, part, vertices)
    np.maximum.at(high, part, vertices)
    wide = ((high - low) > gap).any(axis=1)
    return np.asarray(edges[wide[part[edges[:, 0]]]])


def around_holes(triangles: Triangles, border: Indices) -> NDArray[np.bool_]:
    """Return which border edges go around a hole, shape (n,).

    The longest border of each part of the surface, by the diagonal of its box, is no hole's but
    the part's outline.
    """
    vertices, faces = triangles
    count = len(vertices)
    # two edges of a triangle connect it
    sides = np.concatenate([faces[:, :2], faces[:, 1:]])
    part, loop = connected(sides, count), connected(border, count)
    hole, outlined = np.zeros(count, np.bool_), set[int]()
    loops = grouped(np.unique(border), loop)
    for each in sorted(loops, key=lambda at: -float(np.linalg.norm(np.ptp(vertices[at], axis=0)))):
        hole[each] = part[each[0]] in outlined
        outlined.add(int(part[each[0]]))
    return hole[border[:, 0]]


def cut(
    triangles: Triangles,
    origin: Array,
    s_axis: Array,
    t_axis: Array,
    reach: float,
    some: Indices | None = None,
) -> list[Array]:
    """Cut a mesh with a plane and return the polylines of the cut, with the rock on their left.

    A vertex on the plane counts as beyond the plane, so that no triangle is met in a single point.

    Parameters
    ----------
    triangles : Triangles
    origin, s_axis, t_axis : ndarray, shape (3,)
        Origin [m] and orthonormal axes of the plane's coordinates (s, t).
    reach : float
        Triangles outside the square −reach ≤ s, t ≤ reach are left out [m].
    some : ndarray of int, optional
        Indices of the triangles to cut; all by default.

    Returns
    -------
    list of ndarray, shape (n, 2)
        Points (s, t) of each polyline; a closed one ends where it begins [m].
    """
    from hand_models.rock.compiled_cuts import plane_cut

    vertices, faces = triangles
    vertices, faces = np.ascontiguousarray(vertices), np.ascontiguousarray(faces)
    some = np.arange(len(faces)) if some is None else some
    plane = np.array([origin, s_axis, t_axis])
    return unstrung(*plane_cut(vertices, faces, some, plane, reach))


def unstrung(points: Array, ends: Indices) -> list[Array]:
    """Split the points (n, 2) of polylines at the indices where each ends, as `strung` has them."""
    return [points[i:j] for i, j in pairwise([0, *ends.tolist()])]


def bridge(pieces: list[Array], gap: float) -> list[Array]:
    """Join polylines where an end is within ``gap`` of a beginning, nearest pairs first.

    A single polyline is closed in the same way if it is longer than twice the gap.

    Parameters
    ----------
    pieces : list of ndarray, shape (n, 2)
        Polylines, open or closed [m].
    gap : float
        Largest distance that is bridged [m].

    Returns
    -------
    list of ndarray, shape (n, 2)
        The closed polylines as given, then the joined ones.
    """
    from hand_models.rock.compiled_cuts import bridged

    rings = [bool((piece[0] == piece[-1]).all()) for piece in pieces]
    closed = [piece for piece, ring in zip(pieces, rings, strict=True) if ring]
    pieces = [piece for piece, ring in zip(pieces, rings, strict=True) if not ring]
    if not pieces:
        return closed
    return [*closed, *unstrung(*bridged(*strung(pieces), gap))]


class TriangleCells:
    """Spatial index of a mesh: finds the triangles in a box through a tree of cells.

    The time of a search grows with the number of triangles that it finds, and with the logarithm
    of the mesh's size.

    Parameters
    ----------
    triangles : Triangles
    """

    def __init__(self, triangles: Triangles) -> None:
        from hand_models.rock.compiled_cells import curve_places, leaf_boxes

        self._triangles = triangles
        self._order = np.argsort(curve_places(*triangles))
        go_on()
        levels = [leaf_boxes(*triangles, self._order)]
        while len(levels[-1]) > 1:
            below = levels[-1]
            pairs = below[::2].copy()
            other = below[1::2]
            np.minimum(pairs[: len(other), 0], other[:, 0], out=pairs[: len(other), 0])
            np.maximum(pairs[: len(other), 1], other[:, 1], out=pairs[: len(other), 1])
            levels.append(pairs)
        self._boxes = np.concatenate(levels)
        self._levels = np.cumsum([0, *map(len, levels)])

    def within(self, axes: Array, low: Array, high: Array) -> Indices:
        """Return candidates for the triangles that reach into a box: all that do, and some more.

        Parameters
        ----------
        axes : ndarray, shape (k, 3)
            Unit vectors of the box; the box has no end in other directions.
        low, high : ndarray, shape (k,)
            Bounds of the box along the axes [m].

        Returns
        -------
        ndarray of int
            Indices of the triangles, ascending.
        """
        from hand_models.rock.compiled_cells import triangles_in_box

        tree = self._order, self._boxes, self._levels
        return np.sort(triangles_in_box(*tree, np.ascontiguousarray(axes), low, high))

    def lines(self, points: Array, direction: Array) -> tuple[Array, Indices]:
        """Return where parallel lines enter the rock, and which side of a triangle they meet first.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            A point of each line [m].
        direction : ndarray, shape (3,)
            Unit vector along all of them.

        Returns
        -------
        entries : ndarray, shape (n,)
            Distance from each point at which rock begins; negative inside the rock, infinite where
            the line meets no front side of a triangle [m].
        sides : ndarray of int, shape (n,)
            1 if the first triangle on a line faces it, −1 if it shows its back, 0 without any.
        """
        from hand_models.rock.compiled_cells import lines_met

        axes = np.vstack([np.linalg.svd(direction[None])[2][1:], direction])
        slack = BASE_TOLERANCES.relative
        (vertices, faces), tree = self._triangles, (self._order, self._boxes, self._levels)
        return lines_met(vertices, faces, *tree, points, axes, slack)

    def distances(self, points: Array, most: float) -> Array:
        """Return how far points are from the mesh, shape (n,) [m]; negative behind its triangles.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            Where it is measured from [m].
        most : float
            Distance up to which it is measured [m]; farther points have this one.
        """
        from hand_models.rock.compiled_cells import distances_from

        (vertices, faces), tree = self._triangles, (self._order, self._boxes, self._levels)
        return distances_from(vertices, faces, *tree, np.ascontiguousarray(points), most)
