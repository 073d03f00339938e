"""Outlines as seen in the plane of a finger, and the envelope across the finger (compiled).

Coordinates (s, t) of a finger's plane: s along the finger, t into the rock. Rock is seen along t.
Several polylines are an array of their points, one after another, and the index at which each ends.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["least_heights", "raised_outlines", "seen_corners", "seen_outlines"]


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
                width = high[0] - low[0]
                part = (s[i] - low[0]) / width if width > 0.0 else 0.0
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
