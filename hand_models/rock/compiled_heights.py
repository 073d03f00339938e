"""Heights at which rock of triangles begins under a finger, and where it ends (compiled).

Coordinates (s, y, t) of a finger's plane: s along the finger, t into the rock, y = t × s across.
Rock is seen along t.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["depths_behind", "facing_triangles", "heights_across", "line_depths", "rock_ends"]

Point = tuple[float, float, float]


@compiled()
def _inverse(length: float) -> float:
    return 1.0 / length if length > 0.0 else 0.0


@compiled()
def _part(low: float, high: float, at: float) -> float:
    return (at - low) / (high - low) if high > low else 0.0


@compiled()
def _axes(plane: Array) -> Array:
    """Return the axes s, y and t of a plane."""
    axes = np.empty((3, 3))
    axes[0], axes[2] = plane[1], plane[2]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        axes[1, k] = plane[2, i] * plane[1, j] - plane[2, j] * plane[1, i]
    return axes


@compiled()
def _along_s(triangle: Array) -> tuple[Point, Point, Point]:
    """Return the corners (s, y, t) of a triangle, s ascending."""
    a = (triangle[0, 0], triangle[0, 1], triangle[0, 2])
    b = (triangle[1, 0], triangle[1, 1], triangle[1, 2])
    c = (triangle[2, 0], triangle[2, 1], triangle[2, 2])
    if b[0] < a[0]:
        a, b = b, a
    if c[0] < b[0]:
        b, c = c, b
    if b[0] < a[0]:
        a, b = b, a
    return a, b, c


@compiled("f2", "i2", "i1", "f2", "f0", "f0")
def facing_triangles(
    vertices: Array, faces: Indices, some: Indices, plane: Array, half: float, reach: float
) -> Array:
    """Return the corners (s, y, t) of those triangles that are seen along t in a box.

    Parameters
    ----------
    vertices, faces, some : ndarray
        The mesh [m], and the indices of the triangles that are looked at.
    plane : ndarray, shape (3, 3)
        Origin of the coordinates [m] and both axes s and t.
    half, reach : float
        Half the box's size across the finger, and along s and t [m].

    Returns
    -------
    ndarray, shape (n, 3, 3)
        In the order of each triangle's corners [m].
    """
    axes, found, total = _axes(plane), np.empty((len(some), 3, 3)), 0
    # without a branch, so that the processor waits for the memory of many triangles at once
    for i in range(len(some)):
        for corner in range(3):
            at = faces[some[i], corner]
            x, y, z = vertices[at, 0], vertices[at, 1], vertices[at, 2]
            x, y, z = x - plane[0, 0], y - plane[0, 1], z - plane[0, 2]
            for k in range(3):
                found[i, corner, k] = axes[k, 0] * x + axes[k, 1] * y + axes[k, 2] * z
    for i in range(len(some)):
        inside = True
        for k, most in ((1, half), (2, reach), (0, reach)):
            low = min(found[i, 0, k], found[i, 1, k], found[i, 2, k])
            high = max(found[i, 0, k], found[i, 1, k], found[i, 2, k])
            if low > most or high < -most:
                inside = False
                break
        if not inside:
            continue
        # counterclockwise seen from outside is clockwise in (s, y), as t goes into the rock
        b_s, b_y = found[i, 1, 0] - found[i, 0, 0], found[i, 1, 1] - found[i, 0, 1]
        c_s, c_y = found[i, 2, 0] - found[i, 0, 0], found[i, 2, 1] - found[i, 0, 1]
        if b_s * c_y - c_s * b_y < 0.0:
            for corner in range(3):
                for k in range(3):
                    found[total, corner, k] = found[i, corner, k]
            total += 1
    return found[:total]


@compiled("f3", "f1", "f1", "f1", "f0")
def heights_across(triangles: Array, s: Array, halves: Array, lines: Array, slack: float) -> Array:
    """Return the least t of triangles that face a finger, in slabs and on lines across it.

    Parameters
    ----------
    triangles : ndarray, shape (n, 3, 3)
        Corners (s, y, t) of the triangles, from `facing_triangles` [m].
    s : ndarray, shape (g,)
        Places in equal steps, ascending [m].
    halves : ndarray, shape (h,)
        Half the width of each slab |y| ≤ half [m].
    lines : ndarray, shape (k,)
        y of each line, in equal steps, ascending [m].
    slack : float
        Distance by which a line may pass beside a triangle by rounding [m].

    Returns
    -------
    ndarray, shape (h + k, g)
        Infinite without rock [m].
    """
    slabs = len(halves)
    least = np.full((len(s), slabs + len(lines)), math.inf)
    per_place = 1.0 / (s[1] - s[0])
    per_line = 1.0 / (lines[1] - lines[0]) if len(lines) > 1 else 1.0
    for triangle in triangles:
        # numbers one by one: compiled views of rows would take twice as long
        (a_s, a_y, a_t), (b_s, b_y, b_t), (c_s, c_y, c_t) = _along_s(triangle)
        first = max(math.ceil((a_s - s[0] - slack) * per_place), 0)
        last = min(math.floor((c_s - s[0] + slack) * per_place), len(s) - 1)
        whole, early, late = _inverse(c_s - a_s), _inverse(b_s - a_s), _inverse(c_s - b_s)
        for at in range(first, last + 1):
            # the edge from the first corner to the last crosses the line s = const, and another
            part = min(max((s[at] - a_s) * whole, 0.0), 1.0)
            low, low_t = a_y + part * (c_y - a_y), a_t + part * (c_t - a_t)
            if s[at] < b_s:
                part = min(max((s[at] - a_s) * early, 0.0), 1.0)
                high, high_t = a_y + part * (b_y - a_y), a_t + part * (b_t - a_t)
            else:
                part = min(max((s[at] - b_s) * late, 0.0), 1.0)
                high, high_t = b_y + part * (c_y - b_y), b_t + part * (c_t - b_t)
            if high < low:
                low, low_t, high, high_t = high, high_t, low, low_t
            rise = (high_t - low_t) * _inverse(high - low)
            for i in range(slabs):
                if low <= halves[i] and high >= -halves[i]:
                    here = low_t + max(-halves[i] - low, 0.0) * rise
                    there = low_t + (min(high, halves[i]) - low) * rise
                    least[at, i] = min(least[at, i], here, there)
            begin = max(math.ceil((low - slack - lines[0]) * per_line), 0)
            end = min(math.floor((high + slack - lines[0]) * per_line), len(lines) - 1)
            for line in range(begin, end + 1):
                here = low_t + (min(max(lines[line], low), high) - low) * rise
                least[at, slabs + line] = min(least[at, slabs + line], here)
    return least.T.copy()


@compiled()
def _extend_ends(
    corners: Array, s: Array, slab: Array, least: Array, gap: float, ends: Array
) -> None:
    """Extend the ends of the rock in a slab, (2, g, 2), to where a triangle goes beyond them."""
    count, per_place = len(s), 1.0 / (s[1] - s[0])
    for corner in range(3):
        a, b = corners[corner], corners[(corner + 1) % 3]
        # the corner, and where the edge leaves the slab
        for bound in (a[1], slab[0], slab[1]):
            part = _part(min(a[1], b[1]), max(a[1], b[1]), bound)
            part = part if a[1] <= b[1] else 1.0 - part
            part = 0.0 if bound == a[1] else part
            if not (slab[0] <= bound <= slab[1] and 0.0 <= part <= 1.0):
                continue
            at = a[0] + part * (b[0] - a[0])
            t = a[2] + part * (b[2] - a[2])
            place = (at - s[0]) * per_place
            before, after = math.floor(place), math.ceil(place)
            last = 0 <= before < count - 1 and least[before] < least[before + 1] == math.inf
            last = last and abs(t - least[before]) <= gap
            if last and not (at, -t) <= (ends[1, before, 0], -ends[1, before, 1]):
                ends[1, before, 0], ends[1, before, 1] = at, t
            first = 0 < after < count and least[after] < least[after - 1] == math.inf
            first = first and abs(t - least[after]) <= gap
            if first and not (at, t) >= (ends[0, after, 0], ends[0, after, 1]):
                ends[0, after, 0], ends[0, after, 1] = at, t


@compiled("f3", "f1", "f2", "f2", "f0")
def rock_ends(triangles: Array, s: Array, slabs: Array, least: Array, gap: float) -> Array:
    """Return where the rock in slabs ends, between a place with rock and a neighbour without.

    Parameters
    ----------
    triangles, s
        As of `heights_across`.
    slabs : ndarray, shape (h, 2)
        y of each slab's two sides; the same for a line [m].
    least : ndarray, shape (h, g)
        Least t in each slab at these places, infinite without rock [m].
    gap : float
        Largest difference of an end's t from that of the place beside it [m].

    Returns
    -------
    ndarray, shape (h, 2, g, 2)
        (s, t) of the end before each place and of that after it; NaN where there is none [m].
    """
    count, per_place = len(s), 1.0 / (s[1] - s[0])
    found = np.full((len(slabs), 2, count, 2), math.nan)
    # steps from rock to none or back, up to each place
    changes = np.zeros((count + 1, len(slabs)), np.intp)
    for i in range(count - 1):
        for k in range(len(slabs)):
            step = (least[k, i] < math.inf) != (least[k, i + 1] < math.inf)
            changes[i + 1, k] = changes[i, k] + step
    changes[count] = changes[count - 1]
    for corners in triangles:
        low = min(corners[0, 0], corners[1, 0], corners[2, 0])
        high = max(corners[0, 0], corners[1, 0], corners[2, 0])
        begin = min(max(math.floor((low - s[0]) * per_place) - 1, 0), count)
        end = min(max(math.ceil((high - s[0]) * per_place) + 1, 0), count)
        for k in range(len(slabs)):
            if changes[begin, k] != changes[end, k]:
                _extend_ends(corners, s, slabs[k], least[k], gap, found[k])
    return found


@compiled("f2", "f1", "f1", "f4")
def line_depths(lines: Array, envelope: Array, s: Array, ends: Array) -> Array:
    """Return how far rock on lines across a finger is behind its envelope.

    Beyond the end of a line's rock, that end is what is nearest: as far again as it is along s.

    Parameters
    ----------
    lines, envelope : ndarray, shapes (k, g) and (g,)
        t of the rock on each line, and of the envelope; infinite without rock [m].
    s : ndarray, shape (g,)
        Places in equal steps, ascending [m].
    ends : ndarray, shape (k, 2, g, 2)
        Ends of the rock on each line, as from `rock_ends` [m].

    Returns
    -------
    ndarray, shape (k, g)
        Infinite for a line without rock [m].
    """
    found, count = np.full(lines.shape, math.inf), len(s)
    for k in range(len(lines)):
        for way in (1, -1):
            # depth at the last end, and where that is
            depth, last = math.inf, 0.0
            for step in range(count):
                i = step if way > 0 else count - 1 - step
                beside = i + way
                if lines[k, i] == math.inf:
                    found[k, i] = min(found[k, i], depth + abs(s[i] - last))
                    continue
                found[k, i] = max(lines[k, i] - envelope[i], 0.0)
                if 0 <= beside < count and lines[k, beside] == math.inf:
                    depth, last = found[k, i], s[i]
                    end = ends[k, 1 if way > 0 else 0, i]
                    if not math.isnan(end[0]):
                        last, there = end[0], envelope[i]
                        if envelope[beside] < math.inf:
                            part = abs(last - s[i]) / abs(s[beside] - s[i])
                            there += part * (envelope[beside] - there)
                        depth = max(end[1] - there, 0.0)
    return found


@compiled("f2", "f1", "f2")
def depths_behind(points: Array, s: Array, depths: Array) -> Array:
    """Return how far rock on k lines along a finger lies behind an envelope, at n points of it.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Points (s, t) of the envelope's smoothed outlines [m].
    s : ndarray, shape (g,)
        Places in equal steps, ascending [m].
    depths : ndarray, shape (k, g)
        How far the rock on each line is behind the envelope along t; infinite without rock [m].

    Returns
    -------
    ndarray, shape (n, k)
        Depths along t; infinite without rock [m].
    """
    behind = np.full((len(points), len(depths)), math.inf)
    for i in range(len(points)):
        place = (points[i, 0] - s[0]) / (s[1] - s[0])
        at = min(max(int(place), 0), len(s) - 2)
        for k in range(len(depths)):
            depth = depths[k, at]
            depth += (place - at) * (depths[k, at + 1] - depth)
            if np.isfinite(depth):
                behind[i, k] = depth
    return behind
