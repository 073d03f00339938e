"""The questions what one hand of a stance can carry, and what its body can bear."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from service.requests.limits import Limits, Load
from service.requests.request import Coordinate, Name, Query, Tensions, Wrench
from service.requests.stance import Stance

__all__ = [
    "Axis",
    "BodySpaceRequest",
    "SpaceWant",
    "WrenchSpaceRequest",
]

Axis = Literal["fx", "fy", "fz", "mx", "my", "mz"]
Direction = tuple[Coordinate, Coordinate, Coordinate]
SpaceWant = Literal["robust", "half_spaces", "vertices"]


class WrenchSpaceRequest(Query, frozen=True, kw_only=True):
    """Asks what one hand of a stance can carry."""

    stance: Stance
    limb: Name
    want: Annotated[
        list[SpaceWant] | None,
        Meta(
            description="what is told beside rows and capability, each at most once; an error of "
            "kind limit where it would cost too much, as many half_planes may. By default "
            "half_spaces and vertices where they are cheap. robust: the least that it can carry "
            "over a scatter of its place",
            extra_json_schema={"uniqueItems": True},
        ),
    ] = None


class BodySpaceRequest(Query, frozen=True, kw_only=True):
    """Asks what a stance can hold: body wrenches, a plane of them, and accelerations."""

    stance: Stance
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions], Meta(description="tensions of the tendons now, by limb [N]")
    ] = {}
    axes: Annotated[
        list[Axis], Meta(min_length=2, max_length=2, description="of the plane; fx and fz")
    ] = field(default_factory=lambda: ["fx", "fz"])
    others: Annotated[
        Literal["needed", "zero", "free"],
        Meta(
            description="the plane's other components: as asked for, zero, or whatever they may be"
        ),
    ] = "needed"
    directions: Annotated[
        list[Direction],
        Meta(
            max_length=100,
            description="along which the largest acceleration is wanted, in W: one program each",
        ),
    ] = []
