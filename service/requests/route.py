"""The question of a route: a start stance, and moves."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from service.requests.limits import Limits, Load
from service.requests.plan import ObjectiveName
from service.requests.request import Identifier, Pose, Request
from service.requests.stance import Hand, Stance

__all__ = [
    "RouteRequest",
]


class Move(Hand, frozen=True, kw_only=True):
    """One limb to its next hold."""

    body: Annotated[
        Pose | None, Meta(description="of B in W: where the body shifts to before the limb lifts")
    ] = None


class RouteRequest(Request, frozen=True, kw_only=True):
    """A climb: a start stance, and moves. Not asked over zenoh; a file of the command line."""

    name: Identifier = "route"
    stance: Stance
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    moves: Annotated[list[Move], Meta(max_length=10_000)]
