"""Solutions of a stance: loads of all hands and the multipliers that prove them optimal."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from hand_models.base import Array
from planner import deadline
from planner.deadline import Budget, Unfinished
from planner.prepare import PreparedStance, Sets
from planner.programs import CAP_SLACK, Outcome
from planner.result import Certificate, HandPlan, LoadFactor, PlanArrays, WristPlan
from planner.solving.objectives import CappedObjective, Objective

__all__ = [
    "Answer",
    "ByHand",
    "Failed",
    "Infeasible",
    "Solution",
    "Verified",
    "load_factor_of",
]


@dataclass(frozen=True, eq=False, kw_only=True)
class Solution:
    """Loads of all hands, and the proof of how good they are.

    Attributes
    ----------
    sets : Sets
        Wrench spaces of the hands and rows of the programs, linearised about the loads.
    loads : tuple of ndarray, shape (m,)
        Loads y of each hand [N]; of a floating wrist its twist [m, rad], of a compliant one
        tensions and twist. Empty without a solution.
    least : Outcome
        Outcome of the program of least utilisation.
    objective : Objective
        Objective that the loads minimise.
    best : Outcome
        Outcome of the objective's program.
    cap : float
        Cap on the utilisation.
    most : float
        Largest utilisation that the loads may have to pass the checks.
    faults : tuple of str
        Sentences that say why the multipliers do not prove the loads optimal; empty if they do.
    unfinished : tuple of str
        Names of the steps that the deadline cut off.
    poses : tuple of WristPlan or None
        Displacement of each hand's wrist; None for a fixed wrist.
    """

    sets: Sets
    loads: tuple[Array, ...]
    least: Outcome
    objective: Objective
    best: Outcome
    cap: float
    most: float = math.inf
    faults: tuple[str, ...] = ()
    unfinished: tuple[Unfinished, ...] = ()
    poses: tuple[WristPlan | None, ...] = ()

    @property
    def proven(self) -> bool:
        """False if a search for wrist poses ended without proof of the least utilisation."""
        return True

    def late(self, *names: Unfinished) -> Self:
        """Return a copy of the solution with more steps marked as unfinished."""
        return replace(self, unfinished=self.unfinished + names)

    @abstractmethod
    def best_in(
        self, objective: CappedObjective, prepared: PreparedStance, budget: Budget
    ) -> Solution:
        """Return the best solution for an objective within the cap on the utilisation.

        Without loads, or if they are beyond the cap, the solution itself is returned.

        Parameters
        ----------
        objective : CappedObjective
            Objective to be minimised.
        prepared : PreparedStance
            The question's stance, with hands on their holds and their sets.
        budget : Budget
            Number of programs that a search for wrist poses may still solve.
        """

    @abstractmethod
    def load_factor(self, prepared: PreparedStance, budget: Budget) -> tuple[LoadFactor, Solution]:
        """Return the load factor: the largest multiple of the body wrench at utilisation 1.

        Returned with it: this solution, or a better one that the search found, not verified.

        Parameters
        ----------
        prepared : PreparedStance
            The question's stance, with hands on their holds and their sets.
        budget : Budget
            Number of programs that a search for wrist poses may still solve.
        """

    @abstractmethod
    def no_answer(self, prepared: PreparedStance) -> str:
        """Return a sentence that says why neither loads nor a proof of infeasibility was found."""


@dataclass(frozen=True, eq=False)
class Failed:
    """A solution without loads, or with loads that do not pass the checks.

    Attributes
    ----------
    solution : Solution
        The solution that is no plan.
    reason : str
        Sentence that says why the solution is no plan.
    utilisation, whole : float
        Infinite, as for every answer without a plan.
    """

    solution: Solution
    reason: str
    utilisation: ClassVar[float] = math.inf
    whole: ClassVar[float] = math.inf


@dataclass(frozen=True, eq=False)
class Infeasible:
    """A proof that no loads balance the body (infeasibility certificate).

    Attributes
    ----------
    solution : Solution
        The solution without a balance.
    proof : Certificate
        Certificate that proves it.
    utilisation, whole : float
        Infinite, as for every answer without a plan.
    """

    solution: Solution
    proof: Certificate
    utilisation: ClassVar[float] = math.inf
    whole: ClassVar[float] = math.inf


ByHand = Callable[[], tuple[HandPlan, ...]]
"""Returns a plan's numbers hand by hand."""


@dataclass(frozen=True, eq=False)
class Verified:
    """Loads that pass the checks, with the numbers of the plan.

    Attributes
    ----------
    solution : Solution
        Solution that was checked.
    arrays : PlanArrays
        The plan's numbers, in arrays over all hands.
    used : ndarray, shape (sum of nl,)
        Utilisation of every limit, for one hand after the other; a hand has nl limits.
    effort : float
        Sum of squared relative tensions and joint torques.
    utilisation : float
        Largest utilisation of the hands' limits.
    whole : float
        Largest utilisation, including the joints of limbs without a hand.
    by_hand : callable
        Returns the plan's numbers as a `HandPlan` for each hand.
    """

    solution: Solution
    arrays: PlanArrays
    used: Array
    effort: float
    utilisation: float
    whole: float
    by_hand: ByHand


Answer = Verified | Failed | Infeasible
"""Outcome of a question."""


def load_factor_of(
    prepared: PreparedStance, answer: Answer, budget: Budget, *, overloaded: bool
) -> tuple[LoadFactor, Solution]:
    """Return the load factor: the largest multiple of the body wrench at utilisation 1.

    Returned with it: the answer's solution, or a better one that the search found, not verified. If
    the body wrench is zero and the stance feasible at utilisation 1, the factor is unbounded.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    answer : Answer
        Verified loads, a proof of infeasibility, or a failure.
    budget : Budget
        Number of programs that a search for wrist poses may still solve.
    overloaded : bool
        True if a limb without a hand cannot carry its own weight; there is no factor then.
    """
    solution = answer.solution
    if overloaded:
        return LoadFactor(), solution
    if not prepared.needs_hands:
        # any multiple of it can be held, or none
        held = solution.least.solved and solution.least.value <= 1.0 + CAP_SLACK
        return LoadFactor(unbounded=held and not isinstance(answer, Infeasible)), solution
    if deadline.expired():
        return LoadFactor(unfinished=True), solution
    return solution.load_factor(prepared, budget)
