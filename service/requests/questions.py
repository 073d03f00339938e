"""Define the requests for plans, wrench and body spaces, set-points and climbs.

Fields that later versions will support are declared already, so that the service refuses them by
name (`service.wire.codec`) and not as unknown fields.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, field

from hand_models.base import Acceleration, Coordinate, Name, Strict
from planner import (
    BodyRange,
    Limits,
    Load,
    Objective,
    OpenLoopSettings,
    SurvivalSettings,
    Want,
)
from service.requests.request import (
    Detail,
    Identifier,
    InParts,
    Later,
    PoseMessage,
    Query,
    Tensions,
    Wrench,
)
from service.requests.stance import Angles, Entries, Hand, HandEntries, StanceMessage

__all__ = [
    "Axis",
    "BodySpaceRequest",
    "DiagnosisRequest",
    "Draw",
    "MoveMessage",
    "ObjectiveName",
    "PlanRequest",
    "PlanWant",
    "RouteRequest",
    "SpaceWant",
    "WrenchSpaceRequest",
]

ObjectiveName = Annotated[
    Objective,
    Meta(
        description="least utilisation; least effort within limits.utilisation; largest "
        "probability that no tile slips, at nearly the least utilisation; or least mean "
        "utilisation over samples, with the same tensions"
    ),
]
Explain = Annotated[
    bool,
    Meta(
        description="whether a certificate proves what keeps the stance from a plan, and names "
        "limits that together do; without it, the same status is there sooner"
    ),
]
Axis = Literal["fx", "fy", "fz", "mx", "my", "mz"]
Direction = tuple[Coordinate, Coordinate, Coordinate]
PlanWant = Literal[Want, "com_region", "redundancy", "survival"]
SpaceWant = Literal["robust", "half_spaces", "vertices", "opening"]
Currents = Annotated[list[Annotated[float, Meta(ge=0.0, le=1e3)]], Meta(min_length=4, max_length=4)]
Turns = Annotated[list[Annotated[float, Meta(ge=-1e3, le=1e3)]], Meta(min_length=4, max_length=4)]
Tolerance = Annotated[float, Meta(ge=0.001, le=1.0)]


class Draw(Strict, frozen=True, kw_only=True):
    """One sample of uncertain parameters of hand and rock; the rest keep their nominal values.

    - ``hand``: numbers of the hand, by section and entry of ``hand.toml``.
    - ``surfaces``: numbers of the surface presets, by section and entry of ``surfaces.toml``.
    """

    hand: HandEntries | None = None
    surfaces: Annotated[
        Entries | None,
        Meta(
            description="numbers of presets in place of the bundled ones, by section and entry of "
            "their parameter file surfaces.toml"
        ),
    ] = None


Draws = Annotated[
    list[Draw],
    Meta(
        min_length=1,
        max_length=100,
        description="samples for the spread and max_robust; by default those of draws.toml",
    ),
]


class PlanRequest(Query, frozen=True, kw_only=True):
    """Request for a plan of one stance: loads of all hands and tensions of all tendons.

    - ``stance``: poses of body and hands, and their holds.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m]; give it or
      ``load``, not both.
    - ``load``: mass, acceleration and payloads from which the body wrench follows; by default the
      robot's weight at rest.
    - ``objective``: ``max_margin`` for the least utilisation, ``min_effort`` for the least effort
      within ``limits.utilisation``, ``max_reliability`` for the largest probability that no tile
      slips, at nearly the least utilisation, ``max_robust`` for the least mean utilisation over
      samples with the same tensions; both need fixed wrists on all hands.
    - ``tolerance``: part of the least utilisation by which a plan for ``max_reliability`` may
      exceed it; 0.02 by default.
    - ``limits``: the cap on the utilisation, and the caller's own limits.
    - ``present``: present tensions of the four tendons [N], by limb; the reply's ``path`` says
      whether the straight way from them is safe.
    - ``confidence``: not supported in this version.
    - ``detail``: how much the reply contains: ``set_points``, ``hands`` or ``full``; by default
      ``full``, or as much as fits in ``max_reply_bytes``.
    - ``want``: names of further results.
    - ``draws``: samples of uncertain parameters for the spread and ``max_robust``; by default the
      bundled samples.
    - ``explain``: false leaves out the certificate of a stance that is overloaded or infeasible.
    - ``body_range``: how far advice may move the body.
    - ``open_loop``: samples of displaced hands for ``"want": ["open_loop"]``.
    - ``survival``: draws of strengths for ``"want": ["survival"]``.
    """

    stance: StanceMessage
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions],
        Meta(description="tensions of the tendons now, by limb: is the straight way safe? [N]"),
    ] = {}
    confidence: Later = None
    detail: Detail | None = None
    want: Annotated[
        list[PlanWant],
        Meta(
            description="robust: the least load factor over a scatter of the hands' places, too. "
            "open_loop: the utilisation over displaced hands if the plan is executed as it is. "
            "spread: utilisation and load factor over draws of the hand's and the rock's numbers. "
            "clearance: the least distances of body, hands, links and rock. "
            "com_region: where the centre of mass may be. "
            "advice: what would make it hold, or hold more: verified changes. "
            "redundancy: the plan without each tile, finger and hand, without moving. "
            "survival: how likely it is that no tile slips, and that all hands hold if some do"
        ),
    ] = []
    draws: Draws = []
    explain: Explain = True
    body_range: Annotated[BodyRange, Meta(description="for the advice")] = BodyRange()
    open_loop: Annotated[
        OpenLoopSettings | None,
        Meta(description="samples of displaced hands; only with open_loop in want"),
    ] = None
    survival: Annotated[
        SurvivalSettings | None,
        Meta(description="draws of strengths; only with survival in want"),
    ] = None
    tolerance: Annotated[
        Tolerance | None,
        Meta(description="part of the least utilisation that max_reliability may give away"),
    ] = None


class DiagnosisRequest(Query, frozen=True, kw_only=True):
    """Request for the tile that has probably slipped, by the data of motors; fixed wrists only.

    One of ``tensions``, ``currents`` and ``turns`` is needed, by limb; hands that are left out are
    not suspected. The other fields are those of the plan request to whose plan the tendons have
    been tightened.

    - ``stance``, ``body_wrench``, ``load``, ``limits``, ``objective``, ``tolerance``: as of a plan.
    - ``tensions``: tensions after the slip, with winches that stood still [N].
    - ``currents``: in their place, currents of motors that tighten the tendons to them [A].
    - ``turns``: turns of the winches since, with motors that kept their tension, positive as they
      wind up tendon [rad].
    """

    stance: StanceMessage
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    tolerance: Annotated[Tolerance | None, Meta(description="of max_reliability")] = None
    limits: Limits = Limits()
    tensions: Annotated[dict[Name, Tensions], Meta(description="after a slip, by limb [N]")] = {}
    currents: Annotated[dict[Name, Currents], Meta(description="after a slip, by limb [A]")] = {}
    turns: Annotated[dict[Name, Turns], Meta(description="of winches since, by limb [rad]")] = {}


class WrenchSpaceRequest(Query, frozen=True, kw_only=True):
    """Request for the wrench space of one hand of a stance: all wrenches that the hand can exert.

    - ``stance``: poses of body and hands, and their holds.
    - ``limb``: name of the limb that carries the hand.
    - ``want``: names of further results; by default ``vertices`` and ``half_spaces`` where they are
      cheap.
    """

    stance: StanceMessage
    limb: Name
    want: Annotated[
        list[SpaceWant] | None,
        Meta(
            description="results beside rows and capability, each at most once; an error of kind "
            "limit where it would cost too much, as many half_planes may. By default "
            "half_spaces and vertices where they are cheap. robust: the least that it can carry "
            "over a scatter of its place. opening: how it lets go, of a fixed wrist",
            extra_json_schema={"uniqueItems": True},
        ),
    ] = None


class BodySpaceRequest(Query, frozen=True, kw_only=True):
    """Request for the body space of a stance: body wrenches and accelerations that can be held.

    - ``stance``: poses of body and hands, and their holds.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m]; give it or
      ``load``, not both.
    - ``load``: mass, acceleration and payloads from which the body wrench follows; by default the
      robot's weight at rest.
    - ``limits``: the cap on the utilisation, and the caller's own limits.
    - ``present``: present tensions of the four tendons [N], by limb.
    - ``axes``: two components of the body wrench, which span the plane of the section.
    - ``others``: the other four components in this plane: ``needed`` as asked for, ``zero``, or
      ``free``.
    - ``want``: names of further results: ``com_region``, where the centre of mass may be.
    - ``com_accelerations``: accelerations of the body in W, under each of which the centre of mass
      may be in ``com_region.solid``, besides that of the load [m/s²].
    - ``directions``: directions in W along which the largest acceleration is computed; not zero, of
      any length.
    """

    stance: StanceMessage
    body_wrench: Annotated[
        Wrench | None, Meta(description="that the rock must exert on the robot, in B; or load")
    ] = None
    load: Load | None = None
    limits: Limits = Limits()
    present: Annotated[
        dict[Name, Tensions], Meta(description="tensions of the tendons now, by limb [N]")
    ] = {}
    axes: Annotated[
        list[Axis], Meta(min_length=2, max_length=2, description="of the plane; fx and fz")
    ] = field(default_factory=lambda: ["fx", "fz"])
    others: Annotated[
        Literal["needed", "zero", "free"],
        Meta(
            description="the plane's other components: as asked for, zero, or whatever they may be"
        ),
    ] = "needed"
    want: Annotated[
        list[Literal["com_region"]], Meta(description="com_region: where the mass may be")
    ] = []
    com_accelerations: Annotated[
        list[Acceleration],
        Meta(max_length=32, description="of com_region.solid: requires com_region in want [m/s²]"),
    ] = []
    directions: Annotated[
        list[Direction],
        Meta(
            max_length=100,
            description="along which the largest acceleration is wanted, in W: one program each",
        ),
    ] = []


class MoveMessage(Hand, frozen=True, kw_only=True):
    """Move of one limb to its next hold, as part of a climb.

    Besides the fields of a hand on its new hold:

    - ``body``: pose of B in W to which the body shifts before the limb lifts; without it the body
      does not shift.
    - ``joints``: joint angles by limb [rad], or ``"solve"`` for inverse kinematics, of a climb
      whose start stance has joints.
    """

    body: Annotated[
        PoseMessage | None,
        Meta(description="of B in W: where the body shifts to before the limb lifts"),
    ] = None
    joints: Annotated[
        dict[Name, Angles | Literal["solve"]] | Literal["solve"],
        Meta(
            description="of a start stance with joints, angles by limb: of those on the rock from "
            "the shift on, of the limb that moves on its new hold. Limbs left out keep theirs, "
            "unless the body shifts or they move: then they are found"
        ),
    ] = "solve"


class RouteRequest(Query, frozen=True, kw_only=True):
    """Request for a climb: a start stance, and moves. It takes as long as many plans.

    - ``name``: name of the route.
    - ``stance``: the start stance.
    - ``load``: mass and payloads from which the body wrench of every stance follows.
    - ``objective``: as in a plan's request, for every stance.
    - ``limits``: the cap on the utilisation, and the caller's own limits, for every stance.
    - ``moves``: the moves in climbing order.
    - ``end``: pose of B in W to which the body shifts after all moves.
    - ``explain``: false leaves out the certificates of stances that are overloaded or infeasible.
    - ``want``: names of further results: ``spread`` of every stance, and ``trajectory``.
    - ``parts``: over zenoh, the knots of a trajectory come move by move, in replies of their own
      before the last one, which then has none.
    - ``draws``: samples of uncertain parameters for the spread and ``max_robust``; by default the
      bundled samples.
    """

    name: Identifier = "route"
    stance: StanceMessage
    load: Load | None = None
    objective: ObjectiveName = "max_margin"
    limits: Limits = Limits()
    moves: Annotated[list[MoveMessage], Meta(max_length=10_000)]
    end: Annotated[
        PoseMessage | None, Meta(description="of B in W, to which the body shifts after all moves")
    ] = None
    explain: Explain = True
    want: Annotated[
        list[Literal["spread", "trajectory"]],
        Meta(
            description="spread: of every stance, as in a plan's request. trajectory: how the "
            "robot moves between the stances: the knots of the climb"
        ),
    ] = []
    parts: InParts = False
    draws: Draws = []
