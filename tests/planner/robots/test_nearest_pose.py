"""Poses that no angles solve: how near a hand is put, and when it is out of reach all the same."""

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from planner.robots import RobotFile, UnreachableError, robosimian, robot_of, solve_limbs
from tests.suite.helpers.robots import arm

NEAR = (0.01, 0.05)
"""How far off a hand may be [m, rad]."""

STILL = np.zeros(3)
"""Without gravity no posture is better than another."""


def robot_with(joints):
    return robot_of(RobotFile("arms", *arm(joints)))


def off(robot, angles, poses):
    """How far each hand is from its pose [m], and by how much it is turned [rad]."""
    there = robot.hand_poses(angles)
    return {
        limb: (
            np.linalg.norm(there[limb].position - pose.position),
            Rotation.from_matrix(there[limb].rotation.T @ pose.rotation).magnitude(),
        )
        for limb, pose in poses.items()
    }


def shifted(pose, way=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """A pose farther along axes of B, turned about its own."""
    return Pose(pose.position + way, pose.rotation @ Rotation.from_rotvec(turn).as_matrix())


@pytest.mark.parametrize(
    ("way", "turn"),
    [
        ((0.0, 0.0, 0.0), (0.0023, 0.0, 0.0)),
        ((0.0, 0.0, 0.009), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, -0.0099), (0.0, 0.049, 0.0)),  # each within its own
    ],
)
def test_a_pose_beside_a_circle_is_held_where_the_circle_is_nearest(way, turn):
    """One joint about z: what is off along z, or about x and y, no angle takes away."""
    robot = robot_with(1)
    pose = shifted(robot.hand_poses({"arm": np.array([0.7])})["arm"], way, turn)
    with pytest.raises(UnreachableError):
        solve_limbs(robot, {"arm": pose}, {}, STILL)
    found = solve_limbs(robot, {"arm": pose}, {}, STILL, NEAR)
    assert found["arm"] == pytest.approx([0.7], abs=2e-3)
    missing = np.linalg.norm(way), np.linalg.norm(turn)
    assert off(robot, found, {"arm": pose})["arm"] == pytest.approx(missing, abs=1e-4)


@pytest.mark.parametrize(
    ("way", "turn"), [((0.0, 0.0, 0.0), (0.051, 0.0, 0.0)), ((0.0, 0.0, 0.0101), (0.0, 0.0, 0.0))]
)
def test_what_is_farther_than_the_tolerance_is_out_of_reach(way, turn):
    robot = robot_with(1)
    pose = shifted(robot.hand_poses({"arm": np.array([0.7])})["arm"], way, turn)
    with pytest.raises(UnreachableError) as caught:
        solve_limbs(robot, {"arm": pose}, {}, STILL, NEAR)
    assert list(caught.value.missing) == ["arm"]


def test_only_limbs_that_are_out_of_reach_are_named():
    toml, text = arm(1, ("left", "right"))
    robot = robot_of(RobotFile("arms", toml, text))
    poses = robot.hand_poses({"left": np.array([0.3]), "right": np.array([-0.4])})
    poses = {limb: shifted(pose, (0.0, 0.0, 0.005)) for limb, pose in poses.items()}
    near = solve_limbs(robot, poses, {}, STILL, NEAR)
    assert off(robot, near, poses)["right"][0] == pytest.approx(0.005, abs=1e-4)
    poses["right"] = shifted(poses["right"], (0.0, 0.0, 0.4))
    with pytest.raises(UnreachableError) as caught:
        solve_limbs(robot, poses, {}, STILL, NEAR)
    assert list(caught.value.missing) == ["right"]


@pytest.mark.parametrize("joints", [2, 5])
def test_no_angles_come_nearer(joints):
    """Found again from many starts, by forward kinematics alone, within the limits."""
    robot, rng = robot_with(joints), np.random.default_rng(joints)
    chain = robot.chains["arm"]
    for _ in range(2):
        angles = rng.uniform(chain.lower, chain.upper)
        way, turn = (most * rng.uniform(0.2, 0.6) for most in NEAR)
        sides = rng.normal(size=(2, 3))
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        pose = shifted(robot.hand_poses({"arm": angles})["arm"], way * sides[0], turn * sides[1])

        def measure(angles, pose=pose):
            parts = np.array(off(robot, {"arm": angles}, {"arm": pose})["arm"]) / NEAR
            return float(parts @ parts)

        found = solve_limbs(robot, {"arm": pose}, {}, STILL, NEAR)["arm"]
        assert np.all((chain.lower <= found) & (found <= chain.upper))
        starts = [angles, *(np.clip(found + rng.normal(size=joints), chain.lower, chain.upper),)]
        bounds = list(zip(chain.lower, chain.upper, strict=True))
        least = min(minimize(measure, start, bounds=bounds).fun for start in starts)
        assert measure(found) <= least + 1e-4


def barely_out_of_reach(robot, limb, rng, by=0.006):
    """A pose that the limb has, moved so far that it is out of reach, and a little farther."""
    chain = robot.chains[limb]
    angles = rng.uniform(np.maximum(chain.lower, -3.0), np.minimum(chain.upper, 3.0))
    pose, away = robot.hand_poses({limb: angles})[limb], rng.normal(size=3)
    low, high = 0.0, 3.0
    for _ in range(9):
        middle = 0.5 * (low + high)
        try:
            solve_limbs(robot, {limb: shifted(pose, middle * away)}, {}, STILL)
            low = middle
        except UnreachableError:
            high = middle
    return shifted(pose, (high + by / np.linalg.norm(away)) * away)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_no_posture_of_seven_joints_comes_nearer(seed):
    """Many minima: twenty random postures are followed down."""
    robot, rng = robosimian(), np.random.default_rng(seed)
    limb = robot.limbs[seed % 4]
    chain = robot.chains[limb]
    pose = barely_out_of_reach(robot, limb, rng)

    def measure(angles):
        parts = np.array(off(robot, {limb: angles}, {limb: pose})[limb]) / NEAR
        return float(parts @ parts)

    bounds = list(zip(chain.lower, chain.upper, strict=True))
    starts = rng.uniform(np.maximum(chain.lower, -3.0), np.minimum(chain.upper, 3.0), (20, 7))
    least = min(minimize(measure, start, bounds=bounds).fun for start in starts)
    try:
        found = measure(solve_limbs(robot, {limb: pose}, {}, STILL, NEAR)[limb])
    except UnreachableError:
        assert least > 1.0
        return
    assert found <= 1.01 * least + 1e-4 or least > 1.0


WALL = Pose.from_quaternion([0.65, -0.4, -0.5], [np.cos(np.pi / 18), -np.sin(np.pi / 18), 0.0, 0.0])
"""A hand's in B, on a wall before the body, to the side."""

RAYS = {
    "stretched": (np.array([0.3, 1.0, 0.2, -1.2, 0.4, 0.6, 0.1]), None, 0.105),
    "sideways": (WALL, [0.0, -1.0, 0.0], 0.53),
}
"""Where a hand is, by its joints or in B; where it goes, or away from its shoulder; how far it
is already [m]."""


@pytest.mark.slow
@pytest.mark.parametrize("ray", RAYS)
def test_a_hand_that_goes_beyond_reach_does_not_jump(ray):
    """To the end of the tolerance: the hand follows the pose, then stays behind, and so do joints.

    Within reach, the joints of a limb with more than six may find another way.
    """
    robot, (there, away, begin) = robosimian(), RAYS[ray]
    limb = "front_right"
    pose = there if isinstance(there, Pose) else robot.hand_poses({limb: there})[limb]
    if away is None:
        away = pose.position - robot.chains[limb].shoulder
    away = np.array(away) / np.linalg.norm(away)
    found, reached = [], []
    for k in range(0, 28, 2):
        asked = {limb: shifted(pose, (begin + 0.0013 * k) * away)}
        try:
            answer = solve_limbs(robot, asked, {}, STILL, NEAR)
        except UnreachableError:
            reached.append(False)
            continue
        reached.append(True)
        found.append(
            (answer[limb], robot.hand_poses(answer)[limb], *off(robot, answer, asked)[limb])
        )
    assert reached == sorted(reached, reverse=True)  # out of reach from somewhere on
    assert 6 <= len(found) < 14
    missing = np.array([each[2:] for each in found])
    assert np.all(missing <= NEAR)
    assert np.all(np.diff(missing, axis=0) >= -1e-5)
    beyond = missing.max(axis=1) > 1e-6
    assert not beyond[0]
    assert np.count_nonzero(beyond) >= 4
    for (q, a, *_), (p, b, *_), both in zip(found, found[1:], beyond[:-1], strict=False):
        assert np.linalg.norm(b.position - a.position) <= 3e-3
        assert Rotation.from_matrix(b.rotation.T @ a.rotation).magnitude() <= 0.03
        if both:
            assert np.abs(p - q).max() <= 0.05
