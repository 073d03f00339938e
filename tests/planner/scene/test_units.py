"""Numbers in another unit are findings; others, odd as they may be, are left alone."""

import math
import re
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hand_models.base import Pose
from hand_models.rock import Cylinder, Edge, Ellipsoid, Plane, Sphere
from planner.question import ForceCap, HandOnHold, Limits, Load, Question
from planner.robots import Payload, RobotFile, robosimian, robot_of
from planner.scene import WrenchCheck, unit_findings, wrench_findings
from planner.solving import KnownStance, plan
from service.answering.questions import question
from service.commands.stances import read_request
from tests.suite.helpers.scenes import (
    BASES,
    GRAVITIES,
    SMALL_BODIES,
    sound_stances,
    with_gravity,
    with_hand,
    with_strength,
)
from tests.suite.helpers.stances import on_wall

EXAMPLES = ("wall-300", "wall-700", "wall", "overhang", "slab", "boulders", "ledge")


def told(asked: Question) -> list[str]:
    """Fields of what is found about a question."""
    found = (*unit_findings(asked), *wrench_findings(asked))
    assert {each.kind for each in found} <= {"unit"}
    assert all(math.isfinite(each.value) and each.message and each.unit for each in found)
    return [each.field for each in found]


def needed(asked: Question) -> np.ndarray:
    return asked.needed_wrench()


def asking(**changes):
    return lambda asked: replace(asked, **changes)


def load(**changes):
    return lambda asked: replace(asked, load=Load(**changes))


def carried(mass, com=(0.0, 0.0, 0.0), **where):
    """A payload, on the torso unless it is said where."""
    return load(payloads=(Payload(mass, com=com, **(where or {"link": "torso"})),))


def limits(**changes):
    return lambda asked: replace(asked, limits=Limits(**changes))


def wrench(factor):
    return lambda asked: replace(asked, body_wrench=factor * needed(asked))


def moments(factor):
    """A body wrench whose moments are in another unit, of a centre of mass 0.3 m off."""

    def asked_with(asked):
        load_off = replace(asked, load=Load(com=(0.25, 0.1, -0.1)))
        scale = np.array([1.0, 1.0, 1.0, factor, factor, factor])
        return replace(asked, body_wrench=scale * needed(load_off))

    return asked_with


def with_joints(asked):
    robot = asked.stance.robot
    angles = {limb: np.zeros(len(chain.joints)) for limb, chain in robot.chains.items()}
    return replace(asked, stance=replace(asked.stance, joints=angles))


def joint_limits(given):
    return lambda asked: replace(with_joints(asked), limits=Limits(joint_torque=given))


def present(value):
    return lambda asked: replace(asked, present={"front_left": np.full(4, value)})


WRONG = {
    "body wrench in kN": (wrench(1e-3), "body_wrench"),
    "body wrench in kgf": (wrench(1.0 / 9.80665), "body_wrench"),
    "body wrench in kgf, with a payload": (wrench(1.2 / 9.81), "body_wrench"),
    "body wrench in kN, half hung": (wrench(0.6e-3), "body_wrench"),
    "body wrench in kN, loaded": (wrench(2.0e-3), "body_wrench"),
    "body wrench in mN": (wrench(1e3), "body_wrench"),
    "moments in N·mm": (moments(1e3), "body_wrench"),
    "mass in t": (load(mass=0.110288), "load.mass"),
    "mass in t, with a payload": (load(mass=0.16), "load.mass"),
    "mass in g": (load(mass=110288.0), "load.mass"),
    "mass in mg": (load(mass=1.1e8), "load.mass"),
    "mass as a weight": (load(mass=1081.9), "load.mass"),
    "mass in lb": (load(mass=243.1), "load.mass"),
    "com in mm": (load(com=(0.33, -0.82, -132.9)), "load.com"),
    "com in cm": (load(com=(0.0, 3.0, -13.3)), "load.com"),
    "payload in g": (carried(2000.0), "load.payloads[0].mass"),
    "payload in t": (carried(0.006), "load.payloads[0].mass"),
    "margin of holds in kN": (limits(hold_margin=0.002), "limits.hold_margin"),
    "margin of palms in kN": (limits(palm_margin=0.01), "limits.palm_margin"),
    "least tension in kN": (limits(least_tension=0.03), "limits.least_tension"),
    "payload of a limb in g": (carried(900.0, limb="front_left"), "load.payloads[0].mass"),
    "payload's place in mm": (carried(2.0, (0.0, 0.0, 120.0)), "load.payloads[0].com"),
    "payload's place in cm": (carried(2.0, (3.0, -4.0, 12.0)), "load.payloads[0].com"),
    "acceleration in mm/s²": (load(acceleration=(0.0, 0.0, 500.0)), "load.acceleration"),
    "acceleration in cm/s²": (load(acceleration=(40.0, 0.0, 0.0)), "load.acceleration"),
    "turning in deg/s²": (
        load(angular_acceleration=(0.0, 90.0, 0.0)),
        "load.angular_acceleration",
    ),
    "cap of tension in kN": (limits(tendon_tension=0.7), "limits.tendon_tension"),
    "cap of tension in t": (limits(tendon_tension=0.07), "limits.tendon_tension"),
    "cap of a force in kN": (
        limits(per_hand={"front_left": ForceCap(0.3)}),
        "limits.per_hand.front_left.largest_force",
    ),
    "cap along an axis in kN": (
        limits(per_hand={"rear_left": ForceCap(((-0.3, 0.3), (-300.0, 300.0), (0.0, math.inf)))}),
        "limits.per_hand.rear_left.largest_force",
    ),
    "present tensions in kN": (present(0.037), "present.front_left"),
    "present tensions in mN": (present(37000.0), "present.front_left"),
    "present tensions in gf": (present(3773.0), "present.front_left"),
    "a hand's wrench in kN": (
        lambda asked: replace(
            asked, stance=with_hand(asked.stance, 2, wrench=(None, None, -0.2, None, None, None))
        ),
        "stance.hands[2].wrench",
    ),
    "joint torque in N·mm": (joint_limits(200000.0), "limits.joint_torque"),
    "joint torque in kN·m": (joint_limits(0.2), "limits.joint_torque"),
    "joint torques in N·mm": (
        joint_limits({"rear_left": (150000.0,) * 7}),
        "limits.joint_torque.rear_left",
    ),
    "joint torques in kN·m": (
        joint_limits({"rear_left": (0.2, 0.2, 0.2, 0.1, 0.1, 0.1, 0.0)}),
        "limits.joint_torque.rear_left",
    ),
    "gravity in g": (
        lambda asked: replace(asked, stance=with_gravity(asked.stance, 1.0)),
        "stance.gravity",
    ),
    "gravity in cm/s²": (
        lambda asked: replace(asked, stance=with_gravity(asked.stance, 981.0)),
        "stance.gravity",
    ),
    "a hand's strength of a tile": (
        lambda asked: replace(asked, stance=with_strength(asked.stance, shear_limit=353.0)),
        "stance.hands[0].surface.shear_limit",
    ),
    "a fillet in mm": (
        lambda asked: replace(asked, stance=with_hand(asked.stance, 1, hold=Edge(50.0, 1.6))),
        "stance.hands[1].hold.fillet_radius",
    ),
    "a boulder in cm": (
        lambda asked: replace(
            asked, stance=with_hand(asked.stance, 2, hold=Ellipsoid((14.0, 20.0, 12.0)))
        ),
        "stance.hands[2].hold.semi_axes",
    ),
    "preloads in kN": (
        lambda asked: replace(
            asked,
            stance=with_hand(
                asked.stance, 3, wrist="floating", tendon_preload=np.array([0.04, 0.04, 0.04, 0.04])
            ),
        ),
        "stance.hands[3].tendon_preload",
    ),
}
"""Slips, and the field that tells of each."""


def test_another_unit_is_told_with_its_field():
    for slip in WRONG:
        for base in BASES:
            asked = Question(BASES[base]())
            assert told(asked) == []
            make, field = WRONG[slip]
            found = told(make(asked))
            assert found[0] == field
            # who reads the words alone is told whose number it is
            words = [
                each.message
                for each in (*unit_findings(make(asked)), *wrench_findings(make(asked)))
            ]
            limbs = asked.stance.robot.limbs
            assert all(each.startswith((field, *limbs)) for each in words)
            # all hands are on rock of that strength
            assert len(found) == (len(asked.stance.hands) if "strength of a tile" in slip else 1)


def turned_off(asked, angle, size=1.0):
    """The wrench that a stance needs, its force turned off up by an angle and scaled."""
    own = needed(asked)
    level = np.cross(own[:3], [0.3, -0.5, 0.8])
    turn = Rotation.from_rotvec(angle * level / np.linalg.norm(level)).as_matrix()
    return replace(asked, body_wrench=np.concatenate([size * turn @ own[:3], own[3:]]))


def test_a_weight_that_is_not_held_up_is_doubted():
    for base in BASES:
        asked = Question(BASES[base]())
        if np.linalg.norm(asked.stance.gravity) < 5.0:
            # on the Moon a body that moves needs as much, to whichever side
            moon = Question(with_gravity(asked.stance, 1.62))
            assert wrench_findings(replace(moon, body_wrench=-needed(moon))) == ()
            continue
        own, turn = needed(asked), asked.stance.body.rotation
        in_world = np.concatenate([turn @ own[:3], turn @ own[3:]])
        gravity = -own
        off = np.degrees(np.arccos(in_world[:3] @ own[:3] / (own[:3] @ own[:3])))
        for wrench, angle in ((in_world, off), (gravity, 180.0)):
            found = wrench_findings(replace(asked, body_wrench=wrench))
            assert [each.kind for each in found] == ["wrench_not_up"] * int(angle >= 60.0)
            for each in found:
                assert each.field == "body_wrench"
                assert each.doubts_number
                assert np.degrees(each.value) == pytest.approx(angle, abs=1e-4)
                assert "in B, not in W" in each.message
                assert "not gravity itself" in each.message
        # bounds of angle and size, from inside and from outside
        for angle, size, odd in (
            (1.06, 1.0, True),
            (1.03, 1.0, False),
            (1.06, 1.45, True),
            (1.06, 1.55, False),
            (1.06, 0.7, True),
            (1.06, 0.63, False),
        ):
            assert bool(wrench_findings(turned_off(asked, angle, size))) == odd


def test_a_load_that_is_given_is_what_its_wrenches_are_held_against():
    asked = replace(Question(on_wall()), load=Load(mass=400.0))
    own, check = needed(asked), WrenchCheck(asked)
    assert check.findings(own) == ()
    (found,) = check.findings(-own)
    assert found.kind == "wrench_not_up"
    (found,) = check.findings(own / 1000.0)
    assert "the robot weighs 3924 N" in found.message
    assert WrenchCheck(Question(on_wall())).findings(-own) == ()


def load_factor_probe(axis, sign):
    direction = np.zeros(6)
    direction[axis] = sign
    return asking(body_wrench=direction)


SOUND = {
    "its own wrench": wrench(1.0),
    "a rope takes half": wrench(0.5),
    "a rope takes three quarters": wrench(0.25),
    "nothing at all": wrench(0.0),
    "twice its weight": wrench(2.0),
    "twenty times": wrench(20.0),
    **{
        f"one newton along {'+-'[sign < 0]}{axis}": load_factor_probe(axis, sign)
        for axis in range(6)
        for sign in (1.0, -1.0)
    },
    "a push aside": asking(body_wrench=np.array([0.0, 110.0, 0.0, 0.0, 5.0, 0.0])),
    "a light tool": asking(body_wrench=np.array([20.0, 0.0, 0.0, 0.0, 0.0, 3.0])),
    "a lighter robot": load(mass=40.0),
    "a hull alone": load(mass=5.0),
    "a kilogram": load(mass=1.0),
    "a loaded one": load(mass=400.0),
    "a lorry": load(mass=3000.0),
    "a pack on its back": load(mass=150.0, com=(0.0, 0.0, 0.4)),
    "a pack": carried(60.0, (0.0, 0.0, 0.3)),
    "a small margin": limits(hold_margin=0.5, palm_margin=1.0, least_tension=2.0),
    "a rope aside": lambda asked: replace(
        asked, body_wrench=needed(asked) + np.array([0.0, 900.0, 0.0, 0.0, 0.0, 0.0])
    ),
    "a sensor": carried(0.02, (0.3, 0.0, 0.1)),
    "a lamp on a hand": carried(0.3, (0.0, 0.1, 0.1), limb="front_left"),
    "a boom": load(mass=120.0, com=(1.2, 0.0, 0.2)),
    "gentle motion": load(acceleration=(0.05, 0.0, 0.1)),
    "a leap": load(acceleration=(3.0, 0.0, 20.0)),
    "a turn": load(angular_acceleration=(0.0, 2.0, 0.0)),
    "a tight cap": limits(tendon_tension=40.0),
    "no cap": limits(tendon_tension=1e4),
    "brittle rock": limits(per_hand={"front_left": ForceCap(10.0)}),
    "one way only": limits(per_hand={"front_left": ForceCap(((-50.0, 0.0),) * 3)}),
    "an open cap": limits(per_hand={"front_left": ForceCap(((-math.inf, math.inf),) * 3)}),
    "slack tendons": present(0.0),
    "closing tensions": present(37.0),
    "a strong robot": joint_limits(2000.0),
    "a weak one": joint_limits(20.0),
    "weak wrists": joint_limits({"rear_left": (200.0, 200.0, 200.0, 50.0, 20.0, 5.0, 0.0)}),
    "a wrist that slips": joint_limits({"rear_left": (200.0,) * 6 + (0.001,)}),
    "weak rock": lambda asked: replace(asked, stance=with_strength(asked.stance, shear_limit=3.0)),
    "strong rock": lambda asked: replace(
        asked, stance=with_strength(asked.stance, shear_limit=225.0)
    ),
    "a large boulder": lambda asked: replace(
        asked, stance=with_hand(asked.stance, 0, hold=Sphere(12.0))
    ),
    "a thin rail": lambda asked: replace(
        asked, stance=with_hand(asked.stance, 0, hold=Cylinder(0.03))
    ),
}


def test_what_may_be_meant_is_left_alone():
    for case in SOUND:
        for base in BASES:
            assert told(SOUND[case](Question(BASES[base]()))) == []


def test_gravity_of_small_bodies_is_left_alone():
    for tilt in [0.0, 0.6]:
        for size in SMALL_BODIES:
            stance = with_gravity(on_wall(Plane(), outer_rotation=0.0), size)
            turned = Rotation.from_rotvec([tilt, 0.0, 0.0]).as_matrix() @ stance.gravity
            asked = Question(replace(stance, gravity=turned))
            assert told(asked) == []
            assert told(wrench(1.0)(asked)) == []
            # what the Earth asks for may be asked for there, too
            there = replace(
                asked, body_wrench=needed(Question(on_wall(Plane(), outer_rotation=0.0)))
            )
            assert told(there) == []


def test_a_body_wrench_of_another_place_is_left_alone():
    """A wrench of the Moon, asked about on the Earth, is a sixth of the weight, not a tenth."""
    for gravity in GRAVITIES:
        here = Question(on_wall(Plane(), outer_rotation=0.0))
        there = Question(replace(here.stance, gravity=np.array(gravity)))
        assert told(replace(here, body_wrench=needed(there))) == []


@pytest.mark.slow
def test_nothing_is_odd_about_three_hundred_sound_stances_and_their_wrenches():
    rng = np.random.default_rng(11)
    for stance in sound_stances(300, seed=4):
        asked = Question(stance, load=Load(acceleration=tuple(rng.normal(size=3))))
        assert told(asked) == []
        carried = needed(asked) * rng.uniform(0.3, 3.0)
        assert told(replace(asked, load=Load(), body_wrench=carried)) == []


def test_the_bundled_questions_are_left_alone():
    for name in EXAMPLES:
        asked = question(read_request(name))
        assert told(asked) == []
        assert told(wrench(1.0)(asked)) == []


# Robots -------------------------------------------------------------------------------------------


def robot_with(numbers, text, toml=None):
    """RoboSimian with its URDF's numbers of an attribute scaled, and its file changed."""
    file = RobotFile.bundled()
    urdf, described = file.urdf, file.toml
    for attribute, factor in numbers.items():
        urdf = re.sub(
            rf'{attribute}="([^"]*)"',
            lambda found, by=factor, name=attribute: (
                f'{name}="{" ".join(str(float(v) * by) for v in found[1].split())}"'
            ),
            urdf,
        )
    for old, new in (toml or {}).items():
        assert old in described
        described = described.replace(old, new)
    return robot_of(RobotFile(text, described.replace('"robosimian"', f'"{text}"', 1), urdf))


ON_ROBOT = {
    "g": ({"value": 1e3}, {}, "weighs 99898.4 kg"),
    "t": ({"value": 1e-3}, {}, "links weigh 0.0999 kg together"),
    "mg": ({"value": 1.9e3}, {}, "more than a ball of rock"),
    "cm": ({"xyz": 100.0}, {}, "lengths of its URDF in m"),
    "km": ({"xyz": 1e-3}, {"[0.06735, 0.0, 0.1125]": "[6e-5, 0.0, 1e-4]"}, "lengths of its URDF"),
    "N·mm": ({}, {"torque_limit = { value = 200.0": "torque_limit = { value = 2e5"}, "in N·m"),
    "kN·m": ({}, {"torque_limit = { value = 200.0": "torque_limit = { value = 0.2"}, "in N·m"),
}


@pytest.mark.parametrize("case", ON_ROBOT)
def test_a_robot_in_another_unit_is_told(case):
    numbers, toml, words = ON_ROBOT[case]
    robot = robot_with(numbers, "own", toml)
    limbs = robot.limbs
    pose = robot.hand_poses({})["front_left"]
    hand = HandOnHold("front_left", pose, Plane(), on_wall().hands[0].surface)
    stance = replace(on_wall(), robot=robot, body=Pose.identity(), hands=(hand,))
    stance = replace(stance, joints={limb: np.zeros(7) for limb in limbs})
    found = unit_findings(Question(stance))
    # the cause alone, not what follows from it
    (each,) = found
    assert each.field == "stance.robot"
    assert words in each.message
    if "N·m" not in case:
        loaded = Question(stance, load=Load(mass=110.0), limits=Limits(joint_torque=200.0))
        assert unit_findings(loaded) == found
        assert told(Question(stance, body_wrench=np.full(6, 50.0))) == ["stance.robot"]


def test_robots_of_other_sizes_are_left_alone():
    for numbers in ({}, {"value": 0.1}, {"value": 5.0}, {"xyz": 0.5}, {"xyz": 3.0, "value": 10.0}):
        robot = robot_with(numbers, "other")
        stance = replace(on_wall(Plane(), outer_rotation=0.0), robot=robot)
        assert told(Question(stance)) == []


# Where it is told ---------------------------------------------------------------------------------


def test_plans_tell_it_in_words_and_structured():
    asked = replace(Question(on_wall()), load=Load(mass=0.11))
    answer = plan(asked)
    (found,) = [each for each in answer.findings if each.kind == "unit"]
    assert (found.kind, found.field, found.value, found.unit) == ("unit", "load.mass", 0.11, "kg")
    assert found.message in answer.warnings
    assert "is it in kg, or in t?" in found.message


def test_a_known_stance_tells_it_of_each_wrench():
    asked = Question(on_wall())
    own = needed(asked)
    known = KnownStance(asked)
    assert not [each for each in known.plan(own).findings if each.kind == "unit"]
    (found,) = [each for each in known.plan(own / 1000.0).findings if each.kind == "unit"]
    assert found.field == "body_wrench"
    assert "or in kN?" in found.message
    assert not [each for each in known.plan(own).findings if each.kind == "unit"]
    alone = plan(replace(asked, body_wrench=own / 1000.0))
    assert found in alone.findings
    assert found.message in alone.warnings


def test_what_is_told_can_be_sent():
    for make, _ in WRONG.values():
        for found in unit_findings(make(Question(on_wall()))):
            assert msgspec.json.decode(msgspec.json.encode(found))["kind"] == "unit"
    assert robosimian().mass == pytest.approx(110.288)
