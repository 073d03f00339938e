"""Multipliers that prove, as one linear program that is kept from one question to the next.

Hard rows H z ≤ h and a balance G z = r have no loads z in the box |z| ≤ X where multipliers d and
λ ≥ 0 gain something (Farkas; what is left of Gᵀd − Hᵀλ is for the box to pay):

    d · r − λ · h − X Σ|Gᵀd − Hᵀλ| > 0.

There are as many equations as loads, however many rows. A row is left out by keeping its multiplier
at zero, and the simplex method goes on from where the last question ended.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from hand_models.base import Array
from planner import deadline
from planner.programs import UNLIMITED, SilentHighs

__all__ = ["FarkasProgram", "Multipliers"]

Mask = npt.NDArray[np.bool_]

EXACT: Final = 1e-10
"""Tolerance of the linear programs."""

OPTIONS: Final[dict[str, float | str]] = {
    "presolve": "off",
    "parallel": "off",
    "solver": "simplex",
    "simplex_scale_strategy": 0,
    "primal_feasibility_tolerance": EXACT,
    "dual_feasibility_tolerance": EXACT,
}
"""Of HiGHS. To presolve would be to forget where it was; the rows have their physical scaling."""


class Multipliers(NamedTuple):
    """A vertex of the multipliers that are allowed.

    Attributes
    ----------
    gain : float
        What they gain, in the unit asked for.
    direction, multipliers : ndarray, shapes (nb,), (n,)
        d of the balance and λ ≥ 0 of the rows.
    """

    gain: float
    direction: Array
    multipliers: Array


class FarkasProgram:
    """The program of a balance and rows. For one caller at a time.

    Columns are d⁺ and d⁻ (nb each), which are taken from a start of d, λ (n), and the two signs of
    the parts of Gᵀd − Hᵀλ (M each). Rows are these parts (M), and below them the sum of d⁺, d⁻, λ.

    Parameters
    ----------
    G, goal : ndarray, shapes (nb, M), (nb,)
        The balance, with r.
    H, h : ndarray, shapes (n, M), (n,)
    """

    def __init__(self, G: Array, goal: Array, H: Array, h: Array) -> None:
        self.G, self.goal, self.h = G, goal, h
        leak = np.eye(G.shape[1])
        parts = np.hstack([G.T, -G.T, -H.T, -leak, leak])
        counts = np.arange(parts.shape[1]) < parts.shape[1] - 2 * len(leak)
        self._solver = _solver_of(np.vstack([parts, counts]))
        self._costs, self._most = np.zeros(len(counts)), np.full(counts.sum(), np.inf)
        self._parts = np.zeros(len(leak))

    def least_violation(self, tied: Mask, rows: Mask) -> Multipliers | None:
        """Return multipliers Σ|d| + Σλ ≤ 1, of some rows alone, that gain the most.

        The gain is by how much these must be broken at least: the least t of loads in the box with
        |r − G z| ≤ t and H z − h ≤ t.

        Parameters
        ----------
        tied, rows : ndarray of bool, shapes (nb,), (n,)
            Which of the balance, and which hard rows.

        Returns
        -------
        Multipliers or None
            None if the solver does not say, or the time is over.
        """
        costs = self._priced(self.goal, -self.goal)
        most = np.where(np.concatenate([tied, tied, rows]), np.inf, 0.0)
        return self._solved(costs, most, np.zeros(len(tied)), 1.0)

    def near(self, start: Array, turn: float, unit: float) -> Multipliers | None:
        """Return multipliers that gain the most, less ``turn`` Σ|d − start|, with |d| ≤ 1.

        Parameters
        ----------
        start : ndarray, shape (k,)
            Of the first k of d. The others are free, of any size.
        turn : float
        unit : float
            Of the gain.

        Returns
        -------
        Multipliers or None
            None if the solver does not say, or the time is over.
        """
        bound, free = len(start), len(self.goal) - len(start)
        away = np.concatenate([np.full(bound, turn), np.zeros(free)])
        more, less = (np.append(1.0 + way * start, np.full(free, np.inf)) for way in (-1.0, 1.0))
        return self._solved(
            self._priced(self.goal - away, -self.goal - away) / unit,
            np.concatenate([more, less, np.full(len(self.h), np.inf)]),
            np.append(start, np.zeros(free)),
            math.inf,
        )

    def _priced(self, more: Array, less: Array) -> Array:
        """Return the columns' costs; what d⁺ and d⁻ gain is given."""
        box = np.full(2 * self.G.shape[1], UNLIMITED)
        return np.concatenate([-more, -less, self.h, box])

    def _solved(self, costs: Array, most: Array, start: Array, total: float) -> Multipliers | None:
        """Solve the program of some costs, bounds of d⁺, d⁻, λ from above, start of d and sum."""
        left = deadline.left()
        if left == 0.0:
            return None
        solver, (nb, size) = self._solver, self.G.shape
        self._change(costs, most, -self.G.T @ start)
        solver.changeRowBounds(size, -math.inf, total)
        until = math.inf if left is None else solver.getRunTime() + left
        solver.setOptionValue("time_limit", until)
        if not solver.optimal():
            # where it was may have been a bad place to begin
            solver.clearSolver()
            if deadline.expired() or not solver.optimal():
                return None
        x = np.array(solver.getSolution().col_value)
        direction = start + x[:nb] - x[nb : 2 * nb]
        gain = float(start @ self.goal) - solver.getObjectiveValue()
        return Multipliers(gain, direction, np.maximum(x[2 * nb : 2 * nb + len(self.h)], 0.0))

    def _change(self, costs: Array, most: Array, parts: Array) -> None:
        """Tell the solver what is different of costs, bounds from above, and right-hand sides."""
        solver = self._solver
        places = (costs != self._costs).nonzero()[0].astype(np.int32)
        if len(places):
            solver.changeColsCost(len(places), places, costs[places])
        places = (most != self._most).nonzero()[0].astype(np.int32)
        if len(places):
            solver.changeColsBounds(len(places), places, np.zeros(len(places)), most[places])
        for i in (parts != self._parts).nonzero()[0].tolist():
            solver.changeRowBounds(i, parts[i], parts[i])
        self._costs, self._most, self._parts = costs, most, parts


def _solver_of(A: Array) -> SilentHighs:
    """Return a solver of programs with rows A, all of whose columns are above zero."""
    solver, zeros = SilentHighs(OPTIONS), np.zeros(max(A.shape))
    rows, columns = zeros[: len(A)], zeros[: A.shape[1]]
    solver.load(A, (columns, np.full(A.shape[1], np.inf)), (rows, rows))
    return solver
