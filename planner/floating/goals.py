"""Goals that a search for the wrists of floating hands minimises.

The search itself (`planner.floating.wrist_iteration`) knows sets, ranges and steps. A goal says
which program is solved on the sets, whose multipliers prove the outcome; with which one it steps,
at first and near the end; and which value the model gives a point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final

import numpy as np
import scipy

from hand_models.base import Array
from planner import programs
from planner.prepare import ExactMeasure, HandSets, LinearisationPoint, Sets
from planner.programs import SLACK, Outcome, StanceData

__all__ = ["BINDING", "LEAST_USE", "RANK", "Goal", "LeastUse", "bent_root"]

NEAR: Final = 0.002
"""Weight with which later rounds of `LeastUse` stay near the point, for one unit of z."""

BINDING: Final = 1e-6
"""Multipliers above this bind."""

RANK: Final = 1e-8
"""Relative size below which binding rows count as dependent."""


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
        cap = outcome.value + SLACK * max(1.0, abs(outcome.value))
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
        binding = np.concatenate(weights.hard_duals) > BINDING
        rows = np.vstack(
            [
                np.hstack([hand.G for hand in parts]),
                limits[shares > BINDING] - shares @ limits / max(float(shares.sum()), BINDING),
                hard[binding],
            ]
        )
        return bent_root(
            scipy.linalg.block_diag(*hands.curvature(point, within, weights)), rows, NEAR
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
    rank = int((sizes > RANK * sizes.max(initial=0.0)).sum())
    across, along = axes[:rank], axes[rank:]
    values, turns = np.linalg.eigh(along @ curvature @ along.T)
    roots = np.sqrt(np.maximum(values, 0.0) + near**2)
    return np.vstack([near * across, roots[:, None] * (turns.T @ along)])
