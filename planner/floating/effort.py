"""The plan of least effort of floating hands, found from the plan of least utilisation.

Effort is Σ ‖E z + e₀‖² over relative tensions and joint torques, in a hand's variables z. E z + e₀
is nonlinear in a floating wrist's twist, so the search is that of
`planner.floating.wrist_iteration` with another goal: on the sets linearised at a point it solves
`programs.effort`. Steps near the optimum have the curvature of the Lagrangian,

    Σ 2 (E z + e₀) ∂²E/∂z² + λ ∂²L/∂z² + μ ∂²H/∂z² + ν ∂²G/∂z²,

as further rows of E (the rest of the curvature is Gauss–Newton); λ, μ, ν are the dual values of
limits, hard rows and balance. The search starts from a plan within the cap and ends with a plan of
no more effort. That plan is exact; its effort is at most 4e-6 above the least effort of the sets
linearised there, or else the plan is marked unproven.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy

from hand_models.base import Array
from hand_models.compliance import pose_units
from planner import programs
from planner.deadline import Budget
from planner.floating.elastic_search import find_wrists
from planner.floating.goals import SETTINGS, Goal, bent_root
from planner.floating.wrist_iteration import WristSolution
from planner.prepare import ExactMeasure, HandSets, LinearisationPoint, Sets
from planner.programs import CAP_SLACK, Outcome, StanceData

__all__ = ["LeastEffort", "best_within", "with_room"]


class LeastEffort(Goal):
    """Goal of least effort at a utilisation within a cap, with bounds on the wrists' poses.

    Parameters
    ----------
    cap : float
        Largest utilisation.
    farthest : sequence of ndarray, shape (m,)
        Bound on the size of each component of each wrist's pose y: twist from rest [m, rad], of a
        compliant hand also tensions [N].
    """

    least_penalty = 0.05
    promised = 0.7

    def __init__(self, cap: float, farthest: Sequence[Array]) -> None:
        self.cap = cap
        self.farthest = farthest

    def value(self, measure: ExactMeasure) -> float:
        """Return the effort of a measured point."""
        return measure.effort

    def excess(self, measure: ExactMeasure) -> float:
        """Return by how much a measured point's utilisation exceeds the cap; at least 0."""
        return max(measure.utilisation - self.cap, 0.0)

    def exact(self, measure: ExactMeasure, hands: HandSets) -> bool:
        return measure.exact(hands) and self.excess(measure) <= SETTINGS.cap_excess

    def constraints(self, data: StanceData) -> StanceData:
        return data.capped(self.cap)

    def solve(self, data: StanceData) -> Outcome:
        return programs.effort(data, self.cap)

    def dearest(self, outcome: Outcome) -> float:
        assert outcome.balance_dual is not None
        parts = (*outcome.limit_duals, *outcome.hard_duals)
        rows = sum(float(np.abs(part).sum()) for part in parts)
        return max(rows, float(np.abs(outcome.balance_dual).max()))

    def first_step(self, data: StanceData, outcome: Outcome, near: Sequence[Array]) -> Outcome:
        root = SETTINGS.effort_nearness * np.eye(sum(len(y) for y in near))
        return self.later_step(data, root, near)

    def root(
        self,
        hands: HandSets,
        point: LinearisationPoint,
        sets: Sets,
        within: float,
        weights: Outcome,
    ) -> Array:
        efforts = [
            2.0 * (hand.E @ (y / hand.unit) + hand.e0)
            for hand, y in zip(sets.data.hands, point.loads, strict=True)
        ]
        bent = hands.curvature(point, within, weights, efforts)
        roots = []
        for hand, part, limit, hard in zip(
            sets.data.hands, bent, weights.limit_duals, weights.hard_duals, strict=True
        ):
            # each binds a hand by itself: the balance alone couples hands
            least = SETTINGS.binding_multiplier
            rows = np.vstack([hand.L[limit > least], hand.H[hard > least]])
            roots.append(bent_root(0.5 * part, rows, SETTINGS.effort_nearness))
        return scipy.linalg.block_diag(*roots)

    def later_step(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        hands, at = [], 0
        for hand, y in zip(data.hands, near, strict=True):
            own = slice(at, at + len(hand.unit))
            R, at = root[own, own], own.stop
            hands.append(
                hand._replace(
                    E=np.vstack([hand.E, R]),
                    e0=np.concatenate([hand.e0, -R @ (y / hand.unit)]),
                )
            )
        return programs.effort(StanceData.of(tuple(hands), data.wrench), self.cap)

    def restore(self, data: StanceData) -> Outcome:
        outcome = programs.margin(data)
        return outcome if outcome.solved else programs.nearest(data)


def with_room(cap: float, used: float) -> float:
    """Return the cap on the utilisation, raised a little if the plan uses all of it, for rounding.

    Parameters
    ----------
    cap : float
        Largest utilisation that the question allows.
    used : float
        Utilisation of the plan.

    Returns
    -------
    float
        At least ``cap``, and above ``cap`` by less than `CAP_SLACK`.
    """
    return max(cap, min(used + 0.5 * CAP_SLACK, cap + CAP_SLACK - SETTINGS.cap_excess))


def best_within(
    hands: HandSets,
    plan: WristSolution,
    cap: float,
    goal: Callable[[float, Sequence[Array]], Goal],
    budget: Budget,
) -> WristSolution:
    """Search for a better plan for a goal, starting from a plan within a cap on the utilisation.

    Wrists stay within 4 `TWIST_UNIT` of rest, or of the plan's twist if that is larger. If the
    search finds nothing better, the start plan is returned and marked unproven.

    Parameters
    ----------
    hands : HandSets
        Hands of the stance, with their sets at any pose of their wrists.
    plan : WristSolution
        Start plan, within the cap.
    cap : float
        Largest utilisation.
    goal : callable
        Function (cap, bounds on each wrist's pose y, as `Goal.farthest`) → Goal.
    budget : Budget
        Largest number of conic programs.

    Returns
    -------
    WristSolution
        Plan whose value of the goal is no larger than that of the start plan.
    """
    # in `TWIST_UNIT`: farther, where loads of one step from rest are no longer sure, less
    # would be no gain
    away = [
        np.maximum(4.0 * pose_units(wrist.columns), np.abs(y)) if wrist is not None else y
        for wrist, y in zip(hands.wrists, plan.point.loads, strict=True)
    ]
    least = goal(cap, away)
    budget = budget.part(SETTINGS.effort_programs)
    found = find_wrists(hands, plan.point, budget, goal=least)
    if not found.exact or least.value(found.measure) > least.value(plan.measure):
        sets = hands.sets(plan.point, 1.0, least.farthest)
        return replace(plan, found="unproven", sets=sets, outcome=least.solve(sets.data))
    return replace(found, rounds=plan.rounds + found.rounds)
