"""Goals that a search for the wrists of floating hands minimises.

The search itself (`planner.floating.wrist_iteration`) knows sets, ranges and steps. A goal says
which program is solved on the sets, whose multipliers prove the outcome; with which one it steps,
at first and near the end; and which value the model gives a point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy

from hand_models.base import Array
from planner import programs
from planner.prepare import ExactMeasure, HandSets, LinearisationPoint, Sets
from planner.programs import CAP_SLACK, Outcome, StanceData

__all__ = ["LEAST_USE", "SETTINGS", "FloatingSettings", "Goal", "LeastUse", "bent_root"]


@dataclass(frozen=True, slots=True)
class FloatingSettings:
    """Sizes and tolerances of searches for wrists that give way."""

    programs: int = 320
    """For a question, at most, so that four floating hands take some ten seconds. Then the best
    found so far is the answer."""
    first_programs: int = 70  # for a search for a first plan, at most
    effort_programs: int = 110  # for the search for least effort, at most
    rounds: int = 40  # for one choice of palm modes, at most
    rounds_nearby: int = 16  # from a plan, or where another search has failed, at most
    first_range: float = 4.0  # about a point, in `TWIST_UNIT`
    closeness: float = 4e-6  # of a point to the best of the sets about it, relative
    price: float = 2.0
    """Of a `WRENCH_UNIT` of missing force, and of `LOAD_UNIT` of a broken row, per utilisation."""
    small_factors: tuple[float, ...] = (0.5, 0.1)
    """Of the body wrench, from which the largest is sought where the whole has no plan."""
    binding_multiplier: float = 1e-6  # above this it binds
    dependent_rows: float = 1e-8  # relative size of binding rows that count as dependent
    effort_nearness: float = 2e-4
    """Weight with which rounds stay near the point, for one unit of z: what an effort may be below
    which is not worth a way of several units."""
    cap_excess: float = 0.25 * CAP_SLACK  # of a plan's utilisation over the cap, at most


SETTINGS: Final = FloatingSettings()


class Goal(ABC):
    """Quantity that a search minimises.

    Attributes
    ----------
    least_penalty : float
        Least ρ: of the value for what is missing of the body wrench, per `WRENCH_UNIT`. Twice the
        dearest multiplier if that is more.
    promised : float or None
        What of a promised decrease a repaired step must keep for the range about it to widen;
        None: it does not widen there.
    farthest : sequence of ndarray, shape (6,), or None
        How far from rest each hand's twist may be [m, rad]; None: as far as a twist is small.
    """

    least_penalty: float
    promised: float | None
    farthest: Sequence[Array] | None = None

    @abstractmethod
    def value(self, measure: ExactMeasure) -> float:
        """Return what is to be least, of a point."""

    def excess(self, measure: ExactMeasure) -> float:
        """Return by how much a point is beyond what the goal allows; nothing by default."""
        return 0.0

    def exact(self, measure: ExactMeasure, hands: HandSets) -> bool:
        """Return whether a point is a plan: nothing missing, nothing broken, nothing in excess."""
        return measure.exact(hands)

    def wrong(self, measure: ExactMeasure) -> float:
        """Return what is missing, broken or in excess, together."""
        return measure.missing + measure.broken + self.excess(measure)

    def merit(self, measure: ExactMeasure, penalty: float) -> float:
        """Return the value, and ρ for what is wrong."""
        return self.value(measure) + penalty * self.wrong(measure)

    def constraints(self, data: StanceData) -> StanceData:
        """Return the stance with all that must hold as hard rows; as it is by default."""
        return data

    @abstractmethod
    def solve(self, data: StanceData) -> Outcome:
        """Return what is least on sets, with the multipliers that prove it."""

    @abstractmethod
    def dearest(self, outcome: Outcome) -> float:
        """Return the largest multiplier that the penalty must exceed."""

    @abstractmethod
    def first_step(self, data: StanceData, outcome: Outcome, near: Sequence[Array]) -> Outcome:
        """Return where a round goes that is not yet near the end."""

    @abstractmethod
    def root(
        self,
        hands: HandSets,
        point: LinearisationPoint,
        sets: Sets,
        within: float,
        weights: Outcome,
    ) -> Array:
        """Return R (M, M) for `later_step`: RᵀR is the curvature that linear sets lack."""

    @abstractmethod
    def later_step(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        """Return where a round goes that minds the sets' curvature, about loads."""

    @abstractmethod
    def restore(self, data: StanceData) -> Outcome:
        """Return where a round goes whose sets have no balance as the goal wants it."""


class LeastUse(Goal):
    """Least utilisation; of several such points that of about least effort."""

    least_penalty = 10.0
    promised = None

    def value(self, measure: ExactMeasure) -> float:
        return measure.utilisation

    def solve(self, data: StanceData) -> Outcome:
        return programs.margin(data)

    def dearest(self, outcome: Outcome) -> float:
        assert outcome.balance_dual is not None
        return float(np.abs(outcome.balance_dual).max())

    def first_step(self, data: StanceData, outcome: Outcome, near: Sequence[Array]) -> Outcome:
        cap = outcome.value + CAP_SLACK * max(1.0, abs(outcome.value))
        return programs.tie_break(data, cap)

    def root(
        self,
        hands: HandSets,
        point: LinearisationPoint,
        sets: Sets,
        within: float,
        weights: Outcome,
    ) -> Array:
        parts = sets.data.hands
        limits = scipy.linalg.block_diag(*(hand.L for hand in parts))
        shares = np.concatenate(weights.limit_duals)
        hard = scipy.linalg.block_diag(*(hand.H for hand in parts))
        least = SETTINGS.binding_multiplier
        binding = np.concatenate(weights.hard_duals) > least
        rows = np.vstack(
            [
                np.hstack([hand.G for hand in parts]),
                limits[shares > least] - shares @ limits / max(float(shares.sum()), least),
                hard[binding],
            ]
        )
        # the last is the weight of staying near the point, for one unit of z
        return bent_root(
            scipy.linalg.block_diag(*hands.curvature(point, within, weights)), rows, 0.002
        )

    def later_step(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        return programs.curved(data, root, near)

    def restore(self, data: StanceData) -> Outcome:
        return programs.nearest(data)


LEAST_USE: Final = LeastUse()


def bent_root(curvature: Array, rows: Array, near: float) -> Array:
    """Return R, shape (m, m), of a curvature (m, m) where binding rows (k, m) leave room.

    RᵀR is the curvature there, as far as it bends toward more (the rest of it has no part in the
    solution, and need not be convex), and ``near``² everywhere.
    """
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > SETTINGS.dependent_rows * sizes.max(initial=0.0)).sum())
    across, along = axes[:rank], axes[rank:]
    values, turns = np.linalg.eigh(along @ curvature @ along.T)
    roots = np.sqrt(np.maximum(values, 0.0) + near**2)
    return np.vstack([near * across, roots[:, None] * (turns.T @ along)])
