"""Objectives of a plan, each with its program, bound, check, prices and words.

Every question is first answered with the plan of least utilisation, which says whether the limits
can be kept. A `CappedObjective` then takes the best plan of its own within them. To add one is to
write such a class, and to enter it in `NAMED_OBJECTIVES`; or a question has the object itself.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from hand_models.base import Array, InvalidInputError, UnsupportedError
from planner import programs
from planner.deadline import Unfinished
from planner.explanation import ActiveLimits
from planner.floating import Goal, LeastEffort
from planner.programs import Outcome, StanceData
from planner.question import Question
from planner.result import PlanArrays
from planner.solving.dual_bounds import convex_bound

__all__ = [
    "MAX_MARGIN",
    "NAMED_OBJECTIVES",
    "CappedObjective",
    "MaxMargin",
    "MinEffort",
    "Objective",
    "objective_of",
]


class Objective(ABC):
    """Objective of a plan.

    Attributes
    ----------
    name : str
        Name in a question.
    words : str
        What is least, for sentences.
    """

    name: ClassVar[str]
    words: ClassVar[str]

    def reported(self, binding: ActiveLimits, cap: float) -> Mapping[str, Any]:
        """Return what a plan says of it besides, by fields of `Plan`; nothing by default.

        Parameters
        ----------
        binding : ActiveLimits
            By the multipliers of its program.
        cap : float
            On the utilisation.
        """
        return {}


class MaxMargin(Objective):
    """Least utilisation, but for what less tension is worth (`planner.programs.TensionTrade`)."""

    name = "max_margin"
    words = "utilisation"


class CappedObjective(Objective):
    """Objective that is least at a utilisation within a cap: a convex function of the loads.

    Attributes
    ----------
    late : str
        What a deadline leaves unfinished that comes before its plan.
    """

    late: ClassVar[Unfinished] = "least_effort"

    @abstractmethod
    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return its plan of hands with fixed wrists, with the multipliers that prove it."""

    @abstractmethod
    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return what its program makes least, of loads y of each hand."""

    @abstractmethod
    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return the gradient of `value` in the scaled loads z of all hands, shape (M,)."""

    def bound(self, data: StanceData, outcome: Outcome, cap: float) -> float:
        """Return what no plan is below, as the multipliers prove it; −∞ where they do not."""
        value, slopes = self.value(data, outcome.loads), self.slopes(data, outcome.loads)
        return convex_bound(data, outcome, value, slopes, cap)

    def goal(self, cap: float, farthest: Sequence[Array]) -> Goal:
        """Return the goal of a search for floating wrists, so far from rest at most [m, rad].

        Raises
        ------
        UnsupportedError
            If there is no such search, as by default.
        """
        raise UnsupportedError(
            f"{self.name} requires fixed wrists; with floating wrists only max_margin is valid",
            field="objective",
        )

    def problems(self, arrays: PlanArrays, value: float) -> list[str]:
        """Return what is wrong with its value by the plan's own numbers; nothing by default."""
        return []


class MinEffort(CappedObjective):
    """Least sum of squared relative tensions and joint torques (`planner.programs.Effort`)."""

    name = "min_effort"
    words = "effort"

    def solve(self, data: StanceData, cap: float) -> Outcome:
        return programs.effort(data, cap)

    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        z = [y / hand.unit for hand, y in zip(data.hands, loads, strict=True)]
        small = sum(float(hand.rest @ x**2) for hand, x in zip(data.hands, z, strict=True))
        return programs.used_effort(data, loads) + small

    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        found = []
        for hand, y in zip(data.hands, loads, strict=True):
            z = y / hand.unit
            found.append(2.0 * (hand.E.T @ (hand.E @ z + hand.e0) + hand.rest * z))
        return np.concatenate(found)

    def goal(self, cap: float, farthest: Sequence[Array]) -> Goal:
        return LeastEffort(cap, farthest)

    def reported(self, binding: ActiveLimits, cap: float) -> Mapping[str, Any]:
        return {"effort_prices": binding.prices(cap)}


MAX_MARGIN: Final = MaxMargin()

NAMED_OBJECTIVES: Final[Mapping[str, Objective]] = {
    objective.name: objective for objective in (MAX_MARGIN, MinEffort())
}
"""Those that a question may name."""


def objective_of(question: Question) -> Objective:
    """Return what a question wants the best plan in.

    Raises
    ------
    InvalidInputError
        If it has neither a name nor an objective.
    """
    asked = question.objective
    found = NAMED_OBJECTIVES[asked] if isinstance(asked, str) else asked
    if not isinstance(found, Objective):
        raise InvalidInputError(
            f"an Objective or a name is needed, got a {type(found).__name__}; valid names are "
            f"{', '.join(NAMED_OBJECTIVES)}",
            field="objective",
        )
    return found
