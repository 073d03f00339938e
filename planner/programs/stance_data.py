"""The rows of a stance's hands, nondimensional: what the conic programs are given.

Loads are over `LOAD_UNIT` (a floating wrist's twist over `TWIST_UNIT`), body wrenches over
`WRENCH_UNIT`, limit rows over their capacities: one physical scaling for all programs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.wrench_spaces import WrenchSpace
from planner.programs.row_scaling import (
    JOINT_TORQUE,
    LOAD_UNIT,
    TWIST_UNIT,
    WRIST_RANGE,
    ScaledRows,
    scaled_rows,
)

__all__ = [
    "JOINT_TORQUE",
    "LOAD_UNIT",
    "TWIST_UNIT",
    "WRENCH_UNIT",
    "WRIST_RANGE",
    "Columns",
    "HandData",
    "HandRows",
    "StanceData",
    "beyond",
    "body_wrench",
    "hands_data",
    "parted",
    "used_effort",
]

WRENCH_UNIT: Final = np.array([300.0, 300.0, 300.0, 30.0, 30.0, 30.0])
"""Scale of a body wrench [N, N·m]."""

ROUNDING: Final = 1e-14
"""What of a scaled entry is left of others that cancel: a zero. A solver is set up for where zeros
are, and that must not hang on rounding."""


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
        Weights of z² in the tie-break.
    rest : ndarray, shape (m,)
        Weights of z², of loads that are no tensions, beside the effort; zero for tensions.
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
    def of(cls, space: WrenchSpace, transport: Array, held: Array | None = None) -> HandData:
        """Scale a hand's set.

        Parameters
        ----------
        space : WrenchSpace
        transport : ndarray, shape (6, 6)
            Ad(B←H).
        held : ndarray, shape (nb − 6, 6), optional
            What the further rows of the balance take of this hand's wrench in H.
        """
        given = np.zeros((0, 6)) if held is None else held
        return hands_data(scaled_rows([space]), transport[None], [given])[0]

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


def hands_data(
    scaled: Sequence[ScaledRows], transports: Array, held: Sequence[Array]
) -> tuple[HandData, ...]:
    """Return the data of some hands.

    Parameters
    ----------
    scaled : sequence of ScaledRows
        Their sets' rows, which are the same wherever the hands are.
    transports : ndarray, shape (hands, 6, 6)
        Ad(B←H).
    held : sequence of ndarray, shape (nb − 6, 6)
        What the further rows of the balance take of each hand's wrench in H.
    """
    found = []
    for rows, carried, given in zip(scaled, -transports / WRENCH_UNIT[:, None], held, strict=True):
        if len(given):
            carried = np.vstack([carried, given / WRENCH_UNIT])
        G = carried @ rows.generators
        G[np.abs(G) < ROUNDING] = 0.0
        found.append(HandData(G, carried @ rows.origin, *rows[2:]))
    return tuple(found)


class Columns(NamedTuple):
    """A matrix without its zeros, in compressed columns.

    Attributes
    ----------
    values : ndarray, shape (n,)
    rows : ndarray of int, shape (n,)
        Of the values, column by column.
    starts : ndarray of int, shape (columns + 1,)
        Where each column begins in them, and where the last one ends.
    """

    values: Array
    rows: Indices
    starts: Indices

    @classmethod
    def of(cls, matrix: Array) -> Columns:
        """Leave the zeros of a matrix out."""
        height, width = matrix.shape
        flat = matrix.T.ravel()
        # of truth values they are found six times as fast as of numbers
        (places,) = (flat != 0.0).nonzero()
        starts = places.searchsorted(height * np.arange(width + 1))
        return cls(flat.take(places), places % max(height, 1), starts)

    @classmethod
    def beside(cls, parts: Sequence[Columns]) -> Columns:
        """Put some with the same rows beside each other."""
        ends = np.cumsum([0, *(part.starts[-1] for part in parts)])
        starts = [part.starts[:-1] + end for part, end in zip(parts, ends, strict=False)]
        return cls(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.rows for part in parts]),
            np.concatenate([*starts, ends[-1:]]),
        )


class HandRows(NamedTuple):
    """All hands' rows in all their loads z (M,): G z of the balance, limits L z, hard rows H z.

    Attributes
    ----------
    whole : ndarray, shape (nb + Σ nl + Σ nh, M)
        G above L above H.
    columns : Columns
        The same without its zeros.
    rest : ndarray, shape (Σ nl + Σ nh,)
        −l0 above h.
    limits : int
        Σ nl.
    unit, tie : ndarray, shape (M,)
        Of `HandData`.
    """

    whole: Array
    columns: Columns
    rest: Array
    limits: int
    unit: Array
    tie: Array

    @classmethod
    def of(cls, hands: Sequence[HandData], balance: int) -> HandRows:
        """Write the rows of hands below each other."""
        unit = np.concatenate([hand.unit for hand in hands])
        rest = np.concatenate([*(-hand.l0 for hand in hands), *(hand.h for hand in hands)])
        limits = sum(len(hand.l0) for hand in hands)
        whole = np.zeros((balance + len(rest), len(unit)))
        left, limit, below = 0, balance, balance + limits
        for hand in hands:
            m, nl, nh, _ = hand.shape
            right = left + m
            whole[:balance, left:right] = hand.G
            whole[limit : limit + nl, left:right] = hand.L
            whole[below : below + nh, left:right] = hand.H
            left, limit, below = right, limit + nl, below + nh
        tie = np.concatenate([hand.tie for hand in hands])
        return cls(whole, Columns.of(whole), rest, limits, unit, tie)


@dataclass(frozen=True, eq=False)
class StanceData:
    """All hands of a stance, and what their balance is to give, scaled, shape (nb,).

    First the body wrench (6,), then the components of hands' wrenches that are given.
    """

    hands: tuple[HandData, ...]
    wrench: Array

    @cached_property
    def offset(self) -> Array:
        """What the loads' part of the balance is to give, W − Σ g, shape (nb,)."""
        return np.asarray(self.wrench - sum(hand.g for hand in self.hands))

    def capped(self, utilisation: float) -> StanceData:
        """Return the stance with limits at a utilisation as hard rows, and no others."""
        return StanceData(tuple(hand.capped(utilisation) for hand in self.hands), self.wrench)

    @cached_property
    def rows(self) -> HandRows:
        """All hands' rows below each other."""
        return HandRows.of(self.hands, len(self.wrench))

    def turned(self, wrench: Array) -> StanceData:
        """Return the stance with another balance."""
        turned = StanceData(self.hands, wrench)
        turned.__dict__["rows"] = self.rows
        return turned


def parted(whole: Array, sizes: Iterable[int]) -> tuple[Array, ...]:
    """Return the parts of an array, one after another, of these sizes."""
    ends = list(accumulate(sizes, initial=0))
    return tuple([whole[begin:end] for begin, end in pairwise(ends)])


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


def used(data: StanceData, loads: Sequence[Array]) -> Array:
    """Return the utilisation of every limit row, hand by hand, shape (sum of nl,)."""
    parts = zip(data.hands, loads, strict=True)
    return np.concatenate([hand.L @ (y / hand.unit) + hand.l0 for hand, y in parts])


def used_effort(data: StanceData, loads: Sequence[Array]) -> float:
    """Return Σ ‖E z + e₀‖²: the sum of squared relative tensions and joint torques."""
    return sum(
        float(np.sum((hand.E @ (y / hand.unit) + hand.e0) ** 2))
        for hand, y in zip(data.hands, loads, strict=True)
    )
