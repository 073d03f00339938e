"""Robots for the tests, as texts: a two-link arm worked by hand, and arms of 5, 6 and 8 joints."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose
from planner.robots import LinkTree, Robot, RobotFile, robot_of
from planner.robots.robot_file import Mount, RobotDescription

ROBOT_TOML = """
name = "{name}"
urdf = "{name}.urdf"
body = "trunk"

[every_limb]
position = {{ value = [{tip}, 0.0, 0.0], unit = "m", source = "assumed" }}
orientation = {{ value = [0.0, 0.0, 0.0, 1.0], unit = "1", source = "assumed" }}
torque_limit = {{ value = {torque}, unit = "N·m", source = "assumed" }}

"""


def limbs_toml(name, links, tip=0.1, torque="80.0"):
    """The file of a robot with a limb of each name, on the link given for it."""
    limbs = "".join(f'[limbs.{limb}]\nlink = "{link}"\n' for limb, link in links.items())
    return ROBOT_TOML.format(name=name, tip=tip, torque=torque) + limbs


def joint(name, kind, parent, child, xyz="0 0 0", axis="0 0 1", limit="-2.5 2.5", inner=""):
    low, high = limit.split()
    bounds = f'<limit lower="{low}" upper="{high}" effort="0" velocity="0"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="0 0 0"/><axis xyz="{axis}"/>'
        f"{bounds if kind in ('revolute', 'prismatic') else ''}{inner}</joint>"
    )


def link(name, mass=0.0, com="0 0 0", moment=0.0):
    if not mass:
        return f'<link name="{name}"/>'
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}" rpy="0 0 0"/><mass value="{mass}"/>'
        f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"/>'
        "</inertial></link>"
    )


def urdf(*parts):
    return f'<?xml version="1.0"?><robot name="test">{"".join(parts)}</robot>'


def bare_robot(text, body, hands, hand_mass, com=(0.0, 0.0, 0.0)):
    """A robot whose hands are points of that mass; ``hands``: each limb's link and place there."""
    mounts = {
        limb: Mount(link, Pose(np.array(place), np.eye(3)), com, (80.0,))
        for limb, (link, place) in hands.items()
    }
    hand = SimpleNamespace(mass=hand_mass)
    return Robot(RobotDescription("test", "", body, None, mounts), text, hand)


def with_hand(robot, hand):
    """The robot with another hand on every limb."""
    return Robot(robot.description, robot.urdf, hand)


def refusal(toml, text):
    """The line in which a robot is refused, after its file's name."""
    with pytest.raises(InvalidInputError) as caught:
        robot_of(RobotFile("walker", toml, text, "walker.toml"))
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith("walker.toml: ")
    return message.removeprefix("walker.toml: ")


def check_link_tree(robot, angles, gravity, acceleration):
    """Pinocchio's kinematics and statics must be those of the links, moment by moment."""
    wrenches = {limb: 10.0 * np.arange(1.0, 7.0) * (i + 1) for i, limb in enumerate(robot.limbs)}
    tree = LinkTree(robot).hold_up(angles, wrenches, gravity, acceleration)
    statics, found = robot.statics(angles, gravity, acceleration), robot.kinematics(angles)
    np.testing.assert_allclose(tree.body_wrench, statics.body_wrench, rtol=1e-9, atol=1e-9)
    for limb, (pose, jacobian) in found.items():
        np.testing.assert_allclose(tree.hands[limb].position, pose.position, atol=1e-12)
        np.testing.assert_allclose(tree.hands[limb].rotation, pose.rotation, atol=1e-12)
        torque = statics.joint_torque[limb] + jacobian.T @ wrenches[limb]
        np.testing.assert_allclose(tree.torques[limb], torque, rtol=1e-9, atol=1e-9)


TWO_LINK = urdf(
    link("trunk", 10.0, "0 0 0.1"),
    joint("hip", "revolute", "trunk", "thigh", "0.5 0 0", "0 1 0"),
    link("thigh", 2.0, "0.3 0 0"),
    joint("knee", "continuous", "thigh", "shank", "0.6 0 0", "0 1 0"),
    link("shank", 1.0, "0.2 0 0"),
    joint("ankle", "fixed", "shank", "foot", "0.4 0 0"),
    link("foot"),
    joint("neck", "prismatic", "trunk", "head", "0 0 0.4", "0 0 1", "0.1 0.2"),
    link("head", 0.5),
)
"""A planar limb of 0.6 and 0.4 m that begins at x = 0.5 m and turns about y; a head on a slide."""

AXES = ("0 0 1", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0", "0 1 0")
"""Of an arm's joints, from the body outward."""


def arm(joints, limbs=("arm",), kind="revolute", torque="80.0"):
    """A robot with an arm of so many joints, or of those many each, on the sides of its trunk."""
    counts = [joints] * len(limbs) if isinstance(joints, int) else joints
    parts = [link("trunk", 20.0, "0 0 0.05", 0.3)]
    for i, (limb, count) in enumerate(zip(limbs, counts, strict=True)):
        names = ["trunk", *(f"{limb}{k}" for k in range(1, count + 1))]
        for k, (parent, child) in enumerate(pairwise(names)):
            offset = f"0.2 {0.3 * (-1) ** i} 0" if k == 0 else f"{0.05 + 0.06 * (k % 3)} 0 0.02"
            parts.append(joint(f"{child}_joint", kind, parent, child, offset, AXES[k]))
            parts.append(link(child, 1.0 / (k + 1), "0.05 0.01 0", 0.002))
    links = {limb: f"{limb}{count}" for limb, count in zip(limbs, counts, strict=True)}
    return limbs_toml("arms", links, torque=torque), urdf(*parts)
