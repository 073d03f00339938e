"""Cascades at fixed tensions: tiles slip, the weakest first, until all rest or a hand is lost.

Motors keep their tensions and the hands their postures. A tile that slips changes the loads of its
finger (`planner.simulation.finger_states`); the lateral reactions of fingers and the palms' loads
take over what is then missing in the balance, as springs between a rigid body and the rock
(`planner.simulation.passive_loads`); palms press and shear one way only. A lateral reaction leaves
the tiles that have slipped, and stays in the others in proportion to their spines. A palm counts as
one tile: loaded in shear beyond its strength it slips, and carries no shear any more.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Indices
from hand_models.tile import inner_half_planes
from hand_models.wrench_spaces import WRENCH_SCALE
from planner.prepare import HandBatch, PreparedStance
from planner.simulation.finger_states import STATE_DIGITS, FingerStates, PhalanxState
from planner.simulation.passive_loads import BALANCE_SETTINGS, balanced

__all__ = ["Cascade", "CascadeOutcome", "Loads", "StateLoads"]

Flags = NDArray[np.bool_]


class Loads(NamedTuple):
    """Loads of a plan, over all hands.

    Attributes
    ----------
    tiles : ndarray, shape (T, 3)
        Shear, normal and lateral load of each tile [N].
    laterals : ndarray, shape (F,)
        Lateral reaction of each finger [N].
    palms : ndarray, shape (H, 2)
        Shear toward −x and pressing of each palm [N].
    """

    tiles: Array
    laterals: Array
    palms: Array

    @classmethod
    def of(cls, batch: HandBatch, tiles: Array, palms: Array) -> Loads:
        """Return the loads of a plan from those of tiles and palms' forces in H, (H, 3) [N]."""
        laterals = np.add.reduceat(tiles[:, 2], batch.places.first_of_finger)
        return cls(tiles, laterals, palms[:, ::2] * [-1.0, 1.0])


class StateLoads(NamedTuple):
    """Loads of S states of slipped tiles.

    Attributes
    ----------
    used : ndarray, shape (S, T + H)
        Utilisation of each tile's strength, then of each palm's in shear; 0 for what has slipped.
    tiles : ndarray, shape (S, T, 3)
        Shear, normal and lateral load of each tile [N].
    palms : ndarray, shape (S, H, 2)
        Shear and pressing of each palm [N].
    holding : ndarray of bool, shape (S, T)
        Tiles that hold.
    lost : ndarray of bool, shape (S,)
        Whether no tile of a hand holds, or nothing balances the body.
    """

    used: Array
    tiles: Array
    palms: Array
    holding: Flags
    lost: Flags


class CascadeOutcome(NamedTuple):
    """Outcome of n draws of strengths.

    Attributes
    ----------
    held : ndarray of bool, shape (n,)
        Whether all hands hold at last.
    slips : ndarray of int, shape (n,)
        Number of tiles and palms that have slipped, each weaker than its load.
    first : ndarray of int, shape (n,)
        Which tile or palm slipped first (palms after the tiles); −1 if none did.
    states : ndarray of uint8, shape (n, 2 F + H)
        Final states: of each finger's phalanges, of its base, of each palm.
    """

    held: Flags
    slips: Indices
    first: Indices
    states: NDArray[np.uint8]


class Cascade:
    """Tables of a plan, from which the loads after any slips follow, at the plan's tensions.

    Parameters
    ----------
    prepared : PreparedStance
        All wrists are fixed, and no nail hooks.
    loads : Loads
        The plan's, before which nothing has slipped.

    Attributes
    ----------
    units : int
        T + H, the number of tiles and palms.
    used : ndarray, shape (T + H,)
        Utilisation of each tile's strength and each palm's in shear in the plan.
    fingers : FingerStates
        States of the fingers at the plan's tensions.
    """

    def __init__(self, prepared: PreparedStance, loads: Loads) -> None:
        batch = prepared.batch
        self._batch = batch
        places, T, H = batch.places, len(batch.engagement), len(batch.hands)
        self.units, F = T + H, len(places.phalanges)
        # where a unit's bit is in a state: phalanges by finger, bases after, then palms
        self._phalanx = np.full(T, -1)
        self._phalanx[places.phalanges] = np.arange(3)
        self._finger = places.finger
        self._base_of = np.full(F, -1)
        self._base_of[places.base_fingers] = places.bases
        carry = prepared.hands.transports[places.hand]
        forces = batch.axes
        wrenches = np.concatenate([forces, np.cross(batch.points[:T, None], forces)], axis=2)
        # per newton of shear, normal and lateral load of each tile, in B
        self._per_load = np.einsum("tij,tkj->tki", carry, wrenches) * WRENCH_SCALE
        self._spines = batch.engagement * (batch.touch.touches > 0.0)
        of_hand = [hand.hand.lateral_stiffness * hand.grasp.lateral for hand in batch.hands]
        self._across = np.array(of_hand)[np.arange(F) // (F // H)]
        palms = np.zeros((H, 2, 6))
        x, y, z = batch.points[T:].T
        palms[:, 0, 0], palms[:, 0, 4], palms[:, 0, 5] = -1.0, -z, y
        palms[:, 1, 2], palms[:, 1, 3], palms[:, 1, 4] = 1.0, y, -x
        carried = np.einsum("hij,hkj->hki", prepared.hands.transports, palms) * WRENCH_SCALE
        self._per_palm = carried.reshape(2 * H, 6)
        self._palm_springs = np.array(
            [
                (
                    hand.palm_shear_stiffness,
                    sum(hand.palm.engagement) * hand.hand.palm_pressing_stiffness,
                )
                for hand in batch.hands
            ]
        )
        self._palm_most = np.where(np.isfinite(batch.palm_limits), batch.palm_limits, 0.0)
        self._planes = _half_planes(prepared)
        self._rub_stiffness = BALANCE_SETTINGS.soft * batch.hands[0].hand.lateral_stiffness
        self._rubs = BALANCE_SETTINGS.rubs * max(1.0, float(np.linalg.norm(prepared.wrench[:3])))
        self._load(loads, np.zeros(T + H, dtype=bool))

    def _load(self, loads: Loads, gone: Flags) -> None:
        """Set what follows from a plan's loads, and from what has slipped before it."""
        self._loads, self._gone = loads, gone
        off = gone[: len(self._phalanx)]
        self._on = (self._batch.touch.touches > 0.0) & ~off
        self.fingers = FingerStates.of(self._batch, loads.tiles, off)
        # of the hands on the rock, in B, moments over 0.1 m
        of_tiles = np.einsum("tk,tki->i", loads.tiles, self._per_load)
        self._wrench = of_tiles + loads.palms.ravel() @ self._per_palm
        none = np.zeros((1, len(loads.palms)), bool)
        self.used = self._used(loads.tiles[None], loads.palms[None], self._on[None], none)[0]

    def replanned(self, loads: Loads, slipped: Flags) -> Cascade:
        """Return the tables of another plan of the same stance, made after slips.

        Parameters
        ----------
        loads : Loads
        slipped : ndarray of bool, shape (T + H,)
            Tiles that drag or are off, and palms that have slipped, before the plan.
        """
        other = copy(self)
        other._load(loads, slipped)
        return other

    def start(self, draws: int) -> NDArray[np.uint8]:
        """Return the states of draws in which nothing has slipped since the plan."""
        batch = self._batch
        return np.zeros((draws, 2 * len(batch.places.phalanges) + len(batch.hands)), np.uint8)

    def _missing(self, planar: Array, laterals: Array, wrenches: Array, palms: Array) -> Array:
        """Return the wrench that S states lack of the plan's, (S, 6), before the body moves.

        Shears and normal loads, (S, T, 2); each finger's lateral reaction, (S, F), and its wrench
        per newton; and the palms' loads, (S, 2 H).
        """
        of_tiles = planar.reshape(len(planar), -1) @ self._per_load[:, :2].reshape(-1, 6)
        passive = (laterals[:, None] @ wrenches)[:, 0] + palms @ self._per_palm
        return np.asarray(self._wrench - of_tiles - passive)

    def _planar(self, states: NDArray[np.uint8]) -> Array:
        """Return shear and normal load of each tile, (S, T, 2) [N]."""
        places, F = self._batch.places, len(self._batch.places.phalanges)
        codes, row = states[:, :F].astype(np.intp), np.arange(F)
        found = np.zeros((len(states), len(self._phalanx), 2))
        for k, table in enumerate((self.fingers.shears, self.fingers.normals)):
            found[:, places.phalanges, k] = table[row, codes]
        base = states[:, F : 2 * F][:, places.base_fingers] == 0
        found[:, places.bases, 0] = base * self._loads.tiles[places.bases, 0]
        return found

    def _holding(self, states: NDArray[np.uint8]) -> Flags:
        """Return which tiles hold in each state, shape (S, T)."""
        places, F = self._batch.places, len(self._batch.places.phalanges)
        held = np.zeros((len(states), len(self._phalanx)), dtype=bool)
        held[:, places.phalanges] = (STATE_DIGITS == PhalanxState.HOLDS)[states[:, :F]]
        held[:, places.bases] = states[:, F : 2 * F][:, places.base_fingers] == 0
        return held & self._on

    def _laterals(self, holding: Flags) -> tuple[Array, Array, Array]:
        """Return each finger's lateral reaction, stiffness and wrench per newton in S states."""
        first = self._batch.places.first_of_finger
        shares = holding * self._spines
        sums = np.add.reduceat(shares, first, axis=1)
        whole = np.add.reduceat(self._on * self._spines, first)
        left = sums / np.where(whole > 0.0, whole, 1.0)
        aside = shares[..., None] * self._per_load[:, 2]
        wrenches = np.add.reduceat(aside, first, axis=1)
        wrenches /= np.where(sums > 0.0, sums, 1.0)[..., None]
        return self._loads.laterals * left, self._across * sums, wrenches

    def _palms(self, gone: Flags) -> tuple[Array, Array, Array]:
        """Return the loads of palms before the body moves, their springs and bounds, (S, 2 H)."""
        kept = np.ones((len(gone), gone.shape[1], 2))
        kept[..., 0] = ~(gone | self._gone[len(self._phalanx) :])
        loads, springs = self._loads.palms * kept, self._palm_springs * kept
        # an overloaded plan may press more than palms bear
        pressed = np.maximum(self._palm_most[:, 1], self._loads.palms[:, 1])
        most = np.broadcast_to(
            np.column_stack([np.full_like(pressed, np.inf), pressed]), kept.shape
        )
        return tuple(each.reshape(len(gone), -1) for each in (loads, springs, most))  # type: ignore[return-value]

    def loads(self, states: NDArray[np.uint8]) -> StateLoads:
        """Return the loads of S states, and what they use of strengths.

        Parameters
        ----------
        states : ndarray of uint8, shape (S, 2 F + H)
        """
        batch, H = self._batch, len(self._batch.hands)
        planar = self._planar(states)
        holding = self._holding(states)
        x, springs, wrenches = self._laterals(holding)
        gone = states[:, -H:].astype(bool)
        of_palms, palm_springs, most = self._palms(gone)
        others = np.concatenate([self._per_palm, np.eye(6)])
        rubs = np.full((len(states), 6), self._rubs)
        passive, off = balanced(
            np.concatenate([wrenches, np.broadcast_to(others, (len(states), *others.shape))], 1),
            np.hstack([x, of_palms, np.zeros_like(rubs)]),
            np.hstack([springs, palm_springs, np.full_like(rubs, self._rub_stiffness)]),
            np.hstack([np.full(x.shape, -np.inf), np.zeros_like(most), -rubs]),
            np.hstack([np.full(x.shape, np.inf), most, rubs]),
            self._missing(planar, x, wrenches, of_palms),
        )
        sides, palms, _ = np.split(passive, [x.shape[1], x.shape[1] + 2 * H], axis=1)
        shares = holding * self._spines
        sums = np.add.reduceat(shares, batch.places.first_of_finger, axis=1)
        parts = shares / np.where(sums > 0.0, sums, 1.0)[:, self._finger]
        tiles = np.concatenate([planar, (parts * sides[:, self._finger])[..., None]], axis=2)
        palms = palms.reshape(-1, H, 2)
        on = np.zeros((len(states), H))
        np.add.at(on.T, batch.places.hand, holding.T)
        had = np.bincount(batch.places.hand, self._on, H) > 0
        lost = (off > BALANCE_SETTINGS.lost) | ((on == 0) & had).any(axis=1)
        return StateLoads(self._used(tiles, palms, holding, gone), tiles, palms, holding, lost)

    def _used(self, tiles: Array, palms: Array, holding: Flags, gone: Flags) -> Array:
        """Return what loads use of strengths, (S, T + H)."""
        loaded = tiles.copy()
        loaded[..., 2] = np.abs(loaded[..., 2])
        used = np.einsum("tkj,stj->stk", self._planes, loaded).max(axis=2)
        most = np.where(self._palm_most[:, 0] > 0.0, self._palm_most[:, 0], np.inf)
        sheared = np.where(gone | self._gone[len(self._phalanx) :], 0.0, palms[..., 0] / most)
        return np.concatenate([np.maximum(used * holding, 0.0), sheared], axis=1)

    def slipped(self, states: NDArray[np.uint8], unit: Indices) -> NDArray[np.uint8]:
        """Return the states after one tile or palm of each has slipped, and the fingers rest.

        Parameters
        ----------
        states : ndarray of uint8, shape (S, 2 F + H)
        unit : ndarray of int, shape (S,)
            Tile, or palm after the tiles.
        """
        T, F = len(self._phalanx), len(self._batch.places.phalanges)
        after, row = states.copy(), np.arange(len(states))
        palm = unit >= T
        after[row[palm], 2 * F + unit[palm] - T] = 1
        rows, tile = row[~palm], unit[~palm]
        finger, phalanx = self._finger[tile], self._phalanx[tile]
        base = phalanx < 0
        after[rows[base], F + finger[base]] = 1
        on, of, which = rows[~base], finger[~base], phalanx[~base]
        code = self.fingers.slips[of, after[on, of], which]
        after[on, of] = code
        after[on, F + of] |= self.fingers.base_lifts[of, code] & (self._base_of[of] >= 0)
        return after

    def gone(self, states: NDArray[np.uint8]) -> Flags:
        """Return which tiles on the rock and palms have slipped, since or before the plan."""
        H = len(self._batch.hands)
        lost = (self._batch.touch.touches > 0.0) & ~self._holding(states)
        return np.concatenate([lost, states[:, -H:].astype(bool) | self._gone[-H:]], axis=1)

    def run(
        self, strengths: Array, start: NDArray[np.uint8] | None = None, most: int | None = None
    ) -> CascadeOutcome:
        """Let the weakest tile of each draw slip, one after the other, until all rest.

        Parameters
        ----------
        strengths : ndarray, shape (n, T + H)
            Strength of each tile and palm over that of its surface.
        start : ndarray of uint8, shape (n, 2 F + H), optional
            States to begin with; nothing has slipped by default.
        most : int, optional
            Largest number of slips.
        """
        n = len(strengths)
        states = self.start(n) if start is None else start.copy()
        held, slips, first = np.ones(n, bool), np.zeros(n, np.intp), np.full(n, -1)
        going = np.arange(n)
        while len(going):
            unique, of = _unique(states[going])
            there = self.loads(unique)
            over = there.used[of] / strengths[going]
            unit = over.argmax(axis=1)
            fallen = there.lost[of]
            held[going[fallen]] = False
            slip = ~fallen & (over[np.arange(len(going)), unit] > 1.0)
            if most is not None:
                slip &= slips[going] < most
            going, unit = going[slip], unit[slip]
            first[going] = np.where(slips[going] == 0, unit, first[going])
            slips[going] += 1
            states[going] = self.slipped(states[going], unit)
        return CascadeOutcome(held, slips, first, states)


def _unique(states: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], Indices]:
    """Return the different states, and for each state its index among them."""
    whole = np.ascontiguousarray(states).view(np.dtype((np.void, states.shape[1])))[:, 0]
    _, first, of = np.unique(whole, return_index=True, return_inverse=True)
    return states[first], of


def _half_planes(prepared: PreparedStance) -> Array:
    """Return the utilisations of each tile's half-planes per newton of its loads, (T, k, 3)."""
    hands = prepared.batch.hands
    pieces = [inner_half_planes(hand.surface) for hand in hands]
    found = np.zeros((len(prepared.batch.engagement), max(map(len, pieces)), 3))
    for own, hand, first in zip(pieces, hands, prepared.batch.places.first.tolist(), strict=True):
        shares = np.where(hand.limit_shares > 0.0, hand.limit_shares, np.inf)[:, None, None]
        rows = np.array([[p.a_shear, p.a_normal, p.a_lateral] for p in own])
        capacity = np.array([p.capacity for p in own])[:, None]
        found[first : first + len(hand.tiles), : len(own)] = rows / capacity / shares
        # one that has fewer than others repeats its last
        found[first : first + len(hand.tiles), len(own) :] = (rows / capacity / shares)[:, -1:]
    return found


def unit_names(prepared: PreparedStance) -> Sequence[tuple[str, str | None, str]]:
    """Return limb, finger and phalanx of each tile, then of each palm, whose finger is None."""
    named = [
        (limb, tile.finger, tile.phalanx)
        for limb, hand in zip(prepared.limbs, prepared.batch.hands, strict=True)
        for tile in hand.tiles
    ]
    return [*named, *((limb, None, "palm") for limb in prepared.limbs)]
