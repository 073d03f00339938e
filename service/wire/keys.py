"""Define the keys of the service in zenoh's key space."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

__all__ = ["DEFAULT_ROBOT", "ServiceName", "service_key"]


class ServiceName(StrEnum):
    """Last part of a key."""

    PLAN = "plan"
    WRENCH_SPACE = "wrench_space"
    BODY_SPACE = "body_space"
    STREAM = "stream"
    SET_POINTS = "set_points"
    HEALTH = "health"
    METRICS = "metrics"
    ROUTE = "route"
    """Question of bulk work alone: it takes too long to be asked over zenoh."""
    ALIVE = "alive"
    """Liveliness token, present while the service runs."""
    CLIENTS = "clients"
    """Prefix of session identifiers in the liveliness tokens of clients."""


DEFAULT_ROBOT: Final = "robosimian"
"""Robot of a stance that names none."""


def service_key(robot: str, name: str) -> str:
    """Return the key of one of a robot's services, ``crux/<robot>/<name>``."""
    return f"crux/{robot}/{name}"
