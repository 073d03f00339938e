"""One program over samples of the hands: tensions that serve all of them, with a little feedback.

With the tensions f of a plan, hands of sample k use at least

    V_k(f) = min over z_k, u_k of  u_k + p ‖T_k z_k − f‖²

within their balance, limits at u_k and hard rows: T_k z_k are the tensions in the sample, which
feedback changes from f at the price p. V_k is convex and smooth (the Moreau envelope of the
sample's least utilisation as a function of its tensions), with the gradient −2 p (T_k z_k − f).
`Robust` minimises the mean of V_k within the limits of the question's own hands.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy

from hand_models.base import Array, Indices
from hand_models.parameters import bundled_table
from planner.programs.conic import Columns, ConicProgram
from planner.programs.program import Best, Residuals, tie_weight
from planner.programs.scaled_rows import LOAD_UNIT
from planner.programs.stance_data import StanceData
from planner.programs.stance_program import (
    REFINED_SETTINGS,
    SHARP_SETTINGS,
    Definition,
    StanceProgram,
)

if TYPE_CHECKING:
    import cvxpy as cp

__all__ = ["Robust", "SampleData", "feedback_price", "sample_value"]


def feedback_price() -> float:
    """Return the price p of a squared change of a scaled tension by feedback."""
    table = bundled_table("plans.toml", "planner.parameters")
    return table.positive("robust", "feedback_price") * LOAD_UNIT**2


class SampleData(NamedTuple):
    """Scaled rows of a stance, and which of its scaled loads are tensions.

    Attributes
    ----------
    data : StanceData
    tensions : ndarray of int, shape (F,)
        Places of the tensions of all hands among the loads z; F fingers in the order of the hands.
    """

    data: StanceData
    tensions: Indices


def sample_value(sample: SampleData, tensions: Array, price: float) -> tuple[float, Array]:
    """Return V_k(f) and its gradient.

    Parameters
    ----------
    sample : SampleData
    tensions : ndarray, shape (F,)
        f, scaled.
    price : float
        p, of a squared change of a scaled tension.

    Returns
    -------
    value : float
        Infinite if the sample has no balance at any tensions.
    slopes : ndarray, shape (F,)
        Gradient in the scaled tensions.
    """
    data, at = sample
    residuals = Residuals(np.eye(len(data.rows.unit))[at], tensions, price)
    program = Best(data, residuals=residuals)
    # the gradient is a small difference at a high price
    program.settings = (SHARP_SETTINGS, REFINED_SETTINGS)
    found = program.solve()
    if not found.solved:
        return np.inf, np.zeros(len(at))
    z = np.concatenate(found.loads) / data.rows.unit
    return found.value, -2.0 * price * (z[at] - tensions)


class Robust(StanceProgram):
    """min mean V_k(T z) + Σ w z² within the limits of the question's own hands, at a cap.

    The last term makes the plan unique, like that of `unique`.

    Parameters
    ----------
    own : SampleData
        The question's own hands.
    samples : sequence of SampleData
    price : float
        p, of a squared change of a scaled tension.
    cap : float
        Largest utilisation of the own hands.
    """

    # at a high price of feedback, multipliers of 1e-9 prove little
    settings = (
        {**SHARP_SETTINGS, "tol_feas": 1e-11},
        {**REFINED_SETTINGS, "equilibrate_enable": True},
    )
    reused = False  # a solver takes some 10 MB

    def __init__(
        self, own: SampleData, samples: Sequence[SampleData], price: float, cap: float
    ) -> None:
        super().__init__(own.data)
        self.own, self.samples, self.price, self.cap = own, samples, price, cap
        self.weights = tie_weight(len(own.data.hands)) * own.data.rows.tie

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        z, n = self.loads(), len(self.samples)
        rows = self.rows(z, self.cap)
        f, constraints = z[self.own.tensions], [*rows]
        least: list[cp.Expression] = [cp.sum(cp.multiply(self.weights, cp.square(z)))]
        for data, at in self.samples:
            sample, u = Best(data), cp.Variable()
            z_k = sample.loads()
            constraints += sample.rows(z_k, u)
            least.append((u + self.price * cp.sum_squares(z_k[at] - f)) / n)
        return Definition(cp.Problem(cp.Minimize(sum(least)), constraints), (z,), rows)

    def conic(self) -> ConicProgram:
        """Return the program in the solver's form.

        Columns: of each sample u_k, the changes of its tensions T_k z_k − f and its other loads;
        then z. Rows: the samples' balances, the rows of the own hands, the samples' other rows.
        """
        sparse, n = scipy.sparse, len(self.samples)
        equal, below, fronts = [], [], []
        P, q, b_equal, b_below = [], [], [], []
        place = np.zeros((len(self.own.tensions), self.size))
        place[np.arange(len(place)), self.own.tensions] = 1.0
        for data, at in self.samples:
            rows, balance = data.rows, len(data.wrench)
            free = np.setdiff1d(np.arange(len(rows.unit)), at)
            own = np.zeros((len(rows.whole), 1 + len(rows.unit)))
            own[balance : balance + rows.limits, 0] = -1.0
            own[:, 1:] = rows.whole[:, np.append(at, free)]
            fronts.append((own[:balance], own[balance:]))
            tied = rows.whole[:, at] @ place
            equal.append(tied[:balance])
            below.append(tied[balance:])
            b_equal.append(data.offset)
            b_below.append(rows.rest)
            P.append(np.repeat([0.0, 2.0 * self.price / n, 0.0], [1, len(at), len(free)]))
            q.append(np.append(1.0 / n, np.zeros(len(at) + len(free))))
        rows = self.data.rows
        middle = sparse.csc_array((len(rows.whole), sum(map(len, q))))
        front = sparse.vstack(
            [
                sparse.block_diag([part for part, _ in fronts]),
                middle,
                sparse.block_diag([part for _, part in fronts]),
            ],
            format="csc",
        )
        front.eliminate_zeros()
        b = np.concatenate([self.data.offset, rows.rest])
        b[self.of_limits] += self.cap
        above = sum(map(len, b_equal))
        A = (
            Columns(front.data, front.indices.astype(np.intp), front.indptr.astype(np.intp)),
            Columns.of(np.vstack([*equal, rows.whole, *below])),
        )
        return ConicProgram(
            np.concatenate([*P, 2.0 * self.weights]),
            np.concatenate([*q, np.zeros(self.size)]),
            A,
            np.concatenate([*b_equal, b, *b_below]),
            above + len(self.G),
            above,
        )
