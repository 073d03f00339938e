"""Guess the plan without several tiles, from the plan with all and those without one of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hand_models.base import Array
from planner.programs import Outcome, parted
from planner.solving import LeastUtilisation

__all__ = ["superposed"]


def superposed(whole: LeastUtilisation, others: Sequence[LeastUtilisation]) -> LeastUtilisation:
    """Return a start for the active-set method: the changes of all losses, added up.

    Loads and multipliers are those of the whole stance plus what each loss changes of them; mostly
    the same rows are active without all of the tiles.

    Parameters
    ----------
    whole : LeastUtilisation
        Result with all tiles.
    others : sequence of LeastUtilisation
        Results without one tile each, or more.
    """
    meant = [each.meant for each in others]
    found = [each for each in meant if each is not None]
    both = whole.meant is not None and len(found) == len(meant)
    return whole._replace(
        outcome=_added(whole.outcome, [each.outcome for each in others]),
        meant=_added(whole.meant, found) if whole.meant is not None and both else None,
        spare=(),
    )


def _added(first: Outcome, others: Sequence[Outcome]) -> Outcome:
    """Return an outcome with the differences of others from it added to it."""
    known = all(each.balance_dual is not None for each in (first, *others))
    each = [_numbers(outcome, balance=known) for outcome in (first, *others)]
    # the first plus the differences of the others from it
    whole = np.add.reduce(each) - len(others) * each[0]
    hands = len(first.loads)
    sizes = [len(part) for part in (*first.loads, *first.limit_duals, *first.hard_duals)]
    loads = sum(sizes[:hands])
    np.maximum(whole[loads : sum(sizes)], 0.0, out=whole[loads : sum(sizes)])
    *parts, rest = parted(whole, [*sizes, len(whole) - sum(sizes)])
    return Outcome(
        first.solved,
        first.status,
        first.iterations,
        float(rest[0]),
        tuple(parts[:hands]),
        tuple(parts[hands : 2 * hands]),
        tuple(parts[2 * hands :]),
        rest[1:] if known else None,
    )


def _numbers(outcome: Outcome, *, balance: bool) -> Array:
    """Return all numbers of an outcome: loads, multipliers of limits and hard rows, the rest."""
    parts = [*outcome.loads, *outcome.limit_duals, *outcome.hard_duals, np.array([outcome.value])]
    if balance and outcome.balance_dual is not None:
        parts.append(outcome.balance_dual)
    return np.concatenate(parts)
