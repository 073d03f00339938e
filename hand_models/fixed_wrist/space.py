"""A hand whose wrist stays where it is: from settled fingers to a WrenchSpace (Eqs. 9, 14–16).

The loads y are the tendon tensions, a passive lateral reaction for each finger that touches rock,
and the palm's shear and pressing. Everything is affine in them:

    w = Σ_tiles W_t (c_sys + f c_act) + lateral and palm loads = o + V y,

and so are the loads of the motors and of the structure. All hands of a stance are worked out
together, those with the same rows and columns (`RowLayout`) in arrays of all of them: sums over the
tiles of each finger, of their places p and forces F,

    Σ (1, p) ⊗ F,    F at zero tension, per newton of tension and per newton of lateral reaction,

hold the wrenches of all columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, InvalidInputError, skew
from hand_models.fixed_wrist.row_layout import RowLayout, layout_of
from hand_models.hand import FINGERS, HELD, HandModel, SettledHand
from hand_models.tile import Surface, inner_half_planes
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["wrench_space", "wrench_spaces"]

KEPT: Final = 4
"""Sets that are kept of one settled hand, for different tension limits."""

LEAST_SLOPE: Final = 1e-6
"""Torque on a joint's stop per newton of tension by which its row is divided, at least [m]."""

EACH_TENDON: Final = np.eye(len(FINGERS))

EACH_PALM_LOAD: Final = np.eye(2)

WRENCH_PARTS: Final = 6 + len(HELD)
"""A wrench, and what of its force is held along each of `HELD`."""

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


@lru_cache(maxsize=256)
def surface_planes(surface: Surface) -> Array:
    """Return the half-planes of whole tiles on a surface, shape (p, 4).

    Coefficients of shear, normal and lateral load, and capacity [N].
    """
    return np.array(
        [(p.a_shear, p.a_normal, p.a_lateral, p.capacity) for p in inner_half_planes(surface)]
    )


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
        for hand, space in _worked_out(new):
            found[hand] = hand.sets[new[hand]] = space
            if len(hand.sets) > KEPT:
                for known_limit in list(hand.sets)[:-KEPT]:
                    hand.sets.pop(known_limit, None)
    return [found[hand] for hand in settled]


def _worked_out(limits: Mapping[SettledHand, float]) -> Iterator[tuple[SettledHand, WrenchSpace]]:
    """Yield hands and their sets for each one's largest tension [N], of those alike together."""
    alike: dict[tuple[RowLayout, HandModel], list[SettledHand]] = {}
    for hand in limits:
        layout = layout_of(hand, sticking=hand.hand.finger.friction > 0.0)
        alike.setdefault((layout, hand.hand), []).append(hand)
    for (layout, model), hands in alike.items():
        most = np.array([limits[hand] for hand in hands])
        yield from zip(hands, _of_layout(layout, model, hands, most), strict=True)


def _of_layout(
    layout: RowLayout, model: HandModel, hands: Sequence[SettledHand], most: Array
) -> list[WrenchSpace]:
    """Return the sets of hands with the same rows and columns; ``most`` tension of each (h,)."""
    loads, parts = _stacked(hands, "loads"), _stacked(hands, "engagement")
    shares = _stacked(hands, "lateral_shares")
    sums = _sums(layout, hands, loads, shares)
    palm, nails = _Palms.of(hands), _Nails.of(layout, hands)
    count, nl, nh, m = len(hands), len(layout.limits), len(layout.hard), len(layout.columns)
    tendons, finger_of = len(FINGERS), layout.finger_of
    reacting, hooked = list(layout.reacting), list(layout.nail_columns)
    # columns one after another: tensions, reactions, nails, palm
    lateral = slice(tendons, tendons + len(reacting))

    # the wrench, and below it what of its force is held: the last limit rows
    V = np.zeros((count, WRENCH_PARTS, m))
    V[:, :, :tendons] = sums.wrenches[:, 1]
    V[:, :, lateral] = sums.wrenches[:, 2][:, :, reacting]
    if hooked:
        V[:, :, hooked] = nails.axial
    if layout.palm:
        V[:, :, -2:] = palm.effects
    at_zero = np.add.reduce(sums.wrenches[:, 0], axis=2)

    L, l0, s = np.zeros((count, nl, m)), np.zeros((count, nl)), np.empty((count, nl))
    tile, k = layout.plane_tiles, len(layout.plane_tiles)
    row, of = np.arange(k), finger_of[tile]
    planes = np.array([surface_planes(hand.surface) for hand in hands])[:, layout.plane_pieces]
    planar = planes[:, :, :1] * loads[:, tile, 0] + planes[:, :, 1:2] * loads[:, tile, 1]
    l0[:, :k], L[:, row, of] = planar.transpose(2, 0, 1)
    s[:, :k] = planes[:, :, 3] * parts[:, tile]
    if reacting:
        column = np.zeros(tendons, dtype=np.intp)
        column[reacting] = layout.lateral_columns
        L[:, row, column[of]] = planes[:, :, 2] * layout.plane_signs * shares[:, tile]
    drive, structure = model.drive, model.structure
    for slope, start, end in (
        (1.0, 0.0, most[:, None]),
        (drive.torque_per_newton, 0.0, drive.maximum_torque),
        (drive.current_per_newton, drive.no_load_current, drive.maximum_current),
    ):
        own = slice(k, k + tendons)
        L[:, own, :tendons], l0[:, own], s[:, own] = slope * EACH_TENDON, start, end
        k += tendons
    engaged, tips = np.array(layout.engaged, dtype=np.intp), layout.tips
    for of, (start, slope), end in (
        (engaged, sums.shears[:, :, engaged].transpose(1, 0, 2), structure.finger_shear),
        (finger_of[tips], loads[:, tips, 1].transpose(2, 0, 1), structure.fingertip_force),
    ):
        row = k + np.arange(len(of))
        L[:, row, of], l0[:, row], s[:, row] = slope, start, end
        k += len(of)
    for i, (column_of, nail) in enumerate(zip(hooked, layout.nails, strict=True)):
        L[:, k : k + 2, [finger_of[nail], column_of]] = nails.limits[:, i, :, :2]
        l0[:, k : k + 2] = nails.limits[:, i, :, 2]
        s[:, k : k + 2] = structure.finger_shear, structure.fingertip_force
        k += 2
    if layout.palm:
        L[:, k : k + 2, -2:] = EACH_PALM_LOAD
        s[:, k : k + 2] = palm.limits
        k += 2
    L[:, k:], l0[:, k:], s[:, k:] = V[:, 6:], at_zero[:, 6:], structure.hand_load

    H, h = np.zeros((count, nh, m)), np.zeros((count, nh))
    H[:, :tendons, :tendons] = -EACH_TENDON
    k = tendons
    for tiles, component in ((layout.touching, 0), (layout.frames, 1)):
        if len(tiles):
            row, along = k + np.arange(len(tiles)), loads[:, tiles, component]
            H[:, row, finger_of[tiles]], h[:, row] = -along[:, :, 1], along[:, :, 0]
            k += len(tiles)
    if layout.stops:
        row, stopped = k + np.arange(len(layout.stops)), [finger for finger, _ in layout.stops]
        H[:, row, stopped], h[:, row] = _stop_rows(hands)
        k += len(row)
    for i, (column_of, nail) in enumerate(zip(hooked, layout.nails, strict=True)):
        rows = slice(k, k + nails.ends.shape[2])
        H[:, rows, [finger_of[nail], column_of]], h[:, rows] = nails.rows[:, i], nails.ends[:, i]
        k = rows.stop
    if layout.sticking:
        row, drawing = k + np.arange(len(layout.drawing)), list(layout.drawing)
        H[:, row, drawing] = -1.0
        h[:, row] = [[-hand.closing_tension] for hand in hands]
    if layout.palm:
        H[:, -2:, -2:] = -EACH_PALM_LOAD
    for array in (at_zero, V, L, l0, s, H, h):
        array.setflags(write=False)
    return [
        WrenchSpace.assembled(
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
        )
        for i in range(count)
    ]


def _stacked(hands: Sequence[SettledHand], name: str) -> Array:
    arrays: list[Array] = [getattr(hand, name) for hand in hands]
    return np.concatenate(arrays).reshape(len(hands), *arrays[0].shape)


class _Sums(NamedTuple):
    """Sums over the tiles of each finger, of h hands.

    Attributes
    ----------
    wrenches : ndarray, shape (h, 3, `WRENCH_PARTS`, 4)
        At zero tension, per newton of tension and per newton of lateral reaction.
    shears : ndarray, shape (h, 2, 4)
        At zero tension, and per newton of it.
    """

    wrenches: Array
    shears: Array


def _sums(layout: RowLayout, hands: Sequence[SettledHand], loads: Array, shares: Array) -> _Sums:
    axes, places = _stacked(hands, "axes"), _stacked(hands, "positions")
    starts = np.searchsorted(layout.finger_of, np.arange(len(FINGERS)))
    # F three times, first in the tile's axes, then in H
    forces = np.zeros((*shares.shape, 3, 3))
    forces[..., :2, :2] = loads.swapaxes(2, 3)
    forces[..., 2, 2] = shares
    forces = (forces @ axes).reshape(*shares.shape, 1, 9)
    arms = np.ones((*shares.shape, 4))
    arms[..., 1:] = places
    of_tiles = (arms[..., None] * forces).reshape(*shares.shape, 36)
    # not as a product of matrices: its last digits would depend on how many hands there are
    sums = np.add.reduceat(of_tiles, starts, axis=1).reshape(len(hands), len(FINGERS), 4, 3, 3)
    wrenches = MOMENTS @ sums.transpose(0, 3, 2, 4, 1).reshape(len(hands), 3, 12, -1)
    return _Sums(wrenches, np.add.reduceat(loads[:, :, 0], starts, axis=1).swapaxes(1, 2))


class _Palms(NamedTuple):
    """What the palms of h hands do: wrenches of shear and pressing, and how much they bear.

    Attributes
    ----------
    effects : ndarray, shape (h, `WRENCH_PARTS`, 2)
    limits : ndarray, shape (h, 2)
        [N]
    """

    effects: Array
    limits: Array

    @classmethod
    def of(cls, hands: Sequence[SettledHand]) -> _Palms:
        palms = [hand.palm for hand in hands]
        effects = np.zeros((len(hands), WRENCH_PARTS, 2))
        x, y, z = np.array([palm.centre for palm in palms]).T
        effects[:, 0, 0], effects[:, 4, 0], effects[:, 5, 0] = -1.0, -z, y
        effects[:, 2, 1], effects[:, 3, 1], effects[:, 4, 1] = 1.0, y, -x
        effects[:, 6:] = HELD[:, [0, 2]] * (-1.0, 1.0)
        limits = [(palm.shear_limit, palm.pressing_limit) for palm in palms]
        return cls(effects, np.array(limits))


class _Nails(NamedTuple):
    """What the k nails that hook do of h hands.

    Attributes
    ----------
    axial : ndarray, shape (h, `WRENCH_PARTS`, k)
        Of the load along each.
    limits : ndarray, shape (h, k, 2, 3)
        Of both limit rows: slope, axial coefficient, load at zero tension.
    rows : ndarray, shape (h, k, r, 2)
        Hard rows, over tension and the load along the nail.
    ends : ndarray, shape (h, k, r)
        Their right-hand sides.
    """

    axial: Array
    limits: Array
    rows: Array
    ends: Array

    @classmethod
    def of(cls, layout: RowLayout, hands: Sequence[SettledHand]) -> _Nails:
        if not layout.nail_columns:
            none = np.zeros((len(hands), 0, 0, 0))
            return cls(np.zeros((len(hands), WRENCH_PARTS, 0)), none, none, none)
        tiles = layout.nails
        forces, places = (_stacked(hands, name)[:, tiles] for name in ("axes", "positions"))
        axial = np.einsum("hnp,hnf->hnpf", np.insert(places, 0, 1.0, axis=2), forces[:, :, 0])
        limits = [
            [
                [
                    (limit.a_normal * t1, limit.a_shear, limit.a_normal * t0)
                    for limit in hand.nail_limits(nail)
                ]
                for nail, (t0, t1) in zip(tiles.tolist(), hand.loads[tiles, 1], strict=True)
            ]
            for hand in hands
        ]
        return cls(
            (axial.reshape(*axial.shape[:2], 12) @ MOMENTS.T).swapaxes(1, 2),
            np.array(limits),
            np.array([[rows for rows, _ in hand.nail_rows] for hand in hands]),
            np.array([[ends for _, ends in hand.nail_rows] for hand in hands]),
        )


def _stop_rows(hands: Sequence[SettledHand]) -> Array:
    """Return entries and right-hand sides of joints at a stop, (2, h, stops).

    In newtons of tension, so that rows stay commensurate.
    """
    torques = np.array([[torque for _, _, torque in hand.stops] for hand in hands])
    scales = np.maximum(np.abs(torques[..., 1:]), LEAST_SLOPE)
    return np.asarray(torques[..., ::-1] * (-1.0, 1.0) / scales).transpose(2, 0, 1)
