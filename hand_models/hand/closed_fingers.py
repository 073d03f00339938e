"""Close all fingers of several hands on the rock.

Fingers over smooth rock are laid on it (`hand_models.finger.sequential_closure`) and loaded by
their tendons (`hand_models.finger.closure_loads`), identical fingers once. Fingers that do not rest
on all their phalanges, or whose contacts would break, are closed along their paths
(`hand_models.finger.closing`), as are fingers over other rock.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from importlib import import_module
from typing import Final

import numpy as np

from hand_models.base import Array, InvalidInputError, RefusedPlaceError, go_on, has_compiled
from hand_models.finger import (
    CONTACT_KINDS,
    JOINT_STOPS,
    PHALANGES,
    ClosedFinger,
    ClosedPhalanx,
    OpenFinger,
    Refused,
    cling,
    close_all,
    lay_across,
    stays,
    tendon_loads,
)
from hand_models.hand.model import HandModel
from hand_models.hand.names import FINGERS
from hand_models.hand.placement import PlacedHands, Placement
from hand_models.hand.settled_hand import HandPostures
from hand_models.rock import load_compiled

__all__ = ["ClosedFingers", "close_fingers", "closing_is_compiled", "load_closing"]

FingerNumbers = list[float]
"""Numbers of a closed finger, phalanx by phalanx: three times the `PHALANX_NUMBERS`."""

CLOSING_MODULE: Final = "hand_models.finger.closing"
PHALANX_NUMBERS: Final = 24
"""Numbers of a phalanx: its angle [rad], its contact's place along and above it [m] and tilt [rad],
its joint [m]; its shear and normal load, each at zero tension [N] and per newton; the share of its
tile's spines that are on the rock; the codes of its contact and its joint's stop; and in the
finger's plane, each in homogeneous coordinates, its contact and its axes of shear and of normal
load; how far its contact is from that plane, along the finger's y [m]; and the share of what
balances its joint that it bears."""


class ClosedFingers:
    """Closed fingers of n hands, four for each hand, as arrays.

    Parameters
    ----------
    rows : sequence of list of float
        Numbers of each distinct finger, three phalanges of `PHALANX_NUMBERS` each.
    row_of : sequence of int, length 4 n
        Index into ``rows`` of each finger, hand by hand.
    alone : dict of int to ClosedFinger
        Fingers that were closed along their paths, by their index in ``row_of``.
    lifts : dict of int to float
        For each hand with rock inside an open finger, by its index: distance along −z of the hand
        frame H by which the hand would have to back off [m].

    Attributes
    ----------
    places : ndarray, shape (n, 4, 9, 3)
        For each phalanx its contact [m], axis of shear and axis of normal load, in homogeneous
        coordinates of the finger's plane: (x, z, 1) for places, (x, z, 0) for directions.
    tiles : ndarray, shape (n, 4, 3, 6)
        For each phalanx shear and normal load, each at zero tension [N] and per newton, the share
        of its tile's spines on the rock, and its contact state by code.
    postures : HandPostures
        Postures and contacts of all fingers, arrays of shape (n, 4, 3).
    """

    def __init__(
        self,
        rows: Sequence[FingerNumbers],
        row_of: Sequence[int],
        alone: dict[int, ClosedFinger],
        lifts: dict[int, float],
    ) -> None:
        self.alone, self.lifts = alone, lifts
        count = len(FINGERS)
        shape = len(row_of) // count, count, len(PHALANGES), PHALANX_NUMBERS
        table = np.array(rows).take(row_of, axis=0).reshape(shape)
        codes = table[..., 11:13].astype(np.int8)  # of the `PHALANX_NUMBERS`
        for array in (table, codes):
            array.setflags(write=False)
        self.places = table[..., 13:22].reshape(-1, count, 3 * len(PHALANGES), 3)
        # the loads, the share and the code of the contact
        self.tiles = table[..., 6:12]
        angle, along, rise, tilt = (table[..., i] for i in range(4))
        joint, share = table[..., 4:6].view(complex)[..., 0], table[..., 10]
        self.postures = HandPostures(
            *(angle, joint, along, rise, tilt, share, codes[..., 0], codes[..., 1]),
            *(table[..., 22], table[..., 23]),
        )

    def stops_of(self, index: int) -> tuple[tuple[int, int, Array], ...]:
        """Return finger, joint and torque of each joint of a hand that is at an angle limit.

        Parameters
        ----------
        index : int
            Index of the hand.

        Returns
        -------
        tuple of (int, int, ndarray)
            Index of the finger, index of the joint, and the torque on the stop, positive against
            it: at zero tension [N·m] and per newton [m]. Fingers without a contact are left out.
        """
        if not self.alone:
            return ()
        stops = []
        for finger in range(len(FINGERS)):
            alone = self.alone.get(len(FINGERS) * index + finger)
            if alone is None or not alone.finger.bearing:
                continue
            for joint, contact in enumerate(alone.finger.contacts):
                if contact.stop in ("upper", "lower"):
                    torque = alone.torques[joint] * (1.0 if contact.stop == "upper" else -1.0)
                    torque.setflags(write=False)
                    stops.append((finger, joint, torque))
        return tuple(stops)


def load_closing() -> None:
    """Import what numba compiles to cut rock and to close fingers, so that no hand waits for it."""
    load_compiled()
    import_module(CLOSING_MODULE)


def closing_is_compiled() -> bool:
    """Return whether `load_closing` finds compiled code; it takes minutes if it must compile it."""
    return has_compiled(CLOSING_MODULE)


def close_fingers(
    placed: PlacedHands,
    laid: Sequence[Sequence[list[ClosedPhalanx]]],
    tensions: Sequence[float],
    errors: dict[int, InvalidInputError],
) -> ClosedFingers:
    """Close the fingers of n hands on their holds.

    Parameters
    ----------
    placed : PlacedHands
    laid : sequence of sequence of list of ClosedPhalanx, lengths n and 4
        For each finger its phalanges that rest on smooth rock (`SequentialClosure.lay`); the same
        list for identical fingers.
    tensions : sequence of float, length n
        Closing tension of each hand [N].
    errors : dict of int to InvalidInputError
        Errors by index of the hand, changed in place: hands that have one are skipped, hands that
        cannot close are added.
    """
    # the first stands for a finger of a hand that cannot be where it is
    rows = [[0.0] * (len(PHALANGES) * PHALANX_NUMBERS)]
    hand, row_of = placed.hand, [0] * (len(FINGERS) * len(laid))
    left: list[int] = []
    for i, (placement, tension) in enumerate(zip(placed.placements, tensions, strict=True)):
        if i in errors:
            continue
        known: dict[Hashable, int] = {}
        cuts = placed.cuts(i)
        alike = [False] * len(FINGERS) if cuts is None else cuts.alike
        for k, (phalanges, base_tile, same) in enumerate(
            zip(laid[i], hand.rubbing, alike, strict=True), len(FINGERS) * i
        ):
            if not same:
                left.append(k)
                continue
            key = tuple(phalanges), base_tile
            if key not in known:
                row = _row_laid(hand, placement, phalanges, tension, base_tile)
                if row is None:
                    left.append(k)
                    continue
                known[key] = len(rows)
                rows.append(row)
            row_of[k] = known[key]
    alone: dict[int, ClosedFinger] = {}
    lifts: dict[int, float] = {}
    found = zip(left, _alone(placed, left, tensions), strict=True)
    # a hand with rock in a finger is refused for that, as its other fingers are not closed
    for k, finger in sorted(found, key=lambda each: not _in_rock(each[1])):
        i = k // len(FINGERS)
        if isinstance(finger, ClosedFinger):
            row_of[k] = len(rows)
            rows.append(_row_alone(finger))
            if not finger.laid:
                alone[k] = finger
            continue
        if _in_rock(finger):
            lifts[i] = max(finger.lift, lifts.get(i, 0.0))
        if i not in errors:
            errors[i] = _no_way(placed, i, k % len(FINGERS), finger)
    return ClosedFingers(rows, row_of, alone, lifts)


def _in_rock(finger: ClosedFinger | Refused) -> bool:
    return isinstance(finger, Refused) and finger.depth > 0.0


def _row_laid(
    hand: HandModel,
    placement: Placement,
    laid: list[ClosedPhalanx],
    tension: float,
    base_tile: bool,
) -> FingerNumbers | None:
    """Return the numbers of a finger that can be left as it is laid."""
    if len(laid) < len(PHALANGES) or placement.grasp.fingernail:
        return None
    depths = hand.depths[base_tile]
    laid = [
        each.pressed(hand.sequential_closure.tile, depth * tension)
        for each, depth in zip(laid, depths, strict=True)
    ]
    loads = tendon_loads(hand.finger, laid, tension, base_tile)
    if loads is None or not stays(loads, placement.surface, tension):
        return None
    return _row(laid, hand.finger.tile_height, *loads)


def _alone(
    placed: PlacedHands, left: Sequence[int], tensions: Sequence[float]
) -> list[ClosedFinger | Refused]:
    """Close fingers that could not be left as laid, those that are alike once."""
    hand = placed.hand
    keys: list[tuple[Hashable, float]] = []
    closings: dict[tuple[Hashable, ...], OpenFinger] = {}
    sides: dict[Hashable, float] = {}
    closed: dict[Hashable, ClosedFinger | Refused] = {}
    for k in left:
        go_on()
        i, finger = divmod(k, len(FINGERS))
        placement, cuts = placed.placements[i], placed.cuts(i)
        if placement.grasp.fingernail:
            keys.append((k, 1.0))
            closed[k] = cling(hand.finger, placed.section(i, finger))
            continue
        given = placement.surface, tensions[i], hand.rubbing[finger]
        key = (k if cuts is None else (cuts.shape, cuts.keys[finger]), *given)
        side = 1.0 if cuts is None else cuts.sides[finger]
        if key not in sides:
            sides[key], opened = side, OpenFinger(placed.rock(i, finger), *given)
            laid = None
            if cuts is not None and not cuts.alike[finger]:
                laid = lay_across(hand.finger, hand.sequential_closure, opened)
            if laid is None:
                closings[key] = opened
            else:
                closed[key] = laid
        keys.append((key, side * sides[key]))
    if closings:
        # what is alike is of several hands, and is by itself
        hands = [key[0] // len(FINGERS) if isinstance(key[0], int) else key for key in closings]
        found = close_all(hand.finger, list(closings.values()), hands)
        closed.update(zip(closings, found, strict=True))
    mirrored = {
        key: each.mirrored() if isinstance(each, ClosedFinger) else each
        for key, each in closed.items()
        if (key, -1.0) in keys
    }
    return [closed[key] if side > 0.0 else mirrored[key] for key, side in keys]


def _no_way(placed: PlacedHands, index: int, finger: int, refused: Refused) -> InvalidInputError:
    """Return why a finger cannot close."""
    name = FINGERS[finger]
    if not _in_rock(refused):
        return RefusedPlaceError(
            f"no equilibrium found for {name} on this rock: move or rotate the hand slightly",
            reason="no_equilibrium",
            field="hold",
        )
    how = "even with its joints fully open"
    if placed.placements[index].grasp.fingernail:
        how = "straight, to cling with its nail"
    lift = "move the hand away from the rock"
    if math.isfinite(refused.lift):
        lift = f"lifted by {1e3 * refused.lift:.1f} mm along -z of the hand it would be clear"
    return RefusedPlaceError(
        f"the hold stands {1e3 * refused.depth:.1f} mm inside {name} {how}; {lift}",
        reason="finger_in_rock",
        field="hold",
    )


def _row(
    phalanges: Sequence[ClosedPhalanx], height: float, shears: list[complex], normals: list[complex]
) -> FingerNumbers:
    """Return the numbers of a finger that is laid; ``height`` of its tiles [m]."""
    row: FingerNumbers = []
    laid = CONTACT_KINDS.index("face"), JOINT_STOPS.index(None)
    for (angle, u, joint, along, _), t, n in zip(phalanges, shears, normals, strict=True):
        place = joint + complex(along, height) * u
        # the tile of a phalanx that is laid is on the rock with all its spines
        row += (angle, along, 0.0, 0.0, joint.real, joint.imag)
        row += (t.real, t.imag, n.real, n.imag, 1.0, *laid)
        row += (place.real, place.imag, 1.0, -u.real, -u.imag, 0.0, -u.imag, u.real, 0.0, 0.0, 1.0)
    return row


def _row_alone(closed: ClosedFinger) -> FingerNumbers:
    """Return the numbers of a finger that was closed on its own."""
    finger = closed.finger
    row: FingerNumbers = []
    for contact, place, (x, z), shear, normal, share in zip(
        finger.contacts,
        finger.points.tolist(),
        finger.directions.tolist(),
        closed.shears.tolist(),
        closed.normals.tolist(),
        finger.engagement.tolist(),
        strict=True,
    ):
        row += (contact.angle, contact.along, contact.rise, contact.tilt, *contact.joint)
        kind, stop = CONTACT_KINDS.index(contact.kind), JOINT_STOPS.index(contact.stop)
        row += (*shear, *normal, share, kind, stop)
        row += (*place, 1.0, -x, -z, 0.0, -z, x, 0.0, contact.across, contact.bearing_share)
    return row
