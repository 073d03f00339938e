"""A tendon's motor and winch: worked by hand, against the rock's give, and in plans."""

import math

import numpy as np
import pytest

from hand_models import FINGERS, InvalidInputError
from planner.prepare import settle_hand
from planner.solving import plan
from tests.suite.helpers.hands import HAND, changed_hand, pinch, random_hand
from tests.suite.helpers.stances import ask, on_wall, random_answer

DRIVE = HAND.drive


def winch_angle(settled, i, tension):
    tiles = settled.finger_of == i
    shears = settled.loads[tiles, 0] @ [1.0, tension]
    return DRIVE.winch_angle(drawn_by_joints(settled, i), tension, shears.sum(), tiles.sum())


def drawn_by_joints(settled, i):
    return np.array([5.5e-3, 3.195e-3, 1.945e-3]) @ settled.fingers[i].joint_angles


def test_torque_and_current_at_a_hundred_newtons_are_those_worked_by_hand():
    """0.67 N·m on the winch; over 236 turns and 0.7: 4.0557 mN·m; over 23.4 mN·m/A, and 26.3 mA."""
    assert DRIVE.torque(100.0) == pytest.approx(4.05569e-3, rel=1e-6)
    assert DRIVE.current(100.0) == pytest.approx(0.173320 + 0.0263, rel=1e-5)
    assert DRIVE.torque(0.0) == 0.0
    assert DRIVE.current(0.0) == 0.0263


def test_the_motor_gives_the_papers_seven_hundred_newtons_and_hardly_more():
    assert DRIVE.torque(700.0) <= DRIVE.maximum_torque < DRIVE.torque(720.0)
    assert DRIVE.current(700.0) <= DRIVE.maximum_current < DRIVE.current(720.0)


def test_the_weaker_of_motor_and_driver_limits_the_current():
    assert DRIVE.maximum_current == 1.24
    assert changed_hand("motor", "driver_current", 0.7).drive.maximum_current == 0.7


def test_the_winch_angle_of_a_finger_is_that_worked_by_hand():
    """A pinch at 37 N: tiles drag 18.96 N, so two strands draw in 2 × 203.04/11500 m."""
    settled = pinch()
    i = FINGERS.index("inner_left")
    expected = (
        drawn_by_joints(settled, i) + 2.0 * (3 * 74.0 - 37.0 * (0.1317 + 0.1801 + 0.2006)) / 11500.0
    ) / 0.0067
    assert winch_angle(settled, i, 37.0) == pytest.approx(expected, rel=1e-6)


def test_tightening_turns_the_winch_as_far_as_the_rock_gives():
    """Each newton drags an engaged tile by g/k_c = 2/(k_c + K_p), and two strands follow.

    Of a tile with φ of its spines on the rock the spring takes what φ g leaves of two newtons.
    """
    settled = pinch()
    gives = {
        "base": 2.0 / 15750.0,
        "proximal": 2.0 / 15750.0,
        "middle": 2.0 / 18043.0,
        "distal": 2.0 / 19715.0,
    }
    for i, finger in enumerate(FINGERS):
        own = np.flatnonzero(settled.finger_of == i)
        share = settled.engagement[own]
        give = np.array([gives[settled.tiles[t].phalanx] for t in own])
        rate = 2.0 * (share * give + (1.0 - share) * 2.0 / 11500.0).sum() / 0.0067
        turned = winch_angle(settled, i, 87.0) - winch_angle(settled, i, 37.0)
        assert turned == pytest.approx(50.0 * rate, rel=1e-9), finger


def test_a_slack_open_finger_has_turned_its_winch_by_its_joints_alone():
    for seed in range(20):
        try:
            settled = random_hand(seed)
        except InvalidInputError:
            continue
        for i, finger in enumerate(settled.fingers):
            if not settled.touching[settled.finger_of == i].any():
                drawn = np.asarray(finger.model.pulley_radii) @ finger.joint_angles
                assert winch_angle(settled, i, 0.0) == pytest.approx(drawn / 0.0067, abs=1e-12)


def test_tendon_friction_leaves_less_for_the_tiles_farther_out():
    """With μ = 0.2 the middle tile has 0.8, the distal one 0.64 of the tension."""
    hand = changed_hand("tendon", "friction", 0.2)
    stance = on_wall()
    settled = hand.settle(stance.hands[0].hold, stance.hands[0].surface, stance.hands[0].grasp)
    i = FINGERS.index("inner_right")
    shears = settled.loads[settled.finger_of == i, 0] @ [1.0, 50.0]
    joints = drawn_by_joints(settled, i)
    expected = joints + 2.0 * (2.0 * 50.0 * (1.0 + 0.8 + 0.64) - shears.sum()) / 11500.0
    angle = hand.drive.winch_angle(joints, 50.0, shears.sum(), 1.0 + 0.8 + 0.64)
    assert angle == pytest.approx(expected / 0.0067, rel=1e-9)


def test_a_plan_tells_torque_current_and_angle_of_every_motor():
    question = ask(on_wall())
    answer = plan(question)
    for place, hand in zip(question.stance.hands, answer.hands, strict=True):
        settled = settle_hand(place, question.stance)
        for i, finger in enumerate(hand.fingers):
            torque = finger.tendon_tension * 0.0067 / 236.0 / 0.7
            assert finger.motor_torque == pytest.approx(torque, rel=1e-12)
            assert finger.motor_current == pytest.approx(torque / 0.0234 + 0.0263, rel=1e-12)
            nail = settled.hand.nail.pulley_radius * settled.nail_angles[i] / 0.0067
            expected = nail + winch_angle(settled, i, finger.tendon_tension)
            assert finger.winch_angle == pytest.approx(expected, rel=1e-9)
            assert 0.0 < finger.winch_angle < 4.0 * math.tau


def test_no_motor_of_a_plan_is_used_more_than_the_plan_says():
    for seed in range(8):
        _, answer = random_answer(seed)
        for hand in answer.hands or ():
            for finger in hand.fingers:
                used = max(finger.motor_torque / 0.0286, finger.motor_current / 1.24)
                assert used <= hand.utilisation + 1e-9


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gear_ratio", 0.0),
        ("efficiency", -0.1),
        ("efficiency", 1.01),
        ("winch_radius", 0.0),
        ("torque_constant", -1.0),
        ("maximum_torque", 0.0),
        ("maximum_current", 0.0),
        ("driver_current", 0.0),
        ("no_load_current", -0.01),
        ("no_load_current", 1.24),
    ],
)
def test_an_impossible_motor_is_refused_by_name(name, value):
    with pytest.raises(InvalidInputError) as caught:
        changed_hand("motor", name, value)
    assert caught.value.field == f"motor.{name}"
