"""The settled hands of a stance in arrays: one hand after another, each with its tiles in order.

There are T tiles and nails, F = 4 H fingers, and H hands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, NAIL, SettledHand, SettledTile

__all__ = [
    "CONTACT_CODES",
    "KEPT_NAMES",
    "ContactPattern",
    "HandBatch",
    "TileIndex",
    "concatenated",
    "contact_pattern_of",
    "tile_index_of",
]

KEPT_NAMES: Final = 256
"""Lists of names (of tiles, columns, rows) of which something is kept: some 5 kB each."""

Number = TypeVar("Number", bound=np.generic)

CONTACT_CODES: Final = {"none": 0, "face": 1, "edge": 1, "frame": 2, NAIL: 3}
"""Codes of the contact states of a tile: its face and its edge hold alike."""


class _Part(IntEnum):
    """Parts of a finger with tiles, but for its phalanges, which come between."""

    BASE = 0
    NAIL = len(PHALANGES) + 1


@dataclass(frozen=True, eq=False)
class TileIndex:
    """Index of the tiles of all hands, by how many each hand has.

    Attributes
    ----------
    hand, finger : ndarray of int, shape (T,)
        Hand and finger of each tile, the fingers counted through all hands.
    first : ndarray of int, shape (H,)
        Each hand's first tile.
    first_of_finger : ndarray of int, shape (F,)
        Each finger's first tile.
    phalanges : ndarray of int, shape (F, 3)
        Tiles of each finger's phalanges.
    tips : ndarray of int, shape (F,)
        The last of these.
    bases, base_fingers : ndarray of int, shape (2 H,)
        The tiles on rotating bases, and their fingers.
    nails : ndarray of int
        Nails, whether they hook or not.
    """

    hand: Indices
    finger: Indices
    first: Indices
    first_of_finger: Indices
    phalanges: Indices
    tips: Indices
    bases: Indices
    base_fingers: Indices
    nails: Indices


def _parts_of_hand(*, nails: bool) -> Indices:
    """Return finger and part of each tile of a hand, shape (n, 2); parts by `_Part`."""
    last = _Part.NAIL if nails else _Part.NAIL - 1
    return np.array(
        [
            (i, part)
            for i, name in enumerate(FINGERS)
            for part in range(_Part.BASE if name.startswith("outer") else _Part.BASE + 1, last + 1)
        ],
        dtype=np.intp,
    )


TILE_PARTS: Final = {nails: _parts_of_hand(nails=nails) for nails in (False, True)}
"""Fingers and parts of the tiles of a hand, by whether it clings with its nails."""


def tile_index_of(counts: Sequence[int]) -> TileIndex:
    """Return the places of hands that have so many tiles each."""
    hand = np.arange(len(counts)).repeat(counts)
    of_each = np.concatenate([TILE_PARTS[count > len(TILE_PARTS[False])] for count in counts])
    finger, part = len(FINGERS) * hand + of_each[:, 0], of_each[:, 1]
    phalanges = np.flatnonzero((part != _Part.BASE) & (part != _Part.NAIL)).reshape(
        -1, len(PHALANGES)
    )
    bases = np.flatnonzero(part == _Part.BASE)
    return TileIndex(
        hand=hand,
        finger=finger,
        first=hand.searchsorted(np.arange(len(counts))),
        first_of_finger=finger.searchsorted(np.arange(len(phalanges))),
        phalanges=phalanges,
        tips=phalanges[:, -1].copy(),
        bases=bases,
        base_fingers=finger[bases],
        nails=np.flatnonzero(part == _Part.NAIL),
    )


class ContactPattern(NamedTuple):
    """Contact states of the tiles of some hands.

    Attributes
    ----------
    contacts : ndarray of int, shape (T,)
        Codes of `CONTACT_CODES`.
    touches, framed : ndarray, shape (T,)
        One for tiles on rock, zero for others; the same of those whose frame rests beside them.
    away : ndarray of bool, shape (T,)
        Tiles that are not on rock.
    touching, idle : ndarray of int
        Tiles on rock; tiles that touch nothing.
    holding : tuple of int, length F
        How many tiles and nails of each finger are on rock that they hold.
    """

    contacts: Indices
    touches: Array
    framed: Array
    away: NDArray[np.bool_]
    touching: Indices
    idle: Indices
    holding: tuple[int, ...]


def contact_pattern_of(hands: tuple[tuple[SettledTile, ...], ...]) -> ContactPattern:
    """Return the contact states of hands with these tiles."""
    places = tile_index_of(tuple(map(len, hands)))
    contacts = np.array([CONTACT_CODES[tile.contact] for hand in hands for tile in hand])
    away = contacts != CONTACT_CODES["face"]
    touches = 1.0 - away
    holds = touches + (contacts == CONTACT_CODES[NAIL])
    return ContactPattern(
        contacts=contacts,
        touches=touches,
        framed=1.0 * (contacts == CONTACT_CODES["frame"]),
        away=away,
        touching=np.flatnonzero(touches),
        idle=np.flatnonzero(contacts == CONTACT_CODES["none"]),
        holding=tuple(np.add.reduceat(holds, places.first_of_finger).astype(int).tolist()),
    )


@dataclass(frozen=True, eq=False)
class HandBatch:
    """Settled hands of a stance, in arrays over all of them.

    Attributes
    ----------
    hands : tuple of SettledHand
    places : TileIndex
    touch : ContactPattern
    points : ndarray, shape (T + H, 3)
        Places of all tiles, then of all palms.
    axes : ndarray, shape (T, 3, 3)
    engagement, lateral_shares : ndarray, shape (T,)
        As of `SettledHand`.
    angles : ndarray, shape (F, 3)
        Angle of each phalanx [rad].
    bends : ndarray, shape (F, 3)
        Angle of each joint, relative to the phalanx before it [rad].
    palm_limits : ndarray, shape (H, 2)
        Limits of each palm's shear and pressing; infinite where it touches nothing [N].
    """

    hands: tuple[SettledHand, ...]
    places: TileIndex
    touch: ContactPattern
    points: Array
    axes: Array
    engagement: Array
    lateral_shares: Array
    angles: Array
    bends: Array
    palm_limits: Array

    @classmethod
    def of(cls, hands: Sequence[SettledHand]) -> HandBatch:
        """Return the arrays of settled hands."""
        tiles = tuple([hand.tiles for hand in hands])
        positions = [hand.positions for hand in hands]
        angles = concatenated([hand.postures.angles for hand in hands])
        # what touches nothing uses nothing
        limits = [
            (hand.palm.shear_limit, hand.palm.pressing_limit)
            if hand.palm.engaged
            else (math.inf, math.inf)
            for hand in hands
        ]
        points = np.concatenate([*positions, [hand.palm.centre for hand in hands]])
        axes = concatenated([hand.axes for hand in hands])
        engagement = concatenated([hand.engagement for hand in hands])
        # plans show them
        points.setflags(write=False)
        axes.setflags(write=False)
        engagement.setflags(write=False)
        return cls(
            tuple(hands),
            tile_index_of(tuple(map(len, tiles))),
            contact_pattern_of(tiles),
            points,
            axes,
            engagement,
            concatenated([hand.lateral_shares for hand in hands]),
            angles,
            np.diff(angles, axis=1, prepend=0.0),
            np.array(limits),
        )

    @property
    def closing_tensions(self) -> tuple[float, ...]:
        """Closing tension of each hand [N]."""
        return tuple([hand.closing_tension for hand in self.hands])

    @property
    def friction(self) -> Array:
        """Friction coefficient of each tile's surface, shape (T,)."""
        each = np.array([hand.surface.friction for hand in self.hands])
        return each[self.places.hand]

    @property
    def stops(self) -> NDArray[np.int8]:
        """Limit that each joint stands at, codes of `JOINT_STOPS`, shape (F, 3)."""
        return concatenated([hand.postures.stops for hand in self.hands])


def concatenated(parts: Sequence[NDArray[Number]]) -> NDArray[Number]:
    """Return the hands' arrays one after another."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
