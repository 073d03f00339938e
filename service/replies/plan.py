"""The reply to who carries what: loads, margins and prices, or the proof that there are none."""

from __future__ import annotations

from msgspec import UNSET, Struct, UnsetType

from service.replies.hand import Hand
from service.replies.limits import LimitName, Price
from service.replies.reply import StanceReply, Time, Vector
from service.replies.wrench_set import WrenchSet

__all__ = [
    "Certificate",
    "PlanReply",
    "RobustLoadFactor",
    "Solver",
    "TensionPath",
]


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


class TensionPath(Struct, kw_only=True):
    """The straight way from the present tensions to the planned ones.

    ``safe_part``: how much of it balances the body within the cap on the utilisation, from the plan
    backward. ``utilisation_at_present``: the least at the present tensions, null if these balance
    the body at no utilisation. ``largest_change``: of a tension [N]. ``limiting``: the limits and
    hard rows that end the safe part, the weightiest first; of a plan beyond the cap those of which
    it uses most. Hard rows give by 1 mN on the way: no present tension is known better.
    """

    safe: bool
    safe_part: float
    utilisation_at_present: float | None
    largest_change: float
    limiting: list[LimitName] = []


class RobustLoadFactor(Struct, kw_only=True):
    """The load factor where the hands are not quite where they were put.

    All closed anew in so many ``draws`` of their places, each drawn apart, to either side by at
    most ``position`` along each axis of H [m] and ``angle`` about each [rad]; body, joints and H
    stay, so it is the rock that is elsewhere. ``without``: in so many of them a hand cannot be, or
    there is no load factor; ``refused``: in how many it cannot, by limb, where any. ``worst``: the
    least in the others; ``tenth``: what it exceeds in nine in ten of them; null if there are none.
    """

    draws: int
    without: int
    refused: dict[str, int]
    position: float
    angle: float
    seed: int
    worst: float | None
    tenth: float | None


class PlanReply(StanceReply, kw_only=True):
    """Who carries what, and what margin is left.

    ``effort``: the sum of squared relative tendon tensions and joint torques; where it is the
    objective, palms, lateral reactions and wrists count a little, too, so that there is one plan:
    it may so be a few tenths of a percent above the least. ``joints``: the
    angles planned for [rad], by limb, from the body outward; so are ``joint_torque`` and what the
    joints bear, ``joint_torque_limit`` [N·m]. ``effort_prices``: what one more unit of a limit
    would take off the effort, where the objective is ``min_effort``. ``unfinished``: what a
    deadline has left out, and a warning tells: ``least_utilisation`` (that no plan uses less is not
    proven), ``tie_break``, ``wrists``, ``least_effort``, ``load_factor``, ``path``,
    ``certificate``, ``explanation``, ``robust``. ``robust`` comes with ``"want": ["robust"]``, but
    not for a body wrench of zero.
    """

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
    robust: RobustLoadFactor | UnsetType = UNSET
