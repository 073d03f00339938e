"""Cut triangles with a plane, join the cut across small gaps, and trim it (compiled).

Several polylines are an array of their points, one after another, and the index at which each ends.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["bridged", "plane_cut", "reached"]


@compiled()
def _edge_name(a: int, b: int, count: int) -> int:
    """Return a number for an edge, the same in both directions."""
    return min(a, b) * count + max(a, b)


@compiled()
def _slot(name: int, size: int) -> int:
    """Return where a number belongs in a table of 2ᵏ slots: neighbours far from each other."""
    mixed = name * 0x9E3779B97F4A7C1
    return (mixed ^ (mixed >> 29)) & (size - 1)


@compiled()
def _matching(names: Indices, among: Indices) -> Indices:
    """Return the index of the first equal name among others for each name; −1 where none is."""
    size = 4
    while size < 2 * len(among):
        size *= 2
    slots = np.full(size, -1)
    for i in range(len(among)):
        slot = _slot(among[i], size)
        while slots[slot] >= 0 and among[slots[slot]] != among[i]:
            slot = (slot + 1) % size
        if slots[slot] < 0:
            slots[slot] = i
    found = np.empty(len(names), dtype=np.intp)
    for i in range(len(names)):
        slot = _slot(names[i], size)
        while slots[slot] >= 0 and among[slots[slot]] != names[i]:
            slot = (slot + 1) % size
        found[i] = slots[slot]
    return found


@compiled()
def _followed(after: Indices) -> tuple[Indices, Indices]:
    """Return chains of indices of which each leads to another, or to none (−1), and their ends.

    A closed chain ends with its first index again.
    """
    led, done = np.zeros(len(after), dtype=np.bool_), np.zeros(len(after), dtype=np.bool_)
    for i in after:
        if i >= 0:
            led[i] = True
    steps, ends = np.empty(2 * len(after), dtype=np.intp), np.empty(len(after), dtype=np.intp)
    total = chains = 0
    # open chains begin where none leads; what is left then is closed
    for closed in (False, True):
        for first in range(len(after)):
            if done[first] or led[first] != closed:
                continue
            step = first
            while step >= 0 and not done[step]:
                done[step] = True
                steps[total] = step
                total += 1
                step = after[step]
            if step == first:
                steps[total] = step
                total += 1
            ends[chains] = total
            chains += 1
    return steps[:total], ends[:chains]


@compiled("f2", "i2", "i1", "f2", "f0")
def plane_cut(
    vertices: Array, faces: Indices, some: Indices, plane: Array, reach: float
) -> tuple[Array, Indices]:
    """Return the polylines in which a plane cuts triangles of a mesh; see `rock.triangles.cut`.

    Parameters
    ----------
    vertices, faces : ndarray, shapes (n, 3) and (m, 3)
        The mesh [m].
    some : ndarray of int, shape (k,)
        Indices of the triangles to cut.
    plane : ndarray, shape (3, 3)
        Origin of the plane's coordinates (s, t) [m], then their axes.
    reach : float
        Triangles outside the square |s|, |t| ≤ reach are left out [m].

    Returns
    -------
    points : ndarray, shape (p, 2)
        Points (s, t) of the polylines, one polyline after another, rock on their left [m].
    stops : ndarray of int
        Index in ``points`` at which each polyline ends.
    """
    origin, s_axis, t_axis = plane
    normal, level = np.empty(3), 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        normal[k] = s_axis[i] * t_axis[j] - s_axis[j] * t_axis[i]
        level += origin[k] * normal[k]
    begins, ends = np.empty((len(some), 2)), np.empty((len(some), 2))
    entered, left = np.empty(len(some), dtype=np.intp), np.empty(len(some), dtype=np.intp)
    height, flat = np.empty(3), np.empty((3, 2))
    count = 0
    for one in some:
        face, beyond = faces[one], 0
        for i in range(3):
            x, y, z = vertices[face[i]]
            height[i] = x * normal[0] + y * normal[1] + z * normal[2] - level
            beyond += height[i] >= 0.0
        if beyond == 0 or beyond == 3:
            continue
        for i in range(3):
            flat[i] = 0.0
            for k in range(3):
                away = vertices[face[i], k] - origin[k]
                flat[i, 0] += away * s_axis[k]
                flat[i, 1] += away * t_axis[k]
        if (
            min(flat[0, 0], flat[1, 0], flat[2, 0]) > reach
            or max(flat[0, 0], flat[1, 0], flat[2, 0]) < -reach
            or min(flat[0, 1], flat[1, 1], flat[2, 1]) > reach
            or max(flat[0, 1], flat[1, 1], flat[2, 1]) < -reach
        ):
            continue
        # turn the triangle so that its first vertex is alone on its side of the plane
        a = 0
        while (height[a] >= 0.0) != (beyond == 1):
            a += 1
        # with the rock on the left, from edge ab to ca if a is beyond the plane, else the other way
        b, c = (a + 1) % 3, (a + 2) % 3
        if beyond == 2:
            b, c = c, b
        entered[count] = _edge_name(face[a], face[b], len(vertices))
        left[count] = _edge_name(face[a], face[c], len(vertices))
        begin, end = height[a] / (height[a] - height[b]), height[a] / (height[a] - height[c])
        for k in range(2):
            begins[count, k] = flat[a, k] + begin * (flat[b, k] - flat[a, k])
            ends[count, k] = flat[a, k] + end * (flat[c, k] - flat[a, k])
        count += 1
    steps, stops = _followed(_matching(left[:count], entered[:count]))
    points = np.empty((len(steps) + len(stops), 2))
    total = start = 0
    for piece in range(len(stops)):
        stop = stops[piece]
        for i in range(start, stop):
            points[total] = begins[steps[i]]
            total += 1
        if stop - start == 1 or steps[start] != steps[stop - 1]:
            points[total] = ends[steps[stop - 1]]
            total += 1
        start, stops[piece] = stop, total
    return points[:total], stops


@compiled()
def _length(points: Array) -> float:
    length = 0.0
    for i in range(len(points) - 1):
        length += math.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
    return length


@compiled("f2", "i1", "f0")
def bridged(points: Array, stops: Indices, gap: float) -> tuple[Array, Indices]:
    """Return open polylines joined across gaps; see `hand_models.rock.triangles.bridge`.

    Polylines, given and returned, are ``points`` (p, 2) [m] and ``stops``, the index at which each
    ends; ``gap``: largest distance that is bridged [m].
    """
    starts = np.empty(len(stops), dtype=np.intp)
    starts[0], starts[1:] = 0, stops[:-1]
    near, pairs = np.empty(16), np.empty((16, 2), dtype=np.intp)
    count = 0
    for i in range(len(stops)):
        for j in range(len(stops)):
            away = points[stops[i] - 1] - points[starts[j]]
            distance = math.hypot(away[0], away[1])
            if distance > gap or (i == j and _length(points[starts[i] : stops[i]]) <= 2.0 * gap):
                continue
            if count == len(near):
                near = np.concatenate((near, near))
                pairs = np.concatenate((pairs, pairs))
            near[count], pairs[count, 0], pairs[count, 1] = distance, i, j
            count += 1
    after, led = np.full(len(stops), -1), np.zeros(len(stops), dtype=np.bool_)
    for pair in np.argsort(near[:count], kind="mergesort"):
        i, j = pairs[pair]
        if after[i] < 0 and not led[j]:
            after[i], led[j] = j, True
    steps, ends = _followed(after)
    joined = np.empty((len(points) + len(ends), 2))
    total = start = 0
    for piece in range(len(ends)):
        end = ends[piece]
        ring = end - start > 1 and steps[start] == steps[end - 1]
        for step in steps[start : end - 1] if ring else steps[start:end]:
            for i in range(starts[step], stops[step]):
                joined[total] = points[i]
                total += 1
        if ring:
            joined[total] = points[starts[steps[start]]]
            total += 1
        start, ends[piece] = end, total
    return joined[:total], ends


@compiled()
def _parts_within(a: Array, b: Array, reach: float) -> tuple[float, float]:
    """Return from where to where, in parts of it, a segment is within the square; last if none."""
    first, last = 0.0, 1.0
    for k in range(2):
        step = b[k] - a[k]
        if max(abs(a[k]), abs(b[k])) <= reach:
            continue
        if step != 0.0:
            low, high = (-reach - a[k]) / step, (reach - a[k]) / step
            first, last = max(first, min(low, high)), min(last, max(low, high))
        elif abs(a[k]) > reach:
            first, last = math.inf, -math.inf
    return first, last


@compiled("f2", "i1", "f0")
def reached(points: Array, stops: Indices, reach: float) -> tuple[Array, Indices, float]:
    """Return the parts of polylines within a square, and the sum of their lengths [m].

    Polylines, given and returned, are points (s, t), shape (p, 2) [m], and the index at which each
    ends; the square is |s|, |t| ≤ ``reach`` [m].
    """
    found, ends = np.empty((3 * len(points), 2)), np.empty(len(points) + len(stops), dtype=np.intp)
    total = runs = start = 0
    for stop in stops:
        piece = points[start:stop]
        start = stop
        outside = -1
        for i in range(len(piece)):
            if outside < 0 and max(abs(piece[i, 0]), abs(piece[i, 1])) > reach:
                outside = i
        if outside < 0:
            found[total : total + len(piece)] = piece
            total += len(piece)
            ends[runs] = total
            runs += 1
            continue
        # begin a ring where nothing is cut apart that belongs together
        ring = piece[0, 0] == piece[-1, 0] and piece[0, 1] == piece[-1, 1]
        turn, around = (outside, len(piece) - 1) if ring else (0, len(piece))
        through = 0.0
        inside = False
        for i in range(len(piece) - 1):
            a, b = piece[(i + turn) % around], piece[(i + turn + 1) % around]
            first, last = _parts_within(a, b, reach)
            if inside and (first > 0.0 or through < 1.0):
                inside = False
                ends[runs] = total
                runs += 1
            through = last
            if first >= last:
                continue
            if not inside:
                found[total] = a + first * (b - a)
                total += 1
            inside = True
            for k in range(2):
                found[total, k] = a[k] + last * (b[k] - a[k]) if last < 1.0 else b[k]
            total += 1
        if inside:
            ends[runs] = total
            runs += 1
    length = 0.0
    start = 0
    for end in ends[:runs]:
        for i in range(start, end - 1):
            length += math.hypot(found[i + 1, 0] - found[i, 0], found[i + 1, 1] - found[i, 1])
        start = end
    return found[:total], ends[:runs], length
