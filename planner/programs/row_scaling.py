"""A hand's set in the units of the conic programs, wherever the hand is.

All of a hand's data but its part of the balance. What names alone decide (which rows are efforts,
which capacity measures a load) is found once for each list of names.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.compliance import WRIST, pose_units
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR, TENDON_TENSION
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = [
    "JOINT_TORQUE",
    "LOAD_UNIT",
    "TWIST_UNIT",
    "WRIST_RANGE",
    "ScaledRows",
    "is_effort",
    "scaled_rows",
]

LOAD_UNIT: Final = 100.0
"""Scale of a hand's loads y [N]."""

TWIST_UNIT: Final = pose_units(WRIST)
"""Scale of a floating wrist's twist y [m, rad]: about what loads a hand by `LOAD_UNIT`."""

WRIST_RANGE: Final = "wrist_range"
"""Name of the hard rows within which a floating hand's set is linearised."""

JOINT_TORQUE: Final = "joint_torque"
"""Name of the limit rows of a limb's joints."""

SECONDARY: Final = 1e-4
"""Weight in the tie-break of loads that are not tensions: enough to make them unique."""

LIGHT: Final = 0.1
"""How much less of that weight they have where the effort itself is least."""

KEPT: Final = 256
"""Lists of names that are kept."""


class ScaledRows(NamedTuple):
    """What a hand's set gives the programs wherever the hand is. Arrays are read-only.

    Attributes
    ----------
    generators, origin : ndarray, shapes (6, m), (6,)
        Its wrench on the rock, in H, is generators z + origin [N, N·m].
    L, l0, H, h, E, e0, tie, rest, unit : ndarray
        As of `HandData`.
    """

    generators: Array
    origin: Array
    L: Array
    l0: Array
    H: Array
    h: Array
    E: Array
    e0: Array
    tie: Array
    rest: Array
    unit: Array


class _Roles(NamedTuple):
    """What a set's columns and rows are to the programs, by their names.

    Attributes
    ----------
    unit : ndarray, shape (m,)
        Of the columns.
    scale : float or ndarray, shape (m,)
        The same; a number where all are alike.
    weight : ndarray, shape (m,)
        In the tie-break, of loads that no capacity measures.
    other : ndarray, shape (m,)
        Zero for tensions, `LIGHT` for the others.
    measured, measures : ndarray of int
        Columns with a capacity of their own (tendons, the palm), and the limit rows that have it.
    forces : ndarray
        Roots of the weights of those columns by that capacity [N].
    over : ndarray, shape (nh,), or None
        What hard rows are divided by; None where it is `LOAD_UNIT`, as the columns' unit is.
    efforts : slice or ndarray of int
        Limit rows whose utilisation counts as effort.
    """

    unit: Array
    scale: float | Array
    weight: Array
    other: Array
    measured: Indices
    measures: Indices
    forces: Array
    over: Array | None
    efforts: slice | Indices


def scaled_rows(spaces: Sequence[WrenchSpace]) -> tuple[ScaledRows, ...]:
    """Return what the set of each hand gives the programs."""
    return tuple([_scaled(space) for space in spaces])


def _scaled(space: WrenchSpace) -> ScaledRows:
    roles = _roles(space.columns, space.rows, len(space.s))
    scale, s = roles.scale, space.s
    L, l0 = space.L * (scale / s[:, None]), space.l0 / s
    if roles.over is None:
        H, h = space.H, space.h / LOAD_UNIT
    else:
        H, h = space.H * scale / roles.over[:, None], space.h / roles.over
    tie = roles.weight.copy()
    tie[roles.measured] = (roles.forces / s.take(roles.measures)) ** 2
    rest = tie * roles.other
    generators = space.generators * scale
    for array in (L, l0, H, h, tie, rest, generators):
        array.setflags(write=False)
    return ScaledRows(
        generators=generators,
        origin=space.origin,
        L=L,
        l0=l0,
        H=H,
        h=h,
        E=L[roles.efforts],
        e0=l0[roles.efforts],
        tie=tie,
        rest=rest,
        unit=roles.unit,
    )


@lru_cache(maxsize=KEPT)
def _roles(columns: tuple[str, ...], rows: tuple[Row, ...], count: int) -> _Roles:
    """Return the roles of names; ``count`` of the rows are limits."""
    limits = rows[:count]
    floats = columns == WRIST
    tensions = np.array([name.endswith("/tension") for name in columns])
    place = {name: j for j, name in enumerate(columns)}
    measures = {}
    for i, row in enumerate(limits):
        if row.limit == TENDON_TENSION:
            measures[place.get(f"{row.finger}/tension")] = i
        elif row.limit in (PALM_SHEAR, PALM_PRESSING):
            measures[place.get(row.limit)] = i
    measures.pop(None, None)
    # hard rows are in newtons, but for those of a wrist's range
    ranges = np.array([row.limit == WRIST_RANGE for row in rows[count:]])
    efforts = np.flatnonzero([is_effort(row) for row in limits])
    weight = np.where(tensions, 1.0, SECONDARY)
    measured = np.array(list(measures), dtype=np.intp)
    roles = _Roles(
        unit=TWIST_UNIT if floats else np.full(len(columns), LOAD_UNIT),
        scale=TWIST_UNIT if floats else LOAD_UNIT,
        weight=weight,
        other=np.where(tensions, 0.0, LIGHT),
        measured=measured,
        measures=np.array(list(measures.values()), dtype=np.intp),
        forces=np.sqrt(weight[measured]) * LOAD_UNIT,
        over=np.where(ranges, 1.0, LOAD_UNIT) if floats or ranges.any() else None,
        efforts=efforts,
    )
    for array in roles:
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    together = len(efforts) and efforts[-1] - efforts[0] == len(efforts) - 1
    return roles._replace(efforts=slice(efforts[0], efforts[-1] + 1)) if together else roles


def is_effort(row: Row) -> bool:
    """Whether a limit row's utilisation counts as effort: a torque's with one of its two signs."""
    return row.limit == TENDON_TENSION or (row.limit == JOINT_TORQUE and row.label.endswith("+"))
