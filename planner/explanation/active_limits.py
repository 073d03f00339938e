"""Limits that bind a plan: their utilisation and their shadow prices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.fixed_wrist import FINGER_TWIST
from hand_models.wrench_spaces import Row, WrenchSpace
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
    "most_used",
]


@dataclass(frozen=True, slots=True)
class ExplanationTolerances:
    """Thresholds below which numbers of a plan or a certificate count as zero."""

    binding_multiplier: float = 1e-6  # of a limit that binds, at least
    ranking_digits: int = 5  # of multipliers and utilisations; where alike, rows' order counts
    weighing_multiplier: float = 1e-6  # in a proof, of which all add up to about one
    broken: float = 1e-7  # rows that must be broken by more have no loads, in scaled units
    kept: float = 2e-9  # rows that need not be broken by more have loads: the solver's rounding
    tension_change: float = 1e-3
    """Slack of hard rows along a path of tensions, and largest change that counts as none [N]:
    no present tension is known better, and rounding must not make a resting tendon slack.
    """
    com_offset: float = 0.05
    """Distance of the centre of mass from its assumed place that gives no warning [m]: on a
    vertical wall 0.12 m changed the load factor of four hands by a sixth.
    """
    palm_travel: float = 1e-3
    """Travel that the palm of a fixed hand may lack without a finding [m]: a hand on a cylinder of
    300 mm that is 1 mm farther off the rock holds less than half.
    """
    palm_pressing: float = 1.0
    """Pressing of a palm that counts as none [N]: below 1 % of what a hand carries."""


TOLERANCES: Final = ExplanationTolerances()


def limit_unit(limit: str) -> str:
    """Return the unit of a limit's load and capacity: ``N``, ``N·m`` or ``A``.

    Parameters
    ----------
    limit : str
        Kind of limit, such as ``motor_torque``; see `planner.result.LimitName`.
    """
    if limit in ("motor_torque", FINGER_TWIST, JOINT_TORQUE):
        return "N·m"
    return "A" if limit == "motor_current" else "N"


def most_used(used: Array) -> int:
    """Return the index of the largest utilisation, of alike ones the first: no rounding decides."""
    return int(_alike(used).argmax())


def _alike(values: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which values are the largest, but for rounding."""
    return np.asarray(values >= np.maximum.reduce(values) - 10.0**-TOLERANCES.ranking_digits)


def limit_name(limb: str, row: Row) -> LimitName:
    """Return the name of the limit or hard row that a row of a wrench space stands for.

    Parameters
    ----------
    limb : str
        Limb of the hand that has the wrench space.
    row : Row
        Row of that wrench space.
    """
    return LimitName(limb, row.finger, row.phalanx, row.limit, row.joint)


def joint_name(limb: str, joint: str, slides: bool) -> LimitName:
    """Return the name of the torque or force limit of a limb's joint.

    Parameters
    ----------
    limb, joint : str
        Names of the limb and of its joint.
    slides : bool
        Whether the joint is prismatic, so that its load is a force.
    """
    return LimitName(limb, None, None, JOINT_FORCE if slides else JOINT_TORQUE, joint)


class LimitUse(NamedTuple):
    """Load and capacity of a limit: of its row with the highest utilisation.

    Attributes
    ----------
    name : LimitName
        Name of the limit.
    load : float
        Load on the limit [N], [N·m] or [A].
    capacity : float
        Load at utilisation 1, in the same unit.
    """

    name: LimitName
    load: float
    capacity: float

    @property
    def utilisation(self) -> float:
        """Load over capacity."""
        return self.load / self.capacity


def close_to(utilisation: float) -> float:
    """Return the utilisation above which a limit counts as tied with the most used limit.

    Parameters
    ----------
    utilisation : float
        Utilisation of the most used limit.
    """
    return utilisation - 2.0 * CAP_SLACK * max(1.0, utilisation)


class ActiveLimits:
    """Limits that bind a plan, ranked by the multipliers (dual values) of the plan's program.

    Rows of one name are one limit: their multipliers are added. First comes the limit whose
    increase by one per cent would lower the utilisation most, so that newtons compare with amperes.

    Parameters
    ----------
    limbs : sequence of str
        Limb of each hand.
    spaces : sequence of WrenchSpace
        Wrench space of each hand.
    multipliers : sequence of ndarray, shape (nl,)
        Multipliers of the nl limit rows of each hand.
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
        """Return the shadow price of each limit that binds.

        A limit row ``L y + l0 ≤ u s`` (loads y, utilisation u, capacity s) with multiplier λ, in
        units of its capacity, lowers the utilisation by λ u / s for each unit more of s.

        Parameters
        ----------
        utilisation : float
            Utilisation u of the plan.

        Returns
        -------
        tuple of Price
            The most valuable limit first.
        """
        names = self._names
        dear = sorted(self._worth.nonzero()[0].tolist(), key=self._rank, reverse=True)
        each = self._weights * utilisation / self._capacities
        price = np.bincount(self._of_row, each, len(names)).tolist()
        return tuple(Price.of(names[i], price[i], limit_unit(names[i].limit)) for i in dear)

    def limiting(
        self, used: Array, utilisation: float, idle: Sequence[LimitUse]
    ) -> LimitUse | None:
        """Return the limit with the highest utilisation; of tied limits, the most valuable one.

        The most valuable limit has the largest multiplier.

        Parameters
        ----------
        used : ndarray, shape (sum of nl,)
            Utilisation of every limit row, hand by hand.
        utilisation : float
            Highest utilisation of ``used`` and ``idle``.
        idle : sequence of LimitUse
            Limits of limbs without a hand, which have no shadow price.

        Returns
        -------
        LimitUse or None
            None if there are no limits.
        """
        rows = (used >= close_to(utilisation)).nonzero()[0]
        most = max(idle, key=lambda each: each.utilisation, default=None)
        if not len(rows):
            return most
        limits, shares = self._of_row.take(rows), used.take(rows)
        worth = self._worth.take(limits)
        dear = _alike(worth).nonzero()[0].tolist()
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
"""Distinct limits of some hands, and the index of the limit of each row, shape (sum of nl,)."""


@lru_cache(maxsize=256)  # lists of names, some 5 kB each
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
