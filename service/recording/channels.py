"""Name the channels of a recording, and describe their messages in plain JSON Schema.

A message is on the channel ``/<key>/<kind>``, such as ``/crux/robosimian/plan/PlanReply``. Programs
that draw recordings, such as Foxglove, read only a part of JSON Schema: no references, no unions,
no lists of lists. In the plain schema of a channel, a value that may be null has ``nullable``, and
what cannot be said is left out; `service.wire.schema` has the whole schema of each message.
"""

from __future__ import annotations

from typing import Any, Final

import msgspec

from service.wire import service_key

__all__ = ["QUESTIONS_TOPIC", "QuestionRecord", "channel_schema", "topic_of"]

QUESTIONS_TOPIC: Final = "questions"
"""Last part of the topic of `QuestionRecord`."""

SCALAR_TYPES: Final = {"boolean", "integer", "number", "string"}


class QuestionRecord(msgspec.Struct, kw_only=True):
    """Record of a question beside its messages, which have the same sequence number.

    - ``number``: number of the question in its recording, from 1.
    - ``key``: zenoh key of the question; of a published wrench, that of its set-points.
    - ``client``: identifier of the client's session; empty without one.
    - ``status``: status of the reply, or kind of the error; ``skipped`` for a published wrench that
      a newer one has replaced.
    - ``encoding``: zenoh encoding of the request.
    - ``waited``: time from arrival to work [s].
    - ``worked``: time that a worker took [s].
    - ``payload``: request in base64, if it cannot be written as JSON; null otherwise.
    """

    number: int
    key: str
    client: str
    status: str
    encoding: str
    waited: float = 0.0
    worked: float = 0.0
    payload: bytes | None = None


def topic_of(key: str, kind: str) -> str:
    """Return the topic of a message.

    Parameters
    ----------
    key : str
        Zenoh key; those of single streams count as the key of all streams.
    kind : str
        Name of the message's type.
    """
    _, robot, name, *_ = key.split("/")
    return f"/{service_key(robot, name)}/{kind}"


def channel_schema(kind: str, definitions: dict[str, Any]) -> bytes:
    """Return the plain JSON Schema of a kind of message, encoded.

    Parameters
    ----------
    kind : str
        Name of the message's type.
    definitions : dict
        Schemas of the types of all messages, by name: ``$defs`` of `service.wire.schema`.
    """
    if kind == QuestionRecord.__name__:
        (root,), parts = msgspec.json.schema_components([QuestionRecord])
    else:
        root, parts = {"$ref": f"#/$defs/{kind}"}, definitions
    return msgspec.json.encode(_plain(root, parts) or {"type": "object", "properties": {}})


def _plain(part: dict[str, Any], parts: dict[str, Any]) -> dict[str, Any] | None:
    """Return a part of a schema without references and unions; None for what cannot be said so."""
    if "$ref" in part:
        return _plain(parts[part["$ref"].rpartition("/")[2]], parts)
    about: dict[str, Any] = {key: part[key] for key in ("title", "description") if key in part}
    if "anyOf" in part:
        others = [each for each in part["anyOf"] if each.get("type") != "null"]
        kinds = {each.get("type") for each in others}
        if len(others) == 1:
            found = _plain(others[0], parts)
        else:
            found = {"type": "number"} if kinds == {"integer", "number"} else None
        nullable = {"nullable": True} if len(others) < len(part["anyOf"]) else {}
        return None if found is None else {**about, **found, **nullable}
    if "enum" in part:
        word = all(isinstance(each, str) for each in part["enum"])
        return about | {"type": "string" if word else "integer", "enum": part["enum"]}
    kind = part.get("type")
    if kind == "object":
        named = {name: _plain(each, parts) for name, each in part.get("properties", {}).items()}
        said = {name: each for name, each in named.items() if each is not None}
        return about | {"type": kind, "properties": said}
    if kind == "array":
        given = part.get("items") or next(iter(part.get("prefixItems", [])), None)
        items = _plain(given, parts) if given else None
        # a list of lists cannot be drawn
        listed = items is None or items["type"] == "array" or "contentEncoding" in items
        return None if listed else about | {"type": kind, "items": items}
    encoded = {"contentEncoding": "base64"} if part.get("contentEncoding") == "base64" else {}
    return about | {"type": kind} | encoded if kind in SCALAR_TYPES else None
