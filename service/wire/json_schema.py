"""Build the JSON Schema of every message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import msgspec

from hand_models.parameters import Quantity
from service.replies import (
    BodySpaceReply,
    BriefPlanReply,
    ErrorReply,
    HealthReply,
    PlanReply,
    RouteReply,
    SetPointsReply,
    StreamReply,
    WrenchSpaceReply,
)
from service.requests import (
    BodySpaceRequest,
    PlanRequest,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.wire.codec import LATER_FIELDS
from service.wire.keys import ServiceName, service_key

__all__ = ["MESSAGE_KINDS", "schema"]

MESSAGE_KINDS: Final[tuple[type[msgspec.Struct], ...]] = (
    PlanRequest,
    PlanReply,
    BriefPlanReply,
    WrenchSpaceRequest,
    WrenchSpaceReply,
    BodySpaceRequest,
    BodySpaceReply,
    StreamRequest,
    StreamReply,
    SetPointsRequest,
    SetPointsReply,
    RouteRequest,
    RouteReply,
    HealthReply,
    ErrorReply,
)


def schema() -> dict[str, Any]:
    """Return one schema whose ``$defs`` hold every message; a valid document is one of them.

    ``keys`` has for each key the request, null if it takes none, and the reply.
    """
    wholes, parts = msgspec.json.schema_components(
        (*MESSAGE_KINDS, Quantity), ref_template="#/$defs/{name}"
    )
    names = {name: _plain_name(name, part["title"]) for name, part in parts.items()}
    assert len({*names.values()}) == len(parts)
    for part in parts.values():
        # fields of later versions are left out
        for name in LATER_FIELDS.keys() & part.get("properties", {}).keys():
            del part["properties"][name]
        # keep the first sentence of a docstring
        if "description" in part:
            part["description"] = part["description"].partition("\n\n")[0]
    # request of each key, if it takes one, and the possible replies
    keys: dict[str, tuple[type[msgspec.Struct] | None, *tuple[type[msgspec.Struct], ...]]] = {
        ServiceName.PLAN: (PlanRequest, PlanReply, BriefPlanReply),
        ServiceName.WRENCH_SPACE: (WrenchSpaceRequest, WrenchSpaceReply),
        ServiceName.BODY_SPACE: (BodySpaceRequest, BodySpaceReply),
        ServiceName.STREAM: (StreamRequest, StreamReply),
        ServiceName.SET_POINTS: (SetPointsRequest, SetPointsReply),
        ServiceName.HEALTH: (None, HealthReply),
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Messages of crux, version 1",
        "anyOf": list(wholes[: len(MESSAGE_KINDS)]),
        "keys": {service_key("<robot>", name): _exchange(*each) for name, each in keys.items()},
        "$defs": {names[name]: _renamed(part, names) for name, part in parts.items()},
    }


def _plain_name(name: str, title: str) -> str:
    """Return a part's name without module and parameters; a reply's part gets the suffix Reply."""
    # a part of a request may have the same name
    return title.partition("[")[0] + ("Reply" if name.startswith("service.replies.") else "")


def _renamed(part: Any, names: Mapping[str, str]) -> Any:
    """Return a part of the schema with its references renamed."""
    if isinstance(part, dict):
        return {
            key: f"#/$defs/{names[value.removeprefix('#/$defs/')]}"
            if key == "$ref"
            else _renamed(value, names)
            for key, value in part.items()
        }
    return [_renamed(each, names) for each in part] if isinstance(part, list) else part


def _exchange(
    request: type[msgspec.Struct] | None, *replies: type[msgspec.Struct]
) -> dict[str, Any]:
    references = [{"$ref": f"#/$defs/{reply.__name__}"} for reply in replies]
    return {
        "request": None if request is None else {"$ref": f"#/$defs/{request.__name__}"},
        "reply": references[0] if len(references) == 1 else {"anyOf": references},
        "error": {"$ref": f"#/$defs/{ErrorReply.__name__}"},
    }
