"""Thin points and triangulate them across the view, a million in half a second (compiled).

Triangles are those of Delaunay. Points are added in the order of their distance from a centre, so
that each is outside the hull of those before it: it is joined to the edges of the hull that it
sees, and edges are flipped until no point lies in the circle about a triangle. Coordinates are
whole numbers of so few digits that the side of a line on which a point lies is exact: no triangle
is turned over, whatever the points.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, compiled

__all__ = ["bridged_widths", "delaunay_triangles", "median_points", "vertex_normals"]


@compiled()
def _before(depths: Array, a: int, b: int) -> bool:
    return bool(depths[a] < depths[b] or (depths[a] == depths[b] and a < b))


@compiled()
def _median(depths: Array, some: Indices, low: int, high: int) -> int:
    """Return the median of ``some[low : high + 1]`` by depth, which are exchanged (quickselect)."""
    middle = (low + high) // 2
    while low < high:
        pivot, i, j = some[(low + high) // 2], low, high
        while i <= j:
            while _before(depths, some[i], pivot):
                i += 1
            while _before(depths, pivot, some[j]):
                j -= 1
            if i <= j:
                some[i], some[j] = some[j], some[i]
                i, j = i + 1, j - 1
        if j < middle < i:
            break
        low, high = (low, j) if middle <= j else (i, high)
    return int(some[middle])


@compiled("f1", "i1", "i1")
def median_points(depths: Array, squares: Indices, order: Indices) -> Indices:
    """Return the point of median depth of each square that has any, square by square.

    Of two middle ones the nearer is returned, and of equal depths the first comes first.

    Parameters
    ----------
    depths : ndarray, shape (n,)
        Depth of each point [m].
    squares : ndarray of int, shape (n,)
        Number of the square in which each point is.
    order : ndarray of int, shape (n,)
        Indices of the points, square by square, those of a square in any order.
    """
    kept, found, count, begin = np.empty(len(order), dtype=np.intp), order.copy(), 0, 0
    while begin < len(order):
        end, square = begin + 1, squares[order[begin]]
        while end < len(order) and squares[order[end]] == square:
            end += 1
        kept[count] = _median(depths, found, begin, end - 1)
        count, begin = count + 1, end
    return kept[:count]


@compiled()
def _turn(points: Indices, a: int, b: int, c: int) -> int:
    """Return twice the area of a triangle, exactly: above zero if it runs counterclockwise."""
    ax, ay = points[a]
    return int(
        (points[b, 0] - ax) * (points[c, 1] - ay) - (points[b, 1] - ay) * (points[c, 0] - ax)
    )


@compiled()
def _in_circle(points: Indices, a: int, b: int, c: int, d: int) -> bool:
    """Return True if d lies within the circle about a counterclockwise triangle."""
    x, y = float(points[d, 0]), float(points[d, 1])
    ax, ay = points[a, 0] - x, points[a, 1] - y
    bx, by = points[b, 0] - x, points[b, 1] - y
    cx, cy = points[c, 0] - x, points[c, 1] - y
    aa, bb, cc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
    first, second, third = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    size = aa * abs(first) + bb * abs(second) + cc * abs(third)
    # more than by rounding
    return bool(aa * first + bb * second + cc * third > 1e-12 * size)


@compiled()
def _flipped(
    points: Indices,
    corners: NDArray[np.int32],
    beyond: NDArray[np.int32],
    hull: NDArray[np.int32],
    waiting: NDArray[np.int32],
    edge: int,
) -> int:
    """Flip edges about a new point, from one opposite to it, and return the edge that ends there.

    Edge ``3 i + k`` of triangle i goes from its corner k to the next; ``beyond`` has the
    neighbour's edge between the same points, ``hull`` the edge of the hull that leaves a point.
    """
    count = 0
    while True:
        other = beyond[edge]
        last = edge - edge % 3 + (edge + 2) % 3
        if other >= 0:
            after, across = edge - edge % 3 + (edge + 1) % 3, other - other % 3 + (other + 2) % 3
            new, right, left, far = corners[last], corners[edge], corners[after], corners[across]
            if (
                _in_circle(points, new, right, left, far)
                and _turn(points, new, right, far) > 0
                and _turn(points, new, far, left) > 0
            ):
                corners[edge], corners[other] = far, new
                outer, inner = beyond[across], beyond[last]
                beyond[edge], beyond[other] = outer, inner
                beyond[last], beyond[across] = across, last
                if outer >= 0:
                    beyond[outer] = edge
                else:
                    hull[far] = edge
                if inner >= 0:
                    beyond[inner] = other
                waiting[count] = other - other % 3 + (other + 1) % 3
                count += 1
                continue
        if count == 0:
            return last
        count -= 1
        edge = waiting[count]


@compiled("i2", "i1")
def delaunay_triangles(points: Indices, centre: Indices) -> tuple[Indices, Indices]:
    """Return the triangles of the Delaunay triangulation of points, and their neighbours.

    Parameters
    ----------
    points : ndarray of int, shape (n, 2)
        Coordinates from 0 to 2^30, not all on a line, in the order of their distance from
        ``centre``. Of equal points one is used.
    centre : ndarray of int, shape (2,)
        Point from which the triangulation grows.

    Returns
    -------
    corners : ndarray of int, shape (m, 3)
        Indices of each triangle's points, counterclockwise.
    beside : ndarray of int, shape (m, 3)
        Index of the neighbour across the edge from each corner to the next, −1 for none.
    """
    size = len(points)
    corners, beyond = np.empty(6 * size, dtype=np.int32), np.full(6 * size, -1, dtype=np.int32)
    # of each point on the hull the next one, the one before, and the edge that leaves it
    ahead, behind = np.full(size, -1, dtype=np.int32), np.full(size, -1, dtype=np.int32)
    hull, waiting = np.empty(size, dtype=np.int32), np.empty(size + 3, dtype=np.int32)
    # points of the hull by their direction from the centre: where the search for an edge begins
    some = math.ceil(math.sqrt(size))
    toward = np.full(some, -1, dtype=np.int32)
    directions = np.empty(size, dtype=np.int32)
    for i in range(size):
        turn = math.atan2(points[i, 1] - centre[1], points[i, 0] - centre[0])
        directions[i] = int((0.5 + turn / (2.0 * math.pi)) * some) % some
    one = 1
    while points[one, 0] == points[0, 0] and points[one, 1] == points[0, 1]:
        one += 1
    third = one + 1
    while _turn(points, 0, one, third) == 0:
        third += 1
    first = (0, one, third) if _turn(points, 0, one, third) > 0 else (0, third, one)
    for k in range(3):
        corners[k] = first[k]
        ahead[first[k]], behind[first[k]] = first[(k + 1) % 3], first[(k + 2) % 3]
        hull[first[k]] = k
        toward[directions[first[k]]] = first[k]
    count = 3
    for i in range(1, size):
        if i in (one, third):
            continue
        start = -1
        for j in range(some):
            start = toward[(directions[i] + j) % some]
            if start >= 0 and ahead[start] >= 0:
                break
        # an edge that the point sees, and of all these the first
        edge = start = behind[start]
        while _turn(points, i, edge, ahead[edge]) >= 0 and ahead[edge] != start:
            edge = ahead[edge]
        if _turn(points, i, edge, ahead[edge]) >= 0:
            # equal to a point of the hull
            continue
        while _turn(points, i, behind[edge], edge) < 0:
            edge = behind[edge]
        begin = end = edge
        while end == edge or _turn(points, i, begin, ahead[begin]) < 0:
            end = ahead[begin]
            corners[count], corners[count + 1], corners[count + 2] = begin, i, end
            beyond[count + 2], beyond[hull[begin]] = hull[begin], count + 2
            if begin == edge:
                hull[begin] = count
            else:
                beyond[count], beyond[hull[i]] = hull[i], count
                ahead[begin] = -1
            hull[i] = _flipped(points, corners, beyond, hull, waiting, count + 2)
            begin, count = end, count + 3
        ahead[edge], behind[i], ahead[i], behind[end] = i, edge, end, i
        toward[directions[i]], toward[directions[edge]] = i, edge
    found = corners[:count].reshape(-1, 3).astype(np.intp)
    beside = np.empty((count // 3, 3), dtype=np.intp)
    for i in range(count):
        beside[i // 3, i % 3] = beyond[i] // 3 if beyond[i] >= 0 else -1
    return found, beside


@compiled("f2", "i2", "i2")
def bridged_widths(points: Array, corners: Indices, beside: Indices) -> tuple[Array, Array]:
    """Return the width that each triangle bridges [m], and its area across z [m²], both (m,).

    Arguments and results are the attributes of `Gaps`.
    """
    width, area = np.empty(len(corners)), np.empty(len(corners))
    for i in range(len(corners)):
        a, b, c = points[corners[i, 0]], points[corners[i, 1]], points[corners[i, 2]]
        signed = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        twice = abs(signed)
        product, widest, longest = 1.0, 0.0, 0.0
        for p, q in ((a, b), (b, c), (c, a)):
            across = math.hypot(q[0] - p[0], q[1] - p[1])
            product, widest = product * across, max(widest, across)
            longest = max(longest, math.hypot(across, q[2] - p[2]))
        # hardly any area, as a part of the longest edge's square
        if twice > 1e-6 * widest**2:
            longest = max(longest, product / twice)
        elif beside[i].min() < 0 or signed <= 0.0:
            # of points on a line, along the outline; rounding may have turned it over
            longest = math.inf
        width[i], area[i] = longest, 0.5 * twice
    return width, area


@compiled("f2", "i2")
def vertex_normals(points: Array, faces: Indices) -> Array:
    """Return the unit normal of each vertex, (n, 3): the mean of its triangles' by their area.

    ``points`` (n, 3) [m] and ``faces`` (m, 3): the mesh. A vertex without triangles has zeros.
    """
    normals, areas = np.zeros(points.shape), np.empty(faces.shape)
    u, v = np.empty(3), np.empty(3)
    for i in range(len(faces)):
        a, b, c = faces[i]
        for k in range(3):
            u[k], v[k] = points[b, k] - points[a, k], points[c, k] - points[a, k]
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            areas[i, k] = 0.5 * (u[m] * v[n] - u[n] * v[m])
    for corner in range(3):
        for i in range(len(faces)):
            for k in range(3):
                normals[faces[i, corner], k] += areas[i, k]
    for normal in normals:
        square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]
        length = max(math.sqrt(square), 1e-300)  # divides what is zero
        for k in range(3):
            normal[k] /= length
    return normals
