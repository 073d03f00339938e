"""Robots as others have drawn them: names twice, waists, joints that cannot move, bare numbers."""

import re
import tomllib
from importlib import resources

import numpy as np
import pytest

from hand_models.base import Pose
from planner.robots import RobotFile, robot_of
from tests.suite.helpers.robots import (
    TWO_LINK,
    check_link_tree,
    joint,
    limbs_toml,
    link,
    refusal,
    urdf,
)

EARTH = np.array([0.5, -0.3, -9.81])
TURNED = np.array([0.2, 0.1, -0.3, 0.4, -0.2, 0.3])
"""Acceleration of a body [m/s², rad/s²]."""

WAIST = urdf(
    link("trunk", 8.0, "0 0 0.1", 0.2),
    joint("lift", "prismatic", "trunk", "column", "0 0 0.2", "0 0 1", "0.0 0.4"),
    link("column", 2.0, "0 0 0.1", 0.05),
    joint("waist-yaw", "revolute", "column", "loin", "0 0 0.1", "0 0 1", "0.1 1.5"),
    link("loin", 3.0, "0.02 0 0.05", 0.04),
    joint("waist.pitch", "continuous", "loin", "chest", "0 0 0.1", "0 1 0"),
    link("chest", 6.0, "0.03 0.01 0.2", 0.1),
    *(
        part
        for side, y in (("left", 0.2), ("right", -0.2))
        for part in (
            joint(f"{side}_shoulder", "revolute", "chest", f"{side}_upper", f"0.1 {y} 0.3"),
            link(f"{side}_upper", 1.5, "0.15 0 0", 0.02),
            joint(f"{side}_elbow", "revolute", f"{side}_upper", f"{side}_lower", "0.3 0 0"),
            link(f"{side}_lower", 1.0, "0.1 0 0", 0.01),
        )
    ),
)
"""A lift, two joints of a waist beyond it, and two arms on the chest."""

ARMS = limbs_toml("walker", {"left": "left_lower", "right": "right_lower"})
LOCKED = """
[locked]
lift = { value = 0.15, unit = "m", source = "measured" }
waist-yaw = { value = 0.7, unit = "rad", source = "measured", note = "brake" }
"waist.pitch" = -0.4
"""
ANGLES = {"left": np.array([0.3, -0.5]), "right": np.array([-0.2, 0.8])}


def robot(toml, text):
    return robot_of(RobotFile("walker", toml, text, "walker.toml"))


def agree(one, other, angles):
    """Two robots must stand and bear alike."""
    for a, b in zip(held_up(one, angles), held_up(other, angles), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


def held_up(robot, angles):
    """Body wrench, joint torques, hands and centre of mass of a robot, in one order."""
    statics = robot.statics(angles, EARTH, TURNED)
    yield statics.body_wrench
    yield from statics.joint_torque.values()
    for pose in robot.hand_poses(angles).values():
        yield from (pose.position, pose.rotation)
    yield robot.com_at(angles)


# names --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["thigh", "shank", "foot", "trunk", "free body", "universe"])
@pytest.mark.parametrize("old", ["hip", "ankle", "neck"])
def test_a_joint_may_have_the_name_of_a_link(name, old):
    """That moves, is fixed, or stays at zero; `universe` and the like are Pinocchio's own."""
    toml = limbs_toml("walker", {"leg": "foot"})
    plain = robot(toml, TWO_LINK)
    named = robot(toml, TWO_LINK.replace(f'joint name="{old}"', f'joint name="{name}"'))
    assert named.chains["leg"].joints == (name if old == "hip" else "hip", "knee")
    agree(named, plain, {"leg": np.array([0.3, -0.7])})
    check_link_tree(named, {"leg": np.array([0.3, -0.7])}, EARTH, TURNED)


@pytest.mark.parametrize("name", ["free body", "universe", "joint hip"])
def test_a_link_may_have_any_name(name):
    text = TWO_LINK.replace('"thigh"', f'"{name}"')
    found, plain = (robot(limbs_toml("walker", {"leg": "foot"}), t) for t in (text, TWO_LINK))
    agree(found, plain, {"leg": np.array([0.3, -0.7])})
    names = [frame.name for frame in found.model.frames]
    assert sorted(names) == sorted(
        name if frame.name == "thigh" else frame.name for frame in plain.model.frames
    )


# joints that do not move --------------------------------------------------------------------------


def test_a_joint_with_equal_limits_is_fixed_there():
    """The knee at 0.4 rad is as good as one whose shank is drawn so."""
    toml = limbs_toml("walker", {"leg": "foot"})
    bent = joint("knee", "revolute", "thigh", "shank", "0.6 0 0", "0 1 0", "0.4 0.4")
    free = joint("knee", "continuous", "thigh", "shank", "0.6 0 0", "0 1 0")
    drawn = joint("knee", "fixed", "thigh", "shank", "0.6 0 0").replace(
        'rpy="0 0 0"', 'rpy="0 0.4 0"'
    )
    assert free in TWO_LINK
    one, other = (robot(toml, TWO_LINK.replace(free, knee)) for knee in (bent, drawn))
    assert one.chains["leg"].joints == ("hip",)
    agree(one, other, {"leg": np.array([0.3])})
    check_link_tree(one, {"leg": np.array([0.3])}, EARTH, TURNED)


def test_a_limb_of_joints_whose_limits_are_equal_is_told_why_it_is_none():
    """As where a URDF leaves limits out: it takes these for zero."""
    text = re.sub(' type="continuous"', ' type="revolute"', TWO_LINK)
    bare = '<limit effort="0" velocity="0"/>'
    text = text.replace('<axis xyz="0 1 0"/></joint>', f'<axis xyz="0 1 0"/>{bare}</joint>')
    text = text.replace('lower="-2.5" upper="2.5" ', "")
    assert refusal(limbs_toml("walker", {"leg": "foot"}), text) == (
        "limbs.leg.link: no joint moves between 'trunk' and 'foot' (the limits of 'hip', 'knee' "
        "are equal); a limb has at least one"
    )


def test_a_waist_is_locked_where_the_file_says():
    """As good as a waist that is drawn there, with each joint's turn or shift in its origin."""
    walker = robot(ARMS + LOCKED, WAIST)
    assert walker.locked == {"lift": 0.15, "waist-yaw": 0.7, "waist.pitch": -0.4}
    assert walker.chains["left"].joints == ("left_shoulder", "left_elbow")
    text = WAIST
    for name, xyz, rpy in (
        ("lift", "0 0 0.35", "0 0 0"),
        ("waist-yaw", "0 0 0.1", "0 0 0.7"),
        ("waist.pitch", "0 0 0.1", "0 -0.4 0"),
    ):
        text, count = re.subn(
            rf'(<joint name="{name}" type=")\w+(".*?<origin )xyz=".*?" rpy=".*?"',
            rf'\1fixed\2xyz="{xyz}" rpy="{rpy}"',
            text,
        )
        assert count == 1
    agree(walker, robot(ARMS, text), ANGLES)
    check_link_tree(walker, ANGLES, EARTH, TURNED)


def test_a_lock_moves_what_is_beyond_it_and_nothing_else():
    """By hand: the left arm, stretched along x, is turned by the waist and lifted."""
    walker = robot(ARMS + LOCKED.replace("-0.4", "0.0"), WAIST)
    hand = walker.hand_poses({})["left"]
    c, s = np.cos(0.7), np.sin(0.7)
    reach = np.array([0.1 + 0.3 + 0.1, 0.2])  # the hand sits 0.1 m before the lower arm's joint
    place = [c * reach[0] - s * reach[1], s * reach[0] + c * reach[1], 0.2 + 0.15 + 0.1 + 0.1 + 0.3]
    np.testing.assert_allclose(hand.position, place, atol=1e-12)
    np.testing.assert_allclose(hand.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-12)


def test_what_limbs_share_is_told_with_the_line_that_locks_it():
    """The line itself makes the robot, every joint at zero or its limit that is nearest to it."""
    told = refusal(ARMS, WAIST)
    assert told == (
        "limbs.right.link: limbs 'left' and 'right' share joints 'lift', 'waist-yaw', "
        "'waist.pitch'; every limb needs joints of its own; to lock them, write: locked = "
        '{ lift = 0.0, waist-yaw = 0.1, "waist.pitch" = 0.0 }, above the first section'
    )
    line = re.search(r"write: (.*), above", told).group(1)
    assert robot(line + ARMS, WAIST).locked == {"lift": 0.0, "waist-yaw": 0.1, "waist.pitch": 0.0}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('link="left_lower"/>', 'link="left_lower"/><mimic joint="a"/>', "follows another (mimic)"),
        (
            'link="left_lower"/>',
            'link="left_lower"/><mimic joint="right_elbow"/>',
            "follows another (mimic), 'right_elbow', that no motor of this limb moves",
        ),
    ],
)
def test_a_joint_that_no_limb_can_have_is_told_with_what_locks_it(old, new, words):
    """Added to those that the file locks already."""
    head, elbow, tail = re.split(r"(<joint name=\"left_elbow\".*?</joint>)", WAIST)
    text = head + elbow.replace(old, new, 1) + tail
    told = refusal(ARMS + LOCKED, text)
    assert told.startswith(
        f"limbs.left.link: joint 'left_elbow' between 'trunk' and 'left_lower' {words}"
    )
    assert told.endswith("; to lock it, add to locked: left_elbow = 0.0")
    walker = robot(ARMS + LOCKED + told.partition("locked: ")[2], text)
    assert walker.chains["left"].joints == ("left_shoulder",)
    check_link_tree(walker, {"left": ANGLES["left"][:1], "right": ANGLES["right"]}, EARTH, TURNED)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "lift =",
            "lifts =",
            "locked.lifts: unknown entry; known are lift, waist-yaw, waist.pitch",
        ),
        ('0.15, unit = "m"', '0.15, unit = "mm"', "locked.lift.unit: must be in 'm', got 'mm'"),
        ("0.7", "0.05", "locked.waist-yaw: must be from 0.1 to 1.5 rad, got 0.05"),
        ("0.7", "[0.7]", "locked.waist-yaw: one number is needed, got [0.7]"),
        ("-0.4", "1e9", "locked.waist.pitch: must be from -100 to 100 rad, got 1e+09"),
        ("-0.4", '"zero"', "locked.waist.pitch: expected `object`"),
        ("-0.4", "nan", "locked.waist.pitch.value: must be finite"),
    ],
)
def test_what_is_wrong_with_a_lock(old, new, message):
    assert old in LOCKED
    told = refusal(ARMS + LOCKED.replace(old, new), WAIST)
    assert told.startswith(message.replace("`", ""))


def test_a_limb_whose_joints_are_all_locked_is_none():
    told = refusal(ARMS + LOCKED + "left_shoulder = 0.0\nleft_elbow = 0.0\n", WAIST)
    assert told.startswith("limbs.left.link: no joint moves between 'trunk' and 'left_lower'")


# numbers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", ["-2.4e-35", "-9e-12"])
def test_a_moment_that_is_negative_by_rounding_is_none(size):
    """Below zero by less than 10 kg a micrometre from its centre have."""
    text = TWO_LINK.replace('ixx="0.0"', f'ixx="{size}"', 1)
    toml = limbs_toml("walker", {"leg": "foot"})
    agree(robot(toml, text), robot(toml, TWO_LINK), {"leg": np.array([0.3, -0.7])})


def test_bare_numbers_are_in_the_units_of_their_entries():
    given = limbs_toml("walker", {"leg": "foot"})
    com = '[robot]\ncom = { value = [0.1, 0.2, 0.3], unit = "m", source = "measured" }\n'
    bare, count = re.subn(r"\{ value = (.*?), unit = .*? \}", r"\1", given + com)
    assert count == 4
    one, other = robot(given + com, TWO_LINK), robot(bare, TWO_LINK)
    agree(one, other, {"leg": np.array([0.3, -0.7])})
    np.testing.assert_array_equal(
        other.chains["leg"].torque_limits, one.chains["leg"].torque_limits
    )
    np.testing.assert_array_equal(other.com, [0.1, 0.2, 0.3])


@pytest.mark.parametrize(
    ("number", "message"),
    [
        ("nan", "every_limb.torque_limit.value: must be finite, got nan"),
        ("true", "every_limb.torque_limit: expected object, got bool"),
        ('"80 N·m"', "every_limb.torque_limit: expected object, got str"),
        ("[80.0, true]", "every_limb.torque_limit.value: must be a number or a list of numbers"),
        ("0", "limbs.leg.torque_limit: must be 0.001 to 1e+06 N·m, or in a list 0 for a joint"),
    ],
)
def test_what_is_no_bare_number(number, message):
    toml = limbs_toml("walker", {"leg": "foot"})
    spoilt = re.sub(r"(torque_limit = )\{.*\}", rf"\g<1>{number}", toml)
    assert refusal(spoilt, TWO_LINK).startswith(message)


def test_the_bundled_robot_has_unit_and_source_of_every_number():
    text = resources.files("planner.parameters").joinpath("robosimian.toml").read_text("utf-8")
    entries = list(leaves(tomllib.loads(text)))
    assert len(entries) == 11
    assert all({"value", "unit", "source"} <= entry.keys() for entry in entries)


def leaves(section):
    """Yield the numbers of a file, each with the table that it stands in, or as it is."""
    for value in section.values():
        if isinstance(value, dict) and "value" not in value:
            yield from leaves(value)
        elif not isinstance(value, str):
            yield value


def test_a_hand_on_a_waist_is_where_its_limb_reaches():
    """The reach is measured from the shoulder where the locked waist puts it."""
    walker = robot(ARMS + LOCKED, WAIST)
    stretched = walker.hand_poses({})["left"]
    assert walker.stretches(Pose.identity(), ["left"], [stretched]) == [pytest.approx(1.0)]
