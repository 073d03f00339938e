"""Channels of a recording: their schemas are what programs that draw recordings can read."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from service.recording.channels import QuestionRecord, channel_schema, topic_of
from service.wire.json_schema import MESSAGE_KINDS, schema

DEFINITIONS = schema()["$defs"]
SCALARS = {"boolean", "integer", "number", "string"}


def check_plain(schema: dict[str, Any]) -> None:
    """What Foxglove takes: an object, whose parts are objects, scalars, or lists of these."""
    assert schema["type"] == "object"
    for part in schema["properties"].values():
        assert not {"$ref", "anyOf", "oneOf"} & part.keys()
        inner = part["items"] if part["type"] == "array" else part
        if inner["type"] == "object":
            check_plain(inner)
        else:
            assert inner["type"] in SCALARS
            assert inner.get("contentEncoding") == (
                "base64" if part is inner and "contentEncoding" in inner else None
            )


@pytest.mark.parametrize("kind", [*MESSAGE_KINDS, QuestionRecord], ids=lambda kind: kind.__name__)
def test_the_schema_of_a_channel_is_plain(kind):
    described = msgspec.json.decode(channel_schema(kind.__name__, DEFINITIONS))
    check_plain(described)
    names = {field.encode_name for field in msgspec.structs.fields(kind)}
    assert described["properties"].keys() <= names


def test_what_may_be_null_is_nullable_and_what_can_be_drawn_is_there():
    reply = msgspec.json.decode(channel_schema("PublishedReply", DEFINITIONS))["properties"]
    assert reply["set_points"]["nullable"]
    points = reply["set_points"]["properties"]
    assert points["utilisation"]["type"] == "number"
    assert points["utilisation"]["nullable"]
    assert points["hands"]["items"]["properties"]["tensions"]["items"]["type"] == "number"


def test_topics_do_not_depend_on_a_stream():
    assert topic_of("crux/a/plan", "PlanReply") == "/crux/a/plan/PlanReply"
    one = topic_of("crux/a/stream/0123/set_points", "PublishedReply")
    assert one == "/crux/a/stream/PublishedReply"
