"""Field types of requests, shared by all packages: strict structs and bounded numbers.

The bounds are far beyond any climbing robot and keep arithmetic finite. They apply to messages; a
part that is built in Python has the checks of its class.
"""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

__all__ = [
    "Acceleration",
    "AccelerationEntry",
    "Coordinate",
    "Force",
    "Mass",
    "Name",
    "Position",
    "Strict",
    "Tension",
]

Coordinate = Annotated[float, Meta(ge=-1e4, le=1e4)]
Position = Annotated[tuple[Coordinate, Coordinate, Coordinate], Meta(description="[m]")]
AccelerationEntry = Annotated[float, Meta(ge=-1e3, le=1e3)]
Acceleration = Annotated[
    tuple[AccelerationEntry, AccelerationEntry, AccelerationEntry],
    Meta(description="in W [m/s²]"),
]
Force = Annotated[float, Meta(ge=1e-3, le=1e6, description="[N]")]
Mass = Annotated[float, Meta(ge=1e-3, le=1e5, description="[kg]")]
Tension = Annotated[float, Meta(ge=1e-3, le=1e4, description="of a tendon [N]")]
Name = Annotated[str, Meta(max_length=64)]


class Strict(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Base class of the parts of a request; decoding a part with an unknown field is an error."""
