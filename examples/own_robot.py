"""Describe a robot of your own, and plan with its joints' torques.

Usage: ``python examples/own_robot.py [folder]``

It has two limbs of three joints in one plane, and SpinyHands. A real robot has a URDF already: then
only the TOML file is to be written.
"""

import math
import sys
from pathlib import Path

import numpy as np

from hand_models import Cylinder, Grasp, Pose, Surface
from planner import HandOnHold, Question, RobotFile, Stance, plan, robot_of

LENGTH = 0.3
"""Of a link [m]."""

LINK = """
<link name="{name}"><inertial><origin xyz="0 0 {middle}"/><mass value="1.5"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}_joint" type="revolute"><parent link="{parent}"/><child link="{name}"/>
  <origin xyz="0 0 {start}"/><axis xyz="0 1 0"/>
  <limit lower="-2.6" upper="2.6" effort="80" velocity="1"/></joint>"""

ROBOT = """
name = "pair"
urdf = "pair.urdf"
body = "torso"

[every_limb]
position = [0.05, 0.0, 0.0]
orientation = [0.7071068, 0.0, 0.7071068, 0.0]
torque_limit = { value = 80.0, unit = "N·m", source = "measured", note = "its data sheet" }

[limbs.upper]
link = "upper_3"

[limbs.lower]
link = "lower_3"
"""


def write_robot(folder: Path) -> Path:
    """Write the robot's files, and return the path of that which describes it."""
    links = []
    for limb, way in (("upper", 1.0), ("lower", -1.0)):
        parent, start = "torso", 0.2 * way
        for number in (1, 2, 3):
            name, length = f"{limb}_{number}", LENGTH if number < 3 else 0.0
            middle = 0.5 * way * length
            links.append(LINK.format(name=name, parent=parent, start=start, middle=middle))
            parent, start = name, way * length
    torso = """<link name="torso"><inertial><mass value="15"/>
  <inertia ixx="0.3" iyy="0.3" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
    urdf = f'<robot name="pair">{torso}{"".join(links)}</robot>'
    (folder / "pair.urdf").write_text(urdf, encoding="utf-8")
    file = folder / "pair.toml"
    file.write_text(ROBOT, encoding="utf-8")
    return file


def main(folder: Path) -> None:
    """Describe the robot, plan, and print what hands and joints bear."""
    robot = robot_of(RobotFile.load(write_robot(folder)))
    into_the_wall = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    hands = tuple(
        HandOnHold(
            limb=limb,
            pose=Pose(np.array([0.0, 0.0, up]), into_the_wall),
            hold=Cylinder(diameter=0.3),
            surface=Surface.named("rock"),
            grasp=Grasp(outer_rotation=math.pi),
        )
        for limb, up in (("upper", 0.5), ("lower", -0.5))
    )
    body = Pose(np.array([-0.4, 0.0, 0.0]), np.eye(3))
    answer = plan(Question(Stance(hands, body, robot=robot, joints="solve")))
    print(f"{robot.mass:.1f} kg, {answer.status}: utilisation {answer.utilisation:.2f}")
    print(answer.reason)
    for limb, torques in (answer.joint_torque or {}).items():
        print(limb, ", ".join(f"{torque:.1f} N·m" for torque in torques))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
