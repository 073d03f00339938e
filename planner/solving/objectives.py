"""Objectives that a question may name, among them that of the least hazard."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError
from hand_models.tile import TileStrengths
from planner import programs
from planner.prepare import PreparedStance, Sets
from planner.programs import Outcome, StanceData, TilePowers, hazard_bound, is_least
from planner.question import Question
from planner.result import PlanArrays, Reliability
from planner.solving.objective import MAX_MARGIN, CappedObjective, MinEffort, Objective
from planner.solving.robust_tensions import MaxRobust

__all__ = ["MAX_ROBUST", "NAMED_OBJECTIVES", "LeastHazard", "MaxReliability", "objective_of"]


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
                hand.tiles[i][:2]: start + i for i in np.flatnonzero(hand.touching).tolist()
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


MAX_ROBUST: Final = MaxRobust()

NAMED_OBJECTIVES: Final[Mapping[str, Objective]] = {
    objective.name: objective
    for objective in (MAX_MARGIN, MinEffort(), MaxReliability(), MAX_ROBUST)
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
