"""Scaled rows of all hands of a stance: the input data of the conic programs.

Loads are over `LOAD_UNIT` (a wrist's twist over `TWIST_UNIT`), body wrenches over `WRENCH_UNIT`,
limit rows over their capacities: one physical scaling for all programs.

`ScaledRows` are the hand's data except its part of the balance: the same wherever the hand is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import accumulate, pairwise
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.compliance import WRIST_COLUMNS, pose_units
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR, TENDON_TENSION
from hand_models.wrench_spaces import Row, WrenchSpace
from planner.programs.conic import Columns

__all__ = [
    "JOINT_FORCE",
    "JOINT_TORQUE",
    "LOAD_UNIT",
    "TWIST_UNIT",
    "WRENCH_UNIT",
    "WRIST_RANGE",
    "HandData",
    "HandRows",
    "ScaledRows",
    "StanceData",
    "hands_data",
    "is_effort",
    "parted",
]

LOAD_UNIT: Final = 100.0
"""Scale of a hand's loads y [N]."""

TWIST_UNIT: Final = pose_units(WRIST_COLUMNS)
"""Scale of a wrist's twist y [m, rad]: a twist that loads a hand by roughly `LOAD_UNIT`."""

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


WRENCH_UNIT: Final = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""Scale of a body wrench [N, N·m]."""


class HandData(NamedTuple):
    """Scaled rows of one hand, in its scaled loads z, shape (m,); nb rows of the balance.

    Attributes
    ----------
    G, g : ndarray, shapes (nb, m), (nb,)
        The hand's part of the balance, G z + g: body wrench, then prescribed hand wrenches.
    L, l0 : ndarray, shapes (nl, m), (nl,)
        Limits: utilisations L z + l0.
    H, h : ndarray, shapes (nh, m), (nh,)
        Hard rows: H z ≤ h.
    E, e0 : ndarray, shapes (ne, m), (ne,)
        Efforts E z + e0: tensions and joint torques over their capacities.
    tie : ndarray, shape (m,)
        Weights of z² in the tie-break.
    rest : ndarray, shape (m,)
        Weights of z² that the effort adds for loads other than tensions; zero for tensions.
    unit : ndarray, shape (m,)
        Units of z: the loads are ``y = unit z`` [N], of a floating wrist its twist [m, rad].
    """

    G: Array
    g: Array
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
    def of(cls, space: WrenchSpace, transport: Array, held: Array | None = None) -> HandData:
        """Scale a hand's wrench space, and carry its wrench to the body.

        Parameters
        ----------
        space : WrenchSpace
        transport : ndarray, shape (6, 6)
            Ad(B←H), which carries a wrench from the hand frame H to the body frame B.
        held : ndarray, shape (nb − 6, 6), optional
            Selects the hand's prescribed wrench components, in H, for the last rows of the balance.
        """
        given = np.zeros((0, 6)) if held is None else held
        return hands_data([ScaledRows.of(space)], transport[None], [given])[0]

    def capped(self, utilisation: float) -> HandData:
        """Return the hand with its limits, at a given utilisation, turned into hard rows."""
        return self._replace(
            L=self.L[:0],
            l0=self.l0[:0],
            H=np.vstack([self.L, self.H]),
            h=np.concatenate([utilisation - self.l0, self.h]),
        )

    def about(self, centre: Array, stiffness: float) -> HandData:
        """Return the hand with loads relative to a centre, shape (m,) in units of z.

        ``stiffness`` multiplies the weights of the tie-break.
        """
        return self._replace(
            g=self.g + self.G @ centre,
            l0=self.l0 + self.L @ centre,
            h=self.h - self.H @ centre,
            e0=self.e0 + self.E @ centre,
            tie=stiffness * self.tie,
        )

    def held(self, y: Array) -> HandData:
        """Return the hand with all loads fixed at y, shape (m,): no variables, no hard rows."""
        fixed, none = self.about(y / self.unit, 1.0), np.zeros(0)
        fixed = fixed._replace(H=np.zeros((0, 0)), h=none, tie=none, rest=none, unit=none)
        return fixed._replace(G=self.G[:, :0], L=self.L[:, :0], E=self.E[:, :0])


def hands_data(
    scaled: Sequence[ScaledRows], transports: Array, held: Sequence[Array]
) -> tuple[HandData, ...]:
    """Return the scaled data of hands from their scaled rows and their poses.

    Parameters
    ----------
    scaled : sequence of ScaledRows
    transports : ndarray, shape (hands, 6, 6)
        Ad(B←H) of each hand.
    held : sequence of ndarray, shape (nb − 6, 6)
        Selects each hand's prescribed wrench components, in H, for the last rows of the balance.
    """
    found = []
    for rows, carried, given in zip(scaled, -transports / WRENCH_UNIT[:, None], held, strict=True):
        if len(given):
            carried = np.vstack([carried, given / WRENCH_UNIT])
        G = carried @ rows.generators
        # a solver is set up for the places of zeros, which must not depend on rounding
        G[np.abs(G) < 1e-14] = 0.0
        # beside the generators and the origin, all is the same wherever the hand is
        found.append(HandData(G, carried @ rows.origin, *rows[2:]))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class HandRows:
    """Rows of all hands in all their scaled loads z (M,): balance G z, limits L z, hard rows H z.

    Attributes
    ----------
    whole : ndarray, shape (nb + Σ nl + Σ nh, M)
        G above L above H.
    rest : ndarray, shape (Σ nl + Σ nh,)
        −l0 above h.
    limits : int
        Number of limit rows, Σ nl.
    unit, tie : ndarray, shape (M,)
        Units and tie-break weights, as in `HandData`.
    kept : ndarray of bool, shape as ``whole``, or None
        True where ``columns`` have an entry, also if it is zero.
    """

    whole: Array
    rest: Array
    limits: int
    unit: Array
    tie: Array
    kept: NDArray[np.bool_] | None = None

    @classmethod
    def of(cls, hands: Sequence[HandData], balance: int) -> HandRows:
        """Stack the rows of hands; ``balance`` is the number of rows of the balance."""
        unit = np.concatenate([hand.unit for hand in hands])
        rest = np.concatenate([*(-hand.l0 for hand in hands), *(hand.h for hand in hands)])
        limits = sum(len(hand.l0) for hand in hands)
        whole = np.zeros((balance + len(rest), len(unit)))
        left, limit, below = 0, balance, balance + limits
        for hand in hands:
            right, end, next_limit = (
                left + len(hand.unit),
                below + len(hand.h),
                limit + len(hand.l0),
            )
            whole[:balance, left:right] = hand.G
            whole[limit:next_limit, left:right] = hand.L
            whole[below:end, left:right] = hand.H
            left, limit, below = right, next_limit, end
        tie = np.concatenate([hand.tie for hand in hands])
        return cls(whole, rest, limits, unit, tie)

    @cached_property
    def columns(self) -> Columns:
        """``whole`` as a sparse matrix."""
        return Columns.of(self.whole, self.kept)


@dataclass(frozen=True, eq=False)
class StanceData:
    """Scaled data of all hands of a stance, and the right-hand side of their balance.

    Attributes
    ----------
    hands : tuple of HandData
    wrench : ndarray, shape (nb,)
        Body wrench (6,), then the prescribed components of hands' wrenches, in `WRENCH_UNIT`.
    rows : HandRows
        Rows of all hands below each other.
    """

    hands: tuple[HandData, ...]
    wrench: Array
    rows: HandRows

    @classmethod
    def of(cls, hands: tuple[HandData, ...], wrench: Array) -> StanceData:
        """Return the data of hands and of the wrench, shape (nb,), that they are to balance."""
        return cls(hands, wrench, HandRows.of(hands, len(wrench)))

    @property
    def offset(self) -> Array:
        """Right-hand side of the balance G z = W − Σ g, shape (nb,), in `WRENCH_UNIT`."""
        return np.asarray(self.wrench - sum(hand.g for hand in self.hands))

    def capped(self, utilisation: float) -> StanceData:
        """Return the stance with its limits, at a given utilisation, turned into hard rows."""
        hands = tuple(hand.capped(utilisation) for hand in self.hands)
        return StanceData.of(hands, self.wrench)

    def by_rows(
        self, values: Array, *, limits: bool = True
    ) -> tuple[Array, tuple[Array, ...], tuple[Array, ...]]:
        """Split an array over all rows into the balance, each hand's limits, each hand's hard rows.

        Without ``limits`` the array has no limit rows.
        """
        of_limits = [len(hand.l0) for hand in self.hands] if limits else []
        sizes = [len(self.wrench), *of_limits, *(len(hand.h) for hand in self.hands)]
        balance, *others = parted(values, sizes)
        return balance, tuple(others[: len(of_limits)]), tuple(others[len(of_limits) :])

    def turned(self, wrench: Array) -> StanceData:
        """Return the stance for another right-hand side of the balance, shape (nb,), scaled."""
        return replace(self, wrench=wrench)


def parted(whole: Array, sizes: Iterable[int]) -> tuple[Array, ...]:
    """Split an array into consecutive parts of the given sizes."""
    ends = list(accumulate(sizes, initial=0))
    return tuple([whole[begin:end] for begin, end in pairwise(ends)])
