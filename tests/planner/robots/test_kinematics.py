"""Kinematics and statics by joint angles, against figures by hand and independent computations."""

import math
import pickle
import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation

from hand_models.base import Pose, wrench_transport
from planner.robots import RobotFile, robosimian, robot_of
from tests.suite.helpers.robots import TWO_LINK, arm, bare_robot

EARTH = np.array([0.0, 0.0, -9.81])

ZERO_POSE = {
    "limb1_link0": (0.29326, -0.2094, -0.0365),
    "limb1_link2": (0.29326, -0.2094, -0.20853),
    "limb1_link4": (0.58092, -0.32353, -0.20853),
    "limb1_link6": (0.86857, -0.43766, -0.20853),
    "limb1_link7": (1.06223, -0.55273, -0.20852),
    "limb2_link0": (-0.29326, -0.2094, -0.0365),
    "limb2_link2": (-0.29326, -0.2094, -0.20853),
    "limb2_link4": (-0.57857, -0.32926, -0.20853),
    "limb2_link6": (-0.86389, -0.44912, -0.20853),
    "limb2_link7": (-1.05521, -0.56804, -0.20853),
    "limb3_link0": (-0.29326, 0.2094, -0.0365),
    "limb3_link2": (-0.29326, 0.2094, -0.20853),
    "limb3_link4": (-0.57976, 0.3264, -0.20853),
    "limb3_link6": (-0.86626, 0.4434, -0.20853),
    "limb3_link7": (-1.05876, 0.5604, -0.20852),
    "limb4_link0": (0.29326, 0.2094, -0.0365),
    "limb4_link2": (0.29326, 0.2094, -0.20853),
    "limb4_link4": (0.57976, 0.3264, -0.20853),
    "limb4_link6": (0.86626, 0.4434, -0.20853),
    "limb4_link7": (1.05876, 0.5604, -0.20853),
}
"""Origins in the torso's frame in the published model at its zero pose [m]."""

ALONG = (0.1, 0.0, 0.0)
"""Where a hand of no weight sits in a link whose origin is asked for [m]."""

LIMBS = ("front_right", "rear_right", "rear_left", "front_left")


def bundled_urdf():
    return robosimian().urdf


def published_urdf():
    """With the yaw of limbs 1 and 2 that the published model has."""
    text, count = re.subn(r"1\.5708 3\.141592653589793", "1.5708 3.1515926", bundled_urdf())
    assert count == 2
    return text


def model_with_hands_at(links, text, hand_mass=1e-12):
    return bare_robot(text, "torso", {f"at_{name}": (name, ALONG) for name in links}, hand_mass)


def random_angles(model, rng, spread=2.0):
    return {
        limb: rng.uniform(-spread, spread, len(chain.joints))
        for limb, chain in model.chains.items()
    }


def potential(model, angles, gravity):
    """Potential energy of the robot with its body held [J]."""
    return -model.mass * gravity @ model.com_at(angles)


def moved(angles, limb, i, step):
    changed = {name: np.array(values) for name, values in angles.items()}
    changed[limb][i] += step
    return changed


# --- RoboSimian against the published model


@pytest.mark.parametrize("name", [name for name in ZERO_POSE if not name.endswith("link0")])
def test_zero_pose_is_that_of_the_published_model(name):
    """As our file has it, and in limbs 1 and 2, with the published slip of 0.01 rad put back."""
    hand = f"at_{name}"
    back = -np.array(ALONG)
    ours = model_with_hands_at([name], bundled_urdf()).hand_poses({})[hand].apply(back)
    theirs = model_with_hands_at([name], published_urdf()).hand_poses({})[hand].apply(back)
    slipped = name.startswith(("limb1", "limb2"))
    np.testing.assert_allclose(ours, ZERO_POSE[name], atol=0.01 if slipped else 1e-5)
    np.testing.assert_allclose(theirs, ZERO_POSE[name], atol=1e-5)


def test_limbs_begin_where_link_0_is():
    """The first joint lies 0.17203 m along link 0, which points down."""
    model = robosimian()
    for i, limb in enumerate(LIMBS):
        first = np.array(ZERO_POSE[f"limb{i + 1}_link0"]) - [0.0, 0.0, 0.17203]
        np.testing.assert_allclose(model.link_chain({}, limb)[0], first, atol=1e-5)


def test_mass_and_centre_of_mass_are_those_of_the_published_model():
    model = model_with_hands_at(["limb1_link7"], published_urdf())
    assert model.mass == pytest.approx(99.888, abs=1e-9)
    np.testing.assert_allclose(model.com_at({}), [0.00033, -0.00082, -0.13289], atol=1e-5)
    assert robosimian().mass == pytest.approx(99.888 + 4 * 2.6, abs=1e-9)


def test_gravity_torque_of_a_stretched_limb_is_the_published_figure():
    model = model_with_hands_at([f"limb{i}_link7" for i in (1, 2, 3, 4)], bundled_urdf())
    torque = model.statics({}, EARTH).joint_torque
    assert max(np.abs(t).max() for t in torque.values()) == pytest.approx(59.7, abs=0.1)


def test_limits_and_names_are_those_of_the_published_model():
    model = robosimian()
    for i, limb in enumerate(LIMBS):
        assert model.chains[limb].joints == tuple(f"limb{i + 1}_joint{k}" for k in range(1, 8))
        np.testing.assert_array_equal(model.chains[limb].lower, np.full(7, -3.1415))
        np.testing.assert_array_equal(model.chains[limb].upper, np.full(7, 3.1415))


def test_shoulders_and_reach_are_those_of_the_published_model():
    """Two segments along a line to link 6, and the last one on."""
    robot = robosimian()
    for i, limb in enumerate(LIMBS):
        shoulder = ZERO_POSE[f"limb{i + 1}_link2"]
        np.testing.assert_allclose(robot.chains[limb].shoulder, shoulder, atol=1e-5)
    # joints 3 and 5, and 7, in their parents
    segment, last = np.array([0.2865, -0.117, 0.0]), np.array([0.1925, -0.117, 0.0])
    stretched = 2 * np.linalg.norm(segment) + np.linalg.norm(last)
    assert robot.reach == pytest.approx(stretched, abs=1e-3)


def test_hand_is_mounted_where_the_meshes_say():
    # hand frame 87.2 mm along link 7, less 19.85 mm from it to H; palm 112.5 mm above the axis
    for mount in robosimian().description.mounts.values():
        np.testing.assert_allclose(mount.pose.position, [0.0872 - 0.01985, 0.0, 0.1125])
        np.testing.assert_array_equal(mount.pose.rotation, np.eye(3))


@pytest.mark.parametrize("part", [0.0, 0.5, 1.0, 1.2])
def test_stretch_is_the_distance_of_the_last_link_over_the_reach(part):
    robot = robosimian()
    way = np.random.default_rng(3).normal(size=3)
    turn = Pose.from_quaternion([0.0, 0.0, 0.0], [0.5, -0.5, 0.5, 0.5]).rotation
    for limb, chain in robot.chains.items():
        link = chain.shoulder + part * robot.reach * way / np.linalg.norm(way)
        hand = Pose(link, turn) @ robot.description.mounts[limb].pose
        (stretch,) = robot.stretches(Pose.identity(), [limb], [hand])
        assert stretch == pytest.approx(part, abs=1e-9)


# --- a planar limb by hand


def two_link(hand_mass=3.0, com=(0.0, 0.0, 0.0)):
    return bare_robot(TWO_LINK, "trunk", {"leg": ("foot", (0.1, 0.0, 0.0))}, hand_mass, com)


@given(st.floats(-2.5, 2.5), st.floats(-math.pi, math.pi))
def test_two_links_by_hand(hip, knee):
    model = two_link()
    angles = {"leg": np.array([hip, knee])}
    # about +y, an angle a turns x to (cos a, 0, −sin a)
    first = np.array([math.cos(hip), 0.0, -math.sin(hip)])
    second = np.array([math.cos(hip + knee), 0.0, -math.sin(hip + knee)])
    at_knee = np.array([0.5, 0.0, 0.0]) + 0.6 * first
    hand = at_knee + 0.5 * second
    np.testing.assert_allclose(model.hand_poses(angles)["leg"].position, hand, atol=1e-12)
    np.testing.assert_allclose(
        model.link_chain(angles, "leg"), [[0.5, 0.0, 0.0], at_knee, hand], atol=1e-12
    )
    masses = np.array([10.0, 2.0, 1.0, 0.5, 3.0])
    places = np.array(
        [[0, 0, 0.1], [0.5, 0, 0] + 0.3 * first, at_knee + 0.2 * second, [0, 0, 0.4], hand]
    )
    assert model.mass == pytest.approx(16.5)
    np.testing.assert_allclose(model.com_at(angles), masses @ places / 16.5, atol=1e-12)
    statics = model.statics(angles, EARTH)
    np.testing.assert_allclose(statics.body_wrench[:3], -16.5 * EARTH, atol=1e-9)
    np.testing.assert_allclose(
        statics.body_wrench[3:], np.cross(places, -masses[:, None] * EARTH).sum(axis=0), atol=1e-9
    )
    # a joint must turn the weights beyond it up: −y · (arm × weight)
    beyond = np.cross(places[[1, 2, 4]] - [0.5, 0, 0], masses[[1, 2, 4], None] * EARTH)
    at_hip = -beyond.sum(axis=0)[1]
    beyond = np.cross(places[[2, 4]] - at_knee, masses[[2, 4], None] * EARTH)
    np.testing.assert_allclose(
        statics.joint_torque["leg"], [at_hip, -beyond.sum(axis=0)[1]], atol=1e-9
    )


def test_limits_of_a_continuous_joint_are_infinite():
    model = two_link()
    np.testing.assert_array_equal(model.chains["leg"].lower, [-2.5, -np.inf])
    np.testing.assert_array_equal(model.chains["leg"].upper, [2.5, np.inf])


def test_reach_is_the_sum_of_the_links_beyond_the_joint_that_the_first_leaves_in_place():
    model = two_link()
    np.testing.assert_allclose(model.chains["leg"].shoulder, [0.5, 0.0, 0.0])
    assert model.chains["leg"].reach == pytest.approx(0.6 + 0.4)


# --- signs and derivatives


@pytest.mark.parametrize("seed", range(3))
def test_jacobians_are_the_derivatives_of_the_poses(seed):
    model = robosimian()
    angles = random_angles(model, np.random.default_rng(seed))
    jacobians, here, step = model.jacobians(angles), model.hand_poses(angles), 1e-6
    for limb in LIMBS:
        for i in range(7):
            ahead = model.hand_poses(moved(angles, limb, i, step))[limb]
            behind = model.hand_poses(moved(angles, limb, i, -step))[limb]
            turn = Rotation.from_matrix(behind.rotation.T @ ahead.rotation).as_rotvec()
            linear = here[limb].rotation.T @ (ahead.position - behind.position)
            twist = np.concatenate([linear, turn]) / (2 * step)
            np.testing.assert_allclose(jacobians[limb][:, i], twist, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_gravity_torque_is_the_slope_of_the_potential_energy(seed):
    model = robosimian()
    rng = np.random.default_rng(seed)
    angles, gravity, step = random_angles(model, rng), rng.normal(size=3) * 6.0, 1e-5
    torque = model.statics(angles, gravity).joint_torque
    for limb in LIMBS:
        for i in range(7):
            slope = (
                potential(model, moved(angles, limb, i, step), gravity)
                - potential(model, moved(angles, limb, i, -step), gravity)
            ) / (2 * step)
            assert torque[limb][i] == pytest.approx(slope, abs=1e-5)


def test_a_weight_in_the_hand_asks_for_the_torque_of_the_wrench_that_carries_it():
    """A hand that is heavier by 1 kg holds a stone of 1 kg: it pushes the stone up by −m g."""
    hands = {limb: (f"limb{i + 1}_link7", (0.06735, 0.0, 0.1125)) for i, limb in enumerate(LIMBS)}
    light, heavy = (bare_robot(bundled_urdf(), "torso", hands, mass) for mass in (2.6, 3.6))
    angles = random_angles(light, np.random.default_rng(5))
    bare, laden = light.statics(angles, EARTH), heavy.statics(angles, EARTH)
    poses, jacobians = light.hand_poses(angles), light.jacobians(angles)
    balance = bare.body_wrench.copy()
    for limb in LIMBS:
        on_stone = np.concatenate([poses[limb].rotation.T @ -EARTH, np.zeros(3)])
        np.testing.assert_allclose(
            laden.joint_torque[limb],
            bare.joint_torque[limb] + jacobians[limb].T @ on_stone,
            atol=1e-9,
        )
        balance += wrench_transport(poses[limb]) @ on_stone
    np.testing.assert_allclose(laden.body_wrench, balance, atol=1e-9)


def test_the_body_may_be_another_link_than_the_root():
    """B turned and moved in the root link: the same robot, told from another frame."""
    text = TWO_LINK.replace(
        "</robot>",
        '<joint name="frame" type="fixed"><parent link="base"/><child link="trunk"/>'
        '<origin xyz="0.3 -0.2 0.5" rpy="0.4 -0.7 1.1"/></joint><link name="base"/></robot>',
    )
    hands = {"leg": ("foot", (0.1, 0.0, 0.0))}
    rooted, framed = (bare_robot(t, "trunk", hands, 3.0) for t in (TWO_LINK, text))
    angles = {"leg": np.array([0.3, -1.2])}
    acceleration = np.array([0.1, 0.2, -0.3, 0.5, -0.4, 0.6])
    one, other = (each.statics(angles, EARTH, acceleration) for each in (rooted, framed))
    for a, b in [
        (rooted.hand_poses(angles)["leg"].position, framed.hand_poses(angles)["leg"].position),
        (rooted.hand_poses(angles)["leg"].rotation, framed.hand_poses(angles)["leg"].rotation),
        (rooted.jacobians(angles)["leg"], framed.jacobians(angles)["leg"]),
        (rooted.com_at(angles), framed.com_at(angles)),
        (rooted.link_chain(angles, "leg"), framed.link_chain(angles, "leg")),
        (rooted.chains["leg"].shoulder, framed.chains["leg"].shoulder),
        (one.body_wrench, other.body_wrench),
        (one.joint_torque["leg"], other.joint_torque["leg"]),
    ]:
        np.testing.assert_allclose(a, b, atol=1e-12)


# --- manners


@given(st.integers(0, 2**32 - 1))
def test_hands_stay_within_the_reach_of_their_shoulder(seed):
    robot = robosimian()
    angles = random_angles(robot, np.random.default_rng(seed), 3.1415)
    for limb, pose in robot.hand_poses(angles).items():
        assert robot.stretches(Pose.identity(), [limb], [pose])[0] <= 1.0 + 1e-12


def test_a_limb_left_out_is_at_zero():
    model = robosimian()
    angles = {"rear_left": np.linspace(-1.0, 1.0, 7)}
    whole = {limb: angles.get(limb, np.zeros(7)) for limb in LIMBS}
    np.testing.assert_array_equal(model.com_at(angles), model.com_at(whole))


def test_an_answer_does_not_hang_on_the_question_before_it():
    model = robosimian()
    rng = np.random.default_rng(1)
    first, second = random_angles(model, rng), random_angles(model, rng)
    before = model.jacobians(first)["rear_left"]
    kept = before.copy()
    model.statics(second, EARTH)
    np.testing.assert_array_equal(before, kept)
    np.testing.assert_array_equal(model.jacobians(first)["rear_left"], kept)


def test_threads_share_a_model():
    model = robosimian()
    asked = [random_angles(model, np.random.default_rng(seed)) for seed in range(40)]
    alone = [model.statics(angles, EARTH).body_wrench for angles in asked]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda angles: model.statics(angles, EARTH).body_wrench, asked))
    np.testing.assert_array_equal(alone, together)


def test_a_robot_passes_between_processes():
    robot = robosimian()
    other = pickle.loads(pickle.dumps(robot))
    angles = random_angles(robot, np.random.default_rng(2))
    assert other.limbs == robot.limbs
    for limb in LIMBS:
        np.testing.assert_array_equal(other.jacobians(angles)[limb], robot.jacobians(angles)[limb])


@pytest.mark.parametrize("joints", [1, 5, 6, 8])
def test_robots_with_other_numbers_of_joints(joints):
    toml, text = arm(joints, ("left", "right"))
    robot = robot_of(RobotFile("arms", toml, text))
    assert [len(robot.chains[limb].joints) for limb in robot.limbs] == [joints, joints]
    assert robot.chains["left"].torque_limits.shape == (joints,)
    np.testing.assert_array_equal(robot.com, robot.com_at({}))
