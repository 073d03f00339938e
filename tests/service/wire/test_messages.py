"""What travels: strict requests, errors that name the field, replies that a caller can check."""

from __future__ import annotations

import itertools
import json
import math
import random
import re
from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from jsonschema import Draft202012Validator

from hand_models.base import (
    InvalidInputError,
    Pose,
    SolverError,
    UnsupportedError,
    wrench_transport,
)
from planner import solving
from planner.robots import robosimian
from service.answering import dispatch
from service.answering.questions import question
from service.replies import ErrorReply, PlanReply, WrenchSpaceReply
from service.requests import PlanRequest, WrenchSpaceRequest
from service.wire import Format, MalformedError, decode_request, schema
from service.wire.codec import LARGEST_REQUEST
from service.wire.json_schema import MESSAGES
from tests.suite.helpers.asked import (
    HAND,
    HEAVY,
    JOINTS,
    JSON,
    LATER,
    MSGPACK,
    at,
    dotted,
    drop,
    flat_request,
    full_request,
    jointed_request,
    paths,
    put,
    spoil,
    wall_request,
)
from tests.suite.helpers.rocks import cylinder_mesh

PLAN = "crux/robosimian/plan"
WRENCH_SPACE = "crux/robosimian/wrench_space"
FRONT = ("stance", "hands", 0)
KINDS = {"malformed", "invalid", "unsupported", "unreachable"}


def read(request: object) -> PlanRequest:
    return decode_request(msgspec.json.encode(request), PlanRequest)


def refusal(request: object, key: str = PLAN, form: str = JSON) -> tuple[str, str | None, str]:
    """Kind, field and message of the error that a request gets."""
    encode = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    answer = dispatch.handle(key, encode(request), form)
    assert not answer.good
    error = Format.named(answer.encoding).decode(answer.payload, ErrorReply).error
    assert "\n" not in error.message
    return error.kind, error.field, error.message


def reply_to(request: object, form: str = JSON) -> PlanReply:
    encode = msgspec.msgpack.encode if "msgpack" in form else msgspec.json.encode
    answer = dispatch.handle(PLAN, encode(request), form)
    assert answer.good, answer.payload
    return Format.named(answer.encoding).decode(answer.payload, PlanReply)


# Requests -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", Format)
@pytest.mark.parametrize("asked", [full_request, jointed_request])
def test_a_request_survives_the_journey(asked: Callable[[], dict], form: Format) -> None:
    request = read(asked())
    assert decode_request(form.encode(request), PlanRequest, form) == request


def test_defaults_do_not_travel() -> None:
    sent = json.loads(msgspec.json.encode(read(wall_request())))
    assert set(sent) == {"v", "id", "stance", "load"}
    assert set(sent["stance"]["hands"][0]) == {"limb", "pose", "hold", "surface", "grasp"}


def test_null_means_left_out() -> None:
    request = wall_request()
    spelled = request | {"body_wrench": None, "confidence": None, "deadline": None}
    assert read(spelled) == read(request)


def test_a_request_becomes_a_question() -> None:
    asked = question(read(full_request()))
    plane, sphere, edge, cylinder = asked.stance.hands
    assert [h.hold.shape for h in asked.stance.hands] == ["plane", "sphere", "edge", "cylinder"]
    assert plane.placed_hold() is None
    np.testing.assert_allclose(sphere.placed_hold().position, [0.0, 0.0, 0.003])
    assert (edge.hold.fillet_radius, edge.hold.angle) == (0.05, 2.0)
    assert (edge.grasp.outer_rotation, edge.grasp.closing_tension) == (0.5, 30.0)
    assert (cylinder.surface.pull_off_limit, cylinder.surface.half_planes) == (15.0, 3)
    assert asked.stance.gravity.tolist() == [0.0, 0.0, -3.7]
    assert asked.load.acceleration == (0.0, 0.0, 0.2)
    assert (asked.limits.utilisation, asked.limits.tendon_tension) == (0.8, 150.0)
    assert asked.want == {"load_factor", "prices", "model"}
    np.testing.assert_allclose(
        asked.needed_wrench()[:3], asked.stance.body.rotation.T @ [0.0, 0.0, 390.0]
    )


def test_a_request_with_joints_becomes_a_question() -> None:
    asked = question(read(jointed_request()))
    for limb, angles in JOINTS.items():
        np.testing.assert_array_equal(asked.stance.joints[limb], angles)
    assert asked.stance.hands[1].wrench == (None, None, 20.0, None, None, None)
    assert asked.load.angular_acceleration == (0.0, 0.1, 0.0)
    assert asked.objective == "min_effort"
    limits = asked.limits
    assert limits.joint_torque == {"front_left": 150.0, "rear_left": (180.0,) * 7}
    assert limits.per_hand["rear_left"].largest_force == 400.0
    assert limits.per_hand["rear_left"].frame == "hand"
    capped = limits.per_hand["front_left"]
    assert capped.largest_force == ((-300.0, 300.0), (-math.inf, math.inf), (-250.0, 300.0))
    assert capped.frame == "body"
    assert limits.tension_change == 60.0
    np.testing.assert_array_equal(asked.present["front_left"], [45.0, 50.0, 50.0, 45.0])
    assert question(read(put(wall_request(), ("stance", "joints"), "solve"))).stance.joints == (
        "solve"
    )


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_what_is_asked_of_joints_forces_and_tensions_is_in_the_reply(form: str) -> None:
    request = jointed_request()
    reply = reply_to(request, form)
    assert (reply.status, reply.verified) == ("optimal", True)
    assert reply.utilisation <= 0.95
    assert reply.effort > 0.0
    assert reply.effort_prices is not None
    limits = {limb: [200.0] * 7 for limb in JOINTS}
    limits |= {"front_left": [150.0] * 7, "rear_left": [180.0] * 7}
    assert reply.joint_torque_limit == limits
    for limb, torques in reply.joint_torque.items():
        assert (np.abs(torques) <= np.multiply(0.95 + 1e-6, limits[limb])).all()
        np.testing.assert_allclose(reply.joints[limb], JOINTS[limb])
    hands = {hand.limb: hand for hand in reply.hands}
    assert hands["rear_right"].wrench[2] == pytest.approx(20.0, abs=1e-3)
    assert np.linalg.norm(hands["rear_left"].wrench[:3]) <= 400.0
    places = {hand["limb"]: _pose(hand["pose"]) for hand in request["stance"]["hands"]}
    body = _pose(request["stance"]["body"])
    force = body.rotation.T @ places["front_left"].rotation @ hands["front_left"].wrench[:3]
    assert abs(force[0]) <= 0.95 * 300.0 + 1e-3
    assert -0.95 * 250.0 - 1e-3 <= force[2] <= 0.95 * 300.0 + 1e-3
    for limb, present in request["present"].items():
        tensions = [finger.tendon_tension for finger in hands[limb].fingers]
        assert np.abs(np.subtract(tensions, present)).max() <= 60.0 + 1e-3


def test_hold_placed_in_the_world() -> None:
    request = wall_request()
    hand = request["stance"]["hands"][0]
    hand["hold"]["pose"] = hand["pose"]
    placed = question(read(request)).stance.hands[0].placed_hold()
    np.testing.assert_allclose(placed.position, 0.0, atol=1e-12)
    np.testing.assert_allclose(placed.rotation, np.eye(3), atol=1e-12)


def test_every_missing_field_is_named() -> None:
    optional = {"id", "load", "grasp", "outer_rotation", "com", "mass"}
    request = wall_request()
    for path in paths(request)[1:]:
        if path[-1] in optional or not isinstance(path[-1], str):
            continue
        kind, field, message = refusal(drop(request, path))
        assert (kind, field, message) == ("invalid", dotted(path), "missing")


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
            assert "unknown field; known are " in message


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_limbs_are_names_too_and_have_to_be_limbs(form: str) -> None:
    request = jointed_request()
    places = [path for path in paths(request) if path and path[-1] == "front_left"]
    assert len(places) == 4
    for path in places:
        where = (*path[:-1], "nose")
        kind, field, message = refusal(put(request, where, at(request, path)), form=form)
        assert (kind, field) == ("invalid", dotted(where))
        assert "front_left" in message


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("asked", [full_request, jointed_request])
def test_no_number_may_be_other_than_finite(asked: Callable[[], dict], number: float) -> None:
    request = asked() | {"body_wrench": [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]}
    floats = [p for p in paths(request) if type(at(request, p)) is float]
    assert len(floats) > 60
    for path in floats:
        kind, field, _ = refusal(put(request, path, number), form=MSGPACK)
        assert (kind, field) == ("invalid", dotted(path))


@pytest.mark.parametrize("token", ["NaN", "Infinity", "1e999", "-1e999"])
def test_json_has_no_infinite_numbers_either(token: str) -> None:
    text = json.dumps(wall_request(mass=12345.0)).replace("12345.0", token)
    answer = dispatch.handle(PLAN, text.encode())
    assert not answer.good


INVALID = [
    (("v",), 2, "v", "2 is not known; valid: 1"),
    (("stance", "robot"), "loris", "stance.robot", "known are robosimian"),
    (("stance", "hands"), [], "stance.hands", "at least one hand"),
    (("stance", "gravity"), [0.0, 0.0], "stance.gravity", "length 3"),
    (("stance", "body", "position", 1), 2e4, "stance.body.position[1]", "a number <= 10000"),
    (
        ("stance", "body", "orientation"),
        [0.0, 0.0, 0.0, 1.01],
        "stance.body.orientation",
        "the norm is 1.01",
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
    ((*FRONT, "wrist"), "limp", f"{HAND}.wrist", "'limp' is not known; valid: fixed, floating"),
    (("load", "mass"), "heavy", "load.mass", "a number or null, got a string"),
    (("load", "acceleration"), None, "load.acceleration", "a list"),
    (("body_wrench",), [0.0] * 6, "body_wrench", "give body_wrench or load, not both"),
    (("objective",), "fun", "objective", "valid: max_margin, max_reliability, min_effort"),
    (("limits",), {"utilisation": 0.0}, "limits.utilisation", "a number >= 0.001"),
    (("want",), ["model", "price"], "want[1]", "valid: load_factor, model, prices"),
    (("id",), "x" * 257, "id", "length <= 256"),
    (("stance", "joints"), "guess", "stance.joints", "'guess' is not known; valid: solve"),
    (("stance", "joints"), 3, "stance.joints", "a string or an object or null"),
    (("stance", "joints"), {}, "stance.joints", "missing for front_right, which holds on"),
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
        "rear_right is ",
    ),
    ((*FRONT, "wrench"), [1.0, 2.0, 3.0], f"{HAND}.wrench", "length 6"),
    ((*FRONT, "wrench"), [None, None, "x", 0, 0, 0], f"{HAND}.wrench[2]", "a number or null"),
    (("load", "angular_acceleration"), [0.0, 1.0], "load.angular_acceleration", "length 3"),
    (
        ("load", "angular_acceleration"),
        [0.0, 1.0, 0.0],
        "load.angular_acceleration",
        "needs the stance's joints, and neither mass nor com",
    ),
    (("limits",), {"joint_torque": 100.0}, "limits.joint_torque", "nothing of joints"),
    (
        ("limits",),
        {"joint_torque": {"rear_left": 1.0, "front_left": [1.0, 0.0]}},
        "limits.joint_torque.front_left[1]",
        "a number >= 0.001",
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
        "from below to above zero is needed, one end of which may be zero; got 2 to 5 N",
    ),
    (
        ("limits",),
        {"per_hand": {"front_left": {"largest_force": 5.0, "frame": "palm"}}},
        "limits.per_hand.front_left.frame",
        "'palm' is not known; valid: body, hand, world",
    ),
    (("limits",), {"per_hand": {"x" * 65: {}}}, "limits.per_hand", "length <= 64"),
    (("limits",), {"tension_change": 9.0}, "limits.tension_change", "present tensions are needed"),
    (("present",), {"front_left": [9.0, 9.0, 9.0]}, "present.front_left", "length 4"),
    (
        ("present",),
        {"rear_left": [9.0] * 4, "front_left": [9.0, 9.0, 9.0, -9.0]},
        "present.front_left[3]",
        "a number >= 0",
    ),
    ((), [], None, "expected an object, got a list"),
]


@pytest.mark.parametrize(("path", "value", "field", "hint"), INVALID)
def test_a_bad_value_is_named_with_what_would_be_valid(
    path: tuple, value: object, field: str | None, hint: str
) -> None:
    kind, blamed, message = refusal(put(wall_request(), path, value))
    assert (kind, blamed) == ("invalid", field)
    assert hint in message


OUT_OF_RANGE = [
    ((*FRONT, "hold", "diameter"), 300.0, "a number <= 100.0, in m"),
    ((*FRONT, "grasp", "outer_rotation"), 180.0, f"a number <= {math.pi + 1e-6}, in rad"),
    ((*FRONT, "grasp", "closing_tension"), 0.0, "a number >= 0.001, in N"),
    ((*FRONT, "surface"), {"shear_limit": 9.0, "half_planes": 0}, "a whole number >= 1"),
    ((*FRONT, "wrench"), [None, None, 2e6, None, None, None], "a number <= 1000000.0, in N"),
    ((*FRONT, "wrench"), [2e6, None, None, -2e6, None, None], "a number <= 1000000.0, in N"),
    ((*FRONT, "wrench"), [0.0, 0.0, 0.0, -2e6, 0.0, 0.0], "a number >= -1000000.0, in N·m"),
    (("load", "mass"), 110300.0, "a number <= 100000.0, in kg"),
    (("load", "acceleration"), [0.0, 0.0, 9810.0], "a number <= 1000.0, in m/s²"),
    (("limits",), {"utilisation": 80.0}, "a number <= 1.0"),
    (("limits",), {"joint_torque": {"nose": [5.0, 0.0]}}, "a number >= 0.001, in N·m"),
    (("stance", "body", "orientation"), [0.0, 0.0, 0.0, 2e3], "a number <= 1000.0"),
    (("present",), {"nose": [1.0, 1.0, 1.0, -1.0]}, "a number >= 0.0, in N"),
]


@pytest.mark.parametrize("form", [JSON, MSGPACK])
@pytest.mark.parametrize(("path", "value", "wanted"), OUT_OF_RANGE)
def test_a_number_out_of_range_is_told_in_its_unit(
    path: tuple, value: object, wanted: str, form: str
) -> None:
    assert refusal(put(wall_request(), path, value), form=form)[2] == f"expected {wanted}"


@pytest.mark.parametrize("count", [1, 2, 3, 7, 50])
def test_the_wrong_one_of_many_entries_is_found(count: int) -> None:
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
    body = _pose(request["stance"]["body"]).inverse()
    for i in (1, 3):
        hand = request["stance"]["hands"][i]
        beyond = robot.beyond(hand["limb"], body @ _pose(hand["pose"]))
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


@pytest.mark.parametrize(("path", "value", "field"), LATER)
@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_what_later_versions_will_do_is_refused_by_name(
    path: tuple, value: object, field: str, form: str
) -> None:
    kind, blamed, message = refusal(put(wall_request(), path, value), form=form)
    assert (kind, blamed) == ("unsupported", field)
    assert "not supported in this version; " in message


VERTICES, FACES = (part.tolist() for part in cylinder_mesh(0.3))
WALL = [[-0.5, 0.0], [0.5, 0.0]]
STRIPS = dict.fromkeys(("outer_left", "inner_left", "inner_right", "outer_right"), WALL)


@pytest.mark.parametrize("form", [JSON, MSGPACK])
@pytest.mark.parametrize(
    "hold",
    [
        {"shape": "mesh", "vertices": VERTICES, "faces": FACES},
        {"shape": "profile", "points": [[-0.2, 0.1], [0.0, 0.0], [0.2, 0.1]]},
        {"shape": "profile", "profiles": STRIPS},
    ],
)
def test_drawn_and_scanned_rock_is_planned_on(hold: dict, form: str) -> None:
    request = put(wall_request(), (*FRONT, "hold"), hold)
    assert reply_to(request, form).verified


def test_a_cylinder_of_triangles_gives_the_plan_of_the_cylinder() -> None:
    want = ["load_factor", "prices"]
    replies = []
    for hold in (
        {"shape": "cylinder", "diameter": 0.3},
        {"shape": "mesh", "vertices": VERTICES, "faces": FACES},
    ):
        request = wall_request(HEAVY) | {"want": want}
        for hand in request["stance"]["hands"]:
            hand["hold"] = hold
        replies.append(reply_to(request))
    exact, meshed = replies
    assert meshed.status == exact.status
    assert meshed.utilisation == pytest.approx(exact.utilisation, rel=0.01)
    assert meshed.load_factor == pytest.approx(exact.load_factor, rel=0.01)
    for a, b in zip(exact.hands, meshed.hands, strict=True):
        assert b.seating.rule == a.seating.rule
        np.testing.assert_allclose(b.seating.pose.position, a.seating.pose.position, atol=1e-4)
        tensions = [[f.tendon_tension for f in hand.fingers] for hand in (a, b)]
        np.testing.assert_allclose(tensions[1], tensions[0], rtol=0.01)


@pytest.mark.parametrize(
    ("hold", "field", "words"),
    [
        ({"shape": "mesh"}, "vertices", "missing"),
        ({"shape": "mesh", "vertices": VERTICES}, "faces", "missing"),
        ({"shape": "mesh", "file": "rock.stl"}, "file", "only the command line reads files"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1]]}, "faces[0]", "length 3"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1, -1]]}, "faces[0][2]", ">= 0"),
        ({"shape": "mesh", "vertices": VERTICES, "faces": [[0, 1, 512]]}, "faces[0]", "0 to 511"),
        ({"shape": "mesh", "vertices": [[0, 0]], "faces": FACES}, "vertices[0]", "length 3"),
        ({"shape": "profile"}, "points", "points or profiles"),
        ({"shape": "profile", "points": WALL, "profiles": STRIPS}, "points", "one of them"),
        ({"shape": "profile", "points": WALL[:1]}, "points", "length >= 2"),
        ({"shape": "profile", "profiles": {"outer_left": WALL}}, "profiles.inner_left", "missing"),
        ({"shape": "profile", "points": WALL[::-1] * 2}, "points", "crosses itself|another x"),
    ],
)
def test_impossible_rock_is_refused_by_field(hold: dict, field: str, words: str) -> None:
    kind, blamed, message = refusal(put(wall_request(), (*FRONT, "hold"), hold))
    assert (kind, blamed) == ("invalid", f"stance.hands[0].hold.{field}")
    assert re.search(words, message)


def test_numbers_of_a_mesh_that_are_none_are_refused_in_messagepack_too() -> None:
    vertices = [*VERTICES[:-1], [0.0, math.nan, 0.0]]
    hold = {"shape": "mesh", "vertices": vertices, "faces": FACES}
    kind, blamed, _ = refusal(put(wall_request(), (*FRONT, "hold"), hold), form=MSGPACK)
    assert kind == "invalid"
    assert blamed.startswith("stance.hands[0].hold.vertices[511]")


@pytest.mark.parametrize(
    ("payload", "encoding"),
    [
        (b"", JSON),
        (b"{", JSON),
        (b"\xff\xfe", JSON),
        (b'{"v": 1, "id": "\xff"}', JSON),
        (b'{"v": 1, "id": "\\ud800"}', JSON),
        (b"\xc1", MSGPACK),
        (b"\x81\xa1v", MSGPACK),
        (b"{}", "image/png"),
        (b"{}", "application/jsonp"),
        (b" " * (LARGEST_REQUEST + 1), JSON),
        (b'{"v":1,"confidence":' + b"[" * 400_000, JSON),
        (b"\x82\xa1v\x01\xaaconfidence" + b"\x91" * 400_000, MSGPACK),
    ],
)
def test_bytes_that_are_no_message(payload: bytes, encoding: str) -> None:
    answer = dispatch.handle(PLAN, payload, encoding)
    error = Format.named(answer.encoding).decode(answer.payload, ErrorReply).error
    assert not answer.good
    assert error.kind == "malformed"
    assert len(answer.payload) < 1000


def test_errors_do_not_grow_with_the_request() -> None:
    for key, value in itertools.product(("x" * 500_000, "id"), ("y" * 500_000,)):
        answer = dispatch.handle(PLAN, msgspec.json.encode({key: value}))
        assert len(answer.payload) < 2000


@pytest.mark.parametrize(
    ("encoding", "form"),
    [
        ("", Format.JSON),
        ("zenoh/bytes", Format.JSON),
        ("text/json", Format.JSON),
        ("application/json;crux.PlanRequest@1", Format.JSON),
        ("Application/MsgPack; crux.PlanReply@1", Format.MSGPACK),
    ],
)
def test_names_of_encodings(encoding: str, form: Format) -> None:
    assert Format.named(encoding) is form


# Replies ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", [JSON, MSGPACK])
def test_a_reply_can_be_checked_with_nothing_but_it_and_the_request(form: str) -> None:
    request = wall_request() | {"want": ["model", "load_factor", "prices"]}
    reply = reply_to(request, form)
    assert (reply.v, reply.id, reply.status, reply.verified) == (1, "wall", "optimal", True)
    body = _pose(request["stance"]["body"]).inverse()
    balance = -np.array(reply.body_wrench)
    for asked, hand in zip(request["stance"]["hands"], reply.hands, strict=True):
        assert hand.limb == asked["limb"]
        palm = np.array(hand.palm.force)
        total = np.concatenate([palm, np.cross(hand.palm.position, palm) + hand.palm.moment])
        loads = {}
        for finger in hand.fingers:
            loads[f"{finger.name}/tension"] = finger.tendon_tension
            assert [t.phalanx for t in finger.tiles[-3:]] == ["proximal", "middle", "distal"]
            assert len(finger.tiles) == (4 if finger.name.startswith("outer") else 3)
            for tile in finger.tiles:
                force = (
                    tile.shear * np.array(tile.shear_axis)
                    + tile.normal * np.array(tile.normal_axis)
                    + tile.lateral * np.array(tile.lateral_axis)
                )
                np.testing.assert_allclose(tile.force, force, atol=1e-9)
                total += np.concatenate([tile.force, np.cross(tile.position, tile.force)])
                law = np.array(tile.load_at_zero) + finger.tendon_tension * np.array(
                    tile.load_per_newton
                )
                np.testing.assert_allclose([tile.shear, tile.normal], law, atol=1e-9)
                assert any(a[2] < 0 for a in tile.half_planes)
                if tile.contact != "none":
                    load = (tile.shear, tile.normal, tile.lateral)
                    used = max(np.dot(a[:3], load) / a[3] for a in tile.half_planes)
                    assert tile.utilisation == pytest.approx(max(used, 0.0), abs=1e-9)
                assert tile.utilisation <= hand.utilisation + 1e-9
        np.testing.assert_allclose(hand.wrench, total, atol=1e-6)
        assert hand.utilisation <= reply.utilisation + 1e-9
        balance -= wrench_transport(body @ _pose(asked["pose"])) @ hand.wrench
        _check_rows(hand, loads, reply.utilisation)
    np.testing.assert_allclose(balance, reply.residual, atol=1e-9)
    assert np.abs(balance).max() < 1e-3
    assert reply.load_factor > 1.0
    assert reply.limiting.limb in {hand.limb for hand in reply.hands}
    assert all(price.price > 0.0 for price in reply.prices)


def _pose(message: dict) -> Pose:
    return Pose.from_quaternion(message["position"], message["orientation"])


def _check_rows(hand, loads: dict[str, float], utilisation: float) -> None:
    """The reply's own loads satisfy the rows of its wrench space, and give its wrench."""
    space = hand.wrench_space
    loads["palm_shear"], loads["palm_pressing"] = -hand.palm.force[0], hand.palm.force[2]
    lateral = {
        f"{finger.name}/lateral": sum(tile.lateral for tile in finger.tiles)
        for finger in hand.fingers
    }
    y = np.array([(loads | lateral)[generator.name] for generator in space.generators])
    V = np.array([generator.wrench for generator in space.generators]).T
    np.testing.assert_allclose(np.array(space.origin) + V @ y, hand.wrench, atol=1e-6)
    for row in space.rows:
        load = np.dot(row.coefficients, y) + row.constant
        allowed = row.capacity * utilisation if row.kind == "limit" else row.capacity
        assert load <= allowed + 1e-5, row.name
    assert len({row.name for row in space.rows}) == len(space.rows)


def test_every_field_of_the_contract_is_there_and_nothing_of_the_model_unasked() -> None:
    answer = dispatch.handle(PLAN, msgspec.json.encode(wall_request()))
    reply = json.loads(answer.payload)
    assert set(reply) >= {
        "v", "id", "status", "body_wrench", "utilisation", "load_factor",
        "load_factor_unbounded", "survival_probability", "limiting", "hands", "joint_torque",
        "prices", "certificate", "residual", "verified", "solver", "time", "reason",
    }  # fmt: skip
    finger = reply["hands"][0]["fingers"][0]
    assert set(finger) == {
        "name", "tendon_tension", "motor_torque", "motor_current", "winch_angle", "tiles"
    }  # fmt: skip
    assert reply["survival_probability"] is reply["joint_torque"] is reply["prices"] is None
    assert "load_at_zero" not in finger["tiles"][0]
    assert "wrench_space" not in reply["hands"][0]


def test_an_infeasible_stance_comes_with_its_certificate() -> None:
    request = flat_request()
    request["stance"]["hands"][0]["grasp"]["palm"] = False
    reply = reply_to(request)
    assert reply.status == "infeasible"
    assert reply.hands is None
    assert reply.utilisation is None
    proof = reply.certificate
    asked = np.dot(proof.direction, reply.body_wrench)
    assert proof.needed == pytest.approx(asked)
    assert proof.supremum < proof.needed
    np.testing.assert_allclose(np.add(proof.nearest, proof.shortfall), reply.body_wrench)


def test_an_overloaded_stance_still_has_its_best_plan() -> None:
    reply = reply_to(wall_request(HEAVY))
    assert reply.status == "overloaded"
    assert reply.utilisation > 1.0
    assert reply.hands


def wrench_space_request(limb: str = "front_left") -> dict:
    return {"v": 1, "stance": flat_request()["stance"], "limb": limb}


def test_a_wrench_space_and_its_views_agree() -> None:
    answer = dispatch.handle(WRENCH_SPACE, msgspec.json.encode(wrench_space_request()))
    assert answer.good, answer.payload
    assert answer.encoding == "application/json;crux.WrenchSpaceReply@1"
    reply = msgspec.json.decode(answer.payload, type=WrenchSpaceReply)
    assert (reply.robot, reply.limb) == ("robosimian", "front_left")
    assert reply.seating.rule == "pinch"
    assert reply.seating.pose.position[2] == pytest.approx(2.3e-3, abs=1e-4)
    assert [limit.finger for limit in reply.tension_limits] == [
        "outer_left", "inner_left", "inner_right", "outer_right",
    ]  # fmt: skip
    assert len(reply.contacts) == 14
    vertices = np.array(reply.vertices)
    faces = reply.half_spaces
    assert (vertices @ np.array(faces.normals).T <= np.array(faces.offsets) + 1e-6).all()
    flat = vertices @ np.array(faces.equations.normals).T
    np.testing.assert_allclose(
        flat, np.tile(faces.equations.offsets, (len(vertices), 1)), atol=1e-6
    )
    assert reply.dimension == 6 - len(faces.equations.offsets)
    axes = ("fx", "fy", "fz", "mx", "my", "mz")
    assert set(reply.capability) == {sign + axis for sign in "+-" for axis in axes}
    for i, axis in enumerate(axes):
        for sign, factor in (("+", 1.0), ("-", -1.0)):
            reach = reply.capability[sign + axis]
            extent = (factor * vertices[:, i]).max()
            assert reach.extent == pytest.approx(extent, abs=1e-6)
            assert reach.pure is None or -1e-6 <= reach.pure <= reach.extent + 1e-6
    assert {row.kind for row in reply.rows} == {"limit", "hard"}
    assert all(row.constant == 0.0 for row in reply.rows if row.kind == "hard")


def test_a_hand_that_is_not_there() -> None:
    kind, field, message = refusal(wrench_space_request("rear_left"), WRENCH_SPACE)
    assert (kind, field) == ("invalid", "limb")
    assert "front_left" in message


def test_numbers_that_do_not_exist_are_null(monkeypatch: pytest.MonkeyPatch) -> None:
    from hand_models.fixed_wrist import TensionLimit

    endless = (TensionLimit("inner_left", math.inf, None),)
    monkeypatch.setattr(dispatch, "tension_limits", lambda _: endless)
    request = msgspec.msgpack.encode(wrench_space_request())
    answer = dispatch.handle(WRENCH_SPACE, request, MSGPACK)
    reply = msgspec.msgpack.decode(answer.payload, type=WrenchSpaceReply)
    assert reply.tension_limits[0].tension is None


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (InvalidInputError("no", field="stance.hands[0]"), "invalid"),
        (UnsupportedError("no", field="stance"), "unsupported"),
        (SolverError("no"), "internal"),
        (RuntimeError("no"), "internal"),
        (RecursionError("no"), "internal"),
        (MemoryError("no"), "internal"),
    ],
)
def test_whatever_the_planner_does_the_caller_gets_an_error(
    error: Exception, kind: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(_: object) -> None:
        raise error

    monkeypatch.setattr(solving, "plan", fail)
    got, _, message = refusal(wall_request())
    assert got == kind
    assert ("Traceback" in caplog.text) == (kind == "internal")
    if kind == "internal":
        assert type(error).__name__ in message


def test_a_hand_that_can_carry_nothing_still_tells_its_seating_and_rows() -> None:
    request = wrench_space_request()
    for hand in request["stance"]["hands"]:
        hand["surface"] = {"shear_limit": 2.0}
    answer = dispatch.handle(WRENCH_SPACE, json.dumps(request).encode())
    assert answer.good
    reply = msgspec.json.decode(answer.payload, type=WrenchSpaceReply)
    assert reply.vertices == []
    assert reply.half_spaces is None
    assert reply.dimension is None
    assert reply.capability is None
    assert reply.rows


# Schema -------------------------------------------------------------------------------------------


def test_the_schema_names_every_message_and_every_part_of_it() -> None:
    whole = schema()
    text = json.dumps(whole)
    defined = set(whole["$defs"])
    assert {message.__name__ for message in MESSAGES} <= defined
    wanted = {ref.split('"')[0] for ref in text.split("#/$defs/")[1:]}
    assert wanted <= defined
    request = whole["$defs"]["PlanRequest"]
    assert request["additionalProperties"] is False
    assert set(request["required"]) == {"v", "stance"}
    assert request["properties"]["v"]["enum"] == [1]
    assert "not supported" in request["properties"]["confidence"]["description"]


def departures(name: str, document: object) -> list[tuple]:
    """Where a document departs from the schema of that message."""
    whole = {"$ref": f"#/$defs/{name}", "$defs": schema()["$defs"]}
    errors = Draft202012Validator(whole).iter_errors(document)
    return [tuple(error.absolute_path) for error in errors]


@pytest.mark.parametrize("asked", [wall_request, flat_request, full_request, jointed_request])
def test_requests_and_replies_are_of_the_schema(asked: Callable[[], dict]) -> None:
    Draft202012Validator.check_schema(schema())
    assert departures("PlanRequest", asked()) == []
    answer = dispatch.handle(PLAN, msgspec.json.encode(asked()))
    assert answer.good
    assert departures("PlanReply", json.loads(answer.payload)) == []


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("stance", "joints"), "guess"),
        (("stance", "joints", "front_left"), []),
        (("stance", "hands", 1, "wrench"), [None] * 5),
        (("load", "angular_acceleration"), [0.0, 0.0]),
        (("limits", "per_hand", "front_left", "largest_force"), [1.0, -5.0, None]),
        (("limits", "per_hand", "front_left", "frame"), "palm"),
        (("limits", "joint_torque", "rear_left"), [0.0]),
        (("present", "rear_left"), [-1.0, 0.0, 0.0, 0.0]),
        (("objective",), "fun"),
    ],
)
def test_what_is_refused_departs_from_the_schema(path: tuple, value: object) -> None:
    request = put(jointed_request(), path, value)
    (where,) = departures("PlanRequest", request)
    assert where[: len(path)] == path[: len(where)]
    field = refusal(request)[1]
    assert field.startswith(dotted(where))


def test_replies_may_gain_fields() -> None:
    answer = dispatch.handle(PLAN, msgspec.json.encode(wall_request()))
    grown = json.loads(answer.payload) | {"news": {"of": ["a later version"]}}
    Format.JSON.decode(json.dumps(grown).encode(), PlanReply)


# Fuzz ---------------------------------------------------------------------------------------------


def check_answer(answer: dispatch.Answer, what: object) -> str:
    """An answer is a plan that says what it is, or an error that is the request's."""
    form = Format.named(answer.encoding)
    if answer.good:
        reply = form.decode(answer.payload, PlanReply)
        assert reply.status in {"optimal", "overloaded", "infeasible", "failed"}, what
        assert reply.verified == (reply.status != "failed"), what
        return reply.status
    error = form.decode(answer.payload, ErrorReply).error
    assert error.kind in KINDS, (error, what)
    return error.kind


def check_spoilt(count: int) -> None:
    chance = random.Random(20260)
    seen: dict[str, int] = {}
    for i in range(count):
        request = (full_request, flat_request, jointed_request, flat_request)[i % 4]()
        payload, encoding = spoil(request, chance)
        outcome = check_answer(dispatch.handle(PLAN, payload, encoding), (i, payload[:2000]))
        seen[outcome] = seen.get(outcome, 0) + 1
    assert seen["invalid"] > count / 4
    assert seen["malformed"] > count / 40
    assert seen["unsupported"] > count / 200
    planned = sum(seen.get(status, 0) for status in ("optimal", "overloaded", "infeasible"))
    assert planned > count / 20


def test_spoilt_requests_get_a_plan_or_an_error() -> None:
    check_spoilt(300)


@pytest.mark.slow
def test_two_thousand_spoilt_requests_get_a_plan_or_an_error() -> None:
    check_spoilt(2000)


@settings(max_examples=200, deadline=None)
@given(payload=st.binary(max_size=300), form=st.sampled_from([JSON, MSGPACK]))
def test_random_bytes_are_never_more_than_an_error(payload: bytes, form: str) -> None:
    answer = dispatch.handle(PLAN, payload, form)
    assert not answer.good


def test_malformed_errors_are_the_callers() -> None:
    with pytest.raises(MalformedError, match="not json"):
        decode_request(b"{", PlanRequest)
    with pytest.raises(InvalidInputError, match=r"limb: missing"):
        decode_request(
            msgspec.json.encode({"v": 1, "stance": flat_request()["stance"]}), WrenchSpaceRequest
        )
