"""Put the caller's hand parameters and robot file into requests: overrides and defaults.

Hand parameters travel as ``{section: {entry: {value, unit, source, note}}}``. An entry may be given
in several places; the first of these counts: the command line, the stance's file or request, the
service's hand, the bundled hand, which has a default for each entry. A robot's file stays where
plans are made: only the robot's name travels over the network. A stance that names no robot is
planned for the robot that is served; a stance that names an unknown robot is refused.
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
    ClimbRequest,
    DiagnosisRequest,
    Draw,
    PlanRequest,
    RouteRequest,
    StanceMessage,
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
    bound=PlanRequest
    | WrenchSpaceRequest
    | BodySpaceRequest
    | StreamRequest
    | DiagnosisRequest
    | RouteRequest
    | ClimbRequest,
)

Builder = Callable[[ParameterTable | None], Robot]
"""Function that builds a robot from its hands' parameters; None for the bundled parameters."""

Robots = Mapping[str, Builder]
"""Robots that a stance may name, with the functions that build them; the first is the default."""

BUNDLED_ROBOTS: Final[Robots] = {DEFAULT_ROBOT: robosimian}
"""The robots of this package, by name."""


def read_hand(path: Path) -> ParameterTable:
    """Read hand parameters from a TOML file, and check that they describe a possible hand.

    Parameters
    ----------
    path : Path
        TOML file in the form of ``hand.toml``, with only the entries that differ from it.

    Returns
    -------
    ParameterTable
        The entries of the file alone.

    Raises
    ------
    InvalidInputError
        If an entry is invalid. The message is one line that names file, entry and value.
    """
    own = load_own_hand(path)
    with in_file(str(path)):
        spiny_hand(own_hand(own))
    return own


def read_draws(path: Path) -> list[Draw]:
    """Read Monte Carlo samples of uncertain parameters from a TOML file.

    Parameters
    ----------
    path : Path
        TOML file with a list ``[[draws]]``. Each entry has ``hand`` or ``surfaces``, or both, as in
        a plan request.

    Returns
    -------
    list of Draw
        One sample for each entry.

    Raises
    ------
    InvalidInputError
        If a sample is invalid. The message is one line that names file, sample, entry and value.
    """
    with in_file(str(path)):
        raw = tomllib.loads(path.read_text(encoding="utf-8"))
        given = raw.get("draws")
        if list(raw) != ["draws"] or not isinstance(given, list) or not given:
            raise InvalidInputError(
                "must be a list of one or more tables, each as [[draws]], and the only entry of "
                f"the file, which has {', '.join(raw) or 'none'}",
                field="draws",
            )
        found = []
        for i, draw in enumerate(given):
            with errors_under(f"draws[{i}]"):
                if not isinstance(draw, Mapping):
                    raise InvalidInputError(f"must be a table with hand or surfaces, got {draw!r}")
                own_draw(draw)
            found.append(Draw(**draw))
    return found


def with_hand(request: RequestT, own: ParameterTable | None) -> RequestT:
    """Return a request with the caller's hand parameters, which replace those of its stance.

    Parameters
    ----------
    request : Request
        Request with a stance.
    own : ParameterTable or None
        Hand parameters that take precedence over the request's; with None the request is returned
        unchanged.
    """
    if own is None:
        return request
    return _asking_for(request, _robot_part(request).hand or {}, _entries(own))


def over_default(request: RequestT, default: ParameterTable | None) -> RequestT:
    """Return a request with default hand parameters where its stance gives none.

    Parameters
    ----------
    request : Request
        Request with a stance.
    default : ParameterTable or None
        Hand parameters of the service; those of the request take precedence. With None the request
        is returned unchanged.
    """
    if default is None:
        return request
    return _asking_for(request, _entries(default), _robot_part(request).hand or {})


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
    return _replaced(request, hand=hand)


def _robot_part(request: RequestT) -> StanceMessage | ClimbRequest:
    """Return the part of a request that names robot and hand: its stance, or all of a climb's."""
    return request if isinstance(request, ClimbRequest) else request.stance


def _replaced(request: RequestT, **fields: Any) -> RequestT:
    """Return a request with other fields in the part that names robot and hand."""
    if isinstance(request, ClimbRequest):
        return msgspec.structs.replace(request, **fields)
    stance = msgspec.structs.replace(request.stance, **fields)
    return msgspec.structs.replace(request, stance=stance)


def read_robot(path: Path) -> RobotFile:
    """Read a robot's TOML file and its URDF, and check that they describe a possible robot.

    Parameters
    ----------
    path : Path
        TOML file of the robot, which names the URDF.

    Returns
    -------
    RobotFile
        Name and texts of both files.

    Raises
    ------
    InvalidInputError
        If the robot is impossible. The message is one line that names file, entry and value.
    """
    file = RobotFile.load(path)
    robot_of(file)
    return file


def robots_of(file: RobotFile | None) -> Robots:
    """Return the robots that a stance may name: the robot of a file alone, or the bundled robots.

    Parameters
    ----------
    file : RobotFile or None
        The only robot; None for the bundled robots.

    Returns
    -------
    Robots
        Functions that build the robots, by name.
    """
    return BUNDLED_ROBOTS if file is None else {file.name: partial(robot_of, file)}


def builder_of(name: str | None, robots: Robots) -> Builder:
    """Return the function that builds the robot of a given name.

    Parameters
    ----------
    name : str or None
        Name in the stance; None for the first robot.
    robots : Robots
        Known robots by name.

    Raises
    ------
    InvalidInputError
        If no robot has this name.
    """
    chosen = next(iter(robots)) if name is None else name
    if chosen not in robots:
        raise InvalidInputError(
            f"unknown robot {chosen!r}; known are {', '.join(robots)}", field="robot"
        )
    return robots[chosen]


def with_robot(request: RequestT, file: RobotFile | None) -> RequestT:
    """Return a request whose stance names the robot of a file.

    Parameters
    ----------
    request : Request
        Request with a stance.
    file : RobotFile or None
        Robot to plan for; with None the request is returned unchanged.

    Raises
    ------
    InvalidInputError
        If the stance names another robot.
    """
    if file is None:
        return request
    named = _robot_part(request).robot
    if named not in (None, file.name):
        raise InvalidInputError(
            f"the stance is for {named!r}, the file {file.origin} describes {file.name!r}; name "
            f"{file.name!r} in the stance, or none",
            field="robot" if isinstance(request, ClimbRequest) else "stance.robot",
        )
    return _replaced(request, robot=file.name)
