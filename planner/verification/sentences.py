"""What a plan's numbers are held against, kind by kind, and what is said of those that are off."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

import numpy as np

from hand_models.base import Array, Indices
from hand_models.hand import FINGERS, NAIL
from planner.prepare import HandBatch
from planner.result import PlanArrays
from planner.verification.joint_balance import LEVER
from planner.verification.nails import NailLoads

__all__ = [
    "COUNT",
    "LOAD",
    "NEAR",
    "PALM_SIGNS",
    "SIGNED",
    "STOP",
    "STOPS",
    "UTILISATION",
    "Recomputed",
]

LOAD: Final = 1e-6
"""Largest disagreement of a tile's load, relative to the largest load of its hand."""

UTILISATION: Final = 1e-6
"""How far a utilisation may be from what the plan says."""

DRIVE: Final = 1e-9
"""How far a motor's torque, current or winch angle may be from what the plan says, relative."""

STOP: Final = 1e-6
"""How much torque a joint's stop may seem to pull, by rounding [N·m]."""

NEAR: Final = LOAD * LEVER
"""Error of balances [N, N·m], drives and utilisations below which nothing can be off."""

DRIVES: Final = ("motor torque", "motor current", "winch angle")
"""Rows of `PlanArrays.drives`."""

COUNT: Final = len(FINGERS)

PALM_SIGNS: Final = np.array([-1.0, 1.0])
"""Which way a palm shears and presses along x and z."""


EQUAL: Final = (
    ("load", "tiles"),
    ("load", "tiles"),
    ("force", "tiles"),
    ("wrench", "hands"),
    ("unbalanced", "nails"),
)
"""What says what is wrong with each kind of `Recomputed.zero`, and whose numbers they are."""

SIGNED: Final = (
    ("tension", "fingers"),
    ("backwards", "tiles"),
    ("pulled_off", "tiles"),
    ("palm", "hands"),
    ("slack", "drawing"),
    ("closes", "nails"),
    ("drags", "nails"),
    ("stop", "stops"),
)
"""The same of `Recomputed.signed`."""

STOPS: Final = len(SIGNED) - 1
"""Of these, the one that may be off by `STOP`, whatever the loads."""

BOUNDED: Final = (("curve", "tiles"), ("holds", "hands"), ("slips", "nails"))
"""The same of `Recomputed.bounded`."""


class Recomputed(NamedTuple):
    """What the plan's tensions, or where its wrists go, do to the hands; and the plan's numbers.

    Attributes
    ----------
    limbs : tuple of str
    known : HandBatch
    arrays : PlanArrays
        The plan's numbers.
    floats : bool
        Whether a wrist does.
    shear, normal : ndarray, shape (T,)
        Of each tile [N]; of nails zero.
    allowances : ndarray, shape (T,)
        By how much tiles with few spines on the rock may be dragged backwards [N].
    left : ndarray, shape (F, 3)
        What is left of each free joint's balance [N·m].
    stops : ndarray, shape (k,)
        Torque on each joint's stop [N·m].
    stop_fingers : ndarray of int, shape (k,)
        Whose they are.
    drawing : ndarray of int
        Fingers whose tendon draws a tile or a nail along rock, and friction would hold it.
    slackened : ndarray
        Tensions of these, less the closing tension [N].
    nails : NailLoads
        Of those that hook.
    curves : ndarray, shape (T,)
        By how much each tile is beyond its limit curve [N].
    forces : ndarray, shape (T, 3)
        By how much each tile's force is not that of its loads [N].
    wrenches : ndarray, shape (H, 6)
        The sums of the forces of each hand's tiles and palm.
    held, by_rows : ndarray, shape (H,)
        What each hand holds, and what its rows say of that [N].
    along : ndarray, shape (H, 17)
        The rows: what it holds along `HELD`.
    drives : ndarray, shape (3, F)
        Torque and current of each motor, angle of each winch.
    tiles, palms, hands : ndarray, shapes (T,), (H,), (H,)
        Utilisations.
    shares : tuple of ndarray, shapes (F, 5), (T, 2 p), (H, 2)
        What these are the largest of: of tendons, motors and fingers; of half-planes, if all spines
        held; of palms.
    """

    limbs: tuple[str, ...]
    known: HandBatch
    arrays: PlanArrays
    floats: bool
    shear: Array
    normal: Array
    allowances: Array
    left: Array
    stops: Array
    stop_fingers: Indices
    drawing: Indices
    slackened: Array
    nails: NailLoads
    curves: Array
    forces: Array
    wrenches: Array
    held: Array
    by_rows: Array
    along: Array
    drives: Array
    tiles: Array
    palms: Array
    hands: Array
    shares: tuple[Array, Array, Array]

    # Kinds --------------------------------------------------------------------------------------

    def zero(self) -> tuple[Array, ...]:
        """Return what must be zero: what the plan says of loads, less what they are."""
        arrays, nails = self.arrays, self.known.places.nails
        shear, normal = arrays.loads[:, 0] - self.shear, arrays.loads[:, 1] - self.normal
        if len(nails):
            shear[nails] = normal[nails] = 0.0
        wrenches = self.wrenches - arrays.wrenches
        return shear, normal, self.forces, wrenches, self.nails.turning

    def signed(self) -> tuple[Array, ...]:
        """Return what may not be below zero, and is affine in the loads."""
        bases = self.known.places.bases
        pressed = self.normal.copy()
        pressed[bases] = self.known.engagement[bases] * self.normal[bases + 1]
        return (
            self.arrays.tensions,
            self.shear + self.known.friction * pressed + self.allowances,
            self.normal * self.known.touch.framed,
            self.arrays.palms[:, ::2] * PALM_SIGNS,
            self.slackened,
            self.nails.opening,
            self.nails.grips,
            self.stops,
        )

    def bounded(self) -> tuple[Array, ...]:
        """Return what may not be below zero, and is not affine in the loads."""
        return -self.curves, self.by_rows - self.held, self.nails.within

    def claims(self) -> tuple[tuple[Array, Array, float, Callable[[int], str]], ...]:
        """Return drives and utilisations, what the plan says of them, errors, and their names."""
        told = self.arrays
        return (
            (self.drives, told.drives, DRIVE, self.drive),
            (self.tiles, told.tile_utilisations, UTILISATION, self.tile),
            (self.palms, told.palm_utilisations, UTILISATION, self.of_palm),
            (self.hands, told.utilisations, UTILISATION, self.limbs.__getitem__),
        )

    def owners(self) -> dict[str, Indices]:
        """Return whose hand each number is."""
        places, each = self.known.places, np.arange(len(self.limbs))
        return {
            "tiles": places.hand,
            "hands": each,
            "fingers": each.repeat(COUNT),
            "drawing": self.drawing // COUNT,
            "nails": self.nails.fingers // COUNT,
            "stops": self.stop_fingers // COUNT,
        }

    # Verdicts -----------------------------------------------------------------------------------

    @property
    def error(self) -> float:
        """The Euclidean norm of all that is zero; none of it exceeds that. Of fixed hands."""
        bases = self.normal.take(self.known.places.bases)
        claims = [used - told for used, told, _, _ in self.claims()]
        off = np.concatenate((self.left, bases, *self.zero(), *claims), axis=None)
        return math.sqrt(off.dot(off))

    def near(self) -> bool:
        """Whether all numbers of fixed hands are so near that none can be off by what it may.

        Numbers that are not finite are not near.
        """
        if self.floats or not self.error <= NEAR:
            return False
        signed = np.concatenate((*self.signed(), *self.bounded()), axis=None)
        return bool(np.minimum.reduce(signed) >= -NEAR) and not any(self.contacts())

    def off(self, allowed: Array) -> Iterator[str]:
        """Yield what is off by more than it may be.

        Parameters
        ----------
        allowed : ndarray, shape (H,)
            Error that loads of each hand may have [N].
        """
        owners, equal = self.owners(), [-np.abs(values) for values in self.zero()]
        kinds = zip(
            (*equal, *self.signed(), *self.bounded()), EQUAL + SIGNED + BOUNDED, strict=True
        )
        for values, (say, whose) in kinds:
            most = STOP if whose == "stops" else allowed.take(owners[whose])
            # numbers that are not finite are off, too
            wrong = ~((values.T + most).T >= 0.0) | np.isinf(values)
            yield from map(getattr(self, say), np.flatnonzero(wrong).tolist())
        for used, told, relative, name in self.claims():
            right = np.abs(used - told) <= relative * np.maximum(np.abs(used), 1.0)
            what = "" if used is self.drives else ": utilisation"
            for i in np.flatnonzero(~right).tolist():
                yield f"{name(i)}{what} is {used.flat[i]:.8g}, not {told.flat[i]:.8g}"
        yield from self.contacts()

    # Names --------------------------------------------------------------------------------------

    def tile(self, t: int) -> str:
        """Return the name of a tile: ``front_left: proximal tile of inner_right``."""
        places = self.known.places
        h = int(places.hand[t])
        tile = self.known.hands[h].tiles[t - int(places.first[h])]
        what = NAIL if tile.phalanx == NAIL else f"{tile.phalanx} tile"
        return f"{self.limbs[h]}: {what} of {tile.finger}"

    def contact(self, i: int) -> str:
        """Return the name of a tile, or after them all of a palm."""
        palm = i - len(self.known.places.hand)
        return self.tile(i) if palm < 0 else self.of_palm(palm)

    def of_finger(self, kind: str, finger: int) -> str:
        """Return the name of something of a finger: ``front_left: tendon of inner_right``."""
        h, i = divmod(finger, COUNT)
        return f"{self.limbs[h]}: {kind} of {FINGERS[i]}"

    def nail(self, k: int) -> str:
        return self.of_finger(NAIL, int(self.nails.fingers[k]))

    def drive(self, i: int) -> str:
        kind, finger = divmod(i, COUNT * len(self.limbs))
        return self.of_finger(DRIVES[kind], finger)

    def of_palm(self, h: int) -> str:
        return f"{self.limbs[h]}: palm"

    # Sentences ----------------------------------------------------------------------------------

    def tension(self, i: int) -> str:
        return f"{self.of_finger('tension', i)} is {self.arrays.tensions[i]:g} N"

    def load(self, t: int) -> str:
        shear, normal = self.shear[t], self.normal[t]
        return f"{self.tile(t)} carries {shear:.6g}, {normal:.6g} N, not what the plan says"

    def backwards(self, t: int) -> str:
        shear, normal = self.shear[t], self.normal[t]
        if normal < 0.0:
            return f"{self.tile(t)} is pulled off with {-normal:.3g} N at a drag of {shear:.3g} N"
        return f"{self.tile(t)} would be dragged backwards with {-shear:.3g} N"

    def pulled_off(self, t: int) -> str:
        return f"{self.tile(t)}: its bare frame would be pulled off with {-self.normal[t]:.3g} N"

    def force(self, i: int) -> str:
        return f"{self.tile(i // 3)}: force and loads disagree"

    def curve(self, t: int) -> str:
        return f"{self.tile(t)} is beyond its limit curve"

    def palm(self, i: int) -> str:
        force = self.arrays.palms[i // 2].tolist()
        return f"{self.limbs[i // 2]}: the palm cannot exert {force} N"

    def wrench(self, i: int) -> str:
        return f"{self.limbs[i // 6]}: the wrench is not the sum of its tiles' and palm's forces"

    def holds(self, h: int) -> str:
        return f"{self.limbs[h]}: the hand holds {self.held[h]:.6g} N, more than its rows say"

    def slack(self, i: int) -> str:
        tendon = self.of_finger("tendon", int(self.drawing[i]))
        return f"{tendon} would stick, slackened {-self.slackened[i]:.3g} N"

    def stop(self, i: int) -> str:
        return f"{self.of_finger('a joint', int(self.stop_fingers[i]))} would leave its stop"

    def closes(self, i: int) -> str:
        k, joint = divmod(i, len(self.nails.far))
        closing = -self.nails.opening[k, joint] * self.nails.far[joint]
        return f"{self.nail(k)} lets joint {joint + 1} of its finger close, by {closing:.3g} N·m"

    def unbalanced(self, k: int) -> str:
        turning = self.nails.turning[k] * self.nails.reach[k]
        return f"{self.nail(k)} is out of balance by {turning:.3g} N·m"

    def drags(self, i: int) -> str:
        return self.slips(i // 3)

    def slips(self, k: int) -> str:
        dragged, pressed = self.nails.dragged[k], self.nails.pressed[k]
        name = self.nail(k)
        return f"{name} would slip: {dragged:.3g} N along rock pressed with {pressed:.3g} N"

    def contacts(self) -> Iterator[str]:
        """Yield what carries a load that cannot, and contacts that are not as the plan says."""
        known, arrays, palms = self.known, self.arrays, self.arrays.palms
        for own, told in ((known.points, arrays.points), (known.axes, arrays.axes)):
            if not (told is own or np.array_equal(told, own)):
                hands = np.concatenate((known.places.hand, np.arange(len(palms))))
                elsewhere = (told != own).reshape(len(own), -1).any(axis=1)
                for i in np.flatnonzero(elsewhere).tolist():
                    if arrays.wrists[hands[i]] is None:
                        yield f"{self.contact(i)} is elsewhere, or turned"
        for t in known.touch.idle.tolist():
            if arrays.forces[t].any():
                yield f"{self.tile(t)} carries a load but touches nothing"
        for h in np.flatnonzero(palms[:, 1]).tolist():
            yield self.palm(2 * h)
        shares, said = known.engagement, arrays.engagement
        if said is not shares:
            for t in np.flatnonzero(said != shares).tolist():
                yield f"{self.tile(t)}: {shares[t]:.6g} of its spines hold, not {said[t]:.6g}"
        for h, hand in enumerate(known.hands):
            engaged, told_engaged = hand.palm.engaged, arrays.engaged[h]
            if not (engaged and told_engaged) and palms[h].any():
                yield f"{self.limbs[h]}: the palm carries a load but touches nothing"
            if engaged != told_engaged:
                touching = f"{list(engaged)}, not {list(told_engaged)}"
                yield f"{self.limbs[h]}: the palm touches with tiles {touching}"
            if hand.tiles != arrays.tiles[h]:
                yield from self.tiles_told(h)

    def tiles_told(self, h: int) -> Iterator[str]:
        """Yield what the plan says of the contacts of a hand's tiles that is not so."""
        first, tiles = int(self.known.places.first[h]), self.known.hands[h].tiles
        for t, (tile, said) in enumerate(zip(tiles, self.arrays.tiles[h], strict=True), first):
            if tile != said:
                if said.contact == "none" and self.arrays.forces[t].any():
                    yield f"{self.tile(t)} carries a load but touches nothing"
                yield f"{self.tile(t)} touches with {tile.contact}; the plan has {' '.join(said)}"
