"""A stance: where the body and the hands are, and how these take their holds."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from msgspec import Meta

from service.requests.holds import Hold, Rock, Surface
from service.requests.request import (
    Acceleration,
    Name,
    Pose,
    PreloadEntry,
    Strict,
    Tension,
    WrenchEntry,
)

__all__ = [
    "Grasp",
    "Hand",
    "Stance",
]

OuterRotation = Annotated[float, Meta(ge=0.0, le=math.pi + 1e-6, description="[rad]")]
Preload = Annotated[
    tuple[PreloadEntry, PreloadEntry, PreloadEntry, PreloadEntry],
    Meta(
        description="tensions that the tendons of a floating hand hold at rest [N]; by default the "
        "closing tension"
    ),
]
Angle = Annotated[float, Meta(ge=-1e3, le=1e3)]
Angles = Annotated[
    list[Angle],
    Meta(min_length=1, max_length=64, description="of a limb's joints from the body outward [rad]"),
]
HandEntries = Annotated[
    dict[Name, Any],
    Meta(
        description="numbers of the hand in place of the service's own, by section and entry of "
        "its parameter file hand.toml",
        extra_json_schema={
            "additionalProperties": {
                "type": "object",
                "additionalProperties": {"$ref": "#/$defs/Quantity"},
            }
        },
    ),
]


class Grasp(Strict, frozen=True, kw_only=True):
    """How a hand takes its hold."""

    outer_rotation: OuterRotation = 0.0
    closing_tension: Tension | None = None
    palm: bool = True
    lateral: bool = True
    fingernail: Annotated[
        bool, Meta(description="fingers straight, clinging with their nails alone")
    ] = False


class Hand(Strict, frozen=True, kw_only=True):
    """One hand on its hold."""

    limb: Name
    pose: Annotated[Pose, Meta(description="of H in W")]
    hold: Hold
    surface: Annotated[Name | Surface, Meta(description="a preset's name, or numbers")]
    grasp: Grasp = Grasp()
    wrist: Annotated[
        Literal["fixed", "floating"],
        Meta(description="floating: the motors stand still, and the wrist gives way"),
    ] = "fixed"
    tendon_preload: Preload | None = None
    wrench: Annotated[
        tuple[
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
            WrenchEntry | None,
        ]
        | None,
        Meta(
            description="what the hand must exert on the rock, in H [N, N·m]; null components are "
            "the plan's"
        ),
    ] = None
    seat: Annotated[
        Literal["rest", "best"],
        Meta(
            description="how a hand is seated whose hold has no pose: as its grasp would have it, "
            "or near there where it holds most"
        ),
    ] = "rest"
    seat_direction: Annotated[
        tuple[WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry] | None,
        Meta(
            description="in which wrench on the rock, in H, the best seat is to hold most; by "
            "default the pull-off"
        ),
    ] = None


class Stance(Strict, frozen=True, kw_only=True):
    """Where the body and the hands are."""

    robot: Annotated[
        Name | None,
        Meta(description="by default that which is served or given by --robot, or robosimian"),
    ] = None
    hand: HandEntries | None = None
    gravity: Acceleration | None = None
    body: Annotated[Pose, Meta(description="of B in W")]
    joints: Annotated[
        dict[Name, Angles] | Literal["solve"] | None,
        Meta(
            description="angles of every limb with a hand, or that inverse kinematics finds them; "
            "with joints their torques count"
        ),
    ] = None
    rocks: Annotated[
        dict[Name, Rock],
        Meta(
            max_length=64,
            description="by name, for hands that refer to them; a mesh's frame may begin anywhere",
        ),
    ] = {}
    hands: Annotated[list[Hand], Meta(max_length=16)]
