"""Scaled rows of a hand's wrench space: what the conic programs need of it, wherever the hand is.

Loads are over `LOAD_UNIT` (a wrist's twist over `TWIST_UNIT`), body wrenches over `WRENCH_UNIT`,
limit rows over their capacities: one physical scaling for all programs.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.compliance import WRIST_COLUMNS, pose_units
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR, TENDON_TENSION
from hand_models.wrench_spaces import Row, WrenchSpace

__all__ = [
    "JOINT_FORCE",
    "JOINT_TORQUE",
    "LOAD_BOX",
    "LOAD_UNIT",
    "TWIST_UNIT",
    "WRENCH_UNIT",
    "WRIST_RANGE",
    "ScaledRows",
    "is_effort",
    "load_box",
]

LOAD_UNIT: Final = 100.0
"""Scale of a hand's loads y [N]."""

LOAD_BOX: Final = 1e4
"""Bound on every load, in `LOAD_UNIT`, where no limit counts: far beyond any strength."""

TWIST_UNIT: Final = pose_units(WRIST_COLUMNS)
"""Scale of a wrist's twist y [m, rad]: a twist that loads a hand by roughly `LOAD_UNIT`."""

WRENCH_UNIT: Final = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""Scale of a body wrench [N, N·m]."""

WRIST_RANGE: Final = "wrist_range"
"""Name of the hard rows that bound the range in which a compliant hand's set is linearised."""

JOINT_TORQUE: Final = "joint_torque"
"""Name of the limit rows of a limb's revolute joints."""

JOINT_FORCE: Final = "joint_force"
"""Name of the limit rows of a limb's prismatic joints."""


class ScaledRows(NamedTuple):
    """Scaled rows of a hand's wrench space, the same wherever the hand is. Arrays are read-only.

    Attributes
    ----------
    generators, origin : ndarray, shapes (6, m), (6,)
        The hand's wrench on the rock is generators z + origin, in the hand frame H [N, N·m].
    L, l0, H, h, E, e0, tie, rest, unit : ndarray
        Rows and weights with the meanings and shapes of the fields of `HandData`.
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

    @classmethod
    def of(cls, space: WrenchSpace) -> ScaledRows:
        """Scale the rows of a hand's wrench space for the conic programs."""
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
        return cls(
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


class _Roles(NamedTuple):
    """Scales and weights of a set's columns and rows in the programs, by their names.

    Attributes
    ----------
    unit : ndarray, shape (m,)
        Units of the columns.
    scale : float or ndarray, shape (m,)
        The same; a number where all are alike.
    weight : ndarray, shape (m,)
        Weights in the tie-break, of loads that no capacity measures.
    other : ndarray, shape (m,)
        Zero for tensions, a tenth for the others.
    measured, measures : ndarray of int
        Columns with a capacity of their own (tendons, the palm), and the limit rows that have it.
    forces : ndarray
        Roots of the weights of those columns by that capacity [N].
    over : ndarray, shape (nh,), or None
        Divisors of the hard rows; None where it is `LOAD_UNIT`, as the columns' unit is.
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


@lru_cache(maxsize=256)  # lists of names, some 5 kB each
def _roles(columns: tuple[str, ...], rows: tuple[Row, ...], count: int) -> _Roles:
    """Return the roles of names; ``count`` of the rows are limits."""
    limits = rows[:count]
    floats = columns[-len(WRIST_COLUMNS) :] == WRIST_COLUMNS
    unit = pose_units(columns) if floats else np.full(len(columns), LOAD_UNIT)
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
    # enough to make loads unique that are not tensions
    weight = np.where(tensions, 1.0, 1e-4)
    measured = np.array(list(measures), dtype=np.intp)
    roles = _Roles(
        unit=unit,
        scale=unit if floats else LOAD_UNIT,
        weight=weight,
        other=np.where(tensions, 0.0, 0.1),  # of that weight
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
    """Return whether a limit row counts as effort: a tendon's tension, or a joint's torque.

    Of a joint's two rows, one for each sign of the torque, the + row counts.
    """
    of_joint = row.limit in (JOINT_TORQUE, JOINT_FORCE)
    return row.limit == TENDON_TENSION or (of_joint and row.label.endswith("+"))


def load_box(wrench: Array) -> float:
    """Return the bound on every load, in `LOAD_UNIT`, where no limit counts, for a body wrench.

    `LOAD_BOX`, or a hundred times the force that the body needs if that is more, as for bodies of
    a tonne and above. With larger loads hands do little but squeeze each other, where hard rows
    nearly contradict the balance.

    Parameters
    ----------
    wrench : ndarray, shape (nb,)
        Body wrench, then prescribed components of hands' wrenches, in `WRENCH_UNIT`.
    """
    force = float(np.linalg.norm(wrench[:3] * WRENCH_UNIT[:3]))
    return max(LOAD_BOX, 100.0 * force / LOAD_UNIT)
