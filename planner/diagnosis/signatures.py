"""Signatures of slips: how each tile's slip changes the tension, or turns the winch.

The wrist is fixed, so that a slip concerns its own finger alone. The phalanges stay where they are.
The tile that lets go drags on with friction while it is pressed (`fixed_wrist.slipped_hand`), or
carries nothing; its springs then take up the tendon's slack (`FingerTendon.slipped`). Tendon and
gear do not stretch: the tiles' springs are softer by far (`assumed`).

A slip may be seen by the motor or not: between phalanges the tendon slides, as on closing, or it
sticks with the friction of holding. Both are computed, as nobody has measured which.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hand_models.base import BASE_TOLERANCES, UnsupportedError
from hand_models.fixed_wrist import SLIPPED_TILE, slipped_hand
from hand_models.hand import FINGERS, SettledHand
from hand_models.tendon import FingerTendon
from planner.prepare import PreparedStance
from planner.question import LostTile
from planner.result import HandPlan

__all__ = ["SlipSignature", "slip_signatures"]


class SlipSignature(NamedTuple):
    """Signature of a tile's slip in the data of its finger's motor.

    Attributes
    ----------
    tile : LostTile
    hand, finger : int
        Indices of the hand in the stance, and of the finger in `FINGERS`.
    use : float
        Utilisation of the tile before.
    tensions : tuple of float, length 2
        Tension after the slip if the winch stands still, of a tendon that slides between phalanges
        and of one that sticks [N].
    turns : tuple of float, length 2
        Turn of the winch if the motor keeps its tension, positive as it winds up tendon, of such
        tendons [rad].
    turn_per_newton : float
        Turn of the winch per newton of tension without a slip [rad/N].
    """

    tile: LostTile
    hand: int
    finger: int
    use: float
    tensions: tuple[float, float]
    turns: tuple[float, float]
    turn_per_newton: float


def slip_signatures(
    prepared: PreparedStance, hands: Sequence[HandPlan]
) -> tuple[SlipSignature, ...]:
    """Return the signature of each tile on rock, hand by hand.

    Parameters
    ----------
    prepared : PreparedStance
        All wrists are fixed, and no grasp holds with fingernails.
    hands : sequence of HandPlan
        The stance's plan: tensions and utilisations before the slip.

    Raises
    ------
    UnsupportedError
        If a wrist is not fixed, or a grasp has fingernails.
    """
    if prepared.hands.floating:
        raise UnsupportedError(
            "a slip is diagnosed with fixed wrists only, as a wrist that moves spreads it over all "
            f"fingers; others have {', '.join(prepared.floating)}",
            field="stance",
        )
    found = []
    for h, (hand, planned) in enumerate(zip(prepared.batch.hands, hands, strict=True)):
        if hand.grasp.fingernail:
            raise UnsupportedError(
                f"{planned.limb}: slips of fingernails are not diagnosed", field="stance"
            )
        for finger, tension in enumerate(planned.tensions.tolist()):
            for t, tensions, turns, give in _of_finger(hand, finger, tension):
                tile = LostTile(planned.limb, *hand.tiles[t][:2])
                use = float(planned.tile_utilisations[t])
                found.append(SlipSignature(tile, h, finger, use, tensions, turns, give))
    return tuple(found)


def _of_finger(
    hand: SettledHand, finger: int, tension: float
) -> Iterator[tuple[int, tuple[float, float], tuple[float, float], float]]:
    """Yield each tile on rock with its tensions, turns and turn per newton."""
    model, own = hand.hand, np.flatnonzero(hand.finger_of == finger)
    base_tile, radius = FINGERS[finger].startswith("outer"), model.drive.winch_radius
    tendon = FingerTendon.from_table(model.table, base_tile, hand.stiffness_ratio)
    tendon = tendon.engaged(hand.engagement[own])
    sticks = replace(tendon, friction=max(tendon.friction, model.tendon_friction))
    loads = hand.loads[own, 0]
    before = tendon.closed(tension, loads[:, 0] + tension * loads[:, 1])
    stiffness = np.array(tendon.contact_stiffness) + tendon.spring_stiffness
    give = float((tendon.pulley_ratio**2 / stiffness).sum()) / radius
    for i in np.flatnonzero(hand.touching[own]).tolist():
        t = int(own[i])
        lost = slipped_hand(hand, [t])
        drags = lost.loads[t, 0] if lost.tiles[t].contact == SLIPPED_TILE else np.zeros(2)
        tensions, turns = [], []
        for each in (tendon, sticks):
            after, shear = before, -1.0
            # friction in proportion to the tension that the slip leaves: a round adds two digits
            for _ in range(12):
                known, shear = shear, max(float(drags @ (1.0, after.motor_tension)), 0.0)
                if abs(shear - known) <= BASE_TOLERANCES.force:
                    break
                after = each.slipped(before, i, shear, None)
            tensions.append(after.motor_tension)
            shear = max(float(drags @ (1.0, tension)), 0.0)
            turns.append(each.drawn(before, each.slipped(before, i, shear, tension)) / radius)
        yield t, (tensions[0], tensions[1]), (turns[0], turns[1]), give
