"""Search for Farkas certificates: multipliers that prove that no loads balance the body.

The constraints are the hands' hard rows, and the wrenches that a question prescribes for hands.
Limit rows at a cap on the utilisation are hard rows like any other. All rows of one name are one
constraint. With the loads z, some constraints are infeasible if the linear program

    min t  with  |W − Σ g − G z| ≤ t,  H z − h ≤ t,  |z| ≤ X

has t > 0; its multipliers d (balance) and λ (hard rows) are the certificate. W is the body wrench,
Σ g the wrench at zero loads. The box X of `load_box`, far above any strength, always applies.

The dual linear program has as many equations as there are loads, whatever the number of rows. Its
solver is kept from one question to the next. With r = W − Σ g, infeasibility is proven where

    d · r − λ · h − X Σ|Gᵀd − Hᵀλ| > 0.

A row is left out by fixing its multiplier at zero; the simplex method then starts from the basis of
the last question.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from planner import deadline
from planner.explanation.active_limits import TOLERANCES
from planner.programs import LOAD_BOX, SilentHighs
from planner.result import LimitName

__all__ = [
    "BODY_ROWS",
    "HELD_WRENCH",
    "Chosen",
    "FarkasProgram",
    "HardRowSystem",
    "Multipliers",
    "ranked",
    "summed",
]

Chosen = NDArray[np.bool_]

HELD_WRENCH: Final = "held_wrench"
"""Name of the constraint that a hand exerts the wrench prescribed for it."""

BODY_ROWS: Final = 6
"""Number of balance rows of the body; rows of prescribed hand wrenches follow them."""


class Multipliers(NamedTuple):
    """Optimal multipliers of `FarkasProgram`, nondimensional.

    Attributes
    ----------
    gain : float
        Smallest violation of the constraints; above zero, they are infeasible. Only as
        `FarkasProgram.least_violation` returns it, not `FarkasProgram.near`.
    direction : ndarray, shape (nb,)
        Multipliers d of the balance rows: six of the body, then those of prescribed hand wrenches.
    multipliers : ndarray, shape (n,)
        Multipliers λ ≥ 0 of the hard rows.
    """

    gain: float
    direction: Array
    multipliers: Array


class FarkasProgram:
    """Linear program whose solution is a Farkas certificate; not thread-safe.

    Columns are d⁺ and d⁻ (nb each; d is a start plus d⁺ − d⁻), λ (n), and the positive and negative
    parts of Gᵀd − Hᵀλ (M each). Rows define these parts (M); the last row sums d⁺, d⁻, λ. X is
    the largest size of a load.

    Parameters
    ----------
    G : ndarray, shape (nb, M)
        Balance matrix; M loads z of all hands, nb balance rows. All arrays are nondimensional.
    goal : ndarray, shape (nb,)
        Right-hand side r of the balance G z = r.
    H, h : ndarray, shapes (n, M), (n,)
        Hard rows H z ≤ h.
    box : float, optional
        Largest size X of a load.
    """

    def __init__(self, G: Array, goal: Array, H: Array, h: Array, box: float = LOAD_BOX) -> None:
        self.G, self.goal, self.h, self.box = G, goal, h, box
        leak = np.eye(G.shape[1])
        parts = np.hstack([G.T, -G.T, -H.T, -leak, leak])
        counts = np.arange(parts.shape[1]) < parts.shape[1] - 2 * len(leak)
        self._solver = _solver_of(np.vstack([parts, counts]))
        self._costs, self._most = np.zeros(len(counts)), np.full(counts.sum(), np.inf)
        self._parts = np.zeros(len(leak))

    def least_violation(self, tied: Chosen, rows: Chosen) -> Multipliers | None:
        """Return the smallest violation of selected rows, with the multipliers that prove it.

        Maximises d · r − λ · h − X Σ|Gᵀd − Hᵀλ| with Σ|d| + Σλ ≤ 1. By duality its value is the
        least t for which loads in the box have |r − G z| ≤ t and H z − h ≤ t.

        Parameters
        ----------
        tied : ndarray of bool, shape (nb,)
            Balance rows that take part.
        rows : ndarray of bool, shape (n,)
            Hard rows that take part.

        Returns
        -------
        Multipliers or None
            ``gain`` is the violation t. None if the solver fails or the deadline has expired.
        """
        costs = self._priced(self.goal, -self.goal)
        most = np.where(np.concatenate([tied, tied, rows]), np.inf, 0.0)
        return self._solved(costs, most, np.zeros(len(tied)), 1.0)

    def near(self, start: Array, turn: float, unit: float) -> Multipliers | None:
        """Return the multipliers that prove most, less a penalty for leaving ``start``.

        Maximises (d · r − λ · h − X Σ|Gᵀd − Hᵀλ| − ``turn`` Σ|d − start|) / ``unit``, where the
        first k components of d are within ±1.

        Parameters
        ----------
        start : ndarray, shape (k,)
            Preferred values of the first k components of d. The other components are unbounded.
        turn : float
            Penalty for a change of these components by 1.
        unit : float
            Divisor of the objective, for the solver's scaling.

        Returns
        -------
        Multipliers or None
            None if the solver fails or the deadline has expired.
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
        box = np.full(2 * self.G.shape[1], self.box)
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
        """Pass the costs, bounds from above and right-hand sides that differ to the solver."""
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
    options: dict[str, float | str] = {
        "presolve": "off",  # would lose the basis
        "parallel": "off",
        "solver": "simplex",
        "simplex_scale_strategy": 0,  # rows have their physical scaling
        "primal_feasibility_tolerance": 1e-10,
        "dual_feasibility_tolerance": 1e-10,
    }
    solver, zeros = SilentHighs(options), np.zeros(max(A.shape))
    rows, columns = zeros[: len(A)], zeros[: A.shape[1]]
    solver.load(A, (columns, np.full(A.shape[1], np.inf)), (rows, rows))
    return solver


class HardRowSystem:
    """Named constraints of a stance: balance and hard rows of all hands; nondimensional.

    Parameters
    ----------
    G : ndarray, shape (nb, M)
        Balance matrix: the M loads z of all hands exert G z + g.
    g : ndarray, shape (nb,)
        Wrench at zero loads.
    wrench : ndarray, shape (nb,)
        Wrench W that G z + g must equal: six components of the body, then prescribed components of
        hand wrenches.
    H, h : ndarray, shapes (n, M), (n,)
        Hard rows H z ≤ h.
    names : sequence of LimitName, length n
        Constraint that each hard row belongs to.
    given : sequence of LimitName, length nb − 6
        Constraint that each balance row after the sixth belongs to.
    box : float, optional
        Largest size X of a load.

    Attributes
    ----------
    goal : ndarray, shape (nb,)
        Right-hand side W − g of the balance G z = W − g.
    constraints : tuple of LimitName
        All constraints, each once.
    owners : ndarray of int, shape (n + nb − 6,)
        Index into ``constraints`` of each hard row, then of each balance row after the sixth.
    program : FarkasProgram
        Linear program that searches for certificates.
    """

    def __init__(
        self,
        G: Array,
        g: Array,
        wrench: Array,
        H: Array,
        h: Array,
        names: Sequence[LimitName],
        given: Sequence[LimitName],
        box: float = LOAD_BOX,
    ) -> None:
        self.G, self.g, self.wrench, self.H, self.h, self.box = G, g, wrench, H, h, box
        self.goal = np.asarray(wrench - g)
        self.names, self.given = names, given
        whose = (*names, *given)
        self.constraints = tuple(dict.fromkeys(whose))
        self._places = {name: i for i, name in enumerate(self.constraints)}
        self.owners = np.array([self._places[name] for name in whose], dtype=np.intp)
        self.program = FarkasProgram(G, self.goal, H, h, box)

    def rows_of(
        self, constraints: Iterable[LimitName], *, balance: bool = True
    ) -> tuple[Chosen, Chosen]:
        """Return masks of the rows that belong to some constraints.

        Parameters
        ----------
        constraints : iterable of LimitName
            Names that the system does not have are ignored.
        balance : bool, optional
            Whether the six balance rows of the body are selected.

        Returns
        -------
        tied : ndarray of bool, shape (nb,)
            Selected balance rows.
        rows : ndarray of bool, shape (n,)
            Selected hard rows.
        """
        chosen = np.zeros(len(self._places), dtype=bool)
        chosen[[self._places[name] for name in constraints if name in self._places]] = True
        rows = chosen[self.owners]
        return np.append(np.full(BODY_ROWS, balance), rows[len(self.h) :]), rows[: len(self.h)]

    def bound(self, direction: Array, multipliers: Array) -> float:
        """Return an upper bound on d · (G z + g) over all loads that keep the hard rows.

        Loads z are in the box |z| ≤ X. With H z ≤ h and λ ≥ 0

            d · (G z + g) = d · g + (Gᵀd − Hᵀλ) · z + λ · H z ≤ d · g + |Gᵀd − Hᵀλ| · X + λ · h.

        Parameters
        ----------
        direction, multipliers : ndarray, shapes (nb,), (n,)
            Multipliers d of the balance rows, and λ ≥ 0 of the hard rows.
        """
        leak = np.abs(self.G.T @ direction - self.H.T @ multipliers).sum() * self.box
        return float(direction @ self.g + multipliers @ self.h + leak)

    def proves(self, direction: Array, multipliers: Array) -> bool:
        """Return whether multipliers are a Farkas certificate: `bound` is below d · W.

        Parameters
        ----------
        direction, multipliers : ndarray, shapes (nb,), (n,)
            Multipliers d of the balance rows, and λ ≥ 0 of the hard rows.
        """
        return self.bound(direction, multipliers) < float(direction @ self.wrench)

    def proven_up_to(self, direction: Array, multipliers: Array) -> float:
        """Return the largest load size |z| for which multipliers prove that no loads balance.

        The gain d · (W − g) − λ · h is consumed by the product of that size and the rounding error
        Σ|Gᵀd − Hᵀλ|. Infinite where that error is zero.

        Parameters
        ----------
        direction, multipliers : ndarray, shapes (nb,), (n,)
            Multipliers d of the balance rows, and λ ≥ 0 of the hard rows.

        Returns
        -------
        float
            Nondimensional; times `LOAD_UNIT` in newtons.
        """
        gain = float(direction @ self.goal - multipliers @ self.h)
        leak = float(np.abs(self.G.T @ direction - self.H.T @ multipliers).sum())
        return gain / leak if leak > 0.0 else math.inf

    def weights(self, direction: Array, multipliers: Array) -> dict[LimitName, float]:
        """Return how much each constraint contributes to a certificate.

        Parameters
        ----------
        direction, multipliers : ndarray, shapes (nb,), (n,)
            Multipliers d of the balance rows, and λ ≥ 0 of the hard rows.

        Returns
        -------
        dict of LimitName to float
            Sum of a constraint's absolute multipliers; constraints with negligible sums are left
            out.
        """
        shares = np.append(multipliers, np.abs(direction[BODY_ROWS:]))
        weights = np.bincount(self.owners, shares, len(self.constraints)).tolist()
        pairs = zip(self.constraints, weights, strict=True)
        return {name: weight for name, weight in pairs if weight > TOLERANCES.weighing_multiplier}

    def least_violation(
        self, constraints: Iterable[LimitName], *, balance: bool = True
    ) -> Multipliers | None:
        """Return the smallest violation of the selected constraints over loads in the box.

        Parameters
        ----------
        constraints : iterable of LimitName
            Names of the selected constraints.
        balance : bool, optional
            Whether the body's balance takes part.

        Returns
        -------
        Multipliers or None
            ``gain`` is the violation; above zero, the constraints are infeasible. None if the
            solver fails or the deadline has expired.
        """
        return self.program.least_violation(*self.rows_of(constraints, balance=balance))

    def least_violation_without(self, constraints: Iterable[LimitName]) -> Multipliers | None:
        """Return the smallest violation of the balance and all constraints but some.

        Parameters
        ----------
        constraints : iterable of LimitName
            Left out.

        Returns
        -------
        Multipliers or None
            ``gain`` is the violation; above zero, the rest is infeasible. None if the solver fails
            or the deadline has expired.
        """
        tied, rows = self.rows_of(constraints, balance=False)
        return self.program.least_violation(~tied, ~rows)


def summed(names: Sequence[LimitName], weights: Sequence[float]) -> dict[LimitName, float]:
    """Return, for each distinct name, the sum of its weights."""
    found: dict[LimitName, float] = {}
    for name, weight in zip(names, weights, strict=True):
        found[name] = found.get(name, 0.0) + weight
    return found


def ranked(weights: dict[LimitName, float]) -> list[LimitName]:
    """Return constraints in order of decreasing weight."""
    return sorted(weights, key=lambda name: -round(weights[name], TOLERANCES.ranking_digits))
