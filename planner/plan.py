"""The answer to a question about a stance: data, as `planner.solve.plan` returns it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hand_models.floating_wrist import PalmMode
from hand_models.frames import Array
from hand_models.hand import Seating
from hand_models.spines import HalfPlane
from hand_models.wrench_space import WrenchSpace

__all__ = [
    "Certificate",
    "FingerPlan",
    "HandPlan",
    "LimitName",
    "PalmPlan",
    "Plan",
    "Price",
    "SolverInfo",
    "Status",
    "TileLoad",
    "Times",
    "WristPlan",
]

Status = Literal["optimal", "overloaded", "infeasible", "failed"]


@dataclass(frozen=True)
class LimitName:
    """A limit of one hand, by name.

    Attributes
    ----------
    limb : str
    finger, phalanx : str or None
        None where the limit is not a finger's, or not a tile's.
    limit : str
        What is limited: of a tile ``shear``, ``pull_off``; of a finger ``tendon_tension``,
        ``motor_torque``, ``motor_current``, ``finger_shear`` and, with its distal phalanx,
        ``fingertip_force``; of a hand ``palm_shear``, ``palm_pressing``, ``hand_load``; or a hard
        row's name.
    """

    limb: str
    finger: str | None
    phalanx: str | None
    limit: str


@dataclass(frozen=True)
class Price:
    """A limit that binds, and what one more unit of it would take off the utilisation.

    Attributes
    ----------
    name : LimitName
    price : float
        [1/unit]
    unit : str
        Of the limit's capacity: ``N``, ``N·m`` or ``A``.
    """

    name: LimitName
    price: float
    unit: str


@dataclass(frozen=True, eq=False)
class TileLoad:
    """One finger tile of a plan. Vectors in H, forces on the rock, SI units.

    Attributes
    ----------
    phalanx : str
        ``base``, ``proximal``, ``middle`` or ``distal``.
    contact : str
        ``face``, ``edge``, ``frame`` where its phalanx only presses beside it, or ``none`` where
        it touches nothing and carries nothing.
    position : ndarray, shape (3,)
    force : ndarray, shape (3,)
        shear·shear_axis + normal·normal_axis + lateral·lateral_axis.
    shear, normal, lateral : float
    shear_axis, normal_axis, lateral_axis : ndarray, shape (3,)
    utilisation : float
        Largest load over capacity of its half-planes; never below zero.
    load_at_zero : ndarray, shape (2,), or None
        Shear and normal load at zero tension [N]; None where the wrist floats.
    load_per_newton : ndarray, shape (2,), or None
        The same per newton of tension.
    half_planes : tuple of HalfPlane
    """

    phalanx: str
    contact: str
    position: Array
    force: Array
    shear: float
    normal: float
    lateral: float
    shear_axis: Array
    normal_axis: Array
    lateral_axis: Array
    utilisation: float
    load_at_zero: Array | None
    load_per_newton: Array | None
    half_planes: tuple[HalfPlane, ...]


@dataclass(frozen=True)
class FingerPlan:
    """One finger of a plan.

    Attributes
    ----------
    name : str
    tendon_tension : float
        [N]
    motor_torque, motor_current : float
        Of its motor while it tightens the tendon to that [N·m], [A].
    winch_angle : float
        From the open finger to that tension, of a floating hand to the preload at which the motor
        stands still [rad].
    tiles : tuple of TileLoad
        From the base outward.
    """

    name: str
    tendon_tension: float
    motor_torque: float
    motor_current: float
    winch_angle: float
    tiles: tuple[TileLoad, ...]


@dataclass(frozen=True, eq=False)
class PalmPlan:
    """The palm of a plan: where it acts and its force and moment on the rock, in H."""

    position: Array
    force: Array
    moment: Array
    engaged: tuple[int, ...]
    utilisation: float


@dataclass(frozen=True, eq=False)
class WristPlan:
    """Where the wrist of a floating hand goes.

    Attributes
    ----------
    twist : ndarray, shape (6,)
        ξ of H about its origin at rest [m, rad].
    palm : PalmMode
        How the palm carries: of the hand's sets, one for each, that which the plan is in.
    rounds : int
        How often all hands' sets were linearised.
    error : float
        How far the set before the last was off where the wrist went: forces, and moments over
        0.1 m [N]. The plan itself is exact.
    """

    twist: Array
    palm: PalmMode
    rounds: int
    error: float


@dataclass(frozen=True, eq=False)
class HandPlan:
    """One hand of a plan.

    Attributes
    ----------
    limb : str
    wrench : ndarray, shape (6,)
        On the rock, in H.
    fingers : tuple of FingerPlan
    palm : PalmPlan
    utilisation : float
    seating : Seating
        Where the hold is in H.
    space : WrenchSpace
        The set that the program used; of a floating hand linearised where its wrist goes.
    wrist : WristPlan or None
        None for a hand with a fixed wrist.
    """

    limb: str
    wrench: Array
    fingers: tuple[FingerPlan, ...]
    palm: PalmPlan
    utilisation: float
    seating: Seating
    space: WrenchSpace
    wrist: WristPlan | None = None


@dataclass(frozen=True, eq=False)
class Certificate:
    """Why no plan balances the body, checked without the solver.

    Attributes
    ----------
    direction : ndarray, shape (6,)
        d in B [1/N, 1/(N·m)], of unit length in the program's units of 300 N and 30 N·m: every body
        wrench w that the hands can give has ``d · w ≤ supremum``.
    supremum : float
        Of ``d · w`` over all loads up to 10⁶ N, at any utilisation.
    needed : float
        ``d · W`` of the body wrench W asked for; larger than ``supremum``.
    shortfall : ndarray, shape (6,)
        What is missing in B: the body wrench asked for minus the nearest that can be had.
    nearest : ndarray, shape (6,)
        That nearest body wrench.
    blocking : tuple of LimitName
        Hard rows that keep the hands from giving more; empty where no hand has anything at all to
        give in that direction.
    """

    direction: Array
    supremum: float
    needed: float
    shortfall: Array
    nearest: Array
    blocking: tuple[LimitName, ...]


@dataclass(frozen=True)
class SolverInfo:
    """Which solver ended how."""

    name: str
    status: str
    iterations: int


@dataclass(frozen=True)
class Times:
    """Where the time went [s]."""

    model: float
    solve: float
    total: float


@dataclass(frozen=True, eq=False)
class Plan:
    """The answer. A value that does not exist for a status is None.

    Attributes
    ----------
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
    body_wrench : ndarray, shape (6,)
        The one planned for, in B.
    utilisation : float or None
    load_factor : float or None
        Largest s for which s × body wrench has a plan with utilisation ≤ 1, if it was asked for and
        exists.
    load_factor_unbounded : bool
        Whether there is no end to such s.
    limiting : LimitName or None
        The limit with the largest utilisation.
    hands : tuple of HandPlan or None
        None where there is no balance.
    prices : tuple of Price or None
    certificate : Certificate or None
    residual : ndarray, shape (6,), or None
        Body wrench of the returned loads minus the one asked for.
    verified : bool
        Whether the independent check passed.
    reason : str
        One sentence that a climber understands.
    warnings : tuple of str
        What is odd about the stance: hands that touch nothing, or are out of reach.
    solver : SolverInfo
    time : Times
    """

    status: Status
    body_wrench: Array
    utilisation: float | None
    load_factor: float | None
    load_factor_unbounded: bool
    limiting: LimitName | None
    hands: tuple[HandPlan, ...] | None
    prices: tuple[Price, ...] | None
    certificate: Certificate | None
    residual: Array | None
    verified: bool
    reason: str
    warnings: tuple[str, ...]
    solver: SolverInfo
    time: Times
