"""Tiles of closed hands: their places in H, their axes of load, and their loads.

For palms: which tiles are engaged, and the strength of these together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger import CONTACT_KINDS, PHALANGES
from hand_models.hand.closed_fingers import ClosedFingers
from hand_models.hand.finger_frames import OUTER_FINGERS, TILE_COLUMNS
from hand_models.hand.hooked_nails import Nails
from hand_models.hand.names import CONTACT_NAMES, FINGERS, NAIL
from hand_models.hand.placement import PlacedHands
from hand_models.hand.settled_hand import SettledPalm, SettledTile
from hand_models.tile import engaged_share

__all__ = ["HandTiles", "hand_tiles", "palms_on_rock", "tiles_on_rock"]


def _names() -> list[tuple[str, str]]:
    """Return finger and phalanx of each tile as they are worked out: base tiles, others, nails."""
    bases = [(finger, "base") for finger in FINGERS[OUTER_FINGERS]]
    bodies = [(finger, phalanx) for finger in FINGERS for phalanx in PHALANGES]
    return [*bases, *bodies, *[(finger, NAIL) for finger in FINGERS]]


TILE_NAMES: Final = _names()
"""Finger and phalanx of each tile as they are worked out: first the base tiles, last the nails."""


def _order(*, nails: bool) -> tuple[Indices, Indices]:
    """Return the order of the tiles of hands that cling or do not, and the finger of each.

    Finger by finger, and of each the base, the phalanges, the nail.
    """
    tiles = len(TILE_NAMES) if nails else len(TILE_NAMES) - len(FINGERS)
    order = sorted(range(tiles), key=lambda i: FINGERS.index(TILE_NAMES[i][0]))
    finger_of = np.array([FINGERS.index(TILE_NAMES[i][0]) for i in order])
    finger_of.setflags(write=False)
    return np.array(order), finger_of


class HandTiles(NamedTuple):
    """Tiles of one hand.

    Attributes
    ----------
    tiles : tuple of SettledTile, length n
    finger_of : ndarray of int, shape (n,)
        Index of each tile's finger.
    positions : ndarray, shape (n, 3)
        Place of each tile's contact in the hand frame H [m].
    axes : ndarray, shape (n, 3, 3)
        Rows: unit force on the rock of shear, of normal and of lateral load, in H.
    loads : ndarray, shape (n, 2, 2)
        Shear and normal load, each at zero tension [N] and per newton of tension.
    engagement : ndarray, shape (n,)
        Spine engagement φ of each tile.
    """

    tiles: tuple[SettledTile, ...]
    finger_of: Indices
    positions: Array
    axes: Array
    loads: Array
    engagement: Array


def tiles_on_rock(
    placed: PlacedHands, depths: Array, closed: ClosedFingers, tensions: Sequence[float]
) -> Array:
    """Return places, axes and loads of all finger tiles of n closed hands, as one array.

    Parameters
    ----------
    placed : PlacedHands
    depths : ndarray, shape (n, 2)
        Gaps of the base tiles, as in `PlacedHands.gaps` [m].
    closed : ClosedFingers
    tensions : sequence of float, length n
        Closing tensions [N].

    Returns
    -------
    ndarray, shape (n, 14, 18)
        The two base tiles, then the tiles of the phalanges finger by finger; the last axis in the
        order of `TileColumns`.
    """
    count, frames = len(tensions), placed.frames
    # each phalanx's contact, axis of shear and axis of normal load, from the finger's plane to H
    places = (closed.places @ frames.planes).reshape((*frames.across.shape[:3], 9))
    places[..., :3] += closed.postures.across[..., None] * frames.across
    bodies = np.concatenate([places, frames.across, closed.tiles], axis=3)
    bases = _base_tiles(placed, depths, tensions)
    return np.concatenate([bases, bodies.reshape(count, -1, TILE_COLUMNS.total)], axis=1)


def _base_tiles(placed: PlacedHands, depths: Array, tensions: Sequence[float]) -> Array:
    """Return the base tiles, which carry shear where rock is within the spines' travel."""
    model, tiles = placed.hand.finger, placed.frames.base_tiles
    shares = engaged_share(
        np.abs(depths), placed.hand.spine_travel, placed.hand.engagement_exponent
    )
    shares[[placement.grasp.fingernail for placement in placed.placements]] = 0.0
    engaged = shares.nonzero()
    if not len(engaged[0]):
        return tiles
    column = TILE_COLUMNS
    own, gain = tiles[engaged], model.shear_gain[0]
    own[:, column.position.stop - 1] += depths[engaged]
    own[:, column.shear.start] = (model.base_engagement - gain) * np.array(tensions)[engaged[0]]
    own[:, column.shear.stop - 1] = gain
    own[:, column.shear] *= shares[engaged][:, None]
    own[:, column.engagement], own[:, column.kind] = shares[engaged], CONTACT_KINDS.index("face")
    tiles = tiles.copy()
    tiles[engaged] = own
    return tiles


def hand_tiles(tiles: Array, nails: Mapping[int, Nails]) -> list[HandTiles]:
    """Return the finger tiles of each hand, arrays read-only; in a fingernail grasp with the nails.

    Parameters
    ----------
    tiles : ndarray, shape (n, 14, 18)
        From `tiles_on_rock`.
    nails : mapping of int to Nails
        Nails by the index of their hand.
    """
    made = _each_hand(tiles, nails=False)
    for i, each in nails.items():
        if len(each.tiles):
            clinging = np.concatenate([tiles[i], each.tiles])
            made[i : i + 1] = _each_hand(clinging[None], nails=True)
    return made


def _each_hand(unordered: Array, *, nails: bool) -> list[HandTiles]:
    """Return the tiles of hands that all cling, or all do not, from their numbers."""
    order, finger_of = _order(nails=nails)
    numbers = unordered.take(order, axis=1)
    count, tiles, _ = numbers.shape
    numbers.setflags(write=False)
    column = TILE_COLUMNS
    kinds = numbers[..., column.kind].astype(np.int8)
    codes = [kinds[i].tobytes() for i in range(count)]
    names = [TILE_NAMES[i] for i in order.tolist()]
    named = {
        of_hand: tuple(
            SettledTile(finger, part, CONTACT_NAMES[kind])
            for (finger, part), kind in zip(names, of_hand, strict=True)
        )
        for of_hand in dict.fromkeys(codes)
    }
    axes = numbers[..., column.axes].reshape(count, tiles, 3, 3)
    loads = numbers[..., column.shear.start : column.normal.stop].reshape(count, tiles, 2, 2)
    return [
        HandTiles(named[own], finger_of, *of_hand)
        for own, *of_hand in zip(
            codes,
            *(numbers[..., column.position], axes, loads, numbers[..., column.engagement]),
            strict=True,
        )
    ]


def palms_on_rock(placed: PlacedHands, gaps: Array) -> list[SettledPalm]:
    """Return the palm of each hand: its engaged tiles and their strength.

    A tile is engaged if rock is within its spines' travel. A grasp without ``palm`` engages none.
    ``gaps``, shape (n, 8): those of the palms' tiles, as in `PlacedHands.gaps` [m].
    """
    hand = placed.hand
    shares = engaged_share(gaps, hand.spine_travel, hand.engagement_exponent)
    gaps.setflags(write=False)
    places = np.zeros((len(gaps), 3))
    palms = []
    for placement, own, share, centre in zip(
        placed.placements, gaps, shares.tolist(), places, strict=True
    ):
        engaged = tuple([i for i, part in enumerate(share) if part > 0.0])
        if not placement.grasp.palm:
            engaged = ()
        parts = tuple([share[i] for i in engaged])
        palm = SettledPalm(own, engaged, parts, centre, 0.0, 0.0)
        if engaged:
            weights = np.array(parts) / sum(parts)
            centre[:2] = weights @ hand.palm_tiles[list(engaged), :2]
            centre[2] = weights @ own[list(engaged)]
            most = placement.surface.shear_limit
            shear = sum([part * hand.palm_share(tiles, most) for part, tiles in palm.layers])
            palm = palm._replace(shear_limit=shear, pressing_limit=hand.palm_pressing * sum(parts))
        centre.setflags(write=False)
        palms.append(palm)
    return palms
