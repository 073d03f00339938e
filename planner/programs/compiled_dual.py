"""The dual active-set method for the quadratic programs of a stance (compiled).

`planner.programs.dual_active_set` has its equations, and the names that are used here.
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
def _inverted(A: Array) -> bool:
    """Invert a matrix in its place by Gauss and Jordan's elimination; return whether it can be."""
    swapped = np.zeros(len(A), dtype=np.intp)
    for c in range(len(A)):
        swapped[c] = c + np.abs(A[c:, c]).argmax()
        A[c], A[swapped[c]] = A[swapped[c]].copy(), A[c].copy()
        pivot = A[c, c]
        if pivot == 0.0:
            return False
        A[c, c] = 1.0
        A[c] /= pivot
        for i in range(len(A)):
            factor = A[i, c]
            if i != c and factor != 0.0:
                A[i, c] = 0.0
                for j in range(len(A)):
                    A[i, j] -= factor * A[c, j]
    for c in range(len(A) - 1, -1, -1):
        A[:, c], A[:, swapped[c]] = A[:, swapped[c]].copy(), A[:, c].copy()
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
) -> tuple[Indices, Array, Array]:
    """Return the rows of a guess that neither depend on others nor pull, u and λ, and the inverse.

    No rows if these are too few. Rows come in the order of ``at``, the equations first.
    """
    S, d_all, b_all = _gram(F[at]), d[at], b[at]
    left = np.flatnonzero(_independent(S, d_all, dependent))
    taken = 0
    while True:
        count = len(left)
        own, b_own = d_all[left], b_all[left]
        if count <= equations or (left[:equations] >= equations).any() or not own.any():
            return at[:0], own, S
        inverse = np.zeros((count + 1, count + 1))
        for i in range(count):
            inverse[i + 1, 0] = inverse[0, i + 1] = own[i]
            for j in range(count):
                inverse[i + 1, j + 1] = S[left[i], left[j]]
        if not _inverted(inverse):
            return at[:0], own, S
        found = whole * inverse[0]
        for i in range(count + 1):
            found[i] -= _product(inverse[i, 1:], b_own)
        kept, worst = np.ones(count, dtype=np.bool_), equations
        for i in range(equations, count):
            kept[i] = found[i + 1] >= -below * whole
            worst = i if found[i + 1] < found[worst + 1] else worst
        if kept.all():
            return at[left], found, inverse
        if taken >= starts:
            kept[:] = True
            kept[worst] = False
        left = left[kept]
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
    for i in range(gone, count - 1):
        inverse[i, :count] = inverse[i + 1, :count]
    for j in range(gone, count - 1):
        inverse[: count - 1, j] = inverse[: count - 1, j + 1]


@compiled()
def _loads(F: Array, at: Indices, found: Array) -> Array:
    """Return the scaled loads x = −Fᵀ λ of active rows."""
    x = np.zeros(F.shape[1])
    for i in range(len(at)):
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
    F, size = C / np.sqrt(Q), np.ones(len(C))
    counts = np.zeros(len(C), dtype=np.bool_)
    for i in range(len(C)):
        square = _product(F[i], F[i])
        # rows of nothing bind nothing
        counts[i] = square > 0.0
        if counts[i]:
            size[i] = np.sqrt(square)
            F[i] /= size[i]
    d, b = d / size, b / size
    none = (False, np.zeros(0, dtype=np.intp), Q.copy(), 0.0, np.zeros(0), F[:0])
    if not (counts[:equations].all() and d.any()):
        return none
    whole = 1.0 / d.max()
    d = d * whole

    at = np.flatnonzero(guess & counts)
    weights = -multipliers[at] * size[at]
    weights[:equations] = -np.inf
    at = at[np.argsort(weights, kind="mergesort")]
    own, start, first = _first(F, d, b, whole, at, equations, dependent, below, starts)
    count = len(own)
    if count == 0:
        return none
    at = np.zeros(count + changes, dtype=np.intp)
    at[:count] = own
    # u, then the multipliers of the active rows
    found = np.zeros(count + changes + 1)
    found[: count + 1] = start
    inverse = np.zeros((len(found), len(found)))
    inverse[: count + 1, : count + 1] = first
    slopes, column = np.zeros(len(found)), np.zeros(len(found))
    active = np.zeros(len(C), dtype=np.bool_)
    changed = 0
    while True:
        # the row that is violated most
        active[:] = False
        active[at[:count]] = True
        x = _loads(F, at[:count], found)
        entering, most = -1, -row
        for i in range(len(F)):
            if counts[i] and not active[i]:
                room = (b[i] + d[i] * found[0] - _product(F[i], x)) * size[i]
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
            column[0] = d[entering]
            far = b[entering] + d[entering] * found[0] + multiplier
            for i in range(count):
                column[i + 1] = _product(F[at[i]], F[entering])
                far += found[i + 1] * column[i + 1]
            rise = 1.0
            for i in range(count + 1):
                slopes[i] = -_product(inverse[i, : count + 1], column[: count + 1])
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
    at, found, inverse = at[:count], found[: count + 1], inverse[: count + 1, : count + 1].copy()
    left, exact = np.zeros(count + 1), False
    for steps in range(4):
        missing = _loads(F, at, found) - x
        left[0] = whole - _product(d[at], found[1:])
        most = abs(left[0]) / whole
        for i in range(count):
            left[i + 1] = _product(F[at[i]], x) - b[at[i]] - d[at[i]] * found[0]
            most = max(most, abs(left[i + 1]) * size[at[i]])
            left[i + 1] += _product(F[at[i]], missing)
        still = np.sqrt(_product(Q * missing, missing))
        exact = steps > 0 and most <= met_by and still <= stationarity
        if exact:
            break
        change = np.zeros(count + 1)
        for i in range(count + 1):
            change[i] = _product(inverse[i], left)
        found += change
        x += missing + _loads(F, at, change)
    for i in range(len(F)):
        room = (b[i] + d[i] * found[0] - _product(F[i], x)) * size[i]
        exact = exact and (active[i] or not counts[i] or room >= -row)
    signed = np.zeros(len(C))
    signed[at] = found[1:] / size[at]
    for i in range(count + 1):
        for j in range(count + 1):
            inverse[i, j] *= whole if i == 0 else 1.0 / size[at[i - 1]]
            inverse[i, j] *= whole if j == 0 else 1.0 / size[at[j - 1]]
    return exact, at, x / np.sqrt(Q), found[0] * whole, signed, inverse
