"""What the service says: every reply, lenient, so that a reply may gain fields.

Poses and vectors as in the requests; forces and moments are on the rock and in H unless said
otherwise. A value that does not exist is null; what was not asked for with ``want`` is left out.
"""

from __future__ import annotations

from typing import Final

from msgspec import UNSET, Struct, UnsetType

__all__ = [
    "AXES",
    "AxisCapability",
    "Certificate",
    "Closing",
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
    "Stage",
    "TensionLimit",
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
    """A request that could not be understood, or a service that failed on it."""

    error: ErrorDetail


class LimitName(Struct):
    """A limit of one hand, by name."""

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str


class Price(LimitName):
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
    for ``motor_torque`` in newton-metres, for ``motor_current`` in amperes.
    ``hard`` rows: coefficients · y at most capacity, whatever the utilisation.
    """

    name: str
    kind: str
    finger: str | None
    phalanx: str | None
    limit: str
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
    """Why nothing balances the body.

    Every body wrench w that the hands can supply has direction · w ≤ supremum, and the one asked
    for has ``needed``, which is more. ``nearest`` can be supplied, ``shortfall`` is what
    is missing.
    """

    direction: Vector
    supremum: float
    needed: float
    shortfall: Vector
    nearest: Vector
    blocking: list[LimitName]


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


class PlanReply(Reply, kw_only=True):
    """Who carries what, and what margin is left."""

    id: str | None = None
    status: str
    reason: str
    body_wrench: Vector
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    survival_probability: float | None = None
    limiting: LimitName | None = None
    hands: list[Hand] | None = None
    joint_torque: dict[str, Vector] | None = None
    prices: list[Price] | None = None
    certificate: Certificate | None = None
    residual: Vector | None = None
    verified: bool
    solver: Solver
    time: Time
    warnings: list[str] = []


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


class Stage(Struct):
    """One part of a closing finger: from which tension it moves, at which it is at rest [N]."""

    part: str
    starts: float
    ends: float


class Closing(Struct):
    """How a finger has closed: its nail, its joints from the base outward, its tiles.

    ``in_order``: whether nail and joints move one after the other.
    """

    finger: str
    stages: list[Stage]
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
    closing: list[Closing]
    tension_limits: list[TensionLimit]
    origin: Vector
    generators: list[Generator]
    rows: list[Row]
    vertices: list[Vector]
    half_spaces: HalfSpaces | None
    dimension: int | None
    capability: dict[str, AxisCapability] | None
