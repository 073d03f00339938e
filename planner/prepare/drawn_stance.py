"""The hands of a stance with the parameters of a Monte Carlo sample, closed on their holds."""

from __future__ import annotations

from collections.abc import Sequence

from hand_models.base import InvalidInputError
from hand_models.hand import Placement, PlacementKey, SettledHand, settle_hands
from hand_models.tile import Surface
from planner.prepare.prepared_stance import PreparedStance
from planner.question import DrawnHand

__all__ = ["settled_as_drawn", "with_drawn_hands"]


def settled_as_drawn(
    prepared: PreparedStance, drawn: DrawnHand
) -> list[SettledHand | InvalidInputError]:
    """Return the hands closed as those of a sample; errors in place of those that cannot be.

    A hand with a seat is closed at the seat of the sample's hand: H stays where it is, and the rock
    is elsewhere. A hand whose best seat was searched for keeps that seat.

    Parameters
    ----------
    prepared : PreparedStance
    drawn : DrawnHand
        Hand model and surfaces of the sample.
    """
    placements, surfaces, keys = {}, dict[Surface, Surface](), list[PlacementKey]()
    for hand, usual in zip(prepared.question.stance.hands, prepared.batch.hands, strict=True):
        seat, at = hand.placed_hold(), hand.at
        if hand.seat == "best":
            seat, at = usual.seating.pose, None
        if hand.surface not in surfaces:
            surfaces[hand.surface] = drawn.surface(hand.surface)
        placement = Placement(hand.hold, surfaces[hand.surface], hand.grasp, seat, at)
        keys.append(PlacementKey(placement))
        placements[keys[-1]] = placement
    # hands that close alike close once
    outcomes = settle_hands(drawn.model, list(placements.values()))
    found = dict(zip(placements, outcomes, strict=True))
    pairs = [(limb, found[key]) for limb, key in zip(prepared.limbs, keys, strict=True)]
    return [
        drawn.closed(each, limb) if isinstance(each, SettledHand) else each for limb, each in pairs
    ]


def with_drawn_hands(
    prepared: PreparedStance, outcomes: Sequence[SettledHand | InvalidInputError]
) -> PreparedStance | None:
    """Return the stance with a sample's hands; None if one is not there or loses its preload.

    Parameters
    ----------
    prepared : PreparedStance
    outcomes : sequence of SettledHand or InvalidInputError
        From `settled_as_drawn`.
    """
    settled = [hand for hand in outcomes if isinstance(hand, SettledHand)]
    if len(settled) < len(outcomes):
        return None
    try:
        return prepared.with_hands(settled)
    except InvalidInputError:
        return None
