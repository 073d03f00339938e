"""Linear complementarity problems by Lemke's method, and stick–slip of a tendon as one.

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

from hand_models.base import Array, SolverError

__all__ = ["solve_lcp", "stick_slip"]


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
