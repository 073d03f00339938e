"""The proof that a body wrench cannot be had at any utilisation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import linprog

from hand_models.frames import Array
from hand_models.wrench_space import Row, WrenchSpace
from planner import program
from planner.plan import Certificate, LimitName
from planner.program import UNLIMITED, WRENCH_UNIT, Outcome, StanceData

__all__ = ["certify", "limit_name"]

BLOCKING: Final = 1e-6
"""Multipliers of hard rows below this do not count as blocking a direction of unit length."""

CLOSE: Final = 0.1
"""What a certificate's direction must gain, relative to what is missing, to turn by a unit."""


def certify(
    data: StanceData, limbs: Sequence[str], spaces: Sequence[WrenchSpace], nearest: Outcome
) -> Certificate | None:
    """Return a checked proof that no loads at any utilisation give the body wrench.

    With the direction d and multipliers λ ≥ 0 of the hard rows, every z with H z ≤ h has

        d · (G z + g) = d · g + (Gᵀd − Hᵀλ) · z + λ · H z ≤ d · g + |Gᵀd − Hᵀλ| · X + λ · h

    over the box |z| ≤ X of `UNLIMITED`. The bound must be below d · W.

    Parameters
    ----------
    data : StanceData
    limbs : sequence of str
        Of the hands.
    spaces : sequence of WrenchSpace
        Their sets, for the rows' names.
    nearest : Outcome
        The loads that come nearest to the body wrench.

    Returns
    -------
    Certificate or None
        None if the bound proves nothing.
    """
    hands = data.hands
    reached = program.body_wrench(data, nearest.loads)
    missing = data.wrench - reached
    direction, multipliers = _polished(
        missing,
        data.wrench - sum(hand.g for hand in hands),
        np.hstack([hand.G for hand in hands]),
        block_diag(*(hand.H for hand in hands)),
        np.concatenate([hand.h for hand in hands]),
    )
    supremum = 0.0
    blocking: list[tuple[float, LimitName]] = []
    splits = np.cumsum([len(hand.h) for hand in hands])[:-1]
    for limb, space, hand, mine in zip(
        limbs,
        spaces,
        hands,
        np.split(multipliers, splits),
        strict=True,
    ):
        leak = np.abs(hand.G.T @ direction - hand.H.T @ mine).sum() * UNLIMITED
        supremum += float(direction @ hand.g + mine @ hand.h + leak)
        hard_rows = space.rows[len(space.s) :]
        blocking += [
            (float(value), limit_name(limb, row))
            for row, value in zip(hard_rows, mine, strict=True)
            if value > BLOCKING
        ]
    needed = float(direction @ data.wrench)
    if not supremum < needed:
        return None
    return Certificate(
        direction=direction / WRENCH_UNIT,
        supremum=supremum,
        needed=needed,
        shortfall=missing * WRENCH_UNIT,
        nearest=reached * WRENCH_UNIT,
        blocking=tuple(name for _, name in sorted(blocking, key=lambda pair: -pair[0])),
    )


def _polished(missing: Array, offset: Array, G: Array, H: Array, h: Array) -> tuple[Array, Array]:
    """Return a unit d near that of ``missing``, and λ ≥ 0, that prove the most.

    A vertex of max d·(W − g) − λ·h − X Σ|Gᵀd − Hᵀλ|, less `CLOSE` for turning d away: the error
    of an interior-point solution would be magnified by a box as large as X.
    """
    rows, size = H.shape
    length = float(np.linalg.norm(missing))
    near = missing / length
    # variables: d (6), t ≥ |d − near| (6), λ (rows), the parts of Gᵀd − Hᵀλ (size each)
    one, none = np.eye(6), np.zeros((6, rows + 2 * size))
    leak = np.eye(size)
    result = linprog(
        np.concatenate(
            [-offset / length, np.full(6, CLOSE), h / length, np.full(2 * size, UNLIMITED / length)]
        ),
        A_ub=np.vstack([np.hstack([one, -one, none]), np.hstack([-one, -one, none])]),
        b_ub=np.concatenate([near, -near]),
        A_eq=np.hstack([G.T, np.zeros((size, 6)), -H.T, -leak, leak]),
        b_eq=np.zeros(size),
        bounds=[(-1.0, 1.0)] * 6 + [(0.0, None)] * (6 + rows + 2 * size),
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if result.status != 0 or result.x is None:
        return near, np.zeros(rows)
    length = float(np.linalg.norm(result.x[:6]))
    if length < BLOCKING:
        return near, np.zeros(rows)
    return result.x[:6] / length, np.maximum(result.x[12 : 12 + rows], 0.0) / length


def limit_name(limb: str, row: Row) -> LimitName:
    """Return the name of a row of a limb's hand."""
    return LimitName(limb, row.finger, row.phalanx, row.limit)
