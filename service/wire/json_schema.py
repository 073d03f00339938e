"""The JSON Schema of every message."""

from __future__ import annotations

from typing import Any, Final

import msgspec

from hand_models.parameters import Quantity
from service.replies import (
    BodySpaceReply,
    BriefPlanReply,
    ErrorReply,
    HealthReply,
    PlanReply,
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

__all__ = ["MESSAGES", "schema"]

MESSAGES: Final[tuple[type[msgspec.Struct], ...]] = (
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
    HealthReply,
    ErrorReply,
)


def schema() -> dict[str, Any]:
    """Return one schema whose ``$defs`` hold every message; a valid document is one of them."""
    wholes, parts = msgspec.json.schema_components(
        (*MESSAGES, Quantity), ref_template="#/$defs/{name}"
    )
    for part in parts.values():
        # of a docstring that says more, its first sentence
        if "description" in part:
            part["description"] = part["description"].partition("\n\n")[0]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Messages of crux, version 1",
        "anyOf": list(wholes[: len(MESSAGES)]),
        "$defs": parts,
    }
