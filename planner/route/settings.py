"""How a controller goes from knot to knot of a climb, and how many knots there are."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta
from msgspec.structs import replace

from hand_models.base import InvalidFieldError, Strict
from hand_models.parameters import bundled_table

__all__ = ["ClimbSettings"]

Rate = Annotated[float, Meta(ge=1e-4, le=1e4)]


class ClimbSettings(Strict, frozen=True, kw_only=True):
    """Rates of a robot's controller; those of ``climb.toml`` where left out.

    Attributes
    ----------
    tension_rate : float, optional
        Largest change of a tendon's tension with time [N/s].
    joint_speed : float, optional
        Largest speed of a revolute joint [rad/s].
    slide_speed : float, optional
        Largest speed of a prismatic joint [m/s].
    body_speed : float, optional
        Largest speed of the body frame's origin [m/s].
    body_turn : float, optional
        Largest speed at which the body turns [rad/s].
    """

    tension_rate: Annotated[Rate | None, Meta(description="of a tendon [N/s]")] = None
    joint_speed: Annotated[Rate | None, Meta(description="of a revolute joint [rad/s]")] = None
    slide_speed: Annotated[Rate | None, Meta(description="of a prismatic joint [m/s]")] = None
    body_speed: Annotated[Rate | None, Meta(description="of the origin of B [m/s]")] = None
    body_turn: Annotated[Rate | None, Meta(description="of B [rad/s]")] = None

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if value is not None and not 1e-4 <= value <= 1e4:
                raise InvalidFieldError(f"must be 0.0001 to 10000, got {value:g}", field=name)

    def complete(self) -> ClimbSettings:
        """Return the settings with the bundled rates in place of those that are left out."""
        table = bundled_table("climb.toml", "planner.parameters")
        own = {
            name: table.positive("controller", name)
            for name in self.__struct_fields__
            if getattr(self, name) is None
        }
        return replace(self, **own)
