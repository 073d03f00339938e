"""Stances with joints: hands where given angles put them, a limb worked by hand."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.hand import Grasp
from hand_models.rock import Cylinder, Hold
from hand_models.tile import Surface
from planner.question import EARTH_GRAVITY, ForceCap, HandOnHold, Limits, Load, Question, Stance
from planner.robots import Robot, RobotFile, robosimian, robot_of
from tests.suite.helpers.robots import TWO_LINK, limbs_toml
from tests.suite.helpers.stances import random_hold, random_surface


def two_link_robot(tip: float = 0.1, torque: str = "80.0") -> Robot:
    """A trunk with one limb of 0.6 and 0.4 + ``tip`` m, which turns about y from (0.5, 0, 0)."""
    return robot_of(RobotFile("arm", limbs_toml("arm", {"leg": "foot"}, tip, torque), TWO_LINK))


def at_joints(
    robot: Robot,
    angles: dict[str, np.ndarray],
    limbs: tuple[str, ...],
    *,
    body: Pose | None = None,
    hold: Hold | None = None,
    surface: Surface | None = None,
    gravity=EARTH_GRAVITY,
    **grasp,
) -> Stance:
    """Hands of those limbs where the angles put them, each seated on a hold of its own."""
    body = Pose.identity() if body is None else body
    there = robot.hand_poses(angles)
    hands = tuple(
        HandOnHold(
            limb,
            body @ there[limb],
            Cylinder(0.3) if hold is None else hold,
            Surface.named("rock") if surface is None else surface,
            grasp=Grasp(**{"outer_rotation": math.pi, **grasp}),
        )
        for limb in limbs
    )
    return Stance(hands, body, np.array(gravity, dtype=float), robot, angles)


def random_question_with_joints(seed: int, **kwargs) -> Question:
    """RoboSimian with random angles, holds, gravity, acceleration, limits on torques and forces."""
    rng = np.random.default_rng(seed)
    robot = robosimian()
    angles = {limb: rng.uniform(-1.5, 1.5, 7) for limb in robot.limbs}
    there = robot.hand_poses(angles)
    body = Pose(rng.uniform(-3.0, 3.0, 3), Rotation.random(random_state=seed).as_matrix())
    limbs = [str(limb) for limb in rng.permutation(robot.limbs)[: rng.integers(2, 5)]]
    hands = tuple(
        HandOnHold(
            limb,
            body @ there[limb],
            random_hold(rng),
            random_surface(rng),
            grasp=Grasp(outer_rotation=float(rng.choice([0.0, math.pi]))),
        )
        for limb in limbs
    )
    gravity = rng.normal(size=3) * rng.uniform(0.3, 5.0)
    torques = (None, 80.0, {limbs[0]: tuple(rng.uniform(50.0, 300.0, 7))})
    ranges = ((-100.0, 200.0), (-300.0, 0.0), (-150.0, math.inf))
    caps = (
        {},
        {limbs[0]: ForceCap(float(rng.uniform(50.0, 300.0)))},
        {limbs[-1]: ForceCap(ranges, str(rng.choice(["hand", "body", "world"])))},
    )
    limits = Limits(joint_torque=torques[rng.integers(3)], per_hand=caps[rng.integers(3)])
    load = Load(
        acceleration=tuple(rng.normal(size=3)), angular_acceleration=tuple(rng.normal(size=3))
    )
    stance = Stance(hands, body, gravity, robot, angles)
    return Question(stance, load=load, limits=limits, **kwargs)
