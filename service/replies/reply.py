"""Define the shared parts of replies, the error reply, and the health of a service.

Readers of replies must accept unknown fields, so that replies can gain fields. A pose is a position
[m] and a quaternion [x, y, z, w]; a wrench is [fx, fy, fz, mx, my, mz] [N, N·m]. Forces and moments
act on the rock and are given in the hand's frame H, unless a field says otherwise. A value that
does not exist is null; a result that the request does not name in ``want`` is left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, Self

from msgspec import UNSET, Struct, UnsetType

if TYPE_CHECKING:
    from hand_models.base import Pose

__all__ = [
    "WRENCH_AXES",
    "ErrorDetail",
    "ErrorReply",
    "Generator",
    "HealthReply",
    "LastFailure",
    "PlacedFrame",
    "ProcessHealth",
    "RecordingHealth",
    "Reply",
    "RowReply",
    "SeatingReply",
    "StanceReply",
    "Vector",
    "WrenchSet",
    "Wrist",
]

WRENCH_AXES: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Names of the six components of a wrench; after a sign, such as ``+fx``, keys of capabilities."""

Vector = list[float]


class Reply(Struct, kw_only=True):
    """The fields of every reply.

    - ``v``: version of the messages, 1.
    - ``id``: the request's ``id``; null where the request has none, or could not be read.
    """

    v: int = 1
    id: str | None = None


class PlacedFrame(Struct):
    """Pose of a frame in another frame.

    - ``position``: origin of the frame [m].
    - ``orientation``: unit quaternion as [x, y, z, w].
    """

    position: Vector
    orientation: Vector

    @classmethod
    def of(cls, pose: Pose) -> Self:
        """Convert a pose from arrays to lists."""
        return cls(pose.position.tolist(), pose.quaternion().tolist())


class StanceReply(Reply, kw_only=True):
    """The fields of every reply about a stance.

    - ``poses``: pose of H in W by limb, of hands that the request gives by a ``place`` on a rock or
      places by ``contact`` (with their offset); left out where there are none.
    """

    poses: dict[str, PlacedFrame] | UnsetType = UNSET


class SeatingReply(Struct):
    """Pose of the hold in H, and the rule by which the pose was found.

    - ``rule``: ``given``, ``pinch``, ``palm_on_rock``, ``palm_on_rock_centred``, ``flat``, ``best``
      or ``contact``.
    - ``pose``: pose of the hold's frame in H.
    - ``backed_off``: distance by which the hand moved off the rock along -z of H, so that its open
      fingers are clear of the rock [m].
    """

    rule: str
    pose: PlacedFrame
    backed_off: float = 0.0


class Wrist(Struct, kw_only=True):
    """State of a hand's wrist: how the wrist moves under the loads of a plan.

    All fields but ``mode`` are null or left out where the wrist is fixed.

    - ``mode``: ``fixed``, ``floating`` or ``compliant``.
    - ``twist``: small displacement and rotation of H from its given pose, about that pose [m, rad].
    - ``palm``: contact of the palm: ``off``, ``drags``, ``presses`` or ``drags_and_presses``.
    - ``rounds``: number of times that the wrench spaces of the hands were linearised.
    - ``error``: in a plan, how far the wrench space linearised in the step before the last is from
      the exact model where the wrist went; the plan itself is exact. In a reply about a wrench
      space, the largest such error at the points where the set reaches farthest along the axes.
      Forces in newtons, moments divided by 0.1 m [N].
    - ``pose_target``: pose at which the controller of a limb with a given ``limb_stiffness`` must
      aim, as a twist like ``twist`` [m, rad]; left out without that stiffness.
    - ``least_stiffness``: least stiffness of hand, rock and limb together, turns counted over 0.1 m
      [N/m]; the wrist is unstable where the value is not positive. Left out without
      ``limb_stiffness``.
    - ``largest_stretch``: in a plan, how far the tile that is stretched most is stretched along the
      rock: its shear over its contact stiffness [m]. Left out where the wrist is fixed.
    """

    mode: str
    twist: Vector | None = None
    palm: str | None = None
    rounds: int | None = None
    error: float | None = None
    pose_target: Vector | UnsetType = UNSET
    least_stiffness: float | UnsetType = UNSET
    largest_stretch: float | UnsetType = UNSET


class Generator(Struct):
    """Column of a hand's wrench space: a variable, and the wrench per unit of the variable.

    - ``name``: name of the variable: a load of the hand; of a floating hand a component of the
      wrist's twist.
    - ``wrench``: wrench on the rock, in H, per newton of the load; per metre or radian of the
      twist.
    """

    name: str
    wrench: Vector


class RowReply(Struct, kw_only=True):
    """Linear inequality of a hand's wrench space: a limit or a hard row.

    No strength can change a hard row. With y, the variables of the ``generators`` in order, a
    ``limit`` row is coefficients · y + constant ≤ utilisation · capacity. A ``hard`` row is
    coefficients · y ≤ capacity, whatever the utilisation. Capacities are in newtons; those of
    ``motor_torque``, ``finger_twist`` and ``joint_torque`` in newton-metres, those of
    ``motor_current`` in amperes.

    - ``name``: name of the row, unique in its set.
    - ``kind``: ``limit`` or ``hard``.
    - ``finger``: the finger that the row limits; null where the row limits the palm or the whole
      hand.
    - ``phalanx``: the phalanx whose tile the row limits; null where the row limits no single tile
      (of ``finger_twist``: the phalanx about whose axis its joint is twisted).
    - ``limit``: name of the limit.
    - ``joint``: the joint of the limb that the row limits; null for other rows.
    - ``coefficients``: one number for each variable in y.
    - ``constant``: load at y = 0; zero for a hard row.
    - ``capacity``: largest load at utilisation 1; right side of a hard row.
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
    """Wrench space of a hand: all wrenches origin + Σ y · generator whose y obeys the rows.

    - ``origin``: wrench on the rock at y = 0, in H [N, N·m].
    - ``generators``: one column for each variable in y.
    - ``rows``: linear inequalities on y: limits first, then hard rows.
    """

    origin: Vector
    generators: list[Generator]
    rows: list[RowReply]


class ErrorDetail(Struct):
    """Cause of an error, and the field of the request that caused it.

    - ``kind``: kind of the error.
    - ``field``: path of the field in the request; null where no field is to blame.
    - ``message``: one sentence for a person.
    - ``retry_after``: time after which a retry makes sense [s]; only where the service is busy.
    """

    kind: str
    field: str | None
    message: str
    retry_after: float | UnsetType = UNSET


class ErrorReply(Reply, kw_only=True):
    """Reply to a request that could not be understood, or on which the service failed.

    - ``error``: cause of the error.
    """

    error: ErrorDetail


class ProcessHealth(Struct, kw_only=True):
    """State of one worker process of a service.

    - ``pid``: process identifier; null where the process has none.
    - ``purpose``: ``questions``; ``streams`` for the process that keeps all streams; ``climbs`` for
      one that searches for climbs; ``spare`` for a process that is ready to replace one that ends.
    - ``state``: ``starting``, ``idle`` or ``working``.
    - ``resident``: memory in use [bytes]; null where the system does not report it.
    """

    pid: int | None
    purpose: Literal["questions", "streams", "climbs", "spare"]
    state: Literal["starting", "idle", "working"]
    resident: int | None


class LastFailure(Struct, kw_only=True):
    """Most recent failure of a service.

    - ``kind``: kind of the error.
    - ``about``: kind of the question (last part of its key), or the process that ended and how.
    - ``id``: ``id`` of the question; null where the question has none, or a process failed.
    - ``at``: time of the failure [s], Unix time.
    """

    kind: str
    about: str
    id: str | None = None
    at: float


class RecordingHealth(Struct, kw_only=True):
    """State of the recording of a service.

    - ``file``: file that is written; null while none can be.
    - ``bytes``: size of the file [bytes].
    - ``recorded``: number of questions and messages that have been recorded since the start.
    - ``dropped``: number of those that have not, as the disk was full or too slow.
    - ``problem``: why nothing is recorded now; null where all is well.
    """

    file: str | None
    bytes: int
    recorded: int
    dropped: int
    problem: str | None


class HealthReply(Reply, kw_only=True):
    """Health of a service, for an operator.

    - ``robot``: name of the robot that the service plans for.
    - ``version``: version of the installed package; null where it is not known.
    - ``uptime``: time since the start [s].
    - ``replied``: number of questions that were answered or refused since the start.
    - ``waiting``: number of questions that wait for a worker, by the kind of their queue.
    - ``processes``: state of every worker process.
    - ``last_failure``: most recent failure; null where there was none.
    - ``clients``: number of sessions that are linked to the service, or have proven their names.
    - ``streams``: number of streams that are kept.
    - ``recording``: state of the recording; null without one.
    """

    robot: str
    version: str | None
    uptime: float
    replied: int
    waiting: dict[str, int]
    processes: list[ProcessHealth]
    last_failure: LastFailure | None
    clients: int = 0
    streams: int = 0
    recording: RecordingHealth | None = None
