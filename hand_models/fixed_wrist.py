"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure. All hands of a stance are worked out
together: sums over the tiles of each finger, of their places p and forces F,

    Σ (1, p) ⊗ F,    F at zero tension, per newton of tension and per newton of lateral reaction,

hold the wrenches of all columns; what then goes where is in `row_entries`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from hand_models.errors import InvalidInputError
from hand_models.frames import Array, Indices, skew
from hand_models.hand import FINGERS, SettledHand
from hand_models.row_entries import (
    WRENCH_PARTS,
    Entries,
    entries_of,
    hand_sources,
    surface_sources,
)
from hand_models.row_layout import KEPT as KEPT_LAYOUTS
from hand_models.row_layout import RowLayout, layout_of
from hand_models.structure import HELD
from hand_models.wrench_space import WrenchSpace

__all__ = ["wrench_space", "wrench_spaces"]

KEPT: Final = 4
"""Sets that are kept of one settled hand, for different tension limits."""

LEAST_SLOPE: Final = 1e-6
"""Torque on a joint's stop per newton of tension by which its row is divided, at least [m]."""

HELD_ROWS: Final = np.hstack([HELD, np.zeros_like(HELD)])
"""D of every hand: the rows of `HELD` of a wrench."""

HELD_ROWS.setflags(write=False)


def _moments() -> Array:
    """Return the matrix (`WRENCH_PARTS`, 12) from (1, p) ⊗ F to a wrench and what is held of it."""
    wrench = np.zeros((6, 4, 3))
    wrench[:3, 0] = np.eye(3)
    for axis in range(3):
        wrench[3:, 1 + axis] = skew(np.eye(3)[axis])
    flat = wrench.reshape(6, 12)
    return np.vstack([flat, HELD_ROWS @ flat])


MOMENTS: Final = _moments()
"""From (1, p) ⊗ F to a wrench and what of it is held along `HELD`."""


_kept: WeakKeyDictionary[SettledHand, dict[float, WrenchSpace]] = WeakKeyDictionary()
"""Sets of hands that somebody still has, by their largest tension."""


def wrench_space(settled: SettledHand, tension_limit: float | None = None) -> WrenchSpace:
    """Return the wrenches on the rock, in H, that a settled hand carries with its wrist fixed.

    Parameters
    ----------
    settled : SettledHand
    tension_limit : float, optional
        A caller's cap on every tendon [N]; the hand's own maximum if that is less.

    Returns
    -------
    WrenchSpace
        Columns: four tensions, the lateral reactions, palm shear and palm pressing [N]. Limit rows:
        each tile's half-planes (with both signs of its lateral load); each tendon's tension, motor
        torque [N·m] and motor current [A]; the shear of a finger's tiles together, the pressing of
        its tip; the palm; and, as wrench rows, what the hand holds in the directions `HELD`. Hard
        rows: tension, palm loads not negative; no tile dragged backwards; a joint's stop and a
        frame beside its tile only push; a nail that clings neither lifts nor slips nor closes its
        finger; with friction in the tendons, no tension below closing, where they would stick. A
        nail has a column for the load along it, and two limit rows. Arrays are read-only.

    Raises
    ------
    InvalidInputError
        If the cap is not above zero.
    """
    # a set of its own: the vertices and half-spaces that it keeps go when the caller is done
    return replace(wrench_spaces([settled], tension_limit)[0])


def wrench_spaces(
    settled: Sequence[SettledHand], tension_limit: float | None = None
) -> list[WrenchSpace]:
    """Return the set of each hand, as `wrench_space` does, all worked out together.

    A hand's sets are kept as long as the hand is, the last `KEPT` of them: asked again, the answer
    is the same set.
    """
    if tension_limit is not None and tension_limit <= 0.0:
        raise InvalidInputError(f"must be above 0 N, got {tension_limit:g}", field="tension_limit")
    cap = math.inf if tension_limit is None else tension_limit
    limits = [min(hand.hand.maximum_tension, cap) for hand in settled]
    found: dict[SettledHand, WrenchSpace] = {}
    new: dict[SettledHand, float] = {}
    for hand, limit in zip(settled, limits, strict=True):
        known = _kept.get(hand, {}).get(limit)
        if known is None:
            new[hand] = limit
        else:
            found[hand] = known
    if new:
        for hand, space in zip(new, _worked_out(list(new), list(new.values())), strict=True):
            found[hand] = space
            kept = _kept.setdefault(hand, {})
            kept[new[hand]] = space
            for limit in list(kept)[:-KEPT]:
                kept.pop(limit, None)
    return [found[hand] for hand in settled]


def _worked_out(settled: Sequence[SettledHand], limits: Sequence[float]) -> list[WrenchSpace]:
    """Return the sets of hands for each hand's largest tension [N]."""
    layouts = [layout_of(hand, sticking=hand.hand.finger.friction > 0.0) for hand in settled]
    entries = [entries_of(layout) for layout in layouts]
    tiles = _tiles_of(tuple(entries))
    # tiles of all hands along the last axis
    loads = np.concatenate([hand.loads for hand in settled]).transpose(2, 1, 0)
    axes = np.concatenate([hand.axes for hand in settled]).transpose(1, 2, 0)
    arms = np.ones((4, loads.shape[2]))
    arms[1:] = np.concatenate([hand.positions for hand in settled]).T

    forces = np.empty((3, 3, loads.shape[2]))
    np.add(loads[:, :1] * axes[0], loads[:, 1:] * axes[1], out=forces[:2])
    np.multiply(axes[2], tiles.shares, out=forces[2])
    of_tiles = np.empty((3 * 12 + 2, loads.shape[2]))
    np.multiply(arms[:, None], forces[:, None], out=of_tiles[:-2].reshape(3, 4, 3, -1))
    of_tiles[-2:] = loads[:, 0]
    of_fingers = np.add.reduceat(of_tiles, tiles.starts, axis=1)
    sums = np.empty((3 * WRENCH_PARTS + 2, of_fingers.shape[1]))
    np.matmul(
        MOMENTS,
        of_fingers[:-2].reshape(3, 12, -1),
        out=sums[:-2].reshape(3, WRENCH_PARTS, -1),
    )
    sums[-2:] = of_fingers[-2:]
    of_hands = sums.reshape(-1, len(settled), len(FINGERS))
    at_zero = of_hands[:WRENCH_PARTS].sum(axis=2).T
    by_finger = of_hands[WRENCH_PARTS:].transpose(1, 0, 2).reshape(len(settled), -1)

    spaces = []
    for i, (hand, layout) in enumerate(zip(settled, layouts, strict=True)):
        surface, palm = surface_sources(hand.surface), hand.palm
        x, y, z = palm.centre.tolist()
        planar = loads[:, :, tiles.ends[i] : tiles.ends[i + 1]].swapaxes(0, 1).reshape(2, -1)
        own = hand.loads.ravel()
        sources = (
            hand_sources(hand.hand),
            surface.sources,
            (limits[i], -hand.closing_tension, palm.shear_limit, palm.pressing_limit, -z, y, -x),
            own,
            -own,
            (surface.planar @ planar).ravel(),
            by_finger[i],
            at_zero[i],
            *(_stops_and_nails(hand, layout) if layout.stops or layout.nail_columns else ()),
        )
        spaces.append(_assembled(layout, entries[i], np.concatenate(sources)))
    return spaces


class _Tiles(NamedTuple):
    """The tiles of some hands, one hand after another.

    Attributes
    ----------
    ends : tuple of int, length hands + 1
        Where each hand's begin, and where the last one's end.
    starts : ndarray of int, shape (fingers of all hands,)
        First tile of each finger.
    shares : ndarray, shape (n,)
        Part of its finger's lateral reaction that each tile carries.
    """

    ends: tuple[int, ...]
    starts: Indices
    shares: Array


@lru_cache(maxsize=KEPT_LAYOUTS)
def _tiles_of(entries: tuple[Entries, ...]) -> _Tiles:
    """Return the tiles of hands whose numbers come from these entries."""
    ends = tuple(itertools.accumulate((len(each.shares) for each in entries), initial=0))
    starts = [each.starts + end for each, end in zip(entries, ends, strict=False)]
    shares = [each.shares for each in entries]
    return _Tiles(ends, np.concatenate(starts), np.concatenate(shares))


def _stops_and_nails(settled: SettledHand, layout: RowLayout) -> list[Array]:
    """Return the last of the sources of `row_entries`: of joints at a stop, of nails that hook."""
    # in newtons of tension, so that rows stay commensurate
    torques = np.array([torque for _, _, torque in settled.stops]).reshape(-1, 2)
    scales = np.maximum(np.abs(torques[:, 1:]), LEAST_SLOPE)
    tiles = layout.nails
    forces, places = settled.axes[tiles, 0], settled.positions[tiles]
    axial = np.einsum("np,nf->npf", np.insert(places, 0, 1.0, axis=1), forces)
    limits: list[tuple[float, float, float]] = []
    for nail in tiles.tolist():
        t0, t1 = settled.loads[nail, 1].tolist()
        limits += [
            (limit.a_normal * t1, limit.a_shear, limit.a_normal * t0)
            for limit in settled.nail_limits(nail)
        ]
    return [
        (torques[:, ::-1] * (-1.0, 1.0) / scales).ravel(),
        (axial.reshape(-1, 12) @ MOMENTS.T).ravel(),
        np.array(limits).ravel(),
        *(rows.ravel() for rows, _ in settled.nail_rows),
        *(most for _, most in settled.nail_rows),
    ]


def _assembled(layout: RowLayout, entries: Entries, sources: Array) -> WrenchSpace:
    """Return the set of a layout whose numbers come from these sources."""
    numbers = sources.take(entries.index)
    numbers.setflags(write=False)
    m = len(layout.columns)
    a, b, c, d, e, f = entries.ends
    return WrenchSpace.assembled(
        origin=numbers[:a],
        generators=numbers[a:b].reshape(6, m),
        columns=layout.columns,
        rows=layout.rows,
        L=numbers[b:c].reshape(-1, m),
        l0=numbers[c:d],
        s=numbers[d:e],
        H=numbers[e:f].reshape(-1, m),
        h=numbers[f:],
        D=HELD_ROWS,
    )
