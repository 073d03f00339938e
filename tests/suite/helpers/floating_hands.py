"""Hands with floating wrists: two of them on a wall, and what they give the body by the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hand_models.base import wrench_transport
from hand_models.compliance import CompliantHand, FloatingWrist
from planner.prepare import settle_hand
from planner.question import HandOnHold, Stance
from tests.suite.helpers.stances import on_wall

REAR = ("rear_right", "rear_left")


def floating(stance: Stance, *limbs: str, preload=None) -> Stance:
    hands = tuple(
        replace(hand, wrist="floating", tendon_preload=preload) if hand.limb in limbs else hand
        for hand in stance.hands
    )
    return replace(stance, hands=hands)


def wrist_of(hand: HandOnHold, stance: Stance) -> FloatingWrist:
    return FloatingWrist(CompliantHand(settle_hand(hand, stance), hand.tendon_preload))


def body_wrench(stance: Stance, twists) -> np.ndarray:
    """What floating hands give the body at some twists of their wrists, by the model alone."""
    body, total = stance.body.inverse(), np.zeros(6)
    for hand, twist in zip(stance.hands, twists, strict=True):
        model = wrist_of(hand, stance).hand
        wrench = model.loads(np.asarray(twist)[None]).wrenches[0]
        total -= wrench_transport(body @ hand.pose) @ wrench
    return total


PAIR = floating(on_wall(limbs=REAR), *REAR, preload=np.full(4, 50.0))
NEAR = np.array([-0.8e-3, 0.1e-3, 0.2e-3, 1e-3, 4e-3, -2e-3])
"""A small twist that a hand of `PAIR` bears, its palm dragging and pressing."""
