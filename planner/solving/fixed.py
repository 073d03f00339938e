"""The plan of hands with fixed wrists: least utilisation, of that the least tensions."""

from __future__ import annotations

from planner import deadline, programs
from planner.deadline import Overlap, late
from planner.prepare import PreparedStance, Sets
from planner.solving.prepared_checks import PreparedChecks, read_loads
from planner.solving.solution import Solution
from planner.solving.unique_plan import least_utilisation

__all__ = ["solve_fixed", "solve_in_two"]


def solve_fixed(prepared: PreparedStance, checks: Overlap[PreparedChecks]) -> Solution:
    """Return the plan of least utilisation, of these that of least tensions.

    One solve has its utilisation, and mostly its active rows, which give its last digits; else
    a second solve has these. What reads and checks the loads is prepared meanwhile.
    """
    sets, cap = prepared.at_rest, prepared.question.limits.utilisation
    with checks:
        found = least_utilisation(sets.data)
    first = Solution(sets, found.outcome, cap, bound=found.bound if found.proven else None)
    if found.proven:
        if found.loads is None:
            first = _tie_broken(prepared, checks.result(), first)
        else:
            reading = read_loads(prepared, checks.result(), sets, found.loads)
            first = first._replace(reading=reading)
        if not first.wrong:
            return first
    second = solve_in_two(prepared, checks, sets)
    second = second._replace(unfinished=first.unfinished + second.unfinished)
    if found.outcome.solved and not second.outcome.solved and deadline.expired():
        reading = read_loads(prepared, checks.result(), sets, found.outcome.loads)
        return first._replace(reading=reading).late("least_utilisation")
    return second


def solve_in_two(prepared: PreparedStance, checks: Overlap[PreparedChecks], sets: Sets) -> Solution:
    """Return the plan of least effort among those of the very least utilisation."""
    cap, outcome = prepared.question.limits.utilisation, programs.margin(sets.data)
    found = Solution(sets, outcome, cap)
    return _tie_broken(prepared, checks.result(), found) if outcome.solved else found


def _tie_broken(prepared: PreparedStance, checks: PreparedChecks, found: Solution) -> Solution:
    """Return the plan of least tensions among those of least utilisation."""
    sets = found.sets
    tidy = programs.least_tensions(sets.data, found.outcome.value)
    if tidy.solved:
        found = found._replace(reading=read_loads(prepared, checks, sets, tidy.loads))
    else:
        found = found.late(*late("tie_break"))
    if not tidy.solved or found.wrong:
        found = found._replace(reading=read_loads(prepared, checks, sets, found.outcome.loads))
    return found
