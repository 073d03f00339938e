"""Keys of the service in zenoh's key space."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

__all__ = [
    "DEFAULT_ROBOT",
    "ServiceName",
    "server_key",
    "service_key",
    "shared_key",
    "stream_key",
]


class ServiceName(StrEnum):
    """Last part of a zenoh key, which selects the handler of the request."""

    PLAN = "plan"
    WRENCH_SPACE = "wrench_space"
    BODY_SPACE = "body_space"
    STREAM = "stream"
    SET_POINTS = "set_points"
    WRENCH = "wrench"
    """Body wrenches that clients publish on a stream; nobody answers queries there."""
    DIAGNOSIS = "diagnosis"
    HEALTH = "health"
    METRICS = "metrics"
    ROUTE = "route"
    CLIMB = "climb"
    CANCEL = "cancel"
    """Where a client says that it needs no answer any more to a question of its own."""
    PLAY = "play"
    """Set-points of a climb, which `crux play` publishes; nobody answers there."""
    ALIVE = "alive"
    """Liveliness token, which exists while the service runs."""
    CLIENTS = "clients"
    """Prefix of the liveliness tokens of clients; a session identifier follows."""
    SERVER = "server"
    """Prefix of the keys of one of several services; its session's identifier follows."""


DEFAULT_ROBOT: Final = "robosimian"
"""Robot of a stance that names no robot."""


def service_key(robot: str, name: str) -> str:
    """Return the zenoh key of a service, ``crux/<robot>/<name>``.

    Parameters
    ----------
    robot : str
        Name of the robot that the service plans for.
    name : str
        A `ServiceName`.
    """
    return f"crux/{robot}/{name}"


def server_key(robot: str, server: str, *parts: str) -> str:
    """Return a zenoh key of one of several services, ``crux/<robot>/server/<server>/...``.

    Parameters
    ----------
    robot : str
        Name of the robot that the service plans for.
    server : str
        Identifier of the service's session.
    *parts : str
        A `ServiceName`, where this service alone answers. Without parts, the key of its liveliness
        token.
    """
    return service_key(robot, "/".join((ServiceName.SERVER, server, *parts)))


def shared_key(key: str) -> str:
    """Return the key of a question that all services of a robot answer, of the key of one of them.

    Parameters
    ----------
    key : str
        Zenoh key of a question; one that is shared already is returned.
    """
    _, robot, name, *more = key.split("/")
    return service_key(robot, more[1]) if name == ServiceName.SERVER and len(more) == 2 else key


def stream_key(robot: str, stream: str, *parts: str) -> str:
    """Return a zenoh key of a stream, ``crux/<robot>/stream/<stream>/...``.

    Parameters
    ----------
    robot : str
        Name of the robot that the service plans for.
    stream : str
        Identifier in the reply to the stream's declaration.
    *parts : str
        `ServiceName.WRENCH`, where wrenches are published, or `ServiceName.SET_POINTS`, where
        their set-points are. Without parts, the key of the stream's liveliness token.
    """
    return service_key(robot, "/".join((ServiceName.STREAM, stream, *parts)))
