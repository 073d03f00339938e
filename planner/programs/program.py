"""The conic programs of a stance, in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits), ``H_h y_h ≤ h_h`` (hard rows) and the
wrench o_h + V_h y_h on the rock. Carried to the body, the rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Below these six rows the balance has one for each component of a hand's wrench that is given
(`held`). What joints, caps and largest changes of tension say are rows of the hands' sets.

Nine programs share these rows:

=============  =============================================================================
`Unique`       min u + `TIE` · mean (tension / maximum)²       least utilisation, made unique
`LessTension`  min u + w Σ (tension / maximum)²  the plan that is meant: see `tension_trade`
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

import numpy as np
import scipy

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.programs.conic import Columns, ConicProgram, Outcome, Reached
from planner.programs.stance_data import StanceData
from planner.programs.stance_program import REFINED, SHARP, VERTEX, Definition, StanceProgram
from planner.programs.trade import TensionTrade

__all__ = [
    "TIE",
    "UNLIMITED",
    "Curved",
    "Effort",
    "LessTension",
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
    """min u: the least utilisation; ``value`` is that utilisation."""

    def define(self) -> Definition:
        import cvxpy as cp

        u, z = cp.Variable(), self.loads()
        rows = self.rows(z, u)
        return Definition(cp.Problem(cp.Minimize(u), [*rows]), (u, z), rows)

    def conic(self) -> ConicProgram:
        u, loads, b = self.blocks(1)
        u[self.of_limits] = -1.0
        P, q = np.zeros((2, 1 + self.size))
        q[0] = 1.0
        return ConicProgram(P, q, (Columns.of(u), loads), b, len(self.G))

    def vertex(self) -> Outcome:
        """Return a plan where as many rows meet as there are loads, by the simplex method.

        An interior point has as many digits of all loads as of the largest; here each row has its
        own.
        """
        return self.by_definition(VERTEX)[0]


class Unique(StanceProgram):
    """min u + `TIE` · mean (tension / maximum)²: the least utilisation, made unique in one solve.

    A tension is at most u times its maximum, so the least u is exceeded by less than TIE u².

    Parameters
    ----------
    data : StanceData
    share : float, optional
        How much of its weight the second term is given.
    """

    settings = (SHARP, REFINED)
    wanted = 1

    def __init__(self, data: StanceData, share: float = 1.0) -> None:
        super().__init__(data)
        self.weights = tie_weight(len(data.hands)) * share * data.rows.tie

    def define(self) -> Definition:
        import cvxpy as cp

        u, z = cp.Variable(), self.loads()
        rows = self.rows(z, u)
        ties = cp.sum(cp.multiply(self.weights, cp.square(z)))
        return Definition(cp.Problem(cp.Minimize(u + ties), [*rows]), (u, z), rows)

    def conic(self) -> ConicProgram:
        u, loads, b = self.blocks(1)
        u[self.of_limits] = -1.0
        P, q = np.zeros((2, 1 + self.size))
        P[1:] = 2.0 * self.weights
        q[0] = 1.0
        return ConicProgram(P, q, (Columns.of(u), loads), b, len(self.G))

    def solve(self) -> Outcome:
        """Return the plan of least utilisation; ``value`` is that utilisation."""
        outcome, u = self.run()
        return outcome if u is None else replace(outcome, value=float(u[0]))


class LessTension(Unique):
    """min u + w Σ (tension / maximum)² with u ≤ most: the plan that is meant.

    Parameters
    ----------
    data : StanceData
    trade : TensionTrade
        w and most.
    """

    def __init__(self, data: StanceData, trade: TensionTrade) -> None:
        super().__init__(data)
        self.most, self.weights = trade.most, trade.weight * data.rows.tie

    def define(self) -> Definition:
        import cvxpy as cp

        problem, (u, z), rows = super().define()
        capped = cp.Problem(problem.objective, [*rows, u <= self.most])
        return Definition(capped, (u, z), rows)

    def conic(self) -> ConicProgram:
        u, loads, b = self.blocks(1, below=1)
        u[self.of_limits], u[-1], b[-1] = -1.0, 1.0, self.most
        return super().conic()._replace(A=(Columns.of(u), loads), b=b)


def tie_weight(hands: int) -> float:
    """Return what `Unique` weighs the sum of squares with: `TIE` over the number of tendons."""
    return TIE / (len(FINGERS) * hands)


class Curved(StanceProgram):
    """min u + ½ ‖R (z − z₀)‖²: least utilisation where sets are curved, or near to loads.

    Parameters
    ----------
    data : StanceData
    root : ndarray, shape (M, M)
        R, a root of the curvature in all hands' z.
    near : sequence of ndarray
        Each hand's y₀.
    """

    def __init__(self, data: StanceData, root: Array, near: Sequence[Array]) -> None:
        super().__init__(data)
        self.root, self.centre = root, root @ (np.concatenate(near) / data.rows.unit)

    def define(self) -> Definition:
        import cvxpy as cp

        u, z = cp.Variable(), self.loads()
        rows = self.rows(z, u)
        bent = cp.sum_squares(self.root @ z - self.centre)
        return Definition(cp.Problem(cp.Minimize(u + 0.5 * bent), [*rows]), (u, z), rows)

    def conic(self) -> ConicProgram:
        """Columns u, R z − R z₀ and z."""
        size = self.size
        front, loads, b = self.blocks(1 + size, above=self.root)
        front[:size, 1:] = -np.eye(size)
        front[size:][self.of_limits, 0] = -1.0
        b[:size] = self.centre
        P, q = np.zeros((2, 1 + 2 * size))
        P[1 : 1 + size] = 1.0
        q[0] = 1.0
        return ConicProgram(P, q, (Columns.of(front), loads), b, size + len(self.G), size)


class TieBreak(StanceProgram):
    """min Σ (tension / maximum)² under a cap on the utilisation: which plan is meant of those."""

    def __init__(self, data: StanceData, cap: float) -> None:
        super().__init__(data)
        # weights relative to the largest: the minimiser does not change
        self.cap, self.weights = cap, data.rows.tie / data.rows.tie.max()

    def define(self) -> Definition:
        import cvxpy as cp

        z = self.loads()
        rows = self.rows(z, self.cap)
        effort = cp.sum(cp.multiply(self.weights, cp.square(z)))
        return Definition(cp.Problem(cp.Minimize(effort), [*rows]), (z,), rows)

    def conic(self) -> ConicProgram:
        _, loads, b = self.blocks(0)
        b[self.of_limits] += self.cap
        P = 2.0 * self.weights
        return ConicProgram(P, np.zeros_like(P), (loads,), b, len(self.G))


class Effort(StanceProgram):
    """min Σ ‖E z + e₀‖² under a cap: the least sum of squared relative tensions and torques.

    Small weights make loads unique that are neither: palms, lateral reactions, wrists.
    """

    def __init__(self, data: StanceData, cap: float) -> None:
        super().__init__(data)
        self.cap = cap
        self.E = scipy.linalg.block_diag(*(hand.E for hand in data.hands))
        self.e0 = np.concatenate([hand.e0 for hand in data.hands])
        self.weights = np.concatenate([hand.rest for hand in data.hands])

    def define(self) -> Definition:
        import cvxpy as cp

        z = self.loads()
        rows = self.rows(z, self.cap)
        rest = cp.sum(cp.multiply(self.weights, cp.square(z)))
        effort = cp.sum_squares(self.E @ z + self.e0) + rest
        return Definition(cp.Problem(cp.Minimize(effort), [*rows]), (z,), rows)

    def conic(self) -> ConicProgram:
        """Columns E z + e₀ and z."""
        size = len(self.e0)
        front, loads, b = self.blocks(size, above=self.E)
        front[:size] = -np.eye(size)
        b[:size] = -self.e0
        b[size:][self.of_limits] += self.cap
        P = np.concatenate([np.full(size, 2.0), 2.0 * self.weights])
        A = Columns.of(front), loads
        return ConicProgram(P, np.zeros_like(P), A, b, size + len(self.G), size)


class LoadFactor(StanceProgram):
    """max s: how many times the body wrench, not zero, could be held at utilisation 1.

    ``value`` is that load factor.
    """

    wanted = 1

    def __init__(self, data: StanceData) -> None:
        body, held = data.wrench.copy(), data.wrench.copy()
        body[6:], held[:6] = 0.0, 0.0
        super().__init__(data.turned(held))
        # of unit size, or a small wrench and its large factor would defeat the solver
        self.unit = float(np.abs(body).max())
        self.wrench = body / self.unit

    def define(self) -> Definition:
        import cvxpy as cp

        s, z = cp.Variable(), self.loads()
        _, limits, hard = self.rows(z, 1.0)
        rows = self.G @ z == self.data.offset + self.wrench * s, limits, hard
        return Definition(cp.Problem(cp.Maximize(s), [*rows, s >= 0.0]), (s, z), rows)

    def conic(self) -> ConicProgram:
        s, loads, b = self.blocks(1, below=1)
        s[: len(self.G), 0], s[-1] = -self.wrench, -1.0
        b[self.of_limits] += 1.0
        P, q = np.zeros((2, 1 + self.size))
        q[0] = -1.0
        return ConicProgram(P, q, (Columns.of(s), loads), b, len(self.G))

    def solve(self) -> Outcome:
        outcome, s = self.run()
        return outcome if s is None else replace(outcome, value=float(s[0]) / self.unit)


class Reach(StanceProgram):
    """max c·t: how far along the columns of B the balance can go, under a cap.

    The limit rows may change with t, too, as those of joints do with the body's acceleration:
    L z + l0 + K t ≤ cap.

    Parameters
    ----------
    data : StanceData
    goal : ndarray, shape (k,)
        c.
    B : ndarray, shape (nb, k)
    cap : float, optional
    K : sequence of ndarray, optional
        Of each hand, (nl, k); zero by default.
    """

    def __init__(
        self,
        data: StanceData,
        goal: Array,
        B: Array,
        cap: float = 1.0,
        K: Sequence[Array] | None = None,
    ) -> None:
        super().__init__(data)
        self.goal, self.B, self.cap = goal, B, cap
        self.K = np.zeros((len(self.L), len(goal))) if K is None else np.vstack(K)
        self.wanted = len(goal)

    def define(self) -> Definition:
        import cvxpy as cp

        t, z = cp.Variable(len(self.goal)), self.loads()
        balance = self.G @ z == self.data.offset + self.B @ t
        _, limits, hard = self.rows(z, self.cap - self.K @ t)
        rows = balance, limits, hard
        return Definition(cp.Problem(cp.Maximize(self.goal @ t), [*rows]), (t, z), rows)

    def conic(self) -> ConicProgram:
        ways = len(self.goal)
        t, loads, b = self.blocks(ways)
        t[: len(self.G)], t[self.of_limits] = -self.B, self.K
        b[self.of_limits] += self.cap
        P, q = np.zeros((2, ways + self.size))
        q[:ways] = -self.goal
        return ConicProgram(P, q, (Columns.of(t), loads), b, len(self.G))

    def farthest(self) -> Reached:
        """Return the farthest t."""
        outcome, t = self.run()
        if t is None:
            return Reached(outcome, np.full(self.wanted, np.nan))
        return Reached(replace(outcome, value=float(self.goal @ t)), t)


class Nearest(StanceProgram):
    """min ‖W − w‖ over all body wrenches w that loads up to `UNLIMITED` can give.

    ``value`` is the distance, in `WRENCH_UNIT`.

    Parameters
    ----------
    data : StanceData
    kept : int, optional
        The last so many rows of the balance, of wrenches that hands are given, are kept exactly;
        the others count like the body's.
    """

    def __init__(self, data: StanceData, kept: int = 0) -> None:
        super().__init__(data)
        self.kept = kept
        self.L, self.l0 = self.L[:0], self.l0[:0]

    def define(self) -> Definition:
        import cvxpy as cp

        missing, z = cp.Variable(len(self.G)), self.loads()
        balance = self.G @ z + missing == self.data.offset
        _, limits, hard = self.rows(z, 0.0)
        box = [z <= UNLIMITED, -z <= UNLIMITED]
        kept = [missing[len(self.G) - self.kept :] == 0.0] if self.kept else []
        problem = cp.Problem(cp.Minimize(cp.norm(missing)), [balance, *kept, hard, *box])
        return Definition(problem, (z,), (balance, limits, hard))

    def conic(self) -> ConicProgram:
        """Columns ‖W − w‖, W − w and z."""
        count, kept, size = len(self.G), self.kept, self.size
        zero, box = count + kept, count + kept + len(self.H)
        cone = box + 2 * size
        A = np.zeros((cone + 1 + count, 1 + count + size))
        A[:count, 1 : 1 + count], A[:count, 1 + count :] = np.eye(count), self.G
        A[count:zero, 1 + count - kept : 1 + count] = np.eye(kept)
        A[zero:box, 1 + count :] = self.H
        A[box:cone, 1 + count :] = np.vstack([np.eye(size), -np.eye(size)])
        A[cone:, : 1 + count] = -np.eye(1 + count)
        b = np.zeros(len(A))
        b[:count], b[zero:box], b[box:cone] = self.data.offset, self.h, UNLIMITED
        P, q = np.zeros((2, A.shape[1]))
        q[0] = 1.0
        return ConicProgram(P, q, (Columns.of(A),), b, zero, second_order=1 + count)
