"""Define replies with plans: whole and brief ones, climbs, and set-points of a stream."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from planner import (
    Advice,
    CertificateOf,
    Clearance,
    Finding,
    Finger,
    LimitName,
    LoadFactorStatus,
    Palm,
    Price,
    RobustLoadFactor,
    Solver,
    Spread,
    TensionPath,
    Time,
)
from service.replies.reply import Reply, SeatingReply, StanceReply, Vector, WrenchSet, Wrist

__all__ = [
    "BriefPlanReply",
    "CertificateReply",
    "HandColumns",
    "HandReply",
    "HandSetPoints",
    "PlanReply",
    "RouteReply",
    "RouteStageReply",
    "SetPointsReply",
    "StreamReply",
]


class CertificateReply(CertificateOf[Vector, WrenchSet], frozen=True, kw_only=True, eq=False):
    """Why nothing balances the body: at any ``utilisation`` (null), or up to that cap on it.

    Every body wrench w that the hands can supply with loads up to 10⁶ N, and their wrenches v on
    the rock with which they do, have direction · w + Σ held · v ≤ supremum (``held`` by limb, for
    hands that are given a wrench); what is asked for has ``needed``, which is more. ``nearest`` can
    be supplied, ``shortfall`` is what is missing; both are null where hands have no loads, whatever
    the body needs, and where a deadline came before. ``irreducible``: limits, hard rows and given
    wrenches (``held_wrench``) that by themselves leave no balance, each of them needed for that;
    others may be in the way, too. Empty where loads of any sign do not balance, null where rounding
    or a deadline leaves it undecided. ``irreducible_up_to``: loads up to which they are proven to
    leave no balance [N], at least 10⁶; null where that is so for loads of any size. ``sufficient``:
    those of them of which any one, taken away alone, would let the stance be held; empty if no
    single one would, null where that is not known. In all of these the caller's own limits come
    first, then other limits, then hard rows. ``wrench_spaces``, by limb, come with ``"want":
    ["model"]`` where there is no plan.
    """


class HandReply(Struct, kw_only=True):
    """One hand of a plan. Its wrench space comes with ``"want": ["model"]``."""

    limb: str
    wrench: Vector
    fingers: list[Finger]
    palm: Palm[Vector]
    utilisation: float
    seating: SeatingReply
    wrist: Wrist
    wrench_space: WrenchSet | UnsetType = UNSET


class PlanReply(StanceReply, kw_only=True):
    """Who carries what, and what margin is left.

    ``load_factor_status``: ``found``; ``at_least``, where floating hands may hold more; or why it
    is null: ``unbounded``, ``none`` where no multiple can be held, ``not_asked``, ``not_finished``
    by the deadline. ``utilisation``: up to 0.1 % above the least, where that saves tension;
    ``prices`` are of the least. ``effort``: the sum of squared relative tendon tensions and joint
    torques; where it is the objective, palms, lateral reactions and wrists count a little, too, so
    that there is one plan: it may so be a few tenths of a percent above the least. ``joints``: the
    angles planned for [rad], by limb, from the body outward; so are ``joint_torque`` and what the
    joints bear, ``joint_torque_limit`` [N·m]. ``effort_prices``: what one more unit of a limit
    would take off the effort, where the objective is ``min_effort``. ``certificate`` is null where
    there is a plan within the limits, and where the request says ``"explain": false``.
    ``unfinished``: what a deadline has left out, each with a warning: ``least_utilisation`` (that
    no plan uses less is not proven), ``tie_break``, ``wrists``, ``least_effort``, ``load_factor``,
    ``path``, ``certificate``, ``explanation``, ``robust``, ``spread``, ``advice``. ``robust`` comes
    with ``"want": ["robust"]``, but not for a body wrench of zero; ``spread``, ``clearance`` and
    ``advice`` with ``"want"`` of their names; changes that let the stance hold come first, the
    smallest first; then the others, by their gain for their size. ``findings``: what is odd about
    the stance, each with its ``field`` in the request and what was measured; ``warnings`` has their
    messages, too.
    """

    status: str
    reason: str
    body_wrench: Vector
    utilisation: float | None = None
    effort: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    load_factor_status: LoadFactorStatus = "not_asked"
    survival_probability: float | None = None
    limiting: LimitName | None = None
    hands: list[HandReply] | None = None
    joints: dict[str, Vector] | None = None
    joint_torque: dict[str, Vector] | None = None
    joint_torque_limit: dict[str, Vector] | None = None
    prices: list[Price] | None = None
    effort_prices: list[Price] | None = None
    certificate: CertificateReply | None = None
    residual: Vector | None = None
    path: TensionPath | None = None
    verified: bool
    solver: Solver
    time: Time
    warnings: list[str] = []
    findings: list[Finding] = []
    unfinished: list[str] = []
    robust: RobustLoadFactor | UnsetType = UNSET
    spread: Spread | UnsetType = UNSET
    clearance: Clearance | UnsetType = UNSET
    advice: list[Advice] | UnsetType = UNSET


class HandSetPoints(Struct):
    """Set-points of one hand: tensions [N], motors [N·m, A], its wrench on the rock in H.

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


class BriefPlanReply(StanceReply, kw_only=True):
    """A plan with ``"detail"`` ``set_points`` or ``hands``: fields as of a plan's whole reply.

    Those from ``body_wrench`` on, and ``poses``, are left out with ``set_points``; the ``reason``
    is cut then. Of four hands that is less than 2,000 bytes of JSON, and less than 1,000 of
    MessagePack, whatever the status, beside the request's ``id``.
    """

    status: str
    reason: str
    utilisation: float | None = None
    limiting: LimitName | None = None
    hands: list[HandSetPoints] | None = None
    verified: bool
    unfinished: list[str] = []
    body_wrench: Vector | UnsetType = UNSET
    load_factor: float | UnsetType | None = UNSET
    load_factor_unbounded: bool | UnsetType = UNSET
    load_factor_status: LoadFactorStatus | UnsetType = UNSET
    joints: dict[str, Vector] | UnsetType | None = UNSET
    warnings: list[str] | UnsetType = UNSET
    findings: list[Finding] | UnsetType = UNSET
    time: Time | UnsetType = UNSET


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


class RouteStageReply(Struct, kw_only=True):
    """A stance of a climb. ``move``: from one, zero for the start; ``phase``: of the move.

    ``limb``: the one that moves. ``reason``: what limits the plan, or why there is none.
    """

    move: int
    phase: str
    limb: str | None
    status: str
    utilisation: float | None
    load_factor: float | None
    load_factor_unbounded: bool
    load_factor_status: LoadFactorStatus
    joint_utilisation: float | None
    limiting: LimitName | None
    reason: str


class RouteReply(Reply, kw_only=True):
    """A climb, planned stage by stage.

    ``status``: of the stage that is worst off. ``crux``: the index of the hardest stage, whose
    ``utilisation`` and ``limiting`` these are. ``load_factor``: the least of all stages;
    ``load_factor_status``, here and there: as of a plan.
    """

    name: str
    status: str
    crux: int
    utilisation: float | None
    load_factor: float | None
    load_factor_unbounded: bool
    load_factor_status: LoadFactorStatus
    limiting: LimitName | None
    stages: list[RouteStageReply]
    warnings: list[str]
