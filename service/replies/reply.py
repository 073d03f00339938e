"""What every reply has, the reply to a request that failed, and what an operator is told.

Replies are lenient, so that they may gain fields. Poses and vectors as in the requests; forces and
moments are on the rock and in H unless said otherwise. A value that does not exist is null; what
was not asked for with ``want`` is left out.
"""

from __future__ import annotations

from typing import Final, Literal

from msgspec import UNSET, Struct, UnsetType

__all__ = [
    "AXES",
    "ErrorDetail",
    "ErrorReply",
    "HealthReply",
    "LastFailure",
    "PlacedFrame",
    "ProcessHealth",
    "Reply",
    "StanceReply",
    "Vector",
]

AXES: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Components of a wrench, and keys of a capability after their signs."""

Vector = list[float]


class Reply(Struct, kw_only=True):
    """What every reply has. ``id``: the request's, where there was one that could be read."""

    v: int = 1
    id: str | None = None


class PlacedFrame(Struct):
    """A frame in another, the quaternion as [x, y, z, w]."""

    position: Vector
    orientation: Vector


class StanceReply(Reply, kw_only=True):
    """A reply about a stance; ``poses``: H in W of hands that were given by a place on a rock."""

    poses: dict[str, PlacedFrame] | UnsetType = UNSET


class ErrorDetail(Struct):
    """What is wrong, and with which field; ``retry_after``: when to ask again [s]."""

    kind: str
    field: str | None
    message: str
    retry_after: float | UnsetType = UNSET


class ErrorReply(Reply, kw_only=True):
    """A request that could not be understood, or a service that failed on it."""

    error: ErrorDetail


class ProcessHealth(Struct, kw_only=True):
    """One of a service's processes; ``resident``: its memory [bytes], where the system tells it.

    ``purpose``: a ``spare`` one stands ready to take the place of one that ends.
    """

    pid: int | None
    purpose: Literal["questions", "streams", "spare"]
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
