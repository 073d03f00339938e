"""Forces alone, and what a hand says that it cannot do: by numbers, on any rock."""

import math

import numpy as np
import pytest

from hand_models import Grasp, Profile
from hand_models.fixed_wrist import (
    TRIAL_WAYS,
    force_directions,
    impossible_forces,
    pure_reaches,
    wrench_space,
)
from hand_models.wrench_spaces import WrenchSpace
from tests.suite.helpers.hands import HAND, ROCK, pinch


def cannot(space: WrenchSpace) -> dict[str, str]:
    ways = force_directions()
    pure = pure_reaches(space, ways).tolist()
    support = [space.support(way) for way in ways]
    return impossible_forces(
        dict(zip(TRIAL_WAYS, pure, strict=True)), dict(zip(TRIAL_WAYS, support, strict=True))
    )


def test_directions_are_by_sign_and_axis():
    units = np.eye(6)
    expected = [-units[2], -units[0], units[0], -units[1], units[1]]
    np.testing.assert_array_equal(force_directions(), expected)
    np.testing.assert_array_equal(force_directions(("+fz",)), [units[2]])


def test_a_pinch_can_pull_and_shear():
    assert cannot(wrench_space(pinch())) == {}


@pytest.mark.parametrize("width", [0.04, 0.06, 0.08, 0.1])
@pytest.mark.parametrize("rotation", [0.0, math.pi])
def test_in_a_slot_a_hand_must_be_pressed_on(width, rotation):
    """Its fingers close; they do not open against the walls."""
    half, depth = 0.5 * width, 0.06
    corners = [[-half, 0.0], [-half, depth], [half, depth], [half, 0.0]]
    slot = Profile([[-0.4, 0.0], *corners, [0.4, 0.0]])
    space = wrench_space(HAND.settle(slot, ROCK, Grasp(rotation)))
    most = space.support([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    assert most < -1.0
    assert cannot(space)["-fz"] == (
        f"cannot pull along −z: whatever comes with it, the largest pull-off is −{-most:.1f} N: "
        "the hand must be pressed on"
    )


def test_each_case_has_its_sentence():
    pure = {"-fz": -3.2, "-fx": None, "+fx": 5.0, "-fy": 0.02, "+fy": math.nan}
    support = {"-fz": 4.0, "-fx": 60.0, "+fx": 8.0, "-fy": 9.0, "+fy": -2.0}
    assert impossible_forces(pure, support) == {
        "-fz": "cannot pull along −z alone: the largest pure pull-off is −3.2 N: the hand must be "
        "pressed on",
        "-fx": "cannot shear along −x alone: it takes other forces or moments with it; with any, "
        "the largest force is 60.0 N",
        "-fy": "cannot shear along −y alone: the largest pure force is 0.0 N",
        "+fy": "cannot shear along +y: whatever comes with it, the largest force is −2.0 N: the "
        "hand must be loaded along −y",
    }
    empty = impossible_forces(dict.fromkeys(TRIAL_WAYS), dict.fromkeys(TRIAL_WAYS))
    assert list(empty) == list(TRIAL_WAYS)
    assert "closing alone is more than the hand's tiles hold" in empty["-fz"]
