"""The plan where wrists float: where they go, and what the hands carry there."""

from __future__ import annotations

from planner.deadline import Budget, Overlap, late
from planner.floating import WristSolution, least_use
from planner.prepare import PreparedStance
from planner.solving.prepared_checks import PreparedChecks, read_loads
from planner.solving.solution import Solution

__all__ = ["solve_floating", "with_wrists"]


def solve_floating(
    prepared: PreparedStance, checks: Overlap[PreparedChecks], budget: Budget
) -> Solution:
    """Find where floating wrists go, and return the plan there."""
    search, factor = least_use(prepared.hands, budget)
    found = Solution(
        sets=prepared.at_rest,
        outcome=search.outcome,
        cap=prepared.question.limits.utilisation,
        search=search,
        least_use=search,
        factor=factor,
        unfinished=late("wrists"),
    )
    if search.exact:
        return with_wrists(prepared, checks, found, search)
    return found._replace(sets=prepared.hands.sets(search.point))


def with_wrists(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    found: Solution,
    search: WristSolution,
) -> Solution:
    """Return a solution with floating wrists, and the plan, where a search has found them."""
    reading = read_loads(prepared, checks.result(), search.sets, search.point.loads, search)
    return found._replace(sets=search.sets, search=search, reading=reading)
