"""What joints bear where a robot's file does not say: the efforts of its URDF, if they are any."""

import re
from dataclasses import replace

import numpy as np
import pytest

from planner.question import Limits, Question
from planner.robots import RobotFile, robot_of
from planner.solving import plan
from tests.suite.helpers.robots import TWO_LINK, limbs_toml, refusal
from tests.suite.helpers.stances_with_joints import at_joints

TOML = re.sub(r"torque_limit = .*\n", "", limbs_toml("walker", {"leg": "foot"}))


def rated(hip, knee):
    """The two-link robot with these efforts; None: the joint has no limit element."""
    text = TWO_LINK.replace('effort="0"', f'effort="{hip}"', 1)
    if knee is None:
        return text
    inner = f'<axis xyz="0 1 0"/><limit effort="{knee}" velocity="3"/></joint><link name="shank">'
    return text.replace('<axis xyz="0 1 0"/></joint><link name="shank">', inner)


def robot(text, toml=TOML):
    return robot_of(RobotFile("walker", toml, text, "walker.toml"))


@pytest.mark.parametrize(
    ("hip", "knee"),
    [(180, 180), (90, 45.5), (1000, 900), (0.5, 12), (999, 999), (1e5, 2e5), (30, 1000)],
)
def test_efforts_are_taken_joint_by_joint(hip, knee):
    chain = robot(rated(hip, knee)).chains["leg"]
    np.testing.assert_array_equal(chain.torque_limits, [hip, knee])
    assert not chain.rated


@pytest.mark.parametrize(
    ("hip", "knee", "words"),
    [
        (0, 0, "no effort above 0 and up to 1e+06 N·m (sliding: N) for hip, knee;"),
        (100, 0, "for knee;"),
        (100, None, "for knee;"),
        (0, 100, "for hip;"),
        (100, 3e7, "for knee;"),
        (1000, 1000, "an effort of 1000 N·m (sliding: N) for every joint, which exporters write"),
        (1e4, 1e4, "an effort of 10000 N·m (sliding: N) for every joint"),
        (1000000, 1000000, "an effort of 1e+06 N·m (sliding: N) for every joint"),
    ],
)
def test_efforts_that_are_no_rating_are_refused(hip, knee, words):
    told = refusal(TOML, rated(hip, knee))
    assert told.startswith("limbs.leg.torque_limit: missing, and the URDF has ")
    assert words in told
    assert "give torque_limit" in told


def test_the_file_comes_before_the_urdf():
    for torque, expected in (("80.0", [80.0, 80.0]), ("[80.0, 0.0]", [80.0, 0.0])):
        toml = limbs_toml("walker", {"leg": "foot"}, torque=torque)
        chain = robot(rated(50, 60), toml).chains["leg"]
        np.testing.assert_array_equal(chain.torque_limits, expected)
        assert chain.rated


def test_plans_say_that_efforts_are_taken():
    arms = robot(rated(400, 300))
    stance = at_joints(arms, {"leg": np.array([0.3, 0.4])}, ("leg",))
    wrench = np.zeros(6)
    told = [text for text in plan(Question(stance, wrench)).warnings if "URDF" in text]
    assert told == [
        "leg: what the joints bear is the effort of the robot's URDF, 300 to 400 N·m; torque_limit "
        "in the robot's file, or limits.joint_torque, takes its place"
    ]
    for own in (90.0, {"leg": (90.0, 80.0)}):
        limited = Question(stance, wrench, limits=Limits(joint_torque=own))
        assert not any("URDF" in text for text in plan(limited).warnings)
    unknown = Question(replace(stance, joints=None), wrench)
    assert not any("URDF" in text for text in plan(unknown).warnings)


SPACES = (
    "http://www.ros.org/wiki/xacro",
    "http://ros.org/wiki/xacro",
    "http://wiki.ros.org/xacro",
    "http://other",
)
XACRO = [
    *(("<robot ", f'<robot xmlns:xacro="{space}" ', "<xacro:arm/>") for space in SPACES),
    ("<robot ", "<robot ", '<xacro:arm side="left"/>'),
    ('xyz="0.6 0 0"', 'xyz="${l} 0 0"', ""),
    ('value="2.0"', 'value="${m_thigh}"', ""),
    ('name="hip"', 'name="$(arg prefix)hip"', ""),
    ('name="thigh"', 'name="${side}_thigh"', ""),
    ('upper="2.5"', 'upper="${pi/2}"', ""),
    ('rpy="0 0 0"', 'rpy="0 0 ${radians(90)}"', ""),
    ("<link ", f'<xacro:hand xmlns:xacro="{SPACES[1]}"/><link ', ""),
]


@pytest.mark.parametrize(("old", "new", "more"), XACRO)
def test_a_xacro_is_named_with_what_expands_it(old, new, more):
    text = TWO_LINK.replace(old, new).replace("</robot>", f"{more}</robot>")
    assert text != TWO_LINK
    told = refusal(limbs_toml("walker", {"leg": "foot"}), text)
    assert told.startswith("urdf: must be a URDF; this is a xacro, which is not expanded")
    assert "xacro ROBOT.urdf.xacro > ROBOT.urdf" in told


@pytest.mark.parametrize(
    ("old", "new"),
    [
        # what an expanded file may still have
        ("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" '),
        ("<robot ", "<!-- made by xacro from ${this}, do not edit --><robot "),
        (
            '<link name="foot"/>',
            '<link name="foot"><visual><geometry><mesh filename="$(find foot)/foot.stl"/>'
            "</geometry></visual></link>",
        ),
    ],
)
def test_an_expanded_file_is_none(old, new):
    text = TWO_LINK.replace(old, new, 1)
    assert text != TWO_LINK
    assert robot(text, limbs_toml("walker", {"leg": "foot"})).limbs == ("leg",)
