"""What a wrench stream says: what was declared, and the set-points of body wrenches."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from service.replies.reply import Reply, StanceReply, Vector

__all__ = ["HandColumns", "HandSetPoints", "SetPointsReply", "StreamReply"]


class HandColumns(Struct, kw_only=True):
    """One hand of a stream, and the names of its set's loads."""

    limb: str
    columns: list[str]


class StreamReply(StanceReply, kw_only=True):
    """A stream that is declared. It is there until many others are, or the service ends.

    ``radius``: within which of ``body_wrench``, the first centre, set-points are interpolated, null
    where they are solved one by one. ``status``, ``utilisation``, ``gap``: at that centre.
    ``took``: the time of it [s].
    """

    stream: str
    radius: float | None
    status: str
    reason: str | None
    body_wrench: Vector
    utilisation: float | None
    gap: float | None
    hands: list[HandColumns]
    took: float


class HandSetPoints(Struct):
    """What one hand is to do: tensions [N], motors [N·m, A], its wrench on the rock in H.

    ``winch_angle``: from the open finger [rad]. The hand's ``utilisation`` is only of a plan. With
    ``"detail": "set_points"`` there are tensions and winches alone.
    """

    limb: str
    tensions: Vector
    winch_angle: Vector
    motor_torque: Vector | UnsetType = UNSET
    motor_current: Vector | UnsetType = UNSET
    wrench: Vector | UnsetType = UNSET
    utilisation: float | UnsetType = UNSET


class SetPointsReply(Reply, kw_only=True):
    """Set-points of one body wrench.

    ``status``, ``utilisation``, ``verified``: as of a plan. ``gap``: the least utilisation of any
    plan is no more than this below, which is proven. ``source``: ``interpolated`` from plans known
    before, ``solved`` for this wrench, or ``blended`` of both. ``reason``: why there is no plan;
    then ``utilisation``, ``gap`` and ``hands`` are null. ``took``: the time of it [s].
    """

    stream: str
    status: str
    reason: str | None
    body_wrench: Vector
    utilisation: float | None
    gap: float | None
    hands: list[HandSetPoints] | None
    verified: bool
    source: str
    took: float
