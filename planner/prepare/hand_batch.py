"""Arrays over all settled hands of a stance: one hand after another, each with its tiles in order.

Sizes: H hands, F = 4 H fingers, T tiles and nails.
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
from hand_models.fixed_wrist import SLIPPED_TILE
from hand_models.hand import FINGERS, NAIL, SettledHand, SettledTile

__all__ = [
    "CONTACT_CODES",
    "ContactPattern",
    "HandBatch",
    "TileIndex",
    "concatenated",
    "contact_pattern_of",
    "tile_index_of",
]

Number = TypeVar("Number", bound=np.generic)

CONTACT_CODES: Final = {"none": 0, "face": 1, "edge": 1, "frame": 2, NAIL: 3, SLIPPED_TILE: 4}
"""Code of each contact state; ``face`` and ``edge`` share a code, as they carry load alike."""


class _Part(IntEnum):
    """Parts of a finger with tiles, but for its phalanges, which come between."""

    BASE = 0
    NAIL = len(PHALANGES) + 1


@dataclass(frozen=True, eq=False)
class TileIndex:
    """Index arrays of the tiles of all hands.

    Attributes
    ----------
    hand, finger : ndarray of int, shape (T,)
        Hand and finger of each tile; fingers are numbered through all hands.
    first : ndarray of int, shape (H,)
        First tile of each hand.
    first_of_finger : ndarray of int, shape (F,)
        First tile of each finger.
    phalanges : ndarray of int, shape (F, 3)
        Tiles on the phalanges of each finger.
    tips : ndarray of int, shape (F,)
        Tile on the last phalanx of each finger.
    bases, base_fingers : ndarray of int, shape (2 H,)
        Tiles on the rotating bases of outer fingers, and the fingers of these tiles.
    nails : ndarray of int
        Entries among the T that are fingernails, whether the nails hook or not.
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
"""Finger and part of each tile of a hand, by whether the hand has nails."""


def tile_index_of(counts: Sequence[int]) -> TileIndex:
    """Return the index arrays of all tiles.

    Parameters
    ----------
    counts : sequence of int, length H
        Number of tiles (and nails) of each hand.
    """
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
        Contact state of each tile, as code of `CONTACT_CODES`.
    touches : ndarray, shape (T,)
        1 for a tile on rock (face or edge), else 0.
    framed : ndarray, shape (T,)
        1 for a tile beside which the phalanx's frame presses on rock, else 0.
    away : ndarray of bool, shape (T,)
        True for a tile that is not on rock.
    touching, idle : ndarray of int
        Indices of the tiles on rock, and of the tiles that touch nothing.
    slipped : ndarray of int
        Indices of the tiles that have slipped, and drag on.
    holding : tuple of int, length F
        Number of each finger's tiles and nails that are on rock.
    """

    contacts: Indices
    touches: Array
    framed: Array
    away: NDArray[np.bool_]
    touching: Indices
    idle: Indices
    slipped: Indices
    holding: tuple[int, ...]


def contact_pattern_of(
    hands: Sequence[tuple[SettledTile, ...]], places: TileIndex
) -> ContactPattern:
    """Return the contact states of all tiles, as arrays.

    Parameters
    ----------
    hands : sequence of tuple of SettledTile
        Tiles of each hand, with their contact states.
    places : TileIndex
        Index arrays of these tiles.
    """
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
        slipped=np.flatnonzero(contacts == CONTACT_CODES[SLIPPED_TILE]),
        holding=tuple(np.add.reduceat(holds, places.first_of_finger).astype(int).tolist()),
    )


@dataclass(frozen=True, eq=False)
class HandBatch:
    """Settled hands of a stance, as arrays over all of them. Vectors are in each hand's frame H.

    Attributes
    ----------
    hands : tuple of SettledHand
        The hands, closed on their holds.
    places : TileIndex
        Indices of the tiles by hand, finger and phalanx.
    touch : ContactPattern
        Contact states of the tiles.
    points : ndarray, shape (T + H, 3)
        Positions of all tiles, then of all palms [m].
    axes : ndarray, shape (T, 3, 3)
        Rows: unit forces of each tile's shear, normal and lateral load.
    engagement : ndarray, shape (T,)
        Share of each tile's spines that are on the rock.
    lateral_shares : ndarray, shape (T,)
        Share of the finger's lateral reaction that each tile carries, as in `SettledHand`.
    angles : ndarray, shape (F, 3)
        Angle of each phalanx from x toward z of its finger frame F [rad].
    bends : ndarray, shape (F, 3)
        Angle of each joint, relative to the phalanx before it [rad].
    friction : ndarray, shape (T,)
        Friction coefficient of each tile's surface.
    palm_limits : ndarray, shape (H, 2)
        Limits of each palm's shear and pressing [N]; infinite for a palm that touches nothing.
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
    friction: Array
    palm_limits: Array

    @classmethod
    def of(cls, hands: Sequence[SettledHand]) -> HandBatch:
        """Collect the arrays of settled hands, one hand after another."""
        tiles = [hand.tiles for hand in hands]
        positions = [hand.positions for hand in hands]
        angles = concatenated([hand.postures.angles for hand in hands])
        points = np.concatenate([*positions, [hand.palm.centre for hand in hands]])
        axes = concatenated([hand.axes for hand in hands])
        engagement = concatenated([hand.engagement for hand in hands])
        bends = angles.copy()
        bends[:, 1:] -= angles[:, :-1]
        places = tile_index_of([len(own) for own in tiles])
        # plans show them
        points.setflags(write=False)
        axes.setflags(write=False)
        engagement.setflags(write=False)
        return cls(
            tuple(hands),
            places,
            contact_pattern_of(tiles, places),
            points,
            axes,
            engagement,
            concatenated([hand.lateral_shares for hand in hands]),
            angles,
            bends,
            np.array([hand.surface.friction for hand in hands])[places.hand],
            _palm_limits(hands),
        )

    def after_slips(self, hands: Sequence[SettledHand]) -> HandBatch:
        """Return the same hands after tiles have slipped: no hand, and no finger, has moved.

        Parameters
        ----------
        hands : sequence of SettledHand
            As of `hand_models.fixed_wrist.slipped_hand`, or as they were.
        """
        engagement = concatenated([hand.engagement for hand in hands])
        engagement.setflags(write=False)
        return HandBatch(
            tuple(hands),
            self.places,
            contact_pattern_of([hand.tiles for hand in hands], self.places),
            self.points,
            self.axes,
            engagement,
            concatenated([hand.lateral_shares for hand in hands]),
            self.angles,
            self.bends,
            self.friction,
            _palm_limits(hands),
        )

    @property
    def closing_tensions(self) -> tuple[float, ...]:
        """Closing tension of each hand [N]."""
        return tuple([hand.closing_tension for hand in self.hands])

    @property
    def stops(self) -> NDArray[np.int8]:
        """Mechanical stop that each finger joint is at, as codes of `JOINT_STOPS`, shape (F, 3)."""
        return concatenated([hand.postures.stops for hand in self.hands])

    @property
    def bearing_shares(self) -> Array:
        """Share of what balances its joint that each contact bears, shape (F, 3)."""
        return concatenated([hand.postures.bearing_shares for hand in self.hands])


def _palm_limits(hands: Sequence[SettledHand]) -> Array:
    """Return the limits of palms' shear and pressing; what touches nothing uses nothing."""
    limits = [
        (hand.palm.shear_limit, hand.palm.pressing_limit)
        if hand.palm.engaged
        else (math.inf, math.inf)
        for hand in hands
    ]
    return np.array(limits)


def concatenated(parts: Sequence[NDArray[Number]]) -> NDArray[Number]:
    """Concatenate arrays of all hands along the first axis."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
