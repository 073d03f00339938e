"""Define the keys of the service in zenoh's key space."""

from __future__ import annotations

from typing import Final

__all__ = [
    "ALIVE",
    "BODY_SPACE",
    "CLIENTS",
    "DEFAULT_ROBOT",
    "HEALTH",
    "METRICS",
    "PLAN",
    "ROUTE",
    "SET_POINTS",
    "STREAM",
    "WRENCH_SPACE",
    "service_key",
]

PLAN: Final = "plan"
WRENCH_SPACE: Final = "wrench_space"
BODY_SPACE: Final = "body_space"
STREAM: Final = "stream"
SET_POINTS: Final = "set_points"
ALIVE: Final = "alive"
"""Liveliness token, present while the service runs."""
HEALTH: Final = "health"
METRICS: Final = "metrics"
CLIENTS: Final = "clients"
"""Prefix of session identifiers in the liveliness tokens of clients."""

ROUTE: Final = "route"
"""Question of bulk work alone: it takes too long to be asked over zenoh."""

DEFAULT_ROBOT: Final = "robosimian"
"""Robot of a stance that names none."""


def service_key(robot: str, name: str) -> str:
    """Return the key of one of a robot's services, ``crux/<robot>/<name>``."""
    return f"crux/{robot}/{name}"
