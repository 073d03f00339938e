"""What the check of a plan says of numbers that are off, each in a sentence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import HandBatch
from planner.result import PlanArrays

__all__ = ["DRIVES", "Recomputed"]

DRIVES: Final = ("motor torque", "motor current", "winch angle")
"""Rows of `PlanArrays.drives`."""


class Recomputed(NamedTuple):
    """What the plan's tensions, or where its wrists go, do to the hands; and the plan's numbers.

    Attributes
    ----------
    limbs : tuple of str
    known : HandBatch
    arrays : PlanArrays
        The plan's numbers.
    shear, normal : ndarray, shape (T,)
        Of each tile [N]; of nails zero.
    left : ndarray, shape (F, 3)
        What is left of each joint's balance [N·m].
    stops : ndarray, shape (k,)
        Torque on each joint's stop [N·m].
    stop_fingers : ndarray of int, shape (k,)
        Whose they are.
    curves : ndarray, shape (T,)
        By how much each tile is beyond its limit curve [N].
    forces, wrenches : ndarray, shapes (T, 3), (H, 6)
        By how much each tile's force is not that of its loads, and each hand's wrench not the sum
        of forces.
    held, by_rows : ndarray, shape (H,)
        What each hand holds, and what its rows say of that [N].
    drives : ndarray, shape (3, F)
        Torque and current of each motor, angle of each winch.
    tiles, palms, hands : ndarray, shapes (T,), (H,), (H,)
        Utilisations.
    """

    limbs: tuple[str, ...]
    known: HandBatch
    arrays: PlanArrays
    shear: Array
    normal: Array
    left: Array
    stops: Array
    stop_fingers: Indices
    curves: Array
    forces: Array
    wrenches: Array
    held: Array
    by_rows: Array
    drives: Array
    tiles: Array
    palms: Array
    hands: Array

    # Numbers ------------------------------------------------------------------------------------

    @property
    def used(self) -> Array:
        """Drives and utilisations, one kind after another, shape (3 F + T + 2 H,)."""
        return np.concatenate((self.drives.ravel(), self.tiles, self.palms, self.hands))

    @property
    def told(self) -> Array:
        """What the plan says of them."""
        arrays = self.arrays
        used = (
            arrays.tile_utilisations,
            arrays.palm_utilisations,
            arrays.utilisations,
        )
        return np.concatenate((arrays.drives.ravel(), *used))

    @property
    def off(self) -> Array:
        """By how much loads are off, as of `loads_off` [N]."""
        arrays, touch = self.arrays, self.known.touch
        f, palm = arrays.tensions, arrays.palms
        apart = np.abs(arrays.loads[:, :2].T - (self.shear, self.normal))
        apart[:, self.known.places.nails] = 0.0
        return np.concatenate(
            (
                # NaN, and so off, where a tension is infinite
                0.5 * (np.abs(f) - f),
                apart.ravel(),
                -self.shear,
                -self.normal * touch.framed,
                np.abs(self.forces).ravel(),
                self.curves,
                palm[:, 0],
                -palm[:, 2],
                np.abs(self.wrenches).ravel(),
                self.held - self.by_rows,
            )
        )

    # Names --------------------------------------------------------------------------------------

    def tile(self, t: int) -> str:
        """Return the name of a tile: ``front_left: proximal tile of inner_right``."""
        places = self.known.places
        h = int(places.hand[t])
        tile = self.known.hands[h].tiles[t - int(places.first[h])]
        what = NAIL if tile.phalanx == NAIL else f"{tile.phalanx} tile"
        return f"{self.limbs[h]}: {what} of {tile.finger}"

    def of_finger(self, kind: str, finger: int) -> str:
        """Return the name of something of a finger: ``front_left: tendon of inner_right``."""
        h, i = divmod(finger, len(FINGERS))
        return f"{self.limbs[h]}: {kind} of {FINGERS[i]}"

    # Sentences ----------------------------------------------------------------------------------

    def tension(self, i: int) -> str:
        return f"{self.of_finger('tension', i)} is {self.arrays.tensions[i]:g} N"

    def load(self, t: int) -> str:
        shear, normal = self.shear[t], self.normal[t]
        return f"{self.tile(t)} carries {shear:.6g}, {normal:.6g} N, not what the plan says"

    def backwards(self, t: int) -> str:
        return f"{self.tile(t)} would be dragged backwards with {-self.shear[t]:.3g} N"

    def pulled_off(self, t: int) -> str:
        return f"{self.tile(t)}: its bare frame would be pulled off with {-self.normal[t]:.3g} N"

    def force(self, i: int) -> str:
        return f"{self.tile(i // 3)}: force and loads disagree"

    def curve(self, t: int) -> str:
        return f"{self.tile(t)} is beyond its limit curve"

    def palm(self, h: int) -> str:
        force = self.arrays.palms[h].tolist()
        return f"{self.limbs[h]}: the palm cannot exert {force} N"

    def wrench(self, i: int) -> str:
        return f"{self.limbs[i // 6]}: the wrench is not the sum of its tiles' and palm's forces"

    def holds(self, h: int) -> str:
        return f"{self.limbs[h]}: the hand holds {self.held[h]:.6g} N, more than its rows say"

    def slack(self, finger: int) -> str:
        hand = self.known.hands[finger // len(FINGERS)]
        slack = hand.closing_tension - self.arrays.tensions[finger]
        return f"{self.of_finger('tendon', finger)} would stick, slackened {slack:.3g} N"

    def stop(self, i: int) -> str:
        return f"{self.of_finger('a joint', int(self.stop_fingers[i]))} would leave its stop"

    def use(self, i: int, used: float, told: float) -> str:
        """Say what a drive or a utilisation is, by its index in ``used``."""
        value, said = f"{used:.8g}", f"{told:.8g}"
        tiles, fingers, hands = self.known.places.shape
        if i < len(DRIVES) * fingers:
            kind, finger = divmod(i, fingers)
            return f"{self.of_finger(DRIVES[kind], finger)} is {value}, not {said}"
        i -= len(DRIVES) * fingers
        if i < tiles:
            name = self.tile(i)
        else:
            h = (i - tiles) % hands
            name = f"{self.limbs[h]}: palm" if i - tiles < hands else self.limbs[h]
        return f"{name}: utilisation is {value}, not {said}"

    def idle(self) -> Iterator[str]:
        """Yield what carries a load that cannot."""
        arrays = self.arrays
        for t in self.known.touch.idle.tolist():
            if arrays.forces[t].any():
                yield f"{self.tile(t)} carries a load but touches nothing"
        for h, hand in enumerate(self.known.hands):
            if arrays.palms[h, 1] != 0.0:
                yield self.palm(h)
            if not hand.palm.engaged and arrays.palms[h].any():
                yield f"{self.limbs[h]}: the palm carries a load but touches nothing"

    def contacts_told(self, h: int) -> Iterator[str]:
        """Yield what the plan says of the contacts of a hand that is not so."""
        hand, arrays = self.known.hands[h], self.arrays
        first = int(self.known.places.first[h])
        for t, (tile, said) in enumerate(zip(hand.tiles, arrays.tiles[h], strict=True)):
            if tile != said:
                name = self.tile(first + t)
                if said.contact == "none" and arrays.forces[first + t].any():
                    yield f"{name} carries a load but touches nothing"
                yield f"{name} touches with {tile.contact}; the plan has {' '.join(said)}"
        own = slice(first, first + len(hand.tiles))
        shares = zip(hand.engagement.tolist(), arrays.engagement[own].tolist(), strict=True)
        for t, (share, told_share) in enumerate(shares, first):
            if share != told_share:
                yield f"{self.tile(t)}: {share:.6g} of its spines hold, not {told_share:.6g}"
        true, told = list(hand.palm.engaged), list(arrays.engaged[h])
        if true != told:
            if not told and arrays.palms[h].any():
                yield f"{self.limbs[h]}: the palm carries a load but touches nothing"
            yield f"{self.limbs[h]}: the palm touches with tiles {true}, not {told}"

    def loads_off(self, which: Indices, ends: Indices) -> Iterator[str]:
        """Yield what is off of loads, by index.

        One kind after another: tensions, shears, normals, drags backwards and pulls on bare frames
        of tiles; components of their forces; their limit curves; shear and pressing of palms;
        components of wrenches; what hands hold.

        Parameters
        ----------
        which : ndarray of int
        ends : ndarray of int
            Where each kind ends.
        """
        words: tuple[Callable[[int], str], ...] = (
            self.tension,
            self.load,
            self.load,
            self.backwards,
            self.pulled_off,
            self.force,
            self.curve,
            self.palm,
            self.palm,
            self.wrench,
            self.holds,
        )
        for i in which.tolist():
            kind = int(np.searchsorted(ends, i, side="right"))
            yield words[kind](i - (int(ends[kind - 1]) if kind else 0))
