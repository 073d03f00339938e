"""What is odd about floating hands: preloads that do not hold, wrists that go far."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from hand_models.hand import FINGERS
from planner.prepare import PreparedStance
from planner.result import HandPlan

__all__ = ["far_wrists", "idle_preloads", "strained_preloads"]

FAR: Final = 5e-3
"""How far a wrist may go from rest before a warning [m]."""

TURNED: Final = 50e-3
"""How far it may turn before a warning [rad]."""

BACKWARDS: Final = 1e-3
"""Shear away from the finger's base that counts [N]."""

LIMIT: Final = 1.0 + 1e-6
"""Utilisation beyond which a hand is overloaded at rest."""


def idle_preloads(prepared: PreparedStance) -> tuple[str, ...]:
    """Return one sentence for each floating hand whose preload lets tiles slip backwards at rest.

    A tile's shear at rest is affine in its tendon's tension; where the springs of the finger push
    it away from the finger's base, a tension is needed to hold it.
    """
    found = []
    hands, wrists = prepared.batch.hands, prepared.hands.wrists
    for limb, hand, wrist in zip(prepared.limbs, hands, wrists, strict=True):
        if wrist is None:
            continue
        needs = []
        for t in np.flatnonzero(hand.touching):
            finger = int(hand.finger_of[t])
            drag = hand.loads[t, 0] + hand.surface.friction * hand.loads[t, 1]
            at_zero, per_newton = (float(value) for value in drag)
            at_zero += float(hand.drag_allowances[t])
            shear = at_zero + per_newton * float(wrist.hand.preload[finger])
            if shear < -BACKWARDS and per_newton > 0.0:
                needs.append((-at_zero / per_newton, finger, hand.tiles[t].phalanx))
        if needs:
            need, finger, phalanx = max(needs)
            found.append(
                f"{limb}: tendon_preload of {wrist.hand.preload[finger]:g} N lets the {phalanx} "
                f"tile of {FINGERS[finger]} be dragged backwards at rest; it needs about "
                f"{need:.0f} N"
            )
    return tuple(found)


def strained_preloads(prepared: PreparedStance) -> Iterator[str]:
    """Yield a sentence for each floating hand that its preload alone overloads."""
    tension_limit = prepared.question.limits.tendon_tension
    for limb, wrist in zip(prepared.limbs, prepared.hands.wrists, strict=True):
        if wrist is None:
            continue
        most = float(wrist.hand.preload.max())
        if tension_limit is not None and most > tension_limit:
            yield (
                f"{limb}: tendon_preload of {most:g} N is above the limit of {tension_limit:g} N "
                "on tendons"
            )
            continue
        verdict = wrist.evaluate(np.zeros((1, 6)))
        used, row = float(verdict.utilisation[0]), wrist.limits[int(verdict.limiting[0])]
        if used > LIMIT:
            where = " of ".join(part for part in (row.phalanx, row.finger) if part is not None)
            yield (
                f"{limb}: tendon_preload alone takes the hand to utilisation {used:.3g} at rest "
                f"({where or 'hand'}, {row.limit})"
            )


def far_wrists(hands: Sequence[HandPlan]) -> Iterator[str]:
    """Yield a sentence for each wrist of a plan that goes too far for its loads to be sure."""
    for hand in hands:
        if hand.wrist is None:
            continue
        moved = float(np.linalg.norm(hand.wrist.twist[:3]))
        turned = float(np.linalg.norm(hand.wrist.twist[3:]))
        if moved > FAR or turned > TURNED:
            yield (
                f"{hand.limb}: the wrist moves {1e3 * moved:.0f} mm and turns "
                f"{1e3 * turned:.0f} mrad: loads are of one step from rest, contacts may have "
                "changed"
            )
