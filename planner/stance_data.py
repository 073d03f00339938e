"""The rows of a stance's hands, nondimensional: what the conic programs are given.

Loads are over `LOAD_UNIT` (a floating wrist's twist over `TWIST_UNIT`), body wrenches over
`WRENCH_UNIT`, limit rows over their capacities: one physical scaling for all programs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from hand_models.floating_wrist import WRIST
from hand_models.frames import Array
from hand_models.row_layout import TENDON_TENSION
from hand_models.wrench_space import Row, WrenchSpace
from hand_models.wrist_limit import pose_units

__all__ = [
    "JOINT_TORQUE",
    "LOAD_UNIT",
    "TWIST_UNIT",
    "WRENCH_UNIT",
    "WRIST_RANGE",
    "HandData",
    "Shape",
    "StanceData",
    "beyond",
    "body_wrench",
    "used_effort",
]

LOAD_UNIT: Final = 100.0
"""Scale of a hand's loads y [N]."""

TWIST_UNIT: Final = pose_units(WRIST)
"""Scale of a floating wrist's twist y [m, rad]: about what loads a hand by `LOAD_UNIT`."""

WRENCH_UNIT: Final = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""Scale of a body wrench [N, N·m]."""

WRIST_RANGE: Final = "wrist_range"
"""Name of the hard rows within which a floating hand's set is linearised."""

JOINT_TORQUE: Final = "joint_torque"
"""Name of the limit rows of a limb's joints."""

SECONDARY: Final = 1e-4
"""Weight in the tie-break of loads that are not tensions: enough to make them unique."""

LIGHT: Final = 0.1
"""How much less of that weight they have where the effort itself is least."""


class HandData(NamedTuple):
    """One hand's rows, nondimensional; nb rows of balance.

    Attributes
    ----------
    G, g : ndarray, shapes (nb, m), (nb,)
        Its part of the body wrench, and of what hands are to hold, G z + g.
    L, l0 : ndarray, shapes (nl, m), (nl,)
        Utilisations L z + l0.
    H, h : ndarray, shapes (nh, m), (nh,)
        Hard rows H z ≤ h.
    E, e0 : ndarray, shapes (ne, m), (ne,)
        Efforts E z + e0: tensions and joint torques over their capacities.
    tie : ndarray, shape (m,)
        Weights of z in the tie-break.
    rest : ndarray, shape (m,)
        Weights of loads that are no tensions beside the effort; zero for tensions.
    unit : ndarray, shape (m,)
        Of z: the loads are ``y = unit z`` [N], of a floating wrist [m, rad].
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
    def of(
        cls,
        space: WrenchSpace,
        transport: Array,
        reach: Array | None = None,
        held: Array | None = None,
    ) -> HandData:
        """Scale a hand's set.

        Parameters
        ----------
        space : WrenchSpace
        transport : ndarray, shape (6, 6)
            Ad(B←H).
        reach : ndarray, shape (m,), optional
            The maximum of each column's load [N], for the tie-break; tensions come first. A
            floating wrist's twist is measured by its unit.
        held : ndarray, shape (nb − 6, 6), optional
            What the further rows of the balance take of this hand's wrench in H.
        """
        carried = -transport / WRENCH_UNIT[:, None]
        if held is not None:
            carried = np.vstack([carried, held / WRENCH_UNIT])
        weights = np.array(
            [1.0 if name.endswith("/tension") else SECONDARY**0.5 for name in space.columns]
        )
        floats = space.columns == WRIST
        unit = TWIST_UNIT if floats else np.full(len(space.columns), LOAD_UNIT)
        # hard rows are in newtons, but for those of a wrist's range
        ranges = [row.limit == WRIST_RANGE for row in space.rows[len(space.s) :]]
        over = np.where(ranges, 1.0, 1.0 / LOAD_UNIT)
        L, l0 = space.L / space.s[:, None] * unit, space.l0 / space.s
        efforts = [i for i, row in enumerate(space.rows[: len(space.s)]) if _is_effort(row)]
        tie = weights * (1.0 if reach is None else unit / reach)
        return cls(
            G=carried @ space.generators * unit,
            g=carried @ space.origin,
            L=L,
            l0=l0,
            H=space.H * unit * over[:, None],
            h=space.h * over,
            E=L[efforts],
            e0=l0[efforts],
            tie=tie,
            rest=np.where(weights < 1.0, LIGHT**0.5 * tie, 0.0),
            unit=unit,
        )

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """(m, nl, nh, ne)."""
        return self.G.shape[1], len(self.l0), len(self.h), len(self.e0)

    def capped(self, utilisation: float) -> HandData:
        """Return the hand with its limits at a utilisation as hard rows, and no others."""
        return self._replace(
            L=self.L[:0],
            l0=self.l0[:0],
            H=np.vstack([self.L, self.H]),
            h=np.concatenate([utilisation - self.l0, self.h]),
        )


def _is_effort(row: Row) -> bool:
    """Whether a limit row's utilisation counts as effort: a torque's with one of its two signs."""
    return row.limit == TENDON_TENSION or (row.limit == JOINT_TORQUE and row.label.endswith("+"))


class Shape(NamedTuple):
    """What a program is built for: rows of balance, and (m, nl, nh, ne) of each hand."""

    balance: int
    hands: tuple[tuple[int, int, int, int], ...]


@dataclass(frozen=True, eq=False)
class StanceData:
    """All hands of a stance, and what their balance is to give, scaled, shape (nb,).

    First the body wrench (6,), then the components of hands' wrenches that are given.
    """

    hands: tuple[HandData, ...]
    wrench: Array

    @property
    def shape(self) -> Shape:
        """What a program is built for."""
        return Shape(len(self.wrench), tuple(hand.shape for hand in self.hands))

    @property
    def offset(self) -> Array:
        """What the loads' part of the balance is to give, W − Σ g, shape (nb,)."""
        return np.asarray(self.wrench - sum(hand.g for hand in self.hands))

    def capped(self, utilisation: float) -> StanceData:
        """Return the stance with limits at a utilisation as hard rows, and no others."""
        return StanceData(tuple(hand.capped(utilisation) for hand in self.hands), self.wrench)

    def turned(self, wrench: Array) -> StanceData:
        """Return the stance with another balance."""
        return StanceData(self.hands, wrench)


def body_wrench(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the scaled balance that the hands' loads y give, shape (nb,)."""
    parts = [hand.G @ (y / hand.unit) + hand.g for hand, y in zip(data.hands, loads, strict=True)]
    return np.asarray(sum(parts, start=np.zeros_like(data.wrench)))


def beyond(data: StanceData, loads: Sequence[Array], cap: float) -> float:
    """Return by how much loads y exceed limits at a cap, or break hard rows, scaled; at least 0."""
    worst = 0.0
    for hand, y in zip(data.hands, loads, strict=True):
        z = y / hand.unit
        worst = max(worst, float((hand.L @ z + hand.l0 - cap).max(initial=0.0)))
        worst = max(worst, float((hand.H @ z - hand.h).max(initial=0.0)))
    return worst


def used_effort(data: StanceData, loads: Sequence[Array]) -> float:
    """Return Σ ‖E z + e₀‖²: the sum of squared relative tensions and joint torques."""
    return sum(
        float(np.sum((hand.E @ (y / hand.unit) + hand.e0) ** 2))
        for hand, y in zip(data.hands, loads, strict=True)
    )
