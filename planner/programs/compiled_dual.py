"""The dual active-set method for the quadratic programs of a stance (compiled).

`planner.programs.dual_active_set` has its equations, and the names that are used here. Loops over
numbers compile in a fraction of the time of operations on arrays, and run no slower.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices, compiled

__all__ = ["optimum_near"]


@compiled()
def _product(x: Array, y: Array) -> float:
    """Return xᵀ y."""
    product = 0.0
    for i in range(len(x)):
        product += x[i] * y[i]
    return product


@compiled()
def _gram(F: Array) -> Array:
    """Return F Fᵀ."""
    across, product = F.T.copy(), np.zeros((len(F), len(F)))
    for i in range(len(F)):
        for m in range(F.shape[1]):
            if F[i, m] != 0.0:
                for j in range(len(F)):
                    product[i, j] += F[i, m] * across[m, j]
    return product


@compiled()
def _independent(S: Array, d: Array, dependent: float) -> NDArray[np.bool_]:
    """Return which of the rows of S = F Fᵀ and d depend linearly on none before them."""
    kept = np.zeros(len(S), dtype=np.bool_)
    L = np.zeros(S.shape)
    for i in range(len(S)):
        left = 1.0 + 1e-14  # beside a diagonal of ones
        for j in range(i):
            if kept[j]:
                size = np.sqrt((S[i, i] + d[i] * d[i]) * (S[j, j] + d[j] * d[j]))
                own = (S[i, j] + d[i] * d[j]) / size
                for k in range(j):
                    own -= L[i, k] * L[j, k]
                L[i, j] = own / L[j, j]
                left -= L[i, j] * L[i, j]
        kept[i] = left > dependent
        L[i, i] = np.sqrt(max(left, 0.0))
    return kept


@compiled()
def _swap(A: Array, i: int, k: int, across: bool) -> None:
    """Swap two rows of a matrix, or two columns."""
    for j in range(len(A)):
        if across:
            A[j, i], A[j, k] = A[j, k], A[j, i]
        else:
            A[i, j], A[k, j] = A[k, j], A[i, j]


@compiled()
def _inverted(A: Array) -> bool:
    """Invert a matrix in its place by Gauss and Jordan's elimination; return whether it can be."""
    size = len(A)
    swapped = np.zeros(size, dtype=np.intp)
    for c in range(size):
        swapped[c] = c
        for i in range(c + 1, size):
            if abs(A[i, c]) > abs(A[swapped[c], c]):
                swapped[c] = i
        _swap(A, c, swapped[c], False)
        pivot = A[c, c]
        if pivot == 0.0:
            return False
        A[c, c] = 1.0
        for j in range(size):
            A[c, j] /= pivot
        for i in range(size):
            factor = A[i, c]
            if i != c and factor != 0.0:
                A[i, c] = 0.0
                for j in range(size):
                    A[i, j] -= factor * A[c, j]
    for c in range(size - 1, -1, -1):
        _swap(A, c, swapped[c], True)
    return True


@compiled()
def _first(
    F: Array,
    d: Array,
    b: Array,
    whole: float,
    at: Indices,
    equations: int,
    dependent: float,
    below: float,
    starts: int,
) -> tuple[int, Array, Array]:
    """Keep the rows of a guess that neither depend on others nor pull; return u and λ, the inverse.

    The rows are left at the beginning of ``at``, in its order, the equations first; the number of
    them is the first result, zero if they are too few.
    """
    rows = np.empty((len(at), F.shape[1]))
    own = np.empty(len(at))
    for i in range(len(at)):
        own[i] = d[at[i]]
        for m in range(F.shape[1]):
            rows[i, m] = F[at[i], m]
    S = _gram(rows)
    kept = _independent(S, own, dependent)
    # places in S of the rows that are left
    left = np.empty(len(at), dtype=np.intp)
    count, taken = len(at), 0
    for i in range(count):
        left[i] = i
    while True:
        fewer, enough, limits = 0, True, False
        for i in range(count):
            if kept[i]:
                left[fewer] = left[i]
                limits = limits or own[left[i]] > 0.0
                fewer += 1
            elif left[i] < equations:
                enough = False
        count = fewer
        if count <= equations or not (enough and limits):
            return 0, own, S
        inverse = np.zeros((count + 1, count + 1))
        for i in range(count):
            inverse[i + 1, 0] = inverse[0, i + 1] = own[left[i]]
            for j in range(count):
                inverse[i + 1, j + 1] = S[left[i], left[j]]
        if not _inverted(inverse):
            return 0, own, S
        found = np.empty(count + 1)
        for i in range(count + 1):
            found[i] = whole * inverse[0, i]
            for j in range(count):
                found[i] -= inverse[i, j + 1] * b[at[left[j]]]
        pulling, worst = False, equations
        for i in range(count):
            kept[i] = i < equations or found[i + 1] >= -below * whole
            pulling = pulling or not kept[i]
            worst = i if i > worst and found[i + 1] < found[worst + 1] else worst
        if not pulling:
            for i in range(count):
                at[i] = at[left[i]]
            return count, found, inverse
        if taken >= starts:
            for i in range(count):
                kept[i] = i != worst
        taken += 1


@compiled()
def _with_row(inverse: Array, count: int, slopes: Array, rise: float) -> None:
    """Let a row come into the inverse, the last; ``count`` rows and one are there before."""
    for i in range(count):
        for j in range(count):
            inverse[i, j] += slopes[i] * (slopes[j] / rise)
        inverse[i, count] = inverse[count, i] = slopes[i] / rise
    inverse[count, count] = 1.0 / rise


@compiled()
def _without_row(inverse: Array, count: int, gone: int) -> None:
    """Let a row go out of the inverse; ``count`` rows and one are there before."""
    for i in range(count):
        if i != gone:
            factor = inverse[i, gone] / inverse[gone, gone]
            for j in range(count):
                if j != gone:
                    inverse[i, j] -= factor * inverse[gone, j]
    for i in range(count - 1):
        for j in range(count - 1):
            inverse[i, j] = inverse[i + (i >= gone), j + (j >= gone)]


@compiled()
def _loads(F: Array, at: Indices, count: int, found: Array) -> Array:
    """Return the scaled loads x = −Fᵀ λ of the first rows of ``at``."""
    x = np.zeros(F.shape[1])
    for i in range(count):
        for m in range(len(x)):
            x[m] -= found[i + 1] * F[at[i], m]
    return x


@compiled("f2", "f1", "f1", "i0", "f1", "b1", "f1", "f0", "f0", "f0", "i0", "i0", "f0", "f0")
def optimum_near(
    C: Array,
    d: Array,
    b: Array,
    equations: int,
    Q: Array,
    guess: NDArray[np.bool_],
    multipliers: Array,
    row: float,
    dependent: float,
    below: float,
    starts: int,
    changes: int,
    met_by: float,
    stationarity: float,
) -> tuple[bool, Indices, Array, float, Array, Array]:
    """Return active rows, z, u and λ of an optimum, and the inverse of `DualFace`.

    The first is whether z, u and λ are exact. Without rows none was found. The first four
    parameters are the attributes of `Rows`, the next are those of `dual_optimum`.

    Parameters
    ----------
    row : float
        What a row that holds may be violated by.
    dependent, below : float
        Fields ``dependent`` and ``multiplier`` of `DualSettings`.
    starts, changes : int
        Fields of `DualSettings`.
    met_by, stationarity : float
        Fields ``met`` of `DualSettings` and ``stationarity`` of `SolvingTolerances`.
    """
    F, size, loads = np.empty(C.shape), np.ones(len(C)), len(Q)
    counts, active = np.zeros(len(C), dtype=np.bool_), np.zeros(len(C), dtype=np.bool_)
    whole, usable = 0.0, True
    for i in range(len(C)):
        square = 0.0
        for m in range(loads):
            F[i, m] = C[i, m] / np.sqrt(Q[m])
            square += F[i, m] * F[i, m]
        # rows of nothing bind nothing
        counts[i] = square > 0.0
        usable = usable and (counts[i] or i >= equations)
        if counts[i]:
            size[i] = np.sqrt(square)
            for m in range(loads):
                F[i, m] /= size[i]
        whole = max(whole, d[i] / size[i])
    none = (False, np.zeros(0, dtype=np.intp), np.zeros(0), 0.0, np.zeros(0), np.zeros((0, 0)))
    if not (usable and whole > 0.0):
        return none
    whole = 1.0 / whole
    scaled, rest = np.empty(len(C)), np.empty(len(C))
    for i in range(len(C)):
        scaled[i], rest[i] = whole * d[i] / size[i], b[i] / size[i]

    # the guess: the equations, then what has the largest multipliers
    at, count = np.zeros(len(C) + changes, dtype=np.intp), 0
    for i in range(len(C)):
        if guess[i] and counts[i]:
            place = count
            while place > 0 and i >= equations and at[place - 1] >= equations:
                other = at[place - 1]
                if multipliers[other] * size[other] >= multipliers[i] * size[i]:
                    break
                at[place] = other
                place -= 1
            at[place] = i
            count += 1
    count, start, first = _first(
        F, scaled, rest, whole, at[:count], equations, dependent, below, starts
    )
    if count == 0:
        return none
    # u, then the multipliers of the active rows
    largest = count + changes + 1
    found, inverse = np.zeros(largest), np.zeros((largest, largest))
    for i in range(count + 1):
        found[i] = start[i]
        for j in range(count + 1):
            inverse[i, j] = first[i, j]
    slopes, column = np.zeros(len(found)), np.zeros(len(found))
    changed = 0
    while True:
        # the row that is violated most
        for i in range(len(C)):
            active[i] = False
        for i in range(count):
            active[at[i]] = True
        x = _loads(F, at, count, found)
        entering, most = -1, -row
        for i in range(len(F)):
            if counts[i] and not active[i]:
                room = (rest[i] + scaled[i] * found[0] - _product(F[i], x)) * size[i]
                if room < most:
                    entering, most = i, room
        if entering < 0:
            break
        multiplier, met = 0.0, False
        while not met:
            changed += 1
            if changed > changes:
                return none
            # how all change with the multiplier of the row
            column[0] = scaled[entering]
            far = rest[entering] + scaled[entering] * found[0] + multiplier
            for i in range(count):
                column[i + 1] = _product(F[at[i]], F[entering])
                far += found[i + 1] * column[i + 1]
            rise = 1.0
            for i in range(count + 1):
                slopes[i] = 0.0
                for j in range(count + 1):
                    slopes[i] -= inverse[i, j] * column[j]
                rise += column[i] * slopes[i]
            # until the row is met, or another one would pull
            full, step, gone = -far / rise if rise > dependent else np.inf, np.inf, -1
            for i in range(equations + 1, count + 1):
                if slopes[i] < -1e-14 and -found[i] / slopes[i] < step:
                    step, gone = max(-found[i] / slopes[i], 0.0), i
            step = min(full, step)
            if step == np.inf:
                return none
            for i in range(count + 1):
                found[i] += step * slopes[i]
            multiplier += step
            met = step == full
            if met:
                _with_row(inverse, count + 1, slopes, rise)
                at[count], found[count + 1] = entering, multiplier
                count += 1
            else:
                if abs(inverse[gone, gone]) < below:
                    return none
                _without_row(inverse, count + 1, gone)
                for i in range(gone, count):
                    at[i - 1], found[i] = at[i], found[i + 1]
                count -= 1

    # what the kept inverse has lost to rounding is put right
    left, change, exact = np.zeros(count + 1), np.zeros(count + 1), False
    for steps in range(4):
        missing = _loads(F, at, count, found)
        still, left[0] = 0.0, whole
        for m in range(loads):
            missing[m] -= x[m]
            still += Q[m] * missing[m] * missing[m]
        for i in range(count):
            left[0] -= scaled[at[i]] * found[i + 1]
        most = abs(left[0]) / whole
        for i in range(count):
            k = at[i]
            left[i + 1] = _product(F[k], x) - rest[k] - scaled[k] * found[0]
            most = max(most, abs(left[i + 1]) * size[k])
            left[i + 1] += _product(F[k], missing)
        exact = steps > 0 and most <= met_by and np.sqrt(still) <= stationarity
        if exact:
            break
        for i in range(count + 1):
            change[i] = 0.0
            for j in range(count + 1):
                change[i] += inverse[i, j] * left[j]
            found[i] += change[i]
        moved = _loads(F, at, count, change)
        for m in range(loads):
            x[m] += missing[m] + moved[m]
    # rows of nothing, too, which u alone may violate
    for i in range(len(F)):
        room = (rest[i] + scaled[i] * found[0] - _product(F[i], x)) * size[i]
        exact = exact and (active[i] or room >= -row)
    signed, of_rows = np.zeros(len(C)), np.zeros((count + 1, count + 1))
    for i in range(count):
        signed[at[i]] = found[i + 1] / size[at[i]]
    for i in range(count + 1):
        own = whole if i == 0 else 1.0 / size[at[i - 1]]
        for j in range(count + 1):
            of_rows[i, j] = inverse[i, j] * own * (whole if j == 0 else 1.0 / size[at[j - 1]])
    for m in range(loads):
        x[m] /= np.sqrt(Q[m])
    return exact, at[:count], x, found[0] * whole, signed, of_rows
