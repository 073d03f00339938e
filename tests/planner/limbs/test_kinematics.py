"""Compiled kinematics of limbs, against Pinocchio's."""

import numpy as np
import pytest

from planner.limbs import LimbChain
from planner.robots import robosimian
from tests.planner.robots.test_coupled_joints import random_arms

ROBOTS = {
    "robosimian": robosimian,
    "slides and followers": lambda: random_arms(1)[0],
    "others": lambda: random_arms(2)[0],
}


def random_angles(chain, count, seed=0):
    low, high = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
def test_frames_are_those_of_pinocchio(make):
    robot = make()
    for limb in robot.limbs:
        chain = LimbChain.of(robot, limb)
        angles = random_angles(chain, 20)
        for frame, q in zip(chain.frames(angles), angles, strict=True):
            pose = robot.hand_poses({limb: q})[limb]
            np.testing.assert_allclose(frame[:, :3], pose.rotation, atol=1e-12)
            np.testing.assert_allclose(frame[:, 3], pose.position, atol=1e-12)


@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
def test_centres_of_mass_are_those_of_pinocchio(make):
    """Moving one limb moves the robot's centre by what its own moves, by its share of the mass."""
    robot = make()
    for limb in robot.limbs:
        chain = LimbChain.of(robot, limb)
        angles = random_angles(chain, 10)
        before = chain.centres(robot.chains[limb].rest[None])[0]
        share = chain.masses.sum() / robot.mass
        for centre, q in zip(chain.centres(angles), angles, strict=True):
            moved = robot.com_at({limb: q}) - robot.com_at({})
            np.testing.assert_allclose(share * (centre - before), moved, atol=1e-12)


@pytest.mark.parametrize("make", ROBOTS.values(), ids=ROBOTS)
def test_a_hand_follows_to_a_pose_nearby(make):
    """The pose is that of Pinocchio, its angles are within limits, and no joint turns far."""
    robot, numbers = make(), np.array([1e-11, 0.2, 1e-4, 1e-12])
    for limb in robot.limbs:
        chain = LimbChain.of(robot, limb)
        for q in random_angles(chain, 10):
            near = np.clip(q + 0.02 * np.sin(np.arange(len(q)) + 1.0), chain.lower, chain.upper)
            pose = robot.hand_poses({limb: near})[limb]
            found = chain.follow(pose, q, numbers, 12)
            if found is None:
                # a singular limb may turn a joint by more
                J = robot.kinematics({limb: q})[limb][1]
                assert np.linalg.svd(J, compute_uv=False)[-1] < 0.1
                continue
            assert np.abs(found - q).max() <= 0.2
            assert ((chain.lower <= found) & (found <= chain.upper)).all()
            there = robot.hand_poses({limb: found})[limb]
            np.testing.assert_allclose(there.position, pose.position, atol=1e-9)
            np.testing.assert_allclose(there.rotation, pose.rotation, atol=1e-9)


def test_no_hand_is_beyond_its_span():
    robot = robosimian()
    for limb in robot.limbs:
        chain = LimbChain.of(robot, limb)
        assert (chain.spans(chain.frames(random_angles(chain, 2000))) <= 1.0).all()
