"""The hands of a stance on their holds, and what each can carry at rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from hand_models.base import InvalidInputError, UnsupportedError
from hand_models.compliance import FloatingWrist, PalmMode
from hand_models.fixed_wrist import PULL_OFF, best_seats, wrench_space
from hand_models.hand import Placement, SettledHand, SpinyHand
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare.hand_sets import widest_at_rest, wrist_at
from planner.question import HandOnHold, Stance

__all__ = [
    "RestingHand",
    "floating_wrist",
    "hand_space",
    "resting_hand",
    "settle_each",
    "settle_hand",
    "settle_stance",
]


def settle_hand(hand: HandOnHold, stance: Stance) -> SettledHand:
    """Close one hand of a stance on its hold."""
    (settled,) = settle_each(stance.robot.hand, [hand])
    if isinstance(settled, InvalidInputError):
        raise settled
    return settled


def settle_stance(stance: Stance, which: Sequence[int] | None = None) -> list[SettledHand]:
    """Close the hands of a stance on their holds, at once; of all by default, or of these indices.

    Raises
    ------
    InvalidInputError
        If a hand cannot be where it is; of the first one, its field relative to the question.
    """
    indices = range(len(stance.hands)) if which is None else which
    settled = []
    outcomes = settle_each(stance.robot.hand, [stance.hands[i] for i in indices])
    for i, outcome in zip(indices, outcomes, strict=True):
        if isinstance(outcome, InvalidInputError):
            raise outcome.within(f"stance.hands[{i}]")
        settled.append(outcome)
    return settled


def settle_each(
    kind: SpinyHand, hands: Sequence[HandOnHold]
) -> list[SettledHand | InvalidInputError]:
    """Return hands of one kind closed on their holds; errors in place of those that cannot be."""
    placements = [
        Placement(hand.hold, hand.surface, hand.grasp, hand.placed_hold(), hand.at)
        for hand in hands
    ]
    if all(hand.seat == "rest" for hand in hands):
        return kind.settle_each(placements)
    # those that look in the same direction search together
    given = [PULL_OFF if each.seat_direction is None else each.seat_direction for each in hands]
    ways = [
        None if hand.seat == "rest" else tuple(map(float, way))
        for hand, way in zip(hands, given, strict=True)
    ]
    found: dict[int, SettledHand | InvalidInputError] = {}
    for way in set(ways):
        own = [i for i, each in enumerate(ways) if each == way]
        group = [placements[i] for i in own]
        seated = kind.settle_each(group) if way is None else best_seats(kind, group, way)
        found.update(zip(own, seated, strict=True))
    return [found[i] for i in range(len(hands))]


def hand_space(stance: Stance, limb: str) -> tuple[SettledHand, WrenchSpace]:
    """Return one hand of a stance on its hold, and what it can carry; see `resting_hand`."""
    hand = resting_hand(stance, limb)
    return hand.settled, hand.space


class RestingHand(NamedTuple):
    """One hand of a stance on its hold, and what it can carry.

    Attributes
    ----------
    settled : SettledHand
    space : WrenchSpace
        Of a floating hand the widest of its sets linearised at rest, one for each palm mode.
    palm : PalmMode or None
        The mode of that set; None for a fixed wrist.
    error : float
        How far it is off at most where it reaches farthest along ± each axis: forces, and moments
        over 0.1 m [N].
    """

    settled: SettledHand
    space: WrenchSpace
    palm: PalmMode | None = None
    error: float = 0.0


def resting_hand(stance: Stance, limb: str) -> RestingHand:
    """Return one hand of a stance on its hold, and what it can carry.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, or the hold cannot be where it is.
    UnsupportedError
        If its wrist is compliant: what tensions and poses give together is far from a polyhedron.
    """
    settled, wrist = _hand_at(stance, limb)
    if wrist is not None and wrist.driven:
        raise UnsupportedError(
            f"the wrench space of {limb} is curved, as its wrist is compliant; valid for a wrench "
            "space is fixed or floating",
            field="stance.hands.wrist",
        )
    if wrist is None:
        return RestingHand(settled, wrench_space(settled))
    palm, space, error = widest_at_rest(wrist)
    return RestingHand(settled, space, palm, error)


def floating_wrist(stance: Stance, limb: str) -> FloatingWrist:
    """Return how one hand of a stance gives way.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, its wrist is fixed, or the hold cannot be where it is.
    """
    _, wrist = _hand_at(stance, limb)
    if wrist is None or wrist.driven:
        mode = "fixed" if wrist is None else "compliant"
        raise InvalidInputError(f"the wrist of {limb} is {mode}; must be floating", field="limb")
    return wrist


def _hand_at(stance: Stance, limb: str) -> tuple[SettledHand, FloatingWrist | None]:
    for i, hand in enumerate(stance.hands):
        if hand.limb == limb:
            (settled,) = settle_stance(stance, [i])
            return settled, wrist_at(stance, i, settled)
    limbs = ", ".join(hand.limb for hand in stance.hands)
    raise InvalidInputError(f"no hand {limb!r} in this stance; it has {limbs}", field="limb")
