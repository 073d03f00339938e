"""A climb of two moves on a slab, with joints, and one that fails in the middle of a move."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from msgspec.structs import replace

from planner import Climb, RouteResult, evaluate, plan_climb
from service.answering import route_of
from service.commands.stances import read_route
from service.requests import PoseMessage, RouteRequest


class Climbed(NamedTuple):
    """A route as it is asked for, its knots, and its stages' plans at their joint angles."""

    request: RouteRequest
    climb: Climb
    result: RouteResult


def two_moves() -> RouteRequest:
    """Return a route: one hand moves, then the body shifts, and the hand moves on."""
    bundled = read_route("six-moves")
    start = replace(bundled.stance, joints="solve")
    first = _raised(bundled, "front_left", 0.1)
    second = replace(_raised(bundled, "front_left", 0.15), body=_along(start.body, 0.02))
    return replace(bundled, name="two moves", stance=start, moves=[first, second])


def blocked() -> RouteRequest:
    """Return a route of two moves, whose stages hold, with a shift that a limb cannot follow."""
    bundled = read_route("six-moves")
    return replace(bundled, name="blocked", moves=bundled.moves[:2])


def _raised(route: RouteRequest, limb: str, by: float) -> Any:
    """Return the move of a hand up from where it is at the start [m]."""
    hand = next(each for each in route.stance.hands if each.limb == limb)
    return replace(
        route.moves[0],
        limb=limb,
        pose=_along(hand.pose, by),
        hold=hand.hold,
        surface=hand.surface,
        grasp=hand.grasp,
    )


def _along(pose: PoseMessage, by: float) -> PoseMessage:
    """Return a pose that is moved up the slab [m]."""
    up = np.array([0.155291, 0.0, 0.579555]) / np.hypot(0.155291, 0.579555)
    x, y, z = (np.array(pose.position) + by * up).tolist()
    return replace(pose, position=(x, y, z))


@cache
def climbed() -> Climbed:
    """Return the two moves, planned."""
    return _planned(two_moves())


@cache
def failed() -> Climbed:
    """Return the climb that fails, as far as it comes."""
    return _planned(blocked())


def _planned(request: RouteRequest) -> Climbed:
    route = route_of(request)
    climb = plan_climb(route)
    return Climbed(request, climb, evaluate(route, climb=climb))
