"""Prove by its multipliers that a plan cannot do without some fingers, without another program.

With u* the least utilisation, λ, μ and ν the multipliers of limits, hard rows and balance, and v
the fingers' part of the dual objective, every plan without the fingers has

    u' ≥ (u* − v) / (1 − Σ λ),

Σ over limits of the fingers, as of spare hands (`planner.solving.spare_hands`). The balance and
rows of the whole hand depend on its wrench w alone, p·w by their multipliers. In the columns V of
its fingers they are pᵀ V. So the wrench of the fingers at zero load, V y, adds (pᵀ V) y to v.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from hand_models.hand import FINGERS
from planner.prepare import PreparedStance
from planner.programs import LOAD_UNIT, TOLERANCES
from planner.solving import StanceAnswer

__all__ = ["cannot_spare"]


def cannot_spare(
    whole: PreparedStance, found: StanceAnswer, fingers: Collection[tuple[str, str]]
) -> bool:
    """Return whether every plan without some fingers is proven to use more than a plan with them.

    Parameters
    ----------
    whole : PreparedStance
        The stance before tiles slipped, with rows of the same names and places.
    found : StanceAnswer
        The answer with the fingers, of hands with fixed wrists.
    fingers : collection of (str, str)
        Limb and finger of each.
    """
    prepared, least = found.prepared, found.answer.solution.least
    if least.balance_dual is None:
        return False
    own, share = 0.0, 1.0
    for h, limb in enumerate(prepared.limbs):
        names = [finger for at, finger in fingers if at == limb]
        if not names:
            continue
        hand, limits = prepared.batch.hands[h], least.limit_duals[h]
        sets = [each.hands.spaces[h] for each in (whole, prepared)]
        rows = [each.hands.data.hands[h] for each in (whole, prepared)]
        multipliers = np.concatenate([limits, least.hard_duals[h]])
        owners = [row.finger for row in sets[0].rows]
        theirs = np.array([owner in names for owner in owners])
        of_hand, nobody = multipliers * [owner is None for owner in owners], len(limits)
        columns = np.array(["/" in name for name in sets[0].columns])
        V = np.concatenate([each.generators[:, columns] for each in sets], axis=1)
        slopes = np.concatenate(
            [
                (
                    of_hand[:nobody] @ each.L
                    + of_hand[nobody:] @ each.H
                    + least.balance_dual @ each.G
                )[columns]
                for each in rows
            ]
        )
        tiles = np.logical_or.reduce([hand.finger_of == FINGERS.index(name) for name in names])
        forces = (hand.loads[tiles, None, :, 0] @ hand.axes[tiles, :2])[:, 0]
        x, y, z = hand.positions[tiles].T
        along, across, up = forces.T
        moments = np.array([y * up - z * across, z * along - x * up, x * across - y * along]).T
        wrench = np.concatenate([forces.sum(axis=0), moments.sum(axis=0)])
        loads = np.linalg.lstsq(V, wrench, rcond=1e-9)[0]
        if not np.abs(V @ loads - wrench).max() <= 1e-9 * max(1.0, np.abs(wrench).max()):
            return False
        consts = np.concatenate([rows[1].l0, -rows[1].h])
        own += float(multipliers[theirs] @ consts[theirs])
        own += float(slopes @ loads) / LOAD_UNIT
        share -= float(limits[theirs[: len(limits)]].sum())
    # that of u* itself, and the term that makes plans unique: at each of the two, and across
    error = 4.0 * TOLERANCES.optimality * max(1.0, found.answer.whole)
    return least.value - own - error > max(share, 0.0) * found.answer.whole
