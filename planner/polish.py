"""The last digits of a plan: its active rows, and the one least point where they meet.

An interior-point solver ends near the optimum of `program.Unique`, whose second term is so small
that tensions may be off by newtons while the objective has all its digits. Which rows are active is
clear by then. With these as equations the optimum is one linear system (Karush, Kuhn and Tucker),

    [ Q  Aᵀ ] [ x ]   [ −c ]
    [ A  0  ] [ λ ] = [  b ] ,      x = (u, z),

and it is the optimum if λ ≥ 0 and every other row holds. Where some do not, they change sides, a
few times at most.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.linalg import LinAlgWarning, lu_factor, lu_solve

from hand_models.frames import Array
from planner.program import Outcome, tie_weight
from planner.stance_data import StanceData

__all__ = ["polished"]

ROUNDS: Final = 6
"""Systems that are solved at most."""

HOLDS: Final = 1e-9
"""By how much a row may be broken, scaled."""

PUSHES: Final = 1e-7
"""How far below zero a multiplier may be, those of the limits adding up to one."""

SOFT: Final = 1e-13
"""Softness of equations, so that rows that say the same do not make the system singular."""

STEPS: Final = 2
"""Refinements of each solution, which take the softness back."""


def polished(data: StanceData, outcome: Outcome) -> Outcome | None:
    """Return the outcome of `program.unique` with its loads exact; None if that is not found.

    Parameters
    ----------
    data : StanceData
    outcome : Outcome
        Solved.
    """
    hands = data.hands
    ends = np.cumsum([1, *(len(hand.unit) for hand in hands)])
    limits = [len(hand.l0) for hand in hands]
    n, count, nb = int(ends[-1]), sum(limits), len(data.wrench)
    rows = np.zeros((count + sum(len(hand.h) for hand in hands), n))
    rows[:count, 0] = -1.0
    G, at, hard = np.zeros((nb, n)), 0, count
    for i, hand in enumerate(hands):
        columns = slice(int(ends[i]), int(ends[i + 1]))
        G[:, columns] = hand.G
        rows[at : at + limits[i], columns] = hand.L
        rows[hard : hard + len(hand.h), columns] = hand.H
        at, hard = at + limits[i], hard + len(hand.h)
    most = np.concatenate([*(-hand.l0 for hand in hands), *(hand.h for hand in hands)])
    weight = tie_weight(data.shape)
    # the objective over its small weight, so that both of its parts have a say
    c = np.zeros(n)
    c[0] = 1.0 / weight
    Q = np.zeros(n)
    Q[1:] = 2.0 * np.concatenate([hand.tie for hand in hands]) ** 2
    x = np.concatenate(
        [[outcome.value], *(y / hand.unit for y, hand in zip(outcome.loads, hands, strict=True))]
    )
    duals = np.concatenate([*outcome.limit_duals, *outcome.hard_duals])
    active = duals > most - rows @ x
    for _ in range(ROUNDS):
        found = _meeting(Q, c, np.vstack([G, rows[active]]), np.append(data.offset, most[active]))
        if found is None:
            return None
        x, multipliers = found
        broken = rows @ x - most > HOLDS
        broken[active] = False
        pushing = multipliers[nb:] * weight >= -PUSHES
        if pushing.all() and not broken.any():
            loads = tuple(x[ends[i] : ends[i + 1]] * hand.unit for i, hand in enumerate(hands))
            return replace(outcome, value=float(x[0]), loads=loads)
        active[np.flatnonzero(active)[~pushing]] = False
        active |= broken
    return None


def _meeting(Q: Array, c: Array, A: Array, b: Array) -> tuple[Array, Array] | None:
    """Return x and λ of least ½ xᵀQ x + cᵀx with A x = b; None where there is no such point."""
    n, m = len(c), len(b)
    K = np.zeros((n + m, n + m))
    K[:n, n:], K[n:, :n] = A.T, A
    K.flat[: n * (n + m) : n + m + 1] = Q
    goal = np.append(-c, b)
    soft = K.copy()
    soft.flat[:: n + m + 1] += np.append(np.full(n, SOFT), np.full(m, -SOFT))
    with warnings.catch_warnings():
        warnings.simplefilter("error", LinAlgWarning)
        try:
            factors = lu_factor(soft, check_finite=False, overwrite_a=True)
        except LinAlgWarning:
            return None
    found = lu_solve(factors, goal, check_finite=False)
    for _ in range(STEPS):
        found += lu_solve(factors, goal - K @ found, check_finite=False)
    if not np.isfinite(found).all() or np.abs(K[n:] @ found - b).max() > HOLDS:
        return None
    return found[:n], found[n:]
