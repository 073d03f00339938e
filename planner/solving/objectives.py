"""Objectives of a plan, each with its program, lower bound, check and names in sentences.

Every question is first answered with the plan of least utilisation, which shows whether all limits
can be kept. A `CappedObjective` then minimises its own function within the cap on the utilisation.
To add an objective, write such a class and enter it in `NAMED_OBJECTIVES`; or pass an instance in
the question.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final

import numpy as np

from hand_models.base import Array, InvalidInputError, UnsupportedError
from planner import deadline, programs
from planner.deadline import Unfinished
from planner.execution import without_margins
from planner.explanation import ActiveLimits
from planner.floating import Goal, LeastEffort
from planner.prepare import HandSets, PreparedStance, settled_as_drawn, with_drawn_hands
from planner.programs import (
    CAP_SLACK,
    Outcome,
    Robust,
    SampleData,
    StanceData,
    feedback_price,
    parted,
    tie_weight,
)
from planner.question import Question, drawn_hands
from planner.result import PlanArrays
from planner.solving.dual_bounds import convex_bound

__all__ = [
    "MAX_MARGIN",
    "MAX_ROBUST",
    "NAMED_OBJECTIVES",
    "CappedObjective",
    "MaxMargin",
    "MaxRobust",
    "MinEffort",
    "Objective",
    "objective_of",
]


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

    def on(self, prepared: PreparedStance) -> CappedObjective:
        """Return the objective with what it needs of a stance beside its rows; by default itself.

        Parameters
        ----------
        prepared : PreparedStance
        """
        return self

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
        valid = [
            name
            for name, each in NAMED_OBJECTIVES.items()
            if not isinstance(each, CappedObjective) or type(each).goal is not CappedObjective.goal
        ]
        raise UnsupportedError(
            f"{self.name} requires fixed wrists on all hands; with a compliant or floating wrist, "
            f"valid are {', '.join(valid)}",
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


@dataclass(frozen=True, eq=False)
class MaxRobust(CappedObjective):
    """Least mean utilisation over samples of the parameters, with tensions that serve all of them.

    The function of the loads is the mean of `programs.sample_value` over the samples, plus a small
    term that makes the plan unique; the program is `planner.programs.Robust`.

    Attributes
    ----------
    own : SampleData or None
        The question's own hands; None before `on`.
    samples : tuple of SampleData
        Those samples in which the body can be balanced.
    """

    name = "max_robust"
    words = "mean utilisation over samples"
    late = "robust_tensions"
    dispensable = True
    own: SampleData | None = None
    samples: tuple[SampleData, ...] = ()

    def on(self, prepared: PreparedStance) -> MaxRobust:
        """Return the objective with the hands of all samples, closed on the holds of a stance.

        Parameters
        ----------
        prepared : PreparedStance

        Raises
        ------
        UnsupportedError
            If no sample has a balance.
        """
        question, bare, samples = prepared.question, without_margins(prepared), []
        for drawn in drawn_hands(question.stance.robot.hand, question.draws):
            there = with_drawn_hands(bare, settled_as_drawn(bare, drawn))
            if deadline.expired():
                # the program will not be solved either
                return self
            if there is not None:
                sample = _sample_of(there.hands)
                value, _ = programs.sample_value(
                    sample, np.zeros(len(sample.tensions)), feedback_price()
                )
                samples += [sample] if np.isfinite(value) else []
        if not samples:
            raise UnsupportedError(
                f"{self.name} requires samples in which the hands balance the body, and there is "
                f"none; valid is {MAX_MARGIN.name}",
                field="objective",
            )
        return MaxRobust(_sample_of(prepared.hands), tuple(samples))

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Solve `planner.programs.Robust`; reactions are those of least utilisation."""
        if self.own is None:
            return Outcome(False, programs.OUT_OF_TIME, 0, math.nan)
        own = self.own._replace(data=data)
        outcome = Robust(own, self.samples, feedback_price(), cap).solve()
        if not outcome.solved:
            return outcome
        held = np.full(len(data.rows.unit), np.nan)
        held[own.tensions] = np.concatenate(outcome.loads)[own.tensions]
        again = programs.kept(data, parted(held, [len(hand.unit) for hand in data.hands]))
        better = again.solved and again.value <= cap + CAP_SLACK
        return replace(outcome, loads=again.loads) if better else outcome

    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return the mean over the samples, plus the small term."""
        return self._measure(data, loads)[0]

    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return the gradient of `value` in the scaled loads of all hands, shape (M,)."""
        return self._measure(data, loads)[1]

    def bound(self, data: StanceData, outcome: Outcome, cap: float) -> float:
        """Return a lower bound of the value of every plan, proven by multipliers."""
        return convex_bound(data, outcome, *self._measure(data, outcome.loads), cap)

    def _measure(self, data: StanceData, loads: Sequence[Array]) -> tuple[float, Array]:
        """Return `value` and `slopes`."""
        assert self.own is not None
        z, places = np.concatenate(loads) / data.rows.unit, self.own.tensions
        small = tie_weight(len(data.hands)) * data.rows.tie * z
        found = [programs.sample_value(each, z[places], feedback_price()) for each in self.samples]
        values, gradients = zip(*found, strict=True)
        slopes = 2.0 * small
        slopes[places] += np.mean(gradients, axis=0)
        return float(np.mean(values) + small @ z), slopes


def _sample_of(hands: HandSets) -> SampleData:
    """Return the rows of hands with fixed wrists, and the places of their tensions."""
    columns = [name for space in hands.spaces for name in space.columns]
    places = np.flatnonzero([name.endswith("/tension") for name in columns])
    return SampleData(hands.data, places)


MAX_MARGIN: Final = MaxMargin()

MAX_ROBUST: Final = MaxRobust()

NAMED_OBJECTIVES: Final[Mapping[str, Objective]] = {
    objective.name: objective for objective in (MAX_MARGIN, MinEffort(), MAX_ROBUST)
}
"""Those that a question may name."""


def objective_of(question: Question) -> Objective:
    """Return the objective that a question asks for.

    Raises
    ------
    InvalidInputError
        If the question's objective is neither a valid name nor an `Objective`.
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
