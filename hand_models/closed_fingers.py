"""All fingers of some hands closed on the rock.

Fingers over smooth rock are laid on it (`hand_models.laying`) and loaded by their tendons
(`hand_models.laid_loads`) one by one, of those that are alike one. Fingers that do not rest on all
their phalanges, or whose contacts would break, are left to `hand_models.contact_states`, as are
fingers over other rock.
"""

from __future__ import annotations

import cmath
from collections.abc import Hashable, Sequence
from typing import Final

import numpy as np

from hand_models.contact_states import ClosedFinger, Closing, cling, close_all
from hand_models.errors import InvalidInputError
from hand_models.finger import PHALANGES
from hand_models.frames import Array
from hand_models.laid_loads import stays
from hand_models.laying import KINDS, Laid
from hand_models.placed_hands import PlacedHands
from hand_models.postures import FREE, STOPS
from hand_models.settled_hand import FINGERS, HandPostures
from hand_models.settling import intrusion

__all__ = ["ClosedFingers", "close_fingers"]

Row = list[float]
"""All numbers of a closed finger, one after the other; see `ClosedFingers`."""

ENDS: Final = np.cumsum([3, 6, 3, 3, 3, 12, 18]).tolist()
"""Where each kind of numbers ends in a row."""

NOWHERE: Final = [0.0] * ENDS[-1]
"""In place of a finger of a hand that cannot be where it is."""


class ClosedFingers:
    """The fingers of n hands, closed; attributes hand by hand, finger by finger.

    Parameters
    ----------
    rows : sequence of list of float, length 4 n
    alone : dict of int to ClosedFinger
        Fingers that could not be left as they were laid.

    Attributes
    ----------
    angles, joints, alongs, kinds, stops : ndarray, shapes (n, 4, 3)
        As of `HandPostures`.
    loads : ndarray, shape (n, 4, 3, 2, 2)
        Shear and normal load of each phalanx, at zero tension [N] and per newton.
    places : ndarray, shape (n, 4, 9, 2)
        In each finger's plane: contacts [m], then axes of shear, then of normal load.
    """

    def __init__(self, rows: Sequence[Row], alone: dict[int, ClosedFinger]) -> None:
        self.alone = alone
        alike = {id(row): row for row in rows}
        index = {each: i for i, each in enumerate(alike)}
        table = np.array(list(alike.values())).take([index[id(row)] for row in rows], axis=0)
        a, b, c, _, e, f, g = ENDS
        shape = len(rows) // len(FINGERS), len(FINGERS), len(PHALANGES)
        self.angles = table[:, :a].reshape(shape)
        self.joints = table[:, a:b].copy().view(complex).reshape(shape)
        self.alongs = table[:, b:c].reshape(shape)
        codes = table[:, c:e].astype(np.int8)
        self.kinds, self.stops = (codes[:, i : i + 3].reshape(shape) for i in (0, 3))
        self.loads = table[:, e:f].reshape(*shape, 2, 2)
        self.places = table[:, f:g].reshape(*shape[:2], 3 * len(PHALANGES), 2)

    def of_hands(self) -> list[HandPostures]:
        """Return how the fingers of each hand stand; arrays are read-only."""
        numbers = self.angles, self.joints, self.alongs, self.kinds, self.stops
        for each in numbers:
            each.setflags(write=False)
        return [HandPostures(*hand) for hand in zip(*numbers, strict=True)]

    def stops_of(self, index: int) -> tuple[tuple[int, int, Array], ...]:
        """Return finger, joint and torque of each joint of a hand that stands at a limit."""
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


def close_fingers(
    placed: PlacedHands,
    laid: Sequence[list[Laid]],
    tensions: Sequence[float],
    errors: dict[int, InvalidInputError],
) -> ClosedFingers:
    """Close the fingers of hands on their holds.

    Parameters
    ----------
    placed : PlacedHands
    laid : sequence of list of Laid, length 4 n
        Phalanges of their fingers that rest on smooth rock, one after the other; equal ones for
        fingers that are alike.
    tensions : sequence of float, length n
        Closing tension of each hand [N].
    errors : dict of int to InvalidInputError
        Why hands cannot be where they are; those that cannot close are added.
    """
    hand, height = placed.hand, placed.hand.finger.tile_height
    rows = [NOWHERE] * len(laid)
    known: dict[Hashable, Row] = {}
    left: list[int] = []
    for i, (placement, tension) in enumerate(zip(placed.placements, tensions, strict=True)):
        if i in errors:
            continue
        surface, clings = placement.surface, placement.grasp.fingernail
        for k in range(len(FINGERS) * i, len(FINGERS) * (i + 1)):
            phalanges, base_tile = laid[k], hand.rubbing[k % len(FINGERS)]
            row = None
            if len(phalanges) == len(PHALANGES) and not clings:
                key = id(phalanges), tension, base_tile, id(surface)
                row = known.get(key)
                if row is None:
                    loads = hand.tendon_loads.loads(phalanges, tension, base_tile)
                    if loads is not None and stays(phalanges, loads, surface, tension):
                        row = known[key] = _row(phalanges, height, *loads)
            if row is None:
                left.append(k)
            else:
                rows[k] = row
    alone: dict[int, ClosedFinger] = {}
    for k, finger in zip(left, _alone(placed, left, tensions), strict=True):
        i = k // len(FINGERS)
        if finger is not None:
            alone[k], rows[k] = finger, _row_alone(finger)
        elif i not in errors:
            errors[i] = _no_way(placed, i, k % len(FINGERS))
    return ClosedFingers(rows, alone)


def _alone(
    placed: PlacedHands, left: Sequence[int], tensions: Sequence[float]
) -> list[ClosedFinger | None]:
    """Close fingers that could not be left as laid, those that are alike once."""
    hand = placed.hand
    keys: list[Hashable] = []
    closings: dict[Hashable, Closing] = {}
    closed: dict[Hashable, ClosedFinger | None] = {}
    for k in left:
        i, finger = divmod(k, len(FINGERS))
        placement, cut = placed.placements[i], placed.cut_key(i, finger)
        if placement.grasp.fingernail:
            keys.append(k)
            closed[k] = cling(hand.finger, placed.section(i, finger))
            continue
        given = placement.surface, tensions[i], hand.rubbing[finger]
        key = (k if cut is None else cut, *given)
        keys.append(key)
        if key not in closings:
            closings[key] = Closing(placed.section(i, finger), *given)
    if closings:
        found = close_all(hand.finger, list(closings.values()))
        closed.update(zip(closings, found, strict=True))
    return [closed[key] for key in keys]


def _no_way(placed: PlacedHands, index: int, finger: int) -> InvalidInputError:
    """Return why a finger cannot close."""
    straight = placed.placements[index].grasp.fingernail
    section = placed.section(index, finger)
    assert section is not None
    depth = 1e3 * intrusion(placed.hand.finger, section, straight=straight)
    how = "straight, to cling with its nail" if straight else "even with its joints fully open"
    return InvalidInputError(
        f"the hold stands {depth:.1f} mm inside {FINGERS[finger]} {how}; "
        "move the hand away from the rock",
        field="hold",
    )


def _row(
    phalanges: Sequence[Laid],
    height: float,
    shears: Sequence[Sequence[float]],
    normals: Sequence[Sequence[float]],
    stops: Sequence[int] = (FREE,) * len(PHALANGES),
) -> Row:
    """Return the numbers of a finger; ``height`` of its tiles above the phalanges [m]."""
    angles, directions, joints, alongs, kinds = zip(*phalanges, strict=True)
    row = [*angles]
    for q in joints:
        row += q.real, q.imag
    row += alongs
    row += kinds
    row += stops
    for shear, normal in zip(shears, normals, strict=True):
        row += shear
        row += normal
    for q, c, u in zip(joints, alongs, directions, strict=True):
        place = q + complex(c, height) * u
        row += place.real, place.imag
    for u in directions:
        row += -u.real, -u.imag
    for u in directions:
        row += -u.imag, u.real
    return row


def _row_alone(closed: ClosedFinger) -> Row:
    """Return the numbers of a finger that was closed on its own."""
    contacts, model = closed.finger.contacts, closed.finger.model
    phalanges = [
        Laid(c.angle, cmath.rect(1.0, c.angle), complex(*c.joint), c.along, KINDS.index(c.kind))
        for c in contacts
    ]
    stops = [STOPS.index(c.stop) for c in contacts]
    loads = closed.shears.tolist(), closed.normals.tolist()
    return _row(phalanges, model.tile_height, *loads, stops)
