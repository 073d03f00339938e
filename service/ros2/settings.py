"""Define the times by which a service is seen in ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["ROS_SETTINGS", "RosSettings"]


@dataclass(frozen=True, slots=True)
class RosSettings:
    """Times by which a service is seen in ROS 2."""

    diagnostics_period: float = 1.0
    """Time from one message on ``/diagnostics`` to the next [s]; ROS's viewers take a state for
    stale after 5 s."""
    recent: float = 60.0
    """Time for which a failure of the service is a warning [s]: a person looks so often."""


ROS_SETTINGS: Final = RosSettings()
