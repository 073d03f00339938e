"""Inverse kinematics: poses are met within limits and with little torque, or it is said why not."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from planner.robots import RobotFile, UnreachableError, robosimian, robot_of, solve_limbs
from planner.robots.inverse_kinematics import lower_torques
from planner.robots.limb_batch import LimbBatch
from planner.robots.pose_search import damped_step
from planner.robots.tolerances import TOLERANCES
from tests.suite.helpers.robots import arm

EARTH = np.array([0.0, 0.0, -9.81])
LIMBS = ("front_right", "rear_right", "rear_left", "front_left")


def uniform_angles(robot, rng):
    return {
        limb: rng.uniform(np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi))
        for limb, chain in robot.chains.items()
    }


def unloaded(robot, poses):
    """Angles for poses, and what is said of those that have none."""
    return asked_of(robot, poses, {}, np.zeros(3))


def asked_of(robot, poses, loads, gravity=EARTH):
    try:
        return solve_limbs(robot, poses, loads, gravity), None
    except UnreachableError as error:
        met = {limb: pose for limb, pose in poses.items() if limb not in error.missing}
        return (solve_limbs(robot, met, loads, gravity) if met else {}), error


def shares(robot, poses, gravity=EARTH):
    """Wrenches on the rock of hands that carry equal parts of the weight."""
    force = robot.mass * gravity / len(poses)
    return {
        limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)]) for limb, pose in poses.items()
    }


def errors(robot, poses, found):
    """Largest distance [m] and angle [rad] of the hands from their poses, by forward kinematics."""
    there = robot.hand_poses(found)
    away = [np.linalg.norm(there[limb].position - poses[limb].position) for limb in found]
    turned = [
        Rotation.from_matrix(there[limb].rotation.T @ poses[limb].rotation).magnitude()
        for limb in found
    ]
    return max(away), max(turned)


def cost(robot, angles, loads, gravity=EARTH):
    """Σ (τ / τ_max)² by limb, with τ = gravity torque + Jᵀ w."""
    bare = robot.statics(angles, gravity).joint_torque
    jacobians = robot.jacobians(angles)
    return {
        limb: np.sum(
            ((bare[limb] + jacobians[limb].T @ loads[limb]) / robot.chains[limb].torque_limits) ** 2
        )
        for limb in loads
    }


def within_limits(robot, found):
    return all(
        np.all(robot.chains[limb].lower <= angles) and np.all(angles <= robot.chains[limb].upper)
        for limb, angles in found.items()
    )


@pytest.mark.slow
@pytest.mark.parametrize("loaded", [False, True], ids=["bare", "loaded"])
def test_a_thousand_reachable_poses(loaded):
    """At least 99 % of them are met, and those that are said to be met are."""
    robot, rng = robosimian(), np.random.default_rng(2026)
    solved = 0
    for _ in range(250):
        poses = robot.hand_poses(uniform_angles(robot, rng))
        found, _ = (
            asked_of(robot, poses, shares(robot, poses)) if loaded else unloaded(robot, poses)
        )
        solved += len(found)
        away, turned = errors(robot, poses, found)
        assert away <= 1e-6
        assert turned <= 1e-6
        assert within_limits(robot, found)
    assert solved >= 990


def test_the_stretched_zero_pose_is_met():
    robot = robosimian()
    poses = robot.hand_poses({})
    found = solve_limbs(robot, poses, shares(robot, poses), EARTH)
    assert max(errors(robot, poses, found)) <= 1e-6


def test_a_limb_stretched_to_its_end_is_met_or_said_to_be_barely_out_of_reach():
    toml, text = arm(7)
    robot = robot_of(RobotFile("arms", toml, text))
    poses = robot.hand_poses({})
    found, error = unloaded(robot, poses)
    assert error is None
    assert errors(robot, poses, found)[0] <= 1e-6


# --- the redundant joint


@pytest.mark.parametrize("seed", range(3))
def test_lowered_torques_are_a_minimum_among_the_postures_nearby(seed):
    """From the answer, any self-motion that stays within the limits raises the cost."""
    robot, rng = robosimian(), np.random.default_rng(seed)
    poses = robot.hand_poses(uniform_angles(robot, rng))
    loads = shares(robot, poses)
    batch = LimbBatch(robot, poses, loads, EARTH)
    found = np.array(list(solve_limbs(robot, poses, loads, EARTH).values()))
    # again from there, so that it has converged
    for _ in range(3):
        found = lower_torques(batch, found)
    least = batch.cost(found[None])[0]
    jacobians = robot.jacobians(dict(zip(LIMBS, found, strict=True)))
    for i, limb in enumerate(LIMBS):
        along = null_space(jacobians[limb])[:, 0]
        for step in (-0.02, 0.02):
            near = found.copy()
            near[i] += step * along
            if np.any(near < batch.lower) or np.any(near > batch.upper):
                continue
            for _ in range(10):
                near = damped_step(batch, near, *(each[0] for each in batch.errors(near[None])))
            met = np.abs(batch.errors(near[None])[0][0, i]).max() <= TOLERANCES.pose_error
            if not met or np.abs(near[i] - found[i]).max() > 0.1:
                continue
            assert batch.cost(near[None])[0, i] >= least[i] * (1.0 - 1e-5)


def test_lowering_does_lower():
    """From the same start, torques are never higher, and mostly lower."""
    robot, rng = robosimian(), np.random.default_rng(11)
    ratios = []
    for _ in range(20):
        angles = uniform_angles(robot, rng)
        poses = robot.hand_poses(angles)
        loads = shares(robot, poses)
        batch = LimbBatch(robot, poses, loads, EARTH)
        found = lower_torques(batch, np.array(list(angles.values())))
        before, after = cost(robot, angles, loads), batch.cost(found[None])[0]
        ratios += [after[i] / before[limb] for i, limb in enumerate(LIMBS)]
    assert max(ratios) <= 1.0 + 1e-9
    assert np.median(ratios) < 0.95


@pytest.mark.parametrize("gravity", [EARTH, np.array([3.0, -2.0, 1.0]), np.zeros(3)])
def test_efforts_are_the_torques_of_the_model_over_the_limits(gravity):
    robot, rng = robosimian(), np.random.default_rng(4)
    angles = uniform_angles(robot, rng)
    poses = robot.hand_poses(angles)
    loads = {limb: rng.normal(size=6) * 50.0 for limb in LIMBS}
    batch = LimbBatch(robot, poses, loads, gravity)
    stacked = np.array([[angles[limb] for limb in LIMBS]])
    efforts, slopes = batch.efforts(stacked)
    bare, jacobians = (
        robot.statics(angles, gravity).joint_torque,
        robot.jacobians(angles),
    )
    for i, limb in enumerate(LIMBS):
        torque = bare[limb] + jacobians[limb].T @ loads[limb]
        np.testing.assert_allclose(
            efforts[0, i], torque / robot.chains[limb].torque_limits, atol=1e-12
        )
    step = 1e-6
    for j in range(7):
        ahead, behind = stacked.copy(), stacked.copy()
        ahead[..., j] += step
        behind[..., j] -= step
        slope = (batch.efforts(ahead)[0] - batch.efforts(behind)[0]) / (2 * step)
        np.testing.assert_allclose(slopes[0, :, :, j], slope[0], atol=1e-7)


def test_the_load_decides_which_posture_is_taken():
    robot, rng = robosimian(), np.random.default_rng(8)
    poses = robot.hand_poses(uniform_angles(robot, rng))
    pull = {limb: np.array([0.0, 0.0, -300.0, 0.0, 0.0, 0.0]) for limb in LIMBS}
    turn = {limb: np.array([0.0, 0.0, 0.0, 40.0, 40.0, 0.0]) for limb in LIMBS}
    angles = {
        name: solve_limbs(robot, poses, loads, EARTH)
        for name, loads in (("pull", pull), ("turn", turn))
    }
    own, other = cost(robot, angles["pull"], pull), cost(robot, angles["turn"], pull)
    assert sum(own.values()) < sum(other.values())


# --- the same and the near


def test_the_same_question_has_the_same_answer():
    robot, rng = robosimian(), np.random.default_rng(3)
    asked = [robot.hand_poses(uniform_angles(robot, rng)) for _ in range(6)]
    alone = [unloaded(robot, poses)[0] for poses in asked]
    with ThreadPoolExecutor(3) as pool:
        again = list(pool.map(lambda poses: unloaded(robot, poses)[0], reversed(asked)))[::-1]
    for first, second in zip(alone, again, strict=True):
        for limb in LIMBS:
            np.testing.assert_array_equal(first[limb], second[limb])


def test_limbs_do_not_hang_on_each_other():
    robot, rng = robosimian(), np.random.default_rng(12)
    poses = robot.hand_poses(uniform_angles(robot, rng))
    together, _ = unloaded(robot, poses)
    for limb in LIMBS:
        alone, _ = unloaded(robot, {limb: poses[limb]})
        assert list(alone) == [limb]
        np.testing.assert_allclose(alone[limb], together[limb], atol=1e-9)


# --- out of reach


@pytest.mark.parametrize("limb", LIMBS)
@pytest.mark.parametrize("distance", [0.001, 2.0])
def test_what_is_missing_beyond_the_stretched_limb(limb, distance):
    robot, rng = robosimian(), np.random.default_rng(1)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    turn = Rotation.random(random_state=5).as_matrix()
    link = Pose(robot.chains[limb].shoulder + (robot.reach + distance) * way, turn)
    pose = link @ robot.description.mounts[limb].pose
    _, error = unloaded(robot, {limb: pose})
    # nothing can be nearer, and with the asked axes the stretched limb costs no more than itself
    assert distance - 1e-9 <= error.missing[limb] <= distance + robot.reach
    assert list(error.missing) == [limb]
    assert limb in str(error)


def test_a_hold_that_moves_away_is_missed_by_more_and_more():
    """The hand keeps its axes; each step of 0.1 m away costs between nothing and 0.1 m more."""
    robot = robosimian()
    start = robot.hand_poses({"front_right": np.array([0.3, 1.0, 0.2, -1.2, 0.4, 0.6, 0.1])})
    pose = start["front_right"]
    away = pose.position - robot.chains["front_right"].shoulder
    away /= np.linalg.norm(away)
    missing = []
    for steps in range(8):
        moved = Pose(pose.position + 0.1 * steps * away, pose.rotation)
        _, error = unloaded(robot, {"front_right": moved})
        missing.append(0.0 if error is None else error.missing["front_right"])
    assert missing[0] == 0.0
    assert missing[-1] > 0.1
    assert (np.diff(missing) >= -2e-3).all()
    assert (np.diff(missing) <= 0.1 + 2e-3).all()


def test_every_limb_that_is_out_of_reach_is_named():
    robot = robosimian()
    poses = robot.hand_poses({limb: np.full(7, 0.4) for limb in LIMBS})
    for limb, away in (("rear_left", 3.0), ("front_right", 2.0)):
        poses[limb] = Pose(poses[limb].position + np.array([0.0, 0.0, away]), poses[limb].rotation)
    _, error = unloaded(robot, poses)
    assert list(error.missing) == ["front_right", "rear_left"]
    assert error.missing["rear_left"] > error.missing["front_right"] > 1.0
    assert "; rear_left is out of reach by" in str(error)
    assert "\n" not in str(error)
    assert (error.kind, isinstance(error, InvalidInputError)) == ("unreachable", True)
    other = pickle.loads(pickle.dumps(error))
    assert (other.missing, str(other), type(other)) == (error.missing, str(error), UnreachableError)


def test_a_hand_too_near_its_shoulder_misses_what_the_best_posture_misses():
    """A limb of one joint reaches one circle; the missing distance is that to its nearest point."""
    toml, text = arm(1)
    robot = robot_of(RobotFile("arms", toml, text))
    turned = robot.hand_poses({"arm": np.array([0.7])})["arm"]
    assert unloaded(robot, {"arm": turned})[0]["arm"] == pytest.approx([0.7])
    lifted = Pose(turned.position + np.array([0.0, 0.0, 0.05]), turned.rotation)
    _, error = unloaded(robot, {"arm": lifted})
    assert error.missing["arm"] == pytest.approx(0.05, abs=1e-3)


def test_a_hand_in_its_place_but_not_turned_as_asked_is_told_so():
    toml, text = arm(1)
    robot = robot_of(RobotFile("arms", toml, text))
    pose = robot.hand_poses({"arm": np.array([0.3])})["arm"]
    tilted = Pose(pose.position, pose.rotation @ Rotation.from_rotvec([0.2, 0, 0]).as_matrix())
    _, error = unloaded(robot, {"arm": tilted})
    assert error.turned["arm"] == pytest.approx(0.2, rel=0.05)
    assert str(error) == "arm cannot be turned as asked, by 0.2 rad"


# --- robots of one's own


@pytest.mark.parametrize("kind", ["revolute", pytest.param("continuous", marks=pytest.mark.slow)])
@pytest.mark.parametrize("joints", [3, 5, 6, 7, 8, (8, 6), (2, 7)])
def test_limbs_of_other_numbers_of_joints(joints, kind):
    """Poses that the limb has are met, the limits kept; with fewer than six joints as well."""
    robot = robot_of(RobotFile("arms", *arm(joints, ("left", "right"), kind)))
    rng, solved, tried = np.random.default_rng(0), 0, 8
    for _ in range(tried):
        poses = robot.hand_poses(uniform_angles(robot, rng))
        loads = shares(robot, poses)
        found, _ = asked_of(robot, poses, loads)
        assert within_limits(robot, found)
        solved += len(found)
        if found:
            assert max(errors(robot, poses, found)) <= 1e-6
    assert solved >= 0.9 * 2 * tried
