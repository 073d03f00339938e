"""Hands that hang on their nails: rock to hook, a robot on one hand, and how it pulls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hand_models.base import Pose, wrench_transport
from hand_models.hand import Grasp, SettledHand
from hand_models.rock import Hold, Profile
from planner.prepare import settle_hand
from planner.question import HandOnHold, Question, Stance
from tests.suite.helpers.hands import HAND, ROCK, changed_hand
from tests.suite.helpers.robots import with_hand
from tests.suite.helpers.stances import PALM_TO_WALL

PIN = {"inner": 0.06615 + 3 * 0.0431, "outer": 0.03275 + 0.0346 + 3 * 0.0431}
"""x of the nails' pins in H, all fingers along x [m]."""

LIMB = "front_left"
"""Whose hand it is."""

STRONG = changed_hand("structure", "held_mass", 1000.0)
"""Holds more than its nails do."""


def step(deep: float) -> Profile:
    """Flat rock that falls away at x = 0."""
    return Profile([[-0.3, 0.0], [0.0, 0.0], [0.0, deep], [0.3, deep]])


def nail_rows(settled: SettledHand) -> list[int]:
    return [i for i, tile in enumerate(settled.tiles) if tile.phalanx == "nail"]


def one_hand(hand=HAND, hold: Hold | None = None, place: float = 0.001) -> Stance:
    """A robot that hangs on the nails of one hand, on a wall."""
    body = Pose(np.zeros(3), np.column_stack([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]).astype(float))
    there = HandOnHold(
        LIMB,
        body @ Pose(np.array([0.5, 0.4, -0.3]), PALM_TO_WALL),
        step(0.02) if hold is None else hold,
        ROCK,
        hold_in_hand=Pose(np.array([PIN["inner"] + place, 0.0, 0.006]), np.eye(3)),
        grasp=Grasp(fingernail=True),
    )
    stance = Stance((there,), body)
    return replace(stance, robot=with_hand(stance.robot, hand))


def hung(stance: Stance, pull: float) -> Question:
    """Ask the hand to pull with so much along −x and half a tenth of it into the rock."""
    settled = settle_hand(stance.hands[0], stance)
    places = settled.positions[nail_rows(settled)]
    force = pull / 4.0 * np.array([-1.0, 0.0, 0.05])
    wrench = np.concatenate([4.0 * force, np.cross(places, force).sum(axis=0)])
    carried = wrench_transport(stance.body.inverse() @ stance.hands[0].pose) @ -wrench
    return Question(stance, body_wrench=carried)
