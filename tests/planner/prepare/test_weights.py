"""What a robot weighs and carries: masses alone, payloads, and hands a little off their joints."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from planner.prepare import posture, prepare_stance
from planner.question import Load, Question, Stance
from planner.robots import Payload, Robot, check_carrier, robosimian
from planner.solving import KnownStance, plan
from service.answering import question
from service.commands.stances import read_request
from tests.suite.helpers.stances_with_joints import (
    at_joints,
    random_question_with_joints,
    two_link_robot,
)

LINKS = ("torso", "limb1_link2", "limb3_link7", "limb4_link5")


def hand_frame(robot: Robot, limb: str):
    return robot.model.frames[robot.chains[limb].frame]


def heavier(robot: Robot, payloads: tuple[Payload, ...]):
    """Pinocchio's model of the robot with its payloads as parts of its links."""
    model = robot.model.copy()
    for each in payloads:
        if each.limb is not None:
            frame = hand_frame(robot, each.limb)
        else:
            frame = model.frames[model.getFrameId(each.link, pin.FrameType.BODY)]
        mass = pin.Inertia(each.mass, np.array(each.com), np.zeros((3, 3)))
        model.appendBodyToJoint(frame.parentJoint, mass, frame.placement)
    return model


def newton_euler(asked: Question, payloads: tuple[Payload, ...], forces=None):
    """Body wrench and torques of a robot whose links are heavier, in one pass."""
    robot, where = asked.stance.robot, posture(asked)
    model = heavier(robot, payloads)
    turn, load = asked.stance.body.rotation.T, asked.load
    acceleration = np.concatenate([turn @ load.acceleration, turn @ load.angular_acceleration])
    rates = robot.root_acceleration(turn @ asked.stance.gravity, acceleration)
    q = robot.configuration(where.angles)
    none = pin.StdVec_Force()
    none.extend([pin.Force.Zero() for _ in range(model.njoints)])
    forces = none if forces is None else forces
    torque = pin.rnea(model, model.createData(), q, np.zeros(model.nv), rates, forces)
    base = robot.root.inverse()
    rotation = base.rotation
    wrench = np.concatenate([rotation @ torque[:3], rotation @ torque[3:6]])
    wrench[3:] += np.cross(base.position, wrench[:3])
    return wrench, {
        limb: chain.coupling.T @ torque[chain.columns] for limb, chain in robot.chains.items()
    }


def some_payloads(seed: int) -> tuple[Payload, ...]:
    rng = np.random.default_rng(seed)
    carriers = [{"link": LINKS[seed % 4]}, {"limb": "front_left"}, {"limb": "rear_right"}]
    return tuple(
        Payload(rng.uniform(0.1, 9.0), com=tuple(rng.uniform(-0.2, 0.2, 3)), **carrier)
        for carrier in carriers
    )


@pytest.mark.parametrize("seed", range(3))
def test_payloads_are_parts_of_their_links(seed: int):
    asked = random_question_with_joints(seed)
    payloads = some_payloads(seed)
    asked = replace(asked, load=structs.replace(asked.load, mass=None, com=None, payloads=payloads))
    wrench, torques = newton_euler(asked, payloads)
    where = posture(asked)
    np.testing.assert_allclose(asked.needed_wrench(where.weights), wrench, rtol=1e-9, atol=1e-9)
    for limb, torque in torques.items():
        np.testing.assert_allclose(where.joints[limb].gravity, torque, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_a_mass_alone_is_weighed_at_the_postures_centre_of_mass(seed: int):
    asked = random_question_with_joints(seed)
    asked = replace(asked, load=structs.replace(asked.load, mass=None, com=None))
    robot = asked.stance.robot
    own = prepare_stance(asked).wrench
    same = replace(asked, load=structs.replace(asked.load, mass=robot.mass))
    np.testing.assert_array_equal(prepare_stance(same).wrench, own)

    rest = replace(asked, load=Load())
    twice = replace(rest, load=Load(mass=2.0 * robot.mass))
    at = robot.com_at(posture(asked).angles)
    there = replace(rest, load=Load(mass=2.0 * robot.mass, com=tuple(at)))
    weight = prepare_stance(rest).wrench
    np.testing.assert_allclose(prepare_stance(twice).wrench, 2.0 * weight, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(prepare_stance(there).wrench, 2.0 * weight, rtol=1e-9, atol=1e-7)


def test_the_robots_own_mass_leaves_the_plan_as_it_is():
    asked = random_question_with_joints(3)
    asked = replace(asked, load=Load(), want=frozenset({"load_factor"}))
    one = plan(asked)
    other = plan(replace(asked, load=Load(mass=asked.stance.robot.mass)))
    assert (other.status, other.utilisation, other.load_factor) == (
        one.status,
        one.utilisation,
        one.load_factor,
    )


def test_a_payload_in_a_hand_needs_no_joints():
    """It is where the hand is: 5 kg at H of a hand 0.5 m ahead of B, worked by hand."""
    asked = random_question_with_joints(2)
    hand = asked.stance.hands[0]
    stance = replace(asked.stance, joints=None)
    plain = Question(stance)
    carried = Question(stance, load=Load(payloads=(Payload(5.0, limb=hand.limb),)))
    place = stance.body.inverse().apply(hand.pose.position)
    force = 5.0 * stance.body.rotation.T @ -stance.gravity
    more = carried.needed_wrench() - plain.needed_wrench()
    np.testing.assert_allclose(more, [*force, *np.cross(place, force)], atol=1e-9)
    on_body = Question(stance, load=Load(payloads=(Payload(5.0, link="torso", com=(0.1, 0, 0)),)))
    more = on_body.needed_wrench() - plain.needed_wrench()
    np.testing.assert_allclose(more, [*force, *np.cross([0.1, 0, 0], force)], atol=1e-9)


BAD = {
    "payloads[0].limb": Payload(1.0, limb="fifth"),
    "payloads[0].link": Payload(1.0, link="limb9_link1"),
}


@pytest.mark.parametrize("joints", [True, False])
@pytest.mark.parametrize("field", BAD)
def test_payloads_name_what_the_robot_has(field: str, joints: bool):
    asked = random_question_with_joints(1)
    stance = asked.stance if joints else replace(asked.stance, joints=None)
    with pytest.raises(InvalidInputError, match="known are") as raised:
        prepare_stance(Question(stance, load=Load(payloads=(BAD[field],))))
    assert raised.value.field == f"load.{field}"


def test_a_payload_on_a_link_needs_joints():
    asked = random_question_with_joints(1)
    load = Load(payloads=(Payload(1.0, link="limb2_link4"),))
    with pytest.raises(InvalidInputError, match=r"stance\.joints") as raised:
        prepare_stance(Question(replace(asked.stance, joints=None), load=load))
    assert raised.value.field == "load.payloads[0].link"


@pytest.mark.parametrize(
    ("numbers", "field"),
    [
        ({"mass": 0.0, "limb": "front_left"}, "mass"),
        ({"mass": math.nan, "limb": "front_left"}, "mass"),
        ({"mass": 1.0}, "link"),
        ({"mass": 1.0, "link": "torso", "limb": "front_left"}, "link"),
        ({"mass": 1.0, "limb": "front_left", "com": (0.0, math.inf, 0.0)}, "com"),
        ({"mass": 1.0, "limb": "front_left", "com": (0.0, 0.0)}, "com"),
    ],
)
def test_a_payload_is_a_mass_on_one_link(numbers, field: str):
    with pytest.raises(InvalidInputError) as raised:
        Payload(**numbers)
    assert raised.value.field == field


# --- one pose of a hand


def slightly_off(seed: int) -> Question:
    """A stance whose solved joints put its hand millimetres and milliradians off."""
    rng = np.random.default_rng(seed)
    robot = two_link_robot(torque="1e5")
    stance = at_joints(robot, {"leg": np.array([0.6 + 0.1 * seed, 0.4])}, ("leg",))
    (hand,) = stance.hands
    by = Pose(
        np.array([0.0, rng.uniform(0.002, 0.006), 0.0]),
        Rotation.from_rotvec([rng.uniform(0.005, 0.02), 0.0, 0.0]).as_matrix(),
    )
    moved = replace(hand, pose=hand.pose @ by)
    return Question(Stance((moved,), stance.body, stance.gravity, robot, "solve"))


def pushed(asked: Question, limb: str, pose: Pose, wrench: np.ndarray, forces=None):
    """Forces on Pinocchio's joints, with a hand's wrench on the rock at its pose in B."""
    robot, where = asked.stance.robot, posture(asked)
    model, data = robot.model, robot.data
    pin.forwardKinematics(model, data, robot.configuration(where.angles))
    in_root = robot.root @ pose
    joint = hand_frame(robot, limb).parentJoint
    at = data.oMi[joint].inverse() * pin.SE3(in_root.rotation, in_root.position)
    if forces is None:
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero() for _ in range(model.njoints)])
    forces[joint] = at.act(pin.Force(-wrench))
    return forces


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_is_in_balance_where_a_hand_is_off_its_joints(seed: int):
    """The rock's forces at the hand's pose leave neither the base nor the joints anything over."""
    asked = slightly_off(seed)
    where = posture(asked)
    off, turned = where.off["leg"]
    assert 1e-3 < off < 0.01
    assert turned > 1e-3
    (hand,) = asked.stance.hands
    pose = asked.stance.body.inverse() @ hand.pose
    # the wrench at which the base is in balance with the pose that the stance has
    carry = np.zeros((6, 6))
    carry[:3, :3] = carry[3:, 3:] = pose.rotation
    carry[3:, :3] = np.cross(pose.position, pose.rotation, axisb=0, axisc=0)
    wrench = np.linalg.solve(carry, -where.weights.body_wrench)
    base, torques = newton_euler(asked, (), pushed(asked, "leg", pose, wrench))
    np.testing.assert_allclose(base, np.zeros(6), atol=1e-9)
    np.testing.assert_allclose(where.joints["leg"].torques(wrench), torques["leg"], atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_plans_with_hands_off_their_joints_balance_all_links(seed: int):
    """The bundled stance with joints, its hands up to 7 mm and 0.026 rad off these."""
    asked = question(read_request("wall-300-joints"))
    rng = np.random.default_rng(seed)
    hands = tuple(
        replace(
            hand,
            pose=hand.pose
            @ Pose(
                rng.uniform(-0.004, 0.004, 3),
                Rotation.from_rotvec(rng.uniform(-0.015, 0.015, 3)).as_matrix(),
            ),
        )
        for hand in asked.stance.hands
    )
    asked = replace(asked, stance=replace(asked.stance, hands=hands))
    answer = plan(asked)
    assert answer.verified
    body = asked.stance.body.inverse()
    forces = None
    for hand, part in zip(hands, answer.hands, strict=True):
        forces = pushed(asked, hand.limb, body @ hand.pose, part.wrench, forces)
    base, torques = newton_euler(asked, (), forces)
    np.testing.assert_allclose(base, np.zeros(6), atol=1e-6)
    for limb, torque in answer.joint_torque.items():
        np.testing.assert_allclose(torque, torques[limb], atol=1e-9)


def test_a_known_stance_keeps_what_its_limbs_carry():
    asked = random_question_with_joints(5)
    load = Load(acceleration=(0.3, -0.2, 0.1), payloads=(Payload(4.0, limb="front_left"),))
    asked = replace(asked, load=load)
    one, other = prepare_stance(asked), KnownStance(asked).prepared
    turned = other.turned(0.7 * one.wrench)
    for limb, joints in one.where.joints.items():
        np.testing.assert_array_equal(turned.where.joints[limb].gravity, joints.gravity)


def test_the_bundled_robot_has_the_links_that_payloads_name():
    robot = robosimian()
    for link in LINKS:
        check_carrier(robot, Payload(1.0, link=link))


def test_a_load_that_does_not_fit_the_posture_is_told():
    asked = question(read_request("wall-300-joints"))
    robot, com = asked.stance.robot, prepare_stance(asked).where.weights.com
    for load, kinds in (
        (Load(), []),
        (Load(mass=robot.mass - 5.0), []),
        (Load(mass=robot.limb_mass + 0.1), []),
        (Load(mass=robot.limb_mass - 0.1), ["mass_below_limbs"]),
        (Load(mass=30.0), ["mass_below_limbs"]),
        (Load(com=(com[0] + 0.04, com[1], com[2])), []),
        (Load(com=(com[0] + 0.155, com[1], com[2])), ["com_off_posture"]),
    ):
        answer = plan(replace(asked, load=load))
        found = [each for each in answer.findings if each.field.startswith("load")]
        assert [each.kind for each in found] == kinds
        assert all(each.message in answer.warnings for each in found)
    # without joints, and beside a body wrench, nothing is known of it, or asked
    bare = replace(asked, stance=replace(asked.stance, joints=None))
    found = plan(replace(bare, load=Load(mass=60.0))).findings
    assert not [each for each in found if each.field.startswith("load")]
