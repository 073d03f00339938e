"""Whose stance is planned: RoboSimian's, or that of a robot of the caller's own.

A robot's file stays where plans are made; over the network only its name travels. A stance that
names no robot is for the one that is there, and a stance that names another is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Final, TypeVar

import msgspec

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner.robots import Robot, RobotFile, robosimian, robot_of
from service.requests import BodySpaceRequest, PlanRequest, RouteRequest, WrenchSpaceRequest
from service.wire import DEFAULT_ROBOT

__all__ = ["ROBOTS", "Builder", "Robots", "builder_of", "read_robot", "robots_of", "with_robot"]

R = TypeVar("R", bound=PlanRequest | WrenchSpaceRequest | BodySpaceRequest | RouteRequest)

Builder = Callable[[ParameterTable | None], Robot]
"""Builds a robot from all numbers of its hands."""

Robots = Mapping[str, Builder]
"""Robots that stances may be for, by name; the first is that of stances which name none."""

ROBOTS: Final[Robots] = {DEFAULT_ROBOT: robosimian}
"""The robots that are bundled."""


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
    return ROBOTS if file is None else {file.name: partial(robot_of, file)}


def builder_of(name: str | None, robots: Robots) -> Builder:
    """Return what builds the robot of that name, or the first.

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


def with_robot(request: R, file: RobotFile | None) -> R:
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
            f"the stance is for {named!r}, the file {file.origin} describes {file.name!r}; valid "
            "is that, or no name",
            field="stance.robot",
        )
    stance = msgspec.structs.replace(request.stance, robot=file.name)
    return msgspec.structs.replace(request, stance=stance)
