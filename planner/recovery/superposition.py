"""Guess the plan without several tiles, from the plan with all and those without one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hand_models.base import Array
from planner.programs import Outcome
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

    def parts(name: str, least: float = -np.inf) -> tuple[Array, ...]:
        each = zip(*(getattr(other, name) for other in (first, *others)), strict=True)
        return tuple([np.maximum(_sum(own), least) for own in each])

    balances = [each.balance_dual for each in (first, *others)]
    known = [each for each in balances if each is not None]
    return replace(
        first,
        value=float(_sum([each.value for each in (first, *others)])),
        loads=parts("loads"),
        limit_duals=parts("limit_duals", 0.0),
        hard_duals=parts("hard_duals", 0.0),
        balance_dual=_sum(known) if len(known) == len(balances) else None,
    )


def _sum(values: Sequence[Array] | Sequence[float]) -> Array:
    """Return the first of some values plus the differences of the others from it."""
    first, *others = map(np.asarray, values)
    return np.asarray(first + sum(each - first for each in others))
