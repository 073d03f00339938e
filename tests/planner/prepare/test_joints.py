"""What joints bear in a plan: signs by hand, a caller's limits, weights in motion, other frames."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose, wrench_transport
from hand_models.rock import Plane
from hand_models.tile import Surface
from planner.prepare import posture
from planner.question import EARTH_GRAVITY, Limits, Load, Question
from planner.robots import LinkTree, RobotFile, robosimian, robot_of
from planner.solving import plan
from tests.suite.helpers.robots import TWO_LINK, limbs_toml
from tests.suite.helpers.stances import moved, on_wall
from tests.suite.helpers.stances_with_joints import (
    at_joints,
    random_question_with_joints,
    two_link_robot,
)

G = 9.81
SEEDS = st.integers(0, 10_000)
ANGLES = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


def solved(**kwargs) -> Question:
    return Question(replace(on_wall(), joints="solve"), **kwargs)


# --- signs, by hand


def test_a_level_arm_by_hand():
    """Stretched along x, turning about +y: its weight turns it down, so the joints hold against it.

    Thigh 2 kg at 0.3 m, shank 1 kg at 0.8 m, hand 2.6 kg at 1.1 m from the hip. The hand pulls on
    the rock with 10 N straight down (−z): the rock pushes the hand up, and relieves the joints.
    """
    robot = two_link_robot()
    question = Question(at_joints(robot, {"leg": np.zeros(2)}, ("leg",), hold=Plane()))
    where = posture(question)
    hip = 2.0 * 0.3 + 1.0 * 0.8 + 2.6 * 1.1
    knee = 1.0 * 0.2 + 2.6 * 0.5
    np.testing.assert_allclose(where.joints["leg"].gravity, [-hip * G, -knee * G], atol=1e-9)
    down = np.array([0.0, 0.0, -10.0, 0.0, 0.0, 0.0])
    # w on the rock at x = 1.1 m: its moment about +y is −x w_z
    expected = [-hip * G + 1.1 * 10.0, -knee * G + 0.5 * 10.0]
    np.testing.assert_allclose(where.joints["leg"].torques(down), expected, atol=1e-9)
    pushing = np.array([0.0, 0.0, 0.0, 0.0, 7.0, 0.0])
    np.testing.assert_allclose(
        where.joints["leg"].torques(pushing), [-hip * G + 7.0, -knee * G + 7.0], atol=1e-9
    )


def test_a_hanging_arm_bears_nothing_and_its_pull_on_the_rock_nothing_either():
    """Straight down, all weights and a pull along the arm pass through both axes."""
    robot = two_link_robot()
    down = {"leg": np.array([math.pi / 2, 0.0])}
    where = posture(Question(at_joints(robot, down, ("leg",), hold=Plane())))
    np.testing.assert_allclose(where.joints["leg"].gravity, np.zeros(2), atol=1e-9)
    along = np.array([50.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(where.joints["leg"].torques(along), np.zeros(2), atol=1e-9)
    # across it, along −x of the body: H's z points there when the arm hangs down
    across = np.array([0.0, 0.0, 20.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(
        where.joints["leg"].torques(across), [-20.0 * 1.1, -20.0 * 0.5], atol=1e-9
    )


@given(ANGLES, st.tuples(*[st.floats(-50.0, 50.0)] * 6))
def test_torques_are_the_power_of_weights_and_of_the_hand(angles, wrench):
    """By virtual work with finite differences: τ · dq = dE + w · (dx, dθ) of H."""
    robot = two_link_robot()
    at = np.array(angles)
    stance = at_joints(robot, {"leg": at}, ("leg",), hold=Plane())
    torques = posture(Question(stance)).joints["leg"].torques(np.array(wrench))
    step = 1e-6
    for i in range(2):
        ahead, behind = (at + sign * step * np.eye(2)[i] for sign in (1.0, -1.0))
        energy = [robot.mass * G * robot.com_at({"leg": q})[2] for q in (ahead, behind)]
        there, here = (robot.hand_poses({"leg": q})["leg"] for q in (ahead, behind))
        middle = robot.hand_poses({"leg": at})["leg"].rotation
        slid = middle.T @ (there.position - here.position)
        turned = middle.T @ Rotation.from_matrix(there.rotation @ here.rotation.T).as_rotvec()
        work = energy[0] - energy[1] + np.dot(wrench, np.concatenate([slid, turned]))
        assert torques[i] == pytest.approx(work / (2.0 * step), abs=1e-5)


def test_a_plan_of_one_arm_balances_its_trunk_by_hand():
    """The arm is all that holds: the body wrench is the whole weight, and so is the hand's force.

    Trunk 10 kg at (0, 0, 0.1), head 0.5 kg on its slide at zero, (0, 0, 0.4) m.
    """
    robot = two_link_robot(torque="1e5")
    stance = at_joints(robot, {"leg": np.array([math.pi / 2, 0.0])}, ("leg",), hold=Plane())
    question = Question(stance)
    mass = 10.0 + 0.5 + 2.0 + 1.0 + 2.6
    own = posture(question).weights.body_wrench
    lever = 0.5 * (2.0 + 1.0 + 2.6)
    np.testing.assert_allclose(own, [0, 0, mass * G, 0, -lever * G, 0], atol=1e-9)
    assert robot.mass == pytest.approx(mass)


# --- the same by another way


@pytest.mark.parametrize("seed", range(3))
def test_moments_about_each_axis_are_the_jacobians_and_newton_euler(seed):
    question = random_question_with_joints(seed)
    rng = np.random.default_rng(seed)
    where, robot = posture(question), question.stance.robot
    body = question.stance.body.rotation.T
    wrenches = {limb: rng.normal(size=6) * 100.0 for limb in robot.limbs}
    acceleration = [question.load.acceleration, question.load.angular_acceleration]
    own = LinkTree(robot).hold_up(
        where.angles,
        wrenches,
        body @ question.stance.gravity,
        (np.array(acceleration) @ body.T).ravel(),
    )
    np.testing.assert_allclose(own.body_wrench, where.weights.body_wrench, rtol=1e-9, atol=1e-7)
    for limb in robot.limbs:
        claimed = where.joints[limb].torques(wrenches[limb])
        np.testing.assert_allclose(own.torques[limb], claimed, rtol=1e-9, atol=1e-7)
        pose = robot.hand_poses(where.angles)[limb]
        np.testing.assert_allclose(own.hands[limb].position, pose.position, atol=1e-12)
        np.testing.assert_allclose(own.hands[limb].rotation, pose.rotation, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_acceleration_is_the_rate_of_momentum(seed):
    """The body moves as a rigid one from rest: m v and its moment of momentum, differenced.

    Places of the masses after a small time t are those of B moved by a t²/2 and turned by α t²/2.
    """
    question = random_question_with_joints(seed)
    robot = question.stance.robot
    where = posture(question)
    tree = LinkTree(robot)
    still = posture(replace(question, load=Load()))
    into_body = question.stance.body.rotation.T
    linear = into_body @ np.array(question.load.acceleration)
    angular = into_body @ np.array(question.load.angular_acceleration)
    names = {
        name: float(angle)
        for limb in robot.limbs
        for name, angle in zip(robot.chains[limb].joints, where.angles[limb], strict=True)
    }
    places = tree.places(names)
    rate = np.zeros(6)
    step = 1e-3
    for link in tree.links:
        rate += momentum_rate(link.mass, places[link.name].apply(link.com), linear, angular, step)
        turn = places[link.name].rotation
        rate[3:] += turn @ link.inertia @ turn.T @ angular
    for mount in robot.description.mounts.values():
        hand = (places[mount.link] @ mount.pose).apply(np.array(mount.hand_com))
        rate += momentum_rate(robot.hand.mass, hand, linear, angular, step)
    np.testing.assert_allclose(
        where.weights.body_wrench - still.weights.body_wrench, rate, rtol=1e-4, atol=1e-3
    )


def momentum_rate(mass, place, linear, angular, step):
    """Force and moment about B's origin that make a point move with its body, by differences."""

    def at(t):
        turn = Rotation.from_rotvec(0.5 * angular * t**2).as_matrix()
        return 0.5 * linear * t**2 + turn @ place

    force = mass * (at(step) - 2.0 * at(0.0) + at(-step)) / step**2
    return np.concatenate([force, np.cross(place, force)])


def test_falling_freely_nothing_bears_anything():
    question = replace(random_question_with_joints(3), limits=Limits())
    fall = Load(acceleration=tuple(question.stance.gravity))
    where = posture(replace(question, load=fall))
    np.testing.assert_allclose(where.weights.body_wrench, np.zeros(6), atol=1e-9)
    for joints in where.joints.values():
        np.testing.assert_allclose(joints.gravity, np.zeros(7), atol=1e-9)


def test_a_body_wrench_that_is_given_leaves_the_torques_those_of_the_load():
    question = random_question_with_joints(4)
    given_wrench, moving = posture(replace(question, body_wrench=np.zeros(6))), posture(question)
    still = posture(replace(question, load=Load()))
    for limb, joints in given_wrench.joints.items():
        np.testing.assert_array_equal(joints.gravity, moving.joints[limb].gravity)
        assert np.abs(joints.gravity - still.joints[limb].gravity).max() > 1e-3


@pytest.mark.parametrize("part", [1.62 / 9.81, 3.71 / 9.81, 2.0])
def test_torques_and_the_body_wrench_scale_with_gravity(part):
    """Moon, Mars and twice the Earth, the same stance."""
    earth = random_question_with_joints(5)
    earth = replace(
        earth, load=Load(), stance=replace(earth.stance, gravity=np.array(EARTH_GRAVITY))
    )
    other = replace(earth, stance=replace(earth.stance, gravity=part * np.array(EARTH_GRAVITY)))
    here, there = posture(earth), posture(other)
    np.testing.assert_allclose(
        there.weights.body_wrench, part * here.weights.body_wrench, rtol=1e-12
    )
    for limb, joints in here.joints.items():
        np.testing.assert_allclose(
            there.joints[limb].gravity, part * joints.gravity, rtol=1e-9, atol=1e-12
        )


# --- plans


@pytest.mark.parametrize("seed", range(3))
def test_plans_with_joints_pass_the_check(seed):
    answer = plan(random_question_with_joints(seed))
    assert answer.status in ("optimal", "overloaded", "infeasible")
    assert answer.verified
    if answer.hands is not None:
        shares = [
            np.abs(answer.joint_torque[limb]) / limits
            for limb, limits in _limits(random_question_with_joints(seed)).items()
        ]
        assert answer.utilisation >= np.max(shares) - 1e-6


def _limits(question: Question) -> dict[str, np.ndarray]:
    own, robot = question.limits.joint_torque, question.stance.robot
    if own is None:
        return {limb: chain.torque_limits for limb, chain in robot.chains.items()}
    if isinstance(own, float):
        return {limb: np.full(7, own) for limb in robot.limbs}
    return {limb: np.array(own.get(limb, robot.chains[limb].torque_limits)) for limb in robot.limbs}


def test_the_plan_is_the_same_wherever_the_world_is_turned():
    question = solved(
        load=Load(acceleration=(0.4, -0.2, 0.3), angular_acceleration=(0.5, 0.1, -0.3))
    )
    answer = plan(question)
    turn = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    by = Pose(np.array([3.0, -2.0, 5.0]), turn)
    load = Load(
        acceleration=tuple(turn @ question.load.acceleration),
        angular_acceleration=tuple(turn @ question.load.angular_acceleration),
    )
    # the same angles: inverse kinematics may end elsewhere by rounding
    held = replace(moved(question.stance, by), joints=dict(answer.joints))
    there = plan(replace(question, stance=held, load=load))
    here = plan(replace(question, stance=replace(question.stance, joints=dict(answer.joints))))
    assert there.utilisation == pytest.approx(here.utilisation, abs=1e-6)
    np.testing.assert_allclose(there.body_wrench, here.body_wrench, atol=1e-6)
    for limb, torques in here.joint_torque.items():
        np.testing.assert_allclose(there.joint_torque[limb], torques, atol=0.02)


def test_a_body_frame_elsewhere_in_the_trunk_changes_no_torque():
    """B is a frame fixed to the trunk, moved and turned; the body wrench is the same, in that B."""
    angles = {"leg": np.array([0.4, 0.7])}
    load = Load(acceleration=(0.3, -0.5, 0.2), angular_acceleration=(0.0, 0.0, 0.0))
    xyz, rpy = np.array([0.1, 0.2, -0.3]), np.array([0.2, 0.5, -0.9])
    trunk = Pose(xyz, Rotation.from_euler("xyz", rpy).as_matrix())
    frame = trunk.inverse()
    fixed = (
        '<link name="frame"/><joint name="fix" type="fixed"><parent link="frame"/>'
        f'<child link="trunk"/><origin xyz="{" ".join(map(str, xyz))}" '
        f'rpy="{" ".join(map(str, rpy))}"/></joint></robot>'
    )
    urdf = TWO_LINK.replace("</robot>", fixed)
    toml = limbs_toml("arm", {"leg": "foot"}).replace('body = "trunk"', 'body = "frame"')
    robot = two_link_robot()
    turned = robot_of(RobotFile("arm", toml, urdf))
    here = posture(Question(at_joints(robot, angles, ("leg",), hold=Plane()), load=load))
    stance = at_joints(turned, angles, ("leg",), hold=Plane(), body=frame)
    there = posture(Question(stance, load=load))
    np.testing.assert_allclose(there.joints["leg"].gravity, here.joints["leg"].gravity, atol=1e-9)
    np.testing.assert_allclose(
        wrench_transport(frame) @ there.weights.body_wrench, here.weights.body_wrench, atol=1e-9
    )
    tree = LinkTree(turned)
    own = tree.hold_up(
        there.angles,
        {},
        frame.rotation.T @ np.array(EARTH_GRAVITY),
        np.concatenate([frame.rotation.T @ np.array(load.acceleration), np.zeros(3)]),
    )
    np.testing.assert_allclose(own.body_wrench, there.weights.body_wrench, atol=1e-9)
    np.testing.assert_allclose(own.torques["leg"], there.joints["leg"].gravity, atol=1e-9)


@pytest.mark.parametrize(
    "limit",
    [
        60.0,
        {"rear_right": 60.0, "front_left": 60.0},
        {"rear_left": (90.0, 80.0, 70.0, 60.0, 50.0, 40.0, 30.0)},
    ],
    ids=["all", "by limb", "by joint"],
)
def test_limits_of_the_caller_are_honoured(limit):
    free = plan(solved())
    question = solved(limits=Limits(joint_torque=limit))
    answer = plan(question)
    assert answer.verified
    assert answer.utilisation >= free.utilisation - 1e-6
    robot = robosimian()
    for limb, torques in answer.joint_torque.items():
        given_one = (
            limit.get(limb, robot.chains[limb].torque_limits) if isinstance(limit, dict) else limit
        )
        share = np.abs(torques) / np.array(given_one)
        assert share.max() <= answer.utilisation + 1e-6


def test_torques_give_way_to_a_limit_that_other_loads_can_meet():
    """A limit just under what one limb bears is met by shifting load, at more utilisation."""
    free = plan(solved())
    limb = max(free.joint_torque, key=lambda name: np.abs(free.joint_torque[name]).max())
    bears = float(np.abs(free.joint_torque[limb]).max())
    held = solved(limits=Limits(joint_torque={limb: 0.9 * bears}))
    answer = plan(held)
    assert answer.status == "optimal"
    assert float(np.abs(answer.joint_torque[limb]).max()) <= 0.9 * bears + 1e-3


def test_a_limb_without_a_hand_counts():
    """A free limb stretched out level bears its own weight, whatever the hands do."""
    robot = robosimian()
    rock = Surface.from_values({"shear_limit": 95.0})
    stance = on_wall(surface=rock, limbs=("rear_right", "rear_left", "front_left"))
    angles = plan(Question(replace(stance, joints="solve"))).joints
    assert np.array_equal(angles["front_right"], np.zeros(7))
    held = replace(stance, joints=dict(angles))
    free = plan(Question(held))
    bears = float(np.abs(free.joint_torque["front_right"]).max())
    assert bears > 10.0
    weak = plan(Question(held, limits=Limits(joint_torque={"front_right": 0.5 * bears})))
    assert weak.utilisation == pytest.approx(2.0, abs=1e-6)
    assert weak.status == "overloaded"
    assert weak.limiting.limb == "front_right"
    assert weak.limiting.joint in robot.chains["front_right"].joints
    assert weak.verified
    assert free.status == "optimal"


def test_given_angles_that_do_not_reach_the_hands_are_refused():
    stance = on_wall()
    with pytest.raises(InvalidInputError) as found:
        plan(Question(replace(stance, joints={limb: np.zeros(7) for limb in robosimian().limbs})))
    assert found.value.field == "stance.hands[0].pose"
