"""What may be asked of a wrench stream: a stance is declared once, then asked for set-points."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from service.requests.limits import Limits, Load
from service.requests.request import Detail, Name, Query, Wrench
from service.requests.stance import Stance

__all__ = ["SetPointsRequest", "StreamRequest"]

Radius = Annotated[
    float,
    Meta(
        gt=0.0,
        le=1e4,
        description="of an interpolation, along a force; along a moment a tenth, per metre [N]",
    ),
]


class StreamRequest(Query, frozen=True, kw_only=True):
    """Declares a stance, whose wrists are fixed, for set-points of many body wrenches."""

    stance: Stance
    body_wrench: Annotated[Wrench | None, Meta(description="the first centre, in B; or load")] = (
        None
    )
    load: Load | None = None
    limits: Limits = Limits()
    radius: Radius = 30.0


class SetPointsRequest(Query, frozen=True, kw_only=True):
    """Asks a stream for the set-points of a body wrench."""

    stream: Annotated[Name, Meta(description="as the reply to its declaration names it")]
    body_wrench: Annotated[Wrench, Meta(description="that the rock must exert on the robot, in B")]
    detail: Detail = "full"
