"""The reply to what a stance can hold."""

from __future__ import annotations

from msgspec import Struct

from planner import Finding, LimitName, Time
from service.replies.reply import StanceReply, Vector

__all__ = [
    "Acceleration",
    "BodyCapability",
    "BodySection",
    "BodySpaceReply",
]


class BodyCapability(Struct, kw_only=True):
    """How far body wrenches that are held go along an axis of B; null where there are none.

    ``more``: beyond the body wrench asked for, which has to be held. ``pure``: with every other
    component zero. ``extent``: with whatever else. Below zero, so much of the opposite is always
    there. ``limiting``: the limit that ends ``more``, or else ``extent``.
    """

    more: float | None
    pure: float | None
    extent: float | None
    limiting: LimitName | None


class BodySection(Struct, kw_only=True):
    """The body wrenches that are held in the plane of two axes, between two polygons [N, N·m].

    Every point of the inner polygon is held, and none outside the outer one. Corners go
    counterclockwise: two of a segment, one of a point, none where the plane holds nothing. ``gap``:
    how far the two are apart at most [N, moments over 0.1 m]. ``limiting``: what ends the way at
    each corner of the inner one.
    """

    axes: list[str]
    others: str
    inner: list[Vector]
    outer: list[Vector]
    gap: float | None
    limiting: list[LimitName | None]


class Acceleration(Struct, kw_only=True):
    """The largest acceleration from rest that is held along a direction in W [m/s², rad/s²]."""

    direction: Vector
    acceleration: float
    limiting: LimitName | None


class BodySpaceReply(StanceReply, kw_only=True):
    """What a stance can hold within the utilisation asked for.

    ``status``, ``reason``, ``utilisation``: of the plan for the body wrench asked for.
    ``acceleration``: by axis of W; null where the body cannot be held at rest or its wrench was
    given instead of a load. ``angular_acceleration``: about B's origin, for the robot's own load at
    known joints. ``along``: in the directions asked for. ``exact``: false where a wrist floats; its
    hand's set is then linearised, and at the extents it is off by up to ``linearisation_error``, in
    newtons with moments over 0.1 m. ``error``: its old name, for one more version.
    """

    robot: str
    status: str
    reason: str
    body_wrench: Vector
    utilisation: float | None
    exact: bool
    linearisation_error: float
    error: float
    capability: dict[str, BodyCapability]
    section: BodySection
    acceleration: dict[str, Acceleration] | None
    angular_acceleration: dict[str, Acceleration] | None
    along: list[Acceleration] | None
    time: Time
    warnings: list[str] = []
    findings: list[Finding] = []
