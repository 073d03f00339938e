"""The conic programs of a stance in CVXPY: their definition, readable as the mathematics.

Hand h has loads y_h with ``L_h y_h + l0_h ≤ u s_h`` (limits, u the utilisation), ``H_h y_h ≤ h_h``
(hard rows) and the wrench o_h + V_h y_h on the rock. Ad(B←H_h) (6, 6) carries a wrench from the
hand's frame to the body's. The rock's reactions give the body wrench W:

    Σ_h −Ad(B←H_h) (o_h + V_h y_h) = W.                                              (balance)

Below these six rows the balance has one row for each component of a hand's wrench that the
question prescribes (`held`). Joints, force caps and largest changes of tension are further rows of
the hands' sets.

Four classes share these rows: `Best` minimises the utilisation or a sum of squares; `Reach`
maximises a body wrench; `Nearest` finds the nearest body wrench; `Elastic` relaxes the rows at a
price (an exact ℓ₁ penalty). Each program has a function in `planner.programs.solvers`:

==============  =============================================================================
`margin`        min u                              least utilisation; its duals are the prices
`unique`        min u + `TIE_WEIGHT` · mean (tension / maximum)²   least use, made unique
`less_tension`  min u + w Σ (tension / maximum)²  trades utilisation for tension: `tension_trade`
`curved`        min u + ½ ‖R (z − z₀)‖²            with the curvature of floating hands
`tie_break`     min Σ (tension / maximum)²         among plans of least utilisation
`effort`        min Σ ‖E z + e₀‖²                  relative tensions and torques, under a cap
`reach`         max c·t with W + B t for W         farthest body wrench, under a cap
`load_factor`   max s with s W in place of W       at utilisation 1
`nearest`       min ‖S (W − Σ …)‖                  hard rows alone, loads up to `load_box`
`elastic`       min u + ρ (‖W − Σ …‖₁ + 1ᵀv)       hard rows exceeded by v
==============  =============================================================================

Everything is nondimensional: z are the loads y over `LOAD_UNIT` (a floating wrist's twist over
`TWIST_UNIT`), body wrenches are over `WRENCH_UNIT`, limit rows over their capacities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.hand import FINGERS
from planner.programs.conic import Columns, ConicProgram, Outcome, Reached
from planner.programs.scaled_rows import load_box
from planner.programs.stance_data import StanceData
from planner.programs.stance_program import (
    REFINED_SETTINGS,
    SHARP_SETTINGS,
    Definition,
    StanceProgram,
)

__all__ = ["TIE_WEIGHT", "Best", "Elastic", "Nearest", "Reach", "tie_weight"]

TIE_WEIGHT: Final = 8e-6
"""Weight of the mean square of relative tensions, beside the utilisation, in `unique`."""


class Residuals(NamedTuple):
    """Term k ‖R z − c‖² of an objective, in the scaled loads z of all hands, shape (M,)."""

    R: Array
    c: Array
    k: float


class Best(StanceProgram):
    """Program min u + Σ w z² + k ‖R z − c‖²: least utilisation, or least squares under a cap.

    Here z, shape (M,), are the scaled loads of all hands, and u is the utilisation.

    Parameters
    ----------
    data : StanceData
        Balance, limits and hard rows of all hands.
    cap : float, optional
        Fixed largest utilisation; u is then no variable, and not in the objective.
    weights : ndarray, shape (M,), optional
        Weights w of the squared loads; without weights the term is left out.
    residuals : Residuals, optional
        R, c and k; without residuals the term is left out.
    most : float, optional
        Upper bound of the variable u.
    """

    def __init__(
        self,
        data: StanceData,
        *,
        cap: float | None = None,
        weights: Array | None = None,
        residuals: Residuals | None = None,
        most: float | None = None,
    ) -> None:
        super().__init__(data)
        self.cap, self.weights, self.residuals, self.most = cap, weights, residuals, most
        if cap is None and weights is not None:
            # beside u the second term is small
            self.settings, self.wanted = (SHARP_SETTINGS, REFINED_SETTINGS), 1

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        z, u = self.loads(), cp.Variable() if self.cap is None else None
        rows = self.rows(z, self.cap if u is None else u)
        least, constraints = [] if u is None else [u], [*rows]
        if self.residuals is not None:
            R, c, k = self.residuals
            least.append(k * cp.sum_squares(R @ z - c))
        if self.weights is not None:
            least.append(cp.sum(cp.multiply(self.weights, cp.square(z))))
        if u is not None and self.most is not None:
            constraints.append(u <= self.most)
        variables = (z,) if u is None else (u, z)
        return Definition(cp.Problem(cp.Minimize(sum(least)), constraints), variables, rows)

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form.

        Columns: u, the residuals R z − c, and z, as far as the program has such terms. Rows: the
        equations of the residuals, the rows of the stance, the bound of u.
        """
        free, below = int(self.cap is None), int(self.most is not None)
        R, c, k = self.residuals or Residuals(np.zeros((0, self.size)), np.zeros(0), 0.0)
        size, above = len(c), None if self.residuals is None else R
        front, loads, b = self.blocks(free + size, above=above, below=below)
        front[:size, free:], b[:size] = -np.eye(size), c
        if self.cap is None:
            front[size:][self.of_limits, 0] = -1.0
        else:
            b[size:][self.of_limits] += self.cap
        if self.most is not None:
            front[-1, 0], b[-1] = 1.0, self.most
        P, q = np.zeros((2, free + size + self.size))
        P[free : free + size], q[:free] = 2.0 * k, 1.0
        if self.weights is not None:
            P[free + size :] = 2.0 * self.weights
        A = (Columns.of(front), loads) if free + size else (loads,)
        return ConicProgram(P, q, A, b, size + len(self.G), size)

    def solve(self) -> Outcome:
        """Solve the program; ``value`` is u, or with a cap or residuals the objective."""
        outcome, u = self.run()
        return outcome if u is None or not self.wanted else replace(outcome, value=float(u[0]))

    def vertex(self) -> Outcome:
        """Solve the program by the simplex method, which returns a vertex of the feasible set.

        Only for linear programs (no weights, no residuals). At a vertex each load has all its
        digits; an interior point has as many digits of every load as of the largest load.
        """
        options = {
            "method": "highs-ds",
            "primal_feasibility_tolerance": 1e-10,
            "dual_feasibility_tolerance": 1e-10,
        }
        return self.by_definition({"solver": "SCIPY", "scipy_options": options})[0]


def tie_weight(hands: int) -> float:
    """Return the weight of a squared relative tension in `unique`.

    Parameters
    ----------
    hands : int
        Number of hands of the stance.
    """
    return TIE_WEIGHT / (len(FINGERS) * hands)


class Reach(StanceProgram):
    """Program max c·t: farthest balance along the columns of B, within a cap on the utilisation.

    The balance is G z = offset + B t. The limit rows may depend on t, too, as those of joints
    depend on the body's acceleration: L z + l0 + K t ≤ cap.

    Parameters
    ----------
    data : StanceData
        Balance, limits and hard rows of all hands.
    goal : ndarray, shape (k,)
        Direction c in the space of t.
    B : ndarray, shape (nb, k)
        Directions of the balance's right-hand side, scaled as `StanceData.wrench`.
    cap : float, optional
        Largest utilisation.
    K : sequence of ndarray, shape (nl, k), optional
        Change of each hand's utilisations per unit of t; zero by default.
    forward : bool, optional
        Whether t ≥ 0 is required.
    """

    def __init__(
        self,
        data: StanceData,
        goal: Array,
        B: Array,
        cap: float = 1.0,
        K: Sequence[Array] | None = None,
        *,
        forward: bool = False,
    ) -> None:
        super().__init__(data)
        self.goal, self.B, self.cap = goal, B, cap
        self.K = np.zeros((len(self.L), len(goal))) if K is None else np.vstack(K)
        self.wanted, self.forward, self.unit = len(goal), forward, 1.0

    @classmethod
    def load_factor(cls, data: StanceData) -> Reach:
        """Return the program for the load factor: largest multiple of the body wrench, at cap 1.

        The body wrench of ``data`` must not be zero. ``value`` of the solved outcome is the load
        factor.
        """
        body, held = data.wrench.copy(), data.wrench.copy()
        body[6:], held[:6] = 0.0, 0.0
        # of unit size, or a small wrench and its large factor would defeat the solver
        unit = float(np.abs(body).max())
        found = cls(data.turned(held), np.ones(1), (body / unit)[:, None], forward=True)
        found.unit = unit
        return found

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        t, z = cp.Variable(len(self.goal)), self.loads()
        balance = self.G @ z == self.data.offset + self.B @ t
        _, limits, hard = self.rows(z, self.cap - self.K @ t)
        rows = balance, limits, hard
        further = [t >= 0.0] if self.forward else []
        return Definition(cp.Problem(cp.Maximize(self.goal @ t), [*rows, *further]), (t, z), rows)

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form: columns t and z."""
        ways = len(self.goal)
        t, loads, b = self.blocks(ways, below=ways if self.forward else 0)
        t[: len(self.G)], t[self.of_limits] = -self.B, self.K
        if self.forward:
            t[-ways:] = -np.eye(ways)
        b[self.of_limits] += self.cap
        P, q = np.zeros((2, ways + self.size))
        q[:ways] = -self.goal
        return ConicProgram(P, q, (Columns.of(t), loads), b, len(self.G))

    def farthest(self) -> Reached:
        """Solve the program; return the outcome and the optimal t, shape (k,), NaN if unsolved."""
        outcome, t = self.run()
        if t is None:
            return Reached(outcome, np.full(self.wanted, np.nan))
        return Reached(replace(outcome, value=float(self.goal @ t) / self.unit), t)

    def solve(self) -> Outcome:
        """Solve the program; ``value`` is c·t, or of a `load_factor` program the load factor."""
        return self.farthest().outcome


class Nearest(StanceProgram):
    """Program min ‖W − w‖ over the body wrenches w that hands can give with loads up to `load_box`.

    Only hard rows count, no limits. ``value`` of the solved outcome is the distance, in
    `WRENCH_UNIT`.

    Parameters
    ----------
    data : StanceData
        Balance and hard rows of all hands.
    kept : int, optional
        Number of last rows of the balance (prescribed components of hands' wrenches) that must be
        met exactly. The misfit of the other rows is minimised with that of the body wrench.
    """

    def __init__(self, data: StanceData, kept: int = 0) -> None:
        super().__init__(data)
        self.kept, self.box = kept, load_box(data.wrench)
        self.L, self.l0 = self.L[:0], self.l0[:0]

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        missing, z = cp.Variable(len(self.G)), self.loads()
        balance = self.G @ z + missing == self.data.offset
        _, limits, hard = self.rows(z, 0.0)
        box = [z <= self.box, -z <= self.box]
        kept = [missing[len(self.G) - self.kept :] == 0.0] if self.kept else []
        problem = cp.Problem(cp.Minimize(cp.norm(missing)), [balance, *kept, hard, *box])
        return Definition(problem, (z,), (balance, limits, hard))

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form: columns ‖W − w‖, W − w and z."""
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
        b[:count], b[zero:box], b[box:cone] = self.data.offset, self.h, self.box
        P, q = np.zeros((2, A.shape[1]))
        q[0] = 1.0
        return ConicProgram(P, q, (Columns.of(A),), b, zero, second_order=1 + count)


class Elastic(StanceProgram):
    """Program min u + ρ (‖W − w‖₁ + 1ᵀv) + ½ ε ‖z − z₀‖²: rows may be exceeded at a price ρ.

    W is the body wrench asked for, w the one that the loads z give, u the utilisation. Hard rows
    may be exceeded by slacks v ≥ 0, except the firm rows. The program has a solution wherever the
    firm rows have one. ``value`` of the outcome is the sum of the first two terms.

    Parameters
    ----------
    data : StanceData
        Balance, limits and hard rows of all hands.
    penalty : float
        Price ρ of violations.
    near : ndarray, shape (M,)
        Scaled loads z₀ near which the solution is kept.
    firm : ndarray of bool, shape (Σ nh,)
        True for each hard row that must not be exceeded.
    nearness : float, optional
        Weight ε, which makes the solution unique.
    """

    def __init__(
        self,
        data: StanceData,
        penalty: float,
        near: Array,
        firm: NDArray[np.bool_],
        nearness: float = 1e-3,
    ) -> None:
        super().__init__(data)
        self.penalty, self.near, self.nearness = penalty, near, nearness
        self.gives = np.eye(len(firm))[:, ~firm]
        self.wanted = 1 + 2 * len(self.G) + self.gives.shape[1]

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        z, u, v = self.loads(), cp.Variable(), cp.Variable(self.gives.shape[1])
        lacks, exceeds = cp.Variable(len(self.G)), cp.Variable(len(self.G))
        balance = self.G @ z + lacks - exceeds == self.data.offset
        limits, hard = self.L @ z + self.l0 <= u, self.H @ z <= self.h + self.gives @ v
        wrong = cp.sum(lacks) + cp.sum(exceeds) + cp.sum(v)
        # ½ ε ‖z − z₀‖², but for its constant
        near = (
            cp.sum(cp.multiply(0.5 * self.nearness, cp.square(z))) - self.nearness * self.near @ z
        )
        problem = cp.Problem(
            cp.Minimize(u + self.penalty * wrong + near),
            [balance, limits, hard, lacks >= 0.0, exceeds >= 0.0, v >= 0.0],
        )
        return Definition(problem, (u, lacks, exceeds, v, z), (balance, limits, hard))

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form.

        Columns: u, missing wrench, excess wrench, slacks v, and z.
        """
        count, wanted = len(self.G), self.wanted
        front, loads, b = self.blocks(wanted, below=wanted - 1)
        front[:count, 1 : 1 + count] = np.eye(count)
        front[:count, 1 + count : 1 + 2 * count] = -np.eye(count)
        front[self.of_limits, 0] = -1.0
        front[self.of_limits.stop : len(b) - wanted + 1, 1 + 2 * count :] = -self.gives
        front[len(b) - wanted + 1 :, 1:] = -np.eye(wanted - 1)
        P, q = np.zeros((2, wanted + self.size))
        P[wanted:], q[wanted:] = self.nearness, -self.nearness * self.near
        q[0], q[1:wanted] = 1.0, self.penalty
        return ConicProgram(P, q, (Columns.of(front), loads), b, count)

    def solve(self) -> Outcome:
        """Solve the program; ``value`` is the utilisation plus ρ times all violations."""
        outcome, found = self.run()
        if found is None:
            return outcome
        return replace(outcome, value=float(found[0] + self.penalty * found[1:].sum()))
