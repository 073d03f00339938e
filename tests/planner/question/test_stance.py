"""Stances, loads and limits: frames, signs, and errors that name the field."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose
from hand_models.rock import Cylinder
from planner.prepare import hand_space, settle_hand
from planner.question import HandOnHold, Limits, Load, Question, Stance
from planner.solving import plan
from tests.suite.helpers.stances import PALM_TO_WALL, ROCK, ask, on_wall, wall

NAN, INF = float("nan"), float("inf")
UPRIGHT = replace(on_wall(), body=Pose(np.array([1.0, 2.0, 3.0]), np.eye(3)))


def from_w(rotvec_quaternion, position=(0.0, 0.0, 0.0)):
    return Pose.from_quaternion(position, rotvec_quaternion)


# Body wrenches, worked by hand ------------------------------------------------------------------


def test_upright_body_is_held_up_at_its_centre_of_mass():
    wrench = Load(mass=10.0, com=(0.1, 0.2, 0.3)).body_wrench(UPRIGHT)
    # (0.1, 0.2, 0.3) × (0, 0, 98.1)
    np.testing.assert_allclose(wrench, [0.0, 0.0, 98.1, 19.62, -9.81, 0.0], atol=1e-12)


def test_on_a_wall_the_weight_is_carried_along_the_bodys_x():
    wrench = Load(mass=100.0, com=(0.0, 0.0, -0.1)).body_wrench(on_wall())
    # (0, 0, −0.1) × (981, 0, 0)
    np.testing.assert_allclose(wrench, [981.0, 0.0, 0.0, 0.0, -98.1, 0.0], atol=1e-9)


def test_on_an_overhang_the_rock_must_pull_the_body_toward_it():
    angle = math.radians(30.0)
    wrench = Load(mass=100.0, com=(0.0, 0.0, 0.0)).body_wrench(on_wall(overhang=angle))
    # z of B points away from the rock and here downward, against the 981 N that hold the body up
    expected = [981.0 * math.cos(angle), 0.0, -981.0 * math.sin(angle), 0.0, 0.0, 0.0]
    np.testing.assert_allclose(wrench, expected, atol=1e-9)


def test_acceleration_adds_to_the_weight_in_w():
    load = Load(mass=2.0, com=(0.0, 0.0, 0.0), acceleration=(1.0, -3.0, 0.19))
    np.testing.assert_allclose(load.body_wrench(UPRIGHT)[:3], [2.0, -6.0, 20.0], atol=1e-12)
    quarter = replace(UPRIGHT, body=from_w([0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)]))
    # x of this body is y of W, its y is −x of W
    np.testing.assert_allclose(load.body_wrench(quarter)[:3], [-6.0, -2.0, 20.0], atol=1e-12)


def test_free_fall_needs_no_wrench():
    load = Load(acceleration=(0.0, 0.0, -9.81))
    np.testing.assert_allclose(load.body_wrench(UPRIGHT), np.zeros(6), atol=1e-12)


def test_gravity_of_the_stance_counts():
    moon = replace(UPRIGHT, gravity=np.array([0.0, 0.0, -1.62]))
    np.testing.assert_allclose(Load(mass=10.0).body_wrench(moon)[2], 16.2)


def test_default_load_is_the_robot_with_its_hands():
    wrench = Question(UPRIGHT).needed_wrench()
    weight = (99.888 + 4 * 2.6) * 9.81
    com = np.array([0.00033, -0.00082, -0.13289])
    expected = [0.0, 0.0, weight, com[1] * weight, -com[0] * weight, 0.0]
    np.testing.assert_allclose(wrench, expected, rtol=1e-12)


def test_a_body_wrench_that_is_given_is_taken_as_it_is():
    wrench = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    question = Question(UPRIGHT, body_wrench=wrench, load=Load(mass=5.0))
    np.testing.assert_array_equal(question.needed_wrench(), wrench)


def test_the_balance_is_about_the_bodys_origin():
    """A body frame elsewhere on the robot asks for another wrench and gets the same plan."""
    stance = on_wall()
    by = Pose(np.array([0.1, -0.05, 0.02]), wall(0.3) @ wall().T)
    other = replace(stance, body=stance.body @ by)
    com = np.array([0.02, 0.03, -0.1])
    there = tuple(by.inverse().apply(com))
    one = plan(ask(stance, load=Load(mass=100.0, com=tuple(com))))
    same = plan(ask(other, load=Load(mass=100.0, com=there)))
    assert same.utilisation == pytest.approx(one.utilisation, rel=1e-6)
    assert not np.allclose(same.body_wrench, one.body_wrench, atol=1.0)


# Holds ------------------------------------------------------------------------------------------


def test_a_hold_may_be_placed_in_w_or_in_h():
    hand = on_wall().hands[0]
    in_hand = Pose(np.array([0.03, 0.0, 0.004]), np.eye(3))
    by_hand = replace(hand, hold_in_hand=in_hand)
    by_world = replace(hand, hold_pose=hand.pose @ in_hand)
    for placed in (by_hand.placed_hold(), by_world.placed_hold()):
        np.testing.assert_allclose(placed.position, in_hand.position, atol=1e-12)
        np.testing.assert_allclose(placed.rotation, np.eye(3), atol=1e-12)
    settled = [settle_hand(each, on_wall()) for each in (by_hand, by_world)]
    assert [each.seating.rule for each in settled] == ["given", "given"]
    np.testing.assert_allclose(settled[0].loads, settled[1].loads, atol=1e-6)


def test_a_hold_that_is_not_placed_is_seated():
    hand = on_wall().hands[0]
    assert hand.placed_hold() is None
    assert settle_hand(hand, on_wall()).seating.rule == "pinch"


def test_hand_space_is_the_set_that_the_plan_used():
    stance = on_wall()
    for hand in plan(ask(stance)).hands:
        _, space = hand_space(stance, hand.limb)
        np.testing.assert_array_equal(space.generators, hand.space.generators)
        assert space.rows == hand.space.rows


# Errors -----------------------------------------------------------------------------------------


def first_hand(**changes) -> HandOnHold:
    return replace(on_wall().hands[0], **changes)


def at(*position) -> Pose:
    return Pose(np.array(position, dtype=float), PALM_TO_WALL)


def turned(rotation) -> Pose:
    return Pose(np.zeros(3), np.asarray(rotation, dtype=float))


WRONG = {
    "hands": lambda: Stance((), on_wall().body),
    "hands[1].limb": lambda: Stance(
        (first_hand(), first_hand(limb="tail")),
        on_wall().body,
    ),
    "hands[2].limb": lambda: replace(on_wall(), hands=(*on_wall().hands[:2], on_wall().hands[0])),
    "gravity": lambda: replace(on_wall(), gravity=np.array([0.0, NAN, 0.0])),
    "body.position": lambda: replace(on_wall(), body=at(0.0, INF, 0.0)),
    "body.orientation": lambda: replace(on_wall(), body=turned(2.0 * np.eye(3))),
    "pose.position": lambda: first_hand(pose=at(1e12, 0.0, 0.0)),
    "pose.orientation": lambda: first_hand(pose=turned(np.diag([1.0, 1.0, -1.0]))),
    "hold": lambda: first_hand(hold_pose=at(0, 0, 0), hold_in_hand=at(0, 0, 0)),
    "hold.pose.position": lambda: first_hand(hold_pose=at(NAN, 0.0, 0.0)),
    "hold.pose_in_hand.orientation": lambda: first_hand(hold_in_hand=turned(np.full((3, 3), NAN))),
    "body_wrench": lambda: Question(on_wall(), body_wrench=[0.0, 0.0, INF, 0.0, 0.0, 0.0]),
    "utilisation": lambda: Limits(utilisation=1.5),
    "tendon_tension": lambda: Limits(tendon_tension=0.0),
    "limb": lambda: hand_space(on_wall(limbs=("front_left",)), "rear_left"),
    "load.mass": lambda: plan(ask(on_wall(), load=Load(mass=0.0))),
    "load.com": lambda: plan(ask(on_wall(), load=Load(com=(0.0, NAN, 0.0)))),
    "load.acceleration": lambda: plan(ask(on_wall(), load=Load(acceleration=(0.0, 0.0, -INF)))),
    "stance.hands[2].hold": lambda: plan(
        ask(
            replace(
                on_wall(),
                hands=(
                    *on_wall().hands[:2],
                    replace(
                        on_wall().hands[2], hold_in_hand=Pose(np.array([0, 0, -0.02]), np.eye(3))
                    ),
                ),
            )
        )
    ),
}


def test_an_error_names_the_field():
    for field, make in WRONG.items():
        with pytest.raises(InvalidInputError) as error:
            make()
        assert error.value.field == field
        assert "\n" not in str(error.value)


def test_a_body_wrench_has_six_numbers():
    for wrench in [[1.0, 2.0, 3.0], np.zeros((6, 1)), ["a"] * 6]:
        with pytest.raises(InvalidInputError, match="6 numbers"):
            Question(on_wall(), body_wrench=wrench)


def test_utilisation_caps_are_in_the_unit_interval():
    for value in [0.0, -0.1, 1.0001, NAN, INF]:
        with pytest.raises(InvalidInputError, match="above 0 and at most 1"):
            Limits(utilisation=value)


def test_tension_caps_are_above_zero():
    for value in [0.0, -5.0, NAN, INF]:
        with pytest.raises(InvalidInputError, match="above 0 N"):
            Limits(tendon_tension=value)


def test_unknown_limbs_are_told_the_known_ones():
    with pytest.raises(InvalidInputError, match="front_right, rear_right, rear_left, front_left"):
        Stance((HandOnHold("nose", at(0, 0, 0), Cylinder(0.3), ROCK),), on_wall().body)


def test_a_hand_given_in_millimetres_is_told_so():
    stance = on_wall()
    hand = stance.hands[1]
    far = replace(hand, pose=Pose(1e3 * hand.pose.position, hand.pose.rotation))
    with pytest.raises(InvalidInputError, match="is the position in W, in metres") as caught:
        replace(stance, hands=(stance.hands[0], far))
    assert caught.value.field == "hands[1].pose.position"


# Seats --------------------------------------------------------------------------------------------


def test_hands_that_look_for_their_seats_stand_beside_those_that_do_not():
    stance = on_wall()
    hands = list(stance.hands)
    down = (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    hands[0] = replace(hands[0], seat="best")
    hands[2] = replace(hands[2], seat="best", seat_direction=down)
    asked = replace(stance, hands=tuple(hands))
    answer = plan(ask(asked))
    assert answer.verified
    assert [hand.seating.rule for hand in answer.hands] == ["best", "pinch", "best", "pinch"]
    for hand, part in zip(asked.hands, answer.hands, strict=True):
        assert settle_hand(hand, asked).seating == part.seating


def test_impossible_seats_are_refused():
    for change, field, told in [
        ({"seat": "worst"}, "seat", "known are rest, best"),
        ({"seat": "best", "hold_in_hand": Pose.identity()}, "seat", "cannot be combined"),
        ({"seat_direction": np.ones(6)}, "seat_direction", "requires the seat 'best'"),
        ({"seat": "best", "seat_direction": np.zeros(6)}, "seat_direction", "not zero"),
        ({"seat": "best", "seat_direction": [NAN] * 6}, "seat_direction", "finite"),
        ({"seat": "best", "seat_direction": [1.0]}, "seat_direction", "6"),
    ]:
        with pytest.raises(InvalidInputError, match=told) as caught:
            replace(on_wall().hands[0], **change)
        assert caught.value.field == field
