"""Where the tiles of closed hands are in H, along which axes they load the rock, and with what."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.closed_fingers import ClosedFingers
from hand_models.finger import PHALANGES
from hand_models.finger_frames import (
    AXES,
    BASES,
    COLUMNS,
    JOINTS,
    KIND,
    NORMAL,
    OUTER,
    PARTS,
    POSITION,
    SHEAR,
)
from hand_models.frames import Array, Indices
from hand_models.laying import FACE, NONE
from hand_models.placed_hands import PlacedHands
from hand_models.settled_hand import CONTACTS, FINGERS, NAIL, Tile

__all__ = ["HandTiles", "hand_tiles", "parts_on_rock"]

BASE, BODY = 0, slice(1, 1 + len(PHALANGES))


def _parts(*, nails: bool) -> Indices:
    outer = range(len(FINGERS))[OUTER]
    parts = [
        len(PARTS) * i + k
        for i in range(len(FINGERS))
        for k in range(len(PARTS))
        if (k != BASE or i in outer) and (PARTS[k] != NAIL or nails)
    ]
    return np.array(parts)


GRIPPING: Final = _parts(nails=False)
"""Parts of the four fingers that are tiles of a hand which grips with them."""

CLINGING: Final = _parts(nails=True)
"""Those of a hand which clings with its nails."""

FINGER_OF: Final = {nails: _parts(nails=nails) // len(PARTS) for nails in (False, True)}
"""Index of each tile's finger, of hands that cling or do not."""

for finger_of in FINGER_OF.values():
    finger_of.setflags(write=False)


class HandTiles(NamedTuple):
    """The tiles of one hand; attributes as of `SettledHand`."""

    tiles: tuple[Tile, ...]
    finger_of: Indices
    positions: Array
    axes: Array
    loads: Array


def parts_on_rock(placed: PlacedHands, closed: ClosedFingers, tensions: Sequence[float]) -> Array:
    """Return the fingers' `PARTS` of hands that are closed, before nails hook.

    Parameters
    ----------
    placed : PlacedHands
    closed : ClosedFingers
    tensions : sequence of float, length n
        Closing tensions [N].

    Returns
    -------
    ndarray, shape (n, 4, 5, `COLUMNS`)
    """
    hand, frames, count = placed.hand, placed.frames, len(PHALANGES)
    parts = frames.parts.copy()
    body, bases = parts[:, :, BODY], parts[:, OUTER, BASE]

    places = closed.places @ frames.planes
    np.add(places[:, :, :count], frames.rows[:, JOINTS, None], out=body[..., POSITION])
    # along and into; across stays as it is
    body[..., AXES.start : AXES.start + 3] = places[:, :, count : 2 * count]
    body[..., AXES.start + 3 : AXES.start + 6] = places[:, :, 2 * count :]
    body[..., SHEAR], body[..., NORMAL] = closed.loads[..., 0, :], closed.loads[..., 1, :]
    body[..., KIND] = closed.kinds

    gaps = placed.gaps[:, :BASES]
    engaged = np.abs(gaps) <= hand.spine_travel
    for i, placement in enumerate(placed.placements):
        if placement.grasp.fingernail:
            engaged[i] = False
    gain = hand.finger.shear_gain
    at_zero = (hand.finger.base_engagement - gain) * np.array(tensions)[:, None]
    bases[..., KIND] = np.where(engaged, FACE, NONE)
    bases[..., POSITION.stop - 1] += np.where(engaged, gaps, 0.0)
    bases[..., SHEAR.start], bases[..., SHEAR.start + 1] = engaged * at_zero, engaged * gain
    return parts


def hand_tiles(parts: Array, clinging: Sequence[bool]) -> list[HandTiles]:
    """Return the tiles of each hand, arrays read-only; of those that cling, their nails too."""
    count = len(parts)
    rows = parts.reshape(count, -1, COLUMNS)
    made: list[HandTiles | None] = [None] * count
    for nails in set(clinging):
        chosen = rows.take(CLINGING if nails else GRIPPING, axis=1)
        chosen.setflags(write=False)
        kinds = chosen[..., KIND].astype(np.int8)
        axes = chosen[..., AXES].reshape(count, -1, 3, 3)
        loads = chosen[..., SHEAR.start : NORMAL.stop].reshape(count, -1, 2, 2)
        each = zip(kinds, chosen[..., POSITION], axes, loads, strict=True)
        for i, (codes, *numbers) in enumerate(each):
            if clinging[i] == nails:
                made[i] = HandTiles(_named(codes.tobytes(), nails), FINGER_OF[nails], *numbers)
    return [each for each in made if each is not None]


@lru_cache(maxsize=4096)
def _named(kinds: bytes, nails: bool) -> tuple[Tile, ...]:
    """Return tiles from the codes of their contacts."""
    return tuple(
        Tile(FINGERS[part // len(PARTS)], PARTS[part % len(PARTS)], CONTACTS[kind])
        for part, kind in zip((CLINGING if nails else GRIPPING).tolist(), kinds, strict=True)
    )
