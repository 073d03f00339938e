"""Build the JSON Schema of all requests and replies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import msgspec

from hand_models.parameters import Quantity
from service.replies import (
    BodySpaceReply,
    BriefPlanReply,
    CancelReply,
    ClimbReply,
    ClimbSetPoints,
    DiagnosisReply,
    ErrorReply,
    HealthReply,
    PartReply,
    PlanReply,
    PublishedReply,
    RouteReply,
    SetPointsReply,
    StreamReply,
    WrenchSpaceReply,
)
from service.requests import (
    BodySpaceRequest,
    CancelRequest,
    ClimbRequest,
    DiagnosisRequest,
    PlanRequest,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchRequest,
    WrenchSpaceRequest,
)
from service.wire.codec import LATER_FIELDS
from service.wire.keys import ServiceName, service_key, stream_key

__all__ = ["MESSAGE_KINDS", "part_name", "schema"]

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
    WrenchRequest,
    PublishedReply,
    DiagnosisRequest,
    DiagnosisReply,
    RouteRequest,
    RouteReply,
    ClimbRequest,
    ClimbReply,
    PartReply,
    CancelRequest,
    CancelReply,
    ClimbSetPoints,
    HealthReply,
    ErrorReply,
)


def schema() -> dict[str, Any]:
    """Build one JSON Schema for all messages; a document is valid if it is one of the messages.

    Returns
    -------
    dict
        The schema, draft 2020-12. Besides ``$defs`` with all types, the entry ``keys`` has the
        types of request, reply and error for each zenoh key; the request is null for a key that
        takes none. A key at which messages are only published has the type ``published``.
    """
    wholes, parts = msgspec.json.schema_components(
        (*MESSAGE_KINDS, Quantity), ref_template="#/$defs/{name}"
    )
    names = {name: part_name(part["title"]) for name, part in parts.items()}
    assert len({*names.values()}) == len(parts)
    for name, part in parts.items():
        if part["title"].endswith(("Reply", "Message")):
            part["title"] = names[name]
        # fields of later versions are left out
        for field in LATER_FIELDS.keys() & part.get("properties", {}).keys():
            del part["properties"][field]
        # keep the first sentence of a docstring
        if "description" in part:
            part["description"] = part["description"].partition("\n\n")[0]
    published: dict[str, type[msgspec.Struct]] = {
        service_key("<robot>", ServiceName.PLAY): ClimbSetPoints,
        stream_key("<robot>", "<stream>", ServiceName.WRENCH): WrenchRequest,
        stream_key("<robot>", "<stream>", ServiceName.SET_POINTS): PublishedReply,
    }
    # request of each key, if it takes one, and the possible replies
    keys: dict[str, tuple[type[msgspec.Struct] | None, *tuple[type[msgspec.Struct], ...]]] = {
        ServiceName.PLAN: (PlanRequest, PlanReply, BriefPlanReply),
        ServiceName.WRENCH_SPACE: (WrenchSpaceRequest, WrenchSpaceReply),
        ServiceName.BODY_SPACE: (BodySpaceRequest, BodySpaceReply),
        ServiceName.STREAM: (StreamRequest, StreamReply),
        ServiceName.SET_POINTS: (SetPointsRequest, SetPointsReply),
        ServiceName.DIAGNOSIS: (DiagnosisRequest, DiagnosisReply),
        ServiceName.ROUTE: (RouteRequest, RouteReply, PartReply),
        ServiceName.CLIMB: (ClimbRequest, ClimbReply, PartReply),
        ServiceName.CANCEL: (CancelRequest, CancelReply),
        ServiceName.HEALTH: (None, HealthReply),
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Messages of crux, version 1",
        "anyOf": list(wholes[: len(MESSAGE_KINDS)]),
        "keys": {service_key("<robot>", name): _exchange(*each) for name, each in keys.items()}
        | {key: {"published": _reference(kind)} for key, kind in published.items()},
        "$defs": {names[name]: _renamed(part, names) for name, part in parts.items()},
    }


def part_name(title: str) -> str:
    """Return a class's name in the schema, without type parameters, ``Message`` or ``Reply``.

    Parameters
    ----------
    title : str
        Name of the class, such as ``Palm[list[float]]``.

    Returns
    -------
    str
        Name of the class without ``Message``; without ``Reply`` if the class is only a part of a
        reply, and no part of a request has the same name.
    """
    name = title.partition("[")[0].removesuffix("Message")
    short = name.removesuffix("Reply")
    # a part of a request has this name, too
    alike = short == "Hand"
    return name if alike or name in {each.__name__ for each in MESSAGE_KINDS} else short


def _renamed(part: Any, names: Mapping[str, str]) -> Any:
    """Return a part of the schema with its references renamed."""
    if isinstance(part, dict):
        return {key: _renamed(value, names) for key, value in part.items()}
    if isinstance(part, list):
        return [_renamed(each, names) for each in part]
    if isinstance(part, str) and part.startswith("#/$defs/"):
        return f"#/$defs/{names[part.removeprefix('#/$defs/')]}"
    return part


def _exchange(
    request: type[msgspec.Struct] | None, *replies: type[msgspec.Struct]
) -> dict[str, Any]:
    references = [_reference(reply) for reply in replies]
    return {
        "request": None if request is None else _reference(request),
        "reply": references[0] if len(references) == 1 else {"anyOf": references},
        "error": _reference(ErrorReply),
    }


def _reference(kind: type[msgspec.Struct]) -> dict[str, str]:
    return {"$ref": f"#/$defs/{kind.__name__}"}
