"""The constraints of a stance: all hands' hard rows, by name, and wrenches that hands are given.

Limit rows at a cap on the utilisation are constraints like any other. All rows of one name are one
constraint. Whether some of them leave loads that balance the body is a linear program,

    min t  with  |W − Σ g − G z| ≤ t,  H z − h ≤ t,  |z| ≤ X,

whose multipliers d, λ are a proof (Farkas) where t is above zero. The box X of `LOAD_BOX`, far
beyond any strength, always counts.

These multipliers are a linear program of as many equations as loads, however many rows, and it is
kept from one question to the next: with r = W − Σ g there are no loads where they gain something
(what is left of Gᵀd − Hᵀλ is for the box to pay):

    d · r − λ · h − X Σ|Gᵀd − Hᵀλ| > 0.

A row is left out by keeping its multiplier at zero, and the simplex method goes on from where the
last question ended.
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
"""Name of the constraint that a given wrench of a hand is."""

BODY_ROWS: Final = 6
"""Rows of the balance that are the body's."""


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

    def least_violation(self, tied: Chosen, rows: Chosen) -> Multipliers | None:
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
        box = np.full(2 * self.G.shape[1], LOAD_BOX)
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
    """The hard rows of all hands, with their names, and the balance; nondimensional.

    Parameters
    ----------
    G, g : ndarray, shapes (nb, M), (nb,)
        What all loads z give the balance, G z + g.
    wrench : ndarray, shape (nb,)
        What they are to give.
    H, h : ndarray, shapes (n, M), (n,)
        H z ≤ h
    names : tuple of LimitName, length n
    given : tuple of LimitName, length nb − 6
        Whose given wrench each further row of the balance is.

    Attributes
    ----------
    goal : ndarray, shape (nb,)
        What G z is to be.
    constraints : tuple of LimitName
        Every name once.
    owners : ndarray of int, shape (n + nb − 6,)
        Which constraint each hard row is, and then each further row of the balance.
    program : FarkasProgram
        What finds multipliers that prove.
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
    ) -> None:
        self.G, self.g, self.wrench, self.H, self.h = G, g, wrench, H, h
        self.goal = np.asarray(wrench - g)
        self.names, self.given = names, given
        whose = (*names, *given)
        self.constraints = tuple(dict.fromkeys(whose))
        self._places = {name: i for i, name in enumerate(self.constraints)}
        self.owners = np.array([self._places[name] for name in whose], dtype=np.intp)
        self.program = FarkasProgram(G, self.goal, H, h)

    def rows_of(
        self, constraints: Iterable[LimitName], *, balance: bool = True
    ) -> tuple[Chosen, Chosen]:
        """Return which rows of the balance (nb,) and which hard rows (n,) constraints are.

        The body's own six are among them if its balance counts.
        """
        chosen = np.zeros(len(self._places), dtype=bool)
        chosen[[self._places[name] for name in constraints if name in self._places]] = True
        rows = chosen[self.owners]
        return np.append(np.full(BODY_ROWS, balance), rows[len(self.h) :]), rows[: len(self.h)]

    def bound(self, direction: Array, multipliers: Array) -> float:
        """Return what d · (G z + g) is at most, for loads in the box |z| ≤ X of `LOAD_BOX`.

        By hand: with H z ≤ h and λ ≥ 0

            d · (G z + g) = d · g + (Gᵀd − Hᵀλ) · z + λ · H z ≤ d · g + |Gᵀd − Hᵀλ| · X + λ · h.
        """
        leak = np.abs(self.G.T @ direction - self.H.T @ multipliers).sum() * LOAD_BOX
        return float(direction @ self.g + multipliers @ self.h + leak)

    def proves(self, direction: Array, multipliers: Array) -> bool:
        """Return whether the multipliers show that no loads balance."""
        return self.bound(direction, multipliers) < float(direction @ self.wrench)

    def proven_up_to(self, direction: Array, multipliers: Array) -> float:
        """Return the size of loads |z| up to which the multipliers show that none balance.

        d · (W − g) − λ · h, by which they prove it, is used up there by Gᵀd − Hᵀλ, which rounding
        leaves, or the box X: infinite where nothing is left of it.
        """
        gain = float(direction @ self.goal - multipliers @ self.h)
        leak = float(np.abs(self.G.T @ direction - self.H.T @ multipliers).sum())
        return gain / leak if leak > 0.0 else math.inf

    def weights(self, direction: Array, multipliers: Array) -> dict[LimitName, float]:
        """Return the weights of constraints by their multipliers, those that count alone."""
        shares = np.append(multipliers, np.abs(direction[BODY_ROWS:]))
        weights = np.bincount(self.owners, shares, len(self.constraints)).tolist()
        pairs = zip(self.constraints, weights, strict=True)
        return {name: weight for name, weight in pairs if weight > TOLERANCES.weighing_multiplier}

    def least_violation(
        self, constraints: Iterable[LimitName], *, balance: bool = True
    ) -> Multipliers | None:
        """Return by how much constraints must be broken at least, by loads in the box.

        Parameters
        ----------
        constraints : iterable of LimitName
        balance : bool
            Whether the body's balance counts, too.

        Returns
        -------
        Multipliers or None
            Their gain is that; None if the solver does not say, or the time is over.
        """
        return self.program.least_violation(*self.rows_of(constraints, balance=balance))

    def least_violation_without(self, constraints: Iterable[LimitName]) -> Multipliers | None:
        """Return by how much all constraints but some, and the balance, must be broken at least.

        Parameters and what is returned as for `least_violation`.
        """
        tied, rows = self.rows_of(constraints, balance=False)
        return self.program.least_violation(~tied, ~rows)


def summed(names: Sequence[LimitName], weights: Sequence[float]) -> dict[LimitName, float]:
    """Return the sum of the weights of each name."""
    found: dict[LimitName, float] = {}
    for name, weight in zip(names, weights, strict=True):
        found[name] = found.get(name, 0.0) + weight
    return found


def ranked(weights: dict[LimitName, float]) -> list[LimitName]:
    """Return constraints, the weightiest first."""
    return sorted(weights, key=lambda name: -round(weights[name], TOLERANCES.ranking_digits))
