"""Plans of named stances and the pictures that are drawn of them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

from hand_models import Grasp, Plane, Sphere
from hand_models.base import Pose
from planner.pictures import draw_plan
from planner.question import HandOnHold, Limits, Load, Question, Stance
from planner.robots import RobotFile, robot_of
from planner.solving import solve
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.hands import ROCK
from tests.suite.helpers.robots import TWO_LINK, arm, limbs_toml
from tests.suite.helpers.stances import ask, attainable_wrench, on_wall, wall

__all__ = ["answered", "drawn", "panels"]

OFF = 0.45
"""How far the body stands off the wall so that RoboSimian's limbs are bent [m]."""


@cache
def answered(name):
    """A question by name, and its plan."""
    solved = replace(on_wall(off=OFF), joints="solve")
    heavy = Load(mass=400.0, com=(0.1, 0.2, -0.1))
    two = replace(on_wall(off=OFF, limbs=("front_left", "rear_right")), joints="solve")
    bare = on_wall(off=OFF, limbs=("front_left", "front_right"), palm=False, lateral=False)
    bare = replace(bare, joints="solve")
    floating = on_wall(off=OFF)
    floating = replace(
        floating, hands=(replace(floating.hands[0], wrist="floating"), *floating.hands[1:])
    )
    questions = {
        "solved": lambda: Question(solved),
        "overloaded": lambda: Question(solved, load=heavy, limits=Limits(joint_torque=100.0)),
        "plain": lambda: Question(on_wall(off=OFF, overhang=-0.3)),
        "ceiling": lambda: Question(on_wall(overhang=math.pi / 2, off=OFF)),
        "floating": lambda: Question(floating),
        "two hands": lambda: Question(two),
        "infeasible": lambda: Question(bare, body_wrench=np.array([0.0, 100, 800, 300, 0, 0])),
        "flat wall": lambda: Question(on_wall(Plane(), off=OFF, outer_rotation=0.0)),
        "nails": lambda: requested("ledge"),
        "one limb": lambda: Question(standing("leg")),
        "two limbs": lambda: Question(
            own := standing("left", "right"),
            body_wrench=attainable_wrench(own, np.random.default_rng(0)),
        ),
        "spread": lambda: ask(on_wall(), "spread", "load_factor"),
    }
    question = questions[name]()
    return question, solve.plan(question)


def requested(name):
    """The question of a bundled example."""
    return questions.question(read_request(name))


def standing(*limbs):
    """A robot of one's own at given angles, its hands on balls where they are then."""
    toml, urdf = arm(7, limbs)
    if limbs == ("leg",):
        toml, urdf = limbs_toml("leg", {"leg": "foot"}), TWO_LINK
    robot = robot_of(RobotFile("own", toml, urdf))
    joints = {limb: np.linspace(0.2, 0.6, len(robot.chains[limb].joints)) for limb in robot.limbs}
    body = Pose(np.array([1.0, 2.0, 3.0]), wall())
    poses = robot.hand_poses(joints)
    hands = tuple(
        HandOnHold(limb, body @ poses[limb], Sphere(0.3), ROCK, grasp=Grasp()) for limb in limbs
    )
    return Stance(hands, body, robot=robot, joints=joints)


@cache
def drawn(name):
    """The picture of a question by name."""
    question, plan = answered(name)
    return draw_plan(plan, question)


def panels(figure):
    """The view in W, the one facing the rock and that from the side."""
    return figure.axes[:3]
