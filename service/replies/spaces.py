"""Define the replies about wrench spaces of hands and body spaces of stances."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from planner import Finding, LimitName, Time
from service.replies.opening import OpeningReply
from service.replies.reply import Generator, RowReply, SeatingReply, StanceReply, Vector, Wrist

__all__ = [
    "Acceleration",
    "AxisCapability",
    "BodyCapability",
    "BodySectionReply",
    "BodySpaceReply",
    "ClosingSequenceReply",
    "ClosingStageReply",
    "ComRegionReply",
    "ComSolidReply",
    "ContactReply",
    "HalfSpaceEquations",
    "HalfSpacesReply",
    "RobustCapability",
    "TensionLimitReply",
    "WrenchSpaceReply",
]


class ContactReply(Struct):
    """Place where a finger tile meets the rock, and the axes of the tile's loads, in H.

    - ``finger``: name of the finger.
    - ``phalanx``: name of the phalanx that carries the tile.
    - ``contact``: contact state of the phalanx: ``face``, ``edge``, ``frame`` or ``none``.
    - ``stop``: limit at which the phalanx's joint rests (``upper``, ``lower``), or ``balance``
      where tendon and springs keep the joint without contact; null where contacts keep it, or where
      the tile is on no phalanx.
    - ``position``: point of contact in H [m].
    - ``engagement``: share of the tile's spines that reach the rock, by its area.
    - ``across``: distance of the contact from the finger's plane, along (z of H) × (finger) [m]:
      a tile that bears on one side only has its contact there.
    - ``shear_axis``: unit force of the shear load on the rock, in H.
    - ``normal_axis``: unit force of the normal load on the rock, in H.
    - ``lateral_axis``: unit force of the lateral load on the rock, in H.
    """

    finger: str
    phalanx: str
    contact: str
    stop: str | None
    position: Vector
    engagement: float
    across: float
    shear_axis: Vector
    normal_axis: Vector
    lateral_axis: Vector


class ClosingStageReply(Struct):
    """One part of a closing finger, and the tendon tensions between which the part moves.

    - ``part``: ``nail``, the phalanx whose joint turns, or ``tiles``.
    - ``starts``: tension at which the part begins to move [N].
    - ``ends``: tension at which the part is at rest [N].
    """

    part: str
    starts: float
    ends: float


class ClosingSequenceReply(Struct):
    """Way in which a finger has closed on its hold, stage by stage.

    - ``finger``: name of the finger.
    - ``stages``: the finger's nail, its joints from the base outward, its tiles.
    - ``in_order``: true where nail and joints move one after the other.
    - ``closure``: how the finger has ended: ``laid``, ``hooked``, ``wedged``, ``curled``,
      ``stopped`` or ``straight``.
    - ``nearby``: other closures in which the finger would end if the rock were 0.1 mm elsewhere;
      ``refused`` among them if the hand could not be there.
    - ``nearby_turn``: largest change of a joint's angle for these places of the rock [rad].
    """

    finger: str
    stages: list[ClosingStageReply]
    in_order: bool
    closure: str
    nearby: list[str]
    nearby_turn: float


class TensionLimitReply(Struct):
    """Tendon tension at which the first tile of a finger reaches its limit.

    - ``finger``: name of the finger.
    - ``tension``: the tension [N]; null where no tile ever reaches its limit.
    - ``phalanx``: phalanx of that tile; null where ``tension`` is null.
    """

    finger: str
    tension: float | None
    phalanx: str | None


class HalfSpaceEquations(Struct):
    """Equations of a flat set of wrenches w: normals · w = offsets.

    - ``normals``: one list of six numbers for each equation.
    - ``offsets``: one number for each equation.
    """

    normals: list[Vector]
    offsets: Vector


class HalfSpacesReply(Struct):
    """Half-spaces whose intersection is a set of wrenches w: normals · w ≤ offsets.

    - ``normals``: one list of six numbers for each half-space.
    - ``offsets``: one number for each half-space.
    - ``equations``: equations that hold besides, where the set has less than six dimensions.
    """

    normals: list[Vector]
    offsets: Vector
    equations: HalfSpaceEquations


class AxisCapability(Struct):
    """Largest wrench component of a set along an axis [N, N·m].

    A negative value means that every wrench of the set has at least this much of the opposite
    component.

    - ``pure``: largest component with the other five zero; null where the set has no such wrench.
    - ``extent``: largest component whatever the other five (support function of the set).
    """

    pure: float | None
    extent: float


class RobustCapability(Struct, kw_only=True):
    """Reach of a wrench space along each axis, if the hand is not exactly where it was put.

    The hand is closed anew at sampled places (Monte Carlo samples) near the given one. A place
    where the hand cannot be, or where it holds nothing, counts as a reach of zero. Reaches are by
    sign and axis, such as ``+fx`` [N, N·m].

    - ``draws``: number of sampled places.
    - ``without``: number of these places where the hand cannot be, or holds nothing.
    - ``position``: largest shift to either side along each axis of H [m].
    - ``angle``: largest turn to either side about each axis of H [rad].
    - ``contact_position``, ``contact_angle``: largest displacement along z [m] and about x and y of
      H [rad], in place of the two above, of a hand placed by contact, which comes to rest anew at
      each place; else null.
    - ``seed``: seed of the samples.
    - ``worst``: deprecated, the same as ``hundredth``.
    - ``tenth``: ``extent`` that the hand exceeds at nine in ten places; null where it is not
      finite.
    - ``hundredth``: ``extent`` that the hand exceeds at 99 in a hundred places; null where it is
      not finite.
    - ``pure_tenth``: ``pure`` force, with every other component zero, that the hand has at nine in
      ten places, by sign and axis of forces only [N]; a place without any counts as zero.
    - ``share``: share of the places whose ``pure`` force is at least ``force``, likewise [1].
    - ``force``: the force of ``share`` [N].
    """

    draws: int
    without: int
    position: float
    angle: float
    seed: int
    worst: dict[str, float | None]
    tenth: dict[str, float | None]
    hundredth: dict[str, float | None]
    contact_position: float | None = None
    contact_angle: float | None = None
    pure_tenth: dict[str, float] | None = None
    share: dict[str, float] | None = None
    force: float | None = None


class WrenchSpaceReply(StanceReply, kw_only=True):
    """Wrench space of one hand: all wrenches that the hand can exert on its hold at utilisation 1.

    - ``robot``: name of the robot.
    - ``limb``: name of the limb that carries the hand.
    - ``wrist``: state of the hand's wrist.
    - ``seating``: pose of the hold in H.
    - ``contacts``: contact of each tile with the rock.
    - ``closing``: stages in which each finger has closed.
    - ``tension_limits``: largest tendon tension of each finger.
    - ``origin``: wrench on the rock where all variables y are zero, in H [N, N·m].
    - ``generators``: one column for each variable: the wrench is origin + Σ y · generator.
    - ``rows``: linear inequalities on y.
    - ``vertices``: corners of the set, in H [N, N·m]; null where they were not asked for or cost
      too much (``warnings`` then say so), an empty list where the hand can exert no wrench.
    - ``half_spaces``: half-spaces of the set; null where they were not asked for, cost too much, or
      the hand can exert no wrench.
    - ``dimension``: dimension of the set, 0 to 6; null where the hand can exert no wrench, or where
      the count would cost too much.
    - ``capability``: reach along each axis, by sign and axis such as ``+fx``; null where the hand
      can exert no wrench.
    - ``cannot``: sentences that say which forces on the rock the hand cannot exert alone, with
      every other component zero: by ``-fz`` (pull-off) and ``-fx`` to ``+fy`` (shear); empty where
      it can exert them all, null where it can exert no wrench.
    - ``warnings``: sentences about what was left out.
    - ``robust``: reach over places near the given one; only with ``"want": ["robust"]``.
    - ``opening``: how the hand lets go of its hold; only with ``"want": ["opening"]``.
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
    cannot: dict[str, str] | None = None
    warnings: list[str] = []
    robust: RobustCapability | UnsetType = UNSET
    opening: OpeningReply | UnsetType = UNSET


class BodyCapability(Struct, kw_only=True):
    """Reach of the body wrenches that a stance can hold, along an axis of B [N, N·m].

    A negative value means that every such wrench has at least this much of the opposite component.

    - ``more``: largest addition along the axis to the body wrench asked for; null where that body
      wrench cannot be held.
    - ``pure``: largest component with the other five zero; null where no such wrench can be held.
    - ``extent``: largest component whatever the other five; null where no wrench can be held.
    - ``limiting``: the limit that ends ``more``; where ``more`` is null, the limit that ends
      ``extent``.
    """

    more: float | None
    pure: float | None
    extent: float | None
    limiting: LimitName | None


class BodySectionReply(Struct, kw_only=True):
    """Plane section of the body space: body wrenches in the plane of two axes [N, N·m].

    Every point of the inner polygon can be held, and no point outside the outer polygon. Corners go
    counterclockwise: two of a segment, one of a point, none where nothing in the plane can be held.

    - ``axes``: names of the two components.
    - ``others``: the other four components: ``needed`` as asked for, ``zero``, or ``free``, which
      makes the section a projection.
    - ``inner``: corners of the inner polygon.
    - ``outer``: corners of the outer polygon.
    - ``gap``: largest distance between the polygons, moments divided by 0.1 m [N]; null without
      corners.
    - ``limiting``: the limit that is reached at each corner of the inner polygon; null where there
      is none.
    """

    axes: list[str]
    others: str
    inner: list[Vector]
    outer: list[Vector]
    gap: float | None
    limiting: list[LimitName | None]


class ComSolidReply(Struct, kw_only=True):
    """Region in which the centre of mass may be under several accelerations: a polytope in W.

    - ``accelerations``: accelerations of the body in W, the load's first [m/s²].
    - ``inner``: vertices of a polytope, each point of which can be held under all of them [m].
    - ``outer``: vertices of a polytope outside which no point can be [m].
    - ``gap``: largest distance between the polytopes [m].
    - ``margin``: distance of the region's ``com`` from the surface of the inner polytope [m],
      negative outside.
    """

    accelerations: list[Vector]
    inner: list[Vector]
    outer: list[Vector]
    gap: float
    margin: float


class ComRegionReply(Struct, kw_only=True):
    """Region in which the centre of mass may be while hands and joints stay: a prism.

    A point p of W is in the region if (axes[0] · p, axes[1] · p) is in the polygon, at any height
    along ``up``. Every point of the inner polygon can be held, and no point outside the outer one.

    - ``axes``: two unit vectors in W across the load; x and y of W where gravity is along its z.
    - ``up``: unit vector in W against the load: against gravity, for a body at rest.
    - ``com``: the centre of mass asked for, without payloads, in W [m].
    - ``inner``, ``outer``: corners of the polygons along ``axes`` [m], counterclockwise; empty
      where no centre of mass can be held.
    - ``gap``: largest distance between the polygons [m]; null without corners.
    - ``limiting``: the limit that is reached at each corner of the inner polygon; null where there
      is none.
    - ``margin``: distance of ``com`` from the border of the inner polygon [m], negative outside;
      null without corners.
    - ``exact``: false where a wrist moves; the wrench space of its hand is then linearised.
    - ``solid``: where it may be under the request's ``com_accelerations``, too; null without them,
      or where no place with room around it is held under all.
    """

    axes: list[Vector]
    up: Vector
    com: Vector
    inner: list[Vector]
    outer: list[Vector]
    gap: float | None
    limiting: list[LimitName | None]
    margin: float | None
    exact: bool
    solid: ComSolidReply | None = None


class Acceleration(Struct, kw_only=True):
    """Largest acceleration of the body from rest that a stance can hold along a direction in W.

    - ``direction``: unit vector in W; the axis of rotation for an angular acceleration.
    - ``acceleration``: the largest acceleration [m/s²], or [rad/s²] if angular.
    - ``limiting``: the limit that ends the acceleration; null where there is none.
    """

    direction: Vector
    acceleration: float
    limiting: LimitName | None


class BodySpaceReply(StanceReply, kw_only=True):
    """Body space of a stance: the body wrenches and accelerations within the utilisation asked for.

    - ``robot``: name of the robot.
    - ``status``: status of the plan for the body wrench asked for.
    - ``reason``: one sentence that says what limits that plan, or why there is none.
    - ``body_wrench``: the body wrench asked for, in B [N, N·m].
    - ``utilisation``: utilisation of that plan; null without a plan.
    - ``exact``: false where a wrist floats; the wrench space of its hand is then linearised.
    - ``linearisation_error``: largest error of the linearised wrench spaces at the extents, moments
      divided by 0.1 m [N]; zero where ``exact`` is true.
    - ``error``: deprecated, the same as ``linearisation_error``; there for one more version.
    - ``capability``: reach along each axis of B, by sign and axis such as ``+fx``.
    - ``section``: the section of the body space that was asked for.
    - ``acceleration``: largest acceleration by signed axis of W, such as ``+x``; null where the
      body cannot be held at rest, or where the request gives a body wrench instead of a load.
    - ``angular_acceleration``: largest angular acceleration about B's origin, by signed axis of W;
      null unless joints are known and the load is the robot's own, without ``com``.
    - ``along``: largest accelerations in the directions asked for; null where ``acceleration`` is
      null.
    - ``com_region``: where the centre of mass may be; only with ``"want": ["com_region"]``.
    - ``time``: time that each part of the answer took [s].
    - ``warnings``: sentences about what is odd or left out.
    - ``findings``: what is odd about the stance, each with its ``field`` in the request.
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
    com_region: ComRegionReply | UnsetType = UNSET
    time: Time
    warnings: list[str] = []
    findings: list[Finding] = []
