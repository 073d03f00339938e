"""Inverse kinematics: poses are met within limits and with little torque, or it is said why not."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from planner.robots import (
    RobotFile,
    UnreachableError,
    robosimian,
    robot_of,
    solve_limbs,
    unreachable,
)
from planner.robots.limb_batch import Efforts, LimbBatch
from tests.suite.helpers.robots import arm

EARTH = np.array([0.0, 0.0, -9.81])
LIMBS = ("front_right", "rear_right", "rear_left", "front_left")


def uniform_angles(robot, rng):
    return {
        limb: rng.uniform(
            np.maximum(robot.model.lower[limb], -np.pi), np.minimum(robot.model.upper[limb], np.pi)
        )
        for limb in robot.limbs
    }


def shares(robot, poses, gravity=EARTH):
    """Wrenches on the rock of hands that carry equal parts of the weight."""
    force = robot.mass * gravity / len(poses)
    return {
        limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)]) for limb, pose in poses.items()
    }


def errors(robot, poses, solutions):
    """Largest distance [m] and angle [rad] of the hands from their poses, by forward kinematics."""
    there = robot.model.hand_poses({limb: s.angles for limb, s in solutions.items()})
    away = [np.linalg.norm(there[limb].position - pose.position) for limb, pose in poses.items()]
    turned = [
        Rotation.from_matrix(there[limb].rotation.T @ pose.rotation).magnitude()
        for limb, pose in poses.items()
    ]
    return max(away), max(turned)


def cost(robot, angles, loads, gravity=EARTH):
    """Σ (τ / τ_max)² by limb, with τ = gravity torque + Jᵀ w."""
    bare = robot.model.statics(angles, gravity).joint_torque
    jacobians = robot.model.jacobians(angles)
    return {
        limb: np.sum(
            ((bare[limb] + jacobians[limb].T @ loads[limb]) / robot.torque_limits[limb]) ** 2
        )
        for limb in loads
    }


def within_limits(robot, solutions):
    return all(
        np.all(robot.model.lower[limb] <= s.angles) and np.all(s.angles <= robot.model.upper[limb])
        for limb, s in solutions.items()
    )


@pytest.mark.parametrize("loaded", [False, True], ids=["bare", "loaded"])
def test_a_thousand_reachable_poses(loaded):
    """At least 99 % of them are met, and those that are said to be met are."""
    robot, rng = robosimian(), np.random.default_rng(2026)
    solved = 0
    for _ in range(250):
        poses = robot.model.hand_poses(uniform_angles(robot, rng))
        asked = {"loads": shares(robot, poses), "gravity": EARTH} if loaded else {}
        found = solve_limbs(robot, poses, **asked)
        solved += sum(solution.solved for solution in found.values())
        met = {limb: solution for limb, solution in found.items() if solution.solved}
        away, turned = errors(robot, {limb: poses[limb] for limb in met}, met)
        assert away <= 1e-6
        assert turned <= 1e-6
        assert within_limits(robot, found)
    assert solved >= 990


def test_the_stretched_zero_pose_is_met():
    robot = robosimian()
    poses = robot.model.hand_poses({})
    found = solve_limbs(robot, poses, loads=shares(robot, poses), gravity=EARTH)
    assert all(solution.solved for solution in found.values())
    assert max(errors(robot, poses, found)) <= 1e-6


def test_a_limb_stretched_to_its_end_is_met_or_said_to_be_barely_out_of_reach():
    toml, text = arm(7)
    robot = robot_of(RobotFile("arms", toml, text))
    poses = robot.model.hand_poses({})
    (found,) = solve_limbs(robot, poses).values()
    assert found.position_error <= 1e-6
    assert found.solved


# --- the redundant joint


@pytest.mark.parametrize("seed", range(5))
def test_lowered_torques_are_a_minimum_among_the_postures_nearby(seed):
    """From the answer, any self-motion that stays within the limits raises the cost."""
    robot, rng = robosimian(), np.random.default_rng(seed)
    poses = robot.model.hand_poses(uniform_angles(robot, rng))
    loads = shares(robot, poses)
    found = solve_limbs(robot, poses, loads=loads, gravity=EARTH)
    # again from there, so that it has converged
    for _ in range(3):
        found = solve_limbs(
            robot,
            poses,
            seeds={limb: solution.angles for limb, solution in found.items()},
            loads=loads,
            gravity=EARTH,
        )
    least = cost(robot, {limb: solution.angles for limb, solution in found.items()}, loads)
    jacobians = robot.model.jacobians({limb: s.angles for limb, s in found.items()})
    for limb, solution in found.items():
        along = null_space(jacobians[limb])[:, 0]
        for step in (-0.02, 0.02):
            near = solution.angles + step * along
            low, high = robot.model.lower[limb], robot.model.upper[limb]
            if np.any(near < low) or np.any(near > high):
                continue
            moved = solve_limbs(robot, {limb: poses[limb]}, seeds={limb: near})[limb]
            if not moved.solved or np.abs(moved.angles - solution.angles).max() > 0.1:
                continue
            other = cost(robot, {limb: moved.angles}, {limb: loads[limb]})[limb]
            assert other >= least[limb] * (1.0 - 1e-5)


def test_lowering_does_lower():
    """From the same start, torques are never higher, and mostly lower."""
    robot, rng = robosimian(), np.random.default_rng(11)
    ratios = []
    for _ in range(20):
        angles = uniform_angles(robot, rng)
        poses = robot.model.hand_poses(angles)
        loads = shares(robot, poses)
        found = solve_limbs(robot, poses, seeds=angles, loads=loads, gravity=EARTH)
        before = cost(robot, angles, loads)
        after = cost(robot, {limb: solution.angles for limb, solution in found.items()}, loads)
        ratios += [after[limb] / before[limb] for limb in LIMBS]
    assert max(ratios) <= 1.0 + 1e-9
    assert np.median(ratios) < 0.95


@pytest.mark.parametrize("gravity", [EARTH, np.array([3.0, -2.0, 1.0]), np.zeros(3)])
def test_efforts_are_the_torques_of_the_model_over_the_limits(gravity):
    robot, rng = robosimian(), np.random.default_rng(4)
    angles = uniform_angles(robot, rng)
    poses = robot.model.hand_poses(angles)
    loads = {limb: rng.normal(size=6) * 50.0 for limb in LIMBS}
    batch = LimbBatch(robot, poses)
    stacked = np.array([[angles[limb] for limb in LIMBS]])
    efforts, slopes = Efforts(batch, loads, gravity)(stacked)
    bare, jacobians = (
        robot.model.statics(angles, gravity).joint_torque,
        robot.model.jacobians(angles),
    )
    for i, limb in enumerate(LIMBS):
        torque = bare[limb] + jacobians[limb].T @ loads[limb]
        np.testing.assert_allclose(efforts[0, i], torque / robot.torque_limits[limb], atol=1e-12)
    step = 1e-6
    for j in range(7):
        ahead, behind = stacked.copy(), stacked.copy()
        ahead[..., j] += step
        behind[..., j] -= step
        change = Efforts(batch, loads, gravity).__call__
        slope = (change(ahead)[0] - change(behind)[0]) / (2 * step)
        np.testing.assert_allclose(slopes[0, :, :, j], slope[0], atol=1e-7)


def test_the_load_decides_which_posture_is_taken():
    robot, rng = robosimian(), np.random.default_rng(8)
    poses = robot.model.hand_poses(uniform_angles(robot, rng))
    pull = {limb: np.array([0.0, 0.0, -300.0, 0.0, 0.0, 0.0]) for limb in LIMBS}
    turn = {limb: np.array([0.0, 0.0, 0.0, 40.0, 40.0, 0.0]) for limb in LIMBS}
    found = {
        name: solve_limbs(robot, poses, loads=loads, gravity=EARTH)
        for name, loads in (("pull", pull), ("turn", turn))
    }
    angles = {
        name: {limb: solution.angles for limb, solution in solutions.items()}
        for name, solutions in found.items()
    }
    own, other = cost(robot, angles["pull"], pull), cost(robot, angles["turn"], pull)
    assert sum(own.values()) < sum(other.values())


# --- the same and the near


def test_the_same_question_has_the_same_answer():
    robot, rng = robosimian(), np.random.default_rng(3)
    asked = [robot.model.hand_poses(uniform_angles(robot, rng)) for _ in range(6)]
    alone = [solve_limbs(robot, poses) for poses in asked]
    with ThreadPoolExecutor(3) as pool:
        again = list(pool.map(lambda poses: solve_limbs(robot, poses), reversed(asked)))[::-1]
    for first, second in zip(alone, again, strict=True):
        for limb in LIMBS:
            np.testing.assert_array_equal(first[limb].angles, second[limb].angles)


def test_from_a_seed_the_answer_nearby_is_found():
    """A limb that is followed along a path of its hand does not jump."""
    robot, rng = robosimian(), np.random.default_rng(6)
    here, there = ({limb: rng.uniform(-1.0, 1.0, 7) for limb in LIMBS} for _ in range(2))
    angles = here
    for part in np.linspace(0.0, 1.0, 41):
        way = {limb: (1 - part) * here[limb] + part * there[limb] for limb in LIMBS}
        found = solve_limbs(robot, robot.model.hand_poses(way), seeds=angles)
        for limb in LIMBS:
            assert found[limb].solved
            assert np.abs(found[limb].angles - angles[limb]).max() < 0.3
        angles = {limb: solution.angles for limb, solution in found.items()}


def test_a_useless_seed_does_no_harm():
    robot, rng = robosimian(), np.random.default_rng(9)
    for _ in range(10):
        poses = robot.model.hand_poses(uniform_angles(robot, rng))
        found = solve_limbs(robot, poses, seeds={limb: np.full(7, 40.0) for limb in LIMBS})
        assert all(solution.solved for solution in found.values())
        assert within_limits(robot, found)


def test_limbs_do_not_hang_on_each_other():
    robot, rng = robosimian(), np.random.default_rng(12)
    poses = robot.model.hand_poses(uniform_angles(robot, rng))
    together = solve_limbs(robot, poses)
    for limb in LIMBS:
        alone = solve_limbs(robot, {limb: poses[limb]})
        assert list(alone) == [limb]
        np.testing.assert_allclose(alone[limb].angles, together[limb].angles, atol=1e-9)


# --- out of reach


@pytest.mark.parametrize("limb", LIMBS)
@pytest.mark.parametrize("distance", [0.001, 0.12, 2.0])
def test_what_is_missing_beyond_the_stretched_limb(limb, distance):
    robot, rng = robosimian(), np.random.default_rng(1)
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    turn = Rotation.random(random_state=5).as_matrix()
    link = Pose(robot.shoulders[limb] + (robot.reach + distance) * way, turn)
    pose = link @ robot.hand_in_link[limb]
    found = solve_limbs(robot, {limb: pose})
    solution = found[limb]
    assert not solution.solved
    # nothing can be nearer, and with the asked axes the stretched limb costs no more than itself
    assert distance - 1e-9 <= solution.missing <= distance + robot.reach
    assert solution.position_error >= distance - 1e-9
    error = unreachable(found)
    assert error.missing == {limb: solution.missing}
    assert limb in str(error)


def test_a_hold_that_moves_away_is_missed_by_more_and_more():
    """The hand keeps its axes; each step of 0.1 m away costs between nothing and 0.1 m more."""
    robot = robosimian()
    start = robot.model.hand_poses({"front_right": np.array([0.3, 1.0, 0.2, -1.2, 0.4, 0.6, 0.1])})
    pose = start["front_right"]
    away = pose.position - robot.shoulders["front_right"]
    away /= np.linalg.norm(away)
    missing = []
    for steps in range(8):
        moved = Pose(pose.position + 0.1 * steps * away, pose.rotation)
        found = solve_limbs(robot, {"front_right": moved})["front_right"]
        assert (found.missing == 0.0) == found.solved
        missing.append(found.missing)
    assert missing[0] == 0.0
    assert missing[-1] > 0.1
    assert (np.diff(missing) >= -2e-3).all()
    assert (np.diff(missing) <= 0.1 + 2e-3).all()


def test_every_limb_that_is_out_of_reach_is_named():
    robot = robosimian()
    poses = robot.model.hand_poses({limb: np.full(7, 0.4) for limb in LIMBS})
    for limb, away in (("rear_left", 3.0), ("front_right", 2.0)):
        poses[limb] = Pose(poses[limb].position + np.array([0.0, 0.0, away]), poses[limb].rotation)
    error = unreachable(solve_limbs(robot, poses))
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
    turned = robot.model.hand_poses({"arm": np.array([0.7])})["arm"]
    assert solve_limbs(robot, {"arm": turned})["arm"].angles == pytest.approx([0.7])
    lifted = Pose(turned.position + np.array([0.0, 0.0, 0.05]), turned.rotation)
    found = solve_limbs(robot, {"arm": lifted})
    assert not found["arm"].solved
    assert found["arm"].missing == pytest.approx(0.05, abs=1e-3)


def test_a_hand_in_its_place_but_not_turned_as_asked_is_told_so():
    toml, text = arm(1)
    robot = robot_of(RobotFile("arms", toml, text))
    pose = robot.model.hand_poses({"arm": np.array([0.3])})["arm"]
    tilted = Pose(pose.position, pose.rotation @ Rotation.from_rotvec([0.2, 0, 0]).as_matrix())
    error = unreachable(solve_limbs(robot, {"arm": tilted}))
    assert error.turned["arm"] == pytest.approx(0.2, rel=0.05)
    assert str(error) == "arm cannot be turned as asked, by 0.2 rad"


def test_nothing_is_unreachable_where_all_is_solved():
    robot = robosimian()
    assert unreachable(solve_limbs(robot, robot.model.hand_poses({}))) is None
    assert solve_limbs(robot, {}) == {}


# --- robots of one's own


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
@pytest.mark.parametrize("joints", [3, 5, 6, 7, 8, (8, 6), (2, 7)])
def test_limbs_of_other_numbers_of_joints(joints, kind):
    """Poses that the limb has are met, the limits kept; with fewer than six joints as well."""
    robot = robot_of(RobotFile("arms", *arm(joints, ("left", "right"), kind)))
    rng, solved, tried = np.random.default_rng(0), 0, 25
    for _ in range(tried):
        poses = robot.model.hand_poses(uniform_angles(robot, rng))
        loads = shares(robot, poses)
        found = solve_limbs(robot, poses, loads=loads, gravity=EARTH)
        assert within_limits(robot, found)
        met = {limb: solution for limb, solution in found.items() if solution.solved}
        solved += len(met)
        if met:
            assert max(errors(robot, {limb: poses[limb] for limb in met}, met)) <= 1e-6
    assert solved >= 0.95 * 2 * tried


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"poses": {"tail": Pose.identity()}}, "poses: unknown limb 'tail'; known are front_right"),
        ({"seeds": {"tail": np.zeros(7)}}, "seeds: unknown limb 'tail'"),
        ({"seeds": {"rear_left": np.zeros(6)}}, r"seeds.rear_left: expected 7 numbers"),
        ({"loads": {"rear_left": np.full(6, np.nan)}}, "loads.rear_left: every number must be fin"),
        ({"gravity": np.zeros(2)}, "gravity: expected 3 numbers"),
        (
            {"poses": {"rear_left": Pose(np.full(3, np.nan), np.eye(3))}},
            r"poses.rear_left.position: every number must be finite",
        ),
    ],
)
def test_impossible_questions_are_refused(asked, message):
    poses = {"rear_left": robosimian().model.hand_poses({})["rear_left"]}
    with pytest.raises(InvalidInputError, match=message):
        solve_limbs(robosimian(), **{"poses": poses, **asked})
