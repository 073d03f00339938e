"""Define the requests for plans, wrench and body spaces, set-points and climbs.

Fields that the contract knows but this version does not are declared, so that they are refused by
name (`service.wire.codec`) and not as unknown.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from hand_models.base import Coordinate, Name, Strict
from planner import BodyRange, Limits, Load, Objective, Want
from service.requests.request import (
    Detail,
    Identifier,
    Later,
    Pose,
    Query,
    Request,
    Tensions,
    Wrench,
)
from service.requests.stance import Angles, Entries, Hand, HandEntries, Stance

__all__ = [
    "Axis",
    "BodySpaceRequest",
    "Draw",
    "PlanRequest",
    "RouteRequest",
    "SetPointsRequest",
    "SpaceWant",
    "StreamRequest",
    "WrenchSpaceRequest",
]

ObjectiveName = Annotated[
    Objective,
    Meta(description="least utilisation, or least effort within limits.utilisation"),
]
Explain = Annotated[
    bool,
    Meta(
        description="whether a certificate proves what keeps the stance from a plan, and names "
        "limits that together do; without it, the same status is there sooner"
    ),
]
Axis = Literal["fx", "fy", "fz", "mx", "my", "mz"]
Direction = tuple[Coordinate, Coordinate, Coordinate]
SpaceWant = Literal["robust", "half_spaces", "vertices"]
Radius = Annotated[
    float,
    Meta(
        gt=0.0,
        le=1e4,
        description="of an interpolation, along a force; along a moment a tenth, per metre [N]",
    ),
]


class Draw(Strict, frozen=True, kw_only=True):
    """One set of numbers that hand and rock may have; what it leaves open stays as it is."""

    hand: HandEntries | None = None
    surfaces: Annotated[
        Entries | None,
        Meta(
            description="numbers of presets in place of the bundled ones, by section and entry of "
            "their parameter file surfaces.toml"
        ),
    ] = None


Draws = Annotated[
    list[Draw],
    Meta(
        min_length=1,
        max_length=100,
        description="over which the spread is told; by default those of draws.toml",
    ),
]


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
    detail: Detail | None = None
    want: Annotated[
        list[Want],
        Meta(
            description="robust: the least load factor over a scatter of the hands' places, too. "
            "spread: utilisation and load factor over draws of the hand's and the rock's numbers. "
            "clearance: the least distances of body, hands, links and rock. "
            "advice: what would make it hold, or hold more: verified changes"
        ),
    ] = []
    draws: Draws = []
    explain: Explain = True
    body_range: Annotated[BodyRange, Meta(description="for the advice")] = BodyRange()


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
    detail: Detail | None = None


class Move(Hand, frozen=True, kw_only=True):
    """One limb to its next hold."""

    body: Annotated[
        Pose | None, Meta(description="of B in W: where the body shifts to before the limb lifts")
    ] = None
    joints: Annotated[
        dict[Name, Angles | Literal["solve"]] | Literal["solve"],
        Meta(
            description="of a start stance with joints, angles by limb: of those on the rock from "
            "the shift on, of the limb that moves on its new hold. Limbs left out keep theirs, "
            "unless the body shifts or they move: then they are found"
        ),
    ] = "solve"


class RouteRequest(Request, frozen=True, kw_only=True):
    """A climb: a start stance, and moves. Not asked over zenoh, but in bulk work."""

    id: Identifier | None = None
    name: Identifier = "route"
    stance: Stance
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    moves: Annotated[list[Move], Meta(max_length=10_000)]
    explain: Explain = True
    want: Annotated[
        list[Literal["spread"]],
        Meta(description="of every stance, beside its load factor: as in a plan's request"),
    ] = []
    draws: Draws = []
