"""Describe the health of a service as states of ROS 2's diagnostics."""

from __future__ import annotations

import time
from collections import Counter
from typing import NamedTuple

from service.replies import HealthReply
from service.ros2.settings import ROS_SETTINGS

__all__ = ["DiagnosticState", "service_state"]


class DiagnosticState(NamedTuple):
    """State of one part of a service.

    Attributes
    ----------
    level : int
        0 if all is well, 1 for a warning, 2 for an error, as ``diagnostic_msgs/DiagnosticStatus``.
    name : str
        Name of the part.
    message : str
        State in words.
    values : dict of str to str
        Further values by name.
    """

    level: int
    name: str
    message: str
    values: dict[str, str]


def service_state(health: HealthReply) -> DiagnosticState:
    """Return the state of a service, by its health.

    It is an error if no process can answer questions, and a warning if a failure is recent.
    """
    failure = health.last_failure
    purposes = Counter(
        f"{each.purpose}, {each.state}" for each in health.processes if each.purpose != "spare"
    )
    up = any(each.purpose == "questions" and each.state != "starting" for each in health.processes)
    level, message = 0, "answers questions"
    if not up:
        level, message = 2, "no process is ready to answer questions"
    elif failure is not None and time.time() - failure.at < ROS_SETTINGS.recent:
        level, message = 1, f"{failure.kind}: {failure.about}"
    values = {
        "version": health.version or "unknown",
        "uptime [s]": f"{health.uptime:.0f}",
        "replied": str(health.replied),
    }
    values |= {f"waiting: {kind}": str(count) for kind, count in health.waiting.items()}
    values |= {f"processes: {which}": str(count) for which, count in sorted(purposes.items())}
    return DiagnosticState(level, f"crux/{health.robot}: service", message, values)
