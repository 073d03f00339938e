"""Where each number of a fixed-wrist hand's set comes from.

All numbers of a `WrenchSpace` of a hand are among a few that are worked out for it, one after
another in one array of *sources*; which of them goes where only depends on the row layout. So a set
is one lookup: ``sources[index]`` is o, V, L, l0, s, H and h, end to end.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final
from weakref import WeakKeyDictionary

import numpy as np

from hand_models.base import Array, Indices
from hand_models.finger import PHALANGES
from hand_models.fixed_wrist.row_layout import KEPT, RowLayout
from hand_models.hand import FINGERS, HELD, HandModel
from hand_models.tile import Surface, inner_half_planes

__all__ = [
    "GIVEN",
    "NAIL_ROWS",
    "WRENCH_PARTS",
    "RowEntries",
    "entries_of",
    "hand_sources",
    "surface_planes",
]

WRENCH_PARTS: Final = 6 + len(HELD)
"""A wrench, and what of its force is held along each of `HELD`."""

GIVEN: Final = 7
"""Numbers of a hand on its hold that are no loads: two tensions, and five of its palm."""

NAIL_ROWS: Final = 3 + len(PHALANGES)
"""Hard rows of a nail that hooks."""


@lru_cache(maxsize=256)
def surface_planes(surface: Surface) -> Array:
    """Return the half-planes of whole tiles on a surface, shape (p, 4).

    Coefficients of shear, normal and lateral load, and capacity [N].
    """
    return np.array(
        [(p.a_shear, p.a_normal, p.a_lateral, p.capacity) for p in inner_half_planes(surface)]
    )


_kept: WeakKeyDictionary[HandModel, Array] = WeakKeyDictionary()
"""Sources of hands that somebody still has."""


def hand_sources(hand: HandModel) -> Array:
    """Return what is the same for every hold of a hand: constants, and strengths of its parts."""
    found = _kept.get(hand)
    if found is None:
        found = _kept[hand] = _hand_sources(hand)
    return found


def _hand_sources(hand: HandModel) -> Array:
    drive, structure = hand.drive, hand.structure
    numbers = (
        *(0.0, 1.0, -1.0, drive.torque_per_newton, drive.current_per_newton, drive.no_load_current),
        *(drive.maximum_torque, drive.maximum_current),
        *(structure.finger_shear, structure.fingertip_force, structure.hand_load),
    )
    return np.concatenate([numbers, -HELD[:, 0], HELD[:, 2]])


@dataclass(frozen=True, eq=False)
class RowEntries:
    """Which source each number of a set is.

    The sources are, in order, `hand_sources`, and of the hand on its hold

    - the largest tension, the closing tension with its sign changed, the palm's limits of shear and
      of pressing, and −z, y, −x of its centre;
    - the tiles' loads, (n, 2, 2), and the same with their signs changed;
    - of the half-planes of each tile, (p, 5, n): their loads at zero tension, per newton of it, and
      per newton of the finger's lateral reaction with either sign; their capacities;
    - sums over each finger's tiles, (2 `WRENCH_PARTS` + 2, fingers): the wrench per newton of
      tension and of lateral reaction, and the shear at zero tension and per newton of it;
    - the whole hand's wrench at zero tension, (`WRENCH_PARTS`,);
    - of each stop its hard row's entry and right-hand side;
    - of each nail that hooks `WRENCH_PARTS` of its axial load, slope, axial coefficient and load at
      zero tension of both limit rows, and its hard rows, (`NAIL_ROWS`, 2), and right-hand sides.

    Attributes
    ----------
    index : ndarray of int
        Of the sources that are o (6,), V (6, m), L (nl, m), l0, s (nl,), H (nh, m) and h (nh,).
    ends : tuple of int
        Where each of these ends but the last.
    sources : int
        How many there are.
    """

    index: Indices
    ends: tuple[int, ...]
    sources: int


class _Numbering:
    """Hands out the numbers of sources."""

    def __init__(self) -> None:
        self.count = 0

    def next(self, *shape: int) -> Indices:
        """Return the next numbers, in an array of this shape."""
        count = math.prod(shape)
        self.count += count
        return np.arange(self.count - count, self.count).reshape(shape)


@lru_cache(maxsize=KEPT)
def entries_of(layout: RowLayout) -> RowEntries:
    """Return where the numbers of the sets of a layout come from."""
    n, p, nails, numbering = len(layout.finger_of), layout.pieces, len(layout.nails), _Numbering()
    new = numbering.next
    zero, one, minus, torque, current, idle_current, most_torque, most_current = new(8)
    finger_shear, fingertip_force, hand_load = new(3)
    held_drag, held_press = new(2, len(HELD))
    most, closing, palm_shear, palm_pressing, below, aside, behind = new(GIVEN)
    loads, opposite = new(n, 2, 2), new(n, 2, 2)
    planes = new(p, 5, n)
    per_newton, sideways = new(2, WRENCH_PARTS, len(FINGERS))
    shears = new(2, len(FINGERS))
    whole = new(WRENCH_PARTS)
    stops = new(len(layout.stops), 2)
    axial = new(nails, WRENCH_PARTS)
    nail_limits = new(nails, 2, 3)
    nail_rows, nail_ends = new(nails, NAIL_ROWS, 2), new(nails, NAIL_ROWS)

    m, nl, nh = len(layout.columns), len(layout.limits), len(layout.hard)
    tendon = np.arange(len(FINGERS))
    finger_of, reacting = layout.finger_of, list(layout.reacting)
    nail_columns, lateral_columns = list(layout.nail_columns), list(layout.lateral_columns)

    # the wrench, and below it what of its force is held: the last limit rows
    V = np.full((WRENCH_PARTS, m), zero)
    V[:, tendon] = per_newton
    V[:, lateral_columns] = sideways[:, reacting]
    V[:, nail_columns] = axial.T
    if layout.palm:
        V[[0, 4, 5], -2] = minus, below, aside
        V[[2, 3, 4], -1] = one, aside, behind
        V[6:, -2], V[6:, -1] = held_drag, held_press

    L, l0, s = np.full((nl, m), zero), np.full(nl, zero), np.full(nl, hand_load)
    tile, piece = layout.plane_tiles, layout.plane_pieces
    k = len(tile)
    row = np.arange(k)
    L[row, finger_of[tile]], l0[:k] = planes[piece, 1, tile], planes[piece, 0, tile]
    s[:k] = planes[piece, 4, tile]
    if layout.lateral_columns:
        column_of = np.zeros(len(FINGERS), dtype=np.intp)
        column_of[reacting] = lateral_columns
        backwards = (layout.plane_signs < 0).astype(np.intp)
        L[row, column_of[finger_of[tile]]] = planes[piece, 2 + backwards, tile]
    for slope, start, end in (
        (one, zero, most),
        (torque, zero, most_torque),
        (current, idle_current, most_current),
    ):
        L[k + tendon, tendon], l0[k + tendon], s[k + tendon] = slope, start, end
        k += len(tendon)
    engaged, tips = list(layout.engaged), layout.tips
    for of, (start, slope), end in (
        (engaged, shears[:, engaged], finger_shear),
        (finger_of[tips], loads[tips, 1].T, fingertip_force),
    ):
        row = k + np.arange(len(of))
        L[row, of], l0[row], s[row] = slope, start, end
        k += len(of)
    for i, (column, nail) in enumerate(zip(nail_columns, layout.nails, strict=True)):
        for (slope, along, start), end in zip(
            nail_limits[i], (finger_shear, fingertip_force), strict=True
        ):
            L[k, [finger_of[nail], column]], l0[k], s[k] = (slope, along), start, end
            k += 1
    if layout.palm:
        L[[k, k + 1], [-2, -1]] = one
        s[k : k + 2] = palm_shear, palm_pressing
        k += 2
    L[k:], l0[k:] = V[6:], whole[6:]

    H, h = np.full((nh, m), zero), np.full(nh, zero)
    H[tendon, tendon] = minus
    k = len(tendon)
    for tiles, component in ((layout.touching, 0), (layout.frames, 1)):
        row = k + np.arange(len(tiles))
        H[row, finger_of[tiles]] = opposite[tiles, component, 1]
        h[row] = loads[tiles, component, 0]
        k += len(tiles)
    for (finger, _), (slope, end) in zip(layout.stops, stops, strict=True):
        H[k, finger], h[k] = slope, end
        k += 1
    for i, (column, nail) in enumerate(zip(nail_columns, layout.nails, strict=True)):
        row = k + np.arange(NAIL_ROWS)
        H[row[:, None], [finger_of[nail], column]], h[row] = nail_rows[i], nail_ends[i]
        k += NAIL_ROWS
    if layout.sticking:
        drawing = list(layout.drawing)
        row = k + np.arange(len(drawing))
        H[row, drawing], h[row] = minus, closing
    if layout.palm:
        H[[-2, -1], [-2, -1]] = minus

    parts = [whole[:6], V[:6].ravel(), L.ravel(), l0, s, H.ravel(), h]
    entries = RowEntries(
        index=np.concatenate(parts),
        ends=tuple(np.cumsum([len(part) for part in parts[:-1]]).tolist()),
        sources=numbering.count,
    )
    entries.index.setflags(write=False)
    return entries
