"""Load factors of stances by the simplex method on the vertices of their hands (compiled).

The programs are those of `planner.screening.solve_stance`, which defines them. A basis has some
twenty rows, so its inverse is kept and updated as it is.
"""

from __future__ import annotations

import numpy as np

from hand_models.base import Array, Indices, compiled

__all__ = ["load_factors"]


@compiled()
def _pivot(
    inverse: Array, values: Array, basic: Indices, alpha: Array, row: int, column: int
) -> None:
    """Let a column enter the basis at a row; alpha is the column in terms of the basis."""
    size = len(values)
    for j in range(size):
        inverse[row, j] /= alpha[row]
    values[row] /= alpha[row]
    for i in range(size):
        if i != row and alpha[i] != 0.0:
            factor = alpha[i]
            for j in range(size):
                inverse[i, j] -= factor * inverse[row, j]
            values[i] -= factor * values[row]
    basic[row] = column


@compiled("f2", "f2", "i1", "i1", "f2", "f2", "i2", "f2", "f0", "i0")
def load_factors(
    points: Array,
    rows: Array,
    parts: Indices,
    hands: Indices,
    base: Array,
    room: Array,
    members: Indices,
    wrenches: Array,
    near: float,
    most: int,
) -> tuple[Array, Array, Array]:
    """Return load factors (N,) of stances, directions (N, 6) that bound them, and supports (N,).

    The first six parameters are the attributes of `WorldHands`. A factor is −∞ where no multiple of
    the body wrench is held, and NaN where the method did not end; a direction is zero then.
    Supports are the sums of the hands' supports in these directions.

    Parameters
    ----------
    members : ndarray of int, shape (N, L)
        Hands of each stance; −1 for a limb in the air.
    wrenches : ndarray, shape (N, 6)
        Body wrenches.
    near : float
        What counts as zero.
    most : int
        Steps of the method at most.
    """
    factors, directions = np.full(len(members), np.nan), np.zeros((len(members), 6))
    supports = np.zeros(len(members))
    height = room.shape[1]
    for n in range(len(members)):
        # vertices of this stance, the part of each, and the rows of whole hands
        count, groups, clipped = 0, 0, 0
        for p in members[n]:
            if p >= 0:
                count += parts[hands[p + 1]] - parts[hands[p]]
                groups += hands[p + 1] - hands[p]
                for k in range(height):
                    clipped += 1 if np.isfinite(room[p, k]) else 0
        size = 6 + groups + clipped
        vertex = np.empty(count, dtype=np.intp)
        group = np.empty(count, dtype=np.intp)
        # of the hand of each vertex: its first row among the clipped ones, and its placement
        owner = np.empty(count, dtype=np.intp)
        first_row = np.full(members.shape[1], -1, dtype=np.intp)
        rhs = np.zeros(size)
        best = np.zeros(groups, dtype=np.intp)
        at, g, r = 0, 0, 6 + groups
        for limb in range(members.shape[1]):
            p = members[n, limb]
            if p < 0:
                continue
            first_row[limb] = r
            for k in range(height):
                if np.isfinite(room[p, k]):
                    rhs[r] = room[p, k]
                    r += 1
            for x in range(6):
                rhs[x] -= base[p, x]
            for part in range(hands[p], hands[p + 1]):
                rhs[6 + g] = 1.0
                top = -np.inf
                for i in range(parts[part], parts[part + 1]):
                    vertex[at], group[at], owner[at] = i, g, limb
                    value = 0.0
                    for x in range(6):
                        value += points[i, x] * wrenches[n, x]
                    if value > top:
                        top, best[g] = value, at
                    at += 1
                g += 1
        # columns: 0 the multiple, 1 to count the vertices, then slacks, then what is missing
        slack, missing = 1 + count, 1 + count + clipped
        basic, inverse = np.empty(size, dtype=np.intp), np.zeros((size, size))
        values = rhs.copy()
        for g in range(groups):
            v = best[g]
            basic[6 + g] = 1 + v
            p, r = members[n, owner[v]], first_row[owner[v]]
            for x in range(6):
                values[x] -= points[vertex[v], x]
            for k in range(height):
                if np.isfinite(room[p, k]):
                    values[r] -= rows[vertex[v], k]
                    r += 1
        sign = np.ones(size)
        y = np.zeros(size)
        for i in range(size):
            if 6 <= i < 6 + groups:
                inverse[i, i] = 1.0
                continue
            if values[i] < 0.0:
                sign[i] = -1.0
                values[i] = -values[i]
            short = i < 6 or sign[i] < 0.0
            basic[i] = missing + i if short else slack + i - 6 - groups
            inverse[i, i] = sign[i]
        for g in range(groups):
            v = best[g]
            p, r = members[n, owner[v]], first_row[owner[v]]
            for x in range(6):
                inverse[x, 6 + g] = -sign[x] * points[vertex[v], x]
            for k in range(height):
                if np.isfinite(room[p, k]):
                    inverse[r, 6 + g] = -sign[r] * rows[vertex[v], k]
                    r += 1
        alpha = np.empty(size)
        first, ended = True, False
        for i in range(size):
            if basic[i] >= missing:
                for j in range(size):
                    y[j] += inverse[i, j]
        for _ in range(most):
            # the column whose entering helps most
            entering, least = -1, -near
            value = 0.0 if first else -1.0
            for x in range(6):
                value += y[x] * wrenches[n, x]
            if value < least:
                entering, least = 0, value
            for v in range(count):
                value = -y[6 + group[v]]
                for x in range(6):
                    value -= y[x] * points[vertex[v], x]
                if clipped > 0:
                    p, r = members[n, owner[v]], first_row[owner[v]]
                    for k in range(height):
                        if np.isfinite(room[p, k]):
                            value -= y[r] * rows[vertex[v], k]
                            r += 1
                if value < least:
                    entering, least = 1 + v, value
            for k in range(clipped):
                if -y[6 + groups + k] < least:
                    entering, least = slack + k, -y[6 + groups + k]
            if entering < 0:
                if not first:
                    ended = True
                    break
                total = 0.0
                for i in range(size):
                    if basic[i] >= missing:
                        total += values[i]
                if total > near:
                    factors[n] = -np.inf
                    break
                # something is held: now the largest multiple
                first = False
                y[:] = 0.0
                for i in range(size):
                    if basic[i] == 0:
                        y[:] = -inverse[i]
                continue
            for i in range(size):
                value = 0.0
                if entering == 0:
                    for x in range(6):
                        value -= inverse[i, x] * wrenches[n, x]
                elif entering < slack:
                    v = entering - 1
                    value = inverse[i, 6 + group[v]]
                    for x in range(6):
                        value += inverse[i, x] * points[vertex[v], x]
                    if clipped > 0:
                        p, r = members[n, owner[v]], first_row[owner[v]]
                        for k in range(height):
                            if np.isfinite(room[p, k]):
                                value += inverse[i, r] * rows[vertex[v], k]
                                r += 1
                else:
                    value = inverse[i, 6 + groups + entering - slack]
                alpha[i] = value
            leaving, step, size_of = -1, np.inf, 0.0
            for i in range(size):
                if not first and basic[i] >= missing and abs(alpha[i]) > near:
                    # what is missing stays zero
                    leaving, step = i, 0.0
                    break
                if alpha[i] > near:
                    ratio = max(values[i], 0.0) / alpha[i]
                    if ratio < step - near or (ratio < step + near and alpha[i] > size_of):
                        leaving, step, size_of = i, min(ratio, step), alpha[i]
            if leaving < 0:
                break
            share = least / alpha[leaving]
            for j in range(size):
                y[j] += share * inverse[leaving, j]
            _pivot(inverse, values, basic, alpha, leaving, entering)
        if ended:
            factors[n] = 0.0
            for i in range(size):
                if basic[i] == 0:
                    factors[n] = values[i]
        if ended or factors[n] == -np.inf:
            largest = 0.0
            for x in range(6):
                largest = max(largest, abs(y[x]))
            if largest > 0.0:
                for x in range(6):
                    directions[n, x] = y[x] / largest
                for i in range(size):
                    supports[n] -= y[i] * rhs[i] / largest
    return factors, directions, supports
