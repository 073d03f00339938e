"""The load that the body carries, and the limits that a caller sets."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from service.requests.request import (
    Acceleration,
    AccelerationEntry,
    Force,
    Name,
    Position,
    Strict,
    Tension,
)

__all__ = [
    "AxisForce",
    "ForceCap",
    "Limits",
    "Load",
]

Mass = Annotated[float, Meta(ge=1e-3, le=1e5, description="[kg]")]
Torque = Annotated[float, Meta(ge=1e-3, le=1e6)]
Torques = Annotated[
    list[Torque],
    Meta(min_length=1, max_length=64, description="of a limb's joints from the body outward [N·m]"),
]
ForceBound = Annotated[float, Meta(ge=-1e6, le=1e6)]
ForceRange = Annotated[
    list[ForceBound],
    Meta(min_length=2, max_length=2, description="least and largest, with zero in between [N]"),
]
AxisForce = Force | ForceRange | None
# a tuple with lists in it crashes msgspec's garbage collection
AxisForces = Annotated[list[AxisForce], Meta(min_length=3, max_length=3)]
Utilisation = Annotated[float, Meta(ge=1e-3, le=1.0)]


class Load(Strict, frozen=True, kw_only=True):
    """What the body weighs and how it is to move; by default the robot's own weight, at rest."""

    mass: Mass | None = None
    com: Annotated[Position | None, Meta(description="centre of mass in B")] = None
    acceleration: Acceleration = (0.0, 0.0, 0.0)
    angular_acceleration: Annotated[
        tuple[AccelerationEntry, AccelerationEntry, AccelerationEntry],
        Meta(description="in W [rad/s²]; needs the stance's joints"),
    ] = (0.0, 0.0, 0.0)


class ForceCap(Strict, frozen=True, kw_only=True):
    """The most that a hand may do to its rock."""

    largest_force: Annotated[
        Force | AxisForces,
        Meta(
            description="whatever its direction; or along each axis of the frame: the largest "
            "either way, a range, or null for none"
        ),
    ]
    frame: Literal["hand", "body", "world"] = "hand"


class Limits(Strict, frozen=True, kw_only=True):
    """Caps that the caller puts on the plan."""

    utilisation: Utilisation = 1.0
    tendon_tension: Tension | None = None
    joint_torque: Annotated[
        Torque | dict[Name, Torque | Torques] | None,
        Meta(description="of all joints, or by limb, in place of the robot's own figures [N·m]"),
    ] = None
    per_hand: Annotated[dict[Name, ForceCap], Meta(description="by limb")] = {}
    tension_change: Annotated[
        Tension | None, Meta(description="largest change from the present tensions [N]")
    ] = None
