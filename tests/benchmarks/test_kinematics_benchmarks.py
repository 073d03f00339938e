"""How long RoboSimian's kinematics take: inverse for four limbs, and forward with its statics.

Poses are those of random joint angles; each round asks the next of them, so that the medians are
those over poses.
"""

from itertools import cycle

import numpy as np
import pytest

from planner.robots import robosimian, solve_limbs

EARTH = np.array([0.0, 0.0, -9.81])

POSES = 50
"""Sets of four poses that are asked in turn."""


def random_angles(count):
    rng = np.random.default_rng(7)
    model = robosimian().model
    return [
        {limb: rng.uniform(model.lower[limb], model.upper[limb]) for limb in model.limbs}
        for _ in range(count)
    ]


def questions(loaded):
    """Poses of all hands, with the wrenches of hands that carry equal parts of the weight."""
    robot = robosimian()
    asked = []
    for angles in random_angles(POSES):
        poses = robot.model.hand_poses(angles)
        force = robot.mass * EARTH / len(poses)
        loads = {
            limb: np.concatenate([pose.rotation.T @ force, np.zeros(3)])
            for limb, pose in poses.items()
        }
        asked.append((poses, {"loads": loads, "gravity": EARTH} if loaded else {}))
    return asked


@pytest.mark.benchmark(group="inverse kinematics of four limbs")
@pytest.mark.parametrize("loaded", [False, True], ids=["any angles", "torques lowered"])
def test_four_limbs(benchmark, loaded):
    robot, turn = robosimian(), cycle(questions(loaded))
    solve_limbs(robot, questions(loaded)[0][0])  # looks up its postures once

    def ask():
        poses, more = next(turn)
        return solve_limbs(robot, poses, **more)

    found = benchmark.pedantic(ask, rounds=4 * POSES, warmup_rounds=2)
    assert all(solution.solved for solution in found.values())


@pytest.mark.benchmark(group="inverse kinematics of four limbs")
def test_four_limbs_from_angles_nearby(benchmark):
    robot = robosimian()
    nearby = [
        (robot.model.hand_poses({limb: a + 0.02 for limb, a in angles.items()}), angles)
        for angles in random_angles(POSES)
    ]
    turn = cycle(nearby)

    def ask():
        poses, seeds = next(turn)
        return solve_limbs(robot, poses, seeds=seeds)

    found = benchmark.pedantic(ask, rounds=4 * POSES, warmup_rounds=2)
    assert all(solution.solved for solution in found.values())


@pytest.mark.benchmark(group="poses, Jacobians and statics of the robot")
def test_forward_kinematics_and_statics(benchmark):
    model, turn = robosimian().model, cycle(random_angles(POSES))

    def ask():
        angles = next(turn)
        return model.kinematics(angles), model.statics(angles, EARTH)

    kinematics, statics = benchmark(ask)
    assert len(kinematics) == 4
    np.testing.assert_allclose(statics.body_wrench[:3], -model.mass * EARTH, atol=1e-9)
