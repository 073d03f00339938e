"""Prove lower bounds of a program's optimum by its multipliers (weak duality)."""

from __future__ import annotations

import math

import numpy as np

from hand_models.base import Array
from planner.programs import TIE_WEIGHT, Outcome, StanceData, tie_weight
from planner.solving.active_set import TOLERANCES

__all__ = [
    "convex_bound",
    "is_least",
    "least_bound",
    "unique_bound",
    "unproven_sentences",
]


def is_least(value: float, bound: float) -> bool:
    """Return whether a value exceeds its lower bound by at most 1e-5, relative above 1.

    Parameters
    ----------
    value, bound : float
        A utilisation or an effort, and its lower bound.
    """
    return value - bound <= TOLERANCES.optimality * max(1.0, value)


def unproven_sentences(words: str, value: float, bound: float) -> tuple[str, ...]:
    """Return a sentence if a lower bound does not prove a value to be the least; else nothing.

    Parameters
    ----------
    words : str
        Name of the quantity, with which the sentence begins.
    value, bound : float
        The quantity and its lower bound.
    """
    if is_least(value, bound):
        return ()
    return (f"{words} {value:.6g} is only proven to be above {bound:.6g}",)


def least_bound(data: StanceData, outcome: Outcome) -> float:
    """Return a lower bound of the least utilisation from the multipliers of `programs.margin`.

    With λ of the limit rows (Σ λ = 1), μ of the hard rows and ν of the balance, every plan has
    u ≥ λ·l0 − μ·h − ν·(W − g) if Lᵀλ + Hᵀμ + Gᵀν is zero within 1e-5. Otherwise −∞ is returned.
    The rows are L z + l0 ≤ u, H z ≤ h and G z + g = W.
    """
    return _dual_bound(data, outcome, None, 0.0, _missing(outcome))


def unique_bound(data: StanceData, outcome: Outcome, share: float = 1.0) -> float:
    """Return a lower bound of the least utilisation from the multipliers of `programs.unique`.

    The second term f of that program is convex, so with its plan z₁ every plan z has

        u ≥ [least of u + ∇f(z₁)·z] + f(z₁) − ∇f(z₁)·z₁ − f(z),

    the bracket as in `least_bound`. For a plan with at most the utilisation u₁ of z₁, f(z) is at
    most `TIE_WEIGHT` u₁²: no tension is above u₁ times its maximum (weights of other loads are
    negligible).

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    outcome : Outcome
        Outcome of `programs.unique`.
    share : float, optional
        Factor on the weight of the second term with which the program was solved.
    """
    rows = data.rows
    z = np.concatenate(outcome.loads) / rows.unit
    small = share * tie_weight(len(data.hands)) * rows.tie * z
    value = -float(small @ z) - share * TIE_WEIGHT * outcome.value**2
    slopes = 2.0 * small
    return _dual_bound(data, outcome, slopes, 0.0, _missing(outcome)) + value


def convex_bound(
    data: StanceData, outcome: Outcome, value: float, slopes: Array, cap: float
) -> float:
    """Return a lower bound of a convex function f from the multipliers of its program.

    Every plan z has f(z) ≥ f(z₁) + ∇f(z₁)·(z − z₁), with z₁ the plan of the outcome, and the
    multipliers bound that linear function from below, as in `least_bound`.

    Parameters
    ----------
    data : StanceData
        Scaled rows of all hands, and the wrench that they must balance.
    outcome : Outcome
        Outcome of the program that minimises f, with its multipliers.
    value : float
        f(z₁).
    slopes : ndarray, shape (M,)
        Gradient ∇f(z₁) in the scaled loads of all hands.
    cap : float
        Cap on the utilisation.

    Returns
    -------
    float
        −∞ if the multipliers prove no bound.
    """
    z = np.concatenate(outcome.loads) / data.rows.unit
    return _dual_bound(data, outcome, slopes, cap, 0.0) + value - float(slopes @ z)


def _missing(outcome: Outcome) -> float:
    """Return how far the multipliers of limits are from a sum of one."""
    return abs(1.0 - float(np.concatenate(outcome.limit_duals).sum()))


def _dual_bound(
    data: StanceData, outcome: Outcome, slopes: Array | None, cap: float, leak: float
) -> float:
    """Return a lower bound of slopes · z over plans, with limits at a cap, from multipliers.

    ``leak``: how far multipliers are from stationary besides.
    """
    nu, rows = outcome.balance_dual, data.rows
    if nu is None:
        return -math.inf
    signed = np.concatenate([*outcome.limit_duals, *outcome.hard_duals])
    scale = max(1.0, abs(outcome.value))
    tolerance = 1e-5  # of multipliers from stationary, and below zero
    if signed.min(initial=0.0) < -tolerance * scale:
        return -math.inf
    stationary = np.append(nu, signed) @ rows.whole
    if slopes is not None:
        stationary += slopes
    if leak + float(np.abs(stationary).sum()) > tolerance * scale:
        return -math.inf
    below = float(signed @ rows.rest + nu @ data.offset) + 1e-9 * scale  # rounding, relative
    return -below - cap * float(signed[: rows.limits].sum())
