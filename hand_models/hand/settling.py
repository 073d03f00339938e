"""Many hands closed on their holds at once: seated, with their palms and their fingers on the rock.

What is alike for all hands is worked out for all together, on arrays: where they are in the axes of
their holds, the places and axes of their tiles. How each finger rests is found one by one
(`hand_models.hand.closed_fingers`), for those that are mirror images once.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from hand_models.base import InvalidInputError, go_on
from hand_models.finger import BALANCE, NONE, PHALANGES, ClosedPhalanx
from hand_models.hand.closed_fingers import ClosedFingers, close_fingers
from hand_models.hand.finger_frames import BASES
from hand_models.hand.hooked_nails import Nails, hook_nails
from hand_models.hand.model import HandModel
from hand_models.hand.names import FINGERS
from hand_models.hand.placement import PlacedHands, Placement
from hand_models.hand.seating import (
    CENTRED,
    RockUnder,
    Seating,
    propose,
    seating_given,
    touches_seat,
)
from hand_models.hand.settled_hand import HandPostures, SettledHand
from hand_models.hand.tightening import resting_tensions
from hand_models.hand.tiles_on_rock import hand_tiles, palms_on_rock, tiles_on_rock
from hand_models.sections import FingerPlane, cut_of

__all__ = ["seated", "settle_hands"]

CLEAR: Final = 1e-6
"""By how much a hand that backs off is clear of rock [m]."""

SEATED: Final = FINGERS.index("inner_left")
"""The finger whose proximal contact seats a hand."""


def settle_hands(
    hand: HandModel, placements: Sequence[Placement]
) -> list[SettledHand | InvalidInputError]:
    """Close hands on their holds.

    Parameters
    ----------
    hand : HandModel
        Which all of them are.
    placements : sequence of Placement

    Returns
    -------
    list of SettledHand or InvalidInputError
        In order; an error in place of a hand that cannot be where it is, see `SpinyHand.settle`.
    """
    tensions = [each.grasp.closing_tension or hand.closing_tension for each in placements]
    placed, laid = _seated(hand, placements)
    outcomes, lifts = _close(placed, laid, tensions)
    # those without a place back off rock that stands in their open fingers
    backing = [
        i
        for i, lift in lifts.items()
        if placements[i].hold_in_hand is None and lift < hand.back_off
    ]
    if backing:
        seatings = [placed.seatings[i].off(lifts[i] + CLEAR) for i in backing]
        off = PlacedHands(hand, [placements[i] for i in backing], seatings)
        again, _ = _close(off, _laid(off, range(len(backing))), [tensions[i] for i in backing])
        for i, outcome in zip(backing, again, strict=True):
            if isinstance(outcome, SettledHand):
                outcomes[i] = outcome
    return outcomes


def seated(hand: HandModel, placements: Sequence[Placement]) -> Sequence[Seating]:
    """Return where hands are at their holds, seated where these have no place."""
    return _seated(hand, placements)[0].seatings


@np.errstate(divide="ignore", invalid="ignore")
def _close(
    placed: PlacedHands, laid: list[list[list[ClosedPhalanx]]], tensions: list[float]
) -> tuple[list[SettledHand | InvalidInputError], dict[int, float]]:
    """Return hands closed where they are placed, and the lifts of those with rock in fingers."""
    hand, placements = placed.hand, placed.placements
    errors: dict[int, InvalidInputError] = {}
    for i, (tension, gaps) in enumerate(zip(tensions, placed.gaps, strict=True)):
        if tension > hand.maximum_tension:
            errors[i] = InvalidInputError(
                f"must be at most the tendon's {hand.maximum_tension:g} N, got {tension:g}",
                field="grasp.closing_tension",
            )
        elif min(gaps[BASES:]) < -hand.spine_travel:
            errors[i] = _in_palm(hand, min(gaps[BASES:]))
    closed = close_fingers(placed, laid, tensions, errors)
    for i, error in _too_slack(placed, closed, tensions):
        errors.setdefault(i, error)
    tiles = tiles_on_rock(placed, closed, tensions)
    nails: dict[int, Nails] = {}
    for i, tension in enumerate(tensions):
        if i not in errors:
            try:
                nails[i] = hook_nails(placed, closed, i, tension)
            except InvalidInputError as error:
                errors[i] = error
    palms = palms_on_rock(placed)
    outcomes: list[SettledHand | InvalidInputError] = []
    for i, (each, of_tiles, *posture) in enumerate(
        zip(placements, hand_tiles(tiles, nails), *closed.postures, strict=True)
    ):
        if i in errors:
            outcomes.append(errors[i])
            continue
        settled = SettledHand(
            hand=hand,
            hold=each.hold,
            grasp=each.grasp,
            surface=each.surface,
            closing_tension=tensions[i],
            seating=placed.seatings[i],
            postures=HandPostures(*posture),
            **of_tiles._asdict(),
            nail_angles=nails[i].angles,
            nail_normals=nails[i].normals,
            nail_rows=nails[i].rows,
            stops=closed.stops_of(i),
            palm=palms[i],
        )
        outcomes.append(settled)
    return outcomes, closed.lifts


def _in_palm(hand: HandModel, depth: float) -> InvalidInputError:
    # along z of the hand, which may be nearly along the rock
    far = -depth > hand.finger.reach
    stands = "deep" if far else f"{-1e3 * depth:.1f} mm"
    return InvalidInputError(
        f"the hold stands {stands} inside the palm; at most {1e3 * hand.spine_travel:g} mm "
        "(the spines' travel) is possible: move the hand away from the rock along its -z",
        field="hold",
    )


def _too_slack(
    placed: PlacedHands,
    closed: ClosedFingers,
    tensions: Sequence[float],
) -> Iterator[tuple[int, InvalidInputError]]:
    """Yield hands whose tendons do not close their fingers, and why."""
    hand, placements = placed.hand, placed.placements
    angles, stops, kinds = closed.postures.angles, closed.postures.stops, closed.postures.kinds
    idle = (kinds == NONE).all(axis=(1, 2)) & (stops == BALANCE).any(axis=(1, 2))
    for i in idle.nonzero()[0].tolist():
        if not placements[i].grasp.fingernail:
            yield (
                i,
                InvalidInputError(
                    f"must be larger: at {tensions[i]:g} N no finger comes to the rock",
                    field="grasp.closing_tension",
                ),
            )
    # fingers that are laid on the rock without asking for the path to it
    closes = (kinds != NONE).all(axis=2)
    closes.reshape(-1)[list(closed.alone)] = False
    turns = np.diff(angles, axis=2, prepend=0.0)
    needed = np.where(closes[..., None], resting_tensions(hand.finger, turns, hand.losses), 0.0)
    short = needed.reshape(len(needed), -1).max(axis=1) > tensions
    for i in short.nonzero()[0].tolist():
        finger, joint = divmod(int(needed[i].argmax()), len(PHALANGES))
        # no less than is needed, in hundredths
        least = math.ceil(100.0 * needed[i, finger, joint]) / 100.0
        yield (
            i,
            InvalidInputError(
                f"must be at least {least:g} N, at which the {PHALANGES[joint]} joint of "
                f"{FINGERS[finger]} has closed on this hold, "
                f"got {tensions[i]:g}",
                field="grasp.closing_tension",
            ),
        )


def _seated(
    hand: HandModel, placements: Sequence[Placement]
) -> tuple[PlacedHands, list[list[list[ClosedPhalanx]]]]:
    """Return hands at their holds, seated where these have no place, and their fingers laid."""
    seatings: list[Seating] = []
    meant = []
    under: dict[Hashable, RockUnder] = {}
    for i, each in enumerate(placements):
        if each.hold_in_hand is not None:
            seatings.append(seating_given(each.hold_in_hand))
            continue
        go_on()
        seating, on_contact = propose(hand, each.hold, each.grasp, each.at, under)
        seatings.append(seating)
        if on_contact:
            meant.append(i)
    placed = PlacedHands(hand, placements, seatings)
    laid = _laid(placed, range(len(placements)))
    # where a finger's proximal contact is not where the seat meant it to be
    off = [i for i in meant if not (on := laid[i][SEATED]) or not touches_seat(hand, on[0].along)]
    if off:
        for i in off:
            seatings[i] = CENTRED
        placed = PlacedHands(hand, placements, seatings)
        for i, fingers in zip(off, _laid(placed, off), strict=True):
            laid[i] = fingers
    return placed, laid


def _laid(placed: PlacedHands, which: Iterable[int]) -> list[list[list[ClosedPhalanx]]]:
    """Return the phalanges of the fingers of some hands that rest on smooth rock.

    Of a hand's fingers that are alike the same ones.
    """
    laid: list[list[list[ClosedPhalanx]]] = []
    for i in which:
        cuts = placed.cuts(i)
        if cuts is None:
            laid.append([[] for _ in FINGERS])
            continue
        shape, planes = cuts
        found: dict[FingerPlane, list[ClosedPhalanx]] = {}
        for plane in planes:
            if plane not in found:
                cut = cut_of(shape, plane)
                found[plane] = [] if cut is None else placed.hand.sequential_closure.lay(cut)
        laid.append([found[plane] for plane in planes])
    return laid
