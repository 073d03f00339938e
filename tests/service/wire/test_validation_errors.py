"""Strict requests: errors that name the field and what would be valid."""

from __future__ import annotations

import math
import re

import pytest

from planner.robots import robosimian
from tests.suite.helpers.replies import refusal
from tests.suite.helpers.requests import (
    HAND,
    JOINTS,
    JSON,
    LATER,
    MSGPACK,
    at,
    dotted,
    drop,
    full_request,
    paths,
    pose_of,
    put,
    request_with_joints,
    wall_request,
)

FRONT = ("stance", "hands", 0)


def test_every_missing_field_is_named() -> None:
    optional = {"id", "load", "grasp", "outer_rotation", "com", "mass"}
    request = wall_request()
    for path in paths(request)[1:]:
        if path[-1] in optional or not isinstance(path[-1], str):
            continue
        kind, field, message = refusal(drop(request, path))
        assert (kind, field) == ("invalid", dotted(path))
        words = {"v": "; valid: 1", "shape": "; valid: plane, cylinder"}.get(str(path[-1]), "")
        assert message.startswith(f"missing{words}")


def test_an_unknown_field_is_named_wherever_it_is() -> None:
    request = full_request()
    for path in paths(request):
        if isinstance(at(request, path), dict):
            where = (*path, "colour")
            kind, field, message = refusal(put(request, where, 1))
            if path[:2] == ("stance", "hand"):
                # sections and entries are names too, and have to be what those are
                assert field == dotted(path if len(path) == 4 else where)
                words = {2: "a section", 3: "expected object", 4: "unknown field"}
                assert words[len(path)] in message
                continue
            assert (kind, field) == ("invalid", dotted(where))
            assert re.search("unknown field; known are .", message)


def test_an_unknown_field_of_a_payload_is_told_those_of_payloads() -> None:
    payload = {"limb": "front_right", "mass": 1.0, "colour": 1}
    for form in [JSON, MSGPACK]:
        where, message = refusal(
            put(wall_request(), ("load",), {"payloads": [payload]}), form=form
        )[1:]
        assert where == "load.payloads[0].colour"
        assert message == "unknown field; known are mass, link, limb, com"


def test_an_unknown_field_of_a_hold_is_told_those_of_its_shape() -> None:
    for hold, known in [
        ({"shape": "cylinder", "diameter": 0.3}, "diameter"),
        ({"shape": "edge", "fillet_radius": 0.1, "angle": 1.0}, "fillet_radius, angle"),
        ({"diameter": 0.3, "radius": 0.15, "shape": "sphere"}, "diameter"),
        ({"shape": "plane"}, None),
    ]:
        for form in [JSON, MSGPACK]:
            request = put(wall_request(), (*FRONT, "hold"), hold | {"radius": 0.15})
            where, message = refusal(request, form=form)[1:]
            assert where == "stance.hands[0].hold.radius"
            own = f", {known}" if known else ""
            assert message == f"unknown field; known are shape, pose, pose_in_hand{own}"


def test_an_unknown_field_of_a_shared_rock_is_told_those_of_its_shape() -> None:
    rocks = {"floor": {"shape": "plane"}, "log": {"shape": "cylinder", "radius": 0.1}}
    where, message = refusal(put(wall_request(), ("stance", "rocks"), rocks))[1:]
    assert where == "stance.rocks.log.radius"
    assert message == "unknown field; known are shape, pose, pose_in_hand, diameter"


def test_no_field_that_is_refused_is_offered() -> None:
    where, message = refusal(wall_request() | {"colour": 1})[1:]
    offered = message.removeprefix("unknown field; known are ").split(", ")
    assert where == "colour"
    assert "objective" in offered
    assert "confidence" not in offered


def test_limbs_are_names_too_and_have_to_be_limbs() -> None:
    for form in [JSON, MSGPACK]:
        request = request_with_joints()
        places = [path for path in paths(request) if path and path[-1] == "front_left"]
        assert len(places) == 4
        for path in places:
            where = (*path[:-1], "nose")
            kind, field, message = refusal(put(request, where, at(request, path)), form=form)
            assert (kind, field) == ("invalid", dotted(where))
            assert "front_left" in message


def test_no_number_may_be_other_than_finite() -> None:
    for asked in [full_request, request_with_joints]:
        for number in [math.nan, math.inf, -math.inf]:
            request = asked() | {"body_wrench": [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]}
            floats = [p for p in paths(request) if type(at(request, p)) is float]
            assert len(floats) > 60
            for path in floats:
                kind, field, _ = refusal(put(request, path, number), form=MSGPACK)
                assert (kind, field) == ("invalid", dotted(path))


INVALID = [
    (("v",), 2, "v", "2 is not known; valid: 1"),
    (("stance", "robot"), "loris", "stance.robot", "known are robosimian"),
    (("stance", "hands"), [], "stance.hands", "at least one hand"),
    (("stance", "gravity"), [0.0, 0.0], "stance.gravity", "length 3, got length 2"),
    (("stance", "body", "position", 1), 2e4, "stance.body.position[1]", "a number <= 10000"),
    (("stance", "body", "position", 1), 2e4, "stance.body.position[1]", "got 20000; in map coord"),
    (
        ("stance", "body", "orientation"),
        [0.0, 0.0, 0.0, 1.01],
        "stance.body.orientation",
        "the norm is 1.01",
    ),
    (
        ("stance", "body"),
        {"position": [0.0] * 3},
        "stance.body.orientation",
        "missing; give orientation (a quaternion [x, y, z, w]), rpy, or x_axis with z_axis",
    ),
    (
        (*FRONT, "pose", "rpy"),
        [0.0] * 3,
        f"{HAND}.pose.rpy",
        "give exactly one of orientation (a quaternion [x, y, z, w]), rpy, or x_axis with z_axis, "
        "got orientation and rpy",
    ),
    (
        (*FRONT, "hold", "pose_in_hand"),
        {"position": [0.0] * 3, "z_axis": [0.0, 0.0, 1.0]},
        f"{HAND}.hold.pose_in_hand.x_axis",
        "missing; z_axis requires x_axis",
    ),
    (
        ("stance", "body"),
        {"position": [0.0] * 3, "x_axis": [0.0, 0.0, 1.0], "z_axis": [-1.0, 0.0, 0.01]},
        "stance.body.z_axis",
        "right angles to x_axis within 0.001 rad, got 89.4271°",
    ),
    (
        ("stance", "body"),
        {"position": [0.0] * 3, "x_axis": [0.0, 0.0, 0.0], "z_axis": [-1.0, 0.0, 0.0]},
        "stance.body.x_axis",
        "must be a direction, not zero, got [0, 0, 0]",
    ),
    (
        ("stance", "body"),
        {"position": [0.0] * 3, "rpy": [0.0, -90.0, 0.0]},
        "stance.body.rpy",
        "pitch must be within ±12.57 rad (two turns), got -90 rad: in degrees? -90° are -1.571 rad",
    ),
    ((*FRONT, "limb"), "nose", f"{HAND}.limb", "known are front_right"),
    ((*FRONT, "limb"), 3, f"{HAND}.limb", "a string, got a whole number"),
    ((*FRONT, "pose", "orientation"), [0.0] * 4, f"{HAND}.pose.orientation", "the norm is 0"),
    ((*FRONT, "hold", "shape"), "cone", f"{HAND}.hold.shape", "plane, cylinder, sphere, edge"),
    ((*FRONT, "hold", "diameter"), -0.3, f"{HAND}.hold.diameter", "a number >= 0.001"),
    ((*FRONT, "surface"), "butter", f"{HAND}.surface", "unknown surface 'butter'; known are"),
    ((*FRONT, "surface"), {"shear_limit": 0.0}, f"{HAND}.surface.shear_limit", ">= 0.001"),
    ((*FRONT, "surface"), 3, f"{HAND}.surface", "a string or an object"),
    ((*FRONT, "grasp", "outer_rotation"), 4.0, f"{HAND}.grasp.outer_rotation", "<= 3.14"),
    ((*FRONT, "grasp", "palm"), 1, f"{HAND}.grasp.palm", "true or false"),
    (
        (*FRONT, "wrist"),
        "limp",
        f"{HAND}.wrist",
        "'limp' is not known; valid: compliant, fixed, floating",
    ),
    (("load", "mass"), "heavy", "load.mass", "a number or null, got a string"),
    (("load", "acceleration"), None, "load.acceleration", "a list"),
    (("body_wrench",), [0.0] * 6, "body_wrench", "give body_wrench or load, not both"),
    (
        ("objective",),
        "fun",
        "objective",
        "'fun' is not known; valid: max_margin, max_reliability, max_robust, min_effort",
    ),
    (("limits",), {"utilisation": 0.0}, "limits.utilisation", "a number >= 0.001"),
    (
        ("want",),
        ["model", "price"],
        "want[1]",
        "valid: advice, clearance, com_region, load_factor, model",
    ),
    (("id",), "x" * 257, "id", "length <= 256"),
    (
        ("stance", "joints"),
        "guess",
        "stance.joints",
        "'guess' is not known; valid: solve, an object",
    ),
    (("stance", "joints"), 3, "stance.joints", "a string or an object or null"),
    (("stance", "joints"), {}, "stance.joints", "missing for front_right, which is on the rock"),
    (("stance", "joints"), {"front_left": []}, "stance.joints.front_left", "length >= 1"),
    (("stance", "joints"), {"front_left": [0.0] * 6}, "stance.joints.front_left", "expected 7"),
    (
        ("stance", "joints"),
        {"front_right": [0.0] * 7, "front_left": [0.0] * 6 + ["x"]},
        "stance.joints.front_left[6]",
        "a number, got a string",
    ),
    (
        ("stance", "joints"),
        {limb: [0.0, 0.0, -4.0, 0.0, 0.0, 0.0, 0.0] for limb in JOINTS},
        "stance.joints.front_right[2]",
        "limb1_joint3 goes from -3.1415 to 3.1415 rad, got -4",
    ),
    (
        ("stance", "joints"),
        JOINTS | {"rear_right": [0.0] * 7},
        "stance.hands[1].pose",
        "pose of rear_right's joint angles",
    ),
    ((*FRONT, "wrench"), [1.0, 2.0, 3.0], f"{HAND}.wrench", "length 6"),
    ((*FRONT, "wrench"), [None, None, "x", 0, 0, 0], f"{HAND}.wrench[2]", "a number or null"),
    (("load", "angular_acceleration"), [0.0, 1.0], "load.angular_acceleration", "length 3"),
    (
        ("load", "angular_acceleration"),
        [0.0, 1.0, 0.0],
        "load.angular_acceleration",
        "requires stance.joints, and a load without com",
    ),
    (("limits",), {"joint_torque": 100.0}, "limits.joint_torque", "requires stance.joints"),
    (
        ("limits",),
        {"joint_torque": {"rear_left": 1.0, "front_left": [1.0, -1.0]}},
        "limits.joint_torque.front_left[1]",
        "a number >= 0.0",
    ),
    (
        ("limits",),
        {"per_hand": {"rear_left": {"largest_force": 9.0}, "front_left": {}}},
        "limits.per_hand.front_left.largest_force",
        "missing",
    ),
    (
        ("limits",),
        {"per_hand": {"front_left": {"largest_force": [1.0, -5.0, 3.0]}}},
        "limits.per_hand.front_left.largest_force[1]",
        "a number >= 0.001",
    ),
    (
        ("limits",),
        {"per_hand": {"front_left": {"largest_force": [1.0, [2.0, 5.0], None]}}},
        "limits.per_hand.front_left.largest_force[1]",
        "must go from 0 N or less to 0 N or more, not both 0, got 2 to 5 N",
    ),
    (
        ("limits",),
        {"per_hand": {"front_left": {"largest_force": [[0.0, 0.0], None, None]}}},
        "limits.per_hand.front_left.largest_force[0]",
        "must go from 0 N or less to 0 N or more, not both 0, got 0 to 0 N",
    ),
    (
        ("limits",),
        {"per_hand": {"front_left": {"largest_force": 5.0, "frame": "palm"}}},
        "limits.per_hand.front_left.frame",
        "'palm' is not known; valid: body, hand, world",
    ),
    (("limits",), {"per_hand": {"x" * 65: {}}}, "limits.per_hand", "length <= 64"),
    (
        ("load",),
        {"payloads": [{"mass": 1.0, "limb": "front_left"}, {"mass": 1.0}]},
        "load.payloads[1].link",
        "give link or limb; neither is given",
    ),
    (("limits",), {"tension_change": 9.0}, "limits.tension_change", "requires 'present' tensions"),
    (("present",), {"front_left": [9.0, 9.0, 9.0]}, "present.front_left", "length 4"),
    (
        ("present",),
        {"rear_left": [9.0] * 4, "front_left": [9.0, 9.0, 9.0, -9.0]},
        "present.front_left[3]",
        "a number >= 0",
    ),
    ((), [], None, "expected an object, got a list"),
]


def test_a_bad_value_is_named_with_what_would_be_valid() -> None:
    for path, value, field, hint in INVALID:
        kind, blamed, message = refusal(put(wall_request(), path, value))
        assert (kind, blamed) == ("invalid", field)
        assert hint in message


DEGREES = "a number <= 3.14209, in rad, got 180; in degrees? 180° are 3.142 rad"

OUT_OF_RANGE = [
    ((*FRONT, "hold", "diameter"), 300.0, "a number <= 100.0, in m, got 300; in mm?"),
    ((*FRONT, "grasp", "outer_rotation"), 180.0, DEGREES),
    ((*FRONT, "grasp", "closing_tension"), 0.0, "a number >= 0.001, in N, got 0"),
    ((*FRONT, "surface"), {"shear_limit": 9.0, "half_planes": 0}, "a whole number >= 1, got 0"),
    (
        (*FRONT, "wrench"),
        [None, None, 2e6, None, None, None],
        "a number <= 1000000.0, in N, got 2000000",
    ),
    (
        (*FRONT, "wrench"),
        [2e6, None, None, -2e6, None, None],
        "a number <= 1000000.0, in N, got 2000000",
    ),
    (
        (*FRONT, "wrench"),
        [0.0, 0.0, 0.0, -2e6, 0.0, 0.0],
        "a number >= -1000000.0, in N·m, got -2000000; in N·mm?",
    ),
    (("load", "mass"), 110300.0, "a number <= 100000.0, in kg, got 110300; in g?"),
    (
        ("load", "acceleration"),
        [0.0, 0.0, 9810.0],
        "a number <= 1000.0, in m/s², got 9810; in mm/s²?",
    ),
    (("load", "mass"), -3.0, "a number >= 0.001, in kg, got -3"),
    (
        ("stance", "limb_stiffness"),
        {"position": 5.0, "angle": 500.0},
        "a number >= 100.0, in N/m, got 5; in N/mm?",
    ),
    (
        (*FRONT, "wrist_travel"),
        {"position": 4.0, "inward": 4.0, "angle": 0.1},
        "a number <= 0.05, in m, got 4; in mm?",
    ),
    (("stance", "gravity"), [0.0, 0.0, -1e8], "a number >= -1000.0, in m/s², got -100000000"),
    (("limits",), {"utilisation": 80.0}, "a number <= 1.0, got 80; in %? 80 % are 0.8"),
    (("limits",), {"utilisation": 180.0}, "a number <= 1.0, got 180"),
    (("limits",), {"joint_torque": {"nose": [5.0, -1.0]}}, "a number >= 0.0, in N·m, got -1"),
    (("stance", "body", "orientation"), [0.0, 0.0, 0.0, 2e3], "a number <= 1000.0, got 2000"),
    (("present",), {"nose": [1.0, 1.0, 1.0, -1.0]}, "a number >= 0.0, in N, got -1"),
]


def test_a_number_out_of_range_is_told_in_its_unit() -> None:
    for path, value, wanted in OUT_OF_RANGE:
        for form in [JSON, MSGPACK]:
            assert refusal(put(wall_request(), path, value), form=form)[2] == f"expected {wanted}"


def test_the_wrong_one_of_many_entries_is_found() -> None:
    for count in [1, 2, 3, 7, 50]:
        for wrong in range(count):
            limbs = {f"[...] limb {i}": {"largest_force": 9.0} for i in range(count)}
            limbs[f"[...] limb {wrong}"]["largest_force"] = "much"
            field = refusal(wall_request() | {"limits": {"per_hand": limbs}})[1]
            assert field == f"limits.per_hand.[...] limb {wrong}.largest_force"


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_hands_out_of_reach_are_named_with_what_is_missing(form: str) -> None:
    request = put(wall_request(), ("stance", "joints"), "solve")
    for i in (1, 3):
        request["stance"]["hands"][i]["pose"]["position"][2] *= 3.0
    kind, field, message = refusal(request, form=form)
    assert (kind, field) == ("unreachable", "stance.hands[1].pose")
    robot = robosimian()
    body = pose_of(request["stance"]["body"])
    for i in (1, 3):
        hand = request["stance"]["hands"][i]
        limb = hand["limb"]
        (stretch,) = robot.stretches(body, [limb], [pose_of(hand["pose"])])
        beyond = (stretch - 1.0) * robot.chains[limb].reach
        # the hand keeps its axes, which may cost more than the stretched limb lacks
        told = re.search(rf"{hand['limb']} is out of reach by ([0-9.]+) m", message)
        assert told is not None
        assert float(told[1]) >= beyond - 0.01


def test_errors_of_the_models_come_with_the_whole_path() -> None:
    request = wall_request()
    own = {"shear_limit": 20.0, "pull_off_limit": 30.0}
    field = refusal(put(request, (*FRONT, "surface"), own))[1]
    assert field == "stance.hands[0].surface.pull_off_limit"
    twice = put(request, ("stance", "hands", 1, "limb"), "front_right")
    assert refusal(twice)[1] == "stance.hands[1].limb"
    home = request["stance"]["hands"][2]["pose"]
    hold = {"shape": "plane", "pose": home, "pose_in_hand": home}
    assert refusal(put(request, ("stance", "hands", 2, "hold"), hold))[1] == "stance.hands[2].hold"
    deep = {"position": [0.0, 0.0, -0.05], "orientation": [0.0, 0.0, 0.0, 1.0]}
    hold = {"shape": "plane", "pose_in_hand": deep}
    kind, field, message = refusal(put(request, ("stance", "hands", 3, "hold"), hold))
    assert (kind, field) == ("invalid", "stance.hands[3].hold")
    assert "inside the palm" in message


def test_what_later_versions_will_do_is_refused_by_name() -> None:
    for form in [JSON, MSGPACK]:
        for path, value, field in LATER:
            kind, blamed, message = refusal(put(wall_request(), path, value), form=form)
            assert (kind, blamed) == ("unsupported", field)
            assert "not supported in this version; " in message
