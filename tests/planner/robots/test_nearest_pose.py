"""Poses that no angles solve: how near a hand is put, and when it is out of reach all the same."""

from itertools import pairwise

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


@pytest.mark.parametrize("joints", [2, 3, 5])
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


def along_a_ray():
    """From within reach, straight away from the shoulder, with the same axes; by distance."""
    robot = robosimian()
    chain = robot.chains["front_right"]
    pose = robot.hand_poses({"front_right": np.array([0.3, 1.0, 0.2, -1.2, 0.4, 0.6, 0.1])})[
        "front_right"
    ]
    away = pose.position - chain.shoulder
    return robot, lambda far: shifted(pose, far * away / np.linalg.norm(away))


def followed(robot, poses):
    """Where the hand is put for each pose, what it is off, and its angles; None out of reach."""
    for pose in poses:
        try:
            angles = solve_limbs(robot, {"front_right": pose}, {}, STILL, NEAR)
        except UnreachableError:
            yield None
            continue
        yield robot.hand_poses(angles)["front_right"], off(robot, angles, {"front_right": pose})


def test_a_hand_that_goes_beyond_reach_does_not_jump():
    """To the end of the tolerance: the hand follows the pose, then stays behind."""
    robot, pose = along_a_ray()
    steps = [0.1075 + 0.0013 * k for k in range(16)]
    found = list(followed(robot, map(pose, steps)))
    reached = [each is not None for each in found]
    assert reached == sorted(reached, reverse=True)  # out of reach from somewhere on
    ends = [each for each in found if each is not None]
    assert 10 <= len(ends) < len(steps)
    missing = np.array([each["front_right"] for _, each in ends])
    assert missing[0].max() <= 1e-6
    assert np.all(missing <= NEAR)
    # it ends where the angle is at its tolerance, the distance already held at its own
    assert missing[-1] == pytest.approx(NEAR, rel=0.2)
    assert np.all(np.diff(missing, axis=0) >= -1e-5)
    moved = [np.linalg.norm(b.position - a.position) for (a, _), (b, _) in pairwise(ends)]
    turned = [
        Rotation.from_matrix(b.rotation.T @ a.rotation).magnitude()
        for (a, _), (b, _) in pairwise(ends)
    ]
    assert max(moved) <= 1.4e-3
    assert max(turned) <= 0.012
