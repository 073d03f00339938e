"""The table that stances are screened with: supports of hands, and body wrenches, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices, LimitError
from planner.screening.hand_supports import WorldHands
from planner.screening.settings import SCREENING_SETTINGS

__all__ = ["ScreeningTable", "StanceIndices", "axis_directions"]


class StanceIndices(NamedTuple):
    """N stances by indices: a body, and a placement for each of L limbs.

    Attributes
    ----------
    bodies : ndarray of int, shape (N,)
        Index of the body.
    members : ndarray of int, shape (N, L)
        Index of the placement of each limb's hand; −1 for a limb in the air.
    """

    bodies: Indices
    members: Indices

    def of(self, chosen: Indices) -> StanceIndices:
        """Return the stances with the given indices."""
        return StanceIndices(self.bodies[chosen], self.members[chosen])


@dataclass(frozen=True, eq=False)
class ScreeningTable:
    """Supports of P hands in D directions, and the wrenches that B bodies need.

    From balance, Σ σ(d) ≥ s d·w for every direction d and every multiple s of the body wrench w
    that the hands can hold, σ being their supports.

    Attributes
    ----------
    hands : WorldHands
        The hands at their placements.
    wrenches : ndarray, shape (B, 6)
        Wrench that the rock must exert on each body with all limbs in the air, in the axes of W
        about ``hands.about``, in `WRENCH_UNIT`.
    moments : ndarray, shape (B, L, P, 3), or (0, 0, 0, 0)
        What the limb's posture changes in the moment of that wrench when its hand is at a
        placement, in `WRENCH_UNIT`; none by default.
    directions : ndarray, shape (D, 6)
    supports : ndarray, shape (P, D)
    """

    hands: WorldHands
    wrenches: Array
    moments: Array
    directions: Array
    supports: Array

    @classmethod
    def of(cls, hands: WorldHands, wrenches: Array, moments: Array | None = None) -> ScreeningTable:
        """Return the table with the first directions: forces along axes, and moments about them.

        Parameters
        ----------
        hands : WorldHands
        wrenches : ndarray, shape (B, 6)
        moments : ndarray, shape (B, L, P, 3), optional
        """
        first = axis_directions()
        weighed = np.zeros((0, 0, 0, 0)) if moments is None else np.ascontiguousarray(moments)
        carried = np.ascontiguousarray(wrenches, dtype=float)
        return cls(hands, carried, weighed, first, hands.supports(first))

    def extended(self, directions: Array) -> ScreeningTable:
        """Return the table with further directions, shape (d, 6)."""
        more = self.hands.supports(directions)
        return replace(
            self,
            directions=np.vstack([self.directions, directions]),
            supports=np.ascontiguousarray(np.hstack([self.supports, more])),
        )

    def latest(self, count: int) -> ScreeningTable:
        """Return the table with the last directions only."""
        return self._chosen(np.arange(len(self.directions) - count, len(self.directions)))

    def first(self, count: int) -> ScreeningTable:
        """Return the table with the first directions only."""
        return self._chosen(np.arange(min(count, len(self.directions))))

    def trimmed(self, count: int) -> ScreeningTable:
        """Return the table with so many directions at most: the first half and the latest."""
        if len(self.directions) <= count:
            return self
        left = len(self.directions) - (count - count // 2)
        kept = np.append(np.arange(count // 2), np.arange(left, len(self.directions)))
        return self._chosen(kept)

    def _chosen(self, kept: Indices) -> ScreeningTable:
        supports = np.ascontiguousarray(self.supports[:, kept])
        return replace(self, directions=self.directions[kept], supports=supports)

    def reordered(self, stances: StanceIndices, factor: float) -> ScreeningTable:
        """Return the table with those directions first that rule out most of some stances.

        Parameters
        ----------
        stances : StanceIndices
            Examples; some thousands are enough.
        factor : float
            Multiple of the body wrench that they are to be ruled out at.
        """
        needs = self.needed(stances) @ self.directions.T
        held = np.zeros_like(needs)
        for column in stances.members.T:
            held += np.where((column >= 0)[:, None], self.supports[column], 0.0)
        ruled, order = held < factor * needs, list[int]()
        left = np.ones(len(needs), dtype=bool)
        while left.any() and len(order) < len(self.directions):
            most = int(ruled[left].sum(axis=0).argmax())
            if not ruled[left, most].any():
                break
            order.append(most)
            left &= ~ruled[:, most]
        rest = np.setdiff1d(np.arange(len(self.directions)), order)
        chosen = np.array([*order, *rest.tolist()], dtype=np.intp)
        return self._chosen(chosen)

    def needed(self, stances: StanceIndices) -> Array:
        """Return the body wrenches of stances, shape (N, 6), in `WRENCH_UNIT`."""
        found = self.wrenches[stances.bodies].copy()
        for limb, column in enumerate(stances.members.T if len(self.moments) else ()):
            on = column >= 0
            found[on, 3:] += self.moments[stances.bodies[on], limb, column[on]]
        return found

    def ends(self, stances: StanceIndices, floor: float = -np.inf) -> Array:
        """Return bounds of the multiples of the body wrench that stances can hold, shape (N, 2).

        No multiple below the first or above the second is held: the second bounds the load factor,
        and where it is below the first, there is none.

        Parameters
        ----------
        stances : StanceIndices
        floor : float
            Once a stance's second bound is below this, no further direction is looked at.
        """
        from planner.screening.compiled_screening import load_factor_ends

        return load_factor_ends(
            self.directions,
            self.supports,
            np.ascontiguousarray(stances.bodies, dtype=np.intp),
            np.ascontiguousarray(stances.members, dtype=np.intp),
            self.wrenches,
            self.moments,
            float(floor),
            SCREENING_SETTINGS.least_share,
        )

    def bounds(self, stances: StanceIndices, floor: float = -np.inf) -> Array:
        """Return upper bounds of the load factors of stances, shape (N,); −∞ where there is none.

        Parameters as in `ends`. Where a bound is below ``floor``, a lower one might be had.
        """
        low, high = self.ends(stances, floor).T
        found: Array = np.where(low > high + SCREENING_SETTINGS.slack * (1.0 + low), -np.inf, high)
        return found

    def passing(
        self,
        body: int,
        candidates: Sequence[Indices],
        factor: float,
        limbs: Sequence[int] | None = None,
        most: int = SCREENING_SETTINGS.most_passing,
    ) -> Indices:
        """Return the stances of a body that may have a load factor of at least a given one.

        All choices of one placement for each of H limbs are screened.

        Parameters
        ----------
        body : int
            Index of the body.
        candidates : sequence of ndarray of int, length H
            Placements of each limb; none may be at two limbs' disposal where no two hands may be
            at the same place, or choices with a placement twice are returned as well.
        factor : float
            Least load factor. A stance that no direction rules out at all multiples from this one
            on passes: hands that press on their rock may hold a larger one only.
        limbs : sequence of int, length H, optional
            Indices of the limbs among ``moments``; 0 to H − 1 by default.
        most : int
            Stances that may pass.

        Returns
        -------
        ndarray of int, shape (M, H)
            Placements of the limbs of each stance that no direction rules out.

        Raises
        ------
        LimitError
            If more than ``most`` pass.
        """
        from planner.screening.compiled_screening import passing

        if not prod(map(len, candidates)):
            return np.zeros((0, len(candidates)), dtype=np.intp)
        own = list(range(len(candidates)) if limbs is None else limbs)
        weighed = self.moments[body][own] if len(self.moments) else np.zeros((0, 0, 0))
        found, count = passing(
            self.directions,
            self.supports,
            self.wrenches[body],
            np.ascontiguousarray(weighed),
            np.concatenate(candidates).astype(np.intp),
            np.cumsum([0, *map(len, candidates)]),
            float(factor),
            SCREENING_SETTINGS.slack,
            SCREENING_SETTINGS.first_buffer,
            most,
        )
        if count > most:
            raise LimitError(
                f"more than {most} stances pass at a load factor of {factor:g}; learn more "
                "directions, or ask for a larger one"
            )
        return found


def axis_directions() -> Array:
    """Return directions along and against each axis of forces and moments, shape (12, 6)."""
    return np.vstack([np.eye(6), -np.eye(6)])
