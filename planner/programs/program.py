"""The conic programs of a stance, in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits), ``H_h y_h ≤ h_h`` (hard rows) and the
wrench o_h + V_h y_h on the rock. Carried to the body, the rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Below these six rows the balance has one for each component of a hand's wrench that is given
(`held`). What joints, caps and largest changes of tension say are rows of the hands' sets.

Eight programs share these rows:

=============  =============================================================================
`Unique`       min u + `TIE` · mean (tension / maximum)²       least utilisation, made unique
`Margin`       min u                              least utilisation; its duals are the prices
`Curved`       min u + ½ ‖R (z − z₀)‖²            with the curvature of floating hands
`TieBreak`     min Σ (tension / maximum)²         among plans of least utilisation
`Effort`       min Σ ‖E z + e₀‖²                  relative tensions and torques, under a cap
`LoadFactor`   max s with s W in place of W       at utilisation 1
`Reach`        max c·t with W + B t for W         how far body wrenches go, under a cap
`Nearest`      min ‖S (W − Σ …)‖                  hard rows alone, loads up to `UNLIMITED`
=============  =============================================================================

Everything is nondimensional: loads over `LOAD_UNIT` (a floating wrist's twist over `TWIST_UNIT`),
body wrenches over `WRENCH_UNIT`, limit rows over their capacities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import cvxpy as cp
import numpy as np

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.programs.outcome import Outcome, Reached
from planner.programs.stance_data import Shape, StanceData
from planner.programs.stance_program import CAREFUL, REFINED, SHARP, StanceProgram

__all__ = [
    "TIE",
    "UNLIMITED",
    "Curved",
    "Effort",
    "LoadFactor",
    "Margin",
    "Nearest",
    "Reach",
    "TieBreak",
    "Unique",
    "tie_weight",
]

UNLIMITED: Final = 1e4
"""Box, in `LOAD_UNIT`, on loads at no matter what utilisation: far beyond any strength."""

TIE: Final = 8e-6
"""Weight of the mean square of relative tensions beside the utilisation."""


class Margin(StanceProgram):
    """min u: the least utilisation."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        return cp.Problem(cp.Minimize(self.u), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation."""
        return self.run(data)[0]


class Unique(StanceProgram):
    """min u + `TIE` · mean (tension / maximum)²: the plan that is meant, in one solve.

    A tension is at most u times its maximum, so the least u is exceeded by less than TIE u².
    """

    settings = (SHARP, REFINED, CAREFUL)

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own, self.further = [*self.weights], [self.u]
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        ties = sum(
            cp.sum(cp.multiply(weights, cp.square(z)))
            for weights, z in zip(self.weights, self.z, strict=True)
        )
        rows = [self.balance, *self.limits, *self.hard]
        return cp.Problem(cp.Minimize(self.u + tie_weight(self.shape) * ties), rows)

    def solve(self, data: StanceData, share: float = 1.0) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation.

        ``share``: how much of its weight the second term is given.
        """
        ties = [hand.tie for hand in data.hands]
        if share != 1.0:
            ties = [share * tie for tie in ties]
        outcome, further = self.run(data, *ties)
        return replace(outcome, value=float(further[0])) if further else outcome


def tie_weight(shape: Shape) -> float:
    """Return what `Unique` weighs the sum of squares with: `TIE` over the number of tendons."""
    return TIE / (len(FINGERS) * len(shape.hands))


class Curved(StanceProgram):
    """min u + ½ ‖R (z − z₀)‖²: least utilisation where sets are curved, or near to loads."""

    def define(self) -> cp.Problem:
        self.u = cp.Variable()
        size = sum(z.shape[0] for z in self.z)
        self.root = [cp.Parameter((size, z.shape[0])) for z in self.z]
        self.centre = cp.Parameter(size)
        self.own = [*self.root, self.centre]
        self.limits = [row <= self.u for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        parts = [root @ z for root, z in zip(self.root, self.z, strict=True)]
        bent = cp.sum_squares(sum(parts) - self.centre)
        rows = [self.balance, *self.limits, *self.hard]
        return cp.Problem(cp.Minimize(self.u + 0.5 * bent), rows)

    def solve(self, data: StanceData, root: Array, near: Sequence[Array]) -> Outcome:
        """Return the plan for the root R (M, M) of the curvature in all hands' z, about their y."""
        z = [y / hand.unit for hand, y in zip(data.hands, near, strict=True)]
        parts = np.split(root, np.cumsum([len(part) for part in z])[:-1], axis=1)
        return self.run(data, *parts, root @ np.concatenate(z))[0]


class TieBreak(StanceProgram):
    """min Σ (tension / maximum)² under a cap on the utilisation: which plan is meant of those."""

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own = [self.cap, *self.weights]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum(cp.multiply(weights, cp.square(z)))
            for weights, z in zip(self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan that is meant among those with utilisation at most ``cap``."""
        # weights relative to the largest: the minimiser does not change
        largest = max(float(hand.tie.max(initial=0.0)) for hand in data.hands)
        return self.run(data, cap, *(hand.tie / largest for hand in data.hands))[0]


class Effort(StanceProgram):
    """min Σ ‖E z + e₀‖² under a cap: the least sum of squared relative tensions and torques.

    Small weights make loads unique that are neither: palms, lateral reactions, wrists.
    """

    def define(self) -> cp.Problem:
        self.cap = cp.Parameter()
        self.E = [cp.Parameter((ne, m)) for m, _, _, ne in self.shape.hands]
        self.e0 = [cp.Parameter(ne) for _, _, _, ne in self.shape.hands]
        self.weights = [cp.Parameter(z.shape[0], nonneg=True) for z in self.z]
        self.own = [self.cap, *self.E, *self.e0, *self.weights]
        self.limits = [row <= self.cap for row in self.utilisations()]
        self.balance = self.reaction == self.offset
        effort = sum(
            cp.sum_squares(E @ z + e0) + cp.sum(cp.multiply(weights, cp.square(z)))
            for E, e0, weights, z in zip(self.E, self.e0, self.weights, self.z, strict=True)
        )
        return cp.Problem(cp.Minimize(effort), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData, cap: float) -> Outcome:
        """Return the plan of least effort among those with utilisation at most ``cap``."""
        hands = data.hands
        efforts = (*(hand.E for hand in hands), *(hand.e0 for hand in hands))
        return self.run(data, cap, *efforts, *(hand.rest for hand in hands))[0]


class LoadFactor(StanceProgram):
    """max s: how many times the body wrench could be held at utilisation 1."""

    def define(self) -> cp.Problem:
        self.factor = cp.Variable(nonneg=True)
        self.wrench = cp.Parameter(self.shape.balance)
        self.own = [self.wrench]
        self.limits = [row <= 1.0 for row in self.utilisations()]
        self.balance = self.reaction == self.offset + self.wrench * self.factor
        return cp.Problem(cp.Maximize(self.factor), [self.balance, *self.limits, *self.hard])

    def solve(self, data: StanceData) -> Outcome:
        """Return the largest load factor as ``value``; the body wrench must not be zero."""
        body, held = data.wrench.copy(), data.wrench.copy()
        body[6:], held[:6] = 0.0, 0.0
        size = float(np.abs(body).max())
        # of unit size, or a small wrench and its large factor would defeat the solver
        outcome, _ = self.run(data.turned(held), body / size)
        return replace(outcome, value=outcome.value / size)


class Reach(StanceProgram):
    """max c·t: how far along the columns of B the balance can go, under a cap.

    The limit rows may change with t, too, as those of joints do with the body's acceleration:
    L z + l0 + K t ≤ cap.
    """

    def __init__(self, shape: Shape, directions: int) -> None:
        self.directions = directions
        super().__init__(shape)

    def define(self) -> cp.Problem:
        self.t = cp.Variable(self.directions)
        self.further = [self.t]
        self.goal = cp.Parameter(self.directions)
        self.cap = cp.Parameter()
        self.B = cp.Parameter((self.shape.balance, self.directions))
        self.K = [cp.Parameter((nl, self.directions)) for _, nl, _, _ in self.shape.hands]
        self.own = [self.goal, self.B, self.cap, *self.K]
        self.limits = [
            row + K @ self.t <= self.cap for row, K in zip(self.utilisations(), self.K, strict=True)
        ]
        self.balance = self.reaction == self.offset + self.B @ self.t
        return cp.Problem(cp.Maximize(self.goal @ self.t), [self.balance, *self.limits, *self.hard])

    def solve(
        self,
        data: StanceData,
        goal: Array,
        B: Array,
        cap: float = 1.0,
        K: Sequence[Array] | None = None,
    ) -> Reached:
        """Return the farthest t for the goal c (k,), with B (nb, k) and K (nl, k) of each hand."""
        if K is None:
            K = [np.zeros((len(hand.l0), self.directions)) for hand in data.hands]
        outcome, further = self.run(data, goal, B, cap, *K)
        return Reached(outcome, further[0] if further else np.full(self.directions, np.nan))


class Nearest(StanceProgram):
    """min ‖W − w‖ over all body wrenches w that loads up to `UNLIMITED` can give.

    The last ``kept`` rows of the balance, of wrenches that hands are given, are kept exactly; the
    others count like the body's.
    """

    def __init__(self, shape: Shape, kept: int = 0) -> None:
        self.kept = kept
        super().__init__(shape)

    def define(self) -> cp.Problem:
        count = self.shape.balance
        self.shortfall = cp.Variable(count)
        self.balance = self.reaction + self.shortfall == self.offset
        box = [sign * z <= UNLIMITED for z in self.z for sign in (1.0, -1.0)]
        kept = [self.shortfall[count - self.kept :] == 0.0] if self.kept else []
        objective = cp.Minimize(cp.norm(self.shortfall))
        return cp.Problem(objective, [self.balance, *self.hard, *box, *kept])

    def solve(self, data: StanceData) -> Outcome:
        """Return the distance to the nearest body wrench, in `WRENCH_UNIT`, as ``value``."""
        return self.run(data)[0]
