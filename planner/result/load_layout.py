"""Where everything is in the loads and in the limit rows of hands with fixed wrists."""

from __future__ import annotations

from functools import lru_cache
from itertools import accumulate
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.fixed_wrist import PALM_PRESSING, PALM_SHEAR
from hand_models.hand import FINGERS, NAIL, Tile
from hand_models.wrench_spaces import Row
from planner.prepare import (
    CONTACTS,
    KEPT_NAMES,
    TOUCHING,
    concatenated,
    contact_pattern_of,
    tile_index_of,
)
from planner.programs import is_effort

__all__ = ["COUNT", "WRENCH", "ZERO", "LoadLayout", "layout_of"]

COUNT: Final = len(FINGERS)

OWN: Final = (
    *(f"{finger}/{kind}" for kind in ("tension", "lateral", NAIL) for finger in FINGERS),
    PALM_SHEAR,
    PALM_PRESSING,
)
"""Every column that a hand with a fixed wrist may have."""

WRENCH: Final = 6
"""Rows of a wrench."""

SIGNED: Final = ("/lateral", f"/{NAIL}")
"""Loads that may be negative."""

ZERO: Final = np.zeros(1)
"""A load that a hand does not have, before all others."""


class _HandLayout(NamedTuple):
    """Where everything is in one hand's loads and limit rows.

    Attributes
    ----------
    places : ndarray of int, shape (14,)
        Of each of `OWN` among its m loads, counted from one; zero where there is none.
    has : ndarray of int, shape (14,)
        One where there is one, zero elsewhere.
    least : ndarray, shape (m,)
        What each load may be at least [N].
    rows : int
        How many limit rows it has.
    begins : ndarray of int
        Where the limit rows of each tile on rock begin, and where those of the last end.
    nails : ndarray of int
        Limit rows of its nails, two of each.
    efforts : ndarray of int
        Limit rows whose utilisation counts as effort.
    """

    places: Indices
    has: Indices
    least: Array
    rows: int
    begins: Indices
    nails: Indices
    efforts: Indices


@lru_cache(maxsize=KEPT_NAMES)
def _hand_layout(
    tiles: tuple[Tile, ...], columns: tuple[str, ...], names: tuple[Row, ...], limits: int
) -> _HandLayout:
    """Return the layout of a hand.

    Parameters
    ----------
    tiles : tuple of Tile
    columns : tuple of str
    names : tuple of Row
        Of the rows of its set.
    limits : int
        Limit rows of each tile, of which a hand has the first, tile by tile.
    """
    rows = [row for row in names if row.kind == "limit"]
    touching = sum(CONTACTS[tile.contact] == TOUCHING for tile in tiles)
    place = {name: i for i, name in enumerate(columns, start=1)}
    places = np.array([place.get(name, 0) for name in OWN])
    return _HandLayout(
        places=places,
        has=np.sign(places),
        least=np.array([-np.inf if name.endswith(SIGNED) else 0.0 for name in columns]),
        rows=len(rows),
        begins=limits * np.arange(touching + 1),
        nails=np.flatnonzero([row.phalanx == NAIL for row in rows]),
        efforts=np.flatnonzero([is_effort(row) for row in rows]),
    )


class LoadLayout(NamedTuple):
    """Where everything is in the loads and in the limit rows of all hands.

    Attributes
    ----------
    columns : ndarray of int, shape (H, most m)
        Each hand's loads among all; before all of them is one that is zero.
    shape : tuple of int
        (H, 6 + most limits): so many rows of so many hands.
    limits : ndarray of int, shape (sum of nl,)
        The limit rows among all hands' rows, of which the first six of each hand are its wrench.
    least : ndarray, shape (1 + m,)
        What each load may be at least [N].
    tensions : ndarray of int, shape (F,)
    palms : ndarray of int, shape (H, 2)
    of_tile : ndarray of int, shape (T, 3)
        Loads that shear, normal and lateral load of each tile follow.
    first_row : ndarray of int, shape (H,)
        Of the limit rows, by hand.
    begins : ndarray of int
        Where the limit rows of each tile on rock begin, and where those of a hand's last one end.
    kept : ndarray of int, shape (T,)
        Which of them each tile's are; the first for those that are not on rock.
    hooked : ndarray of int
        Nails that hook.
    nail_limits : ndarray of int, shape (number of them, 2)
        Their limit rows.
    efforts : ndarray of int
        Limit rows whose utilisation counts as effort.
    """

    columns: Indices
    shape: tuple[int, int]
    limits: Indices
    least: Array
    tensions: Indices
    palms: Indices
    of_tile: Indices
    first_row: Indices
    begins: Indices
    kept: Indices
    hooked: Indices
    nail_limits: Indices
    efforts: Indices


@lru_cache(maxsize=KEPT_NAMES)
def layout_of(
    tiles: tuple[tuple[Tile, ...], ...],
    columns: tuple[tuple[str, ...], ...],
    names: tuple[tuple[Row, ...], ...],
    limits: tuple[int, ...],
) -> LoadLayout:
    """Return the layout of all hands.

    Parameters
    ----------
    tiles, columns, names : tuple
        Of `_hand_layout`, for each.
    limits : tuple of int
        Of `_hand_layout`, for each.
    """
    count = len(limits)
    hands = [_hand_layout(*own) for own in zip(tiles, columns, names, limits, strict=True)]
    places, touch = tile_index_of(tuple(map(len, tiles))), contact_pattern_of(tiles)
    ends = list(accumulate((len(hand.least) for hand in hands), initial=1))
    found = np.array([hand.places + at * hand.has for hand, at in zip(hands, ends, strict=False)])
    found -= np.sign(found)
    first_row = list(accumulate((hand.rows for hand in hands), initial=0))[:-1]
    tensions, laterals, axials = (
        found[:, i : i + COUNT].ravel() for i in range(0, 3 * COUNT, COUNT)
    )
    of_tile = np.empty((len(places.hand), 3), dtype=np.intp)
    of_tile[:, :2] = tensions[places.finger, None]
    of_tile[:, 2] = laterals[places.finger]
    hooked = np.flatnonzero(touch.contacts == CONTACTS[NAIL])
    of_tile[hooked, 0] = axials[places.finger[hooked]]
    pairs = list(zip(first_row, hands, strict=True))
    loads = np.zeros((count, max(len(hand.least) for hand in hands)), dtype=np.intp)
    for own, end, hand in zip(loads, ends, hands, strict=False):
        own[: len(hand.least)] = end + np.arange(len(hand.least))
    shape = count, WRENCH + max(hand.rows for hand in hands)
    kept = np.zeros(len(places.hand), dtype=np.intp)
    kept[touch.touching] = places.hand[touch.touching] + np.arange(len(touch.touching))
    return LoadLayout(
        columns=loads,
        shape=shape,
        limits=concatenated(
            [
                shape[1] * h + WRENCH + np.arange(hand.rows, dtype=np.intp)
                for h, hand in enumerate(hands)
            ]
        ),
        least=np.concatenate([ZERO, *[hand.least for hand in hands]]),
        tensions=tensions,
        palms=found[:, 3 * COUNT :],
        of_tile=of_tile,
        first_row=np.array(first_row),
        begins=concatenated([at + hand.begins for at, hand in pairs]),
        kept=kept,
        hooked=hooked,
        nail_limits=concatenated([at + hand.nails for at, hand in pairs]).reshape(-1, 2),
        efforts=concatenated([at + hand.efforts for at, hand in pairs]),
    )
