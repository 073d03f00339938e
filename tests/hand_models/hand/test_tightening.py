"""In which order a finger's springs let it close, and at which tension each stage is over."""

import math

import numpy as np
import pytest
from msgspec import structs

from hand_models import Cylinder, Grasp, InvalidInputError, Plane, Pose, Profile, Sphere
from hand_models.finger import PHALANGES
from hand_models.hand import closing_sequence, nearby_closures
from tests.suite.helpers.hands import HAND, PINCH, ROCK, changed_hand, pinch
from tests.suite.helpers.rocks import random_profile

PARTS = ["nail", "proximal", "middle", "distal", "tiles"]


def test_each_stage_ends_where_the_tendons_moment_equals_the_springs():
    settled = pinch()
    finger = settled.fingers[1]
    for closing in closing_sequence(settled):
        assert [stage.part for stage in closing.stages] == PARTS
    nail, *joints, tiles = closing_sequence(settled)[1].stages
    # 0.025 N·m/rad over half a turn on 7.5 mm
    assert nail.ends == pytest.approx(0.025 * math.pi / 0.0075)
    for stage, angle, radius in zip(
        joints, finger.joint_angles, finger.model.pulley_radii, strict=True
    ):
        assert stage.starts == 0.0
        assert stage.ends * radius == pytest.approx(0.05 * angle)
    assert tiles == ("tiles", 0.0, 37.0)


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


KNOB = Profile(
    np.array([[-0.6, 0.06], [-0.075, 0.06], [-0.04, 0.0], [0.04, 0.0], [0.075, 0.06], [0.6, 0.06]])
)
"""On a wall 60 mm behind it."""

BALL = Sphere(0.03)
LEFT = Pose(np.array([0.11, 0.0165, 0.03]), np.eye(3))
"""Under inner_left alone."""

AWAY = Pose(np.array([0.0, 0.0, 1.0]), np.eye(3))


def test_it_is_told_how_fingers_end():
    for hold, grasp, pose, closures in [
        (Cylinder(0.3), PINCH, None, "laid laid laid laid"),
        (KNOB, PINCH, None, "wedged wedged wedged wedged"),
        (BALL, Grasp(closing_tension=50.0), LEFT, "stopped hooked stopped stopped"),
        (BALL, Grasp(closing_tension=8.0), LEFT, "curled hooked curled curled"),
        (Plane(), PINCH, AWAY, "curled curled curled curled"),
        (
            Plane(),
            structs.replace(PINCH, closing_tension=50.0),
            AWAY,
            "stopped stopped stopped stopped",
        ),
        (Cylinder(0.3), structs.replace(PINCH, fingernail=True), None, "straight " * 4),
    ]:
        settled = HAND.settle(hold, ROCK, grasp, pose)
        assert [each.closure for each in closing_sequence(settled)] == closures.split()


@pytest.mark.slow
def test_how_fingers_end_is_what_their_contacts_say():
    seen = set()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        try:
            settled = HAND.settle(random_profile(rng), ROCK, PINCH)
        except InvalidInputError:
            continue
        for finger, closure in zip(settled.fingers, settled.closures, strict=True):
            held, bearing = sum(finger.touching), len(finger.bearing)
            assert (closure == "laid") == (held == len(PHALANGES))
            assert (closure == "hooked") == (0 < held < len(PHALANGES))
            assert (closure == "wedged") == (held == 0 < bearing)
            seen.add(closure)
    assert seen >= {"laid", "hooked"}


def test_where_the_rock_is_a_little_elsewhere_fingers_end_as_told():
    """Hands on rough rock, one of whose fingers loses a tile within a tenth of a millimetre."""
    settled = HAND.settle(random_profile(np.random.default_rng(20)), ROCK, PINCH)
    told = nearby_closures(settled)
    pose = settled.seating.pose
    there = [
        HAND.settle(settled.hold, ROCK, settled.grasp, Pose(pose.position + step, pose.rotation))
        for step in 1e-4 * np.vstack([np.eye(3), -np.eye(3)])
    ]
    assert any(each.closures for each in told)
    for k, each in enumerate(told):
        assert set(each.closures) == {hand.closures[k] for hand in there} - {settled.closures[k]}
        turns = [hand.fingers[k].joint_angles - settled.fingers[k].joint_angles for hand in there]
        assert each.turn == pytest.approx(np.abs(turns).max())


def test_a_hand_that_cannot_be_a_little_nearer_is_told():
    """Open fingers have 0.28 mm between a plane and their tiles' faces, beside a palm on it."""
    settled = HAND.settle(Plane(), ROCK, Grasp(), Pose(np.array([0.0, 0.0, -2.5e-4]), np.eye(3)))
    assert all("refused" in each.closures for each in nearby_closures(settled))
    assert not any("refused" in each.closures for each in nearby_closures(settled, 1e-5))


def test_nothing_is_near_where_nothing_is_moved():
    assert nearby_closures(pinch(), 0.0) == (((), 0.0),) * 4
