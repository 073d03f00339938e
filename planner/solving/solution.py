"""Solution of a stance: loads of all hands, and what their multipliers prove."""

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
    """Loads of all hands, and how good they are proven to be.

    Attributes
    ----------
    sets : Sets
        Of the hands, about the loads.
    loads : tuple of ndarray
        y of each hand; empty without any.
    least : Outcome
        Of the program of least utilisation.
    objective : Objective
        What the loads are the best in.
    best : Outcome
        Of the objective's program.
    cap : float
        On the utilisation.
    most : float
        Largest utilisation that the loads are to have.
    faults : tuple of str
        Why the multipliers do not prove them the best, if they do not.
    unfinished : tuple of str
        What the deadline came before.
    poses : tuple of WristPlan or None
        Where each hand's wrist goes; None for a fixed one.
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
        """False if its search, if there is any, ended without proof."""
        return True

    def late(self, *names: Unfinished) -> Self:
        """Return the same with something more that is not finished."""
        return replace(self, unfinished=self.unfinished + names)

    @abstractmethod
    def best_in(
        self, objective: CappedObjective, prepared: PreparedStance, budget: Budget
    ) -> Solution:
        """Return the best loads for an objective within the cap; the same where there are none."""

    @abstractmethod
    def load_factor(self, prepared: PreparedStance, budget: Budget) -> LoadFactor:
        """Return how many times the body wrench could be held."""

    @abstractmethod
    def no_answer(self, prepared: PreparedStance) -> str:
        """Say why there are neither loads nor a proof of none."""


@dataclass(frozen=True, eq=False)
class Failed:
    """A solution without loads, or whose loads do not pass the checks.

    Attributes
    ----------
    solution : Solution
    reason : str
        Why it is no plan.
    """

    solution: Solution
    reason: str
    utilisation: ClassVar[float] = math.inf
    whole: ClassVar[float] = math.inf


@dataclass(frozen=True, eq=False)
class Infeasible:
    """A proof that there are no loads that balance the body.

    Attributes
    ----------
    solution : Solution
        That failed.
    proof : Certificate
    """

    solution: Solution
    proof: Certificate
    utilisation: ClassVar[float] = math.inf
    whole: ClassVar[float] = math.inf


ByHand = Callable[[], tuple[HandPlan, ...]]
"""Returns a plan's numbers hand by hand."""


@dataclass(frozen=True, eq=False)
class Verified:
    """Loads that pass the checks, and what they do.

    Attributes
    ----------
    solution : Solution
    arrays : PlanArrays
        The plan's numbers.
    used : ndarray, shape (sum of nl,)
        Utilisation of every limit row, hand by hand.
    effort : float
    utilisation : float
        The largest of the hands.
    whole : float
        The largest of these, and of the joints of limbs without a hand.
    by_hand : callable
        Returns the plan's numbers hand by hand.
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
) -> LoadFactor:
    """Return how many times the body wrench could be held at utilisation 1, if it can be known.

    ``overloaded``: whether a limb without a hand cannot bear itself.
    """
    if overloaded:
        return LoadFactor()
    if not prepared.needs_hands:
        # any multiple of it can be held, or none
        least = answer.solution.least
        held = least.solved and least.value <= 1.0 + CAP_SLACK
        return LoadFactor(unbounded=held and not isinstance(answer, Infeasible))
    if deadline.expired():
        return LoadFactor(unfinished=True)
    return answer.solution.load_factor(prepared, budget)
