"""Outlines as seen in the reach and plane of a finger, and the envelope across it (compiled).

Coordinates (s, t) of a finger's plane: s along the finger, t into the rock. Rock is seen along t.
Several polylines are an array of their points, one after another, and the index at which each ends.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = [
    "least_heights",
    "opened_overhangs",
    "raised_outlines",
    "seen_corners",
    "seen_outlines",
    "widened_outline",
]


@compiled()
def _near_part(a: Array, b: Array, reach: float, begin: float) -> tuple[float, float]:
    """Return the least and the largest s ≥ ``begin`` of a segment within reach; NaN if none."""
    ds, dt = b[0] - a[0], b[1] - a[1]
    square, along = ds * ds + dt * dt, a[0] * ds + a[1] * dt
    inside = along * along - square * (a[0] * a[0] + a[1] * a[1] - reach * reach)
    if square > 0.0 and inside >= 0.0:
        first = max((-along - math.sqrt(inside)) / square, 0.0)
        last = min((-along + math.sqrt(inside)) / square, 1.0)
        low, high = a[0] + first * ds, a[0] + last * ds
        low, high = max(min(low, high), begin), max(low, high)
        if first <= last and low <= high:
            return low, high
    return math.nan, math.nan


@compiled("f2", "i1", "f0")
def seen_outlines(points: Array, stops: Indices, reach: float) -> tuple[Array, Indices, float]:
    """Return what is seen of outlines along t, and how far overhangs hide rock from a finger.

    A finger begins at the origin, along s, and curls toward −s as it closes. So it may reach under
    a lip that ends the rock toward +s, even one behind the origin, and before the origin under any.

    Parameters
    ----------
    points, stops : ndarray
        Outlines (s, t), rock on their left [m].
    reach : float
        Distance from the origin beyond which a finger reaches nothing [m].

    Returns
    -------
    points, stops : ndarray
        Outlines with s ascending, with an upright piece at each overhang [m]; each outline by
        itself, whatever others hide of it.
    hidden : float
        Largest distance along s from an overhang's lip to the rock that it hides, both where a
        finger may reach them [m].
    """
    found, ends = np.empty((3 * len(points), 2)), np.empty_like(stops)
    hidden, total, start = 0.0, 0, 0
    for piece in range(len(stops)):
        begin, under, back = total, False, False
        lip = edge = math.nan
        for i in range(start, stops[piece]):
            s, t = points[i]
            if total == begin:
                found[total] = points[i]
                total += 1
                continue
            before = points[i - 1]
            if under and s > lip:
                part = (lip - before[0]) / (s - before[0])
                found[total, 0], found[total, 1] = lip, before[1] + part * (t - before[1])
                found[total + 1] = points[i]
                total += 2
                under = False
                continue
            if not under and s >= before[0]:
                back = False
                found[total] = points[i]
                total += 1
                continue
            if not under and not back:
                if i > start + 1:
                    old = points[i - 2]
                    turn = (before[0] - old[0]) * (t - before[1]) - (before[1] - old[1]) * (
                        s - before[0]
                    )
                    # a lip is where the outline turns back to the left, into the rock
                    under = turn > 0.0
                else:
                    under = t > before[1]
                back, lip = not under, before[0]
                # the lip, or where rock begins that is passed again, if within reach
                edge = lip if under and math.hypot(before[0], before[1]) <= reach else math.nan
            least, most = _near_part(before, points[i], reach, -math.inf if under else 0.0)
            if back and math.isnan(edge):
                edge = most
            if edge - least > hidden:
                hidden = edge - least
            if under:
                continue
            # it comes back out over rock that it has passed
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


@compiled()
def _mirrored(points: Array) -> Array:
    """Return an outline with s turned round, rock on its left again."""
    found = np.empty_like(points)
    for i in range(len(points)):
        found[-1 - i, 0], found[-1 - i, 1] = -points[i, 0], points[i, 1]
    return found


@compiled()
def _opened(points: Array, depth: float) -> Array:
    """Return an outline with what lips toward +s hide closed, from so far behind each lip on."""
    found = np.empty((2 * len(points), 2))
    found[0], total = points[0], 1
    under, back, lip = False, False, points[0, 0]
    for i in range(1, len(points)):
        (s, t), (at, into) = points[i - 1], points[i]
        if not under and at >= s:
            back = False
        elif not under and not back:
            under = into > t
            if i > 1:
                # a lip is where the outline turns back to the left, into the rock
                turn = (s - points[i - 2, 0]) * (into - t) - (t - points[i - 2, 1]) * (at - s)
                under = turn > 0.0
            back, lip = not under, s
        bound = lip - depth if under else -math.inf
        if (s < bound) != (at < bound):
            found[total, 0], found[total, 1] = bound, t + (bound - s) / (at - s) * (into - t)
            total += 1
        if at >= bound:
            found[total] = points[i]
            total += 1
        under = under and at <= lip
    return found[:total]


@compiled("f2", "f0")
def opened_overhangs(points: Array, depth: float) -> Array:
    """Return an outline (s, t), (n, 2), with overhangs that are open so far behind their lips [m].

    An upright piece closes what is farther behind a lip, along s. With a depth of zero only that
    is left which `seen_outlines` sees, with an infinite one everything.
    """
    return _mirrored(_opened(_mirrored(_opened(points, depth)), depth))


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


@compiled()
def _part(low: float, high: float, here: float) -> float:
    return min(max((here - low) / (high - low), 0.0), 1.0) if high > low else 0.0


@compiled()
def _raised(t: float, own: float, least: float) -> float:
    """Return t raised as the plane's rock beside it is; no farther than what is where it ended."""
    return t - (own - least) if own < math.inf else min(t, least)


@compiled()
def _raised_between(t: float, part: float, own: Array, least: Array, even: float) -> float:
    """Return t raised as the plane's rock at two places beside it is, at a part of the way between.

    It is as far from the envelope's chord as from its own rock's, in proportion less where that is
    steeper, or falls where the envelope rises; ``even`` is the step between places up to which rock
    is not steep. Between places this is affine: corners on a straight piece change nothing. It is
    never raised behind its own rock. Where the plane's rock ends it is raised to the chord at most.
    """
    step, chord = own[1] - own[0], least[0] + part * (least[1] - least[0])
    if max(own[0], own[1]) == math.inf:
        return float(min(t, chord))
    like = ((least[1] - least[0]) * step + even * even) / (step * step + even * even)
    return float(min(chord + min(max(like, 0.0), 1.0) * (t - (own[0] + part * step)), t))


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
            if rock and not alone:
                part = (here - s[i - 1]) / (s[i] - s[i - 1])
                sides = slice(i - 1, i + 1)
                raised = _raised_between(t, part, own[sides], least[sides], s[i] - s[i - 1])
                found[total, 0], found[total, 1] = here, raised
                total += 1
                continue
            # between a place with rock, and where the envelope ends before the next
            low, high, before, after = math.nan, math.nan, 0.0, 0.0
            if not alone:
                low, before = s[i - 1], _raised(t, own[i - 1], least[i - 1])
            elif rock and not np.isnan(ends[0, i, 0]):
                low, before = ends[0, i, 0], min(t, ends[0, i, 1])
            if rock:
                high, after = s[i], _raised(t, own[i], least[i])
            elif not alone and not np.isnan(ends[1, i - 1, 0]):
                high, after = ends[1, i - 1, 0], min(t, ends[1, i - 1, 1])
            if not np.isnan(low) or not np.isnan(high):
                part = 0.0 if np.isnan(high) else 1.0 if np.isnan(low) else _part(low, high, here)
                found[total, 0], found[total, 1] = here, before + part * (after - before)
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


@compiled("f2", "f1", "f1", "f1", "f0", "f0")
def widened_outline(
    points: Array, s: Array, own: Array, least: Array, share: float, slack: float
) -> Array:
    """Return an outline with overhangs, raised by a share of what stands out beside its plane.

    What an overhang hides is moved along t as the rock before it is: in the same order along every
    line, so that it crosses nothing. Places s are in equal steps.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Outline in the plane, rock on its left [m].
    s, own, least, slack
        As of `raised_outlines`; without ``own`` or ``least`` nothing is moved.
    share : float
        Share of the whole way by which each point is raised.
    """
    size, step = 1, s[1] - s[0]
    for i in range(1, len(points)):
        size += int(abs(points[i, 0] - points[i - 1, 0]) / step) + 3
    found, total = np.empty((size, 2)), 0
    for i in range(len(points)):
        a, b = points[max(i - 1, 0)], points[i]
        low, high = (min(a[0], b[0]) - s[0]) / step, (max(a[0], b[0]) - s[0]) / step
        first, last = max(math.floor(low) + 1, 0), min(math.ceil(high) - 1, len(s) - 1)
        # at the places that the segment passes, then at its end
        for k in range(max(last - first + 1, 0) + 1):
            place = first + k if a[0] <= b[0] else last - k
            here, t = b
            if first <= place <= last:
                here, t = s[place], a[1] + (s[place] - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
                raised = t - (own[place] - least[place])
            else:
                cell = min(max(math.floor((here - s[0]) / step), 0), len(s) - 2)
                sides, part = slice(cell, cell + 2), (here - s[cell]) / step
                raised = _raised_between(t, part, own[sides], least[sides], step)
            if math.isfinite(raised) and 0.0 <= (here - s[0]) / step <= len(s) - 1:
                t += share * (raised - t)
            if total and math.hypot(here - found[total - 1, 0], t - found[total - 1, 1]) <= slack:
                continue
            found[total, 0], found[total, 1] = here, t
            total += 1
    return found[:total]
