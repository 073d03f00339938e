"""What the service says: every reply, lenient, so that a reply may gain fields.

Poses and vectors as in the requests; forces and moments are on the rock and in H unless said
otherwise. A value that does not exist is null; what was not asked for with ``want`` is left out.
"""

from __future__ import annotations

from typing import Final

from msgspec import UNSET, Struct, UnsetType

__all__ = [
    "AXES",
    "Acceleration",
    "AxisCapability",
    "BodyCapability",
    "BodySection",
    "BodySpaceReply",
    "Certificate",
    "ClosingSequence",
    "ClosingStage",
    "Contact",
    "ErrorDetail",
    "ErrorReply",
    "Finger",
    "Generator",
    "Hand",
    "LimitName",
    "Palm",
    "PlacedFrame",
    "PlanReply",
    "Price",
    "Reply",
    "Row",
    "Seating",
    "Solver",
    "TensionLimit",
    "TensionPath",
    "Tile",
    "Time",
    "WrenchSet",
    "WrenchSpaceReply",
    "Wrist",
]

AXES: Final = ("fx", "fy", "fz", "mx", "my", "mz")
"""Components of a wrench, and keys of a capability after their signs."""

Vector = list[float]


class Reply(Struct, kw_only=True):
    """What every reply has."""

    v: int = 1


class ErrorDetail(Struct):
    """What is wrong, and with which field."""

    kind: str
    field: str | None
    message: str


class ErrorReply(Reply, kw_only=True):
    """A request that could not be understood, or a service that failed on it.

    ``id``: the request's, where it could be read.
    """

    id: str | None = None
    error: ErrorDetail


class LimitName(Struct, kw_only=True):
    """A limit of one hand or its limb, by name."""

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str
    joint: str | None = None


class Price(LimitName, kw_only=True):
    """What one more unit of a limit that binds would take off the utilisation.

    The unit is that of the limit's capacity: ``N``, ``N·m`` or ``A``.
    """

    price: float
    unit: str


class Tile(Struct, kw_only=True):
    """One finger tile. The last three fields come with ``"want": ["model"]``.

    The first two of them only where the wrist is fixed.
    """

    phalanx: str
    contact: str
    position: Vector
    force: Vector
    shear: float
    normal: float
    lateral: float
    shear_axis: Vector
    normal_axis: Vector
    lateral_axis: Vector
    utilisation: float
    load_at_zero: Vector | UnsetType = UNSET
    load_per_newton: Vector | UnsetType = UNSET
    half_planes: list[Vector] | UnsetType = UNSET


class Finger(Struct, kw_only=True):
    """One finger: its tendon, its motor while it tightens that, its tiles from the base outward.

    The winch's angle is from the open finger [rad].
    """

    name: str
    tendon_tension: float
    motor_torque: float
    motor_current: float
    winch_angle: float
    tiles: list[Tile]


class Palm(Struct, kw_only=True):
    """The palm: where it acts, its force there, and its moment about that point."""

    position: Vector
    force: Vector
    moment: Vector
    engaged: list[int]
    utilisation: float


class PlacedFrame(Struct):
    """A frame in another, the quaternion as [x, y, z, w]."""

    position: Vector
    orientation: Vector


class Seating(Struct):
    """Where the hold is in H, and how that was found."""

    rule: str
    pose: PlacedFrame


class Generator(Struct):
    """A column of a hand's wrench space: a load, and the wrench per newton of it.

    Of a floating hand a component of its wrist's twist, and the wrench per metre or radian.
    """

    name: str
    wrench: Vector


class Row(Struct, kw_only=True):
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
    rows: list[Row]


class Wrist(Struct, kw_only=True):
    """How a hand's wrist is; all but ``mode`` are null where it is fixed.

    ``twist``: where it goes from the pose that was given, about that pose [m, rad]. ``palm``:
    ``off``, ``drags``, ``presses`` or ``drags_and_presses``. ``rounds``: how often the hands' sets
    were linearised. ``error``: how far the set of the last step was off at its end [N, moments over
    0.1 m]; the plan is exact. Of a wrench space, how far it is off at most where it reaches
    farthest along the axes.
    """

    mode: str
    twist: Vector | None = None
    palm: str | None = None
    rounds: int | None = None
    error: float | None = None


class Hand(Struct, kw_only=True):
    """One hand of a plan. Its wrench space comes with ``"want": ["model"]``."""

    limb: str
    wrench: Vector
    fingers: list[Finger]
    palm: Palm
    utilisation: float
    seating: Seating
    wrist: Wrist
    wrench_space: WrenchSet | UnsetType = UNSET


class Certificate(Struct, kw_only=True):
    """Why nothing balances the body: at any ``utilisation`` (null), or up to that cap on it.

    Every body wrench w that the hands can supply, and their wrenches v on the rock with which they
    do, have direction · w + Σ held · v ≤ supremum (``held`` by limb, for hands that are given a
    wrench); what is asked for has ``needed``, which is more. ``nearest`` can be supplied,
    ``shortfall`` is what is missing; both are null where hands have no loads, whatever the body
    needs, and where a deadline came before. ``irreducible``: limits, hard rows and given wrenches
    (``held_wrench``) that by themselves leave no balance, each of them needed for that; others may
    be in the way, too. Empty where loads of any sign do not balance, null where rounding or a
    deadline leaves it undecided. ``sufficient``: those of them of which any one, taken away alone,
    would let the stance be held; empty if no single one would, null where that is not known. In all
    of these the caller's own limits come first, then other limits, then hard rows.
    ``wrench_spaces``, by limb, come with ``"want": ["model"]`` where there is no plan.
    """

    utilisation: float | None = None
    direction: Vector
    held: dict[str, Vector] = {}
    supremum: float
    needed: float
    shortfall: Vector | None
    nearest: Vector | None
    blocking: list[LimitName]
    irreducible: list[LimitName] | None = None
    sufficient: list[LimitName] | None = None
    wrench_spaces: dict[str, WrenchSet] | UnsetType = UNSET


class Solver(Struct):
    """Which solver ended how."""

    name: str
    status: str
    iterations: int


class Time(Struct):
    """Where the time went [s]."""

    model: float
    solve: float
    total: float


class TensionPath(Struct, kw_only=True):
    """The straight way from the present tensions to the planned ones.

    ``safe_part``: how much of it balances the body within the cap on the utilisation, from the plan
    backward. ``utilisation_at_present``: the least at the present tensions, null if these balance
    the body at no utilisation. ``largest_change``: of a tension [N]. ``limiting``: the limits and
    hard rows that end the safe part, the weightiest first; of a plan beyond the cap those of which
    it uses most.
    """

    safe: bool
    safe_part: float
    utilisation_at_present: float | None
    largest_change: float
    limiting: list[LimitName] = []


class PlanReply(Reply, kw_only=True):
    """Who carries what, and what margin is left.

    ``effort``: the sum of squared relative tendon tensions and joint torques. ``joints``: the
    angles planned for [rad], by limb, from the body outward; so are ``joint_torque`` and what the
    joints bear, ``joint_torque_limit`` [N·m]. ``effort_prices``: what one more unit of a limit
    would take off the effort, where the objective is ``min_effort``. ``unfinished``: what a
    deadline has left out, and a warning tells: ``least_utilisation`` (that no plan uses less is not
    proven), ``tie_break``, ``wrists``, ``least_effort``, ``load_factor``, ``path``,
    ``certificate``, ``explanation``.
    """

    id: str | None = None
    status: str
    reason: str
    body_wrench: Vector
    utilisation: float | None = None
    effort: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    survival_probability: float | None = None
    limiting: LimitName | None = None
    hands: list[Hand] | None = None
    joints: dict[str, Vector] | None = None
    joint_torque: dict[str, Vector] | None = None
    joint_torque_limit: dict[str, Vector] | None = None
    prices: list[Price] | None = None
    effort_prices: list[Price] | None = None
    certificate: Certificate | None = None
    residual: Vector | None = None
    path: TensionPath | None = None
    verified: bool
    solver: Solver
    time: Time
    warnings: list[str] = []
    unfinished: list[str] = []


class Contact(Struct, kw_only=True):
    """Where a finger tile meets the rock, and the axes of its loads.

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


class ClosingStage(Struct):
    """One part of a closing finger: from which tension it moves, at which it is at rest [N]."""

    part: str
    starts: float
    ends: float


class ClosingSequence(Struct):
    """How a finger has closed: its nail, its joints from the base outward, its tiles.

    ``in_order``: whether nail and joints move one after the other.
    """

    finger: str
    stages: list[ClosingStage]
    in_order: bool


class TensionLimit(Struct):
    """The tension at which a finger's first tile lets go [N]; null where none ever does."""

    finger: str
    tension: float | None
    phalanx: str | None


class HalfSpaceEquations(Struct):
    """``normals · w = offsets``."""

    normals: list[Vector]
    offsets: Vector


class HalfSpaces(Struct):
    """``normals · w ≤ offsets``, and what holds with equality where the set is flat."""

    normals: list[Vector]
    offsets: Vector
    equations: HalfSpaceEquations


class AxisCapability(Struct):
    """How far a set reaches along an axis.

    ``pure``: the most of it with every other component zero, null where there is none. ``extent``:
    the most of it with whatever else.
    """

    pure: float | None
    extent: float


class WrenchSpaceReply(Reply, kw_only=True):
    """What one hand can carry, at utilisation 1: if nothing, no vertices, and null for the rest."""

    robot: str
    limb: str
    wrist: Wrist
    seating: Seating
    contacts: list[Contact]
    closing: list[ClosingSequence]
    tension_limits: list[TensionLimit]
    origin: Vector
    generators: list[Generator]
    rows: list[Row]
    vertices: list[Vector]
    half_spaces: HalfSpaces | None
    dimension: int | None
    capability: dict[str, AxisCapability] | None


class BodyCapability(Struct, kw_only=True):
    """How far body wrenches that are held go along an axis of B; null where there are none.

    ``more``: beyond the body wrench asked for, which has to be held. ``pure``: with every other
    component zero. ``extent``: with whatever else. ``limiting``: the limit that ends ``more``, or
    else ``extent``.
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


class BodySpaceReply(Reply, kw_only=True):
    """What a stance can hold within the utilisation asked for.

    ``status``, ``reason``, ``utilisation``: of the plan for the body wrench asked for.
    ``acceleration``: by axis of W; null where the body cannot be held at rest or its wrench was
    given instead of a load. ``angular_acceleration``: about B's origin, for the robot's own load at
    known joints. ``along``: in the directions asked for. ``exact``: false where a wrist floats; its
    hand's set is then linearised, and at the extents it is off by up to ``error``, in newtons with
    moments over 0.1 m.
    """

    id: str | None = None
    robot: str
    status: str
    reason: str
    body_wrench: Vector
    utilisation: float | None
    exact: bool
    error: float
    capability: dict[str, BodyCapability]
    section: BodySection
    acceleration: dict[str, Acceleration] | None
    angular_acceleration: dict[str, Acceleration] | None
    along: list[Acceleration] | None
    time: Time
    warnings: list[str] = []
