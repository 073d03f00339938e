"""What binds a plan: its limits, how much of each is used, and what more of it would be worth."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from hand_models.frames import Array
from hand_models.wrench_space import Row, WrenchSpace
from planner.plan import LimitName, Price
from planner.program import SLACK
from planner.stance_data import JOINT_TORQUE

__all__ = ["Used", "joint_name", "limit_name", "limiting_limit", "prices", "unit_of", "used_limits"]

BINDING: Final = 1e-6
"""Multipliers below this do not count as binding."""

ALIKE: Final = 5
"""Decimals of multipliers by which limits are ranked; where these are alike, rows' order counts."""

UNITS: Final = {"motor_torque": "N·m", "motor_current": "A", JOINT_TORQUE: "N·m"}
"""Of limits that are not in newtons."""


def unit_of(limit: str) -> str:
    """Return the unit of a limit's capacity."""
    return UNITS.get(limit, "N")


def limit_name(limb: str, row: Row) -> LimitName:
    """Return the name of a row of a limb's hand."""
    return LimitName(limb, row.finger, row.phalanx, row.limit, row.joint)


def joint_name(limb: str, joint: str) -> LimitName:
    """Return the name of what a limb's joint bears."""
    return LimitName(limb, None, None, JOINT_TORQUE, joint)


class Used(NamedTuple):
    """How much of a limit is used: load over capacity of one of its rows."""

    name: LimitName
    load: float
    capacity: float

    @property
    def utilisation(self) -> float:
        """Load over capacity."""
        return self.load / self.capacity


def used_limits(
    limbs: Sequence[str], spaces: Sequence[WrenchSpace], loads: Sequence[Array]
) -> Iterator[Used]:
    """Yield how much of every limit row is used."""
    for limb, space, y in zip(limbs, spaces, loads, strict=True):
        for row, used, capacity in zip(space.rows, space.utilisations(y), space.s, strict=False):
            yield Used(limit_name(limb, row), float(used * capacity), float(capacity))


def limiting_limit(used: Sequence[Used], utilisation: float, dear: Sequence[Price]) -> Used | None:
    """Return the limit with the largest utilisation; of those that tie, the dearest.

    The others only follow it.
    """
    close = utilisation - 2.0 * SLACK * max(1.0, utilisation)
    rank_of = {price.name: len(dear) - i for i, price in enumerate(dear)}

    def rank(each: Used) -> tuple[bool, int, float]:
        return each.utilisation >= close, rank_of.get(each.name, 0), each.utilisation

    return max(used, key=rank, default=None)


def prices(
    limbs: Sequence[str],
    spaces: Sequence[WrenchSpace],
    multipliers: Sequence[Array],
    utilisation: float,
) -> tuple[Price, ...]:
    """Return the price of each limit that binds; rows of one name are one limit.

    A limit ``L y + l0 ≤ u s`` with multiplier λ, in units of its capacity, takes λ u / s off the
    objective for each unit more of s. The dearest come first: of which one per cent more would
    take most off, so that newtons compare with amperes.

    Parameters
    ----------
    limbs : sequence of str
    spaces : sequence of WrenchSpace
    multipliers : sequence of ndarray
        Of each hand's limit rows.
    utilisation : float
        At which the rows stand.
    """
    found: dict[LimitName, float] = {}
    worth: dict[LimitName, float] = {}
    for limb, space, duals in zip(limbs, spaces, multipliers, strict=True):
        for row, multiplier, capacity in zip(space.rows, duals, space.s, strict=False):
            if multiplier > BINDING:
                name = limit_name(limb, row)
                price = float(multiplier * utilisation / capacity)
                found[name] = found.get(name, 0.0) + price
                worth[name] = worth.get(name, 0.0) + float(multiplier)
    return tuple(
        Price(name, found[name], unit_of(name.limit))
        for name in sorted(worth, key=lambda name: -round(worth[name], ALIKE))
    )
