"""A robot's own file and URDF: what they make, and the one line that says what is wrong."""

import dataclasses
import math
import pickle
import re
from importlib import resources

import numpy as np
import pytest

from hand_models.base import InvalidInputError, Pose
from hand_models.parameters import hand_table, own_hand
from planner.robots import RobotFile, robosimian, robot_of
from tests.suite.helpers.robots import TWO_LINK, arm, joint, limbs_toml, link, refusal, urdf

TOML = limbs_toml("walker", {"leg": "foot"})

OWN_MASS = own_hand(
    type(hand_table()).of(
        {"hand": {"mass": {"value": 3.0, "unit": "kg", "source": "assumed"}}},
    )
)
"""A hand of 3 kg, as in the figures worked by hand."""


def written(folder, toml=TOML, text=TWO_LINK):
    path = folder / "walker.toml"
    path.write_text(toml)
    (folder / "walker.urdf").write_text(text)
    return path


def refused(toml=TOML, text=TWO_LINK):
    """The line in which the walker is refused."""
    return refusal(toml, text)


def test_a_file_makes_a_robot(tmp_path):
    robot = robot_of(RobotFile.load(written(tmp_path)), OWN_MASS)
    assert (robot.name, robot.limbs) == ("walker", ("leg",))
    assert robot.mass == pytest.approx(10.0 + 2.0 + 1.0 + 0.5 + 3.0)
    # its centre of mass at zero angles, worked by hand
    x = (2.0 * 0.8 + 1.0 * 1.3 + 3.0 * 1.6) / 16.5
    np.testing.assert_allclose(robot.com, [x, 0.0, (10.0 * 0.1 + 0.5 * 0.4) / 16.5], atol=1e-12)
    np.testing.assert_array_equal(robot.chains["leg"].torque_limits, [80.0, 80.0])
    assert robot.reach == pytest.approx(1.0)
    # the foot 0.9 m before the hip: stretched to 90 %
    hand = Pose(np.array([1.5, 0.0, 0.0]), np.eye(3))
    assert robot.stretches(Pose.identity(), ["leg"], [hand]) == [pytest.approx(0.9)]


def test_files_of_the_same_content_make_one_robot(tmp_path):
    (tmp_path / "other").mkdir()
    one, two = RobotFile.load(written(tmp_path)), RobotFile.load(written(tmp_path / "other"))
    assert one == two
    assert hash(one) == hash(two)
    assert pickle.loads(pickle.dumps(one)) == one
    assert robot_of(one) is robot_of(two)
    assert robot_of(dataclasses.replace(one, urdf=TWO_LINK + "\n")) is not robot_of(one)


def test_the_bundled_robot_is_a_file_like_any_other():
    with resources.as_file(resources.files("planner.parameters")) as folder:
        robot = robot_of(RobotFile.load(folder / "robosimian.toml"), None)
    assert robot is robosimian()
    assert all(np.all(chain.torque_limits == 200.0) for chain in robot.chains.values())


def test_a_limb_says_what_differs_from_every_limb():
    toml, text = arm(3, ("left", "right"))
    own = """
torque_limit = { value = [30.0, 20.0, 10.0], unit = "N·m", source = "measured" }
orientation = { value = [0.0, 1.0, 0.0, 0.0], unit = "1", source = "measured" }
hand_com = { value = [0.0, 0.0, -0.04], unit = "m", source = "measured" }
"""
    robot = robot_of(RobotFile("arms", toml + own, text))  # the last section is that of the right
    np.testing.assert_array_equal(robot.chains["left"].torque_limits, [80.0] * 3)
    np.testing.assert_array_equal(robot.chains["right"].torque_limits, [30.0, 20.0, 10.0])
    np.testing.assert_allclose(
        robot.description.mounts["right"].pose.rotation, np.diag([-1.0, 1.0, -1.0])
    )
    # the right hand's centre of mass is turned up, by its orientation, from where the left's is
    plain = robot_of(RobotFile("arms", toml + own.replace("-0.04", "0.0"), text))
    lift = robot.hand.mass * 0.04 / robot.mass
    np.testing.assert_allclose(robot.com - plain.com, [0.0, 0.0, lift], atol=1e-12)


def test_links_without_capsules_have_one_from_joint_to_joint():
    robot = robot_of(RobotFile("arm", TOML, TWO_LINK))
    found = robot.capsules
    assert found.names == robot.chains["leg"].joints
    assert found.limbs == ("leg", "leg")
    assert found.radii.tolist() == [0.05, 0.05]  # assumed, in scene.toml
    # stretched out along x from (0.5, 0, 0), links of 0.6 and 0.4 m
    placed = robot.placed_capsules({})
    assert placed[:, :, 0] == pytest.approx(np.array([[0.5, 1.1], [1.1, 1.5]]))
    assert robot.body_capsules[0].shape == (0, 2, 3)
    # turned about y by a quarter they hang down
    down = robot.placed_capsules({"leg": np.array([math.pi / 2.0, 0.0])})
    assert down[:, :, 2] == pytest.approx(np.array([[0.0, -0.6], [-0.6, -1.0]]), abs=1e-12)


def test_a_file_may_have_capsules_of_links_and_a_radius_of_the_others():
    thick = TOML + entry("radius", 0.08, "m")
    assert robot_of(RobotFile("arm", thick, TWO_LINK)).capsules.radii.tolist() == [0.08, 0.08]
    own = "[capsules]\n" + entry('"tr*"', [0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.1], "m")
    robot = robot_of(RobotFile("arm", f"{thick}\n{own}", TWO_LINK))
    assert robot.capsules.names[0] == "trunk"
    assert robot.capsules.limbs == (None, "leg", "leg")
    ends, radii = robot.body_capsules
    assert ends.tolist() == [[[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]]
    assert radii.tolist() == [0.1]


def test_a_file_may_say_which_way_the_robots_back_is():
    assert robot_of(RobotFile("arm", TOML, TWO_LINK)).back is None
    told = "[robot]\n" + entry("back", [0.0, 3.0, 4.0], "1")
    robot = robot_of(RobotFile("arm", f"{TOML}\n{told}", TWO_LINK))
    assert robot.back.tolist() == [0.0, 0.6, 0.8]
    assert robosimian().back.tolist() == [0.0, 0.0, 1.0]
    none = "[robot]\n" + entry("back", [0.0, 0.0, 0.0], "1")
    assert refused(f"{TOML}\n{none}") == "robot.back: must be a direction, not zero"


@pytest.mark.parametrize(
    ("values", "unit", "message"),
    [
        ([0.0, 0.0, 0.0, 0.1], "m", "capsules.trunk: must be 7 numbers a capsule"),
        ([0.0] * 7, "m", "capsules.trunk: must be 7 numbers a capsule, .* a radius up to 1 m"),
        ([0.0] * 6 + [50.0], "m", "capsules.trunk: must be 7 numbers a capsule"),
        ([0.0] * 6 + [0.1], "mm", "capsules.trunk.unit: must be in 'm'"),
    ],
)
def test_capsules_that_are_none(values, unit, message):
    assert re.match(message, refused(TOML + "\n[capsules]\n" + entry("trunk", values, unit)))


def test_the_bundled_robots_capsules_are_about_its_torso_and_all_links():
    robot = robosimian()
    found = robot.capsules
    assert found.names.count("torso") == 7
    assert {limb: found.limbs.count(limb) for limb in robot.limbs} == dict.fromkeys(robot.limbs, 10)
    ends, radii = robot.body_capsules
    reach = (np.abs(ends).max(axis=1) + radii[:, None]).max(axis=0)
    # 0.93 m long, 0.5 m wide without its shoulders
    assert reach[0] == pytest.approx(0.475, abs=0.011)
    assert reach[1] == pytest.approx(0.26, abs=0.011)


def test_the_centre_of_mass_may_be_given():
    com = '[robot]\ncom = { value = [0.1, 0.2, 0.3], unit = "m", source = "measured" }\n'
    robot = robot_of(RobotFile("walker", TOML + com, TWO_LINK))
    np.testing.assert_array_equal(robot.com, [0.1, 0.2, 0.3])


def test_a_joint_that_no_limb_has_stays_at_zero():
    """The slide of the head may go from 0.1 to 0.2 m; it is where the file draws it."""
    robot = robot_of(RobotFile("walker", TOML, TWO_LINK))
    assert robot.chains["leg"].joints == ("hip", "knee")
    heavy = TWO_LINK.replace('<mass value="0.5"/>', '<mass value="1.5"/>')
    other = robot_of(RobotFile("walker", TOML, heavy))
    moved = other.mass * other.com - robot.mass * robot.com
    np.testing.assert_allclose(moved, [0.0, 0.0, 0.4], atol=1e-12)


def entry(name, value, unit):
    return f'{name} = {{ value = {value}, unit = "{unit}", source = "assumed" }}\n'


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "walker"', "", "name: must be text, got nothing"),
        ('name = "walker"', 'name = "w/*"', "name: a name must begin with a letter .* got 'w/\\*'"),
        ('body = "trunk"', "body = 3", "body: must be text, got 3"),
        ('body = "trunk"', 'body = "torso"', "body: unknown link 'torso'; known are trunk, thigh"),
        (
            'body = "trunk"',
            'body = "trunk"\ncolour = "red"',
            "colour: unknown; known are name, urdf",
        ),
        ("[every_limb]", "[every_leg]", "every_leg: unknown; known are"),
        ("[limbs.leg]", '[limbs."a leg"]', "limbs: a name must begin with a letter"),
        ('[limbs.leg]\nlink = "foot"\n', "", r"limbs: from 1 to 16 limbs are needed, .* got 0"),
        ('link = "foot"', "", "limbs.leg.link: must be text, got nothing"),
        ('link = "foot"', 'link = "toe"', "limbs.leg.link: unknown link 'toe'; known are trunk"),
        ('link = "foot"', 'link = "trunk"', "limbs.leg.link: no joint moves between 'trunk' and"),
        (
            'link = "foot"',
            'link = "tail"',
            "limbs.leg.link: unknown link 'tail'",
        ),
        (
            'link = "foot"',
            'link = "foot"\nspeed = 3',
            "limbs.leg.speed: unknown entry; known are link",
        ),
        (
            "[0.1, 0.0, 0.0]",
            "[100.0, 0.0, 0.0]",
            r"limbs.leg.position: .* within ±10 m, got 100, 0",
        ),
        ("[0.1, 0.0, 0.0]", "[0.1, 0.0]", "limbs.leg.position: must be 3 numbers"),
        ("[0.1, 0.0, 0.0]", "[0.1, nan, 0.0]", r"every_limb.position.value\[1\]: must be finite"),
        ("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 1.0, 1.0]", "limbs.leg.orientation: a quaternion"),
        (
            'link = "foot"',
            'link = "foot"\nrpy = [0.0, 90.0, 0.0]',
            r"limbs.leg.rpy: pitch must be within ±12.57 rad .* got 90 rad",
        ),
        ('link = "foot"', 'link = "foot"\nx_axis = [1.0, 0.0, 0.0]', "limbs.leg.z_axis: missing"),
        ('unit = "m"', 'unit = "mm"', "every_limb.position.unit: must be in 'm', got 'mm'"),
        ('unit = "N·m"', 'unit = "Nm"', "every_limb.torque_limit.unit: must be in 'N·m', got 'Nm'"),
        ("80.0", "0.0", "limbs.leg.torque_limit: must be 0.001 to 1e.06 N·m, .* got 0"),
        (
            "80.0",
            "[80.0, 80.0, 80.0]",
            "limbs.leg.torque_limit: one number is needed, or 2, .* got 3",
        ),
        ("80.0", "[]", "limbs.leg.torque_limit: must be 0.001"),
        ('source = "assumed"', 'source = "guessed"', "every_limb.position.source: must be one of"),
        ("[every_limb]", "[every_limb", ".*at line"),
    ],
)
def test_what_is_wrong_with_a_file(old, new, message):
    assert old in TOML
    assert re.match(message, refused(TOML.replace(old, new, 1)))


@pytest.mark.parametrize("missing", ["position", "orientation"])
def test_what_no_limb_can_do_without(missing):
    lines = [line for line in TOML.splitlines() if not line.startswith(missing)]
    assert refused("\n".join(lines)).startswith(f"limbs.leg.{missing}: missing; ")


@pytest.mark.parametrize(
    "form",
    [
        "rpy = [0.0, 3.141592653589793, 0.0]",
        "x_axis = [-1.0, 0.0, 0.0]\nz_axis = [0.0, 0.0, -2.0]",
    ],
)
def test_a_limb_may_turn_its_hand_by_angles_or_axes(form):
    toml, text = arm(3, ("left", "right"))
    robot = robot_of(RobotFile("arms", f"{toml}\n{form}\n", text))  # the last section: the right
    mounts = robot.description.mounts
    np.testing.assert_allclose(
        mounts["right"].pose.rotation, np.diag([-1.0, 1.0, -1.0]), atol=1e-12
    )
    plain = robot_of(RobotFile("arms", toml, text)).description.mounts
    np.testing.assert_array_equal(mounts["left"].pose.rotation, plain["left"].pose.rotation)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</robot>", "", "urdf: must be a URDF, which is XML"),
        ("robot", "sdf", "urdf: must be a URDF, whose root is <robot>, got <sdf>"),
        (
            'parent link="trunk"',
            'parent link="chest"',
            "urdf: joint 'hip': its parent must be a link",
        ),
        (
            'child link="shank"',
            'child link="thigh"',
            "urdf: link 'thigh' has two parent joints, 'hip'",
        ),
        ('type="continuous"', 'type="ball"', "urdf: joint 'knee': type must be one of revolute"),
        ('type="continuous"', 'type="floating"', "limbs.leg.link: joint 'knee' .* is floating"),
        (
            'type="continuous"',
            'type="revolute"',
            "urdf: joint 'knee' is revolute and has no <limit>",
        ),
        ('upper="2.5"', 'upper="-2.6"', "urdf: joint 'hip': lower must not be above upper"),
        (
            'upper="2.5"',
            'upper="inf"',
            "urdf: joint 'hip': upper of <limit> must be a number within",
        ),
        ('effort="0"', "", "urdf: joint 'hip': effort of <limit> is missing"),
        (
            'effort="0"',
            'effort="1e400"',
            "urdf: joint 'hip': effort of <limit> must be a number within",
        ),
        (
            'mass value="2.0"',
            'mass value="2_0"',  # 20 for Python, and no mass at all for Pinocchio
            "urdf: link 'thigh': value of <mass> must be a num",
        ),
        (
            'xyz="0.6 0 0"',
            'xyz="600 0 0"',
            "urdf: joint 'knee': xyz of <origin> must be .* within ±100 m, not in mm, got '600",
        ),
        (
            'upper="2.5"',
            'upper="150"',
            "urdf: joint 'hip': upper of <limit> must be a number within ±100 rad, not in degrees",
        ),
        (
            'xyz="0.6 0 0"',
            'xyz="${l} 0 0"',
            r"urdf: must be a URDF; this is a xacro, .* xacro ROBOT.urdf.xacro > ROBOT.urdf",
        ),
        ('xyz="0 1 0"', 'xyz="0 0 0"', "urdf: joint 'hip': its axis must not be zero"),
        ('mass value="2.0"', 'mass value="-2.0"', "urdf: link 'thigh': mass must not be negative"),
        (
            'mass value="2.0"',
            'mass value="nan"',
            "urdf: link 'thigh': value of <mass> must be a num",
        ),
        (
            'mass value="2.0"',
            'mass value="1e9"',
            "urdf: link 'thigh': value of <mass> must be a num",
        ),
        (
            'ixx="0.0"',
            'ixx="-1.0"',
            "urdf: link 'trunk': its inertia must have no negative principal",
        ),
        (
            'ixx="0.0"',
            'ixx="-1.1e-11"',  # of 10 kg: a micrometre and a little more
            "urdf: link 'trunk': its inertia must have no negative principal",
        ),
        ('link name="head"', 'link name="foot"', "urdf: link 'foot' appears 2 times; every"),
        ('joint name="knee"', 'joint name="hip"', "urdf: joint 'hip' appears 2 times; every"),
        ('link name="head"', "link", "urdf: a <link> has no name"),
        ('<link name="foot"/>', '<link name="foot"/><link name="hat"/>', "urdf: one link must be"),
    ],
)
def test_what_is_wrong_with_a_urdf(old, new, message):
    assert old in TWO_LINK
    changed = TWO_LINK.replace(old, new) if old == "robot" else TWO_LINK.replace(old, new, 1)
    assert re.match(message, refused(text=changed))


def test_a_joint_that_follows_one_of_no_limb_is_no_limbs():
    text = TWO_LINK.replace('link="shank"/><origin', 'link="shank"/><mimic joint="neck"/><origin')
    assert refused(text=text).startswith(
        "limbs.leg.link: joint 'knee' between 'trunk' and 'foot' f"
    )


def test_a_ring_of_links_is_no_robot():
    text = urdf(
        *(link(name, 1.0) for name in ("trunk", "a", "b")),
        joint("one", "continuous", "a", "b"),
        joint("two", "continuous", "b", "a"),
    )
    assert refused(text=text) == "urdf: link 'b' is in a loop; a robot must be a tree"


def test_a_robot_without_mass_is_refused():
    text = re.sub(r"<inertial>.*?</inertial>", "", TWO_LINK)
    assert refused(text=text) == (
        "urdf: no link has a mass; give at least one link an <inertial> with a mass above 0 kg"
    )


def test_limbs_that_share_a_joint_are_refused():
    toml = limbs_toml("walker", {"leg": "foot", "other": "thigh"})
    # without the hip, the other would have none
    assert refused(toml) == (
        "limbs.other.link: limbs 'leg' and 'other' share joint 'hip'; every limb needs joints of "
        "its own"
    )


def test_a_limb_beside_the_body_is_refused():
    toml = TOML.replace('body = "trunk"', 'body = "head"')
    told = refused(toml)
    assert told.startswith("limbs.leg.link: link 'foot' is not connected to the body 'head'")
    assert told.endswith("; every link has one to body = 'trunk'")


def test_a_limb_that_only_turns_its_hand_in_its_place_is_refused():
    toml, text = arm(1)
    assert refused(toml.replace("[0.1, 0.0, 0.0]", "[0.0, 0.0, 0.0]"), text) == (
        "limbs.arm.position: the hand is on the axes of the limb's joints, which cannot move the "
        "hand; must be away from them, got [0.0, 0.0, 0.0] m; give another position"
    )


def test_sixteen_limbs_are_a_robot_and_seventeen_are_not():
    limbs = [f"leg{i}" for i in range(17)]
    toml, text = arm(1, tuple(limbs[:16]))
    assert len(robot_of(RobotFile("arms", toml, text)).limbs) == 16
    assert re.match("limbs: from 1 to 16 limbs are needed.* got 17", refused(*arm(1, tuple(limbs))))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda folder: (folder / "walker.toml").unlink(), "walker.toml: No such file"),
        (
            lambda folder: (folder / "walker.urdf").unlink(),
            "walker.toml: urdf: .*walker.urdf: No such",
        ),
        (
            lambda folder: (folder / "walker.urdf").write_bytes(b"\xff\xfe\x00"),
            "walker.toml: urdf: .*walker.urdf: must be a URDF in UTF-8; save it so",
        ),
        (
            lambda folder: (folder / "walker.toml").write_bytes(b"\xff"),
            "walker.toml: is not in UTF-8 .byte 0xff in line 1.; save it as TOML in UTF-8",
        ),
        (
            lambda folder: (folder / "walker.toml").write_text("a = "),
            "walker.toml: is not valid TOML: Invalid value .*; correct the file there",
        ),
        (
            lambda folder: (folder / "walker.toml").write_text(f"a = {'[' * 9999}"),
            r"walker.toml: has lists \[ \] or tables \{ \} nested too deep to be read",
        ),
    ],
)
def test_files_that_cannot_be_read(tmp_path, spoil, message):
    path = written(tmp_path)
    spoil(tmp_path)
    with pytest.raises(InvalidInputError, match=message) as caught:
        robot_of(RobotFile.load(path))
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
