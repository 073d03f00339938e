"""In which order a finger's springs let it close, and at which tension each stage is over."""

import math

import pytest

from hand_models import Cylinder, Plane, Pose
from hand_models.hand import closing_sequence
from hand_models.hand.tightening import TILES
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, pinch

PARTS = ["nail", "proximal", "middle", "distal", TILES]


def test_each_stage_ends_where_the_tendons_moment_equals_the_springs():
    settled = pinch()
    finger = settled.fingers[1]
    for closing in closing_sequence(settled):
        assert [stage.part for stage in closing.stages] == PARTS
    nail, *joints, tiles = closing_sequence(settled)[1].stages
    # 0.025 N·m/rad over half a turn on 7.5 mm
    assert nail.ends == pytest.approx(0.025 * math.pi / 0.0075)
    assert nail.ends == pytest.approx(HAND.nail.retracting_tension)
    for stage, angle, radius in zip(
        joints, finger.joint_angles, finger.model.pulley_radii, strict=True
    ):
        assert stage.starts == 0.0
        assert stage.ends * radius == pytest.approx(0.05 * angle)
    assert tiles == (TILES, 0.0, 37.0)


def test_the_published_springs_alone_do_not_keep_the_order():
    """Without preloads everything starts at once: the nail is last but for the tiles."""
    for closing in closing_sequence(pinch()):
        assert not closing.in_order
        nail, *joints, tiles = closing.stages
        assert nail.ends > max(stage.ends for stage in joints)
        assert tiles.ends > nail.ends


def test_with_preloads_the_stages_come_one_after_the_other():
    # on a flat wall joints do not turn: each starts where its preload gives way
    preloads = [0.06, 0.035, 0.031]
    hand = changed_hand("finger", "joint_preload", preloads)
    for closing in closing_sequence(hand.settle(Plane(), ROCK)):
        nail, *joints, _ = closing.stages
        by_hand = [p / r for p, r in zip(preloads, hand.finger.pulley_radii, strict=True)]
        assert [stage.starts for stage in joints] == pytest.approx(by_hand)
        assert closing.in_order
        assert nail.ends < by_hand[0] < by_hand[1] < by_hand[2]


def test_a_joint_that_the_rock_pushed_open_is_not_closed_by_the_tendon():
    """A palm on a flat wall leaves the fingers' tiles no room."""
    settled = HAND.settle(Plane(), ROCK, None, Pose.identity())
    opened = 0
    for closing, finger in zip(closing_sequence(settled), settled.fingers, strict=True):
        for stage, angle in zip(closing.stages[1:4], finger.joint_angles, strict=True):
            assert (stage.ends == stage.starts) == (angle <= 0.0)
            opened += angle <= 0.0
    assert opened


def test_friction_makes_the_far_joints_later():
    hand = changed_hand("tendon", "friction", 0.3)
    plain, lossy = (h.settle(Cylinder(0.3), ROCK, PINCH) for h in (HAND, hand))
    before, after = (closing_sequence(settled)[1].stages for settled in (plain, lossy))
    assert after[1].ends == pytest.approx(before[1].ends)
    assert after[2].ends == pytest.approx(before[2].ends / 0.7)
    assert after[3].ends == pytest.approx(before[3].ends / 0.49)
