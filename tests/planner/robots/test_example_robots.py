"""Robots that others use, as `example-robot-data` has them: each loads, and is planned for.

A robot's file is written as its user would: bare numbers, and where the refusal has a line to
write, that line. Palms are mounted to face the ground at some posture, and hold it there.
"""

import json
import math
import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import InvalidInputError, Pose
from planner.robots import Robot, RobotFile, robot_of
from service.commands.cli import run_command_line
from tests.suite.helpers.requests import pose
from tests.suite.helpers.robots import check_link_tree

pytestmark = pytest.mark.slow

DOWN = np.diag([1.0, -1.0, -1.0])
"""Axes in B of a palm that faces the ground, its fingers forward."""

TIP = 0.15
"""How far below its link's origin H is [m]."""


class Example(NamedTuple):
    """A robot of the package.

    Attributes
    ----------
    urdf : str
        Path in the package.
    body : str
        Link.
    limbs : dict of str to str
        Links that carry the hands.
    torque : float
        What a joint bears [N·m].
    refusal : str
        What is said without the line that it tells to write; nothing where none is needed.
    """

    urdf: str
    body: str
    limbs: dict[str, str]
    torque: float
    refusal: str = ""


def legs(form: str, *names: str) -> dict[str, str]:
    return {name: form.format(name) for name in names}


ANYMAL = "LF", "RF", "LH", "RH"
UNITREE = "FL", "FR", "RL", "RR"

EXAMPLES = {
    "anymal_b": Example(
        "anymal_b_simple_description/robots/anymal.urdf", "base", legs("{}_SHANK", *ANYMAL), 80.0
    ),
    "anymal_c": Example(  # links and joints of one name
        "anymal_c_simple_description/urdf/anymal.urdf", "base", legs("{}_SHANK", *ANYMAL), 80.0
    ),
    "b1": Example("b1_description/urdf/b1.urdf", "base", legs("{}_calf", *UNITREE), 140.0),
    "go2": Example("go2_description/urdf/go2.urdf", "base", legs("{}_calf", *UNITREE), 45.0),
    "hyq": Example(
        "hyq_description/robots/hyq_no_sensors.urdf",
        "base_link",
        legs("{}_lowerleg", "lf", "rf", "lh", "rh"),
        150.0,
    ),
    "solo": Example(
        "solo_description/robots/solo.urdf",
        "base_link",
        legs("{}_LOWER_LEG", "FL", "FR", "HL", "HR"),
        20.0,
    ),
    "solo12": Example(
        "solo_description/robots/solo12.urdf",
        "base_link",
        legs("{}_LOWER_LEG", "FL", "FR", "HL", "HR"),
        20.0,
    ),
    "laikago": Example(
        "laikago_description/urdf/laikago.urdf", "trunk", legs("{}_calf", *UNITREE), 40.0
    ),
    "icub": Example(  # a moment of -2.4e-35 kg·m², and a waist
        "icub_description/robots/icub.urdf",
        "base_link",
        legs("{}_hand", "l", "r") | {"left_leg": "l_foot", "right_leg": "r_foot"},
        60.0,
        "limbs 'l' and 'r' share joints 'torso_pitch', 'torso_roll', 'torso_yaw'",
    ),
    "centauro": Example(  # wheels whose limits are equal, and a waist
        "centauro_description/urdf/centauro.urdf",
        "pelvis",
        legs("{}_8", "arm1", "arm2") | {f"leg{i}": f"wheel_{i}" for i in range(1, 5)},
        300.0,
        "limbs 'arm1' and 'arm2' share joint 'torso_yaw'",
    ),
    "talos": Example(
        "talos_data/robots/talos_full_v2.urdf",
        "base_link",
        legs("arm_{}_7_link", "left", "right")
        | {"left_leg": "leg_left_6_link", "right_leg": "leg_right_6_link"},
        300.0,
        "limbs 'left' and 'right' share joints 'torso_1_joint', 'torso_2_joint'",
    ),
    "g1": Example(
        "g1_description/urdf/g1_29dof_rev_1_0.urdf",
        "pelvis",
        legs("{}_wrist_yaw_link", "left", "right")
        | {"left_leg": "left_ankle_roll_link", "right_leg": "right_ankle_roll_link"},
        120.0,
        "share joints 'waist_yaw_joint', 'waist_roll_joint', 'waist_pitch_joint'",
    ),
    "romeo": Example(
        "romeo_description/urdf/romeo.urdf",
        "base_link",
        legs("{}_wrist", "l", "r") | {"left_leg": "l_ankle", "right_leg": "r_ankle"},
        120.0,
        "limbs 'l' and 'r' share joint 'TrunkYaw'",
    ),
}


@pytest.fixture(scope="module")
def package() -> Path:
    """Where the URDFs are; they come with `pip install -e '.[robots]'`."""
    try:
        found = distribution("example-robot-data")
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed: pip install -e '.[robots]'")
    return Path(str(found.locate_file("cmeel.prefix/share/example-robot-data/robots")))


def toml(name: str, mounts: dict[str, tuple[Pose, str]], body: str, torque: float) -> str:
    """A robot's file; ``mounts``: H in its link, and that link."""
    lines = [f'name = "{name}"', 'urdf = "robot.urdf"', f'body = "{body}"', "[every_limb]"]
    lines.append(f"torque_limit = {torque}")
    for limb, (hand, link) in mounts.items():
        turn = Rotation.from_matrix(hand.rotation).as_quat().tolist()
        lines += [f"[limbs.{limb}]", f'link = "{link}"']
        lines += [f"position = {hand.position.tolist()}", f"orientation = {turn}"]
    return "\n".join(lines)


def bent(robot: Robot) -> dict[str, np.ndarray]:
    """Joints that are all a little bent, to and fro, within their limits [rad]."""
    return {
        limb: np.clip(0.4 * (-1.0) ** np.arange(len(chain.joints)), chain.lower, chain.upper)
        for limb, chain in robot.chains.items()
    }


@pytest.fixture(scope="module", params=EXAMPLES)
def loaded(request: pytest.FixtureRequest, package: Path, tmp_path_factory) -> tuple[Path, Robot]:
    """The robot's file, beside nothing but its URDF, and the robot."""
    name = request.param
    example = EXAMPLES[name]
    folder = tmp_path_factory.mktemp(name)
    urdf = (package / example.urdf).read_text("utf-8")
    (folder / "robot.urdf").write_text(urdf, "utf-8")
    straight = {
        limb: (Pose(np.array([0.0, 0.0, -TIP]), np.eye(3)), link)
        for limb, link in example.limbs.items()
    }
    text, line = toml(name, straight, example.body, example.torque), ""
    if example.refusal:
        with pytest.raises(InvalidInputError) as caught:
            robot_of(RobotFile(name, text, urdf))
        message = str(caught.value)
        assert "\n" not in message
        assert example.refusal in message
        line = re.search(r"write: (locked = \{.*\}), above", message).group(1) + "\n"
    robot = robot_of(RobotFile(name, line + text, urdf))
    there = robot.hand_poses(bent(robot))
    down = {}
    for limb, link in example.limbs.items():
        turn = there[limb].rotation.T @ DOWN
        down[limb] = Pose(turn @ [0.0, 0.0, TIP], turn), link
    path = folder / "robot.toml"
    path.write_text(line + toml(name, down, example.body, example.torque), "utf-8")
    return path, robot_of(RobotFile.load(path))


def test_all_of_its_mass_is_held_up_link_by_link(loaded: tuple[Path, Robot]) -> None:
    """Pinocchio's statics are the moments of the URDF's links about each axis."""
    _, robot = loaded
    acceleration = np.random.default_rng(0).normal(size=6)
    check_link_tree(robot, bent(robot), np.array([0.5, -0.4, -9.81]), acceleration)


@pytest.mark.parametrize("joints", ["given", "solve"])
def test_a_stance_on_the_ground_is_planned(
    joints: str, loaded: tuple[Path, Robot], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, robot = loaded
    angles = bent(robot)
    asked_for = robot.hand_poses(angles)
    given = {limb: each.tolist() for limb, each in angles.items()}
    asked = {
        "v": 1,
        "stance": {
            "body": pose(Pose.identity()),
            "joints": joints if joints == "solve" else given,
            "hands": [
                {
                    "limb": limb,
                    "pose": pose(hand),
                    "hold": {"shape": "plane"},
                    "surface": "rock",
                    "grasp": {"outer_rotation": math.pi},
                }
                for limb, hand in asked_for.items()
            ],
        },
    }
    stance = tmp_path / "stance.json"
    stance.write_text(json.dumps(asked))
    assert run_command_line(["plan", str(stance), "--robot", str(path), "--json"]) == 0
    out, err = capfd.readouterr()
    assert err == ""
    reply = json.loads(out)
    assert reply["status"] == "optimal"
    assert reply["verified"]
    weight = reply["body_wrench"][2] / 9.81
    assert weight == pytest.approx(robot.mass)
    hands = robot.hand_poses({limb: np.array(each) for limb, each in reply["joints"].items()})
    for limb, chain in robot.chains.items():
        found = np.array(reply["joints"][limb])
        assert np.all((chain.lower - 1e-6 <= found) & (found <= chain.upper + 1e-6))
        np.testing.assert_allclose(hands[limb].position, asked_for[limb].position, atol=1e-5)
        assert len(reply["joint_torque"][limb]) == len(found)
