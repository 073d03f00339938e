"""Smooth a cut through rock to the scale of a tile (compiled).

What is computed, and why, is in `hand_models.rock.smoothing`.
"""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["corners", "smoothed", "without_repeats"]


@compiled()
def _distance(a: Array, b: Array) -> float:
    x, y = b[0] - a[0], b[1] - a[1]
    return math.sqrt(x * x + y * y)


@compiled("f2")
def without_repeats(points: Array) -> Array:
    """Return a polyline, (n, 2), without points that equal the point before them."""
    kept = np.empty_like(points)
    count = 0
    for point in points:
        if count == 0 or point[0] != kept[count - 1, 0] or point[1] != kept[count - 1, 1]:
            kept[count, 0], kept[count, 1] = point
            count += 1
    return kept[:count]


@compiled("f2")
def corners(points: Array) -> tuple[Array, Array]:
    """Return a polyline, (n, 2), without the points at which its direction does not change.

    Returns
    -------
    points : ndarray, shape (n, 2)
        Points that are left, each different from the one before [m].
    lengths : ndarray, shape (n,)
        Length of the polyline up to each point [m].
    """
    kept = without_repeats(points)
    last = len(kept) - 1
    count = min(1, last + 1)
    step, before = np.empty(2), np.empty(2)
    for i in range(last):
        length = _distance(kept[i], kept[i + 1])
        for k in range(2):
            step[k] = (kept[i + 1, k] - kept[i, k]) / length
        turn = before[0] * step[1] - before[1] * step[0]
        onward = before[0] * step[0] + before[1] * step[1]
        if i > 0 and (abs(turn) > 1e-7 or onward <= 0.0):  # sine of no turn
            kept[count] = kept[i]
            count += 1
        before[:] = step
    if last > 0:
        kept[count] = kept[last]
        count += 1
    lengths = np.zeros(count)
    for i in range(1, count):
        lengths[i] = lengths[i - 1] + _distance(kept[i - 1], kept[i])
    return kept[:count], lengths


@compiled()
def _sampled(
    points: Array, lengths: Array, step: float, first: int, last: int, shift: float
) -> Array:
    """Return places of a polyline at steps of its length; beyond a ring's ends it goes on.

    ``shift``: how many steps later they are than at whole steps from the polyline's beginning.
    """
    total = lengths[-1]
    found = np.empty((last - first, 2))
    place = 0
    for i in range(len(found)):
        at = step * (first + i + shift)
        if first < 0:
            at %= total
        if at < lengths[place]:
            place = 0
        while place + 1 < len(lengths) and lengths[place + 1] <= at:
            place += 1
        beyond = min(place + 1, len(lengths) - 1)
        part = (at - lengths[place]) / (lengths[beyond] - lengths[place]) if beyond > place else 0.0
        for k in range(2):
            found[i, k] = points[place, k] + part * (points[beyond, k] - points[place, k])
    return found


@compiled()
def _fitted(curve: Array, weights: Array) -> Array:
    """Return the middles of parabolas over as many points on both sides; at the ends, theirs.

    Row i of the weights, of an odd number, gives the parabola's value at the i-th of its points.
    """
    part, count = len(weights) // 2, len(curve)
    fitted = np.zeros((count, 2))
    values = curve.copy().reshape(2 * count)
    middle = fitted.reshape(2 * count)[2 * part : 2 * (count - part)]
    for k in range(len(weights)):
        weight, near = weights[part, k], values[2 * k : 2 * k + len(middle)]
        for i in range(len(middle)):
            middle[i] += weight * near[i]
    for i in range(part):
        for k in range(len(weights)):
            last = count - len(weights) + k
            for j in range(2):
                fitted[i, j] += weights[i, k] * curve[k, j]
                fitted[count - part + i, j] += weights[part + 1 + i, k] * curve[last, j]
    return fitted


@compiled()
def _end_fitted(curve: Array, window: Array, wide: Array, rest: float) -> None:
    """Write the last points of a fitted curve, and its end: of one parabola up to the very end.

    Parameters
    ----------
    curve : ndarray, shape (n + 1, 2)
        Fitted points at whole steps, and the end of the curve, changed in place.
    window : ndarray, shape (2 h + 1, 2)
        Places of the polyline at whole steps before its end, the last at the end.
    wide : ndarray, shape (2 h + 1, 2 h + 1)
        Weights as of `smoothed`.
    rest : float
        Length from the last whole step to the end, in steps.
    """
    half = len(wide) // 2
    # the parabola at its beginning, its middle and its end
    nodes = np.zeros((3, 2))
    for i in range(3):
        for k in range(len(wide)):
            for j in range(2):
                nodes[i, j] += wide[i * half, k] * window[k, j]
    last = len(curve) - 1
    for i in range(half + 1):
        # whole steps before the end, in parts of half the window
        u = 1.0 - (i - 1.0 + rest) / half if i else 1.0
        for j in range(2):
            bend = 0.5 * (nodes[0, j] + nodes[2, j]) - nodes[1, j]
            curve[last - i, j] = nodes[1, j] + u * (0.5 * (nodes[2, j] - nodes[0, j]) + u * bend)


@compiled()
def _outward(curve: Array, closed: int, rest: float) -> Array:
    """Return unit normals on the right of a curve, shape (n, 2).

    ``rest``: length of the last step, in steps; 0 if it is whole.
    """
    count = len(curve)
    normals = np.empty((count, 2))
    for i in range(count):
        before, after = i - 1, i + 1
        if closed:
            before, after = before % count, after % count
        a, b = curve[max(before, 0)], curve[min(after, count - 1)]
        length = max(_distance(a, b), 1e-300)
        normals[i, 0], normals[i, 1] = (b[1] - a[1]) / length, (a[0] - b[0]) / length
    if rest > 0.0:
        # the last step may be next to nothing: over a whole one
        a = rest * curve[count - 2] + (1.0 - rest) * curve[count - 3]
        length = max(_distance(a, curve[-1]), 1e-300)
        normals[-1, 0] = (curve[-1, 1] - a[1]) / length
        normals[-1, 1] = (a[0] - curve[-1, 0]) / length
    return normals


@compiled()
def _foot(curve: Array, at: int, x: float, y: float) -> float:
    """Return the place on a curve nearest to a point, in steps; ``at``: its nearest vertex."""
    least, place = math.inf, float(at)
    for begin in (at - 1, at):
        if 0 <= begin < len(curve) - 1:
            u, v = curve[begin + 1, 0] - curve[begin, 0], curve[begin + 1, 1] - curve[begin, 1]
            a, b = x - curve[begin, 0], y - curve[begin, 1]
            part = min(max((a * u + b * v) / max(u * u + v * v, 1e-300), 0.0), 1.0)
            away = (a - part * u) ** 2 + (b - part * v) ** 2
            if away < least:
                least, place = away, begin + part
    return place


@compiled()
def _excess(curve: Array, outward: Array, raw: Array, guesses: Indices, rest: float) -> Array:
    """Return how far raw points stand out of a curve, by the steps of it that are nearest to them.

    ``guesses``: for each raw point a point of the curve that is near it. Rows of the result, for
    each step from one point of the curve to the next: the largest excess, and the largest part of
    it that counts at the step's beginning and at its end, as far as it is from the other.
    ``rest``: length of the last step, in steps; 0 if it is whole.
    """
    count, last = len(curve), curve[-1]
    longest = 1e-9  # [m] or else the longest step of the curve
    chord = max(_distance(curve[0], last), 1e-9)
    u, v = (last[0] - curve[0, 0]) / chord, (last[1] - curve[0, 1]) / chord
    # how far along the chord a curve has been up to each point, and is from there on
    so_far, yet = np.empty(count), np.empty(count)
    for i in range(count):
        so_far[i] = yet[i] = u * curve[i, 0] + v * curve[i, 1]
        if i:
            longest = max(longest, _distance(curve[i - 1], curve[i]))
            so_far[i] = max(so_far[i], so_far[i - 1])
    for i in range(count - 1, 0, -1):
        yet[i - 1] = min(yet[i - 1], yet[i])
    excess = np.zeros((3, count))
    for i in range(len(raw)):
        x, y = raw[i]
        along = u * x + v * y
        nearest = guesses[i]
        least = (x - curve[nearest, 0]) ** 2 + (y - curve[nearest, 1]) ** 2
        for way in (-1, 1):
            at = guesses[i] + way
            while 0 <= at < count:
                beside = along - so_far[at] if way < 0 else yet[at] - along
                if beside > 0.0 and beside * beside > least:
                    # so is all that follows
                    break
                square = (x - curve[at, 0]) ** 2 + (y - curve[at, 1]) ** 2
                if square < least:
                    nearest, least = at, square
                # what is farther by so many steps is as many points away at least
                steps = 1
                if square > 16.0 * least:
                    steps = max(1, int((math.sqrt(square) - math.sqrt(least)) / longest))
                at += way * steps
        place = _foot(curve, nearest, x, y)
        step = min(int(place), count - 1)
        part, after = place - step, min(step + 1, count - 1)
        out = 0.0
        for k in range(2):
            foot = curve[step, k] + part * (curve[after, k] - curve[step, k])
            normal = outward[step, k] + part * (outward[after, k] - outward[step, k])
            out += (raw[i, k] - foot) * normal
        if out <= 0.0:
            continue
        if rest > 0.0 and step >= count - 2:
            # the end belongs to the step before it, which is shorter
            part, step = rest * (part if step == count - 2 else 1.0), count - 2
        excess[0, step] = max(excess[0, step], out)
        excess[1, step] = max(excess[1, step], (1.0 - part) * out)
        excess[2, step] = max(excess[2, step], part * out)
    return excess


@compiled()
def _continued(values: Array, part: int, closed: int) -> Array:
    """Return values with ``part`` more at both ends: those of a ring, else the last ones."""
    found = np.empty(len(values) + 2 * part)
    for i in range(len(found)):
        place = i - part
        found[i] = values[place % len(values) if closed else min(max(place, 0), len(values) - 1)]
    return found


@compiled()
def _highest(excess: Array, part: int, closed: int) -> Array:
    """Return the largest excess within ``part`` steps of each point of a curve, or zero.

    Over the last step of that it fades, so that it changes with a raw point's place without a jump.
    """
    count = excess.shape[1]
    further, found = np.empty((3, count + 2 * part + 2)), np.zeros(count)
    for row in range(3):
        further[row] = _continued(excess[row], part + 1, closed)
    for k in range(2 * part + 2):
        row = 2 if k == 0 else 1 if k == 2 * part + 1 else 0
        beside = further[row, k : k + count]
        for i in range(count):
            found[i] = max(found[i], beside[i])
    return found


@compiled()
def _mean(values: Array, part: int, closed: int) -> Array:
    """Return the mean of each value and ``part`` on both sides of it."""
    further, size = _continued(values, part, closed), 2 * part + 1
    found = np.empty(len(values))
    found[0] = further[:size].sum() / size
    for i in range(1, len(found)):
        found[i] = found[i - 1] + (further[i + size - 1] - further[i - 1]) / size
    return found


@compiled()
def _at_end(values: Array, rest: float) -> Array:
    """Return values at whole steps with the last, one step too far, taken back to the end."""
    if rest > 0.0:
        values[-1] = (1.0 - rest) * values[-2] + rest * values[-1]
    return values


@compiled("f2", "f1", "f0", "i0", "f0", "i0", "f2", "f2")
def smoothed(
    points: Array,
    lengths: Array,
    step: float,
    count: int,
    rest: float,
    closed: int,
    wide: Array,
    narrow: Array,
) -> Array:
    """Return a polyline smoothed to the scale of a tile, and raised over its raw points.

    Parameters
    ----------
    points, lengths : ndarray
        Raw polyline, the result of `corners`.
    step : float
        Distance of neighbouring points along the polyline [m].
    count : int
        Number of points at equal steps.
    rest : float
        Length from the last of them to the polyline's end, in steps; 0 for none. The curve goes on
        to that end: with the parabola that is fitted to the polyline's last stretch, up to its very
        end, so that no point jumps when the polyline grows by one step more.
    closed : int
        1 if the polyline is a ring, else 0.
    wide, narrow : ndarray
        Weights of neighbouring points in the first and the second fit of parabolas (odd lengths).
    """
    half = len(wide) // 2
    over = 2 * half if closed else 0
    sampled = _sampled(points, lengths, step, -over, count + over, 0.0)
    more = 1 if rest > 0.0 else 0
    curve = np.empty((count + more, 2))
    once = _fitted(sampled, wide)
    if more and half:
        window = _sampled(points, lengths, step, count - 1 - 2 * half, count, rest)
        curve[:count] = once
        _end_fitted(curve, window, wide, rest)
        once[:] = curve[:count]
        curve[:count] = _fitted(once, narrow)
        for i in range(count - len(narrow) // 2, count):
            # of a parabola through points of a parabola nothing changes
            curve[i] = once[i]
    else:
        curve[:count] = _fitted(once, narrow)[over : over + count]
        if more:
            curve[count] = points[-1]
    raw = np.concatenate((sampled[over : over + count], points))
    guesses = np.empty(len(raw), dtype=np.intp)
    for i in range(count):
        guesses[i] = i
    for i in range(len(points)):
        guesses[count + i] = min(int(lengths[i] / step), count - 1)
    for _ in range(4):  # each time far less is left
        outward = _outward(curve, closed, rest)
        excess = _excess(curve, outward, raw, guesses, rest)
        if excess[0].max() <= 1e-6:  # [m]
            break
        # two moving means whose widths add up to that of the maximum leave no point below it
        rise = _at_end(_highest(excess, half, closed), rest)
        rise = _at_end(_mean(rise, half // 2, closed), rest)
        rise = _at_end(_mean(rise, half - half // 2, closed), rest)
        for i in range(len(curve)):
            for k in range(2):
                curve[i, k] += rise[i] * outward[i, k]
    return np.concatenate((curve, curve[:1])) if closed else curve
