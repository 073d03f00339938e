"""What an operator is told of a service."""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

from service.replies.reply import Reply

__all__ = ["HealthReply", "LastFailure", "ProcessHealth"]


class ProcessHealth(Struct, kw_only=True):
    """One of a service's processes; ``resident``: its memory [bytes], where the system tells it."""

    pid: int | None
    purpose: Literal["questions", "streams"]
    state: Literal["starting", "idle", "working"]
    resident: int | None


class LastFailure(Struct, kw_only=True):
    """What failed last: the kind of error, of which key or process, and when (Unix time).

    ``id``: the question's.
    """

    kind: str
    about: str
    id: str | None = None
    at: float


class HealthReply(Reply, kw_only=True):
    """How a service is.

    ``uptime``: [s]; ``replied``: questions so far; ``waiting``: questions, by the kind of queue.
    """

    robot: str
    version: str | None
    uptime: float
    replied: int
    waiting: dict[str, int]
    processes: list[ProcessHealth]
    last_failure: LastFailure | None
