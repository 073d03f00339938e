"""The constraints of a stance: all hands' hard rows, by name, and wrenches that hands are given.

Limit rows at a cap on the utilisation are constraints like any other. All rows of one name are one
constraint. Whether some of them leave loads that balance the body is a linear program,

    min t  with  |W − Σ g − G z| ≤ t,  H z − h ≤ t,  |z| ≤ X,

whose multipliers d, λ are a proof (Farkas) where t is above zero. The box X of `UNLIMITED`, far
beyond any strength, always counts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from planner.explanation.active_limits import ALIKE
from planner.explanation.farkas_program import FarkasProgram, Multipliers
from planner.programs import UNLIMITED
from planner.result import LimitName

__all__ = [
    "BODY",
    "HELD_WRENCH",
    "WEIGHS",
    "Chosen",
    "HardRowSystem",
    "ranked",
    "summed",
]

Chosen = NDArray[np.bool_]

HELD_WRENCH: Final = "held_wrench"
"""Name of the constraint that a given wrench of a hand is."""

BODY: Final = 6
"""Rows of the balance that are the body's."""

WEIGHS: Final = 1e-6
"""Multipliers below this, of which all add up to about one, do not count."""


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
        return np.append(np.full(BODY, balance), rows[len(self.h) :]), rows[: len(self.h)]

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

    def proven_up_to(self, direction: Array, multipliers: Array) -> float:
        """Return the size of loads |z| up to which the multipliers show that none balance.

        d · (W − g) − λ · h, by which they prove it, is used up there by Gᵀd − Hᵀλ, which rounding
        leaves, or the box X: infinite where nothing is left of it.
        """
        gain = float(direction @ self.goal - multipliers @ self.h)
        leak = float(np.abs(self.G.T @ direction - self.H.T @ multipliers).sum())
        return gain / leak if leak > 0.0 else math.inf

    def weights(self, direction: Array, multipliers: Array) -> dict[LimitName, float]:
        """Return what multipliers weigh each constraint with, those that count alone."""
        shares = np.append(multipliers, np.abs(direction[BODY:]))
        weights = np.bincount(self.owners, shares, len(self.constraints)).tolist()
        pairs = zip(self.constraints, weights, strict=True)
        return {name: weight for name, weight in pairs if weight > WEIGHS}

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
    return sorted(weights, key=lambda name: -round(weights[name], ALIKE))
