"""The check of joints, caps and what is asked of a hand finds each number that is wrong."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from msgspec import structs
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from planner.prepare import Posture, posture
from planner.question import ForceCap, Limits, Load, Question
from planner.result import Plan
from planner.robots import RobotFile, robot_of
from planner.solving import plan
from planner.verification import limbs
from tests.suite.helpers.checks import problems
from tests.suite.helpers.robots import arm
from tests.suite.helpers.stances import on_wall
from tests.suite.helpers.stances_with_joints import at_joints, random_question_with_joints

LIMB = "rear_left"
INDEX = 2


@cache
def asked() -> Question:
    """All of it at once: joints in motion, a cap, a component of a wrench, small changes."""
    stance = on_wall()
    angles = plan(Question(replace(stance, joints="solve"))).joints
    hands = list(stance.hands)
    hands[INDEX] = replace(hands[INDEX], wrench=(None, 5.0, None, None, None, None))
    return Question(
        replace(stance, hands=tuple(hands), joints=dict(angles)),
        load=Load(acceleration=(0.2, 0.1, -0.3), angular_acceleration=(0.1, -0.2, 0.3)),
        limits=Limits(
            per_hand={LIMB: ForceCap(400.0), "front_left": ForceCap(((-300.0, 300.0),) * 3)},
            tension_change=200.0,
        ),
        present={LIMB: np.full(4, 80.0)},
    )


@cache
def honest() -> tuple[Plan, Posture]:
    return plan(asked()), posture(asked())


def complaints(
    question: Question | None = None, where: Posture | None = None, **changes
) -> list[str]:
    question = asked() if question is None else question
    answer, there = honest()
    answer = replace(answer, **changes)
    return problems(question, answer, where=there if where is None else where)


def with_joints(**changes: Callable) -> Posture:
    """The posture with parts of one limb's joints changed."""
    where = honest()[1]
    joints = where.joints[LIMB]
    joints = joints._replace(**{name: f(getattr(joints, name)) for name, f in changes.items()})
    return replace(where, joints={**where.joints, LIMB: joints})


def with_angle(limb: str, by: float) -> Posture:
    where = honest()[1]
    return replace(where, angles={**where.angles, limb: where.angles[limb] + by * np.eye(7)[3]})


def with_limits(**changes) -> Question:
    return replace(asked(), limits=structs.replace(asked().limits, **changes))


def test_an_honest_plan_passes():
    answer, _ = honest()
    assert answer.status == "optimal"
    assert complaints() == []


@pytest.mark.parametrize("objective", ["max_margin", "min_effort"])
def test_honest_plans_of_random_questions_pass(objective):
    for seed in range(20, 26):
        assert plan(random_question_with_joints(seed, objective=objective)).verified


@pytest.mark.parametrize(
    ("where", "words"),
    [
        (lambda: with_joints(gravity=lambda g: g + 0.01 * np.eye(7)[2]), "joint limb3_joint3"),
        (lambda: with_joints(jacobian=lambda j: -j), "joint limb3_joint1 bears"),
        (lambda: with_joints(jacobian=lambda j: j + 1e-4), "bears"),
        (lambda: with_angle(LIMB, 0.001), "not at the angles that were given"),
        (lambda: with_angle(LIMB, 0.001), "bears"),
        (lambda: with_angle(LIMB, 0.2), "its joints put the hand"),
        (lambda: with_angle("front_right", 2 * np.pi), "beyond its limit"),
    ],
    ids=["weight", "signs", "jacobian", "other", "torque", "far", "beyond"],
)
def test_joints_that_are_tampered_with_are_found(where, words):
    found = complaints(where=where())
    assert any(words in each for each in found), found


def test_joints_that_were_found_must_put_hands_where_they_are():
    found = replace(asked(), stance=replace(asked().stance, joints="solve"))
    told = complaints(found, with_angle(LIMB, 0.001))
    assert any("its joints put the hand" in each for each in told), told


@cache
def put_near() -> tuple[Question, Plan, Posture]:
    """A pose that one joint comes near to: 3 mm and 0.0023 rad beside its circle."""
    toml, text = arm(1, ("left", "right"))
    robot = robot_of(RobotFile("arms", toml, text))
    angles = {"left": np.array([0.3]), "right": np.array([-0.4])}
    stance = at_joints(robot, angles, robot.limbs, gravity=(0.0, 0.0, -0.1))
    left, right = stance.hands
    turn = Rotation.from_rotvec([0.0023, 0.0, 0.0]).as_matrix()
    beside = Pose(left.pose.position + np.array([0.0, 0.0, 0.003]), left.pose.rotation @ turn)
    hands = (replace(left, pose=beside), right)
    question = Question(replace(stance, hands=hands, joints="solve"))
    return question, plan(question), posture(question)


def test_hands_that_are_near_their_poses_are_told_of():
    question, answer, where = put_near()
    assert answer.verified
    assert where.off == {"left": pytest.approx((0.003, 0.0023), rel=0.01)}
    (told,) = (each for each in answer.warnings if "no joint angles" in each)
    assert told == (
        "left: no joint angles put its hand exactly there; the nearest, which are taken, put it "
        "0.003 m away and turn it by 0.0023 rad"
    )
    # as the same angles, given
    given = replace(question, stance=replace(question.stance, joints=dict(answer.joints)))
    same = plan(given)
    assert same.verified
    assert same.utilisation == pytest.approx(answer.utilisation, abs=1e-9)
    for limb, torques in answer.joint_torque.items():
        np.testing.assert_allclose(same.joint_torque[limb], torques, atol=1e-6)


@pytest.mark.parametrize(
    "off",
    [{}, {"right": (0.003, 0.0023)}, {"left": (0.0031, 0.0023)}, {"left": (0.003, 0.002)}],
    ids=["untold", "other", "distance", "angle"],
)
def test_hands_that_are_elsewhere_than_told_are_found(off):
    question, answer, where = put_near()
    assert problems(question, answer, where=where) == []
    told = problems(question, answer, where=replace(where, off=off))
    assert any("its joints put the hand" in each for each in told), told


def test_hands_that_are_too_far_are_found_although_told():
    question, answer, where = put_near()
    far = replace(where, angles={**where.angles, "left": where.angles["left"] + 0.06})
    stance = question.stance
    pose, there = stance.hands[0].pose, stance.robot.hand_poses(far.angles)["left"]
    off = float(np.linalg.norm(there.position - pose.position))
    turned = Rotation.from_matrix(there.rotation.T @ pose.rotation).magnitude()
    told = problems(question, answer, where=replace(far, off={"left": (off, float(turned))}))
    assert any("left: its joints put the hand" in each for each in told), told


def test_joints_that_are_left_out_are_found():
    answer, _ = honest()
    found = problems(asked(), answer)
    assert any("the joints are not what" in each for each in found)


@pytest.mark.parametrize("component", range(6))
def test_another_weight_is_found(component):
    wrench = honest()[0].body_wrench + 1e-5 * np.eye(6)[component]
    assert any("weight and acceleration" in each for each in complaints(body_wrench=wrench))


@pytest.mark.parametrize(
    ("question", "words"),
    [
        (lambda: with_limits(joint_torque=20.0), "utilisation is"),
        (lambda: with_limits(joint_torque={LIMB: 20.0}), f"{LIMB}: utilisation is"),
        (lambda: with_limits(per_hand={LIMB: ForceCap(50.0)}), f"{LIMB}: utilisation is"),
        (
            lambda: with_limits(per_hand={LIMB: ForceCap(((-9.0, 9.0),) * 3, "world")}),
            f"{LIMB}: utilisation is",
        ),
        (
            lambda: with_limits(per_hand={LIMB: ForceCap(((0.0, 9e9), (0.0, 9e9), (0.0, 9e9)))}),
            "N along x of the hand, of none",
        ),
        (lambda: with_limits(tension_change=1.0), "changes by"),
        (lambda: replace(asked(), present={LIMB: np.full(4, 500.0)}), "changes by"),
        (lambda: replace(asked(), load=Load()), "weight and acceleration"),
        (lambda: replace(asked(), load=Load(acceleration=(0.2, 0.1, -0.3))), "bears"),
    ],
    ids=["torque", "limb", "cap", "world", "none", "change", "present", "still", "no turning"],
)
def test_a_plan_for_another_question_is_found(question, words):
    found = complaints(question())
    assert any(words in each for each in found), found


def test_tensions_may_change_where_nothing_is_said_of_it():
    off = tuple(replace(hand, utilisation=1.0) for hand in honest()[0].hands)
    found = complaints(with_limits(tension_change=None), hands=off)
    assert all("utilisation is" in each for each in found), found
    assert len(found) == len(off)


def test_another_wrench_that_was_asked_for_is_found():
    hands = list(asked().stance.hands)
    for given in ((None, 5.001, None, None, None, None), (None, 5.0, None, 0.1, None, None)):
        hands[INDEX] = replace(hands[INDEX], wrench=given)
        stance = replace(asked().stance, hands=tuple(hands))
        assert any("component" in each for each in complaints(replace(asked(), stance=stance)))


def test_rows_that_promise_less_force_than_there_is_are_found(monkeypatch):
    monkeypatch.setattr(limbs, "FORCE_DIRECTIONS", 0.5 * limbs.FORCE_DIRECTIONS)
    assert any("more than its rows say" in each for each in complaints())


@pytest.mark.parametrize("wrong", [0.0, 0.99, 1.01, float("nan")])
def test_a_wrong_effort_is_found(wrong):
    effort = honest()[0].effort * wrong
    assert any("effort is" in each for each in complaints(effort=effort))


@pytest.mark.parametrize("joint", range(7))
def test_a_torque_at_a_joint_without_a_motor_is_told(joint):
    limits = [200.0] * 7
    limits[joint] = 0.0
    torque = honest()[0].joint_torque[LIMB][joint]
    name = honest()[1].joints[LIMB].names[joint]
    told = complaints(with_limits(joint_torque={LIMB: tuple(limits)}))
    assert f"{LIMB}: joint {name} has no motor, and bears {torque:.6g} N·m" in told
