"""Settings of a climb: rates of its controller, and when knots are put in between."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Self

import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from hand_models.base import InvalidFieldError, Strict
from hand_models.parameters import bundled_table
from planner.robots import Robot
from planner.route.com_travel import turn_between
from planner.route.knots import Knot

__all__ = ["ClimbSettings", "KnotNumbers"]

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
    period : float, optional
        Least time between two knots: the controller's period [s].
    """

    tension_rate: Annotated[Rate | None, Meta(description="of a tendon [N/s]")] = None
    joint_speed: Annotated[Rate | None, Meta(description="of a revolute joint [rad/s]")] = None
    slide_speed: Annotated[Rate | None, Meta(description="of a prismatic joint [m/s]")] = None
    body_speed: Annotated[Rate | None, Meta(description="of the origin of B [m/s]")] = None
    body_turn: Annotated[Rate | None, Meta(description="of B [rad/s]")] = None
    period: Annotated[Rate | None, Meta(description="least time between two knots [s]")] = None

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            value = getattr(self, name)
            if value is None:
                continue
            number = isinstance(value, (int, float, np.integer, np.floating))
            if isinstance(value, bool) or not number:
                raise InvalidFieldError(
                    f"must be a number from 0.0001 to 10000, got {value!r}; leave it out for that "
                    "of climb.toml",
                    field=name,
                )
            if not 1e-4 <= value <= 1e4:
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

    def duration(self, first: Knot, last: Knot, robot: Robot) -> float:
        """Return the time from one knot to the next, with all rates given [s].

        It is the longest that a tendon, a joint or the body takes.
        """
        pairs = zip(first.hands, last.hands, strict=True)
        change = max(float(np.abs(a.tensions - b.tensions).max()) for a, b in pairs)
        times = [(change, self.tension_rate)]
        for limb, angles in last.joints.items():
            moved, slides = np.abs(angles - first.joints[limb]), robot.chains[limb].sliding
            times += [
                (float(moved[~slides].max(initial=0.0)), self.joint_speed),
                (float(moved[slides].max(initial=0.0)), self.slide_speed),
            ]
        way = last.body.position - first.body.position
        times.append((float(np.linalg.norm(way)), self.body_speed))
        times.append((float(np.linalg.norm(turn_between(first.body, last.body))), self.body_turn))
        assert self.period is not None
        return max([self.period, *(each / rate for each, rate in times if rate is not None)])


class KnotNumbers(NamedTuple):
    """When more knots are put between two.

    Attributes
    ----------
    excess, excess_floor : float
        Part of the larger utilisation of two knots, and utilisation, by which the bound between
        them may exceed it.
    slack : float
        Distance of a hand from its hold, of interpolated joints in the middle [m].
    press : float
        Force with which palms press at knots between stages [N].
    halvings : int
        Times that the way between two knots is halved at most.
    least_change : float
        Smallest limit of the change of tensions between two knots [N].
    """

    excess: float
    excess_floor: float
    slack: float
    press: float
    halvings: int
    least_change: float

    @classmethod
    def bundled(cls) -> Self:
        """Return the numbers of ``climb.toml``."""
        table = bundled_table("climb.toml", "planner.parameters")

        def number(name: str) -> float:
            return table.positive("knots", name)

        return cls(
            excess=number("excess"),
            excess_floor=number("excess_floor"),
            slack=number("slack"),
            press=number("press"),
            halvings=int(number("halvings")),
            least_change=number("least_change"),
        )
