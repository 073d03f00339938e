"""Joints that slide, follow others or have no motor: what they bear, by virtual work."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from hand_models.base import InvalidInputError
from planner.question import ForceCap, Limits, Load, Question
from planner.robots import LinkTree, RobotFile, robot_of, solve_limbs
from planner.solving import KnownStance, plan
from planner.streaming import WrenchStream
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.robots import joint, limbs_toml, link, urdf
from tests.suite.helpers.stances import on_wall
from tests.suite.helpers.stances_with_joints import at_joints

GRAVITY = np.array([0.6, -1.1, -9.3])
LIMBS = ("left", "right")
KINDS = ("revolute", "continuous", "prismatic")
STEP = 1e-6
SEEDS = range(4)


def name_of(limb, k):
    return f"{limb}{k}_joint"


def random_arms(seed, torque="80.0"):
    """Two arms of seven joints that turn or slide, of which two each follow others."""
    rng = np.random.default_rng(seed)
    parts, mimics = [link("trunk", 20.0, "0.02 0 0.05", 0.3)], {}
    for i, limb in enumerate(LIMBS):
        followers = dict.fromkeys(rng.choice(np.arange(2, 8), 2, replace=False).tolist())
        own = [k for k in range(1, 8) if k not in followers]
        names = ["trunk", *(f"{limb}{k}" for k in range(1, 8))]
        for k, (parent, child) in enumerate(pairwise(names), start=1):
            kind = str(rng.choice(KINDS))
            limit = "-0.15 0.25" if kind == "prismatic" else "-2.5 2.5"
            inner = ""
            if k in followers:
                driver, ratio, shift = int(rng.choice(own)), rng.uniform(-1.5, 1.5), 0.01
                limit = "-9 9"
                mimics[name_of(limb, k)] = (name_of(limb, driver), ratio, shift)
                inner = (
                    f'<mimic joint="{name_of(limb, driver)}" multiplier="{ratio}" '
                    f'offset="{shift}"/>'
                )
            offset = f"0.2 {0.3 * (-1) ** i} 0" if k == 1 else f"{0.05 + 0.06 * (k % 3)} 0 0.02"
            axis = " ".join(f"{value:.6f}" for value in rng.normal(size=3))
            parts.append(joint(name_of(limb, k), kind, parent, child, offset, axis, limit, inner))
            parts.append(link(child, 1.0 / (k + 1), "0.05 0.01 0", 0.002))
    toml = limbs_toml("arms", {limb: f"{limb}7" for limb in LIMBS}, torque=torque)
    return robot_of(RobotFile("arms", toml, urdf(*parts))), mimics


def random_angles(robot, rng):
    return {
        limb: rng.uniform(np.maximum(chain.lower, -0.9), np.minimum(chain.upper, 0.9))
        for limb, chain in robot.chains.items()
    }


class FreeJoints:
    """The same URDF in Pinocchio by itself, every joint on its own, with points for hands."""

    def __init__(self, robot, mimics):
        self.robot, self.mimics = robot, mimics
        self.model = pin.buildModelFromXML(robot.urdf)
        for limb in robot.limbs:
            place = pin.SE3(np.eye(3), np.array([0.1, 0.0, 0.0]))
            at = self.model.getJointId(name_of(limb, 7))
            hand = pin.Inertia(robot.hand.mass, np.zeros(3), np.zeros((3, 3)))
            self.model.appendBodyToJoint(at, hand, place)
            self.model.addFrame(pin.Frame(f"{limb} hand", at, 0, place, pin.FrameType.OP_FRAME))
        self.model.gravity.linear = GRAVITY
        self.data = self.model.createData()

    def at(self, angles):
        by_name = {
            name: value
            for limb, chain in self.robot.chains.items()
            for name, value in zip(chain.joints, angles[limb], strict=True)
        }
        for name, (driver, ratio, shift) in self.mimics.items():
            by_name[name] = ratio * by_name[driver] + shift
        q = pin.neutral(self.model)
        for i in range(1, self.model.njoints):
            each, value = self.model.joints[i], by_name[self.model.names[i]]
            turns = (np.cos(value), np.sin(value)) if each.nq == 2 else (value,)
            q[each.idx_q : each.idx_q + each.nq] = turns
        return q

    def energy(self, angles):
        return float(pin.computePotentialEnergy(self.model, self.data, self.at(angles)))

    def hand(self, angles, limb):
        pin.framesForwardKinematics(self.model, self.data, self.at(angles))
        return self.data.oMf[self.model.getFrameId(f"{limb} hand")].copy()

    def forces(self, angles, wrenches):
        """What motors give, by how energy and the hands' work change with each angle."""
        found = {}
        for limb in self.robot.limbs:
            here, each = self.hand(angles, limb), []
            for j in range(len(angles[limb])):
                ends = []
                for way in (STEP, -STEP):
                    there = {**angles, limb: angles[limb] + way * np.eye(len(angles[limb]))[j]}
                    moved = pin.log6(here.actInv(self.hand(there, limb))).vector
                    ends.append(self.energy(there) + float(wrenches[limb] @ moved))
                each.append((ends[0] - ends[1]) / (2.0 * STEP))
            found[limb] = np.array(each)
        return found


@pytest.mark.parametrize("seed", SEEDS)
def test_motors_bear_what_virtual_work_says(seed):
    robot, mimics = random_arms(seed)
    rng = np.random.default_rng(seed + 100)
    angles = random_angles(robot, rng)
    assert all(len(chain.joints) == 5 and len(chain.moving) == 7 for chain in robot.chains.values())
    free = FreeJoints(robot, mimics)
    wrenches = {limb: rng.normal(size=6) * [90.0, 90.0, 90.0, 9.0, 9.0, 9.0] for limb in LIMBS}
    expected = free.forces(angles, wrenches)
    statics, jacobians = robot.statics(angles, GRAVITY), robot.jacobians(angles)
    tree = LinkTree(robot).hold_up(angles, wrenches, GRAVITY, np.zeros(6))
    for limb in LIMBS:
        ours = statics.joint_torque[limb] + jacobians[limb].T @ wrenches[limb]
        np.testing.assert_allclose(ours, expected[limb], atol=2e-6 * np.abs(expected[limb]).max())
        np.testing.assert_allclose(tree.torques[limb], ours, atol=1e-9)
        there = free.hand(angles, limb)
        np.testing.assert_allclose(tree.hands[limb].position, there.translation, atol=1e-12)
        np.testing.assert_allclose(
            robot.hand_poses(angles)[limb].rotation, there.rotation, atol=1e-12
        )


@pytest.mark.parametrize("seed", SEEDS)
def test_a_limb_reaches_no_farther_than_it_says(seed):
    robot, _ = random_arms(seed)
    rng = np.random.default_rng(seed)
    for _ in range(50):
        for limb, chain in robot.chains.items():
            angles = {limb: rng.uniform(np.maximum(chain.lower, -3), np.minimum(chain.upper, 3))}
            pose = robot.hand_poses(angles)[limb]
            (stretch,) = robot.stretches(type(pose).identity(), [limb], [pose])
            assert stretch <= 1.0 + 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_plans_count_sliding_and_coupled_joints(seed):
    robot, mimics = random_arms(seed, torque="[90.0, 120.0, 100.0, 80.0, 110.0]")
    rng = np.random.default_rng(seed)
    angles = random_angles(robot, rng)
    stance = at_joints(robot, angles, LIMBS, gravity=GRAVITY)
    wrench = rng.normal(size=6) * [40.0, 40.0, 40.0, 6.0, 6.0, 6.0]
    answer = plan(Question(stance, body_wrench=wrench))
    if answer.hands is None:
        assert answer.status == "infeasible"
        return
    assert answer.verified
    wrenches = {hand.limb: hand.wrench for hand in answer.hands}
    expected = FreeJoints(robot, mimics).forces(angles, wrenches)
    for limb in LIMBS:
        np.testing.assert_allclose(answer.joint_torque[limb], expected[limb], atol=1e-4)
        shares = np.abs(expected[limb]) / [90.0, 120.0, 100.0, 80.0, 110.0]
        assert shares.max() <= answer.utilisation + 1e-6
    for name in (answer.limiting, *(price for price in answer.prices or ())):
        if name.joint is not None:
            chain = robot.chains[name.limb]
            slides = chain.sliding[chain.joints.index(name.joint)]
            assert name.limit == ("joint_force" if slides else "joint_torque")


def test_a_limit_that_binds_on_a_slide_is_a_force():
    robot, _ = random_arms(4)
    limb, i = next(
        (limb, int(np.flatnonzero(chain.sliding)[0]))
        for limb, chain in robot.chains.items()
        if chain.sliding.any()
    )
    stance = at_joints(robot, random_angles(robot, np.random.default_rng(4)), LIMBS)
    question = Question(stance, body_wrench=np.full(6, 5.0))
    before = plan(question)
    # the hand's wrench is held, and its slide too weak for that by a factor of three
    index = LIMBS.index(limb)
    hands = list(stance.hands)
    hands[index] = replace(hands[index], wrench=tuple(before.hands[index].wrench.tolist()))
    weak = [500.0] * len(robot.chains[limb].joints)
    weak[i] = abs(before.joint_torque[limb][i]) / 3.0
    held = replace(stance, hands=tuple(hands))
    answer = plan(replace(question, stance=held, limits=Limits(joint_torque={limb: weak})))
    assert answer.utilisation == pytest.approx(3.0, rel=1e-4)
    assert answer.limiting.limit == "joint_force"
    assert answer.limiting.joint == robot.chains[limb].joints[i]
    assert " N of " in answer.reason
    assert "N·m" not in answer.reason


@pytest.mark.parametrize("seed", range(3))
def test_poses_are_solved_with_slides_and_followers(seed):
    robot, _ = random_arms(seed)
    angles = random_angles(robot, np.random.default_rng(seed))
    # a pose has six numbers, and these limbs five motors: only what was reached is asked for
    poses = robot.hand_poses(angles)
    found = solve_limbs(robot, poses, {}, GRAVITY, (0.01, 0.05))
    for limb, pose in robot.hand_poses(found).items():
        assert np.linalg.norm(pose.position - poses[limb].position) <= 0.01


def test_limits_of_followers_are_kept_by_the_motor():
    parts = (
        link("trunk", 5.0),
        joint("lift", "prismatic", "trunk", "mast", "0 0 0.2", "0 0 1", "0.0 0.4"),
        link("mast", 1.0),
        joint(
            "second", "prismatic", "mast", "top", "0 0 0.2", "0 0 1", "-0.6 0.1",
            '<mimic joint="lift" multiplier="-2" offset="0.1"/>',
        ),
        link("top", 1.0),
    )  # fmt: skip
    file = RobotFile("crane", limbs_toml("crane", {"arm": "top"}), urdf(*parts))
    chain = robot_of(file).chains["arm"]
    assert (chain.joints, chain.moving) == (("lift",), ("lift", "second"))
    np.testing.assert_allclose([*chain.lower, *chain.upper], [0.0, 0.35])
    # gravity along the mast: what the second stage weighs counts 1 − 2 times
    held = robot_of(file).statics({"arm": np.array([0.2])}, np.array([0.0, 0.0, -10.0]))
    hand = robot_of(file).hand.mass
    assert held.joint_torque["arm"][0] == pytest.approx(10.0 * (1.0 - (1.0 + hand)))
    apart = replace(file, urdf=file.urdf.replace('lower="-0.6" upper="0.1"', 'lower="2" upper="3"'))
    with pytest.raises(InvalidInputError, match=r"follows 'lift' .* no common range"):
        robot_of(apart)


# Joints without a motor ---------------------------------------------------------------------------


def with_passive(robot, count, rng):
    """The robot's torque limits with so many zeros in each limb."""
    limits = {}
    for limb, chain in robot.chains.items():
        values = rng.uniform(60.0, 200.0, len(chain.joints))
        values[rng.choice(len(values), count, replace=False)] = 0.0
        limits[limb] = tuple(values.tolist())
    return limits


@pytest.mark.parametrize("seed", range(3))
def test_joints_without_a_motor_bear_nothing(seed, wall_with_joints):
    rng = np.random.default_rng(seed)
    stance = wall_with_joints
    limits = with_passive(stance.robot, 1 + seed % 2, rng)
    question = Question(
        stance,
        limits=Limits(joint_torque=limits),
        objective=("max_margin", "min_effort")[seed % 2],
        want=frozenset({"load_factor", "prices"}),
    )
    answer = plan(question)
    if answer.hands is None:
        names = answer.certificate.irreducible
        assert any(name.limit == "passive_joint" for name in names)
        return
    assert answer.verified
    effort = 0.0
    for limb, given in limits.items():
        driven = np.array(given) > 0.0
        assert np.abs(answer.joint_torque[limb][~driven]).max() < 1e-4
        effort += np.sum((answer.joint_torque[limb][driven] / np.array(given)[driven]) ** 2)
    hand = stance.robot.hand
    tensions = np.array([hand.tensions for hand in answer.hands])
    most = hand.maximum_tension
    assert answer.effort == pytest.approx(effort + np.sum((tensions / most) ** 2), rel=1e-5)
    assert answer.joint_utilisation <= answer.utilisation + 1e-6
    known = KnownStance(question).plan(answer.body_wrench)
    assert known.utilisation == pytest.approx(answer.utilisation, rel=1e-6)
    least = plan(replace(question, objective="max_margin"))
    if least.status == "optimal":
        again = WrenchStream(replace(question, want=frozenset(), objective="max_margin"))
        told = again.set_points(least.body_wrench)
        assert told.verified
        assert told.utilisation == pytest.approx(least.utilisation, rel=1e-4)


def test_a_motor_of_next_to_no_torque_is_nearly_none(wall_with_joints):
    """The limit of ever weaker motors is none, but their relative torques count as effort."""
    weak, none = (
        plan(
            Question(
                wall_with_joints,
                limits=Limits(joint_torque=dict.fromkeys(LIMBS_OF_WALL, (200.0,) * 6 + (last,))),
            )
        )
        for last in (1e-3, 0.0)
    )
    assert weak.utilisation == pytest.approx(none.utilisation, rel=1e-4)
    assert none.utilisation >= weak.utilisation - 1e-9


LIMBS_OF_WALL = ("front_right", "rear_right", "rear_left", "front_left")


def test_what_a_joint_without_a_motor_forbids_is_told(wall_with_joints):
    # nothing is left to turn with: the wrench that is given cannot be
    hands = list(wall_with_joints.hands)
    hands[0] = replace(hands[0], wrench=(0.0, 0.0, 20.0, 3.0, 5.0, 7.0))
    limits = Limits(joint_torque={hands[0].limb: (200.0,) * 6 + (0.0,)})
    answer = plan(Question(replace(wall_with_joints, hands=tuple(hands)), limits=limits))
    assert answer.status == "infeasible"
    kinds = {name.limit for name in answer.certificate.irreducible}
    assert "passive_joint" in kinds
    assert "has no motor" in answer.reason


def test_a_limb_that_hangs_free_would_swing(wall_with_joints):
    idle = wall_with_joints.hands[0].limb
    stance = replace(wall_with_joints, hands=wall_with_joints.hands[1:])
    angles = {**stance.joints, idle: np.array([0.3, 1.0, 0.2, -1.2, 0.4, 0.6, 0.1])}
    stance = replace(stance, joints=angles)
    limits = Limits(joint_torque={idle: (200.0, 0.0) + (200.0,) * 5})
    answer = plan(Question(stance, limits=limits))
    name = stance.robot.chains[idle].joints[1]
    (told,) = [text for text in answer.warnings if "has no motor" in text]
    assert told.startswith(f"{idle}: joint {name} has no motor and does not stay")
    assert f"{abs(answer.joint_torque[idle][1]):.2g} N·m" in told
    assert answer.joint_shares[idle][1] == 0.0
    assert answer.verified


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (0.0, r"0 for a joint without a motor \(not for all joints of a limb\), got 0"),
        ({"front_left": 0.0}, r"not for all joints of a limb"),
        ({"front_left": (1e-4,) + (0.0,) * 6}, r"at least 0.001 N·m, .* got 0.0001"),
        ({"front_left": (-1.0,) + (9.0,) * 6}, r"got -1"),
        (float("nan"), r"got nan"),
        (float("inf"), r"must be finite .* got inf; leave it out to keep the robot's own limits"),
        ({"front_left": (4.0, float("inf"), 5.0)}, r"got 4, inf, 5;"),
    ],
)
def test_limits_that_are_none(given, words):
    with pytest.raises(InvalidInputError, match=words):
        Limits(joint_torque=given)


@pytest.fixture(scope="module")
def wall_with_joints():
    stance = on_wall()
    return replace(stance, joints=dict(plan(Question(replace(stance, joints="solve"))).joints))


@pytest.mark.parametrize(
    ("limb", "words"),
    [
        (
            "front_left",
            r"^limits.joint_torque.front_left: .*not for all joints of a limb\), got 0, 0",
        ),
        ("nobody", r"^limits.joint_torque.nobody: .*front_left"),
    ],
)
def test_a_limb_whose_joints_all_bear_nothing_is_refused_after_its_name(
    wall_with_joints, limb, words
):
    with pytest.raises(InvalidInputError, match=words):
        Question(wall_with_joints, limits=Limits(joint_torque={limb: (0.0,) * 7}))


def test_caps_beside_them_are_kept(wall_with_joints):
    limits = Limits(
        joint_torque=dict.fromkeys(LIMBS_OF_WALL, (200.0,) * 6 + (0.0,)),
        per_hand={"front_left": ForceCap(((-300.0, 300.0), (-300.0, 0.0), (-300.0, 300.0)))},
    )
    answer = plan(
        Question(wall_with_joints, load=Load(acceleration=(0.1, 0.0, 0.2)), limits=limits)
    )
    assert answer.verified
    for torque in answer.joint_torque.values():
        assert abs(torque[6]) < 1e-4


@pytest.mark.parametrize("joint", [1, 6])
def test_so_do_those_of_hands_whose_wrists_float(joint):
    stance = replace(question(read_request("wall-300-floating")).stance, joints="solve")
    given = [200.0] * 7
    given[joint] = 0.0
    limits = Limits(joint_torque=dict.fromkeys(LIMBS_OF_WALL, tuple(given)))
    answer = plan(Question(stance, load=Load(mass=90.0), limits=limits))
    assert answer.status == "optimal"
    assert answer.verified
    for torque in answer.joint_torque.values():
        assert abs(torque[joint]) < 1e-4
