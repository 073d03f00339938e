"""Close many hands on their holds together: seat them, then place their palms and fingers on rock.

The parts that all hands have in common are computed on arrays: their poses at their holds, and the
places and axes of their tiles. Each finger's closing is found on its own
(`hand_models.hand.closed_fingers`), mirror images once.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Iterator, Sequence

import numpy as np

from hand_models.base import InvalidInputError, RefusedPlaceError, go_on
from hand_models.finger import CONTACT_KINDS, JOINT_STOPS, PHALANGES, ClosedPhalanx
from hand_models.hand.closed_fingers import ClosedFingers, close_fingers
from hand_models.hand.finger_frames import STACK_ROWS
from hand_models.hand.hooked_nails import Nails, hook_nails
from hand_models.hand.model import HandModel
from hand_models.hand.names import FINGERS
from hand_models.hand.placement import PlacedHands, Placement
from hand_models.hand.seating import (
    CENTRED_SEATING,
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


def settle_hands(
    hand: HandModel, placements: Sequence[Placement]
) -> list[SettledHand | InvalidInputError]:
    """Close hands of one model on their holds.

    Parameters
    ----------
    hand : HandModel
        Model of all the hands.
    placements : sequence of Placement

    Returns
    -------
    list of SettledHand or InvalidInputError
        In the order of ``placements``; for a hand that cannot close, the error that
        `SpinyHand.settle` would raise.
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
        clear = 1e-6  # [m] of the rock, of a hand that backs off
        seatings = [placed.seatings[i].off(lifts[i] + clear) for i in backing]
        off = PlacedHands(hand, [placements[i] for i in backing], seatings)
        again, _ = _close(off, _laid(off, range(len(backing))), [tensions[i] for i in backing])
        for i, outcome in zip(backing, again, strict=True):
            if isinstance(outcome, SettledHand):
                outcomes[i] = outcome
    return outcomes


def seated(hand: HandModel, placements: Sequence[Placement]) -> Sequence[Seating]:
    """Return the seating of each hand: the pose of its hold in H, as given, or else found.

    Parameters
    ----------
    hand : HandModel
    placements : sequence of Placement

    Returns
    -------
    sequence of Seating
        In the order of ``placements``.
    """
    return _seated(hand, placements)[0].seatings


@np.errstate(divide="ignore", invalid="ignore")
def _close(
    placed: PlacedHands, laid: list[list[list[ClosedPhalanx]]], tensions: list[float]
) -> tuple[list[SettledHand | InvalidInputError], dict[int, float]]:
    """Return hands closed where they are placed, and the lifts of those with rock in fingers."""
    hand, placements = placed.hand, placed.placements
    errors: dict[int, InvalidInputError] = {}
    of_bases, of_palms = np.hsplit(placed.gaps(), [STACK_ROWS.base_count])
    nearest = of_palms.min(axis=1).tolist()
    for i, (tension, gap) in enumerate(zip(tensions, nearest, strict=True)):
        if tension > hand.maximum_tension:
            errors[i] = InvalidInputError(
                f"must be at most tendon.maximum_tension, {hand.maximum_tension:g} N, got "
                f"{tension:g} N",
                field="grasp.closing_tension",
            )
        elif gap < -hand.spine_travel:
            errors[i] = _in_palm(hand, gap)
    closed = close_fingers(placed, laid, tensions, errors)
    for i, error in _too_slack(placed, laid, closed, tensions):
        errors.setdefault(i, error)
    tiles = tiles_on_rock(placed, of_bases, closed, tensions)
    nails: dict[int, Nails] = {}
    for i, tension in enumerate(tensions):
        if i not in errors:
            try:
                nails[i] = hook_nails(placed, closed, i, tension)
            except InvalidInputError as error:
                errors[i] = error
    palms = palms_on_rock(placed, of_palms)
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
    return RefusedPlaceError(
        f"the hold stands {stands} inside the palm; at most {1e3 * hand.spine_travel:g} mm "
        "(the spines' travel) is possible: move the hand away from the rock along its -z",
        reason="palm_in_rock",
        field="hold",
    )


def _too_slack(
    placed: PlacedHands,
    laid: Sequence[Sequence[list[ClosedPhalanx]]],
    closed: ClosedFingers,
    tensions: Sequence[float],
) -> Iterator[tuple[int, InvalidInputError]]:
    """Yield hands whose tendons do not close their fingers, and why."""
    hand, placements = placed.hand, placed.placements
    stops, kinds = closed.postures.stops, closed.postures.kinds
    # fingers that are laid on the rock, or would be, without asking for the path to it
    none = CONTACT_KINDS.index("none")
    angles, closes = closed.postures.angles.copy(), (kinds != none).all(axis=2)
    for k in closed.alone:
        i, finger = divmod(k, len(FINGERS))
        phalanges = laid[i][finger]
        closes[i, finger] = len(phalanges) == len(PHALANGES) and not placements[i].grasp.fingernail
        if closes[i, finger]:
            angles[i, finger] = [each.angle for each in phalanges]
    turns = angles.copy()
    turns[..., 1:] -= angles[..., :-1]
    needed = np.where(closes[..., None], resting_tensions(hand.finger, turns, hand.losses), 0.0)
    short = (needed.reshape(len(needed), -1).max(axis=1) > tensions).nonzero()[0].tolist()
    for i in short:
        finger, joint = divmod(int(needed[i].argmax()), len(PHALANGES))
        # no less than is needed, in hundredths
        least = math.ceil(100.0 * needed[i, finger, joint]) / 100.0
        yield (
            i,
            RefusedPlaceError(
                f"must be at least {least:g} N, at which the {PHALANGES[joint]} joint of "
                f"{FINGERS[finger]} has closed on this hold, "
                f"got {tensions[i]:g} N",
                reason="tendon_slack",
                field="grasp.closing_tension",
            ),
        )
    balance = JOINT_STOPS.index("balance")
    idle = (kinds == none).all(axis=(1, 2)) & (stops == balance).any(axis=(1, 2))
    slack = [
        i
        for i in idle.nonzero()[0].tolist()
        if i not in short and not placements[i].grasp.fingernail
    ]
    for i in _closed_by_more(placed, laid, slack, tensions):
        yield (
            i,
            RefusedPlaceError(
                f"must be larger: at {tensions[i]:g} N no finger touches the rock",
                reason="tendon_slack",
                field="grasp.closing_tension",
            ),
        )


def _closed_by_more(
    placed: PlacedHands,
    laid: Sequence[Sequence[list[ClosedPhalanx]]],
    slack: Sequence[int],
    tensions: Sequence[float],
) -> list[int]:
    """Return which of some hands in the air have a finger that more tension brings to the rock.

    Their paths are followed to the tension that closes all joints to their limits in the air, on
    which fingers may come to the rock and pass it: those that have passed it come to no other.
    """
    hand = placed.hand
    limits = resting_tensions(hand.finger, np.array(hand.finger.joint_upper), hand.losses)
    most = min(float(limits.max()), hand.maximum_tension)
    slack = [i for i in slack if tensions[i] < most]
    if not slack:
        return []
    which = [placed.placements[i] for i in slack]
    again = PlacedHands(hand, which, [placed.seatings[i] for i in slack])
    refused: dict[int, InvalidInputError] = {}
    closed = close_fingers(again, [laid[i] for i in slack], [most] * len(slack), refused)
    near = (closed.postures.kinds != CONTACT_KINDS.index("none")).any(axis=(1, 2))
    near[[*refused]] = True
    for finger, each in closed.alone.items():
        k = finger // len(FINGERS)
        near[k] |= np.greater(each.touches, tensions[slack[k]]).any()
    return [i for i, comes in zip(slack, near.tolist(), strict=True) if comes]


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
    inner = FINGERS.index("inner_left")
    off = [i for i in meant if not (on := laid[i][inner]) or not touches_seat(hand, on[0].along)]
    if off:
        for i in off:
            seatings[i] = CENTRED_SEATING
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
        found: dict[FingerPlane | None, list[ClosedPhalanx]] = {}
        for plane in cuts.planes:
            if plane not in found:
                cut = None if plane is None else cut_of(cuts.shape, plane)
                found[plane] = [] if cut is None else placed.hand.sequential_closure.lay(cut)
        laid.append([found[plane] for plane in cuts.planes])
    return laid
