"""Objectives of the search for the wrist poses of floating and compliant hands.

The search in `planner.floating.wrist_iteration` is sequential: it linearises the hands' sets at a
point, solves a conic program on them, and steps within a trust region. A `Goal` supplies the
program whose dual values prove the outcome, the programs of the steps (far from and near the
optimum), and the merit function of a point.
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
    """Sizes and tolerances of the search for poses of floating and compliant wrists."""

    programs: int = 640
    """Largest number of conic programs for one question.

    Then the best plan found is returned. Four floating hands take some ten seconds."""
    first_programs: int = 70  # for a search for a first plan, at most
    first_relaxed: int = 140  # the same of compliant wrists, whose programs are smaller steps
    along_programs: int = 190  # for a search along the multiples of the body wrench, at most
    effort_programs: int = 110  # for the search for least effort, at most
    rounds: int = 40  # from one starting point, at most
    followed: int = 4  # steps of relaxed programs until one of them lowers the merit, at most
    rounds_nearby: int = 16  # from a plan, or where another search has failed, at most
    first_range: float = 4.0  # about a point, in `TWIST_UNIT`
    closeness: float = 4e-6  # of a point to the best of the sets about it, relative
    next_gap: float = 5e-3
    """Gap of a plan for the next body wrench to the best of the sets about it, at most, relative.

    Less is not worth another round: the model itself is no better."""
    next_nearness: float = 0.1
    """Weight of half the squared step to the next body wrench's plan, in the units of z.

    Where a step saves little, as where fewer limits bind than there are loads, the point stays."""
    next_rounds: int = 5  # from the last plan to the next, at most
    next_error: float = 0.01
    """Missing wrench and violations, in their units, that are left to Newton steps.

    With more, these steps would leave the other limits behind."""
    next_corrections: int = 3  # Newton steps of a round, at most; each squares the error
    repair_growth: float = 1e-3  # of a plan's value by corrections of its last point, relative
    price: float = 2.0
    """Price, as utilisation, of a `WRENCH_UNIT` of missing wrench or a `LOAD_UNIT` of violation."""
    rises: tuple[float, ...] = (1.0, 10.0, 100.0, 1000.0)
    """Multiples of the price: where balance costs more utilisation than a price, a search at that
    price ends without balance, and the next goes on at a higher one."""
    beyond_rest: float = 8.0
    """Least price over what hands use at rest: plans of bundled stances use some ten times that."""
    far_off: float = 0.1
    """Missing wrench and violations, in their units, from which a higher price is tried only if it
    promises to lower them: elsewhere the sets about the point have no balance."""
    promise: float = 0.1
    """Share of the violations that sets about a point must promise to remove at a higher price.

    Steering of an exact penalty: Byrd, Nocedal and Waltz, Optimization Methods and Software 23,
    2008. Promises of less are within the error of a linearised set."""
    nearness: float = 1e-3  # weight of half the squared step in relaxed programs, in the units of z
    relaxed_range: float = 1.0
    """Half width of the first trust region of relaxed programs, in `TWIST_UNIT`.

    One `TWIST_UNIT` and 100 N, for which linearised sets are good."""
    small_factors: tuple[float, ...] = (0.5, 0.1)
    """Multiples of the body wrench to start the search from if the whole one has no plan."""
    better_branch: float = 2e-3
    """Utilisation by which a plan for a multiple of the body wrench must be below what follows from
    the plan for the whole, for another search: searches end within some thousandths."""
    binding_multiplier: float = 1e-6  # above this it binds
    dependent_rows: float = 1e-8  # relative size of binding rows that count as dependent
    effort_nearness: float = 2e-4
    """Weight that keeps an effort step near its point, for one unit of z.

    Smaller gains of effort are not worth a step of several units."""
    cap_excess: float = 0.25 * CAP_SLACK  # of a plan's utilisation over the cap, at most


SETTINGS: Final = FloatingSettings()


class Goal(ABC):
    """Objective of a search for wrist poses: what is minimised, and with which programs.

    Attributes
    ----------
    least_penalty : float
        Least penalty ρ of violations, per `WRENCH_UNIT` of missing body wrench. The search uses
        twice the largest dual value if that is more.
    promised : float or None
        Share of the predicted decrease that a corrected step must achieve for the trust region to
        grow; None: the trust region does not grow after a corrected step.
    farthest : sequence of ndarray, shape (m,), or None
        Bound on the size of each component of each wrist's pose y: twist from rest [m, rad], of a
        compliant hand also tensions [N]. None: no bound but that of small twists.
    """

    least_penalty: float
    promised: float | None
    farthest: Sequence[Array] | None = None

    @abstractmethod
    def value(self, measure: ExactMeasure) -> float:
        """Return the objective of a point: the quantity that the search minimises.

        Parameters
        ----------
        measure : ExactMeasure
            Exact utilisation, violations and effort at the point.
        """

    def excess(self, measure: ExactMeasure) -> float:
        """Return by how much a measured point exceeds a cap of the goal; 0 by default."""
        return 0.0

    def exact(self, measure: ExactMeasure, hands: HandSets) -> bool:
        """Return whether a measured point is a plan: balanced, within hard rows and caps."""
        return measure.exact(hands)

    def wrong(self, measure: ExactMeasure) -> float:
        """Return the sum of a measured point's violations: missing wrench, hard row, excess."""
        return measure.missing + measure.broken + self.excess(measure)

    def merit(self, measure: ExactMeasure, penalty: float) -> float:
        """Return the merit function at a point: objective plus penalty times violations.

        Parameters
        ----------
        measure : ExactMeasure
            Exact utilisation, violations and effort at the point.
        penalty : float
            Penalty ρ per unit of violation.
        """
        return self.value(measure) + penalty * self.wrong(measure)

    def constraints(self, data: StanceData) -> StanceData:
        """Return a stance's rows with the goal's constraints as hard rows; unchanged by default."""
        return data

    @abstractmethod
    def solve(self, data: StanceData) -> Outcome:
        """Minimise the objective on sets linearised at a point.

        Parameters
        ----------
        data : StanceData
            The linearised sets' scaled rows.

        Returns
        -------
        Outcome
            Loads and the dual values that prove them optimal.
        """

    @abstractmethod
    def dearest(self, outcome: Outcome) -> float:
        """Return the largest dual value of an outcome, which an exact penalty must exceed."""

    @abstractmethod
    def first_step(self, data: StanceData, outcome: Outcome, near: Sequence[Array]) -> Outcome:
        """Solve for the next step while the search is still far from the optimum.

        Parameters
        ----------
        data : StanceData
            Sets linearised at the current point.
        outcome : Outcome
            Result of `solve` on the sets.
        near : sequence of ndarray, shape (m,)
            Loads y of each hand at the current point, as in `LinearisationPoint`.
        """

    @abstractmethod
    def root(
        self,
        hands: HandSets,
        point: LinearisationPoint,
        sets: Sets,
        within: float,
        weights: Outcome,
    ) -> Array:
        """Return the curvature that linearised sets lack, as a root R with curvature RᵀR.

        Parameters
        ----------
        hands : HandSets
            Hands of the stance, with their sets at any pose of their wrists.
        point : LinearisationPoint
            Current point.
        sets : Sets
            Sets linearised at the point.
        within : float
            Half width of the trust region, in `TWIST_UNIT`.
        weights : Outcome
            Dual values that weigh the rows' curvatures.

        Returns
        -------
        ndarray, shape (M, M)
            R in the scaled loads of all hands, for `later_step`.
        """

    @abstractmethod
    def later_step(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        """Solve for the next step near the optimum, with the sets' curvature RᵀR.

        Parameters
        ----------
        data : StanceData
            Sets linearised at the current point.
        root : ndarray, shape (M, M)
            R, in the scaled loads of all hands.
        near : sequence of ndarray, shape (m,)
            Loads y of each hand at the current point, as in `LinearisationPoint`.
        """

    @abstractmethod
    def restore(self, data: StanceData) -> Outcome:
        """Solve for a step toward feasibility, where the linearised sets contain no plan."""


class LeastUse(Goal):
    """Goal of least utilisation; of points of equal utilisation, one of about the least effort."""

    least_penalty = 10.0
    promised = None

    def value(self, measure: ExactMeasure) -> float:
        """Return the utilisation of a measured point."""
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
"""The goal of least utilisation."""


def bent_root(curvature: Array, rows: Array, near: float) -> Array:
    """Return a root R of a curvature, restricted to the directions that binding rows leave free.

    Parameters
    ----------
    curvature : ndarray, shape (m, m)
        Symmetric second derivatives.
    rows : ndarray, shape (k, m)
        Gradients of the binding rows.
    near : float
        Root of a small curvature that is added in every direction.

    Returns
    -------
    ndarray, shape (m, m)
        R. In the free directions RᵀR is the positive part of the curvature, plus near²; in all
        other directions near². Negative curvature is dropped, so that the program stays convex.
    """
    _, sizes, axes = np.linalg.svd(rows)
    rank = int((sizes > SETTINGS.dependent_rows * sizes.max(initial=0.0)).sum())
    across, along = axes[:rank], axes[rank:]
    values, turns = np.linalg.eigh(along @ curvature @ along.T)
    roots = np.sqrt(np.maximum(values, 0.0) + near**2)
    return np.vstack([near * across, roots[:, None] * (turns.T @ along)])
