"""Plans of hands with fixed wrists: least utilisation, except for what is traded for less tension.

One solve gives the least utilisation and its active rows, from which the active-set method computes
the exact plan. If that plan does not pass its checks, other methods for the same plan follow, each
slower and more accurate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hand_models.base import Array
from planner import deadline, programs
from planner.deadline import Budget, Unfinished, late
from planner.prepare import HandSets, PreparedStance, Sets
from planner.programs import (
    CAP_SLACK,
    Outcome,
    StanceData,
    least_bound,
    tension_trade,
    unproven_sentences,
)
from planner.result import LoadFactor
from planner.solving.objective import MAX_MARGIN, CappedObjective
from planner.solving.solution import Solution
from planner.solving.spare_hands import SpareHand, less_tense
from planner.solving.unique_plan import LeastUtilisation, least_utilisation

__all__ = ["FixedSolution", "fixed_solutions", "most_of_fixed", "nearest_solutions"]


@dataclass(frozen=True, eq=False, kw_only=True)
class FixedSolution(Solution):
    """Loads of hands with fixed wrists.

    Attributes
    ----------
    spare : tuple of SpareHand
        Hands without which the utilisation would hardly be larger.
    start : LeastUtilisation or None
        Result from which the loads were computed; a warm start for the same hands at another body
        wrench.
    """

    spare: tuple[SpareHand, ...] = ()
    start: LeastUtilisation | None = None

    @classmethod
    def of_least(
        cls,
        prepared: PreparedStance,
        sets: Sets,
        least: Outcome,
        loads: tuple[Array, ...] = (),
        bound: float | None = None,
        start: LeastUtilisation | None = None,
    ) -> Self:
        """Return a solution whose objective is the least utilisation.

        Parameters
        ----------
        prepared : PreparedStance
            The question's stance, with hands on their holds and their sets.
        sets : Sets
            Wrench spaces of the hands and rows of the programs.
        least : Outcome
            Outcome of the program of least utilisation.
        loads : tuple of ndarray, shape (m,), optional
            Loads y of each hand to report [N]; by default none, as a later program computes them.
        bound : float, optional
            Lower bound of the least utilisation; by default computed from the multipliers.
        start : LeastUtilisation, optional
            Result that has these loads, as a warm start for other body wrenches; its spare hands
            are taken over.
        """
        cap, faults = prepared.question.limits.utilisation, tuple[str, ...]()
        if least.solved:
            bound = least_bound(sets.data, least) if bound is None else bound
            faults = unproven_sentences("utilisation", least.value, bound)
        return cls(
            sets=sets,
            loads=loads,
            least=least,
            objective=MAX_MARGIN,
            best=least,
            cap=cap,
            most=tension_trade(least.value, cap).most,
            faults=faults,
            spare=() if start is None else start.spare,
            start=start,
        )

    def best_in(
        self, objective: CappedObjective, prepared: PreparedStance, budget: Budget
    ) -> FixedSolution:
        """Return the best solution for an objective within the cap on the utilisation.

        Without loads, or if they are beyond the cap, the solution itself is returned. If the
        program is not solved, the solution is returned with the reason in ``faults``, or marked as
        unfinished.
        """
        used = self.least.value
        if not self.loads or used > self.cap + CAP_SLACK:
            return self
        # where the least utilisation is the cap itself, rounding must not empty the set
        cap = max(objective.cap(used, self.cap), used + 0.5 * CAP_SLACK)
        data = self.sets.data
        best = objective.solve(data, cap)
        if not best.solved:
            if deadline.expired():
                return self.late(objective.late)
            return replace(self, faults=(f"least {objective.words}: {best.status}",))
        bound = objective.bound(data, best, cap)
        further = unproven_sentences(objective.words, best.value, bound)
        if further and objective.dispensable:
            return self.late(objective.late)
        return replace(
            self,
            loads=best.loads,
            objective=objective,
            best=best,
            cap=cap,
            most=np.inf,
            faults=self.faults + further,
        )

    def load_factor(
        self, prepared: PreparedStance, budget: Budget
    ) -> tuple[LoadFactor, FixedSolution]:
        """Return the largest multiple of the body wrench at utilisation 1, and this solution."""
        factor = most_of_fixed(prepared.hands, self.sets.data)
        return LoadFactor(factor, unfinished=factor is None and deadline.expired()), self

    def no_answer(self, prepared: PreparedStance) -> str:
        """Return a sentence with the solver's status."""
        return f"the solver gave no usable answer ({self.least.status})"


def fixed_solutions(
    prepared: PreparedStance, near: Solution | None = None, *, twice: bool = True
) -> Iterator[FixedSolution]:
    """Yield candidates for the plan of least utilisation, from one method after the other.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    near : Solution, optional
        Solution for the same hands at another body wrench, as a warm start.
    twice : bool, optional
        As of `least_utilisation`.
    """
    sets, cap = prepared.at_rest, prepared.question.limits.utilisation
    before = near.start if isinstance(near, FixedSolution) else None
    closing = prepared.batch.closing_tensions
    found = least_utilisation(sets.data, cap, closing, before, twice=twice)
    late: tuple[Unfinished, ...] = ()
    if found.proven:
        loads = () if found.meant is None else found.meant.loads
        first = FixedSolution.of_least(prepared, sets, found.outcome, loads, found.bound, found)
        for solution in [first] if loads else _less_tense(prepared, first):
            late = solution.unfinished
            yield solution
    solved = True
    for solution in _solutions_in_two(prepared, sets):
        solved = bool(solution.loads)
        if solved or not (found.outcome.solved and deadline.expired()):
            yield replace(solution, unfinished=late + solution.unfinished)
    if found.outcome.solved and not solved and deadline.expired():
        loads = found.outcome.loads
        last = FixedSolution.of_least(prepared, sets, found.outcome, loads)
        last = replace(last, most=np.inf, faults=(), unfinished=late, start=found)
        yield last.late("least_utilisation")


def _solutions_in_two(prepared: PreparedStance, sets: Sets) -> Iterator[FixedSolution]:
    """Yield the plan that is meant from the very least utilisation, by a solver for each.

    Where hands are asked for thousands of times what they can do, a small error of the largest load
    may be more than the others' checks let pass: then the plan is a vertex. Without any, what comes
    has no loads.
    """
    least = FixedSolution.of_least(prepared, sets, programs.margin(sets.data))
    if not least.least.solved:
        yield least
        return
    yield from _less_tense(prepared, least)
    if not deadline.expired():
        yield from _at_vertex(prepared, sets)


def _at_vertex(prepared: PreparedStance, sets: Sets) -> Iterator[FixedSolution]:
    """Yield a plan of least utilisation where as many rows meet as there are loads, if any."""
    outcome = programs.vertex(sets.data)
    if outcome.solved:
        yield FixedSolution.of_least(prepared, sets, outcome, outcome.loads)


def _less_tense(prepared: PreparedStance, least: FixedSolution) -> Iterator[FixedSolution]:
    """Yield the plan of less tension for a little utilisation, or else for none; then the least.

    ``least``: without loads, but for its outcome.
    """
    data, outcome = least.sets.data, least.least
    trade = tension_trade(outcome.value, least.cap)
    tidy, spare = less_tense(data, outcome, trade, prepared.batch.closing_tensions)
    if not (tidy.solved or deadline.expired()):
        tidy = programs.least_tensions(data, outcome.value)
    if tidy.solved:
        yield replace(least, loads=tidy.loads, spare=spare)
    else:
        least = least.late(*late("tie_break"))
    yield replace(least, loads=outcome.loads, spare=())


def nearest_solutions(
    prepared: PreparedStance, found: Solution, nearest: Outcome
) -> Iterator[FixedSolution]:
    """Yield candidate plans for the feasible body wrench nearest to the one of the question.

    It serves body wrenches that are infeasible only by rounding.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    found : Solution
        Solution for the body wrench of the question.
    nearest : Outcome
        Outcome of `programs.nearest`, whose loads give the nearest wrench.
    """
    data = found.sets.data
    sets = found.sets._replace(data=data.turned(programs.body_wrench(data, nearest.loads)))
    for solution in _solutions_in_two(prepared, sets):
        yield solution.late(*found.unfinished)
        if not solution.loads and not deadline.expired():
            for vertex in _at_vertex(prepared, sets):
                yield vertex.late(*found.unfinished)


def most_of_fixed(hands: HandSets, data: StanceData) -> float | None:
    """Return the load factor of hands with fixed wrists; None without one that passes its checks.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    data : StanceData
        Rows of the hands' wrench spaces, and the body wrench.
    """
    result = programs.load_factor(data)
    if not result.solved:
        return None
    held = programs.loads_are_feasible(data.turned(hands.goal(result.value)), result.loads, 1.0)
    return max(result.value, 0.0) if held else None
