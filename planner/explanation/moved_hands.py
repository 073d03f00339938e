"""Compare hands whose compliant wrists have moved with hands that close where their wrists are.

A hand of the model closes first; then its wrist moves, and its contact states stay. Where a hand
that closes at the moved pose has other joints or other contacts, the plan's loads are in doubt.
"""

from __future__ import annotations

import cmath
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hand_models.base import Array, InvalidInputError, Pose, turns_about
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, SettledHand
from planner.prepare import PreparedStance, settle_each
from planner.result import HandPlan

__all__ = ["changed_contacts"]


def changed_contacts(prepared: PreparedStance, hands: Sequence[HandPlan]) -> Iterator[str]:
    """Yield a sentence for each compliant hand that would close differently at its planned pose.

    Parameters
    ----------
    prepared : PreparedStance
        The question's stance, with hands on their holds and their sets.
    hands : sequence of HandPlan
        A plan's hands, in the order of the stance.
    """
    stance = prepared.question.stance
    moved = [
        (hand, hand.wrist.twist, settled, place)
        for hand, settled, place in zip(hands, prepared.batch.hands, stance.hands, strict=True)
        if hand.wrist is not None and hand.wrist.driven
    ]
    asked = []
    for _, twist, settled, place in moved:
        there = Pose(twist[:3], turns_about(twist[3:])).inverse() @ settled.seating.pose
        seated = replace(place, at=None, seat="rest", seat_direction=None)
        asked.append(replace(seated, hold_pose=None, hold_in_hand=there))
    closed = settle_each(stance.robot.hand, asked) if asked else []
    for (hand, twist, settled, _), again in zip(moved, closed, strict=True):
        if isinstance(again, InvalidInputError):
            yield f"{hand.limb}: no hand closes where the wrist goes; contacts may have changed"
            continue
        where = f"{hand.limb}: if the hand closed where its wrist goes,"
        worst, finger = _largest_change(hand, twist, settled, again)
        other = next(
            (
                name
                for name, before, after in zip(FINGERS, settled.fingers, again.fingers, strict=True)
                if before.bearing != after.bearing
            ),
            None,
        )
        if worst > 5e-3:  # [rad] of a joint
            yield (
                f"{where} joints of {finger} would be {1e3 * worst:.0f} mrad elsewhere: contacts "
                "may have changed; a shorter wrist_travel is surer"
            )
        elif other is not None:
            yield f"{where} other phalanges of {other} would touch; a shorter wrist_travel is surer"


def _largest_change(
    hand: HandPlan, twist: Array, settled: SettledHand, again: SettledHand
) -> tuple[float, str]:
    """Return how far phalanges are from those of a hand that closed there [rad], and the finger."""
    worst, where = 0.0, FINGERS[0]
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    fingers = zip(frames, settled.fingers, again.fingers, strict=True)
    for i, (frame, one, other) in enumerate(fingers):
        tiles = np.flatnonzero(settled.finger_of == i)[-len(PHALANGES) :]
        # from x toward z is against the sense of the axis across, z × x
        turned = -float(twist[3:] @ frame.across)
        pairs = zip(tiles, one.contacts, other.contacts, strict=True)
        for tile, before, after in pairs:
            drag = hand.axes[tile, 0]
            along = complex(-drag @ frame.along, -drag[2]) * cmath.rect(1.0, -before.tilt)
            off = abs(cmath.phase(along * cmath.rect(1.0, -turned - after.angle)))
            if off > worst:
                worst, where = off, FINGERS[i]
    return worst, where
