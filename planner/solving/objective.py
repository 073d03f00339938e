"""Base classes of a plan's objective: program, lower bound, check and names in sentences.

Every question is first answered with the plan of least utilisation, which shows whether all limits
can be kept. A `CappedObjective` then minimises its own function within the cap on the utilisation.
To add an objective, write such a class and enter it in `NAMED_OBJECTIVES`; or pass an instance in
the question.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from hand_models.base import Array, UnsupportedError
from planner import programs
from planner.deadline import Unfinished
from planner.explanation import ActiveLimits
from planner.floating import Goal, LeastEffort
from planner.prepare import PreparedStance, Sets
from planner.programs import Outcome, StanceData, convex_bound
from planner.question import MOVING_WRIST_OBJECTIVES
from planner.result import PlanArrays

__all__ = ["MAX_MARGIN", "CappedObjective", "MaxMargin", "MinEffort", "Objective"]


class Objective(ABC):
    """Objective of a plan.

    Attributes
    ----------
    name : str
        Name of the objective in a question.
    words : str
        Name of the minimised quantity, for sentences.
    """

    name: ClassVar[str]
    words: ClassVar[str]

    def reported(self, binding: ActiveLimits, cap: float) -> Mapping[str, Any]:
        """Return fields of `Plan` that this objective adds to a plan; none by default.

        Parameters
        ----------
        binding : ActiveLimits
            Limits that bind in the objective's program, by its multipliers.
        cap : float
            Cap on the utilisation.
        """
        return {}

    def within(
        self, prepared: PreparedStance, sets: Sets, loads: Sequence[Array]
    ) -> CappedObjective | None:
        """Return the objective that improves a plan of least utilisation; None if that is meant.

        Parameters
        ----------
        prepared : PreparedStance
        sets : Sets
            Wrench spaces and rows of the hands.
        loads : sequence of ndarray, shape (m,)
            Loads y of each hand in that plan [N].
        """
        return None


class MaxMargin(Objective):
    """Least utilisation, except for a little that is traded for less tension.

    The trade is `planner.programs.TensionTrade`.
    """

    name = "max_margin"
    words = "utilisation"


class CappedObjective(Objective):
    """Objective that minimises a convex function of the loads under a cap on the utilisation.

    Attributes
    ----------
    late : str
        Name of the unfinished step in a plan if the deadline passes before this program is solved.
    """

    late: ClassVar[Unfinished] = "least_effort"
    dispensable: ClassVar[bool] = False
    """True if the plan of least utilisation, with ``late`` among what is unfinished, is the answer
    where multipliers do not prove the objective's plan; else there is none."""

    def within(
        self, prepared: PreparedStance, sets: Sets, loads: Sequence[Array]
    ) -> CappedObjective | None:
        """Return the objective itself: it is the same in every stance."""
        return self

    def cap(self, least: float, cap: float) -> float:
        """Return the cap on the utilisation of the objective's plan; the question's by default.

        Parameters
        ----------
        least : float
            Least utilisation of the question.
        cap : float
            The question's cap, at least ``least``.
        """
        return cap

    @abstractmethod
    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Solve the objective's program for hands with fixed wrists.

        Parameters
        ----------
        data : StanceData
            Rows of all hands and the wrench that they must balance.
        cap : float
            Cap on the utilisation.

        Returns
        -------
        Outcome
            Loads, with the multipliers that prove them optimal.
        """

    @abstractmethod
    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return the value of the function that `solve` minimises.

        Parameters
        ----------
        data : StanceData
        loads : sequence of ndarray, shape (m,)
            Loads y of each hand [N]; of a floating hand instead the twist of its wrist [m, rad].
        """

    @abstractmethod
    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return the gradient of `value` in the scaled loads z = y / unit of all hands, shape (M,).

        Parameters
        ----------
        data : StanceData
        loads : sequence of ndarray, shape (m,)
            Loads y of each hand [N]; of a floating hand instead the twist of its wrist [m, rad].
        """

    def bound(self, data: StanceData, outcome: Outcome, cap: float) -> float:
        """Return a lower bound of the value of every plan, proven by multipliers; −∞ without proof.

        Parameters
        ----------
        data : StanceData
        outcome : Outcome
            Outcome of `solve`, with its multipliers.
        cap : float
            Cap on the utilisation.
        """
        value, slopes = self.value(data, outcome.loads), self.slopes(data, outcome.loads)
        return convex_bound(data, outcome, value, slopes, cap)

    def goal(self, cap: float, farthest: Sequence[Array]) -> Goal:
        """Return the goal of the search for the wrists' poses of compliant and floating hands.

        Parameters
        ----------
        cap : float
            Cap on the utilisation.
        farthest : sequence of ndarray, shape (6,)
            Largest displacement of each hand's wrist from rest, by component [m, rad].

        Raises
        ------
        UnsupportedError
            If the objective requires fixed wrists, as by default.
        """
        raise UnsupportedError(
            f"{self.name} requires fixed wrists on all hands; with a compliant or floating wrist, "
            f"valid are {', '.join(MOVING_WRIST_OBJECTIVES)}",
            field="objective",
        )

    def problems(self, arrays: PlanArrays, value: float) -> list[str]:
        """Return errors in the objective's value that a plan's numbers show; none by default.

        Parameters
        ----------
        arrays : PlanArrays
            The plan's numbers.
        value : float
            Value of the objective for these loads.

        Returns
        -------
        list of str
            One sentence for each error.
        """
        return []

    def measured(self, arrays: PlanArrays) -> Mapping[str, Any]:
        """Return fields of `Plan` that follow from a plan's numbers; none by default.

        Parameters
        ----------
        arrays : PlanArrays
            The plan's numbers.
        """
        return {}


class MinEffort(CappedObjective):
    """Least sum of squared relative tensions and joint torques (`planner.programs.effort`)."""

    name = "min_effort"
    words = "effort"

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Minimise the effort of hands with fixed wrists under a cap on the utilisation."""
        return programs.effort(data, cap)

    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return the effort, plus a small term in the squares of loads that are no tensions."""
        z = [y / hand.unit for hand, y in zip(data.hands, loads, strict=True)]
        small = sum(float(hand.rest @ x**2) for hand, x in zip(data.hands, z, strict=True))
        return programs.used_effort(data, loads) + small

    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return the gradient of `value` in the scaled loads of all hands, shape (M,)."""
        found = []
        for hand, y in zip(data.hands, loads, strict=True):
            z = y / hand.unit
            found.append(2.0 * (hand.E.T @ (hand.E @ z + hand.e0) + hand.rest * z))
        return np.concatenate(found)

    def goal(self, cap: float, farthest: Sequence[Array]) -> Goal:
        """Return the goal of the search for the wrists' poses of least effort."""
        return LeastEffort(cap, farthest)

    def reported(self, binding: ActiveLimits, cap: float) -> Mapping[str, Any]:
        """Return the shadow prices of the binding limits in terms of the effort."""
        return {"effort_prices": binding.prices(cap)}


MAX_MARGIN: Final = MaxMargin()
