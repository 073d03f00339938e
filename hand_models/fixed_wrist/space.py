"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure. All hands of a stance are worked out
together: sums over the tiles of each finger, of their places p and forces F,

    Σ (1, p) ⊗ F,    F at zero tension, per newton of tension and per newton of lateral reaction,

hold the wrenches of all columns; what then goes where is in `entries_of_batch`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from hand_models.base import Array, InvalidInputError, skew
from hand_models.fixed_wrist.batch_entries import BatchEntries, entries_of_batch
from hand_models.fixed_wrist.row_layout import RowLayout, layout_of
from hand_models.hand import FINGERS, HELD, SettledHand
from hand_models.wrench_spaces import WrenchSpace

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
        known = hand.sets.get(limit)
        if known is None:
            new[hand] = limit
        else:
            found[hand] = known
    if new:
        for (hand, limit), space in zip(new.items(), _worked_out(new), strict=True):
            found[hand] = hand.sets[limit] = space
            if len(hand.sets) > KEPT:
                for known_limit in list(hand.sets)[:-KEPT]:
                    hand.sets.pop(known_limit, None)
    return [found[hand] for hand in settled]


def _worked_out(limits: Mapping[SettledHand, float]) -> list[WrenchSpace]:
    """Return the sets of hands for each hand's largest tension [N]."""
    hands = list(limits)
    layouts = [layout_of(hand, sticking=hand.hand.finger.friction > 0.0) for hand in hands]
    entries = entries_of_batch(
        tuple(layouts),
        tuple([hand.hand for hand in hands]),
        tuple([hand.surface for hand in hands]),
    )
    loads = np.concatenate([hand.loads for hand in hands])
    shares = np.concatenate([hand.lateral_shares for hand in hands])
    wrenches, shears = _sums(hands, loads, shares, entries)
    at_zero = np.add.reduce(wrenches[:, 0].reshape(-1, len(FINGERS)), axis=1)
    given: list[float] = []
    further: list[Array] = []
    for (hand, limit), layout in zip(limits.items(), layouts, strict=True):
        palm = hand.palm
        x, y, z = palm.centre.tolist()
        given += (limit, -hand.closing_tension, palm.shear_limit, palm.pressing_limit, -z, y, -x)
        if layout.stops or layout.nail_columns:
            further += _stops_and_nails(hand, layout)
    own = loads.ravel()
    planes = entries.planes * loads.reshape(-1, 4).take(entries.plane_tiles, axis=0)
    planar = (planes[:, :2] + planes[:, 2:]).ravel()
    engagement = np.concatenate([hand.engagement for hand in hands])
    parts = np.stack([shares, shares, engagement], axis=1)
    limits = (entries.limits * parts.take(entries.plane_tiles, axis=0)).ravel()
    sources = np.concatenate(
        [
            *(entries.constants, given, own, -own, planar, limits),
            *(wrenches.ravel(), shears.ravel(), at_zero, *further),
        ]
    )
    numbers = sources.take(entries.index)
    numbers.setflags(write=False)
    return [
        _assembled(layout, ends, numbers)
        for layout, ends in zip(layouts, entries.ends, strict=True)
    ]


def _sums(
    settled: Sequence[SettledHand], loads: Array, shares: Array, entries: BatchEntries
) -> tuple[Array, Array]:
    """Return sums over the tiles of each finger, of hands one after another.

    Parameters
    ----------
    settled : sequence of SettledHand
    loads : ndarray, shape (n, 2, 2)
        Of all their tiles.
    shares : ndarray, shape (n,)
        Of their fingers' lateral reactions.
    entries : BatchEntries

    Returns
    -------
    wrenches : ndarray, shape (`WRENCH_PARTS`, 3, fingers)
        At zero tension, per newton of tension and per newton of lateral reaction.
    shears : ndarray, shape (fingers, 2)
        At zero tension, and per newton of it.
    """
    axes = np.concatenate([hand.axes for hand in settled])
    places = np.concatenate([hand.positions for hand in settled])
    # F three times, first in the tile's axes, then in H
    forces = np.zeros((len(loads), 3, 3))
    forces[:, :2, :2] = loads.transpose(0, 2, 1)
    forces[:, 2, 2] = shares
    forces = (forces @ axes).reshape(-1, 1, 9)
    arms = np.concatenate([entries.ones, places], axis=1)
    of_tiles = (arms[:, :, None] * forces).reshape(-1, 36)
    # not as a product of matrices: its last digits would depend on how many hands there are
    sums = np.add.reduceat(of_tiles, entries.starts).reshape(-1, 4, 3, 3)
    wrenches = MOMENTS @ sums.transpose(1, 3, 2, 0).reshape(12, -1)
    return wrenches.reshape(len(MOMENTS), 3, -1), np.add.reduceat(loads[:, 0], entries.starts)


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


def _assembled(layout: RowLayout, ends: tuple[int, ...], numbers: Array) -> WrenchSpace:
    """Return the set of a layout whose numbers are between these ends."""
    m = len(layout.columns)
    a, b, c, d, e, f, g, last = ends
    return WrenchSpace.assembled(
        origin=numbers[a:b],
        generators=numbers[b:c].reshape(6, m),
        columns=layout.columns,
        rows=layout.rows,
        L=numbers[c:d].reshape(-1, m),
        l0=numbers[d:e],
        s=numbers[e:f],
        H=numbers[f:g].reshape(-1, m),
        h=numbers[g:last],
        D=HELD_ROWS,
    )
