"""Define the parts of all requests: strict structs, names, and numbers within bounds.

The bounds are far beyond any climbing robot; they keep arithmetic finite.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from msgspec import Meta

from hand_models.base import Coordinate, Position, Strict, check_orientation_form

__all__ = [
    "DEFAULT_DEADLINE",
    "LEAST_REPLY_BYTES",
    "LONGEST_DEADLINE",
    "Detail",
    "FourTensions",
    "Identifier",
    "InParts",
    "Later",
    "PoseMessage",
    "Query",
    "ReplyBytes",
    "Request",
    "Tensions",
    "Wrench",
    "WrenchEntries",
    "WrenchEntry",
]

QuaternionEntry = Annotated[float, Meta(ge=-1e3, le=1e3)]
Quaternion = Annotated[
    tuple[QuaternionEntry, QuaternionEntry, QuaternionEntry, QuaternionEntry],
    Meta(description="[x, y, z, w], of norm 1 within 1e-3"),
]
TurnEntry = Annotated[float, Meta(ge=-1e3, le=1e3)]
Turns = Annotated[
    tuple[TurnEntry, TurnEntry, TurnEntry],
    Meta(
        description="roll, pitch and yaw about the fixed axes x, y and z, one after the other, as "
        "in ROS; in place of orientation [rad]"
    ),
]
PoseAxis = Annotated[
    tuple[Coordinate, Coordinate, Coordinate],
    Meta(
        description="direction of the frame's axis, of any length; x_axis and z_axis, at right "
        "angles within 1e-3 rad, stand in place of orientation"
    ),
]
WrenchEntry = Annotated[float, Meta(ge=-1e6, le=1e6)]
WrenchEntries = tuple[WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry, WrenchEntry]
Wrench = Annotated[
    WrenchEntries, Meta(description="[fx, fy, fz, mx, my, mz], force first [N, N·m]")
]
PreloadEntry = Annotated[float, Meta(ge=0.0, le=1e4)]
FourTensions = tuple[PreloadEntry, PreloadEntry, PreloadEntry, PreloadEntry]
Tensions = Annotated[FourTensions, Meta(description="of a hand's tendons [N]")]
Identifier = Annotated[str, Meta(max_length=256, description="echoed in the reply")]
DEFAULT_DEADLINE: Final = 10.0
"""Default deadline of a question to a service, from its arrival [s]."""

LONGEST_DEADLINE: Final = 600.0
"""Longest deadline [s]."""

LEAST_REPLY_BYTES: Final = 1000
"""Least limit on a reply's bytes: errors with cut texts and set-points in MessagePack fit."""

ReplyBytes = Annotated[int, Meta(ge=LEAST_REPLY_BYTES, le=2**31)]
Duration = Annotated[float, Meta(gt=0.0, le=LONGEST_DEADLINE, description="[s]")]
Detail = Annotated[
    Literal["set_points", "hands", "full"],
    Meta(
        description="how much the reply has: set-points of tendons; the hands' loads, too; or the "
        "whole plan. By default the whole; where max_reply_bytes is given, as much as fits"
    ),
]
InParts = Annotated[
    bool,
    Meta(
        description="over zenoh, replies of their own before the last one: how far a search is, "
        "and the knots of a trajectory move by move, which the last reply then leaves out"
    ),
]
Later = Annotated[Any, Meta(description="not supported in this version; leave it out")]


class PoseMessage(Strict, frozen=True, kw_only=True):
    """Pose of a frame in another frame; its orientation in exactly one of three forms.

    - ``position``: origin of the frame [m].
    - ``orientation``: unit quaternion as [x, y, z, w]; or
    - ``rpy``: roll, pitch and yaw about the fixed axes x, y and z, one after the other [rad]; or
    - ``x_axis``, ``z_axis``: directions of the frame's axes, of any length, at right angles.
    """

    position: Position
    orientation: Quaternion | None = None
    rpy: Turns | None = None
    x_axis: PoseAxis | None = None
    z_axis: PoseAxis | None = None

    def __post_init__(self) -> None:
        check_orientation_form(self.orientation, self.rpy, self.x_axis, self.z_axis)


class Request(Strict, frozen=True, kw_only=True):
    """The fields of every request.

    - ``v``: version of the messages, 1.
    """

    v: Literal[1]


class Query(Request, frozen=True, kw_only=True):
    """The fields of every request that a client can send over zenoh.

    - ``id``: text of the client's choice, which the reply repeats.
    - ``deadline``: time that the answer may take, waiting in the queue included, at most 600 s [s];
      then the best verified plan is the answer. By default the service's deadline; none on the
      command line.
    - ``max_reply_bytes``: largest reply payload that the client accepts [bytes]; without it there
      is no bound.
    """

    id: Identifier | None = None
    deadline: Annotated[
        Duration | None,
        Meta(
            description="how long the answer may take, from its question's arrival at the service "
            "on, waiting included: then the best plan that is verified is the answer, or that "
            "there is none yet [s]"
        ),
    ] = None
    max_reply_bytes: Annotated[
        ReplyBytes | None,
        Meta(
            description="that the caller takes, of the reply's payload. A reply of more is not "
            "sent, but an error of kind limit that names what would fit"
        ),
    ] = None
