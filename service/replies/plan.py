"""Define replies with plans: whole and brief plans, and climbs."""

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
    OpenLoop,
    Palm,
    Price,
    Redundancy,
    Reliability,
    RobustLoadFactor,
    Solver,
    Spread,
    Survival,
    TensionPath,
    Time,
)
from service.replies.climb import ClimbFailureReply, KnotReply
from service.replies.reply import Reply, SeatingReply, StanceReply, Vector, WrenchSet, Wrist
from service.replies.spaces import ComRegionReply

__all__ = [
    "BriefPlanReply",
    "CertificateReply",
    "HandReply",
    "HandSetPoints",
    "PlanReply",
    "RouteReply",
    "RouteStageReply",
]


class CertificateReply(CertificateOf[Vector, WrenchSet], frozen=True, kw_only=True, eq=False):
    """Proof that no plan balances the body, or none within a cap on the utilisation.

    This is an infeasibility certificate (Farkas certificate). Notation: w is a body wrench that the
    hands can supply with loads up to 10⁶ N, in B; v are the wrenches that the hands then exert on
    the rock, each in its H. The proof is direction · w + Σ held · v ≤ ``supremum`` < ``needed`` for
    every such w and v. Lists of limits begin with the caller's limits; other limits follow, then
    hard rows.

    - ``utilisation``: the cap on the utilisation that no plan keeps to; null where no plan exists
      at any utilisation.
    - ``direction``: six numbers in B [1/N, 1/(N·m)]: the direction of the body wrench in which the
      hands give less than the body needs.
    - ``held``: six numbers in H [1/N, 1/(N·m)] by limb, for hands whose wrench the request gives;
      zero for free components.
    - ``supremum``: largest value of the left side of the proof over all loads.
    - ``needed``: value of the left side for what the request asks; larger than ``supremum``.
    - ``nearest``: nearest body wrench that the hands can supply, in B [N, N·m]; null where the
      hands have no admissible loads at all, whatever the body needs, or where a deadline came
      before.
    - ``shortfall``: the body wrench asked for minus ``nearest``, in B [N, N·m]; null where
      ``nearest`` is null.
    - ``blocking``: limits and hard rows that keep the hands from giving more in the direction;
      empty where no hand can give anything.
    - ``irreducible``: an irreducible infeasible subset: limits, hard rows and given wrenches
      (``held_wrench``) that by themselves leave no balance; each of them is needed for that. Other
      limits may be in the way, too. Empty where loads of any sign do not balance the body; null
      where rounding or a deadline leaves the subset undecided.
    - ``irreducible_up_to``: loads up to which ``irreducible`` is proven to leave no balance [N], at
      least 10⁶; null where the proof covers loads of any size, or where there is no subset.
    - ``sufficient``: members of ``irreducible`` of which any one, taken away alone, would make the
      stance feasible; empty if no single one would, null where that is not known.
    - ``wrench_spaces``: wrench space of each hand by limb; only with ``"want": ["model"]``, where
      there is no plan.
    """


class HandReply(Struct, kw_only=True):
    """One hand of a plan: its loads, its utilisation, its pose on the hold and its wrist.

    - ``limb``: name of the limb that carries the hand.
    - ``wrench``: force and moment of the hand on the rock, in H, about H's origin [N, N·m].
    - ``fingers``: tension and tile loads of each of the four fingers.
    - ``palm``: load of the palm.
    - ``utilisation``: largest load over capacity of the hand's limits.
    - ``seating``: pose of the hold in H.
    - ``wrist``: state of the wrist.
    - ``wrench_space``: linear description of the wrenches that the hand can exert; only with
      ``"want": ["model"]``.
    """

    limb: str
    wrench: Vector
    fingers: list[Finger]
    palm: Palm[Vector]
    utilisation: float
    seating: SeatingReply
    wrist: Wrist
    wrench_space: WrenchSet | UnsetType = UNSET


class PlanReply(StanceReply, kw_only=True):
    """Plan of a stance: loads of all hands, tensions of all tendons, and the margin that is left.

    - ``status``: ``optimal``, ``overloaded``, ``infeasible`` or ``failed``.
    - ``reason``: one sentence that says what limits the plan, or why there is none.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m].
    - ``utilisation``: load over capacity of the limit that is used most; up to 0.1 % above the
      least possible, where that saves tension. Null without a plan.
    - ``effort``: sum of squared relative tendon tensions and joint torques. Where effort is the
      objective, palms, lateral reactions and wrists count a little, too, so that the plan is
      unique; the effort may then be a few tenths of a percent above the least. Null without a plan.
    - ``load_factor``: largest multiple of the body wrench that can be held at utilisation 1; null
      for the reasons in ``load_factor_status``.
    - ``load_factor_unbounded``: true where every multiple of the body wrench can be held.
    - ``load_factor_status``: ``found``; ``at_least``, where floating hands may hold more; or why
      ``load_factor`` is null: ``unbounded``, ``none`` where no multiple can be held, ``not_asked``,
      ``not_finished`` by the deadline.
    - ``survival_probability``: probability that no tile and no palm slips, with factors of holds
      and rock: ``survival.no_slip``; null where it was not asked for, or without a plan.
    - ``margin_share``: share of the margins that the plan keeps, from 0 to 1; only with
      ``limits.margins`` ``if_possible``, and with a plan.
    - ``limiting``: the limit that is used most; null without a plan.
    - ``hands``: one entry for each hand; null where nothing balances the body.
    - ``joints``: joint angles planned for, by limb, from the body outward [rad]; [m] for joints
      that slide. Null where the request has no joints.
    - ``joint_torque``: torques of these joints, by limb, from the body outward [N·m]; [N] for
      joints that slide. Null without joints or without a plan.
    - ``joint_torque_limit``: largest torques that the joints can carry, in the same order and
      units; null where the request has no joints.
    - ``prices``: shadow prices of the limits that bind: how far the least utilisation falls for one
      more unit of a limit [1/N, 1/(N·m), 1/A]; null where they were not asked for, or without a
      plan.
    - ``effort_prices``: how far the effort falls for one more unit of a limit, where the objective
      is ``min_effort``; else null.
    - ``certificate``: proof that there is no plan within the limits; null where there is one, and
      with ``"explain": false``.
    - ``residual``: body wrench of the loads minus ``body_wrench`` [N, N·m]; null without a plan.
    - ``path``: whether the straight way from the ``present`` tensions, if given, is safe; or null.
    - ``verified``: true where the independent check of the answer passed.
    - ``solver``: name of the solver, how it ended, and its iterations.
    - ``time``: time that each part of the answer took [s].
    - ``warnings``: sentences about what is odd or unfinished, the messages of ``findings`` among
      them.
    - ``findings``: what is odd about the stance, each with its ``field`` in the request and the
      measured value.
    - ``unfinished``: what a deadline has left out, each with a warning: ``least_utilisation`` (not
      proven that no plan uses less), ``tie_break``, ``wrists``, ``least_effort``, ``load_factor``,
      ``path``, ``certificate``, ``explanation``, or what ``want`` names.
    - ``robust``: load factor over places of the hands near the given ones; only with ``"want":
      ["robust"]``, and not for a body wrench of zero.
    - ``open_loop``: utilisation over displaced hands if tensions and pose targets stay as planned;
      only with ``"want": ["open_loop"]``, and with a plan.
    - ``survival``: how likely it is that no tile slips, and that all hands hold if some do; only
      with ``"want": ["survival"]``, and with a plan.
    - ``spread``: Monte Carlo statistics over samples of uncertain parameters; only with ``"want":
      ["spread"]``.
    - ``clearance``: least distances of body, hands, links and rock; only with ``"want":
      ["clearance"]``.
    - ``com_region``: where the centre of mass may be; if in ``want``.
    - ``redundancy``: the plan without each tile, each finger and each hand; only with ``"want":
      ["redundancy"]``.
    - ``reliability``: probability that no tile slips, of tiles alone: no palms, no factors of holds
      and rock; only with the objective ``max_reliability``, where tiles are loaded and the limits
      can be kept.
    - ``advice``: verified changes of the request; only with ``"want": ["advice"]``. Changes that
      make the stance feasible come first, the smallest first; the rest follow by gain for their
      size.
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
    open_loop: OpenLoop | UnsetType = UNSET
    survival: Survival | UnsetType = UNSET
    spread: Spread | UnsetType = UNSET
    clearance: Clearance | UnsetType = UNSET
    redundancy: Redundancy | UnsetType = UNSET
    reliability: Reliability | UnsetType = UNSET
    com_region: ComRegionReply | UnsetType = UNSET
    margin_share: float | UnsetType = UNSET
    advice: list[Advice] | UnsetType = UNSET


class HandSetPoints(Struct):
    """Set-points of one hand: what a controller sends to its four tendons.

    With ``"detail": "set_points"`` a reply has ``limb``, ``tensions``, ``winch_angle`` and, for a
    wrist that moves, either ``pose_target`` or, where the stance gives no ``limb_stiffness``,
    ``twist``.

    - ``limb``: name of the limb that carries the hand.
    - ``tensions``: tensions of the four tendons [N].
    - ``winch_angle``: angles of the four winches from the open finger [rad].
    - ``motor_torque``: torques of the four motors [N·m].
    - ``motor_current``: currents of the four motors [A].
    - ``wrench``: force and moment of the hand on the rock, in H, about H's origin [N, N·m].
    - ``utilisation``: largest load over capacity of the hand's limits; only in a plan, not in a
      stream.
    - ``twist``: where a compliant or floating wrist goes, about the pose that was given [m, rad].
    - ``pose_target``: where a limb of the stance's ``limb_stiffness`` is to aim, as ``twist``.
    """

    limb: str
    tensions: Vector
    winch_angle: Vector
    motor_torque: Vector | UnsetType = UNSET
    motor_current: Vector | UnsetType = UNSET
    wrench: Vector | UnsetType = UNSET
    utilisation: float | UnsetType = UNSET
    twist: Vector | UnsetType = UNSET
    pose_target: Vector | UnsetType = UNSET


class BriefPlanReply(StanceReply, kw_only=True):
    """Plan with less detail: ``"detail"`` is ``set_points`` or ``hands``.

    Fields from ``body_wrench`` on, and ``poses``, are left out with ``set_points``. A
    ``set_points`` reply for four hands has less than 2,000 bytes of JSON, and less than 1,000 of
    MessagePack, whatever the status, beside the request's ``id``.

    - ``status``: ``optimal``, ``overloaded``, ``infeasible`` or ``failed``.
    - ``reason``: one sentence that says what limits the plan, or why there is none; cut to 120
      bytes with ``set_points``.
    - ``utilisation``: load over capacity of the limit that is used most; null without a plan.
    - ``limiting``: the limit that is used most; null without a plan.
    - ``hands``: set-points of each hand; null where nothing balances the body.
    - ``margin_share``: share of the margins that the plan keeps, from 0 to 1; only with
      ``limits.margins`` ``if_possible``, and with a plan.
    - ``verified``: true where the independent check of the answer passed.
    - ``unfinished``: what a deadline has left out, by name.
    - ``body_wrench``: wrench that the rock must exert on the robot, in B [N, N·m].
    - ``load_factor``: largest multiple of the body wrench that can be held at utilisation 1; null
      for the reasons in ``load_factor_status``.
    - ``load_factor_unbounded``: true where every multiple of the body wrench can be held.
    - ``load_factor_status``: ``found``, ``at_least``, ``unbounded``, ``none``, ``not_asked`` or
      ``not_finished``.
    - ``joints``: joint angles planned for, by limb, from the body outward [rad]; null where the
      request has no joints.
    - ``warnings``: sentences about what is odd or unfinished.
    - ``findings``: what is odd about the stance, each with its ``field`` in the request.
    - ``time``: time that each part of the answer took [s].
    """

    status: str
    reason: str
    utilisation: float | None = None
    limiting: LimitName | None = None
    hands: list[HandSetPoints] | None = None
    verified: bool
    unfinished: list[str] = []
    margin_share: float | UnsetType = UNSET
    body_wrench: Vector | UnsetType = UNSET
    load_factor: float | UnsetType | None = UNSET
    load_factor_unbounded: bool | UnsetType = UNSET
    load_factor_status: LoadFactorStatus | UnsetType = UNSET
    joints: dict[str, Vector] | UnsetType | None = UNSET
    warnings: list[str] | UnsetType = UNSET
    findings: list[Finding] | UnsetType = UNSET
    time: Time | UnsetType = UNSET


class RouteStageReply(Struct, kw_only=True):
    """One stance of a climb, with the outcome of its plan.

    - ``move``: number of the move, from one; zero for the start stance.
    - ``phase``: part of the move: ``start``, ``shift`` of the body, ``lift`` of the limb, or
      ``place`` of the hand on its next hold.
    - ``limb``: name of the limb that moves; null where none does.
    - ``status``: status of the stage's plan, or ``unreachable``.
    - ``utilisation``: load over capacity of the limit that is used most; null without a plan.
    - ``load_factor``: largest multiple of the body wrench that can be held at utilisation 1; null
      for the reasons in ``load_factor_status``.
    - ``load_factor_unbounded``: true where every multiple of the body wrench can be held.
    - ``load_factor_status``: ``found``, ``at_least``, ``unbounded``, ``none``, ``not_asked`` or
      ``not_finished``.
    - ``joint_utilisation``: largest joint torque over its limit; null where torques are not known.
    - ``limiting``: the limit that is used most; null without a plan.
    - ``reason``: one sentence that says what limits the plan, or why there is none.
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

    - ``name``: name of the route.
    - ``status``: status of the stage that is worst off: ``optimal``, ``overloaded``,
      ``infeasible``, ``unreachable`` or ``failed``, in this order.
    - ``crux``: index of the hardest stage in ``stages``, from zero.
    - ``utilisation``: utilisation of the hardest stage; null where that stage has no plan.
    - ``load_factor``: least load factor of all stages; null where a stage has none, or where all
      are unbounded.
    - ``load_factor_unbounded``: true where the load factor of every stage is unbounded.
    - ``load_factor_status``: status of the least load factor, in the words of a stage's.
    - ``limiting``: the limit that is used most at the hardest stage; null where that stage has no
      plan.
    - ``stages``: all stances in climbing order.
    - ``warnings``: sentences about what is odd about any stage, each once.
    - ``trajectory``: knots of the climb in order, up to the move that fails; left out unless
      wanted.
    - ``failure``: why the climb ends in the middle of a move; null where it runs from end to end,
      left out without ``trajectory``.
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
    trajectory: list[KnotReply] | UnsetType = UNSET
    failure: ClimbFailureReply | UnsetType | None = UNSET
