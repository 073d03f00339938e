"""Put a hand and a robot of the caller's own into questions.

Entries of a hand travel as ``{section: {entry: {value, unit, source, note}}}``. Whoever is nearer
to the question has the last word on an entry: the command line over a stance's file, a request over
the service, which may have a hand of its own, over the bundled hand. A robot's file stays where
plans are made; over the network only its name travels. A stance that names no robot is for the one
that is there, and a stance that names another is refused.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec

from hand_models.base import InvalidInputError, errors_under, in_file
from hand_models.hand import spiny_hand
from hand_models.parameters import ParameterTable, load_own_hand, own_draw, own_hand
from planner import Robot, RobotFile, robosimian, robot_of
from service.requests import (
    BodySpaceRequest,
    Draw,
    PlanRequest,
    RouteRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.wire import DEFAULT_ROBOT

__all__ = [
    "BUNDLED_ROBOTS",
    "Builder",
    "Robots",
    "builder_of",
    "over_default",
    "read_draws",
    "read_hand",
    "read_robot",
    "robots_of",
    "with_hand",
    "with_robot",
]

RequestT = TypeVar(
    "RequestT",
    bound=PlanRequest | WrenchSpaceRequest | BodySpaceRequest | StreamRequest | RouteRequest,
)

Builder = Callable[[ParameterTable | None], Robot]
"""Function that builds a robot from all numbers of its hands."""

Robots = Mapping[str, Builder]
"""Robots of stances, by name; the first is the default."""

BUNDLED_ROBOTS: Final[Robots] = {DEFAULT_ROBOT: robosimian}
"""Bundled robots."""


def read_hand(path: Path) -> ParameterTable:
    """Return a file's entries, which together with the bundled ones make a possible hand.

    Raises
    ------
    InvalidInputError
        In one line that names file, entry and value.
    """
    own = load_own_hand(path)
    with in_file(str(path)):
        spiny_hand(own_hand(own))
    return own


def read_draws(path: Path) -> list[Draw]:
    """Return a file's draws: TOML with a list ``draws``, each as in a request.

    Raises
    ------
    InvalidInputError
        In one line that names file, draw, entry and value.
    """
    with in_file(str(path)):
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
        given = raw.get("draws")
        if list(raw) != ["draws"] or not isinstance(given, list) or not given:
            raise InvalidInputError(
                "must be a list, [[draws]], with no other entries", field="draws"
            )
        found = []
        for i, draw in enumerate(given):
            with errors_under(f"draws[{i}]"):
                if not isinstance(draw, Mapping):
                    raise InvalidInputError("hand or surfaces is needed")
                own_draw(draw)
            found.append(Draw(**draw))
    return found


def with_hand(request: RequestT, own: ParameterTable | None) -> RequestT:
    """Return a request for a hand with these entries, over those that it names itself."""
    if own is None:
        return request
    return _asking_for(request, request.stance.hand or {}, _entries(own))


def over_default(request: RequestT, default: ParameterTable | None) -> RequestT:
    """Return a request whose missing entries of the hand are the service's defaults."""
    if default is None:
        return request
    return _asking_for(request, _entries(default), request.stance.hand or {})


def _entries(own: ParameterTable) -> dict[str, dict[str, Any]]:
    """Return entries as they are in a request."""
    entries: dict[str, dict[str, Any]] = msgspec.to_builtins(own.sections)
    return entries


def _asking_for(request: RequestT, low: Mapping[str, Any], high: Mapping[str, Any]) -> RequestT:
    """Return a request with the entries of two hands; the second's replace the first's."""
    hand = {**low, **high}
    for section in low.keys() & high.keys():
        # an entry that is no section is refused later
        if isinstance(high[section], Mapping) and isinstance(low[section], Mapping):
            hand[section] = {**low[section], **high[section]}
    stance = msgspec.structs.replace(request.stance, hand=hand)
    return msgspec.structs.replace(request, stance=stance)


def read_robot(path: Path) -> RobotFile:
    """Return the content of a robot's file and of its URDF, which describe a possible robot.

    Raises
    ------
    InvalidInputError
        In one line that names file, entry and value.
    """
    file = RobotFile.load(path)
    robot_of(file)
    return file


def robots_of(file: RobotFile | None) -> Robots:
    """Return the robots that are planned for: that of a file alone, or those that are bundled."""
    return BUNDLED_ROBOTS if file is None else {file.name: partial(robot_of, file)}


def builder_of(name: str | None, robots: Robots) -> Builder:
    """Return the builder of the robot of that name; by default the first.

    Raises
    ------
    InvalidInputError
        If there is none of that name.
    """
    chosen = next(iter(robots)) if name is None else name
    if chosen not in robots:
        raise InvalidInputError(
            f"unknown robot {chosen!r}; known are {', '.join(robots)}", field="robot"
        )
    return robots[chosen]


def with_robot(request: RequestT, file: RobotFile | None) -> RequestT:
    """Return a request for the robot of a file.

    Raises
    ------
    InvalidInputError
        If it names another.
    """
    if file is None:
        return request
    named = request.stance.robot
    if named not in (None, file.name):
        raise InvalidInputError(
            f"the stance is for {named!r}, the file {file.origin} describes {file.name!r}; use "
            "that name, or none",
            field="stance.robot",
        )
    stance = msgspec.structs.replace(request.stance, robot=file.name)
    return msgspec.structs.replace(request, stance=stance)
