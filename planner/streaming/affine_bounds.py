"""Lower bound of the least utilisation, affine in the body wrench, from one solved program.

With multipliers λ ≥ 0 of the limit rows, Σ λ = 1, μ ≥ 0 of the hard rows and ν of the balance,
every plan z of a body wrench W has

    u ≥ λ·(L z + l0) + μ·(H z − h) + ν·(G z + g − W) = λ·l0 − μ·h + ν·(g − W) + r·z,

r = Lᵀλ + Hᵀμ + Gᵀν. The rows are L z + l0 ≤ u (limits), H z ≤ h (hard rows) and G z + g = W
(balance). A solver's multipliers leave a small r; they are repaired until r is zero except for
rounding, and the bound is lowered by the rest of r, with no load above `LOAD_BOX`. So the bound is
exact, and valid for every W, not only that of the program.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from planner.programs import LOAD_BOX, WRENCH_UNIT, Outcome, StanceData

__all__ = ["AffineBound", "affine_bound"]


class AffineBound(NamedTuple):
    """Lower bound of the least utilisation: slope · body wrench + constant.

    Attributes
    ----------
    slope : ndarray, shape (6,)
        Slope of the bound in the body wrench in B [1/N, 1/(N·m)].
    constant : float
        Bound at zero body wrench.
    """

    slope: Array
    constant: float


def affine_bound(data: StanceData, outcome: Outcome) -> AffineBound | None:
    """Return the lower bound of the utilisation that a program's multipliers prove, for any wrench.

    Parameters
    ----------
    data : StanceData
        Rows of all hands, and the body wrench of the program.
    outcome : Outcome
        Solved outcome of `programs.margin` or `programs.unique`; of the latter, the repair of the
        multipliers takes out the second term.

    Returns
    -------
    AffineBound or None
        None if the multipliers could not be repaired.
    """
    assert outcome.balance_dual is not None
    limit, hard = np.concatenate(outcome.limit_duals), np.concatenate(outcome.hard_duals)
    signed = np.concatenate([limit, hard])
    signed[signed < 1e-8] = 0.0  # less is the solver's error
    # stationarity (M rows) and Σ λ = 1, as rows over λ, μ, ν
    whole, balance = data.rows.whole, len(outcome.balance_dual)
    rows = np.zeros((whole.shape[1] + 1, len(whole)))
    rows[:-1] = np.hstack([whole[balance:].T, whole[:balance].T])
    rows[-1, : len(limit)] = 1.0
    goal = np.zeros(len(rows))
    goal[-1] = 1.0
    multipliers = np.concatenate([signed, outcome.balance_dual])
    for _ in range(3):  # each takes nearly all of what is left
        error = goal - rows @ multipliers
        # so little of the utilisation needs no further step
        if LOAD_BOX * float(np.abs(error).sum()) <= 1e-9:
            break
        # each changes in proportion to its size, so that none of the signed ones turns over
        weights = multipliers.copy()
        weights[len(signed) :] = 1.0
        kept = np.flatnonzero(weights)
        scaled = rows[:, kept] * weights[kept]
        change = np.linalg.lstsq(scaled, error, rcond=None)[0]
        multipliers[kept] += weights[kept] * change
        np.maximum(multipliers[: len(signed)], 0.0, out=multipliers[: len(signed)])
    multipliers /= multipliers[: len(limit)].sum()
    left = (rows @ multipliers)[:-1]
    price = LOAD_BOX * float(np.abs(left).sum())
    if not price <= 1e-6:  # of the utilisation: for more there is no bound
        return None
    nu = multipliers[len(signed) :]
    g = np.sum([hand.g for hand in data.hands], axis=0)
    constant = -float(multipliers[: len(signed)] @ data.rows.rest)
    constant += float(nu @ g - nu[6:] @ data.wrench[6:]) - price
    return AffineBound(-nu[:6] / WRENCH_UNIT, constant)
