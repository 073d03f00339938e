"""The question who carries what in a stance.

Fields that the contract knows but this version does not are declared, so that they are refused by
name (`service.wire.checks`) and not as unknown.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from service.requests.limits import Limits, Load
from service.requests.request import Detail, Later, Name, Query, Tensions, Wrench
from service.requests.stance import Stance

__all__ = [
    "ObjectiveName",
    "PlanRequest",
    "Want",
]

ObjectiveName = Annotated[
    Literal["max_margin", "min_effort", "max_reliability"],
    Meta(
        description="least utilisation, or least effort within limits.utilisation; "
        "max_reliability is not supported in this version"
    ),
]
Want = Literal["load_factor", "prices", "model", "robust"]


class PlanRequest(Query, frozen=True, kw_only=True):
    """Asks who carries what in a stance."""

    stance: Stance
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions],
        Meta(description="tensions of the tendons now, by limb: is the straight way safe? [N]"),
    ] = {}
    confidence: Later = None
    detail: Detail = "full"
    want: Annotated[
        list[Want],
        Meta(description="robust: the least load factor over a scatter of the hands' places, too"),
    ] = []
