"""Heights at which rock begins under a finger, and its envelope across the finger (compiled).

Coordinates (s, y, t) of a finger's plane: s along the finger, t into the rock, y = t × s across.
Rock is seen along t. Several polylines are an array of their points, one after another, and the
index at which each ends.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = [
    "heights_across",
    "least_heights",
    "raised_outlines",
    "rock_ends",
    "seen_corners",
    "seen_outlines",
]


@compiled()
def _between(part: float, low: float, high: float) -> float:
    return low + min(max(part, 0.0), 1.0) * (high - low)


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
def _seen(
    vertices: Array,
    face: Indices,
    origin: Array,
    axes: Array,
    most: tuple[float, float],
    corners: Array,
) -> bool:
    """Write the (s, y, t) of a triangle's corners; return whether it is seen along t.

    ``most``: largest y and t that count, of either sign.
    """
    for corner in range(3):
        for k in range(3):
            corners[corner, k] = 0.0
            for j in range(3):
                corners[corner, k] += axes[k, j] * (vertices[face[corner], j] - origin[j])
    a, b, c = corners
    for k in range(1, 3):
        if min(a[k], b[k], c[k]) > most[k - 1] or max(a[k], b[k], c[k]) < -most[k - 1]:
            return False
    # counterclockwise seen from outside is clockwise in (s, y), as t goes into the rock
    return bool((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]) < 0.0)


@compiled("f2", "i2", "i1", "f2", "f1", "f1", "f1", "f0")
def heights_across(
    vertices: Array,
    faces: Indices,
    some: Indices,
    plane: Array,
    s: Array,
    halves: Array,
    lines: Array,
    slack: float,
) -> Array:
    """Return the least t of triangles that face a finger, in slabs and on lines across it.

    Parameters
    ----------
    vertices, faces, some : ndarray
        The mesh [m], and the indices of the triangles that are looked at.
    plane : ndarray, shape (3, 3)
        Origin of the coordinates [m] and both axes s and t.
    s : ndarray, shape (g,)
        Places in equal steps, ascending [m]; triangles beyond them in s or t are left out.
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
    axes = _axes(plane)
    least = np.full((len(halves) + len(lines), len(s)), math.inf)
    step, widest = s[1] - s[0], halves.max()
    per_line = 1.0 / (lines[1] - lines[0]) if len(lines) > 1 else 1.0
    corners = np.empty((3, 3))
    for one in some:
        if not _seen(vertices, faces[one], plane[0], axes, (widest, s[-1]), corners):
            continue
        a, b, c = corners
        if b[0] < a[0]:
            a, b = b, a
        if c[0] < b[0]:
            b, c = c, b
        if b[0] < a[0]:
            a, b = b, a
        first = max(math.ceil((a[0] - s[0] - slack) / step), 0)
        last = min(math.floor((c[0] - s[0] + slack) / step), len(s) - 1)
        whole, early, late = _inverse(c[0] - a[0]), _inverse(b[0] - a[0]), _inverse(c[0] - b[0])
        for at in range(first, last + 1):
            # the edge from the first corner to the last crosses the line s = const, and another
            part = (s[at] - a[0]) * whole
            low, low_t = _between(part, a[1], c[1]), _between(part, a[2], c[2])
            if s[at] < b[0]:
                part = (s[at] - a[0]) * early
                high, high_t = _between(part, a[1], b[1]), _between(part, a[2], b[2])
            else:
                part = (s[at] - b[0]) * late
                high, high_t = _between(part, b[1], c[1]), _between(part, b[2], c[2])
            if high < low:
                low, low_t, high, high_t = high, high_t, low, low_t
            width = _inverse(high - low)
            for i in range(len(halves)):
                bottom, top = max(low, -halves[i]), min(high, halves[i])
                if bottom <= top:
                    here = _between((bottom - low) * width, low_t, high_t)
                    there = _between((top - low) * width, low_t, high_t)
                    least[i, at] = min(least[i, at], here, there)
            begin = max(math.ceil((low - slack - lines[0]) * per_line), 0)
            end = min(math.floor((high + slack - lines[0]) * per_line), len(lines) - 1)
            for line in range(begin, end + 1):
                i = len(halves) + line
                here = _between((lines[line] - low) * width, low_t, high_t)
                least[i, at] = min(least[i, at], here)
    return least


@compiled("f2", "i2", "i1", "f2", "f1", "f0", "f1", "f0")
def rock_ends(
    vertices: Array,
    faces: Indices,
    some: Indices,
    plane: Array,
    s: Array,
    half: float,
    least: Array,
    gap: float,
) -> Array:
    """Return where the rock in a slab ends, between a place with rock and a neighbour without.

    Parameters
    ----------
    vertices, faces, some, plane, s
        As of `heights_across`.
    half : float
        Half the width of the slab [m].
    least : ndarray, shape (g,)
        Least t in the slab at these places, infinite without rock [m].
    gap : float
        Largest difference of an end's t from that of the place beside it [m].

    Returns
    -------
    ndarray, shape (2, g, 2)
        (s, t) of the end before each place and of that after it; NaN where there is none [m].
    """
    ends, axes, corners = np.full((2, len(s), 2), math.nan), _axes(plane), np.empty((3, 3))
    step, count = s[1] - s[0], len(s)
    for one in some:
        if not _seen(vertices, faces[one], plane[0], axes, (half, s[-1]), corners):
            continue
        for corner in range(3):
            a, b = corners[corner], corners[(corner + 1) % 3]
            # the corner, and where the edge leaves the slab
            for bound in (a[1], -half, half):
                part = _part(min(a[1], b[1]), max(a[1], b[1]), bound)
                part = part if a[1] <= b[1] else 1.0 - part
                part = 0.0 if bound == a[1] else part
                if not (-half <= bound <= half and 0.0 <= part <= 1.0):
                    continue
                at = a[0] + part * (b[0] - a[0])
                t = a[2] + part * (b[2] - a[2])
                place = (at - s[0]) / step
                before, after = math.floor(place), math.ceil(place)
                last = 0 <= before < count - 1 and least[before] < least[before + 1] == math.inf
                last = last and abs(t - least[before]) <= gap
                if last and not (at, -t) <= (ends[1, before, 0], -ends[1, before, 1]):
                    ends[1, before, 0], ends[1, before, 1] = at, t
                first = 0 < after < count and least[after] < least[after - 1] == math.inf
                first = first and abs(t - least[after]) <= gap
                if first and not (at, t) >= (ends[0, after, 0], ends[0, after, 1]):
                    ends[0, after, 0], ends[0, after, 1] = at, t
    return ends


@compiled("f2", "i1")
def seen_outlines(points: Array, stops: Indices) -> tuple[Array, Indices, float]:
    """Return what is seen of outlines along t, and how far overhangs hide rock at most.

    Parameters
    ----------
    points, stops : ndarray
        Outlines (s, t), rock on their left [m].

    Returns
    -------
    points, stops : ndarray
        Outlines with s ascending, with an upright piece at each overhang [m]; each outline by
        itself, whatever others hide of it.
    hidden : float
        Largest distance along s from an overhang's lip to the rock that it hides [m].
    """
    found, ends = np.empty((3 * len(points), 2)), np.empty_like(stops)
    hidden, total, start = 0.0, 0, 0
    for piece in range(len(stops)):
        begin, lip, turned, under, back = total, 0.0, 0.0, False, False
        for i in range(start, stops[piece]):
            s, t = points[i]
            if total == begin:
                found[total] = points[i]
                total += 1
                continue
            before = points[i - 1]
            if under:
                hidden = max(hidden, lip - s)
                if s > lip:
                    part = (lip - before[0]) / (s - before[0])
                    found[total, 0], found[total, 1] = lip, before[1] + part * (t - before[1])
                    found[total + 1] = points[i]
                    total += 2
                    under = False
                continue
            if s >= before[0]:
                back = False
                found[total] = points[i]
                total += 1
                continue
            if not back and i > start + 1:
                old = points[i - 2]
                turn = (before[0] - old[0]) * (t - before[1]) - (before[1] - old[1]) * (
                    s - before[0]
                )
                # a lip is where the outline turns back to the left, into the rock
                under = turn > 0.0
            elif not back:
                under = t > before[1]
            if under:
                lip = before[0]
                hidden = max(hidden, lip - s)
                continue
            # it comes back out over rock that it has passed
            turned = turned if back else before[0]
            back = True
            hidden = max(hidden, turned - s)
            top = found[total - 1]
            while total > begin and found[total - 1, 0] > s:
                top = found[total - 1]
                total -= 1
            if total > begin:
                low = found[total - 1]
                part = (s - low[0]) / (top[0] - low[0])
                found[total, 0], found[total, 1] = s, low[1] + part * (top[1] - low[1])
                total += 1
            found[total] = points[i]
            total += 1
        start, ends[piece] = stops[piece], total
    return found[:total], ends, hidden


@compiled("f2", "i1", "f1")
def least_heights(points: Array, stops: Indices, s: Array) -> Array:
    """Return the least t, (g,), of outlines (s ascending) at ascending places ``s`` [m]."""
    least = np.full(len(s), math.inf)
    start = 0
    for stop in stops:
        at = start
        for i in range(len(s)):
            while at + 1 < stop and points[at + 1, 0] < s[i]:
                at += 1
            if at + 1 < stop and points[at, 0] <= s[i]:
                low, high = points[at], points[at + 1]
                part = _part(low[0], high[0], s[i])
                least[i] = min(least[i], low[1] + part * (high[1] - low[1]))
        start = stop
    return least


@compiled("f2", "i1", "f0")
def seen_corners(points: Array, stops: Indices, slack: float) -> Array:
    """Return the points (s, t) of `seen_outlines` that no other hides by over ``slack`` [m]."""
    order = np.argsort(points[:, 0], kind="mergesort")
    if len(stops) < 2:
        return points[order]
    s, seen, begin = points[order, 0], np.ones(len(points), dtype=np.bool_), 0
    for stop in stops:
        least = least_heights(points[begin:stop], np.array([stop - begin]), s)
        for i in range(len(s)):
            own = begin <= order[i] < stop
            seen[i] &= own or points[order[i], 1] <= least[i] + slack
        begin = stop
    return points[order[seen]]


@compiled("f2", "f1", "f1", "f1", "f3", "f0", "f0")
def raised_outlines(
    points: Array, s: Array, own: Array, least: Array, ends: Array, gap: float, slack: float
) -> tuple[Array, Indices]:
    """Return outlines of an envelope: those of one plane, raised to rock that stands out beside it.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Corners of the outlines in the plane, as from `seen_corners` [m].
    s, own, least : ndarray, shape (g,)
        Places in equal steps, and t of the rock in the plane and of the envelope there; infinite
        without rock [m].
    ends : ndarray, shape (2, g, 2)
        Ends of the envelope, as from `rock_ends` [m].
    gap : float
        Distance of places of the envelope, with none between, that is bridged [m].
    slack : float
        Distance of points that are the same [m].

    Returns
    -------
    points, stops : ndarray
        Corners of the plane's outlines, raised as the places on both sides are, these places, and
        the ends.
    """
    size = len(points) + 2 * len(s)
    found, parted = np.empty((size, 2)), np.zeros(size, dtype=np.bool_)
    total = corner = 0
    for i in range(len(s)):
        rock = least[i] < math.inf
        alone = i == 0 or least[i - 1] == math.inf
        if rock and alone and not np.isnan(ends[0, i, 0]):
            found[total], parted[total] = ends[0, i], True
            total += 1
        while corner < len(points) and points[corner, 0] < s[i]:
            here, t = points[corner]
            corner += 1
            # by how much the plane is raised beside it, or what stands out where it has no rock
            weights, raised, level = np.zeros(2), 0.0, 0.0
            for side in (i - 1, i):
                if side >= 0 and least[side] < math.inf:
                    near = max(1.0 - abs(here - s[side]) / (s[1] - s[0]), 1e-12)
                    weights[1] += near
                    level += near * least[side]
                    if own[side] < math.inf:
                        weights[0] += near
                        raised += near * (own[side] - least[side])
            if weights[1] > 0.0:
                known = weights[0] > 0.0
                t = t - raised / weights[0] if known else min(t, level / weights[1])
                found[total, 0], found[total, 1] = here, t
                total += 1
        if rock:
            found[total, 0], found[total, 1] = s[i], least[i]
            parted[total] = alone and np.isnan(ends[0, i, 0])
            total += 1
        elif i > 0 and not np.isnan(ends[1, i - 1, 0]):
            found[total] = ends[1, i - 1]
            total += 1
    stops = np.empty(total + 1, dtype=np.intp)
    count = runs = begin = 0
    for i in range(total):
        if count > begin:
            away = math.hypot(found[i, 0] - found[count - 1, 0], found[i, 1] - found[count - 1, 1])
            if parted[i] and away > gap:
                stops[runs] = begin = count
                runs += 1
            elif away <= slack:
                continue
        found[count] = found[i]
        count += 1
    if count > begin:
        stops[runs] = count
        runs += 1
    return found[:count], stops[:runs]
