"""How long RoboSimian's kinematics take: inverse for four limbs, and forward with its statics.

Poses are those of random joint angles; each round asks the next of them, so that the medians are
those over poses.
"""

from itertools import cycle

import numpy as np
import pytest

from planner.robots import robosimian, solve_limbs

pytestmark = pytest.mark.slow

EARTH = np.array([0.0, 0.0, -9.81])

POSES = 50
"""Sets of four poses that are asked in turn."""


def random_angles(count):
    rng = np.random.default_rng(7)
    chains = robosimian().chains
    return [
        {limb: rng.uniform(chain.lower, chain.upper) for limb, chain in chains.items()}
        for _ in range(count)
    ]


def questions():
    """Poses of all hands, with the wrenches of hands that carry equal parts of the weight."""
    robot = robosimian()
    asked = []
    for angles in random_angles(POSES):
        poses = robot.hand_poses(angles)
        force = robot.mass * EARTH / len(poses)
        loads = {
            limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)])
            for limb, pose in poses.items()
        }
        asked.append((poses, loads, EARTH))
    return asked


@pytest.mark.benchmark(group="inverse kinematics of four limbs")
def test_four_limbs(benchmark):
    robot, turn = robosimian(), cycle(questions())
    solve_limbs(robot, *questions()[0])  # looks up its postures once
    found = benchmark.pedantic(
        lambda: solve_limbs(robot, *next(turn)), rounds=4 * POSES, warmup_rounds=2
    )
    assert list(found) == list(robot.limbs)


@pytest.mark.benchmark(group="poses, Jacobians and statics of the robot")
def test_forward_kinematics_and_statics(benchmark):
    model, turn = robosimian(), cycle(random_angles(POSES))

    def ask():
        angles = next(turn)
        return model.kinematics(angles), model.statics(angles, EARTH)

    kinematics, statics = benchmark(ask)
    assert len(kinematics) == 4
    np.testing.assert_allclose(statics.body_wrench[:3], -model.mass * EARTH, atol=1e-9)
