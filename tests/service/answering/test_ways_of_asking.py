"""Every field of a question is answered alike, however it is asked.

By `plan`, by a stance that is known, by a stream of set-points, in a batch and as a service. Fields
are listed from the types of requests: one that is new here has no variant, and fails the test.
"""

from __future__ import annotations

import copy
import json
import math
import typing
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import msgspec
import numpy as np
import pytest

from hand_models.base import UnsupportedError
from planner import KnownStance, OpenLoop, Plan, Question, WrenchStream, plan
from service.answering import handle, question
from service.commands.stances import read_request
from service.processes import plan_many
from service.requests import PlanRequest
from service.wire import Format, decode_request

UTILISATION = 1e-7
"""How far two answers' utilisations may be from each other: what optima are proven to."""

STREAMS = 1e-3
"""The same of set-points, which are mixtures of plans."""

HAND = "stance.hands.0."
"""Path of the first hand's fields."""

RIGHT = "front_right"

INTO_THE_WALL = {
    "position": [0.0, -0.45, 0.6],
    "orientation": [0.0, 0.7071067811865476, 0.0, 0.7071067811865476],
}
"""A frame on the wall, z into the rock."""

PLACED = {
    "stance.joints": "solve",
    HAND + "pose": None,
    HAND + "hold": {"shape": "sphere", "diameter": 0.3, "pose": INTO_THE_WALL},
}
"""A hand on a ball of the wall, by its place."""


def on_a_log(**orientation: list[float]) -> dict[str, Any]:
    """The first hand on a log whose pose in H is given, with this orientation."""
    pose = {"position": [0.0, 0.0, 0.002], **orientation}
    return {HAND + "hold": {"shape": "cylinder", "diameter": 0.3, "pose_in_hand": pose}}


LIMBS_GIVE = {"position": 5000.0, "angle": 100.0}
TRAVEL = {"angle": 0.02}
THERE = {"point": [0.0, -0.45, 0.6], "approach": [1.0, 0.0, 0.0]}

EXECUTED = {
    "want": ["open_loop"],
    "stance.limb_stiffness": LIMBS_GIVE,
    "stance.joints": None,
    **{f"stance.hands.{i}.wrist": "compliant" for i in range(4)},
}
"""A plan that is executed as it is."""

SLIPS: dict[str, Any] = {
    "draws": 20,
    "replanned": 1,
    "seed": 3,
    "strength": 1.5,
    "hold_scatter": 0.1,
    "rock_scatter": 0.3,
    "delay": 0.02,
}
"""Draws of strengths."""

# of each field of each part of a request, what to write where
VARIANTS: dict[str, list[dict[str, Any]]] = {
    "PlanRequest.v": [{}],
    "PlanRequest.id": [{"id": "x", "detail": "full", "load": {}, "limits": {}}],
    "PlanRequest.deadline": [{"deadline": 100.0, "max_reply_bytes": 1_000_000}],
    "PlanRequest.max_reply_bytes": [{}],
    "PlanRequest.stance": [{}],
    "PlanRequest.body_wrench": [{"body_wrench": [700.0, 20.0, -30.0, 5.0, 210.0, -8.0]}],
    "PlanRequest.load": [{}],
    "PlanRequest.objective": [{"objective": "min_effort"}, {"objective": "max_robust"}],
    "PlanRequest.limits": [{}],
    "PlanRequest.present": [{"present": {RIGHT: [50.0, 60.0, 60.0, 50.0]}}],
    "PlanRequest.tolerance": [
        {"objective": "max_reliability"},
        {"objective": "max_reliability", "tolerance": 0.1},
    ],
    "PlanRequest.confidence": [],  # refused
    "PlanRequest.detail": [{}],
    "PlanRequest.want": [{"want": ["load_factor", "prices", "clearance", "model"]}],
    "PlanRequest.draws": [
        {
            "want": ["spread"],
            "draws": [
                {
                    "surfaces": {
                        "rock": {"shear_limit": {"value": 50.0, "unit": "N", "source": "assumed"}}
                    }
                }
            ],
        }
    ],
    "PlanRequest.explain": [{"explain": False, "load.mass": 200.0}],
    "PlanRequest.body_range": [{"body_range": {"shift": 0.1}}],
    "PlanRequest.open_loop": [{}],
    "PlanRequest.survival": [{"want": ["survival"], "survival": SLIPS}],
    **{f"SurvivalSettings.{part}": [{}] for part in SLIPS},
    "OpenLoopSettings.samples": [{}],
    "OpenLoopSettings.seed": [
        {
            **EXECUTED,
            "open_loop": {
                "samples": 2,
                "seed": 7,
                "position": 1e-3,
                "height": 1e-4,
                "tilt": 1e-3,
                "yaw": 0.1,
            },
        }
    ],
    **{f"OpenLoopSettings.{part}": [{}] for part in ("position", "height", "tilt", "yaw")},
    "BodyRange.shift": [{"body_range": {"shift": 0.01}}],
    "BodyRange.tilt": [{"body_range": {"tilt": 0.01}}],
    "Load.mass": [{"load.mass": mass} for mass in (40.0, 150.0)],
    "Load.com": [{"load.com": [0.05, 0.02, -0.1]}],
    "Load.acceleration": [{"load.acceleration": [0, -0.1, 0.3]}],
    "Load.angular_acceleration": [{"load.angular_acceleration": [0.1, 0.2, -0.3]}],
    "Load.payloads": [
        {"load.payloads": [{"mass": 3.0, "limb": RIGHT}], "load.acceleration": [0.0, 0.3, 0.2]}
    ],
    "Payload.mass": [{"load.payloads": [{"mass": 8.0, "limb": RIGHT}]}],
    "Payload.link": [{"load.payloads": [{"mass": 8.0, "link": "limb2_link4"}]}],
    "Payload.limb": [{}],
    "Payload.com": [{"load.payloads": [{"mass": 8.0, "link": "torso", "com": [0.1, 0.2, 0.1]}]}],
    "Limits.utilisation": [{"limits.utilisation": 0.8}],
    "Limits.tendon_tension": [{"limits.tendon_tension": 90.0}],
    "Limits.joint_torque": [{"limits.joint_torque": 60.0}, {"limits.joint_torque": {RIGHT: 30.0}}],
    "Limits.per_hand": [{"limits.per_hand": {RIGHT: {"largest_force": 150.0}}}],
    "Limits.tension_change": [
        {"limits.tension_change": 30.0, "present": {RIGHT: [60.0, 80.0, 80.0, 60.0]}}
    ],
    "Limits.hold_margin": [{"limits.hold_margin": 4.0}],
    "Limits.margins": [{"limits.margins": "if_possible"}],
    "Limits.palm_margin": [{"limits.palm_margin": 60.0}],
    "Limits.least_tension": [{"limits.least_tension": 35.0}],
    "ForceCap.largest_force": [
        {"limits.per_hand": {RIGHT: {"largest_force": [[-400, 400], None, [-50, 200]]}}}
    ],
    "ForceCap.frame": [
        {"limits.per_hand": {RIGHT: {"largest_force": [[-150, 150], None, None], "frame": frame}}}
        for frame in ("world", "body")
    ],
    "Stance.robot": [{"stance.robot": "robosimian"}],
    "Stance.hand": [
        {
            "stance.hand": {
                "tendon": {"maximum_tension": {"value": 120.0, "unit": "N", "source": "assumed"}}
            }
        }
    ],
    "Stance.gravity": [{"stance.gravity": [1.0, 0.5, -9.0]}],
    "Stance.body": [{"stance.joints": "solve", "stance.body.position": [-0.42, 0.02, 0.0]}],
    "Stance.limb_stiffness": [{"stance.limb_stiffness": LIMBS_GIVE, HAND + "wrist": "compliant"}],
    "LimbStiffness.position": [{"stance.limb_stiffness": LIMBS_GIVE, HAND + "wrist": "floating"}],
    "LimbStiffness.angle": [{"stance.limb_stiffness": LIMBS_GIVE}],
    "Stance.joints": [{"stance.joints": None}, {"stance.joints": "solve"}],
    "Stance.rocks": [
        {
            "stance.rocks": {"log": {"shape": "cylinder", "diameter": 0.3}},
            HAND + "hold": {"shape": "rock", "rock": "log"},
        }
    ],
    "Stance.hands": [{"stance.hands": 3}],
    "Hand.limb": [{}],
    "Hand.pose": [{"stance.joints": "solve", HAND + "pose.position": [0.02, -0.45, 0.6]}],
    "Hand.place": [{**PLACED, HAND + "place": THERE}],
    "Hand.hold": [{HAND + "hold": {"shape": "sphere", "diameter": 0.4}}],
    "Hand.surface": [
        {HAND + "surface": "concrete-coarse"},
        {HAND + "surface": {"shear_limit": 50}},
    ],
    "Hand.grasp": [{HAND + "grasp": {}}],
    "Hand.wrist": [{HAND + "wrist": "floating"}, {HAND + "wrist": "compliant"}],
    "Hand.wrist_travel": [{}],
    "WristTravel.position": [
        {HAND + "wrist": "compliant", HAND + "wrist_travel": {"position": 2e-3}}
    ],
    "WristTravel.inward": [{HAND + "wrist": "compliant", HAND + "wrist_travel": {"inward": 2e-3}}],
    "WristTravel.angle": [{HAND + "wrist": "compliant", HAND + "wrist_travel": TRAVEL}],
    "Hand.tendon_preload": [
        {HAND + "wrist": "floating", HAND + "tendon_preload": [30.0, 30.0, 30.0, 30.0]}
    ],
    "Hand.wrench": [{HAND + "wrench": [None, None, -60.0, None, None, None]}],
    "Hand.seat": [{HAND + "seat": "best"}],
    "Hand.seat_direction": [{HAND + "seat": "best", HAND + "seat_direction": [1, 0, -1, 0, 0, 0]}],
    "Hand.placing": [
        {"stance.joints": "solve", HAND + "placing": "contact"},
        {"stance.joints": "solve", HAND + "placing": "contact", HAND + "wrist": "compliant"},
    ],
    "Hand.contact_offset": [
        {
            "stance.joints": "solve",
            HAND + "placing": "contact",
            HAND + "contact_offset": [0.0, 0.0, -5e-4, 0.0, 0.0, 0.0],
        }
    ],
    "Grasp.outer_rotation": [{HAND + "grasp.outer_rotation": 3.0}],
    "Grasp.closing_tension": [{HAND + "grasp.closing_tension": 30.0}],
    "Grasp.palm": [{HAND + "grasp.palm": False}],
    "Grasp.lateral": [{HAND + "grasp.lateral": False}],
    "Grasp.fingernail": [{HAND + "grasp.fingernail": True}],
    "Place.point": [{}],
    "Place.approach": [{}],
    "Place.wrist_angle": [{**PLACED, HAND + "place": {**THERE, "wrist_angle": 0.1}}],
    "Place.frame": [
        {**PLACED, HAND + "place": {"point": [0, 0, 0], "approach": [0, 0, 1], "frame": "rock"}}
    ],
    "Place.up": [{**PLACED, HAND + "place": {**THERE, "up": [0.0, 0.3, 1.0]}}],
    "Pose.position": [{}],
    "Pose.orientation": [{}],
    "Pose.rpy": [on_a_log(rpy=[0.0, 0.02, math.pi])],
    "Pose.x_axis": [on_a_log(x_axis=[-1.0, 0.02, 0.0], z_axis=[0.0, 0.0, 2.0])],
    "Pose.z_axis": [{}],
    "Draw.hand": [
        {
            "want": ["spread"],
            "draws": [
                {
                    "hand": {
                        "tendon": {
                            "maximum_tension": {"value": 90.0, "unit": "N", "source": "assumed"}
                        }
                    }
                }
            ],
        }
    ],
    "Draw.surfaces": [{}],
}

ROCKS = ("service.requests.holds",)
"""Modules whose parts are holds, of which a hand has one as a whole."""


def parts(kind: Any, seen: set[type]) -> Iterator[type]:
    """The structs of a request, each once."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        if kind in seen or kind.__module__ in ROCKS:
            return
        seen.add(kind)
        yield kind
        for entry in msgspec.structs.fields(kind):
            yield from parts(entry.type, seen)
    for inner in typing.get_args(kind):
        yield from parts(inner, seen)


FIELDS = [
    f"{part.__name__.removesuffix('Message')}.{entry.name}"
    for part in parts(PlanRequest, set())
    for entry in msgspec.structs.fields(part)
]
CASES = [(name, i) for name in VARIANTS for i in range(len(VARIANTS[name]))]
DEAR = {
    *("OpenLoopSettings.seed", "LimbStiffness.position", "Hand.tendon_preload"),
    *("Hand.seat_direction", "WristTravel.position", "WristTravel.inward"),
}
"""Fields whose variants take longest, as their wrists move or their seats are looked for."""

TRIVIAL = [case for case in CASES if not VARIANTS[case[0]][case[1]]]


@lru_cache
def plain(name: str) -> bytes:
    return msgspec.json.encode(read_request(name))


def request_of(name: str, i: int) -> dict[str, Any]:
    """The bundled stance with joints, changed."""
    asked = json.loads(plain("wall-300-joints"))
    asked["want"] = ["load_factor", "prices"]
    for path, value in copy.deepcopy(VARIANTS[name][i]).items():
        if path == "stance.hands":
            asked["stance"]["hands"] = asked["stance"]["hands"][:value]
            continue
        part, *others, last = [asked, *path.split(".")]
        for step in others:
            part = part[int(step)] if isinstance(part, list) else part.setdefault(step, {})
        part[last] = value
    return asked


def alike(one: dict[str, Any], other: dict[str, Any], within: float) -> None:
    """Two answers' numbers are the same."""
    assert one.keys() == other.keys()
    for name, value in one.items():
        if isinstance(value, str | None) or value is None or other[name] is None:
            assert value == other[name], name
        else:
            np.testing.assert_allclose(
                np.asarray(value, float), np.asarray(other[name], float), atol=within, err_msg=name
            )


def numbers(answer: Any) -> dict[str, Any]:
    """What every way says of a plan, by the names that objects and replies share."""
    torque = answer.joint_torque
    most = max(map(np.abs, map(np.max, map(np.abs, torque.values())))) if torque else None
    return {
        "status": answer.status,
        "utilisation": answer.utilisation,
        "load_factor": answer.load_factor,
        "effort": answer.effort,
        "body_wrench": answer.body_wrench,
        "torque": None if most is None else most / 100.0,
        "open_loop": _used_over_samples(answer),
    }


def _used_over_samples(answer: Any) -> list[float] | None:
    if not isinstance(answer.open_loop, OpenLoop):
        return None
    return [sample.utilisation for sample in answer.open_loop.samples]


def test_every_field_of_a_question_has_a_variant():
    assert sorted(VARIANTS) == sorted(FIELDS)


@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize(
    ("name", "i"),
    [
        pytest.param(*case, marks=pytest.mark.slow if case[0] in DEAR else ())
        for case in CASES
        if case not in TRIVIAL
    ],
)
def test_a_question_is_answered_alike_in_every_way(name: str, i: int):
    asked = request_of(name, i)
    decoded = msgspec.convert(asked, PlanRequest)
    as_question = question(decoded)
    answer = plan(as_question)
    assert answer.status != "failed", answer.reason
    assert answer.verified
    told = numbers(answer)

    packed = msgspec.msgpack.encode(asked)
    assert decode_request(packed, PlanRequest, Format.MSGPACK) == decoded
    json_reply = handle("crux/robosimian/plan", json.dumps(asked).encode())
    assert json_reply.good, json_reply.payload
    (in_batch,) = plan_many([decoded])
    alike(told, numbers(in_batch), UTILISATION)
    served = json.loads(json_reply.payload)
    assert served["status"] == answer.status
    if answer.utilisation is not None:
        assert served["utilisation"] == pytest.approx(answer.utilisation, abs=UTILISATION)

    if told["open_loop"] is not None:
        there = [sample["utilisation"] for sample in served["open_loop"]["samples"]]
        np.testing.assert_allclose(there, told["open_loop"], atol=UTILISATION)

    if "survival" in served:
        assert served["survival"] == msgspec.to_builtins(in_batch.survival)
        assert served["survival_probability"] == in_batch.survival.no_slip

    again = KnownStance(as_question).plan(answer.body_wrench)
    assert again.status == answer.status, again.reason
    alike(told, numbers(again), UTILISATION)
    if answer.prices is not None:
        assert [each.name for each in again.prices or ()] == [each.name for each in answer.prices]

    _stream(as_question, answer)


def _stream(asked: Question, answer: Plan) -> None:
    """Set-points of the same wrench, where a stream takes such a question."""
    try:
        stream = WrenchStream(asked)
    except UnsupportedError:
        return
    with stream:
        points = stream.set_points(answer.body_wrench)
    np.testing.assert_allclose(stream.first, answer.body_wrench, rtol=1e-12, atol=1e-9)
    assert points.verified, points.reason
    assert points.status == answer.status
    if answer.utilisation is not None:
        assert math.isclose(points.utilisation, answer.utilisation, abs_tol=STREAMS)
