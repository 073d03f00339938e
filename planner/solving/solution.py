"""The plan that is asked for: of fixed wrists, of floating ones, and that of least effort."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

from planner import deadline, programs
from planner.deadline import Budget, Overlap, Unfinished, late
from planner.floating import LargestFactor, WristSolution, least_effort, least_use, with_room
from planner.prepare import PreparedStance, Sets
from planner.programs import SLACK, Outcome, StanceData, tension_trade
from planner.solving import dual_bounds
from planner.solving.prepared_checks import PreparedChecks, Reading, read_loads
from planner.solving.spare_hands import SpareHand, less_tense
from planner.solving.unique_plan import LeastUtilisation, is_least, least_utilisation

__all__ = [
    "Solution",
    "not_least",
    "solve_at_vertex",
    "solve_effort",
    "solve_in_two",
    "solve_question",
]


class Solution(NamedTuple):
    """What solving has come to.

    Attributes
    ----------
    sets : Sets
        Of the hands, about the plan.
    outcome : Outcome
        Of the program of least utilisation.
    cap : float
        Under which the effort was made least; else the one asked for.
    reading : Reading or None
        Of the plan's loads; None without any.
    bound : float or None
        Of the least utilisation, from below, where it is known already.
    search : WristSolution or None
        Where the plan's floating wrists are.
    least_use : WristSolution or None
        Where they are at the least utilisation.
    factor : LargestFactor or None
        The largest load factor that the search met.
    effort : Outcome or None
        Of the program of least effort.
    unfinished : tuple of str
        What the deadline came before.
    least : LeastUtilisation or None
        What the plan was found from, of fixed wrists.
    spare : tuple of SpareHand
        Hands that add nothing to the plan of least tension.
    """

    sets: Sets
    outcome: Outcome
    cap: float
    reading: Reading | None = None
    bound: float | None = None
    search: WristSolution | None = None
    least_use: WristSolution | None = None
    factor: LargestFactor | None = None
    effort: Outcome | None = None
    unfinished: tuple[Unfinished, ...] = ()
    least: LeastUtilisation | None = None
    spare: tuple[SpareHand, ...] = ()

    @property
    def wrong(self) -> tuple[str, ...]:
        """What is wrong with the plan."""
        if self.effort is not None and not self.effort.solved:
            return (f"least effort: {self.effort.status}",)
        return () if self.reading is None else self.reading.wrong

    @property
    def passes(self) -> bool:
        """Whether there is a plan that passes its checks."""
        return self.outcome.solved and not self.wrong

    @property
    def utilisation(self) -> float:
        """The largest of the hands; infinite without a plan."""
        return math.inf if self.reading is None else self.reading.utilisation

    @property
    def unproven(self) -> bool:
        """Whether a search for floating wrists ended without proof."""
        return self.search is not None and self.search.found == "unproven"

    def late(self, *names: Unfinished) -> Solution:
        """Return the same with something more that is not finished."""
        return self._replace(unfinished=self.unfinished + names)


def solve_question(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    budget: Budget,
    near: WristSolution | None = None,
    before: LeastUtilisation | None = None,
) -> Solution:
    """Return the plan that is asked for.

    ``near``: where floating wrists are sought from; ``before``: how the program of the same fixed
    hands ended at another wrench.
    """
    if prepared.hands.floating:
        found = _solve_floating(prepared, checks, budget, near)
    else:
        found = _solve_fixed(prepared, checks, before)
    if prepared.question.objective == "min_effort":
        found = solve_effort(prepared, checks, found, budget)
    return found


def _solve_fixed(
    prepared: PreparedStance, checks: Overlap[PreparedChecks], before: LeastUtilisation | None
) -> Solution:
    """Return the plan that is meant: of least utilisation, but for what less tension is worth.

    One solve has the least utilisation, and mostly its active rows, which give its last digits and
    the plan; else a second solve has these. What reads and checks the loads is prepared meanwhile.
    """
    sets, cap = prepared.at_rest, prepared.question.limits.utilisation
    with checks:
        found = least_utilisation(sets.data, cap, prepared.batch.closing_tensions, before)
    bound = found.bound if found.proven else None
    first = Solution(sets, found.outcome, cap, bound=bound, least=found, spare=found.spare)
    if found.proven:
        if found.meant is None:
            first = _less_tense(prepared, checks.result(), first)
        else:
            reading = read_loads(prepared, checks.result(), sets, found.meant.loads)
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
    """Return the plan that is meant from the very least utilisation, by a solver for each.

    Where hands are asked for thousands of times what they can do, a small error of the largest load
    may be more than the others' checks let pass: then the plan is a vertex.
    """
    cap, outcome = prepared.question.limits.utilisation, programs.margin(sets.data)
    found = Solution(sets, outcome, cap)
    if not outcome.solved:
        return found
    found = _less_tense(prepared, checks.result(), found)
    if deadline.expired() or not (found.wrong or not_least(found)):
        return found
    exact = solve_at_vertex(prepared, checks, sets)
    return exact if exact.outcome.solved else found


def solve_at_vertex(
    prepared: PreparedStance, checks: Overlap[PreparedChecks], sets: Sets
) -> Solution:
    """Return a plan of least utilisation where as many rows meet as there are loads."""
    found = Solution(sets, programs.vertex(sets.data), prepared.question.limits.utilisation)
    if not found.outcome.solved:
        return found
    return found._replace(reading=read_loads(prepared, checks.result(), sets, found.outcome.loads))


def _less_tense(prepared: PreparedStance, checks: PreparedChecks, found: Solution) -> Solution:
    """Return the plan of less tension for a little utilisation, or else for none."""
    sets, least = found.sets, found.outcome.value
    trade = tension_trade(least, found.cap)
    tidy, spare = less_tense(sets.data, found.outcome, trade, prepared.batch.closing_tensions)
    found = found._replace(spare=spare)
    if not (tidy.solved or deadline.expired()):
        tidy = programs.least_tensions(sets.data, least)
    if tidy.solved:
        found = found._replace(reading=read_loads(prepared, checks, sets, tidy.loads))
    else:
        found = found.late(*late("tie_break"))
    if not tidy.solved or found.wrong:
        reading = read_loads(prepared, checks, sets, found.outcome.loads)
        found = found._replace(reading=reading, spare=())
    return found


def _solve_floating(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    budget: Budget,
    near: WristSolution | None,
) -> Solution:
    """Find where floating wrists go, and return the plan there."""
    search, factor = least_use(prepared.hands, budget, near)
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
        return _with_wrists(prepared, checks, found, _less_tense_beside(prepared, search))
    return found._replace(sets=prepared.hands.sets(search.point))


def _less_tense_beside(prepared: PreparedStance, search: WristSolution) -> WristSolution:
    """Return a search's plan with less tension in its fixed hands, floating wrists as they are."""
    wrists, data = prepared.hands.wrists, search.sets.data
    if None not in wrists or deadline.expired():
        return search
    loads = search.point.loads
    held = [
        hand if wrist is None else hand.held(y)
        for hand, wrist, y in zip(data.hands, wrists, loads, strict=True)
    ]
    cap = prepared.question.limits.utilisation
    trade = tension_trade(search.measure.utilisation, cap)
    found = programs.less_tension(StanceData(tuple(held), data.wrench), trade)
    if not found.solved:
        return search
    pairs = zip(wrists, loads, found.loads, strict=True)
    loads = tuple([new if wrist is None else old for wrist, old, new in pairs])
    return replace(search, point=replace(search.point, loads=loads))


def _with_wrists(
    prepared: PreparedStance,
    checks: Overlap[PreparedChecks],
    found: Solution,
    search: WristSolution,
) -> Solution:
    """Return a solution with floating wrists, and the plan, where a search has found them."""
    reading = read_loads(prepared, checks.result(), search.sets, search.point.loads, search)
    return found._replace(sets=search.sets, search=search, reading=reading)


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
    return _with_wrists(prepared, checks, found._replace(effort=effort), search)


def not_least(found: Solution) -> list[str]:
    """Return what is wrong if the multipliers do not prove the plan the best.

    But for what fixed hands give away for less tension; with floating hands, the best of their sets
    about the plan.
    """
    if found.unproven or "least_utilisation" in found.unfinished:
        return []
    data, bound, least = found.sets.data, found.bound, found.outcome.value
    if found.least_use is not None:
        # of these sets, which may be about another point, the outcome is
        data = found.least_use.sets.data
        if found.effort is None:
            least = found.least_use.measure.utilisation
    if bound is None:
        bound = dual_bounds.least_bound(data, found.outcome)
    if not is_least(least, bound):
        return [f"utilisation {least:.6g} is only proven to be above {bound:.6g}"]
    if found.effort is None:
        most, used = tension_trade(least, found.cap).most, found.utilisation
        if not is_least(used, most):
            return [f"utilisation {used:.6g} is above {most:.6g}, what less tension is worth"]
        return []
    effort = found.effort.value if found.search is None else found.search.measure.effort
    bound = dual_bounds.least_effort_bound(found.sets.data, found.effort, found.cap)
    if not is_least(effort, bound):
        return [f"effort {effort:.6g} is only proven to be above {bound:.6g}"]
    return []
