"""Find the plan of the next body wrench, close to a plan of the same hands for another one.

The sets linearised at the known plan stay, and the body wrench changes. One linear program
(`programs.elastic`) on these sets says where tensions and wrists go, and which limits and hard rows
are active. Newton steps on the balance and the active rows make that point exact. A linear program
on the sets linearised there then says how much better a plan within their range can be. If that is
little, the point is the next plan. After a large change of the wrench it takes more rounds: their
steps are not cut short, as those of a search from rest are.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

from planner import programs
from planner.deadline import Budget
from planner.floating.elastic_search import firm_rows
from planner.floating.goals import LEAST_USE, SETTINGS
from planner.floating.wrist_iteration import WristSolution, gap, repaired, searching
from planner.prepare import HandSets, Sets

__all__ = ["next_plan"]


def next_plan(hands: HandSets, near: WristSolution, budget: Budget) -> WristSolution | None:
    """Return a plan close to a plan of the same hands for another body wrench.

    Parameters
    ----------
    hands : HandSets
        Hands with compliant or fixed wrists, for the new body wrench.
    near : WristSolution
        Plan of the same hands for another body wrench.
    budget : Budget
        Largest number of conic programs.

    Returns
    -------
    WristSolution or None
        A plan whose utilisation is at most the fraction `FloatingSettings.next_gap` above the least
        in the sets linearised there; ``unproven`` unless it is that least. None if there is no such
        plan close by.
    """
    goal, within = LEAST_USE, SETTINGS.first_range
    turned = Sets(near.sets.spaces, near.sets.data.turned(hands.wrench))
    now = replace(near, point=replace(near.point, factor=1.0), sets=turned)
    for rounds in range(1, SETTINGS.next_rounds + 1):
        if budget.ended:
            break
        price, loads, firm = SETTINGS.price, now.point.loads, firm_rows(now.sets)
        step = programs.elastic(now.sets.data, price, loads, firm, SETTINGS.next_nearness)
        budget.spend()
        if not step.solved:
            break
        now = searching(hands, goal, replace(now.point, loads=step.loads), within, now.sets)
        if not now.sets.finite:
            break
        if now.measure.missing + now.measure.excess > SETTINGS.next_error:
            continue
        now = _corrected(hands, now, within)
        if not now.measure.exact(hands):
            continue
        outcome = goal.solve(now.sets.data)
        budget.spend()
        most = gap(goal, now, outcome) if outcome.solved else math.inf
        if most <= SETTINGS.next_gap:
            found: Literal["least", "unproven"] = (
                "least" if most <= SETTINGS.closeness else "unproven"
            )
            return replace(now, found=found, outcome=outcome, rounds=rounds)
    return None


def _corrected(hands: HandSets, state: WristSolution, within: float) -> WristSolution:
    """Return a point after Newton steps on the balance and the active rows, exact if these met."""
    for _ in range(SETTINGS.next_corrections):
        if not state.sets.finite or state.measure.exact(hands):
            break
        state = repaired(hands, LEAST_USE, state, within)
    return state
