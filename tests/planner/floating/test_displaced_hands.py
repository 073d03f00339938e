"""Plans of compliant hands that are not quite where they were meant to be."""

from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import Pose, turns_about
from planner.prepare import prepare_stance
from planner.question import Question
from planner.solving import plan
from tests.planner.floating.test_compliant_plan import asked

ASIDE = 2e-3, 2e-3, 1e-3
"""Largest displacements along x, y and z of H [m]."""

TURNED = 0.02
"""Largest turn about y and z of H, either way [rad]."""


def displaced(name: str, sample: int) -> Question:
    """Return a bundled stance with each hand displaced on its own."""
    question, hands = replace(asked(name), want=frozenset(["load_factor"])), []
    settled = prepare_stance(question).batch.hands
    parts = np.random.default_rng(1).uniform(-1.0, 1.0, (sample + 1, len(settled), 5))[sample]
    for hand, place, part in zip(settled, question.stance.hands, parts, strict=True):
        moved = Pose(ASIDE * part[:3], turns_about(TURNED * np.array([0.0, *part[3:]])))
        there = moved.inverse() @ hand.seating.pose
        hands.append(replace(place, at=None, seat="rest", hold_pose=None, hold_in_hand=there))
    return replace(question, stance=replace(question.stance, hands=tuple(hands)))


@pytest.mark.slow
def test_where_the_utilisation_stays_a_little_beyond_1_the_load_factor_is_found() -> None:
    """Each search for a smaller load ends some 1e-4 beyond 1, as far as the one before."""
    found = plan(displaced("boulders", 3))
    assert found.verified
    assert found.load_factor is not None
    assert 0.9 < found.load_factor < 1.0
    assert not any("lower bound" in each for each in found.warnings)
