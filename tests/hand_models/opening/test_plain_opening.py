"""Hands open as a plain simulation of the same law does, in small steps, finger by finger."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hand_models import Grasp, InvalidInputError, SettledHand
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS
from hand_models.opening import opening_path
from hand_models.opening.parts import open_fingers
from tests.suite.helpers.hands import HAND, ROCK, settled_at
from tests.suite.helpers.moved_hands import gentle_profile, rough_profile
from tests.suite.helpers.plain_opening import LostError, PlainOpening

SAME = 0.02
"""Parts of the largest force by which wrenches may differ."""


def hand_of(seed: int) -> SettledHand | None:
    """A hand on round rock, in places askew, on a knoll, or on a rough wall."""
    rng = np.random.default_rng(seed)
    turned = float(rng.uniform(0.3, math.pi))
    if seed % 3 == 0:
        return settled_at(seed)
    hold = (gentle_profile, rough_profile)[seed % 3 - 1](rng)
    try:
        return HAND.settle(hold, ROCK, Grasp(turned))
    except InvalidInputError:
        return None


class PlainHand:
    """Four fingers that open, and the tiles on the bases of the outer two."""

    def __init__(self, hand: SettledHand) -> None:
        self.hand = hand
        opened = open_fingers(hand)
        self.fingers = [
            PlainOpening(hand.hand.finger, *each) for each in zip(opened, hand.fingers, strict=True)
        ]

    def wrench(self, tension: float) -> np.ndarray:
        """Lower the tendons to a tension; return the wrench on the rock, in H."""
        hand, total = self.hand, np.zeros(6)
        frames = hand.hand.frames(hand.grasp.outer_rotation)
        for finger, frame in zip(self.fingers, frames, strict=True):
            finger.lower_to(tension)
            places, forces = finger.contacts()
            axes = np.array([frame.along, [0.0, 0.0, 1.0]])
            here, force = frame.joint + places @ axes, forces @ axes
            total += np.concatenate([force.sum(axis=0), np.cross(here, force).sum(axis=0)])
        for tile, place, axes, loads in zip(
            hand.tiles, hand.positions, hand.axes, hand.loads, strict=True
        ):
            if tile.phalanx == "base":
                force = max(loads[0] @ [1.0, tension], 0.0) * axes[0]
                total += np.concatenate([force, np.cross(place, force)])
        return total


def differences(hand: SettledHand, increment: float) -> tuple[np.ndarray, list[str]]:
    """Return how far the forces of both differ, in parts of the largest, and tiles that do.

    ``increment``: of the tension in the simulation [N].
    """
    path, plain = opening_path(hand, force=0.02), PlainHand(hand)
    tensions = np.arange(hand.closing_tension, 0.0, -increment)
    mine = np.column_stack(
        [np.interp(-tensions, -path.tensions[:, 0], each) for each in path.wrenches.T]
    )
    slow = np.array([plain.wrench(float(f)) for f in tensions])
    largest = np.linalg.norm(slow[:, :3], axis=1).max()
    apart = np.abs(mine - slow)[:, :3].max(axis=1) / max(largest, 5.0)
    wrong = []
    for name, finger in zip(FINGERS, plain.fingers, strict=True):
        when = {PHALANGES[j]: f for j, f in finger.let_go}
        here = {e.phalanx: e.tension for e in path.events if e.finger == name}
        here.pop("base", None)
        for phalanx in PHALANGES:
            # below the last increment of the simulation, it does not know
            early, late = when.get(phalanx, 0.0), here.get(phalanx, 0.0)
            if abs(early - late) > 2.0 * increment:
                wrong.append(f"{name} {phalanx} at {late:.2f} N, simulated {early:.2f} N")
    return apart, wrong


def compared(seeds: range, increment: float) -> tuple[int, dict[int, object]]:
    count, unlike = 0, {}
    for seed in seeds:
        hand = hand_of(seed)
        if hand is None:
            continue
        try:
            apart, wrong = differences(hand, increment)
        except LostError:
            # the simulation of one in twelve moves to and fro where a contact does
            continue
        count += 1
        # where a finger snaps, both snap within an increment
        if wrong or np.quantile(apart, 0.9) > SAME:
            unlike[seed] = wrong, float(np.quantile(apart, 0.9))
    return count, unlike


def test_a_few_hands_open_as_simulated():
    count, unlike = compared(range(2, 3), 3.0)
    assert count
    assert unlike == {}


@pytest.mark.slow
@pytest.mark.parametrize("part", range(2))
def test_hands_open_as_simulated(part):
    count, unlike = compared(range(10 * part, 10 * part + 6), 0.5)
    assert count > 2
    assert len(unlike) <= 1, unlike
