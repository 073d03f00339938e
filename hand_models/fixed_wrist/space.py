"""Wrench spaces of hands with a fixed wrist: from settled fingers to `WrenchSpace` (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
the load along each nail that hooks, and the palm's shear and pressing. All quantities are affine in
the loads:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure. Hands of equal `RowLayout` are computed
together in arrays. Sums over the tiles of each finger, of their places p and forces F,

    Σ (1, p) ⊗ F,    F at zero tension, per newton of tension and per newton of lateral reaction,

give the wrenches of all columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from hand_models.base import BASE_TOLERANCES, Array, check_positive, skew
from hand_models.fixed_wrist.finger_twist import twist_moments
from hand_models.fixed_wrist.row_layout import RowLayout, layout_of
from hand_models.hand import FINGERS, HELD_DIRECTIONS, HandModel, SettledHand
from hand_models.wrench_spaces import WrenchSpace

__all__ = [
    "HELD_ROWS",
    "hard_rows",
    "limit_rows",
    "wrench_columns",
    "wrench_space",
    "wrench_spaces",
]

HELD_ROWS: Final = np.hstack([HELD_DIRECTIONS, np.zeros_like(HELD_DIRECTIONS)])
"""D of every hand, shape (17, 6): takes a wrench to its force along the `HELD_DIRECTIONS`."""

HELD_ROWS.setflags(write=False)

NO_BOUND: Final = 1e4
"""Right-hand side of a hard row of what is off the rock, whose coefficients are zero [N]."""


def _moments() -> Array:
    """Return the matrix (p, 12) from (1, p) ⊗ F to a wrench and what is held of it."""
    wrench = np.zeros((6, 4, 3))
    wrench[:3, 0] = np.eye(3)
    for axis in range(3):
        wrench[3:, 1 + axis] = skew(np.eye(3)[axis])
    flat = wrench.reshape(6, 12)
    return np.vstack([flat, HELD_ROWS @ flat])


MOMENT_MAP: Final = _moments()
"""Map (23, 12) from (1, p) ⊗ F to a wrench and its force along the `HELD_DIRECTIONS`."""


def wrench_columns(layout: RowLayout, hands: Sequence[SettledHand]) -> tuple[Array, Array]:
    """Return the wrench of each hand at zero load, and the wrench per unit of each load.

    Parameters
    ----------
    layout : RowLayout
        Layout that all hands have, with m columns.
    hands : sequence of SettledHand, length h

    Returns
    -------
    at_zero : ndarray, shape (h, 23)
        Force and moment in H [N, N·m], then the force along the 17 `HELD_DIRECTIONS` [N].
    per_load : ndarray, shape (h, 23, m)
        The same per newton of each column's load.
    """
    axes, places, shares = (_of_tiles(hands, n) for n in ("axes", "positions", "lateral_shares"))
    # F three times, first in the tile's axes, then in H
    forces = np.zeros((*shares.shape, 3, 3))
    forces[..., :2, :2] = _of_tiles(hands, "loads").swapaxes(2, 3)
    forces[..., 2, 2] = shares
    forces = (forces @ axes).reshape(*shares.shape, 1, 9)
    arms = np.ones((*shares.shape, 4))
    arms[..., 1:] = places
    of_tiles = (arms[..., None] * forces).reshape(*shares.shape, 36)
    # not as a product of matrices: its last digits would depend on how many hands there are
    sums = _of_fingers(layout, of_tiles).reshape(len(hands), len(FINGERS), 4, 3, 3)
    wrenches = MOMENT_MAP @ sums.transpose(0, 3, 2, 4, 1).reshape(len(hands), 3, 12, -1)
    V = np.zeros((len(hands), len(MOMENT_MAP), len(layout.columns)))
    V[:, :, : len(FINGERS)] = wrenches[:, 1]
    V[:, :, list(layout.lateral_columns)] = wrenches[:, 2][:, :, list(layout.reacting)]
    if layout.nail_columns:
        axial = arms[:, layout.nails, :, None] * axes[:, layout.nails, :1]
        flat = axial.reshape(*axial.shape[:2], 12)
        V[:, :, list(layout.nail_columns)] = (flat @ MOMENT_MAP.T).swapaxes(1, 2)
    if layout.palm:
        x, y, z = np.array([hand.palm.centre for hand in hands]).T
        shear, pressing = V[:, :, -2], V[:, :, -1]
        shear[:, 0], shear[:, 4], shear[:, 5] = -1.0, -z, y
        pressing[:, 2], pressing[:, 3], pressing[:, 4] = 1.0, y, -x
        shear[:, 6:], pressing[:, 6:] = -HELD_DIRECTIONS[:, 0], HELD_DIRECTIONS[:, 2]
        V[[not hand.palm.engaged for hand in hands], :, -2:] = 0.0
    # residuals of forces that cancel [N/N, N·m/N]
    V[np.abs(V) < 0.01 * BASE_TOLERANCES.rounding] = 0.0
    return np.add.reduce(wrenches[:, 0], axis=2), V


def limit_rows(
    layout: RowLayout,
    model: HandModel,
    hands: Sequence[SettledHand],
    most: Array,
    wrenches: tuple[Array, Array],
) -> tuple[Array, Array, Array]:
    """Return the limits L y + l0 ≤ u s of hands: y are a hand's loads [N], u its utilisation.

    Parameters
    ----------
    layout : RowLayout
        Layout that all hands have, with m columns and nl limits.
    model : HandModel
    hands : sequence of SettledHand, length h
    most : ndarray, shape (h,)
        Largest tendon tension of each hand [N].
    wrenches : tuple of ndarray
        Result of `wrench_columns` for these hands.

    Returns
    -------
    L, l0, s : ndarray, shapes (h, nl, m), (h, nl), (h, nl)
        Load of each limit per unit of each column, at zero load, and its capacity; in the order of
        ``layout.limits``: tiles, tendons and motors, fingers, nails, palm, hand; [N], of motors
        also [N·m] and [A], of the twist of joints [N·m].
    """
    (at_zero, V), finger_of = wrenches, layout.finger_of
    loads, structure = _of_tiles(hands, "loads"), model.structure
    shape = len(hands), len(layout.limits)
    L, l0, s = np.zeros((*shape, V.shape[2])), np.zeros(shape), np.empty(shape)
    tile, k = layout.plane_tiles, len(layout.plane_tiles)
    row, of = np.arange(k), finger_of[tile]
    planes = layout.planes([hand.surface for hand in hands])
    planar = planes[:, :, :1] * loads[:, tile, 0] + planes[:, :, 1:2] * loads[:, tile, 1]
    held = _of_tiles(hands, "limit_shares")[:, tile]
    # spines that have let go carry nothing
    planar[held == 0.0] = 0.0
    l0[:, :k], L[:, row, of] = planar.transpose(2, 0, 1)
    s[:, :k] = planes[:, :, 3] * np.where(held > 0.0, held, 1.0)
    if layout.reacting:
        column = np.zeros(len(FINGERS), dtype=np.intp)
        column[list(layout.reacting)] = layout.lateral_columns
        shares = _of_tiles(hands, "lateral_shares")[:, tile]
        L[:, row, column[of]] = planes[:, :, 2] * shares
    for slope, start, end in (
        (1.0, 0.0, most[:, None]),
        *model.drive.limits,
    ):
        own = slice(k, k + len(FINGERS))
        L[:, own, : len(FINGERS)], l0[:, own], s[:, own] = slope * np.eye(len(FINGERS)), start, end
        k += len(FINGERS)
    engaged, tips = np.array(layout.engaged, dtype=np.intp), layout.tips
    signs = (1.0, -1.0)  # of a lateral reaction, and of a twist
    sideways, reacting = (
        np.repeat(np.array(each, dtype=np.intp), len(signs))
        for each in (layout.lateral_columns, layout.reacting)
    )
    shears = _of_fingers(layout, loads[:, :, 0])[:, engaged].transpose(2, 0, 1)
    twisted = np.repeat(np.array([i for i, _ in layout.twisted], dtype=np.intp), len(signs))
    twists = twist_moments(hands, layout.twisted).repeat(len(signs), axis=2)
    twists *= signs * len(layout.twisted)
    either_way = np.array([(0.0,) * len(sideways), signs * len(layout.reacting)])
    for of, (start, slope), end in (
        (engaged, shears, structure.finger_shear),
        (sideways, either_way, np.array([_aside(hand)[reacting] for hand in hands])),
        (finger_of[tips], loads[:, tips, 1].transpose(2, 0, 1), structure.fingertip_force),
        (twisted, twists, structure.finger_twist),
    ):
        row = k + np.arange(len(of))
        L[:, row, of], l0[:, row], s[:, row] = slope, start, end
        k += len(of)
    for nail, columns in _nails(layout):
        for h, hand in enumerate(hands):
            t0, t1 = loads[h, nail, 1]
            for i, limit in enumerate(hand.nail_limits(nail), k):
                L[h, i, columns] = limit.a_normal * t1, limit.a_shear
                l0[h, i], s[h, i] = limit.a_normal * t0, limit.capacity
        k += 2
    if layout.palm:
        L[:, [k, k + 1], [-2, -1]] = [[bool(hand.palm.engaged)] for hand in hands]
        s[:, k : k + 2] = [(hand.palm.shear_limit, hand.palm.pressing_limit) for hand in hands]
        k += 2
    L[:, k:], l0[:, k:], s[:, k:] = V[:, 6:], at_zero[:, 6:], structure.hand_load
    return L, l0, s


def hard_rows(layout: RowLayout, hands: Sequence[SettledHand]) -> tuple[Array, Array]:
    """Return the hard rows H y ≤ h of hands: conditions on the loads y that hold at any strength.

    Parameters
    ----------
    layout : RowLayout
        Layout that all hands have, with m columns and nh hard rows.
    hands : sequence of SettledHand, length n

    Returns
    -------
    H, h : ndarray, shapes (n, nh, m), (n, nh)
        Coefficients and right-hand sides, in the order of ``layout.hard``: tensions, tiles, joint
        stops, nails, tendon friction, palm.
    """
    loads, shape = _of_tiles(hands, "loads"), (len(hands), len(layout.hard))
    friction = np.array([hand.surface.friction for hand in hands])[:, None, None]
    pressed, base = loads[:, :, 1].copy(), layout.bases
    pressed[:, base] = _of_tiles(hands, "engagement")[:, base, None] * pressed[:, base + 1]
    drags = loads[:, :, 0] + friction * pressed
    drags[:, :, 0] += _of_tiles(hands, "drag_allowances")
    H, h = np.zeros((*shape, len(layout.columns))), np.zeros(shape)
    H[:, : len(FINGERS), : len(FINGERS)] = -np.eye(len(FINGERS))
    k = len(FINGERS)
    for tiles, kept in ((layout.touching, drags), (layout.frames, loads[:, :, 1])):
        row, along = k + np.arange(len(tiles)), kept[:, tiles]
        H[:, row, layout.finger_of[tiles]], h[:, row] = -along[:, :, 1], along[:, :, 0]
        # what is off the rock has no such condition
        h[:, row] = np.where(loads[:, tiles].any(axis=(2, 3)), h[:, row], NO_BOUND)
        k += len(tiles)
    if layout.stops:
        row, stopped = k + np.arange(len(layout.stops)), [finger for finger, _ in layout.stops]
        torques = np.array([[torque for _, _, torque in hand.stops] for hand in hands])
        idle = ~torques.any(axis=2)
        # in newtons of tension, so that rows stay commensurate
        torques /= np.maximum(np.abs(torques[..., 1:]), 1e-6)
        H[:, row, stopped] = -torques[..., 1]
        h[:, row] = np.where(idle, NO_BOUND, torques[..., 0])
        k += len(row)
    for i, (_, columns) in enumerate(_nails(layout)):
        rows, ends = (np.array([hand.nail_rows[i][part] for hand in hands]) for part in (0, 1))
        own = slice(k, k + ends.shape[1])
        H[:, own, columns], h[:, own] = rows, ends
        k = own.stop
    if layout.sticking:
        row, drawing = k + np.arange(len(layout.drawing)), list(layout.drawing)
        H[:, row, drawing] = -1.0
        closing = np.array([[-hand.closing_tension] for hand in hands])
        drawn = _of_fingers(layout, _of_tiles(hands, "holding"))[:, drawing]
        h[:, row] = np.where(drawn > 0, closing, 0.0)
    if layout.palm:
        H[:, -2:, -2:] = -np.eye(2)
    return H, h


def _aside(hand: SettledHand) -> Array:
    """Return the lateral strength of each finger (4,) [N]; of one that has let go, as it closed."""
    limits = hand.lateral_limits
    return np.where(limits > 0.0, limits, hand.as_closed.lateral_limits)


def _nails(layout: RowLayout) -> list[tuple[int, list[int]]]:
    """Return nails that hook, and their columns: the finger's tension, the load along the nail."""
    fingers = layout.finger_of[layout.nails].tolist()
    columns = [list(pair) for pair in zip(fingers, layout.nail_columns, strict=True)]
    return list(zip(layout.nails.tolist(), columns, strict=True))


def _of_tiles(hands: Sequence[SettledHand], name: str) -> Array:
    """Return an array of each hand's tiles, of all hands: shape (h, n, …)."""
    arrays: list[Array] = [getattr(hand, name) for hand in hands]
    return np.concatenate(arrays).reshape(len(hands), *arrays[0].shape)


def _of_fingers(layout: RowLayout, tiles: Array) -> Array:
    """Return sums (h, 4, …) over each finger's tiles (h, n, …)."""
    starts = np.searchsorted(layout.finger_of, np.arange(len(FINGERS)))
    return np.asarray(np.add.reduceat(tiles, starts, axis=1))


def wrench_space(settled: SettledHand, tension_limit: float | None = None) -> WrenchSpace:
    """Return all wrenches on the rock, in H, that a settled hand can exert with its wrist fixed.

    Parameters
    ----------
    settled : SettledHand
    tension_limit : float, optional
        Cap on every tendon's tension; the hand's maximum applies where that is less [N].

    Returns
    -------
    WrenchSpace
        Columns: four tensions, the lateral reactions, the load along each nail that hooks, palm
        shear and palm pressing [N]. Limit rows: each tile's half-planes (with both signs of its
        lateral load); each tendon's tension, motor torque [N·m] and motor current [A]; the shear of
        a finger's tiles together, a finger's lateral load, the pressing of its tip, the twist
        of its joints [N·m]; two for each nail; the palm; and, as wrench rows, the hand's force
        along the `HELD_DIRECTIONS`. Hard rows: no negative tension or palm load; no tile dragged
        backwards; a joint's stop and a frame beside its tile only push; a nail that hooks neither
        lifts nor slips nor closes its finger; with friction in the tendons, no tension below
        closing, where they would stick.
        Arrays are read-only.

    Raises
    ------
    InvalidInputError
        If ``tension_limit`` is not above zero.
    """
    # a set of its own: the vertices and half-spaces that it keeps go when the caller is done
    return replace(wrench_spaces([settled], tension_limit)[0])


def wrench_spaces(
    settled: Sequence[SettledHand], tension_limit: float | None = None
) -> list[WrenchSpace]:
    """Return the wrench space of each of several hands, as `wrench_space` does, computed together.

    Each hand has a cache of its last wrench spaces: a second call returns the same objects.

    Parameters
    ----------
    settled : sequence of SettledHand
    tension_limit : float, optional
        Cap on every tendon's tension; each hand's maximum applies where that is less [N].

    Returns
    -------
    list of WrenchSpace
        In the order of the hands.

    Raises
    ------
    InvalidInputError
        If ``tension_limit`` is not above zero.
    """
    if tension_limit is not None:
        check_positive(tension_limit, "N", "tension_limit", most=math.inf)
    cap = math.inf if tension_limit is None else tension_limit
    limits = [min(hand.hand.maximum_tension, cap) for hand in settled]
    found: dict[SettledHand, WrenchSpace] = {}
    new: dict[SettledHand, float] = {}
    for hand, limit in zip(settled, limits, strict=True):
        (known,) = hand.sets.find([limit])
        if known is None:
            new[hand] = limit
        else:
            found[hand] = known
    if new:
        for hand, space in _worked_out(new):
            found[hand] = space
            hand.sets.keep([(new[hand], space)])
    return [found[hand] for hand in settled]


def _worked_out(limits: Mapping[SettledHand, float]) -> Iterator[tuple[SettledHand, WrenchSpace]]:
    """Yield hands and their sets for each one's largest tension [N], of those alike together."""
    alike: dict[tuple[RowLayout, HandModel], list[SettledHand]] = {}
    for hand in limits:
        layout = layout_of(hand, sticking=hand.hand.finger.friction > 0.0)
        alike.setdefault((layout, hand.hand), []).append(hand)
    for (layout, model), hands in alike.items():
        at_zero, V = wrenches = wrench_columns(layout, hands)
        most = np.array([limits[hand] for hand in hands])
        L, l0, s = limit_rows(layout, model, hands, most, wrenches)
        H, h = hard_rows(layout, hands)
        for array in (at_zero, V, L, l0, s, H, h):
            array.setflags(write=False)
        for i, hand in enumerate(hands):
            yield (
                hand,
                WrenchSpace(
                    origin=at_zero[i, :6],
                    generators=V[i, :6],
                    columns=layout.columns,
                    rows=layout.rows,
                    L=L[i],
                    l0=l0[i],
                    s=s[i],
                    H=H[i],
                    h=h[i],
                    D=HELD_ROWS,
                ),
            )
