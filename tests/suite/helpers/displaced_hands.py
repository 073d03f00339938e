"""Compliant hands of bundled stances that are not quite where they were meant to be.

``python -m tests.suite.helpers.displaced_hands slab 60`` prints the load factor of a bundled
stance, and quantiles over 60 samples in which each hand is displaced on its own and all is planned
anew.
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

from hand_models.base import Pose, turns_about
from planner.prepare import prepare_stance
from planner.question import Question
from planner.solving import plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.stances import complying

ASIDE = 2e-3, 2e-3, 1e-3
"""Largest displacements along x, y and z of H, either way [m]."""

LARGEST_TURN = 0.02
"""About y and z of H, either way [rad]."""


def as_given(name: str) -> Question:
    """Return a bundled stance with compliant wrists whose load factor is asked for."""
    return replace(complying(question(read_request(name))), want=frozenset(["load_factor"]))


def displaced(name: str, sample: int) -> Question:
    """Return a bundled stance with each hand displaced on its own."""
    asked, hands = as_given(name), []
    settled = prepare_stance(asked).batch.hands
    parts = np.random.default_rng(1).uniform(-1.0, 1.0, (sample + 1, len(settled), 5))[sample]
    for hand, place, part in zip(settled, asked.stance.hands, parts, strict=True):
        moved = Pose(ASIDE * part[:3], turns_about(LARGEST_TURN * np.array([0.0, *part[3:]])))
        there = moved.inverse() @ hand.seating.pose
        hands.append(replace(place, at=None, seat="rest", hold_pose=None, hold_in_hand=there))
    return replace(asked, stance=replace(asked.stance, hands=tuple(hands)))


def main(name: str, count: str) -> None:
    """Print the load factors of a stance as it is given, and with hands displaced."""
    print(f"{name}: load factor {plan(as_given(name)).load_factor or 0.0:.3f}")
    factors = [plan(displaced(name, i)).load_factor or 0.0 for i in range(int(count))]
    least, *quantiles = np.percentile(factors, (0, 10, 50, 90))
    said = ", ".join(f"{each:.3f}" for each in quantiles)
    print(f"{count} samples: least {least:.3f}; 10, 50, 90 %: {said}")


if __name__ == "__main__":
    main(*sys.argv[1:])
