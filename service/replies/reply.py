"""Define the shared parts of replies, the error reply, and the state for an operator.

Replies are lenient, so that they may gain fields. Poses and vectors as in the requests; forces and
moments are on the rock and in H unless said otherwise. A value that does not exist is null; what
was not asked for with ``want`` is left out.
"""

from __future__ import annotations

from typing import Final, Literal

from msgspec import UNSET, Struct, UnsetType

__all__ = [
    "WRENCH_AXES",
    "ErrorDetail",
    "ErrorReply",
    "Generator",
    "HealthReply",
    "LastFailure",
    "PlacedFrame",
    "ProcessHealth",
    "Reply",
    "RowReply",
    "SeatingReply",
    "StanceReply",
    "Vector",
    "WrenchSet",
    "Wrist",
]

WRENCH_AXES: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Components of a wrench, and keys of a capability after their signs."""

Vector = list[float]


class Reply(Struct, kw_only=True):
    """The fields of every reply. ``id``: the request's, where there was one that could be read."""

    v: int = 1
    id: str | None = None


class PlacedFrame(Struct):
    """A frame in another, the quaternion as [x, y, z, w]."""

    position: Vector
    orientation: Vector


class StanceReply(Reply, kw_only=True):
    """A reply about a stance; ``poses``: H in W of hands that were given by a place on a rock."""

    poses: dict[str, PlacedFrame] | UnsetType = UNSET


class SeatingReply(Struct):
    """The place of the hold in H, and the rule by which it was found.

    ``backed_off``: how far the hand moved off the rock along -z of H, so that its open fingers
    are clear [m].
    """

    rule: str
    pose: PlacedFrame
    backed_off: float = 0.0


class Wrist(Struct, kw_only=True):
    """The state of a hand's wrist; all but ``mode`` are null where it is fixed.

    ``twist``: where it goes from the pose that was given, about that pose [m, rad]. ``palm``:
    ``off``, ``drags``, ``presses`` or ``drags_and_presses``. ``rounds``: how often the hands' sets
    were linearised. ``error``: how far the set of the last step was off at its end [N, moments over
    0.1 m]; the plan is exact. Of a wrench space, how far it is off at most where it reaches
    farthest along the axes. ``pose_target``: where a limb of the stance's ``limb_stiffness`` is to
    aim, as ``twist`` [m, rad]. ``least_stiffness``: of the hand on its rock and that limb together,
    turns over 0.1 m [N/m]; where it is not positive the wrist does not stay.
    """

    mode: str
    twist: Vector | None = None
    palm: str | None = None
    rounds: int | None = None
    error: float | None = None
    pose_target: Vector | UnsetType = UNSET
    least_stiffness: float | UnsetType = UNSET


class Generator(Struct):
    """A column of a hand's wrench space: a load, and the wrench per newton of it.

    Of a floating hand a component of its wrist's twist, and the wrench per metre or radian.
    """

    name: str
    wrench: Vector


class RowReply(Struct, kw_only=True):
    """An inequality of a hand's wrench space.

    ``limit`` rows: load = coefficients · y + constant, at most utilisation · capacity; in newtons,
    for ``motor_torque`` and ``joint_torque`` in newton-metres, for ``motor_current`` in amperes.
    ``hard`` rows: coefficients · y at most capacity, whatever the utilisation.
    """

    name: str
    kind: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None
    coefficients: Vector
    constant: float
    capacity: float


class WrenchSet(Struct, kw_only=True):
    """A hand's wrenches, origin + Σ y · generator, for the loads y that the rows allow."""

    origin: Vector
    generators: list[Generator]
    rows: list[RowReply]


class ErrorDetail(Struct):
    """The fault, and the field to blame; ``retry_after``: when to ask again [s]."""

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
    """The last failure: the kind of error, of which key or process, and when (Unix time).

    ``id``: the question's.
    """

    kind: str
    about: str
    id: str | None = None
    at: float


class HealthReply(Reply, kw_only=True):
    """The state of a service.

    ``uptime``: [s]; ``replied``: questions so far; ``waiting``: questions, by the kind of queue.
    """

    robot: str
    version: str | None
    uptime: float
    replied: int
    waiting: dict[str, int]
    processes: list[ProcessHealth]
    last_failure: LastFailure | None
