"""The plan of least effort within the cap on the utilisation."""

from __future__ import annotations

from planner import deadline, programs
from planner.deadline import Budget, Overlap, late
from planner.floating import WristSolution, least_effort, with_room
from planner.prepare import PreparedStance
from planner.programs import SLACK
from planner.solving.floating import with_wrists
from planner.solving.prepared_checks import PreparedChecks, read_loads
from planner.solving.solution import Solution

__all__ = ["solve_effort"]


def solve_effort(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    found: Solution,
    budget: Budget,
) -> Solution:
    """Return the plan of least effort, if any is within the cap; else the one that was found."""
    if not found.passes:
        return found
    if found.search is not None:
        return _solve_floating_effort(prepared, checks, found, found.search, budget)
    cap = prepared.question.limits.utilisation
    if found.outcome.value > cap + SLACK:
        return found
    # where the least utilisation is the cap itself, rounding must not empty the set
    cap = max(cap, found.outcome.value + 0.5 * SLACK)
    effort = programs.effort(found.sets.data, cap)
    if not effort.solved and deadline.expired():
        return found._replace(cap=cap).late("least_effort")
    found = found._replace(cap=cap, effort=effort)
    if not effort.solved:
        return found
    return found._replace(reading=read_loads(prepared, checks.result(), found.sets, effort.loads))


def _solve_floating_effort(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    found: Solution,
    plan: WristSolution,
    budget: Budget,
) -> Solution:
    """Return the plan of least effort that floating wrists come to from that of least use."""
    cap, used = prepared.question.limits.utilisation, plan.measure.utilisation
    if used > cap + SLACK:
        return found
    cap = with_room(cap, used)
    search = least_effort(prepared.hands, plan, cap, budget)
    found = found._replace(cap=cap).late(*late("least_effort"))
    if not search.outcome.solved and deadline.expired():
        return found
    effort = search.outcome if search.outcome.solved else None
    return with_wrists(prepared, checks, found._replace(effort=effort), search)
