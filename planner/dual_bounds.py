"""What the multipliers of a program prove: bounds from below of its least value."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from hand_models.frames import Array
from planner.program import TIE, Outcome, tie_weight
from planner.stance_data import StanceData

__all__ = ["least_bound", "least_effort_bound", "unique_bound"]

STATIONARY: Final = 1e-5
"""How far multipliers may be from stationary, and below zero, to count as a bound."""


def least_bound(data: StanceData, outcome: Outcome) -> float:
    """Return a lower bound of the least utilisation from the multipliers of `Margin`.

    With λ of the limit rows (Σ λ = 1), μ of the hard rows and ν of the balance, every plan has
    u ≥ λ·l0 − μ·h − ν·(W − g), as far as Lᵀλ + Hᵀμ + Gᵀν is zero; −∞ where it is not.
    """
    slopes = [np.zeros(len(hand.unit)) for hand in data.hands]
    leak = abs(1.0 - sum(float(limit.sum()) for limit in outcome.limit_duals))
    return _dual_bound(data, outcome, slopes, 0.0, leak)


def unique_bound(data: StanceData, outcome: Outcome) -> float:
    """Return a lower bound of the least utilisation from the multipliers of `Unique`.

    Its second term f is convex, so with the plan z₁ and its slope every plan z has

        u ≥ [least of u + ∇f(z₁)·z] + f(z₁) − ∇f(z₁)·z₁ − f(z),

    the first as in `least_bound`. Of a plan with at most the utilisation u₁ of z₁, f(z) is at most
    `TIE` u₁²: no tension is above u₁ times its maximum (weights of other loads are next to none).
    """
    slopes, value = [], 0.0
    leak = abs(1.0 - sum(float(limit.sum()) for limit in outcome.limit_duals))
    weight = tie_weight(data.shape)
    for hand, y in zip(data.hands, outcome.loads, strict=True):
        small = hand.tie * y / hand.unit
        slopes.append(2.0 * weight * hand.tie * small)
        value -= weight * float(small @ small)
    value -= TIE * outcome.value**2
    return _dual_bound(data, outcome, slopes, 0.0, leak) + value


def least_effort_bound(data: StanceData, outcome: Outcome, cap: float) -> float:
    """Return a lower bound of the least effort from the multipliers of `Effort`.

    The effort f is convex, so every plan has f(z) ≥ f(z₁) + ∇f(z₁)·(z − z₁) about the plan z₁, and
    the multipliers bound that linear function from below, as in `least_bound`.
    """
    slopes, value = [], 0.0
    for hand, y in zip(data.hands, outcome.loads, strict=True):
        z = y / hand.unit
        effort, small = hand.E @ z + hand.e0, hand.rest**2 * z
        slopes.append(2.0 * (hand.E.T @ effort + small))
        value += float(effort @ effort + small @ z - slopes[-1] @ z)
    return _dual_bound(data, outcome, slopes, cap, 0.0) + value


def _dual_bound(
    data: StanceData, outcome: Outcome, slopes: Sequence[Array], cap: float, leak: float
) -> float:
    """Return a lower bound of Σ slope · z over plans, with limits at a cap, from multipliers."""
    assert outcome.balance_dual is not None
    nu = outcome.balance_dual
    scale = max(1.0, abs(outcome.value))
    bound = -float(nu @ (data.wrench - sum(hand.g for hand in data.hands)))
    for hand, limit, hard, slope in zip(
        data.hands, outcome.limit_duals, outcome.hard_duals, slopes, strict=True
    ):
        bound += float(limit @ (hand.l0 - cap) - hard @ hand.h)
        leak += float(np.abs(slope + hand.L.T @ limit + hand.H.T @ hard + hand.G.T @ nu).sum())
        if min(limit.min(initial=0.0), hard.min(initial=0.0)) < -STATIONARY * scale:
            return -np.inf
    return bound if leak <= STATIONARY * scale else -np.inf
