"""Linear programs of lifts and stances: each solved once, with the direction that bounds it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from planner.screening import ScreeningTable, StanceIndices, solve_stance
from planner.search.settings import SEARCH_SETTINGS
from planner.search.wall import State

__all__ = ["Programs", "SolvedStates"]


class SolvedStates(NamedTuple):
    """Load factors of N stances, with the directions that bound them.

    Attributes
    ----------
    bodies : ndarray of int, shape (N,)
    members : ndarray of int, shape (N, L)
    factors : ndarray, shape (N,)
        −∞ where no multiple of the body wrench is held.
    directions : ndarray, shape (N, 6)
        Zero where the solver failed; the factor is infinite then, and bounds nothing.
    held : ndarray, shape (N,)
        Sums of the supports of the hands in these directions.
    """

    bodies: Indices
    members: Indices
    factors: Array
    directions: Array
    held: Array

    def below(self, multiple: float) -> SolvedStates:
        """Return those with a smaller load factor."""
        kept = self.factors < multiple
        return SolvedStates(
            self.bodies[kept],
            self.members[kept],
            self.factors[kept],
            self.directions[kept],
            self.held[kept],
        )


class Programs:
    """Linear programs of the states of a wall.

    Parameters
    ----------
    table : ScreeningTable
        Hands, body wrenches and moments.
    """

    def __init__(self, table: ScreeningTable) -> None:
        self._table = table
        self._parts = list[SolvedStates]()
        self._stances = dict[State, tuple[float, Array, float]]()
        self.count = 0

    def solve(self, bodies: Indices, members: Indices) -> SolvedStates:
        """Return the load factors of states, which are kept."""
        from planner.search.compiled_programs import load_factors

        hands, settings = self._table.hands, SEARCH_SETTINGS
        wrenches = self._table.needed(StanceIndices(bodies, members))
        factors, directions, held = load_factors(
            hands.points,
            hands.rows,
            hands.parts,
            hands.hands,
            hands.base,
            hands.room,
            np.ascontiguousarray(members),
            np.ascontiguousarray(wrenches),
            settings.zero,
            settings.pivots,
        )
        for i in np.flatnonzero(np.isnan(factors)).tolist():
            answer = solve_stance(hands, members[i][members[i] >= 0], wrenches[i])
            if answer.direction is None:
                factors[i] = np.inf
                continue
            directions[i] = answer.direction
            held[i] = hands.supports(answer.direction[None])[members[i][members[i] >= 0]].sum()
            factors[i] = -np.inf if np.isnan(answer.factor) else answer.factor
        self.count += len(bodies)
        found = SolvedStates(bodies, members, factors, directions, held)
        self._parts.append(found)
        return found

    def stances(self, states: Sequence[State]) -> Array:
        """Return the load factors of states, shape (n,); those that are not known are solved."""
        new = [each for each in dict.fromkeys(states) if each not in self._stances]
        if new:
            bodies, members = (np.array(column) for column in zip(*new, strict=True))
            found = self.solve(bodies, members)
            rows = zip(found.factors.tolist(), found.directions, found.held.tolist(), strict=True)
            self._stances.update(zip(new, rows, strict=True))
        return np.array([self._stances[each][0] for each in states])

    def stance(self, state: State) -> float:
        """Return the load factor of one state."""
        return float(self.stances([state])[0])

    def bounding(self, states: Sequence[State], chosen: NDArray[np.bool_]) -> tuple[Array, Array]:
        """Return the directions (n, 6) of some known states, and the sums of supports in them."""
        rows = [self._stances[each] for each, wanted in zip(states, chosen, strict=True) if wanted]
        directions = np.array([row[1] for row in rows]).reshape(-1, 6)
        return directions, np.array([row[2] for row in rows])

    @property
    def known(self) -> SolvedStates:
        """All that was solved."""
        if len(self._parts) != 1:
            limbs = self._table.moments.shape[1] or 4
            none = SolvedStates(
                np.zeros(0, dtype=np.intp),
                np.zeros((0, limbs), dtype=np.intp),
                np.zeros(0),
                np.zeros((0, 6)),
                np.zeros(0),
            )
            parts = self._parts or [none]
            self._parts = [SolvedStates(*map(np.concatenate, zip(*parts, strict=True)))]
        return self._parts[0]
