"""Hands with the same rows and columns, all at once: what goes where in their sets, by its formula.

Sums over the tiles of each finger, of their places p and forces F,

    Σ (1, p) ⊗ F,    F at zero tension, per newton of tension and per newton of lateral reaction,

hold the wrenches of all columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, skew
from hand_models.fixed_wrist.row_layout import RowLayout, surface_planes
from hand_models.hand import FINGERS, HELD, HandModel, SettledHand

__all__ = ["HELD_ROWS", "AlikeHands"]

LEAST_SLOPE: Final = 1e-6
"""Torque on a joint's stop per newton of tension by which its row is divided, at least [m]."""

TENDONS: Final = len(FINGERS)

EACH_TENDON: Final = np.eye(TENDONS)

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


class AlikeHands(NamedTuple):
    """Hands with the same n tiles, rows and columns, h of them.

    Columns are, one after another, tensions, lateral reactions, nails that hook, the palm.

    Attributes
    ----------
    layout : RowLayout
    model : HandModel
    hands : sequence of SettledHand
    most : ndarray, shape (h,)
        Largest tension [N].
    loads : ndarray, shape (h, n, 2, 2)
    engagement, shares : ndarray, shape (h, n)
        `SettledHand.engagement` and `lateral_shares`.
    sums : _Sums
    palms : _Palms
    nails : _Nails
    """

    layout: RowLayout
    model: HandModel
    hands: Sequence[SettledHand]
    most: Array
    loads: Array
    engagement: Array
    shares: Array
    sums: _Sums
    palms: _Palms
    nails: _Nails

    @classmethod
    def of(
        cls, layout: RowLayout, model: HandModel, hands: Sequence[SettledHand], most: Array
    ) -> AlikeHands:
        loads, shares = _stacked(hands, "loads"), _stacked(hands, "lateral_shares")
        sums = _sums(layout, hands, loads, shares)
        palms, nails = _Palms.of(hands), _Nails.of(layout, hands)
        engagement = _stacked(hands, "engagement")
        return cls(layout, model, hands, most, loads, engagement, shares, sums, palms, nails)

    def wrenches(self) -> tuple[Array, Array]:
        """Return wrenches at zero tension (h, p), and those of the columns (h, p, m).

        Below each of the p = `WRENCH_PARTS` what of its force is held: the last limit rows.
        """
        layout, sums, hooked = self.layout, self.sums, list(self.layout.nail_columns)
        reacting = list(layout.reacting)
        V = np.zeros((len(self.hands), WRENCH_PARTS, len(layout.columns)))
        V[:, :, :TENDONS] = sums.wrenches[:, 1]
        V[:, :, TENDONS : TENDONS + len(reacting)] = sums.wrenches[:, 2][:, :, reacting]
        if hooked:
            V[:, :, hooked] = self.nails.axial
        if layout.palm:
            V[:, :, -2:] = self.palms.effects
        return np.add.reduce(sums.wrenches[:, 0], axis=2), V

    def limits(self, at_zero: Array, V: Array) -> tuple[Array, Array, Array]:
        """Return L (h, nl, m), l0 and s (h, nl): tiles, tendons, fingers, nails, palm, the hand."""
        layout, loads, finger_of = self.layout, self.loads, self.layout.finger_of
        drive, structure = self.model.drive, self.model.structure
        shape = len(self.hands), len(layout.limits)
        L, l0, s = np.zeros((*shape, V.shape[2])), np.zeros(shape), np.empty(shape)
        tile, k = layout.plane_tiles, len(layout.plane_tiles)
        row, of = np.arange(k), finger_of[tile]
        tables = np.array([surface_planes(hand.surface) for hand in self.hands])
        planes = tables[:, layout.plane_pieces]
        planar = planes[:, :, :1] * loads[:, tile, 0] + planes[:, :, 1:2] * loads[:, tile, 1]
        l0[:, :k], L[:, row, of] = planar.transpose(2, 0, 1)
        s[:, :k] = planes[:, :, 3] * self.engagement[:, tile]
        if layout.reacting:
            column = np.zeros(TENDONS, dtype=np.intp)
            column[list(layout.reacting)] = layout.lateral_columns
            L[:, row, column[of]] = planes[:, :, 2] * layout.plane_signs * self.shares[:, tile]
        for slope, start, end in (
            (1.0, 0.0, self.most[:, None]),
            (drive.torque_per_newton, 0.0, drive.maximum_torque),
            (drive.current_per_newton, drive.no_load_current, drive.maximum_current),
        ):
            own = slice(k, k + TENDONS)
            L[:, own, :TENDONS], l0[:, own], s[:, own] = slope * EACH_TENDON, start, end
            k += TENDONS
        engaged, tips = np.array(layout.engaged, dtype=np.intp), layout.tips
        shears = self.sums.shears[:, :, engaged].transpose(1, 0, 2)
        for of, (start, slope), end in (
            (engaged, shears, structure.finger_shear),
            (finger_of[tips], loads[:, tips, 1].transpose(2, 0, 1), structure.fingertip_force),
        ):
            row = k + np.arange(len(of))
            L[:, row, of], l0[:, row], s[:, row] = slope, start, end
            k += len(of)
        for i, columns in enumerate(self._of_nails()):
            L[:, k : k + 2, columns] = self.nails.limits[:, i, :, :2]
            l0[:, k : k + 2] = self.nails.limits[:, i, :, 2]
            s[:, k : k + 2] = structure.finger_shear, structure.fingertip_force
            k += 2
        if layout.palm:
            L[:, k : k + 2, -2:], s[:, k : k + 2] = EACH_PALM_LOAD, self.palms.limits
            k += 2
        L[:, k:], l0[:, k:], s[:, k:] = V[:, 6:], at_zero[:, 6:], structure.hand_load
        return L, l0, s

    def hard(self) -> tuple[Array, Array]:
        """Return H (h, nh, m) and h (h, nh): tensions, tiles, stops, nails, friction, the palm."""
        layout, shape = self.layout, (len(self.hands), len(self.layout.hard))
        H, h = np.zeros((*shape, len(layout.columns))), np.zeros(shape)
        H[:, :TENDONS, :TENDONS] = -EACH_TENDON
        k = TENDONS
        for tiles, component in ((layout.touching, 0), (layout.frames, 1)):
            if len(tiles):
                row, along = k + np.arange(len(tiles)), self.loads[:, tiles, component]
                H[:, row, layout.finger_of[tiles]], h[:, row] = -along[:, :, 1], along[:, :, 0]
                k += len(tiles)
        if layout.stops:
            row, stopped = k + np.arange(len(layout.stops)), [finger for finger, _ in layout.stops]
            H[:, row, stopped], h[:, row] = _stop_rows(self.hands)
            k += len(row)
        for i, columns in enumerate(self._of_nails()):
            rows, ends = self.nails.rows[:, i], self.nails.ends[:, i]
            own = slice(k, k + ends.shape[1])
            H[:, own, columns], h[:, own] = rows, ends
            k = own.stop
        if layout.sticking:
            row, drawing = k + np.arange(len(layout.drawing)), list(layout.drawing)
            H[:, row, drawing] = -1.0
            h[:, row] = [[-hand.closing_tension] for hand in self.hands]
        if layout.palm:
            H[:, -2:, -2:] = -EACH_PALM_LOAD
        return H, h

    def _of_nails(self) -> list[list[int]]:
        """Return the columns of each nail that hooks: its finger's tension, the load along it."""
        fingers = self.layout.finger_of[self.layout.nails].tolist()
        return [list(pair) for pair in zip(fingers, self.layout.nail_columns, strict=True)]


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
