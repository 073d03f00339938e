"""The state of a service among ROS 2's diagnostics."""

from __future__ import annotations

import time

import pytest

from service.replies import HealthReply, LastFailure, ProcessHealth
from service.ros2.health import service_state


def health(state: str, failed: float | None) -> HealthReply:
    """Health with one process for questions, and a failure so long ago [s]."""
    process = ProcessHealth(pid=1, purpose="questions", state=state, resident=None)
    spare = ProcessHealth(pid=2, purpose="spare", state="idle", resident=None)
    failure = failed and LastFailure(kind="lost", about="plan", at=time.time() - failed)
    return HealthReply(
        robot="robosimian",
        version=None,
        uptime=12.3,
        replied=4,
        waiting={"short": 2},
        processes=[process, spare],
        last_failure=failure or None,
    )


@pytest.mark.parametrize(
    ("state", "failed", "level", "message"),
    [
        ("working", None, 0, "answers questions"),
        ("idle", 5.0, 1, "lost: plan"),
        ("idle", 3600.0, 0, "answers questions"),
        # a spare one answers nothing
        ("starting", 5.0, 2, "no process is ready to answer questions"),
    ],
)
def test_a_state_is_as_bad_as_the_worst_of_it(
    state: str, failed: float | None, level: int, message: str
) -> None:
    found = service_state(health(state, failed))
    assert (found.level, found.message) == (level, message)
    assert found.values["waiting: short"] == "2"
    assert found.values["version"] == "unknown"
