"""The constraints of a stance: all hands' hard rows, by name, and wrenches that hands are given.

Limit rows at a cap on the utilisation are constraints like any other. All rows of one name are one
constraint. Whether some of them leave loads that balance the body is a linear program,

    min t  with  |W − Σ g − G z| ≤ t,  H z − h ≤ t,  |z| ≤ X,

whose multipliers d, λ are a proof (Farkas) where t is above zero. The box X of `UNLIMITED`, far
beyond any strength, always counts.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import OptimizeResult, linprog

from hand_models.base import Array
from planner import deadline
from planner.explanation.active_limits import ALIKE
from planner.programs import UNLIMITED
from planner.result import LimitName

__all__ = [
    "BODY",
    "HELD_WRENCH",
    "WEIGHS",
    "HardRowSystem",
    "Violation",
    "ranked",
    "summed",
    "vertex",
]

Chosen = NDArray[np.bool_]

HELD_WRENCH: Final = "held_wrench"
"""Name of the constraint that a given wrench of a hand is."""

BODY: Final = 6
"""Rows of the balance that are the body's."""

WEIGHS: Final = 1e-6
"""Multipliers below this, of which all add up to about one, do not count."""

EXACT: Final = 1e-10
"""Tolerance of the linear programs."""


class Violation(NamedTuple):
    """By how much constraints and balance must be broken at least, and why.

    Attributes
    ----------
    size : float
        t, in the program's units.
    direction, multipliers : ndarray, shapes (nb,), (n,)
        d of the balance and λ ≥ 0 of the rows, Σ|d| + Σλ = 1 where t is above zero.
    """

    size: float
    direction: Array
    multipliers: Array


@dataclass(frozen=True, eq=False)
class HardRowSystem:
    """The hard rows of all hands, with their names, and the balance; nondimensional.

    Attributes
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
    """

    G: Array
    g: Array
    wrench: Array
    H: Array
    h: Array
    names: tuple[LimitName, ...]
    given: tuple[LimitName, ...]

    @property
    def goal(self) -> Array:
        """What G z is to be, shape (nb,)."""
        return np.asarray(self.wrench - self.g)

    @property
    def constraints(self) -> tuple[LimitName, ...]:
        """Every name once."""
        return tuple(dict.fromkeys((*self.names, *self.given)))

    def rows_of(
        self, constraints: Collection[LimitName], *, balance: bool = True
    ) -> tuple[Chosen, Chosen]:
        """Return which rows of the balance (nb,) and which hard rows (n,) constraints are.

        The body's own six are among them if its balance counts.
        """
        tied = [balance] * BODY + [name in constraints for name in self.given]
        return np.array(tied), np.array([name in constraints for name in self.names], dtype=bool)

    def bound(self, direction: Array, multipliers: Array) -> float:
        """Return what d · (G z + g) is at most, for loads in the box |z| ≤ X of `UNLIMITED`.

        By hand: with H z ≤ h and λ ≥ 0

            d · (G z + g) = d · g + (Gᵀd − Hᵀλ) · z + λ · H z ≤ d · g + |Gᵀd − Hᵀλ| · X + λ · h.
        """
        leak = np.abs(self.G.T @ direction - self.H.T @ multipliers).sum() * UNLIMITED
        return float(direction @ self.g + multipliers @ self.h + leak)

    def proves(self, direction: Array, multipliers: Array) -> bool:
        """Whether the multipliers show that no loads balance."""
        return self.bound(direction, multipliers) < float(direction @ self.wrench)

    def weights(self, direction: Array, multipliers: Array) -> dict[LimitName, float]:
        """Return what multipliers weigh each constraint with, those that count alone."""
        shares = (*multipliers.tolist(), *np.abs(direction[BODY:]).tolist())
        found = summed((*self.names, *self.given), shares)
        return {name: weight for name, weight in found.items() if weight > WEIGHS}

    def least_violation(
        self, constraints: Collection[LimitName], *, balance: bool = True
    ) -> Violation | None:
        """Return by how much constraints must be broken at least, by loads in the box.

        Parameters
        ----------
        constraints : collection of LimitName
        balance : bool
            Whether the body's balance counts, too.

        Returns
        -------
        Violation or None
            None if the solver does not say, or the time is over.
        """
        tied, rows = self.rows_of(frozenset(constraints), balance=balance)
        G, goal, H, h = self.G[tied], self.goal[tied], self.H[rows], self.h[rows]
        size, count = G.shape[1], len(G)
        ends = np.append(np.full(size, UNLIMITED), np.inf)
        result = vertex(
            np.append(np.zeros(size), 1.0),
            (np.append(-ends[:-1], 0.0), ends),
            np.column_stack([np.vstack([G, -G, H]), -np.ones(2 * count + len(h))]),
            np.concatenate([goal, -goal, h]),
        )
        if result is None:
            return None
        shares = np.maximum(-result.ineqlin.marginals, 0.0)
        direction, multipliers = np.zeros(len(self.wrench)), np.zeros(len(self.h))
        direction[tied] = shares[count : 2 * count] - shares[:count]
        multipliers[rows] = shares[2 * count :]
        return Violation(float(result.x[-1]), direction, multipliers)


def summed(names: Sequence[LimitName], weights: Sequence[float]) -> dict[LimitName, float]:
    """Return the sum of the weights of each name."""
    found: dict[LimitName, float] = {}
    for name, weight in zip(names, weights, strict=True):
        found[name] = found.get(name, 0.0) + weight
    return found


def ranked(weights: dict[LimitName, float]) -> list[LimitName]:
    """Return constraints, the weightiest first."""
    return sorted(weights, key=lambda name: -round(weights[name], ALIKE))


def vertex(
    cost: Array,
    bounds: tuple[Array, Array],
    A: Array,
    b: Array,
    E: Array | None = None,
    e: Array | None = None,
) -> OptimizeResult | None:
    """Return a vertex of least cost · x with A x ≤ b, E x = e within bounds.

    None if it is not found, or not in time.
    """
    left = deadline.left()
    if left == 0.0:
        return None
    result = linprog(
        cost,
        A_ub=A,
        b_ub=b,
        A_eq=E,
        b_eq=e,
        bounds=list(zip(*(ends.tolist() for ends in bounds), strict=True)),
        method="highs-ds",
        options={
            "primal_feasibility_tolerance": EXACT,
            "dual_feasibility_tolerance": EXACT,
            "time_limit": math.inf if left is None else left,
        },
    )
    return result if result.status == 0 and result.x is not None else None
