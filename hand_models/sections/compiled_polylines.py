"""Search and sample polylines that bound rock: nearest segments, highest places (compiled).

Several polylines are an array of their points, one after another, and the index at which each ends.
Segments are counted through all of them.
"""

from __future__ import annotations

import cmath
import math

import numpy as np

from hand_models.base import Array, Indices, compiled
from hand_models.sections.section import Complexes

__all__ = [
    "equal_parts",
    "highest_rock",
    "nearest_segments",
    "segment_blocks",
    "signed_distances",
]

Blocks = tuple[Indices, Array, Array]
"""What `segment_blocks` returns."""


@compiled()
def _from_segment(vertices: Array, at: int, s: float, t: float) -> tuple[float, float, float]:
    """Return the part of segment ``at`` nearest to (s, t), and the vector from there to (s, t)."""
    x, y = s - vertices[at, 0], t - vertices[at, 1]
    u, v = vertices[at + 1, 0] - vertices[at, 0], vertices[at + 1, 1] - vertices[at, 1]
    part = min(max((x * u + y * v) / (u * u + v * v), 0.0), 1.0)
    return part, x - part * u, y - part * v


@compiled("f2", "i1")
def segment_blocks(vertices: Array, ends: Indices) -> Blocks:
    """Return blocks of up to 16 neighbouring segments of polylines, in their order.

    They are the first segment of each of b blocks and the one after its last, (b, 2); a box about
    them, (b, 6): its centre, the unit vector from the first to the last point, half its length
    along that and across, rounded up [m]; and their longest segment, (b,) [m].
    """
    each, count, begin = 16, 0, 0
    for end in ends:
        count += (end - begin + each - 2) // each
        begin = end
    spans, boxes = np.empty((count, 2), dtype=np.intp), np.empty((count, 6))
    longest, block, begin = np.full(count, 1e-9), 0, 0
    for end in ends:
        for first in range(begin, end - 1, each):
            after = min(first + each, end - 1)
            s, t = vertices[first]
            u, v = vertices[after, 0] - s, vertices[after, 1] - t
            size = math.sqrt(u * u + v * v)
            u, v = (u / size, v / size) if size > 0.0 else (1.0, 0.0)
            back, far, low, high = 0.0, 0.0, 0.0, 0.0
            for i in range(first, after):
                x, y = vertices[i + 1, 0] - s, vertices[i + 1, 1] - t
                along, across = x * u + y * v, y * u - x * v
                back, far, low, high = (
                    *(min(back, along), max(far, along)),
                    *(min(low, across), max(high, across)),
                )
                x, y = vertices[i + 1, 0] - vertices[i, 0], vertices[i + 1, 1] - vertices[i, 1]
                longest[block] = max(longest[block], math.sqrt(x * x + y * y))
            spans[block, 0], spans[block, 1] = first, after
            along, across = 0.5 * (back + far), 0.5 * (low + high)
            boxes[block, 0], boxes[block, 1] = (
                s + along * u - across * v,
                t + along * v + across * u,
            )
            boxes[block, 2], boxes[block, 3] = u, v
            more = 1e-12 * (far - back + high - low + abs(s) + abs(t)) + 1e-15
            boxes[block, 4], boxes[block, 5] = 0.5 * (far - back) + more, 0.5 * (high - low) + more
            block += 1
        begin = end
    return spans, boxes, longest


@compiled()
def _beside_box(boxes: Array, block: int, s: float, t: float) -> float:
    """Return the square of the distance of a point from the box about a block [m²]."""
    x, y = s - boxes[block, 0], t - boxes[block, 1]
    u, v = boxes[block, 2], boxes[block, 3]
    along = max(abs(x * u + y * v) - boxes[block, 4], 0.0)
    across = max(abs(y * u - x * v) - boxes[block, 5], 0.0)
    return float(along * along + across * across)


@compiled("f2", "i2 f2 f1", "f2")
def nearest_segments(
    vertices: Array, blocks: Blocks, points: Array
) -> tuple[Indices, Array, Array]:
    """Return the nearest segment to each of n points.

    Parameters
    ----------
    vertices : ndarray, shape (p, 2)
        Points of the polylines [m].
    blocks : tuple of ndarray
        Their `segment_blocks`.
    points : ndarray, shape (n, 2)
        Points (s, t) [m].

    Returns
    -------
    segments : ndarray of int, shape (n,)
        Index of the point of the polylines at which the segment begins.
    parts : ndarray, shape (n,)
        Place nearest to the point as a share of the segment's length, in [0, 1].
    away : ndarray, shape (n, 2)
        Vector (s, t) from that place to the point [m].
    """
    spans, boxes, longest = blocks
    segments, parts = np.zeros(len(points), dtype=np.intp), np.zeros(len(points))
    away, nearest, near, count = np.empty((len(points), 2)), 0, np.empty(len(spans), np.intp), 0
    # points follow each other: blocks that may have what is nearest to one are so for those that
    # are no farther from it than this
    reach = 4.0 * longest.mean() if len(longest) else 0.0  # [m]
    s_0, t_0, far = math.inf, math.inf, 0.0
    for i in range(len(points)):
        s, t = points[i]
        # the segment nearest to the point before is near to this one
        _, x, y = _from_segment(vertices, nearest, s, t)
        least = math.sqrt(x * x + y * y) * (1.0 + 1e-12) + 1e-15  # [m] it is found once more
        moved, square = math.sqrt((s - s_0) ** 2 + (t - t_0) ** 2), math.inf
        # and the first point may be far from the first segment, and so have all of them
        if least > far - moved or far > 2.0 * (least + 2.0 * reach):
            s_0, t_0, far, count = s, t, least + 2.0 * reach, 0
            for block in range(len(spans)):
                near[count] = block
                count += 1 if _beside_box(boxes, block, s, t) <= far * far else 0
        for block in near[:count]:
            if _beside_box(boxes, block, s, t) > least * least:
                continue
            at, end = spans[block]
            while at < end:
                x, y = s - vertices[at, 0], t - vertices[at, 1]
                # what is within so many segments of a vertex that is farther is farther, too
                if x * x + y * y > (least + longest[block]) ** 2:
                    at += max(int((math.sqrt(x * x + y * y) - least) / longest[block]), 1)
                    continue
                part, x, y = _from_segment(vertices, at, s, t)
                if x * x + y * y < square:
                    square = x * x + y * y
                    least = min(least, math.sqrt(square))
                    nearest, segments[i], parts[i] = at, at, part
                    away[i, 0], away[i, 1] = x, y
                at += 1
    return segments, parts, away


@compiled()
def _out(vertices: Array, at: int, way: Array) -> float:
    """Return how far a way leads out of the rock, along the normal of segment ``at``."""
    u, v = vertices[at + 1, 0] - vertices[at, 0], vertices[at + 1, 1] - vertices[at, 1]
    return float((way[0] * v - way[1] * u) / math.sqrt(u * u + v * v))


@compiled("f2", "i1", "i2 f2 f1", "f2")
def signed_distances(vertices: Array, ends: Indices, blocks: Blocks, points: Array) -> Array:
    """Return the distance of each of n points from polylines, negative inside the rock, (n,) [m].

    Where rock ends nothing is inside. ``ends``: index at which each polyline ends, (k,); the other
    arguments are those of `nearest_segments`.
    """
    segments, parts, away = nearest_segments(vertices, blocks, points)
    found = np.empty(len(points))
    for i in range(len(points)):
        at, piece = segments[i], 0
        while ends[piece] <= at:
            piece += 1
        first, last = ends[piece - 1] if piece else 0, ends[piece] - 1
        ring = vertices[first, 0] == vertices[last, 0] and vertices[first, 1] == vertices[last, 1]
        out = _out(vertices, at, away[i])
        # at a corner both its segments count
        if parts[i] <= 0.0:
            before = at - 1 if at > first else last - 1
            out = out + _out(vertices, before, away[i]) if at > first or ring else 0.0
        elif parts[i] >= 1.0:
            after = at + 1 if at + 1 < last else first
            out = out + _out(vertices, after, away[i]) if at + 1 < last or ring else 0.0
        distance = math.sqrt(away[i, 0] ** 2 + away[i, 1] ** 2)
        found[i] = -distance if out < 0.0 else distance
    return found


@compiled("f2", "i1", "f1", "f1")
def highest_rock(vertices: Array, ends: Indices, low: Array, high: Array) -> Array:
    """Return the least t of polylines in each of n windows of s, (n,) [m]; infinite without rock.

    ``vertices`` (p, 2) and ``ends``: points of the polylines [m], and the index at which each ends;
    ``low`` and ``high``, (n,): the windows low ≤ s ≤ high [m].
    """
    # the bounds of pieces of up to 16 points, with the first point of what follows them
    each, bounds, count, begin = 16, np.empty((len(vertices) // 16 + len(ends), 3)), 0, 0
    spans = np.empty((len(bounds), 3), dtype=np.intp)
    for end in ends:
        for first in range(begin, end, each):
            after = min(first + each, end)
            own = vertices[first : min(after + 1, end)]
            bounds[count, 0], bounds[count, 1] = own[:, 0].min(), own[:, 0].max()
            bounds[count, 2] = own[:, 1].min()
            spans[count, 0], spans[count, 1], spans[count, 2] = first, after, end
            count += 1
        begin = end
    least = np.full(len(low), math.inf)
    for i in range(len(low)):
        for piece in range(count):
            beside = bounds[piece, 1] < low[i] or bounds[piece, 0] > high[i]
            if beside or bounds[piece, 2] >= least[i]:
                continue
            first, after, end = spans[piece]
            for at in range(first, after):
                s, t = vertices[at]
                if low[i] <= s <= high[i]:
                    least[i] = min(least[i], t)
                if at + 1 == end:
                    continue
                s_after, t_after = vertices[at + 1]
                for bound in (low[i], high[i]):
                    if (s < bound) != (s_after < bound):
                        part = (bound - s) / (s_after - s)
                        least[i] = min(least[i], t + part * (t_after - t))
    return least


@compiled("c1", "f1", "f0", "f0", "f0")
def equal_parts(
    chain: Complexes, sizes: Array, reach: float, spacing: float, relative: float
) -> tuple[Complexes, Array]:
    """Return places on a curve, at its corners and in equal steps between, and their lengths [m].

    Parameters
    ----------
    chain : ndarray of complex, shape (n,)
        Points s + i t of the curve [m].
    sizes : ndarray, shape (n − 1,)
        Distances from each point to the next [m].
    reach : float
        Distance from the origin beyond which places are left out [m].
    spacing : float
        Largest step [m].
    relative : float
        Part of a step by which steps may be too long by rounding.
    """
    count = len(chain) - 1
    at, near, step = np.zeros(count + 1), np.zeros(count + 1, np.bool_), np.diff(chain)
    whole = 0.0
    for i in range(count):
        part = -(chain[i] * step[i].conjugate()).real / max(sizes[i] * sizes[i], 1e-24)
        near[i] = abs(chain[i] + min(max(part, 0.0), 1.0) * step[i]) <= reach
        whole += sizes[i] if near[i] else 0.0
    most = int(whole / spacing) + 2 * count + 2
    points, lengths = np.empty(most, np.complex128), np.empty(most)
    total = first = 0
    for i in range(count):
        at[i + 1] = at[i] + sizes[i]
        if not near[i]:
            first, at[i + 1] = i + 1, 0.0
            continue
        turn = step[min(i + 1, count - 1)] * step[i].conjugate()
        if near[i + 1] and abs(cmath.phase(turn)) <= math.radians(15.0):
            continue
        length = at[i + 1]
        parts = max(math.ceil(length / spacing - relative), 1)
        for k in range(parts + 1):
            place = k * (length / parts) if k < parts else length
            while first <= i and at[first + 1] <= place:
                first += 1
            points[total] = chain[first]
            if first <= i:
                per_length = 1.0 / (at[first + 1] - at[first])
                along, into = step[first].real * per_length, step[first].imag * per_length
                points[total] += complex(along, into) * (place - at[first])
            lengths[total] = length / parts * (0.5 if k in (0, parts) else 1.0)
            x, y = points[total].real, points[total].imag
            total += 1 if x * x + y * y <= reach * reach else 0
        first, at[i + 1] = i + 1, 0.0
    return points[:total], lengths[:total]
