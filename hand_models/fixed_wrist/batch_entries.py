"""Where the numbers of many hands' sets come from, all of them at once.

What `hand_models.fixed_wrist.row_entries` says of one hand, put together for hands one after
another: the sources of all of them are one array, block by block, and all numbers of all sets are
one lookup. The blocks are, h hands having n tiles and f fingers and p planes together,

- the constants: `hand_sources` of each hand;
- `GIVEN` numbers of each hand: its largest tension, its closing tension with the sign changed, the
  palm's limits, and −z, y, −x of its centre;
- the tiles' loads, (n, 2, 2), and the same with their signs changed;
- loads of the half-planes at zero tension and per newton, (p, 2);
- what they take of lateral reactions, with either sign, and their capacities, (p, 3);
- sums over the tiles of each finger: wrenches at zero tension, per newton of tension and of lateral
  reaction, (`WRENCH_PARTS`, 3, f), and shears, (f, 2);
- whole hands' wrenches at zero tension, (`WRENCH_PARTS`, h);
- what stops and nails give each hand, if it has any.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from hand_models.base import Array, Indices
from hand_models.fixed_wrist.row_entries import (
    GIVEN,
    WRENCH_PARTS,
    RowEntries,
    entries_of,
    hand_sources,
    surface_planes,
)
from hand_models.fixed_wrist.row_layout import RowLayout
from hand_models.hand import FINGERS, HandModel
from hand_models.tile import Surface

__all__ = ["BatchEntries", "entries_of_batch"]

KEPT: Final = 64
"""Choices of hands that are kept, those used last; each hand takes some 50 kB."""


@dataclass(frozen=True, eq=False)
class BatchEntries:
    """Which source each number of the sets of some hands is. Arrays are read-only.

    Attributes
    ----------
    constants : ndarray
        The first of the sources.
    index : ndarray of int
        Of the sources that are the numbers of all sets, one after another.
    ends : tuple of tuple of int, lengths h and 8
        Where o, V, L, l0, s, H and h of each begin, and where the last ends.
    starts : ndarray of int, shape (f,)
        First tile of each finger.
    ones : ndarray, shape (n, 1)
    plane_tiles : ndarray of int, shape (p,)
        Whose planes the half-planes are.
    planes : ndarray, shape (p, 4)
        Their coefficients of shear and of normal load, each at zero tension and per newton.
    limits : ndarray, shape (p, 3)
        Their coefficients of lateral load with either sign, and capacities of whole tiles [N].
    """

    constants: Array
    index: Indices
    ends: tuple[tuple[int, ...], ...]
    starts: Indices
    ones: Array
    plane_tiles: Indices
    planes: Array
    limits: Array


@lru_cache(maxsize=KEPT)
def entries_of_batch(
    layouts: tuple[RowLayout, ...],
    models: tuple[HandModel, ...],
    surfaces: tuple[Surface, ...],
) -> BatchEntries:
    """Return where the numbers of hands come from, with these row layouts, on these surfaces."""
    entries = [entries_of(layout) for layout in layouts]
    constants = [hand_sources(model) for model in models]
    counts = [len(layout.finger_of) for layout in layouts]
    # of each half-plane of each tile
    given = [
        surface_planes(surface).repeat(count, axis=0)
        for surface, count in zip(surfaces, counts, strict=True)
    ]
    coefficients = np.concatenate(given)
    tiles, planes = _starts(counts), _starts([len(own) for own in given])
    places = _places(entries, [len(each) for each in constants], tiles, planes)
    lengths = [len(each.index) for each in entries]
    made = BatchEntries(
        constants=np.concatenate(constants),
        index=np.concatenate(
            [place[each.index] for place, each in zip(places, entries, strict=True)]
        ),
        ends=tuple(
            tuple(start + end for end in (0, *each.ends, length))
            for start, each, length in zip(_starts(lengths), entries, lengths, strict=False)
        ),
        starts=np.concatenate(
            [
                start + np.searchsorted(layout.finger_of, np.arange(len(FINGERS)))
                for start, layout in zip(tiles, layouts, strict=False)
            ]
        ),
        ones=np.ones((tiles[-1], 1)),
        plane_tiles=np.concatenate(
            [
                np.tile(np.arange(start, end), len(own) // (end - start))
                for (start, end), own in zip(itertools.pairwise(tiles), given, strict=True)
            ]
        ),
        planes=coefficients[:, :2].repeat(2, axis=1),
        limits=coefficients[:, 2:].repeat((2, 1), axis=1) * (1.0, -1.0, 1.0),
    )
    for array in vars(made).values():
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return made


def _starts(lengths: list[int]) -> list[int]:
    """Return where parts of these lengths begin, and where the last ends."""
    return list(itertools.accumulate(lengths, initial=0))


def _places(
    entries: list[RowEntries], constants: list[int], tiles: list[int], planes: list[int]
) -> list[Indices]:
    """Return where each hand's own sources, in the order of `RowEntries`, are among all.

    Parameters
    ----------
    entries : list of RowEntries, length h
    constants : list of int, length h
        How many constants each hand has.
    tiles, planes : list of int, length h + 1
        Where its tiles and half-planes begin.
    """
    hands, fingers = len(entries), len(FINGERS)
    n_tiles, n_planes, n_sums = tiles[-1], planes[-1], hands * fingers
    blocks = [sum(constants), GIVEN * hands, 4 * n_tiles, 4 * n_tiles]
    blocks += [2 * n_planes, 3 * n_planes]
    blocks += [3 * WRENCH_PARTS * n_sums, 2 * n_sums, WRENCH_PARTS * hands]
    *begin, further = _starts(blocks)
    first = begin[0]
    part, own = np.arange(WRENCH_PARTS), np.arange(fingers)
    places = []
    for i, each in enumerate(entries):
        n, finger = tiles[i + 1] - tiles[i], fingers * i + own
        plane = np.arange(planes[i], planes[i + 1]).reshape(-1, 1, n)
        kind = np.array([1, 2]).reshape(2, 1, 1)
        mine = [
            first + np.arange(constants[i]),
            begin[1] + GIVEN * i + np.arange(GIVEN),
            begin[2] + 4 * tiles[i] + np.arange(4 * n),
            begin[3] + 4 * tiles[i] + np.arange(4 * n),
            np.concatenate(
                [
                    begin[4 + k] + size * plane + np.arange(size).reshape(1, size, 1)
                    for k, size in enumerate((2, 3))
                ],
                axis=1,
            ),
            begin[6] + (3 * part[:, None] + kind) * n_sums + finger,
            begin[7] + 2 * finger + np.arange(2)[:, None],
            begin[8] + hands * part + i,
        ]
        left = each.sources - sum(block.size for block in mine)
        mine.append(further + np.arange(left))
        first, further = first + constants[i], further + left
        places.append(np.concatenate([block.ravel() for block in mine]))
    return places
