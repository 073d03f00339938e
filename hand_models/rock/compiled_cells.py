"""Find triangles of a mesh by a tree of boxes, and the neighbours of its vertices (compiled).

Triangles in the order of a space-filling curve make up leaves of equally many. Each box of a level
holds two of the level below it, so that a search visits those boxes alone that it meets.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, compiled

__all__ = [
    "curve_places",
    "distances_from",
    "leaf_boxes",
    "lines_met",
    "neighbour_means",
    "solid_triangles",
    "triangles_in_box",
]

LEAF_SIZE: Final = 8
"""Triangles in a leaf; what is found does not depend on it."""


@compiled("f2", "i2")
def curve_places(vertices: Array, faces: Indices) -> Indices:
    """Return the Morton code of each triangle's middle, (m,): its place on a curve through space.

    The mesh has ``vertices`` (n, 3) [m] and ``faces`` (m, 3).
    """
    low, high = np.full(3, math.inf), np.full(3, -math.inf)
    for vertex in vertices:
        for k in range(3):
            low[k], high[k] = min(low[k], vertex[k]), max(high[k], vertex[k])
    bits = 20
    cell = max((high - low).max(), 1e-9) * (1.0 + 1e-9) / 2.0**bits
    places = np.zeros(len(faces), dtype=np.intp)
    for i in range(len(faces)):
        a, b, c = vertices[faces[i, 0]], vertices[faces[i, 1]], vertices[faces[i, 2]]
        for k in range(3):
            number = int(((a[k] + b[k] + c[k]) / 3.0 - low[k]) / cell)
            for bit in range(bits):
                places[i] |= (number >> bit & 1) << (3 * bit + k)
    return places


@compiled("f2", "i2", "f0")
def solid_triangles(vertices: Array, faces: Indices, least: float) -> NDArray[np.bool_]:
    """Return True for each triangle, (m,), that is higher over its longest edge than ``least`` [m].

    The mesh has ``vertices`` (n, 3) [m] and ``faces`` (m, 3).
    """
    solid = np.empty(len(faces), dtype=np.bool_)
    edges, square = np.empty((3, 3)), np.empty(3)
    for i in range(len(faces)):
        square[:] = 0.0
        for side in range(3):
            a, b = faces[i, side], faces[i, (side + 1) % 3]
            for k in range(3):
                edges[side, k] = vertices[b, k] - vertices[a, k]
                square[side] += edges[side, k] ** 2
        area = 0.0  # twice, squared
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            area += (edges[0, m] * edges[1, n] - edges[0, n] * edges[1, m]) ** 2
        solid[i] = area > least**2 * square.max() and square.max() > least**2
    return solid


@compiled()
def _neighbours(faces: Indices, count: int) -> tuple[NDArray[np.int32], Indices]:
    """Return the neighbours of each vertex, ascending, once for each edge, and where they begin."""
    begins = np.zeros(count + 1, dtype=np.intp)
    begins[1:] = np.cumsum(2 * np.bincount(faces.ravel(), minlength=count))
    beside, sorted_ = np.empty(6 * len(faces), np.int32), np.empty(6 * len(faces), np.int32)
    ends, sorted_ends = begins[:-1].copy(), begins[:-1].copy()
    for face in faces:
        for k in range(3):
            for step in (1, 2):
                beside[ends[face[k]]] = face[(k + step) % 3]
                ends[face[k]] += 1
    # each is a neighbour of its neighbours, which so come in order
    for vertex in range(count):
        for other in beside[begins[vertex] : begins[vertex + 1]]:
            sorted_[sorted_ends[other]] = vertex
            sorted_ends[other] += 1
    return sorted_, begins


@compiled("f2", "i2")
def neighbour_means(vertices: Array, faces: Indices) -> tuple[Array, Array]:
    """Return the mean of each vertex's neighbours, (n, 3), and their distance from it, (n,) [m].

    The distance is the root of the mean of their squares; infinite for a vertex on a border, one of
    whose edges has one triangle only. The mesh has ``vertices`` (n, 3) [m] and ``faces`` (m, 3).
    """
    beside, begins = _neighbours(faces, len(vertices))
    means, spreads = np.zeros(vertices.shape), np.empty(len(vertices))
    for i in range(len(vertices)):
        number, square, border, end = 0, 0.0, False, begins[i + 1]
        for at in range(begins[i], end):
            other = beside[at]
            if at > begins[i] and beside[at - 1] == other:
                continue
            number, border = number + 1, border or at + 1 == end or beside[at + 1] != other
            x, y, z = vertices[other, 0], vertices[other, 1], vertices[other, 2]
            square += x * x + y * y + z * z
            for k in range(3):
                means[i, k] += vertices[other, k]
        number, length = max(number, 1), 0.0
        for k in range(3):
            means[i, k] /= number
            length += means[i, k] ** 2
        spreads[i] = math.inf if border else math.sqrt(max(square / number - length, 0.0))
    return means, spreads


@compiled("f2", "i2", "i1")
def leaf_boxes(vertices: Array, faces: Indices, order: Indices) -> Array:
    """Return opposite corners of the box about each leaf of triangles, (n, 2, 3) [m].

    ``order``: indices of the triangles, `LEAF_SIZE` for each leaf, of the mesh of ``vertices`` and
    ``faces``.
    """
    boxes = np.empty(((len(order) + LEAF_SIZE - 1) // LEAF_SIZE, 2, 3))
    boxes[:, 0], boxes[:, 1] = math.inf, -math.inf
    for i in range(len(order)):
        box = boxes[i // LEAF_SIZE]
        for corner in faces[order[i]]:
            for k in range(3):
                box[0, k] = min(box[0, k], vertices[corner, k])
                box[1, k] = max(box[1, k], vertices[corner, k])
    return boxes


@compiled()
def _meets(box: Array, axes: Array, low: Array, high: Array) -> bool:
    """Return whether boxes along the frame's axes and along others may meet."""
    for i in range(len(axes)):
        # rounding must not leave one out
        middle, half = 0.0, 1e-9
        for k in range(3):
            middle += axes[i, k] * 0.5 * (box[0, k] + box[1, k])
            half += abs(axes[i, k]) * 0.5 * (box[1, k] - box[0, k])
        if middle - half > high[i] or middle + half < low[i]:
            return False
    return True


@compiled()
def _leaves(boxes: Array, levels: Indices, axes: Array, low: Array, high: Array) -> Indices:
    """Return the leaves that a box meets."""
    found, count = np.empty(256, dtype=np.intp), 0
    # boxes still to be looked at, at most one of each level and one more
    waiting = np.empty((len(levels) + 1, 2), dtype=np.intp)
    waiting[0, 0], waiting[0, 1] = len(levels) - 2, 0
    more = 1
    while more:
        more -= 1
        level, box = waiting[more]
        if not _meets(boxes[levels[level] + box], axes, low, high):
            continue
        if level == 0:
            if count == len(found):
                found = np.concatenate((found, np.empty_like(found)))
            found[count] = box
            count += 1
            continue
        for child in (2 * box + 1, 2 * box):
            if levels[level - 1] + child < levels[level]:
                waiting[more, 0], waiting[more, 1] = level - 1, child
                more += 1
    return found[:count]


@compiled("i1", "f3", "i1", "f2", "f1", "f1")
def triangles_in_box(
    order: Indices, boxes: Array, levels: Indices, axes: Array, low: Array, high: Array
) -> Indices:
    """Return the indices of the triangles of all leaves that a box meets, leaf by leaf.

    Parameters
    ----------
    order : ndarray of int, shape (m,)
        Indices of the triangles, leaf by leaf.
    boxes : ndarray, shape (n, 2, 3)
        Opposite corners of the boxes, the leaves first, then those of each level above [m].
    levels : ndarray of int, shape (k + 1,)
        Index of the first box of each level, and their number.
    axes, low, high : ndarray
        The box that is searched, as of `TriangleCells.within`.
    """
    leaves = _leaves(boxes, levels, axes, low, high)
    found = np.empty(len(leaves) * LEAF_SIZE, dtype=np.intp)
    count = 0
    for leaf in leaves:
        for i in range(leaf * LEAF_SIZE, min(leaf * LEAF_SIZE + LEAF_SIZE, len(order))):
            found[count] = order[i]
            count += 1
    return found[:count]


@compiled()
def _area(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


@compiled("f2", "i2", "i1", "f3", "i1", "f2", "f2", "f0")
def lines_met(
    vertices: Array,
    faces: Indices,
    order: Indices,
    boxes: Array,
    levels: Indices,
    points: Array,
    axes: Array,
    relative: float,
) -> tuple[Array, Indices]:
    """Return where parallel lines enter the rock, and which side of a triangle they meet first.

    Parameters
    ----------
    vertices, faces, order, boxes, levels
        The mesh and its tree, as of `triangles_in_box`.
    points : ndarray, shape (n, 3)
        A point of each line [m].
    axes : ndarray, shape (3, 3)
        Two unit vectors across the lines, then their direction.
    relative : float
        Share of a triangle's area by which a line may pass beside it by rounding.

    Returns
    -------
    entries : ndarray, shape (n,)
        Distance of each point from the place where the rock begins along the line; negative inside
        the rock, infinite where there is none [m].
    sides : ndarray of int, shape (n,)
        1 if a line meets the front of its first triangle, −1 if the back, 0 if it meets none.
    """
    turn = np.empty(3)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        turn[k] = (axes[0, i] * axes[1, j] - axes[0, j] * axes[1, i]) * axes[2, k]
    handed = turn.sum()
    entries, sides = np.full(len(points), math.inf), np.zeros(len(points), dtype=np.intp)
    middle, corners = np.empty(2), np.empty((3, 3))
    for line, p in enumerate(points):
        for k in range(2):
            middle[k] = axes[k, 0] * p[0] + axes[k, 1] * p[1] + axes[k, 2] * p[2]
        first, first_at = math.inf, -1
        behind, behind_at, inside = -math.inf, -1, False
        ahead = math.inf
        for leaf in _leaves(boxes, levels, axes[:2], middle, middle):
            for i in range(leaf * LEAF_SIZE, min(leaf * LEAF_SIZE + LEAF_SIZE, len(order))):
                at = order[i]
                for corner in range(3):
                    for k in range(3):
                        corners[corner, k] = 0.0
                        for j in range(3):
                            away = vertices[faces[at, corner], j] - p[j]
                            corners[corner, k] += away * axes[k, j]
                a, b, c = corners
                u, v, w = _area(b, c), _area(c, a), _area(a, b)
                area = u + v + w
                slack = relative * abs(area)
                if area == 0.0 or (min(u, v, w) < -slack and max(u, v, w) > slack):
                    continue
                where = (u * a[2] + v * b[2] + w * c[2]) / area
                # counterclockwise from outside is clockwise for a line that enters
                enters = area * handed < 0.0
                # of triangles at the same place the first comes first
                if (where, at) < (first, first_at):
                    first, first_at, sides[line] = where, at, 1 if enters else -1
                if where <= 0.0 and ((where, at) > (behind, behind_at)):
                    behind, behind_at, inside = where, at, enters
                if where > 0.0 and enters:
                    ahead = min(ahead, where)
        entries[line] = behind if inside else ahead
    return entries, sides


@compiled()
def _box_square(box: Array, p: Array) -> float:
    """Return the squared distance of a point from a box; zero inside."""
    total = 0.0
    for k in range(3):
        away = max(box[0, k] - p[k], p[k] - box[1, k], 0.0)
        total += away * away
    return total


@compiled()
def _dot(a: Array, b: Array) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled()
def _on_triangle(d: tuple[float, ...]) -> tuple[float, float]:
    """Return how far along its edges ab and ac the point of a triangle nearest to p is.

    Ericson, *Real-Time Collision Detection* (2005), section 5.1.5. ``d``: the products of ab and of
    ac with p − a, p − b and p − c.
    """
    d1, d2, d3, d4, d5, d6 = d
    if d1 <= 0.0 and d2 <= 0.0:
        return 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 1.0
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return d1 / (d1 - d3), 0.0
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return 0.0, d2 / (d2 - d6)
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = (d4 - d3) / (d4 - d3 + d5 - d6)
        return 1.0 - w, w
    return vb / (va + vb + vc), vc / (va + vb + vc)


@compiled("f2", "i2", "i1", "f3", "i1", "f2", "f0")
def distances_from(
    vertices: Array,
    faces: Indices,
    order: Indices,
    boxes: Array,
    levels: Indices,
    points: Array,
    most: float,
) -> Array:
    """Return the distance of points (n, 3) from a mesh, shape (n,) [m]; negative behind it.

    Where an edge or a corner is nearest, the side is that of the triangle which faces the point the
    most.

    Parameters
    ----------
    vertices, faces, order, boxes, levels
        The mesh and its tree, as of `triangles_in_box`.
    points : ndarray, shape (n, 3)
        Where it is measured from [m].
    most : float
        Distance up to which it is measured [m]; farther points have this one.
    """
    found = np.full(len(points), most)
    # boxes still to be looked at, at most one of each level and one more; the nearer one first
    waiting, squares = np.empty((len(levels) + 1, 2), dtype=np.intp), np.empty(len(levels) + 1)
    ab, ac, away, normal = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(len(points)):
        p, best, height = points[i], most * most, 0.0
        waiting[0, 0], waiting[0, 1], more = len(levels) - 2, 0, 1
        squares[0] = _box_square(boxes[levels[len(levels) - 2]], p)
        while more:
            more -= 1
            # of triangles equally near, which share an edge or a corner, all are looked at
            if squares[more] > best * (1.0 + 1e-9):
                continue
            level, box = waiting[more]
            if level > 0:
                first, second = 2 * box, 2 * box + 1
                near = _box_square(boxes[levels[level - 1] + first], p)
                far = math.inf
                if levels[level - 1] + second < levels[level]:
                    far = _box_square(boxes[levels[level - 1] + second], p)
                if far < near:
                    first, second, near, far = second, first, far, near
                if far < math.inf:
                    waiting[more, 0], waiting[more, 1], squares[more] = level - 1, second, far
                    more += 1
                waiting[more, 0], waiting[more, 1], squares[more] = level - 1, first, near
                more += 1
                continue
            for at in order[box * LEAF_SIZE : (box + 1) * LEAF_SIZE]:
                a, b, c = vertices[faces[at, 0]], vertices[faces[at, 1]], vertices[faces[at, 2]]
                for k in range(3):
                    ab[k], ac[k], away[k] = b[k] - a[k], c[k] - a[k], p[k] - a[k]
                d1, d2 = _dot(ab, away), _dot(ac, away)
                bb, cc, bc = _dot(ab, ab), _dot(ac, ac), _dot(ab, ac)
                v, w = _on_triangle((d1, d2, d1 - bb, d2 - bc, d1 - bc, d2 - cc))
                for k in range(3):
                    away[k] -= v * ab[k] + w * ac[k]
                square = _dot(away, away)
                if square > best * (1.0 + 1e-9):
                    continue
                for k in range(3):
                    m, n = (k + 1) % 3, (k + 2) % 3
                    normal[k] = ab[m] * ac[n] - ab[n] * ac[m]
                over = _dot(normal, away) / math.sqrt(max(_dot(normal, normal), 1e-300))
                if square < best * (1.0 - 1e-9) or abs(over) > abs(height):
                    height = over
                best = min(best, square)
        found[i] = math.copysign(math.sqrt(best), height) if best < most * most else most
    return found
