"""Programs for tensions that are set-points: kept as they are, or changed as little as need be.

A set-point fixes some of the loads y of the hands. The other loads are reactions, which follow
from the balance and the limits. ``held`` has of each hand's loads the value that is fixed [N], and
NaN where a load is free.

==============  =============================================================================
`kept`          min u  with  y_i = f_i for each load i that is held
`least_change`  min Σ (y_i − f_i)² + ε Σ y_j²  over loads i held and j free; no limits
==============  =============================================================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from hand_models.base import Array
from planner.programs.conic import Outcome
from planner.programs.program import Best, Residuals
from planner.programs.scaled_rows import LOAD_UNIT
from planner.programs.stance_data import StanceData, parted
from planner.programs.stance_program import Definition

__all__ = ["SET_POINT_SETTINGS", "Kept", "LeastChange", "kept", "least_change"]


@dataclass(frozen=True, slots=True)
class SetPointSettings:
    """Tolerance and scale of the programs for set-points."""

    slack: float = 1e-7
    """By which a hard row may be exceeded, in `LOAD_UNIT`: ten times the solver's tolerance, as
    changed tensions end on hard rows, where otherwise rounding would leave no balance."""
    scale: float = LOAD_UNIT**2
    """Factor k of squared changes, which are then in N²: changes are newtons, not hundreds."""
    reactions: float = 1e-9
    """Weight ε of squared free loads beside squared changes. Hands can squeeze each other without
    end; loads of a million newtons would leave no digits of the tensions on the hard rows' border.
    Small enough that 300 N weigh as much as a change of 0.01 N."""


SET_POINT_SETTINGS: Final = SetPointSettings()


class Kept(Best):
    """min u where some loads are held: least utilisation with the best possible reactions.

    Parameters
    ----------
    data : StanceData
        Balance, limits and hard rows of all hands.
    held : sequence of ndarray, shape (m,)
        Value of each load of each hand that is held [N]; NaN where it is free.
    """

    def __init__(self, data: StanceData, held: Sequence[Array]) -> None:
        super().__init__(data)
        self.held = np.concatenate(held) / data.rows.unit
        self.h = self.h + SET_POINT_SETTINGS.slack

    def define(self) -> Definition:
        """Return the program written in CVXPY."""
        import cvxpy as cp

        problem, variables, rows = super().define()
        z, given = variables[-1], ~np.isnan(self.held)
        constraints = [*problem.constraints, z[given] == self.held[given]]
        return Definition(cp.Problem(problem.objective, constraints), variables, rows)

    def solve(self) -> Outcome:
        """Solve the program for the free loads alone; ``value`` is the utilisation u."""
        of_hands = parted(self.held, [len(hand.unit) for hand in self.data.hands])
        hands = []
        for hand, z in zip(self.data.hands, of_hands, strict=True):
            free = np.isnan(z)
            at = hand.about(np.where(free, 0.0, z), 1.0)
            h, bound = at.h + SET_POINT_SETTINGS.slack, (at.H[:, free] != 0.0).any(axis=1)
            if h[~bound].min(initial=0.0) < 0.0:
                return Outcome(False, "infeasible", 0, math.nan)
            # of the limits that no free load changes, the one that is used most says all
            rows = (at.L[:, free] != 0.0).any(axis=1)
            fixed = np.where(rows, -np.inf, at.l0)
            rows[fixed.argmax()] = True
            hands.append(
                at._replace(
                    G=at.G[:, free],
                    L=at.L[rows][:, free],
                    l0=at.l0[rows],
                    H=at.H[bound][:, free],
                    h=h[bound],
                    E=at.E[:, free],
                    tie=at.tie[free],
                    rest=at.rest[free],
                    unit=at.unit[free],
                )
            )
        found = Best(StanceData.of(tuple(hands), self.data.wrench)).solve()
        if not found.solved:
            return found
        loads = []
        for hand, z, y in zip(self.data.hands, of_hands, found.loads, strict=True):
            whole = z * hand.unit
            whole[np.isnan(z)] = y
            loads.append(whole)
        return Outcome(True, found.status, found.iterations, found.value, tuple(loads))


class LeastChange(Best):
    """min k (Σ (z_i − f_i)² + ε Σ z_j²) within balance and hard rows alone; i held, j free.

    The small weight ε of free loads keeps them finite, and so the tensions exact.

    Parameters
    ----------
    data : StanceData
        Balance and hard rows of all hands.
    held : sequence of ndarray, shape (m,)
        Value of each load that is to change as little as need be [N]; NaN where it is free.
    """

    def __init__(self, data: StanceData, held: Sequence[Array]) -> None:
        hands = [hand._replace(L=hand.L[:0], l0=hand.l0[:0]) for hand in data.hands]
        z = np.concatenate(held) / data.rows.unit
        given = ~np.isnan(z)
        change = Residuals(np.eye(len(z))[given], z[given], SET_POINT_SETTINGS.scale)
        weights = np.where(given, 0.0, SET_POINT_SETTINGS.reactions * SET_POINT_SETTINGS.scale)
        whole = StanceData.of(tuple(hands), data.wrench)
        super().__init__(whole, cap=1.0, weights=weights, residuals=change)


def kept(data: StanceData, held: Sequence[Array]) -> Outcome:
    """Solve for the least utilisation with some loads held.

    Parameters
    ----------
    data : StanceData
    held : sequence of ndarray, shape (m,)
        Value of each load of each hand that is held [N]; NaN where it is free.

    Returns
    -------
    Outcome
        ``value`` is the utilisation. Without dual values.
    """
    return Kept(data, held).solve()


def least_change(data: StanceData, held: Sequence[Array]) -> Outcome:
    """Solve for loads near given ones that balance the body and meet all hard rows; see the table.

    Parameters
    ----------
    data : StanceData
    held : sequence of ndarray, shape (m,)
        Value of each load that is to change as little as need be [N]; NaN where it is free.

    Returns
    -------
    Outcome
        ``value`` is the sum of the squared changes, and of ε times the squares of the free loads,
        in newtons; ε is ``SET_POINT_SETTINGS.reactions``.
    """
    return LeastChange(data, held).solve()
