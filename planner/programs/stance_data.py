"""Scaled rows of all hands of a stance: the input data of the conic programs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace
from planner.programs.conic import Columns
from planner.programs.scaled_rows import WRENCH_UNIT, ScaledRows

__all__ = ["HandData", "HandRows", "StanceData", "blocks_of", "hands_data", "parted"]


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
        whole = np.zeros((balance + len(rest), len(unit)))
        for hand, (limits, hard, loads) in zip(hands, blocks_of(hands, balance), strict=True):
            whole[:balance, loads] = hand.G
            whole[limits, loads] = hand.L
            whole[hard, loads] = hand.H
        tie = np.concatenate([hand.tie for hand in hands])
        return cls(whole, rest, sum(len(hand.l0) for hand in hands), unit, tie)

    def with_hands(self, hands: Sequence[HandData], others: Iterable[int]) -> HandRows:
        """Return the rows of as many hands of as many rows, of which some are others."""
        whole, rest, tie = self.whole.copy(), self.rest.copy(), self.tie.copy()
        balance = len(whole) - len(rest)
        blocks = blocks_of(hands, balance)
        for h in others:
            hand, (limits, hard, loads) = hands[h], blocks[h]
            whole[:balance, loads], whole[limits, loads], whole[hard, loads] = (
                hand.G,
                hand.L,
                hand.H,
            )
            rest[limits.start - balance : limits.stop - balance] = -hand.l0
            rest[hard.start - balance : hard.stop - balance] = hand.h
            tie[loads] = hand.tie
        return HandRows(whole, rest, self.limits, self.unit, tie, self.kept)

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


def blocks_of(hands: Sequence[HandData], balance: int) -> list[tuple[slice, slice, slice]]:
    """Return which of all rows are each hand's limits and hard rows, and which are its loads.

    ``balance`` is the number of rows of the balance, which come first.
    """
    sizes = [*(len(hand.l0) for hand in hands), *(len(hand.h) for hand in hands)]
    rows = [slice(*ends) for ends in pairwise(accumulate(sizes, initial=balance))]
    ends = pairwise(accumulate([len(hand.unit) for hand in hands], initial=0))
    loads = [slice(*each) for each in ends]
    return list(zip(rows[: len(hands)], rows[len(hands) :], loads, strict=True))


def parted(whole: Array, sizes: Iterable[int]) -> tuple[Array, ...]:
    """Split an array into consecutive parts of the given sizes."""
    ends = list(accumulate(sizes, initial=0))
    return tuple([whole[begin:end] for begin, end in pairwise(ends)])
