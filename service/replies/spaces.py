"""Define the replies about wrench spaces of hands and body spaces of stances."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from planner import Finding, LimitName, Time
from service.replies.reply import Generator, RowReply, SeatingReply, StanceReply, Vector, Wrist

__all__ = [
    "Acceleration",
    "AxisCapability",
    "BodyCapability",
    "BodySectionReply",
    "BodySpaceReply",
    "ClosingSequenceReply",
    "ClosingStageReply",
    "ContactReply",
    "HalfSpaceEquations",
    "HalfSpacesReply",
    "RobustCapability",
    "TensionLimitReply",
    "WrenchSpaceReply",
]


class ContactReply(Struct):
    """The place where a finger tile meets the rock, and the axes of its loads.

    ``stop``: the limit at which its phalanx's joint stands (``upper``, ``lower``), or ``balance``
    where tendon and springs hold it without contact; null where contacts hold it.
    """

    finger: str
    phalanx: str
    contact: str
    stop: str | None
    position: Vector
    shear_axis: Vector
    normal_axis: Vector
    lateral_axis: Vector


class ClosingStageReply(Struct):
    """One part of a closing finger: from which tension it moves, at which it is at rest [N]."""

    part: str
    starts: float
    ends: float


class ClosingSequenceReply(Struct):
    """The way a finger has closed: its nail, its joints from the base outward, its tiles.

    ``in_order``: whether nail and joints move one after the other. ``closure``: how it has ended:
    ``laid``, ``hooked``, ``wedged``, ``curled``, ``stopped`` or ``straight``. ``nearby``: how else
    it would end if the rock were 0.1 mm elsewhere, ``refused`` if the hand could not be there;
    ``nearby_turn``: by how much a joint would end elsewhere [rad].
    """

    finger: str
    stages: list[ClosingStageReply]
    in_order: bool
    closure: str
    nearby: list[str]
    nearby_turn: float


class TensionLimitReply(Struct):
    """The tension at which a finger's first tile lets go [N]; null where none ever does."""

    finger: str
    tension: float | None
    phalanx: str | None


class HalfSpaceEquations(Struct):
    """``normals · w = offsets``."""

    normals: list[Vector]
    offsets: Vector


class HalfSpacesReply(Struct):
    """``normals · w ≤ offsets``, and what holds with equality where the set is flat."""

    normals: list[Vector]
    offsets: Vector
    equations: HalfSpaceEquations


class AxisCapability(Struct):
    """The reach of a set along an axis.

    ``pure``: the most of it with every other component zero, null where there is none. ``extent``:
    the most of it with whatever else. Below zero, so much of the opposite is always there.
    """

    pure: float | None
    extent: float


class RobustCapability(Struct, kw_only=True):
    """The reach of a set along each axis where the hand is not quite where it was put.

    Closed anew at so many ``draws`` of its place, to either side by at most ``position`` along each
    axis of H [m] and ``angle`` about each [rad]; ``without``: at so many of them it cannot be, or
    holds nothing, which counts as reaching zero far. ``tenth``, ``hundredth``: the ``extent`` that
    it exceeds at nine in ten places, and at 99 in a hundred. ``worst``, deprecated, is the latter.
    """

    draws: int
    without: int
    position: float
    angle: float
    seed: int
    worst: dict[str, float | None]
    tenth: dict[str, float | None]
    hundredth: dict[str, float | None]


class WrenchSpaceReply(StanceReply, kw_only=True):
    """The wrenches that one hand can carry, at utilisation 1: if none, ``capability`` is null.

    ``vertices`` and ``half_spaces`` are null where they were not asked for, or where they were left
    out; ``warnings`` then say so. ``dimension`` is null where nothing is left, or where even that
    would cost too much.
    """

    robot: str
    limb: str
    wrist: Wrist
    seating: SeatingReply
    contacts: list[ContactReply]
    closing: list[ClosingSequenceReply]
    tension_limits: list[TensionLimitReply]
    origin: Vector
    generators: list[Generator]
    rows: list[RowReply]
    vertices: list[Vector] | None
    half_spaces: HalfSpacesReply | None
    dimension: int | None
    capability: dict[str, AxisCapability] | None
    warnings: list[str] = []
    robust: RobustCapability | UnsetType = UNSET


class BodyCapability(Struct, kw_only=True):
    """The reach of body wrenches that are held along an axis of B; null where there are none.

    ``more``: beyond the body wrench asked for, which has to be held. ``pure``: with every other
    component zero. ``extent``: with whatever else. Below zero, so much of the opposite is always
    there. ``limiting``: the limit that ends ``more``, or else ``extent``.
    """

    more: float | None
    pure: float | None
    extent: float | None
    limiting: LimitName | None


class BodySectionReply(Struct, kw_only=True):
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
    """The body wrenches that a stance can hold within the utilisation asked for.

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
    section: BodySectionReply
    acceleration: dict[str, Acceleration] | None
    angular_acceleration: dict[str, Acceleration] | None
    along: list[Acceleration] | None
    time: Time
    warnings: list[str] = []
    findings: list[Finding] = []
