"""A robot with sixteen hands, and questions about some of them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from hand_models.base import Pose, wrench_transport
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import Grasp
from hand_models.rock import Cylinder
from planner.prepare.hand_sets import wrist_at
from planner.prepare.settled_stance import settle_stance
from planner.question import HandOnHold, Question, Stance
from planner.robots import Robot, RobotFile, robot_of
from tests.suite.helpers.robots import joint, link, urdf
from tests.suite.helpers.stances import ROCK, wall

LIMBS = tuple(f"limb{i:02d}" for i in range(16))

ARM = """
[limbs.{limb}]
link = "{limb}_hand"
position = {{ value = [0.0, 0.0, 0.0], unit = "m", source = "assumed" }}
orientation = {{ value = [1.0, 0.0, 0.0, 0.0], unit = "1", source = "assumed" }}
torque_limit = {{ value = 150.0, unit = "N·m", source = "assumed" }}
"""


def crawler_in(folder: Path) -> Robot:
    """A plate on a wall with sixteen arms of three joints, eight on each side, read from files."""
    parts = [link("plate", 12.0, "0 0 0.02", 0.5)]
    for i, limb in enumerate(LIMBS):
        place = f"{0.35 * (i % 8) - 1.225} {0.3 if i < 8 else -0.3} 0"
        parts += [
            joint(f"{limb}_yaw", "revolute", "plate", f"{limb}_root", place, "0 0 1"),
            link(f"{limb}_root", 0.4),
            joint(f"{limb}_hip", "revolute", f"{limb}_root", f"{limb}_arm", "0.03 0 0", "0 1 0"),
            link(f"{limb}_arm", 0.6, "0.12 0 0"),
            joint(f"{limb}_wrist", "revolute", f"{limb}_arm", f"{limb}_hand", "0.25 0 0", "0 1 0"),
            link(f"{limb}_hand", 0.1),
        ]
    toml = 'name = "crawler"\nurdf = "crawler.urdf"\nbody = "plate"\n'
    (folder / "crawler.urdf").write_text(urdf(*parts))
    (folder / "crawler.toml").write_text(toml + "".join(ARM.format(limb=limb) for limb in LIMBS))
    return robot_of(RobotFile.load(folder / "crawler.toml"))


def crawler_question(
    robot: Robot, count: int, floating: int = 0, *, joints: bool, seed: int = 0
) -> Question:
    """The robot on a steep wall with so many hands, the first ones floating."""
    chance = np.random.default_rng(100 * count + seed)
    angles = {}
    for limb in LIMBS:
        pitch = chance.uniform(0.5, 0.8)
        angles[limb] = np.array([chance.uniform(-0.5, 0.5), pitch, -pitch])
    there, body = robot.hand_poses(angles), Pose(np.zeros(3), wall(-0.2))
    hands = tuple(
        HandOnHold(
            limb,
            body @ there[limb],
            Cylinder(float(chance.uniform(0.25, 0.6))),
            ROCK,
            grasp=Grasp(outer_rotation=math.pi),
            wrist="floating" if i < floating else "fixed",
            tendon_preload=np.full(4, 45.0) if i < floating else None,
        )
        for i, limb in enumerate(chance.permutation(LIMBS)[:count].tolist())
    )
    stance = Stance(hands, body, robot=robot, joints=angles)
    wrench = None if count > 3 else given(stance, chance)
    return Question(stance if joints else replace(stance, joints=None), body_wrench=wrench)


def given(stance: Stance, chance: np.random.Generator) -> np.ndarray:
    """A body wrench that some loads of the hands give, by their own models."""
    body, total = stance.body.inverse(), np.zeros(6)
    for i, hand in enumerate(stance.hands):
        (settled,) = settle_stance(stance, [i])
        wrist = wrist_at(stance, i, settled)
        if wrist is None:
            space = wrench_space(settled)
            loads = [45.0 if c.endswith("/tension") else 0.0 for c in space.columns]
            wrench = space.wrench(np.array(loads))
        else:
            twist = chance.uniform(-1.0, 1.0, 6) * [*[1e-4] * 3, *[5e-4] * 3]
            wrench = wrist.hand.loads(twist[None]).wrenches[0]
        total -= wrench_transport(body @ hand.pose) @ wrench
    return total
