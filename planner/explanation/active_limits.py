"""Limits that bind a plan, how much of each is used, and what more of it would be worth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.wrench_spaces import Row, WrenchSpace
from planner.prepare import KEPT_NAMES
from planner.programs import CAP_SLACK, JOINT_FORCE, JOINT_TORQUE
from planner.result import LimitName, Price

__all__ = [
    "TOLERANCES",
    "ActiveLimits",
    "ExplanationTolerances",
    "LimitUse",
    "close_to",
    "joint_name",
    "limit_name",
    "limit_unit",
]


@dataclass(frozen=True, slots=True)
class ExplanationTolerances:
    """Least size of numbers of a plan, or of an infeasibility certificate, that mean something."""

    binding_multiplier: float = 1e-6  # of a limit that binds, at least
    ranking_digits: int = 5  # decimals of multipliers; where alike, rows' order counts
    weighing_multiplier: float = 1e-6  # in a proof, of which all add up to about one
    broken: float = 1e-7  # rows that must be broken by more have no loads, in scaled units
    kept: float = 2e-9  # rows that need not be broken by more have loads: the solver's rounding
    tension_change: float = 1e-3
    """What hard rows give on the way, and no change of tension [N]: no present tension is known
    better, and a tendon at rest where it would stick is not slack by a rounding."""
    com_offset: float = 0.05
    """From where the centre of mass is taken, without a warning [m]: on a vertical wall 0.12 m
    changed the load factor of four hands by a sixth."""


TOLERANCES: Final = ExplanationTolerances()


def limit_unit(limit: str) -> str:
    """Return the unit of a limit's capacity."""
    units = {"motor_torque": "N·m", "motor_current": "A", JOINT_TORQUE: "N·m"}
    return units.get(limit, "N")


def limit_name(limb: str, row: Row) -> LimitName:
    """Return the name of a row of a limb's hand."""
    return LimitName(limb, row.finger, row.phalanx, row.limit, row.joint)


def joint_name(limb: str, joint: str, slides: bool) -> LimitName:
    """Return the name of the load of a limb's joint; ``slides``: whether the joint is prismatic."""
    return LimitName(limb, None, None, JOINT_FORCE if slides else JOINT_TORQUE, joint)


class LimitUse(NamedTuple):
    """The use of a limit: load over capacity of one of its rows."""

    name: LimitName
    load: float
    capacity: float

    @property
    def utilisation(self) -> float:
        """Load over capacity."""
        return self.load / self.capacity


def close_to(utilisation: float) -> float:
    """Return the utilisation from which on a limit ties with the most used ones."""
    return utilisation - 2.0 * CAP_SLACK * max(1.0, utilisation)


class ActiveLimits:
    """Limits that bind a plan, by the multipliers of its program; rows of one name are one limit.

    The dearest come first: of which one per cent more would take most off, so that newtons compare
    with amperes.

    Parameters
    ----------
    limbs : sequence of str
    spaces : sequence of WrenchSpace
    multipliers : sequence of ndarray
        Of each hand's limit rows.
    """

    def __init__(
        self,
        limbs: Sequence[str],
        spaces: Sequence[WrenchSpace],
        multipliers: Sequence[Array],
    ) -> None:
        self._capacities = np.concatenate([space.s for space in spaces])
        self._names, self._of_row = _named(tuple([space.rows for space in spaces]), tuple(limbs))
        duals = np.concatenate(multipliers)
        self._weights = duals * (duals > TOLERANCES.binding_multiplier)
        self._worth = np.bincount(self._of_row, self._weights, len(self._names))

    def _rank(self, limit: int) -> tuple[float, int]:
        """Return what a limit is worth, and for those alike how early its first row that binds."""
        worth = float(self._worth[limit])
        if worth == 0.0:
            return (-math.inf, 0)  # below any that binds, and a place
        first = ((self._of_row == limit) & (self._weights > 0.0)).argmax()
        return round(worth, TOLERANCES.ranking_digits), -int(first)

    def prices(self, utilisation: float) -> tuple[Price, ...]:
        """Return the price of each limit that binds.

        A limit ``L y + l0 ≤ u s`` with multiplier λ, in units of its capacity, takes λ u / s off
        the objective for each unit more of s.

        Parameters
        ----------
        utilisation : float
            At which the rows stand.
        """
        names = self._names
        dear = sorted(self._worth.nonzero()[0].tolist(), key=self._rank, reverse=True)
        each = self._weights * utilisation / self._capacities
        price = np.bincount(self._of_row, each, len(names)).tolist()
        return tuple(Price.of(names[i], price[i], limit_unit(names[i].limit)) for i in dear)

    def limiting(
        self, used: Array, utilisation: float, idle: Sequence[LimitUse]
    ) -> LimitUse | None:
        """Return the limit with the largest utilisation; of those that tie, the dearest.

        The others only follow it.

        Parameters
        ----------
        used : ndarray, shape (sum of nl,)
            Utilisation of every limit row, hand by hand.
        utilisation : float
            The largest of these and the idle ones.
        idle : sequence of LimitUse
            Limits of limbs without a hand, which have no price.
        """
        rows = (used >= close_to(utilisation)).nonzero()[0]
        most = max(idle, key=lambda each: each.utilisation, default=None)
        if not len(rows):
            return most
        limits, shares = self._of_row.take(rows), used.take(rows)
        worth = self._worth.take(limits)
        dear = (
            (worth >= np.maximum.reduce(worth) - 10.0**-TOLERANCES.ranking_digits)
            .nonzero()[0]
            .tolist()
        )
        tied = set(limits.take(dear).tolist())
        if len(tied) > 1:
            first = max(map(self._rank, tied))
            dear = [i for i in dear if self._rank(int(limits[i])) == first]
        best = max(dear, key=shares.tolist().__getitem__)
        if most is not None and worth[best] == 0.0 and most.utilisation > shares[best]:
            return most
        found = int(rows[best])
        capacity = float(self._capacities[found])
        return LimitUse(self._names[self._of_row[found]], float(used[found]) * capacity, capacity)


Named = tuple[tuple[LimitName, ...], Indices]
"""Limits of some hands, each name once, and which of them each limit row is, shape (sum of nl,)."""


@lru_cache(maxsize=KEPT_NAMES)
def _named(sets: tuple[tuple[Row, ...], ...], limbs: tuple[str, ...]) -> Named:
    """Return the limits of hands of limbs by the rows of their sets."""
    names = [
        limit_name(limb, row)
        for rows, limb in zip(sets, limbs, strict=True)
        for row in rows
        if row.kind == "limit"
    ]
    index = {name: i for i, name in enumerate(dict.fromkeys(names))}
    return tuple(index), np.array([index[name] for name in names], dtype=np.intp)
