"""Close hands on their holds, let them come to rest there, and find the set of one hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from hand_models.base import InvalidInputError, Pose, UnsupportedError
from hand_models.compliance import FloatingWrist, PalmMode
from hand_models.fixed_wrist import PULL_OFF, best_seats, placed_by_contact, wrench_space
from hand_models.hand import Placement, SettledHand, SpinyHand
from hand_models.wrench_spaces import WrenchSpace
from planner.prepare.hand_sets import error_at_rest, wrist_at
from planner.question import HandOnHold, Stance

__all__ = [
    "RestingHand",
    "come_to_rest",
    "floating_wrist",
    "hand_space",
    "resting_hand",
    "settle_each",
    "settle_hand",
    "settle_stance",
]


def settle_hand(hand: HandOnHold, stance: Stance) -> SettledHand:
    """Close one hand of a stance on its hold.

    Raises
    ------
    InvalidInputError
        If the hand cannot be closed on its hold there.
    """
    (settled,) = settle_each(stance.robot.hand, [hand])
    if isinstance(settled, InvalidInputError):
        raise settled
    return settled


def settle_stance(stance: Stance, which: Sequence[int] | None = None) -> list[SettledHand]:
    """Close the hands of a stance on their holds, all in one call.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    which : sequence of int, optional
        Indices of the hands; all by default.

    Returns
    -------
    list of SettledHand
        The closed hands, in the order of the indices.

    Raises
    ------
    InvalidInputError
        If a hand cannot be closed on its hold; the field, relative to the question, is that of the
        first such hand.
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
    """Close hands of one kind on their holds; return an error in place of each that cannot close.

    Parameters
    ----------
    kind : SpinyHand
        Model of all the hands.
    hands : sequence of HandOnHold
        Hands with their holds and grasps.

    Returns
    -------
    list of SettledHand or InvalidInputError
        Closed hand, or error, for each of ``hands``, in their order.
    """
    placements = [
        Placement(hand.hold, hand.surface, hand.grasp, hand.placed_hold(), hand.at)
        for hand in hands
    ]
    if all(hand.seat == "rest" for hand in hands):
        outcomes = kind.settle_each(placements)
        return [_as_placed(*each) for each in zip(hands, outcomes, strict=True)]
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
    return [_as_placed(hand, found[i]) for i, hand in enumerate(hands)]


def _as_placed(
    hand: HandOnHold, outcome: SettledHand | InvalidInputError
) -> SettledHand | InvalidInputError:
    """Return a settled hand whose seating says that it was placed by contact, if it was."""
    if hand.contact_offset is None or isinstance(outcome, InvalidInputError):
        return outcome
    seating = replace(outcome.seating, rule="contact", offset=hand.contact_offset)
    return replace(outcome, seating=seating)


def come_to_rest(
    kind: SpinyHand, hands: Sequence[HandOnHold], offsets: Sequence[Pose] | None = None
) -> list[HandOnHold | InvalidInputError]:
    """Place hands by contact: where each, closed and unloaded, rests on its rock.

    Only a hand's position along z, and its rotations about x and y of H, change
    (`hand_models.fixed_wrist.contact_rest`). The rock stays at its pose in W.

    Parameters
    ----------
    kind : SpinyHand
        Model of all the hands.
    hands : sequence of HandOnHold, length n
        Hands where they start.
    offsets : sequence of Pose, length n, optional
        Pose of each hand's final frame H in its frame H at rest; by default hands stay at rest.

    Returns
    -------
    list of HandOnHold or InvalidInputError
        The same hands with new poses in W, and with the poses of their holds in H; an error in
        place of each hand that has no rest.
    """
    if not hands:
        return []
    offsets = [Pose.identity()] * len(hands) if offsets is None else offsets
    found: dict[int, HandOnHold | InvalidInputError] = {}
    starts: dict[int, SettledHand] = {}
    for i, start in enumerate(settle_each(kind, hands)):
        if isinstance(start, SettledHand):
            starts[i] = start
        else:
            found[i] = start
    rests = placed_by_contact(kind, list(starts.values()), [offsets[i] for i in starts])
    for (i, start), rest in zip(starts.items(), rests, strict=True):
        if isinstance(rest, InvalidInputError):
            found[i] = rest
            continue
        rock = hands[i].pose @ start.seating.pose
        found[i] = replace(
            hands[i],
            pose=rock @ rest.seating.pose.inverse(),
            hold_pose=None,
            hold_in_hand=rest.seating.pose,
            seat="rest",
            seat_direction=None,
            at=None,
            contact_offset=offsets[i],
        )
    return [found[i] for i in range(len(hands))]


def hand_space(stance: Stance, limb: str) -> tuple[SettledHand, WrenchSpace]:
    """Close one hand of a stance on its hold; return the closed hand and its wrench space.

    The wrench space is that of `resting_hand`, which also says when an error is raised.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    limb : str
        Limb of the hand.
    """
    hand = resting_hand(stance, limb)
    return hand.settled, hand.space


class RestingHand(NamedTuple):
    """One hand of a stance closed on its hold, and its wrench space at rest.

    Attributes
    ----------
    settled : SettledHand
        The hand, closed on its hold.
    space : WrenchSpace
        All wrenches that the hand can exert on the rock. Of a floating hand, the set linearised at
        rest.
    palm : PalmMode or None
        How the palm carries at rest; None for a fixed wrist.
    error : float
        Largest linearisation error where the set reaches farthest along ± each axis: forces, and
        moments over 0.1 m [N]. Zero for a fixed wrist.
    """

    settled: SettledHand
    space: WrenchSpace
    palm: PalmMode | None = None
    error: float = 0.0


def resting_hand(stance: Stance, limb: str) -> RestingHand:
    """Close one hand of a stance on its hold, and compute its wrench space at rest.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    limb : str
        Limb of the hand.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, or the hand cannot be closed on its hold.
    UnsupportedError
        If the wrist is compliant: its wrench space is far from a polyhedron.
    """
    settled, wrist = _hand_at(stance, limb)
    if wrist is not None and wrist.driven:
        raise UnsupportedError(
            f"the wrench space of {limb} is not available, as its wrist is compliant; valid are "
            "fixed and floating",
            field=f"stance.hands[{[hand.limb for hand in stance.hands].index(limb)}].wrist",
        )
    if wrist is None:
        return RestingHand(settled, wrench_space(settled))
    palm = wrist.palm_mode(wrist.at_rest)
    return RestingHand(settled, wrist.linearised(), palm, error_at_rest(wrist))


def floating_wrist(stance: Stance, limb: str) -> FloatingWrist:
    """Close a floating hand of a stance on its hold, and return the model of its wrist.

    Parameters
    ----------
    stance : Stance
        Poses of the body and of the hands on their holds.
    limb : str
        Limb of the hand.

    Raises
    ------
    InvalidInputError
        If the stance has no such hand, its wrist is not floating, or the hand cannot be closed on
        its hold.
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
