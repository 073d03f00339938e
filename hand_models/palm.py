"""Load sharing of a palm: N tiles on one tendon with friction (Eqs. 1–3, 18–19).

The palm frame travels x; tile i, on a contact of stiffness k_i and preload springs k_p, travels
x_i. With strand tensions F_0 … F_N, slip δ_i = x − x_i and tendon travel past tile i's pulley
m_i = 2 Σ_{j<i} δ_j + δ_i, the tiles obey

    F_{i−1} + F_i + k_p δ_i = k_i x_i        (balance, Eq. 18)
    Σ δ_i = 0                                (the tendon's length)
    F_i = ρ F_{i−1}  if m_i > 0,   F_{i−1} = ρ F_i  if m_i < 0,   between the two if m_i = 0,

with ρ = (1 − μ/2)/(1 + μ/2) (Eq. 19). The direction of friction at each pulley is unknown: this is
a linear complementarity problem, solved here by Lemke's method. Everything is proportional to x.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from hand_models.errors import InvalidInputError, SolverError
from hand_models.frames import Array

__all__ = ["PalmSharing", "share_load", "shear_capacity"]

TOLERANCE: Final = 1e-9

COVERS: Final = 32
"""Covering vectors tried before a problem is given up."""

GOLDEN: Final = 0.5 * (math.sqrt(5.0) - 1.0)
"""Spreads the covering vectors."""


@dataclass(frozen=True, eq=False)
class PalmSharing:
    """How the tiles of a palm share its load, per unit of palm travel.

    Attributes
    ----------
    tile_stiffness : ndarray, shape (N,)
        Load of each tile, k_i x_i / x [N/m].
    tile_travel : ndarray, shape (N,)
        x_i / x.
    strand_stiffness : ndarray, shape (N + 1,)
        Tension of each strand, F_i / x [N/m].
    tendon_travel : ndarray, shape (N,)
        m_i / x, positive toward the last strand.
    """

    tile_stiffness: Array
    tile_travel: Array
    strand_stiffness: Array
    tendon_travel: Array

    def capacity(self, tile_limits: Sequence[float] | Array) -> float:
        """Return the palm's load when its first tile reaches its limit [N]."""
        limits = np.asarray(tile_limits, dtype=float)
        return float(np.min(limits / self.tile_stiffness) * self.tile_stiffness.sum())


def share_load(
    contact_stiffness: Sequence[float], spring_stiffness: float, friction: float
) -> PalmSharing:
    """Solve the load sharing of N tiles.

    Parameters
    ----------
    contact_stiffness : sequence of float, length N
        k_i in the tendon's order [N/m].
    spring_stiffness : float
        k_p [N/m].
    friction : float
        μ between the strands of a tile, in [0, 2).

    Returns
    -------
    PalmSharing

    Raises
    ------
    InvalidInputError
        If a stiffness is not above zero, k_p is negative, or μ is out of range.
    SolverError
        If the complementarity problem ends without a solution.
    """
    k = np.asarray(contact_stiffness, dtype=float)
    if k.ndim != 1 or not len(k) or not np.isfinite(k).all() or (k <= 0.0).any():
        raise InvalidInputError(
            f"stiffnesses above 0 N/m are needed, got {k.tolist()}", field="contact_stiffness"
        )
    if not (math.isfinite(spring_stiffness) and spring_stiffness >= 0.0):
        raise InvalidInputError(
            f"must not be negative, got {spring_stiffness:g}", field="spring_stiffness"
        )
    if not 0.0 <= friction < 2.0:
        raise InvalidInputError(f"must be in [0, 2), got {friction:g}", field="friction")
    try:
        return _share(k, spring_stiffness, friction)
    except SolverError:
        # the same palm, its tendon threaded from the other end
        mirrored = _share(k[::-1], spring_stiffness, friction)
    return PalmSharing(
        tile_stiffness=mirrored.tile_stiffness[::-1],
        tile_travel=mirrored.tile_travel[::-1],
        strand_stiffness=mirrored.strand_stiffness[::-1],
        tendon_travel=-mirrored.tendon_travel[::-1],
    )


def _share(k: Array, spring_stiffness: float, friction: float) -> PalmSharing:
    n = len(k)
    rho = (1.0 - friction / 2.0) / (1.0 + friction / 2.0)
    # In units of k_mean·x. The unknowns are the strands' excesses α_i = F_i − ρ F_{i−1}: they give
    # the strands F = G α + g F_0, F_0 by the tendon's length, and from these slips δ and travels m.
    scale = k.mean()
    kappa, spring = k / scale, spring_stiffness / scale
    index = np.arange(n + 1)
    decay = np.tril(rho ** np.maximum(index[:, None] - index[None, :], 0))
    by_excess, by_first = decay[:, 1:], decay[:, 0]
    pair = np.eye(n, n + 1) + np.eye(n, n + 1, 1)
    # δ = (k − F_{i−1} − F_i) / (k + k_p), and Σ δ = 0
    compliance = 1.0 / (kappa + spring)
    weight = compliance @ pair
    first = weight @ by_first
    strand_a = by_excess - np.outer(by_first, weight @ by_excess) / first
    strand_c = by_first * (compliance @ kappa) / first
    travel_of_slip = 2.0 * np.tril(np.ones((n, n))) - np.eye(n)
    m_a = -travel_of_slip @ (compliance[:, None] * (pair @ strand_a))
    m_c = travel_of_slip @ (compliance * (kappa - pair @ strand_c))
    # m = p − q, with p ⊥ α ≥ 0 and q ⊥ β = F_{i−1} − ρ F_i ≥ 0
    backward = np.eye(n, n + 1) - rho * np.eye(n, n + 1, 1)
    M = np.block([[m_a, np.eye(n)], [backward @ strand_a, np.zeros((n, n))]])
    z = _lemke(M, np.concatenate([m_c, backward @ strand_c]))
    strands = strand_a @ z[:n] + strand_c
    m = m_a @ z[:n] + m_c
    travel = 1.0 - compliance * (kappa - pair @ strands)
    return PalmSharing(k * travel, travel, strands * scale, m)


def _lemke(M: Array, q: Array) -> Array:
    """Solve w = M z + q, w ≥ 0, z ≥ 0, w ⊥ z by Lemke's method.

    A path that ends on a ray says nothing of the problem, so it is tried with several covering
    vectors; every solution is checked.
    """
    n = len(q)
    if q.min() >= 0.0:
        return np.zeros(n)
    size = 1.0 + float(np.abs(q).max())
    for attempt in range(COVERS):
        # the first is all ones; the others spread over the positive orthant
        cover = 1.0 + attempt * np.modf(GOLDEN * np.arange(1, n + 1) * attempt)[0]
        z = _lemke_path(M, q, cover)
        if z is not None:
            w = M @ z + q
            if min(w.min(), z.min()) >= -1e-7 * size and np.abs(w * z).max() <= 1e-7 * size**2:
                return z
    raise SolverError("the palm's load sharing ended without a solution")


def _lemke_path(M: Array, q: Array, cover: Array) -> Array | None:
    """Follow Lemke's path with lexicographic pivots; None where it ends on a ray."""
    n = len(q)
    # columns: w (n), z (n), the covering variable, right-hand side
    tableau = np.hstack([np.eye(n), -M, -cover[:, None], q[:, None]])
    basis = list(range(n))
    entering, row = 2 * n, int(np.argmin(q / cover))
    for _ in range(50 * n):
        tableau[row] /= tableau[row, entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, entering], tableau[row])
        leaving, basis[row] = basis[row], entering
        if leaving == 2 * n:
            z = np.zeros(n)
            for i, variable in enumerate(basis):
                if n <= variable < 2 * n:
                    z[variable - n] = tableau[i, -1]
            return z
        entering = leaving + n if leaving < n else leaving - n
        column = tableau[:, entering]
        rows = np.flatnonzero(column > TOLERANCE)
        if not len(rows):
            break
        # the lexicographically smallest ratio; the covering variable leaves where it ties
        ratios = tableau[rows, -1] / column[rows]
        rows = rows[ratios <= ratios.min() + TOLERANCE]
        covering = [r for r in rows if basis[r] == 2 * n]
        if covering:
            row = covering[0]
            continue
        for j in range(n):
            if len(rows) == 1:
                break
            ratios = tableau[rows, j] / column[rows]
            rows = rows[ratios <= ratios.min() + TOLERANCE]
        row = int(rows[0])
    return None


@lru_cache(maxsize=4096)
def shear_capacity(
    contact_stiffness: tuple[float, ...],
    spring_stiffness: float,
    friction: float,
    tile_limit: float,
) -> float:
    """Return the shear that a palm carries when its first tile reaches ``tile_limit`` [N].

    Parameters as of `share_load`, hashable; the last few thousand answers are kept.
    """
    sharing = share_load(contact_stiffness, spring_stiffness, friction)
    return sharing.capacity(np.full(len(contact_stiffness), tile_limit))
