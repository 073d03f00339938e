"""Where everything is in the loads and in the limit rows of hands with fixed wrists."""

from __future__ import annotations

from functools import lru_cache
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
    tiles : tuple of tuple of Tile
        By hand, and so are the others.
    columns : tuple of tuple of str
    names : tuple of tuple of Row
        Of the rows of its set.
    limits : tuple of int
        Limit rows of each tile, of which a hand has the first, tile by tile.
    """
    places, touch = tile_index_of(tuple(map(len, tiles))), contact_pattern_of(tiles)
    named = [(h, name) for h, own in enumerate(columns) for name in own]
    place = {name: i for i, name in enumerate(named, start=1)}
    found = np.array([[place.get((h, name), 0) for name in OWN] for h in range(len(limits))])
    loads = np.zeros((len(limits), max(map(len, columns))), dtype=np.intp)
    for h, own in enumerate(columns):
        loads[h, : len(own)] = [place[h, name] for name in own]
    tensions, laterals, axials = (
        found[:, i : i + COUNT].ravel() for i in range(0, 3 * COUNT, COUNT)
    )
    of_tile = np.empty((len(places.hand), 3), dtype=np.intp)
    of_tile[:, :2] = tensions[places.finger, None]
    of_tile[:, 2] = laterals[places.finger]
    hooked = np.flatnonzero(touch.contacts == CONTACTS[NAIL])
    of_tile[hooked, 0] = axials[places.finger[hooked]]
    rows = [(h, row) for h, own in enumerate(names) for row in own if row.kind == "limit"]
    of_row = np.array([h for h, _ in rows], dtype=np.intp)
    counts = np.bincount(of_row, minlength=len(limits))
    first_row, most = np.cumsum(counts) - counts, WRENCH + int(counts.max())
    touching = [sum(CONTACTS[tile.contact] == TOUCHING for tile in own) for own in tiles]
    of_rock = zip(first_row, limits, touching, strict=True)
    kept = np.zeros(len(places.hand), dtype=np.intp)
    kept[touch.touching] = places.hand[touch.touching] + np.arange(len(touch.touching))
    return LoadLayout(
        columns=loads,
        shape=(len(limits), most),
        limits=most * of_row + WRENCH + np.arange(len(rows)) - first_row[of_row],
        least=np.array([0.0, *(-np.inf if name.endswith(SIGNED) else 0.0 for _, name in named)]),
        tensions=tensions,
        palms=found[:, 3 * COUNT :],
        of_tile=of_tile,
        first_row=first_row,
        begins=np.concatenate([at + each * np.arange(n + 1) for at, each, n in of_rock]),
        kept=kept,
        hooked=hooked,
        nail_limits=np.flatnonzero([row.phalanx == NAIL for _, row in rows]).reshape(-1, 2),
        efforts=np.flatnonzero([is_effort(row) for _, row in rows]),
    )
