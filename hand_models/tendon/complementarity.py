"""Linear complementarity problems by Lemke's method, and stick–slip of tendons as such.

Find z ≥ 0 with w = M z + q ≥ 0 and wᵀz = 0. Lemke's method: a covering vector c ≥ 0 makes
(M, q + c z₀) easy for a large z₀; complementary pivots then lead z₀ down to zero along a path that,
with lexicographic ties, never comes back to a basis. So there is no iteration that may cycle: the
path ends after finitely many pivots, at a solution or on a ray.

A tendon under tension runs over pulleys p = 1, 2, …. From s before a pulley its tension becomes
s′ = λ s + ω a with 0 ≤ a ≤ s: λ s where the tendon runs toward its first strand (a = 0), (λ + ω) s
where it runs toward its last (a = s), between the two where it sticks. The travels v of an
increment, positive toward the first strand, are affine in a. With v = v⁺ − v⁻ that is

    v⁺ = v + v⁻ ≥ 0  ⊥  a ≥ 0,        s − a ≥ 0  ⊥  v⁻ ≥ 0.

Covered on its first rows alone, this problem has no ray but the one that the path begins on: a is
bounded, since 0 ≤ a ≤ s and the strands follow from it, so on any other ray some v⁻ grows where
a = 0 and s − a = 0, that is with no tension at all (which the lexicographic rule keeps off). So
Lemke's method always finds a solution.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, SolverError

__all__ = ["solve_lcp", "stick_slip", "stick_slips"]


def solve_lcp(M: Array, q: Array, cover: Array) -> Array:
    """Return a z ≥ 0 with M z + q ≥ 0 and zᵀ(M z + q) = 0, by Lemke's method.

    Parameters
    ----------
    M : ndarray, shape (n, n)
        Scaled so that its entries are of order one.
    q : ndarray, shape (n,)
    cover : ndarray, shape (n,)
        Covering vector: not negative, and above zero wherever q is negative.

    Returns
    -------
    ndarray, shape (n,)
        z, checked against the three conditions.

    Raises
    ------
    SolverError
        If the path ends on a ray, or rounding errors violate the conditions.
    """
    n = len(q)
    if q.min(initial=0.0) >= 0.0:
        return np.zeros(n)
    size = float(np.abs(q).max())
    z = _follow(M, q / size, cover)
    if z is not None:
        w = M @ z + q / size
        off = 1e-7  # how negative w and z, and how large w∘z, may be, relative to the size of q
        if min(w.min(), z.min()) >= -off and np.abs(w * z).max() <= off:
            return size * np.maximum(z, 0.0)
    raise SolverError(
        "which of a tendon's pulleys slip was not found (a complementarity problem of size "
        f"{n}): change a friction or stiffness slightly"
    )


def _follow(M: Array, q: Array, cover: Array) -> Array | None:
    """Follow Lemke's path; None where it ends on a ray."""
    n = len(q)
    # columns: w (n), z (n), the covering variable, right-hand side
    tableau = np.hstack([np.eye(n), -M, -cover[:, None], q[:, None]])
    basis = list(range(n))
    entering = 2 * n
    covered = np.flatnonzero(cover > 0.0)
    row = int(covered[np.argmin(q[covered] / cover[covered])])
    # far beyond any number of pivots seen (about 2 n), a guard against rounding
    for _ in range(50 * n):
        tableau[row] /= tableau[row, entering]
        factors = tableau[:, entering].copy()
        factors[row] = 0.0
        tableau -= np.outer(factors, tableau[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = tableau[:, -1]
            return np.asarray(z[n : 2 * n])
        entering = leaving + n if leaving < n else leaving - n
        next_row = _ratio_test(tableau, basis, entering)
        if next_row is None:
            return None
        row = next_row
    return None


def _ratio_test(tableau: Array, basis: list[int], entering: int) -> int | None:
    """Return the row whose variable leaves: lexicographically least, the covering one in a tie."""
    n = len(basis)
    column = tableau[:, entering]
    rounding = 1e-10  # entries and differences of ratios below it count as zero
    rows = np.flatnonzero(column > rounding)
    for j in (2 * n + 1, *range(n)):
        if len(rows) < 2:
            break
        ratios = tableau[rows, j] / column[rows]
        rows = rows[ratios <= ratios.min() + rounding]
        for row in rows:
            if basis[row] == 2 * n:
                return int(row)
    return int(rows[0]) if len(rows) else None


def stick_slip(travel: tuple[Array, Array], before: tuple[Array, Array]) -> Array:
    """Return the unknown a of each pulley, which says whether the tendon slips there and which way.

    The tension after a pulley is λ s + ω a, with s the tension before it, λ and λ + ω the ratios of
    the two tensions as the tendon slips toward its first and toward its last strand.

    Parameters
    ----------
    travel : tuple of ndarray, shapes (m, m) and (m,)
        (V, v_0): the tendon's travels past the pulleys are v = V a + v_0.
    before : tuple of ndarray, shapes (n, m) and (n,)
        (S, s_0): the tensions before the last n pulleys are s = S a + s_0, and s_0 ≥ 0. The first
        m − n unknowns have no upper bound: v ≥ 0 ⊥ a ≥ 0 is their only condition.

    Returns
    -------
    ndarray, shape (m,)
        a: 0 where the tendon runs toward its first strand, s where it runs toward its last, and
        between the two where it sticks.

    Raises
    ------
    SolverError
        If rounding errors keep a solution from being found.
    """
    m, n = len(travel[1]), len(before[1])
    bounded = np.eye(m)[:, m - n :]
    M = np.block([[travel[0], bounded], [before[0] - bounded.T, np.zeros((n, n))]])
    cover = np.concatenate([np.ones(m), np.zeros(n)])
    return solve_lcp(M, np.concatenate([travel[1], before[1]]), cover)[:m]


def stick_slips(travel: tuple[Array, Array], before: tuple[Array, Array], known: Array) -> Array:
    """Return the unknowns of F tendons, which say where they slip and which way, as `stick_slip`.

    The a in [0, s] where v = 0, the a = 0 where v > 0 and the a = s where v < 0 are the zeros of
    a − min(max(a − v, 0), s). Newton's method finds most of them in two or three steps, on the
    systems of all tendons together. Tendons that it leaves are solved by Lemke's method.

    Parameters
    ----------
    travel : tuple of ndarray, shapes (F, m, m) and (F, m)
        (V, v_0) of each tendon.
    before : tuple of ndarray, shapes (F, n, m) and (F, n)
        (S, s_0) of each tendon; s ≥ 0 where the known unknowns are as given and the others 0.
    known : ndarray, shape (F, m)
        Values of unknowns that are given, and meet no condition; nan of all others.

    Returns
    -------
    ndarray, shape (F, m)

    Raises
    ------
    SolverError
        If rounding errors keep a solution from being found.
    """
    (V, v_0), (S, s_0) = travel, before
    found, good = _newton(V, v_0, S, s_0, known)
    for i in np.flatnonzero(~good):
        free, found[i] = np.isnan(known[i]), np.nan_to_num(known[i])
        bounded = free[known.shape[1] - s_0.shape[1] :]
        found[i, free] = stick_slip(
            (V[i][np.ix_(free, free)], (v_0[i] + V[i] @ found[i])[free]),
            (S[i][np.ix_(bounded, free)], (s_0[i] + S[i] @ found[i])[bounded]),
        )
    return found


def _newton(
    V: Array, v_0: Array, S: Array, s_0: Array, given: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Return a of each tendon (F, m) by Newton's method, and whether it meets all conditions."""
    (count, m), n = v_0.shape, s_0.shape[1]
    free, fixed = np.isnan(given), np.nan_to_num(given)
    bounds = np.zeros((count, m, m))
    bounds[:, m - n :] = S
    least, most = np.eye(m) * np.ones((count, 1, 1)), np.eye(m) - bounds
    highest = np.full((count, m), np.inf)
    # what the conditions may be off by: rounding, relative to the size of the problem
    sizes = np.abs(np.concatenate((v_0, s_0, fixed), axis=1))
    rounding = 1e-11 * sizes.max(axis=1, initial=0.0)
    a, good = fixed, np.zeros(count, dtype=bool)
    low, high = ~free, np.zeros_like(free)
    for _ in range(8):
        rows = np.where(low[..., None], least, np.where(high[..., None], most, V))
        aims = np.where(low, fixed, -v_0)
        aims[:, m - n :] = np.where(high[:, m - n :], s_0, aims[:, m - n :])
        try:
            a = np.linalg.solve(rows, aims[..., None])[..., 0]
        except np.linalg.LinAlgError:
            break
        highest[:, m - n :] = (S @ a[..., None])[..., 0] + s_0
        ways = a - (V @ a[..., None])[..., 0] - v_0
        low, high = ~free | (ways <= 0.0), free & (ways >= highest) & (ways > 0.0)
        off = np.abs(np.where(free, a - np.minimum(np.maximum(ways, 0.0), highest), 0.0))
        good = off.max(axis=1, initial=0.0) <= rounding
        good &= highest.min(axis=1, initial=0.0) >= -rounding
        if good.all():
            break
    return a, good
