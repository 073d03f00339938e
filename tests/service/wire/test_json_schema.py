"""The schema of all messages: what travels is of it, and what is refused departs from it."""

from __future__ import annotations

import json

import msgspec
from jsonschema import Draft202012Validator

from service.answering import dispatch
from service.wire import schema
from service.wire.json_schema import MESSAGE_KINDS
from tests.suite.helpers.replies import PLAN, departures, refusal
from tests.suite.helpers.requests import (
    dotted,
    flat_request,
    full_request,
    put,
    request_with_joints,
    wall_request,
)


def test_the_schema_names_every_message_and_every_part_of_it() -> None:
    whole = schema()
    text = json.dumps(whole)
    defined = set(whole["$defs"])
    assert {message.__name__ for message in MESSAGE_KINDS} <= defined
    wanted = {ref.split('"')[0] for ref in text.split("#/$defs/")[1:]}
    assert wanted <= defined
    request = whole["$defs"]["PlanRequest"]
    assert request["additionalProperties"] is False
    assert set(request["required"]) == {"v", "stance"}
    assert request["properties"]["v"]["enum"] == [1]
    # what is refused is not offered
    assert "confidence" not in request["properties"]
    objectives = ["max_margin", "max_reliability", "max_robust", "min_effort"]
    assert request["properties"]["objective"]["enum"] == objectives


def test_names_are_of_messages_and_not_of_modules() -> None:
    defined = schema()["$defs"]
    assert all(name.isidentifier() for name in defined)
    assert "limb" in defined["Hand"]["properties"]
    assert "fingers" in defined["HandReply"]["properties"]
    hands = defined["PlanReply"]["properties"]["hands"]
    assert "#/$defs/HandReply" in json.dumps(hands)


def test_every_key_has_its_request_and_reply() -> None:
    whole = schema()
    told = whole["keys"]
    for name, service in dispatch.SERVICES_BY_NAME.items():
        assert told[f"crux/<robot>/{name}"]["request"] == {
            "$ref": f"#/$defs/{service.request.__name__}"
        }
    assert told["crux/<robot>/health"]["request"] is None
    wanted = {ref.split('"')[0] for ref in json.dumps(told).split("#/$defs/")[1:]}
    assert wanted <= set(whole["$defs"])
    assert {"BriefPlanReply", "HealthReply", "SetPointsReply", "ErrorReply"} <= wanted


def test_requests_and_replies_are_of_the_schema() -> None:
    Draft202012Validator.check_schema(schema())
    for asked in [wall_request, flat_request, full_request, request_with_joints]:
        assert departures("PlanRequest", asked()) == []
        answer = dispatch.handle(PLAN, msgspec.json.encode(asked()))
        assert answer.good
        assert departures("PlanReply", json.loads(answer.payload)) == []


def test_what_is_refused_departs_from_the_schema() -> None:
    for path, value in [
        (("stance", "joints"), "guess"),
        (("stance", "joints", "front_left"), []),
        (("stance", "hands", 1, "wrench"), [None] * 5),
        (("load", "angular_acceleration"), [0.0, 0.0]),
        (("limits", "per_hand", "front_left", "largest_force"), [1.0, -5.0, None]),
        (("limits", "per_hand", "front_left", "frame"), "palm"),
        (("limits", "joint_torque", "rear_left"), [-1.0]),
        (("present", "rear_left"), [-1.0, 0.0, 0.0, 0.0]),
        (("objective",), "fun"),
    ]:
        request = put(request_with_joints(), path, value)
        (where,) = departures("PlanRequest", request)
        assert where[: len(path)] == path[: len(where)]
        field = refusal(request)[1]
        assert field.startswith(dotted(where))
