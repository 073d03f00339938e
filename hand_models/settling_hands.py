"""Many hands closed on their holds at once: seated, with their palms and their fingers on the rock.

What is alike for all hands is worked out for all together, on arrays: where they are in the axes of
their holds, the gaps under their palms, the places and axes of their tiles. How each finger rests
is found one by one (`hand_models.closed_fingers`), for those that are mirror images once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from hand_models.closed_fingers import close_fingers
from hand_models.errors import InvalidInputError
from hand_models.finger_frames import BASES
from hand_models.frames import Array
from hand_models.hooked_nails import hook_nails
from hand_models.laying import KINDS, Laid
from hand_models.palm import shear_capacity
from hand_models.placed_hands import CutKey, PlacedHands, Placement
from hand_models.seating import CENTRED, Seating, propose, seat, touches_seat
from hand_models.settled_hand import FINGERS, Palm, SettledHand
from hand_models.swept_cuts import cut_of
from hand_models.tiles_on_rock import hand_tiles, parts_on_rock

if TYPE_CHECKING:
    from hand_models.hand import SpinyHand

__all__ = ["settle_hands"]

NO_CENTRE: Final = np.zeros(3)
"""Of a palm that is not on rock."""

NO_CENTRE.setflags(write=False)

SEATED: Final = FINGERS.index("inner_left")
"""The finger whose proximal contact seats a hand."""


def settle_hands(
    hand: SpinyHand, placements: Sequence[Placement]
) -> list[SettledHand | InvalidInputError]:
    """Close hands on their holds.

    Parameters
    ----------
    hand : SpinyHand
        Which all of them are.
    placements : sequence of Placement

    Returns
    -------
    list of SettledHand or InvalidInputError
        In order; an error in place of a hand that cannot be where it is, see `SpinyHand.settle`.
    """
    given = [each.grasp.closing_tension for each in placements]
    tensions = [hand.closing_tension if tension is None else tension for tension in given]
    outcomes: dict[int, SettledHand | InvalidInputError] = {
        i: InvalidInputError(
            f"must be at most the tendon's {hand.maximum_tension:g} N, got {tension:g}",
            field="grasp.closing_tension",
        )
        for i, tension in enumerate(tensions)
        if tension > hand.maximum_tension
    }
    closable = [i for i in range(len(placements)) if i not in outcomes]
    if closable:
        with np.errstate(divide="ignore", invalid="ignore"):
            settled = _settle(
                hand, [placements[i] for i in closable], [tensions[i] for i in closable]
            )
        outcomes.update(zip(closable, settled, strict=True))
    return [outcomes[i] for i in range(len(placements))]


def _settle(
    hand: SpinyHand, placements: Sequence[Placement], tensions: list[float]
) -> list[SettledHand | InvalidInputError]:
    placed, laid = _placed(hand, placements)
    gaps = placed.gaps[:, BASES:]
    gaps.setflags(write=False)
    errors = {
        i: _in_palm(hand, depth)
        for i, depth in enumerate(gaps.min(axis=1).tolist())
        if depth < -hand.spine_travel
    }
    closed = close_fingers(placed, laid, tensions, errors)
    parts = parts_on_rock(placed, closed, tensions)
    clinging = [each.grasp.fingernail for each in placements]
    nails = [hand.no_nails] * len(placements)
    for i, clings in enumerate(clinging):
        if clings and i not in errors:
            try:
                nails[i] = hook_nails(placed, closed, parts, i, tensions[i])
            except InvalidInputError as error:
                errors[i] = error
    outcomes: list[SettledHand | InvalidInputError] = []
    for i, (each, tiles, posture) in enumerate(
        zip(placements, hand_tiles(parts, clinging), closed.of_hands(), strict=True)
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
            postures=posture,
            tiles=tiles.tiles,
            finger_of=tiles.finger_of,
            positions=tiles.positions,
            axes=tiles.axes,
            loads=tiles.loads,
            nail_angles=nails[i].angles,
            nail_normals=nails[i].normals,
            nail_rows=nails[i].rows,
            stops=closed.stops_of(i),
            palm=_palm(hand, each, gaps[i]),
        )
        outcomes.append(settled)
    return outcomes


def _in_palm(hand: SpinyHand, depth: float) -> InvalidInputError:
    return InvalidInputError(
        f"the hold stands {-1e3 * depth:.1f} mm inside the palm; "
        f"at most {1e3 * hand.spine_travel:g} mm (the spines' travel) is possible",
        field="hold",
    )


def _placed(
    hand: SpinyHand, placements: Sequence[Placement]
) -> tuple[PlacedHands, list[list[Laid]]]:
    """Return hands at their holds, seated where these have no place, and their fingers laid."""
    seatings, meant = [], []
    for i, each in enumerate(placements):
        if each.hold_in_hand is not None:
            seatings.append(Seating(each.hold_in_hand, "given"))
            continue
        seating, on_contact = propose(hand, each.hold, each.grasp)
        if on_contact and each.hold.swept is None:
            seating, on_contact = seat(hand, each.hold, each.grasp), False
        seatings.append(seating)
        if on_contact:
            meant.append(i)
    known: dict[CutKey, list[Laid]] = {}
    placed = PlacedHands(hand, placements, seatings)
    laid = _laid(placed, known)
    off = [i for i in meant if not _on_seat(hand, laid[len(FINGERS) * i + SEATED])]
    if off:
        for i in off:
            seatings[i] = CENTRED
        placed = PlacedHands(hand, placements, seatings)
        laid = _laid(placed, known)
    return placed, laid


def _laid(placed: PlacedHands, known: dict[CutKey, list[Laid]]) -> list[list[Laid]]:
    """Return the phalanges of fingers that rest on smooth rock, those known already and others."""
    laid: list[list[Laid]] = []
    for i in range(len(placed.placements)):
        for finger in range(len(FINGERS)):
            key = placed.cut_key(i, finger)
            if key is None:
                laid.append([])
                continue
            phalanges = known.get(key)
            if phalanges is None:
                cut = cut_of(*key)
                phalanges = known[key] = [] if cut is None else placed.hand.layer.lay(cut)
            laid.append(phalanges)
    return laid


def _on_seat(hand: SpinyHand, laid: list[Laid]) -> bool:
    """Whether a finger's proximal contact is where a seat meant it to be."""
    return bool(laid) and touches_seat(hand, KINDS[laid[0].kind], laid[0].along)


def _palm(hand: SpinyHand, placement: Placement, gaps: Array) -> Palm:
    """Return the palm of one hand on its rock."""
    near = [gap if gap <= hand.spine_travel else None for gap in gaps.tolist()]
    engaged = tuple([i for i, gap in enumerate(near) if gap is not None])
    if not (engaged and placement.grasp.palm):
        return Palm(gaps, (), NO_CENTRE, 0.0, 0.0)
    tiles, count = hand.palm_tiles.tolist(), len(engaged)
    centre = np.array(
        [
            sum([tiles[i][0] for i in engaged]) / count,
            sum([tiles[i][1] for i in engaged]) / count,
            sum([gap for gap in near if gap is not None]) / count,
        ]
    )
    centre.setflags(write=False)
    shear_limit = shear_capacity(
        tuple([hand.palm_contact[i] for i in engaged]),
        hand.palm_spring,
        hand.palm_friction,
        placement.surface.shear_limit,
        hand.palm_own_friction,
    )
    return Palm(gaps, engaged, centre, shear_limit, hand.palm_pressing * count)
