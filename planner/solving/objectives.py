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
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, UnsupportedError
from hand_models.tile import TileStrengths
from planner import programs
from planner.deadline import Unfinished
from planner.explanation import ActiveLimits
from planner.floating import Goal, LeastEffort
from planner.prepare import PreparedStance, Sets
from planner.programs import Outcome, StanceData, TilePowers
from planner.question import Question
from planner.result import PlanArrays, Reliability
from planner.solving.dual_bounds import convex_bound, hazard_bound, is_least

__all__ = [
    "MAX_MARGIN",
    "NAMED_OBJECTIVES",
    "CappedObjective",
    "LeastHazard",
    "MaxMargin",
    "MaxReliability",
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
            f"valid are {MaxMargin.name}, {MinEffort.name}",
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


class MaxReliability(Objective):
    """Least hazard among plans whose utilisation is close to the least (`LeastHazard`)."""

    name = "max_reliability"
    words = "hazard"

    def within(
        self, prepared: PreparedStance, sets: Sets, loads: Sequence[Array]
    ) -> CappedObjective | None:
        """Return the objective for the tiles of one stance; None if no tile is loaded."""
        batch = prepared.batch
        surfaces = [hand.surface for hand in prepared.question.stance.hands]
        rows, tile_of, places = list[int](), list[int](), dict[int, int]()
        at = 0
        for hand, space, start in zip(batch.hands, sets.spaces, batch.places.first, strict=True):
            names: dict[tuple[str | None, str | None], int] = {
                tile[:2]: start + i for i, tile in enumerate(hand.tiles) if hand.touching[i]
            }
            for i, row in enumerate(space.rows[: len(space.s)]):
                place = names.get((row.finger, row.phalanx))
                if place is not None and row.limit in ("shear", "pull_off"):
                    rows.append(at + i)
                    tile_of.append(places.setdefault(place, len(places)))
            at += len(space.s)
        each, of_rows, of_tiles = (np.array([*x], dtype=np.intp) for x in (places, rows, tile_of))
        strengths = TileStrengths.of(surfaces, batch.places.hand[each])
        own = strengths.modulus[strengths.hand]
        # of a tile alone, at its whole strength
        weights = [math.exp(strengths.log_hazards(x).max()) for x in np.eye(len(each))]
        tiles = TilePowers(of_rows, of_tiles, np.array(weights), own)
        used = programs.used(sets.data, loads)
        hazard = float(tiles.terms(tiles.uses(used)).sum())
        if hazard <= 0.0:
            return None
        tiles = tiles._replace(weights=tiles.weights / hazard)
        before, tolerance = max(float(used.max()), 0.0), prepared.question.utilisation_tolerance
        return LeastHazard(tiles, each, strengths, tolerance, hazard, before)


@dataclass(frozen=True, eq=False)
class LeastHazard(CappedObjective):
    """Least hazard of the tiles of one stance, at nearly the least utilisation.

    Its value is the hazard (`hand_models.tile.TileStrengths`) over that of the plan of least
    utilisation, plus a term in the squares of loads that makes the plan unique
    (`planner.programs.Hazard`).

    Attributes
    ----------
    tiles : TilePowers
        Tiles on rock, with weights relative to ``before``.
    places : ndarray of int
        Index of each of them among the tiles of all hands.
    strengths : TileStrengths
        Distribution of their strengths.
    tolerance : float
        Part of the least utilisation by which the plan may exceed it.
    before, utilisation_before : float
        Hazard and utilisation of the plan of least utilisation.
    """

    tiles: TilePowers
    places: Indices
    strengths: TileStrengths
    tolerance: float
    before: float
    utilisation_before: float

    name = MaxReliability.name
    words = MaxReliability.words
    late = "least_hazard"

    def cap(self, least: float, cap: float) -> float:
        """Return the least utilisation with the tolerance, as far as the question's cap allows."""
        return min(cap, least + self.tolerance * abs(least))

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Minimise the hazard; where that is not proven least, with the solver's own scaling."""
        program = programs.Hazard(data, cap, self.tiles)
        outcome = program.solve()
        if outcome.solved and not is_least(outcome.value, self.bound(data, outcome, cap)):
            outcome = program.equilibrated().solve()
        return outcome

    def value(self, data: StanceData, loads: Sequence[Array]) -> float:
        """Return the relative hazard of loads, with the small term in their squares."""
        return programs.Hazard(data, 1.0, self.tiles).value(loads)

    def slopes(self, data: StanceData, loads: Sequence[Array]) -> Array:
        """Return a subgradient of `value` in the scaled loads, shape (M,)."""
        return programs.Hazard(data, 1.0, self.tiles).slopes(loads)

    def bound(self, data: StanceData, outcome: Outcome, cap: float) -> float:
        """Return a lower bound of every plan's value; `hazard_bound` has its proof."""
        return hazard_bound(data, outcome, self.tiles, cap)

    def problems(self, arrays: PlanArrays, value: float) -> list[str]:
        """Return an error if the tiles' utilisations in a plan have another hazard."""
        relative = self._hazard(arrays) / self.before
        # the small term is beside the hazard
        if abs(relative - value) <= 1e-4 * max(1.0, value):
            return []
        return [f"plan: relative hazard is {relative:.8g}, not {value:.8g}"]

    def measured(self, arrays: PlanArrays) -> Mapping[str, Any]:
        """Return the plan's hazard and its probability that no tile slips."""
        found = self._hazard(arrays)
        before, moduli = (self.utilisation_before, self.before), self.strengths.modulus.tolist()
        return {"reliability": Reliability(found, math.exp(-found), *before, moduli)}

    def _hazard(self, arrays: PlanArrays) -> float:
        used = arrays.tile_utilisations[self.places]
        return float(np.exp(self.strengths.log_hazards(used)).sum())


MAX_MARGIN: Final = MaxMargin()

NAMED_OBJECTIVES: Final[Mapping[str, Objective]] = {
    objective.name: objective for objective in (MAX_MARGIN, MinEffort(), MaxReliability())
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
