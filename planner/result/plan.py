"""Answers to questions about a stance: a plan, and of a stream what tendons are to hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace
from planner.deadline import Unfinished
from planner.result.advice import Advice
from planner.result.certificate import CertificateOf
from planner.result.hand_plan import HandPlan
from planner.result.plain_parts import (
    Clearance,
    Finding,
    LimitName,
    LoadFactorStatus,
    Price,
    RobustLoadFactor,
    Solver,
    TensionPath,
    Time,
)
from planner.result.spread import Spread

__all__ = ["Certificate", "Plan", "SetPointSource", "SetPoints", "Status"]

Status = Literal["optimal", "overloaded", "infeasible", "failed"]
SetPointSource = Literal["interpolated", "blended", "solved"]


class Certificate(CertificateOf[Array, WrenchSpace], frozen=True, kw_only=True, eq=False):
    """Why there is no plan, as the planner finds it: arrays, and the hands' wrench spaces."""

    @property
    def spaces(self) -> Mapping[str, WrenchSpace]:
        """The hands' sets that are meant, by limb."""
        return self.wrench_spaces or {}


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """The answer. A value that does not exist for a status is None.

    Attributes
    ----------
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
    body_wrench : ndarray, shape (6,)
        The one planned for, in B.
    utilisation : float or None
    effort : float or None
        Sum of squared relative tendon tensions and joint torques of the limbs that hold on.
    load_factor : float or None
        Largest s for which s × body wrench has a plan with utilisation ≤ 1, if it was asked for and
        exists.
    load_factor_status : {'found', 'at_least', 'unbounded', 'none', 'not_asked', 'not_finished'}
        Whether it is there, and why not.
    load_factor_unbounded : bool
        Whether there is no end to such s.
    limiting : LimitName or None
        The limit with the largest utilisation.
    hands : tuple of HandPlan or None
        None where there is no balance.
    prices : tuple of Price or None
        What one more unit of each limit that binds would take off the utilisation.
    effort_prices : tuple of Price or None
        What it would take off the effort, where that is what is least; tensions and torques stay
        measured by the limits as they are.
    certificate : Certificate or None
        Why there is no plan, or none within the cap; None where that was not to be explained.
    residual : ndarray, shape (6,), or None
        Body wrench of the returned loads minus the one asked for.
    joints, joint_torque : mapping of str to ndarray, shape (n,), or None
        Of every limb [rad], [N·m]; None where the stance says nothing of joints, and of torques
        where there is no balance.
    joint_torque_limit : mapping of str to ndarray, shape (n,), or None
        What the joints bear: the caller's figures, or else the robot's [N·m]; zero for a joint
        without a motor. Of joints that slide this is a force, the torque too [N], and where they
        are a length [m].
    path : TensionPath or None
        The way from the present tensions; None where none were given, or there is no plan.
    verified : bool
        Whether the independent check passed.
    reason : str
        One sentence that a climber understands.
    warnings : tuple of str
        What is odd about the stance: the messages of its findings, hands that touch nothing. What a
        deadline has left unfinished.
    solver : Solver
    time : Time
    findings : tuple of Finding
        What is odd about the stance as a scene: is it meant?
    unfinished : tuple of str
        What a deadline has left unfinished, by name: see `planner.deadline.Unfinished`. Values that
        are missing for it are None.
    robust : RobustLoadFactor or None
        The load factor over a scatter of the hands' places, if it was asked for; None where the
        body wrench is zero, any multiple of which is the same.
    spread : Spread or None
        Utilisation and load factor over draws of the numbers, if it was asked for.
    clearance : Clearance or None
        The least distances, if they were asked for.
    advice : tuple of Advice or None
        What would make it hold, or hold more, if that was asked for: what
        holds first, the smallest change first of that; of the rest that of most gain for its size.
    """

    status: Status
    body_wrench: Array
    reason: str
    solver: Solver
    time: Time
    utilisation: float | None = None
    effort: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    limiting: LimitName | None = None
    hands: tuple[HandPlan, ...] | None = None
    prices: tuple[Price, ...] | None = None
    effort_prices: tuple[Price, ...] | None = None
    certificate: Certificate | None = None
    residual: Array | None = None
    joints: Mapping[str, Array] | None = None
    joint_torque: Mapping[str, Array] | None = None
    joint_torque_limit: Mapping[str, Array] | None = None
    path: TensionPath | None = None
    verified: bool = True
    warnings: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()
    unfinished: tuple[Unfinished, ...] = ()
    robust: RobustLoadFactor | None = None
    spread: Spread | None = None
    clearance: Clearance | None = None
    advice: tuple[Advice, ...] | None = None
    load_factor_status: LoadFactorStatus = "not_asked"

    @property
    def joint_shares(self) -> Mapping[str, Array] | None:
        """Each joint's torque over what it bears, shape (n,) by limb; None where it is not known.

        A joint without a motor, whose limit is zero, has none: 0.
        """
        torques, limits = self.joint_torque, self.joint_torque_limit
        if torques is None or limits is None:
            return None
        return {
            limb: np.divide(np.abs(torque), most, out=np.zeros(len(most)), where=most > 0.0)
            for limb, torque, most in ((limb, each, limits[limb]) for limb, each in torques.items())
        }

    @property
    def joint_utilisation(self) -> float | None:
        """Largest torque of a joint over what it bears; None where torques are not known."""
        shares = self.joint_shares
        return None if shares is None else max(float(np.max(each)) for each in shares.values())


@dataclass(frozen=True, eq=False, slots=True)
class SetPoints:
    """The tensions that tendons are to hold. Arrays are of all hands, in the stance's order.

    Attributes
    ----------
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
        As of a plan. Without a plan, all numbers but the wrench are None.
    body_wrench : ndarray, shape (6,)
        The one asked for, in B [N, N·m].
    verified : bool
        Whether the independent check passed, or the proof that there is no plan.
    utilisation : float or None
        The largest of all limits.
    gap : float or None
        The least utilisation of any plan is no more than this below: proven.
    tensions : ndarray, shape (hands, 4), or None
        [N]
    wrenches : ndarray, shape (hands, 6), or None
        Of hands on the rock, in H [N, N·m].
    loads : ndarray, shape (hands, m), or None
        y: `WrenchStream.columns` of each hand, then zeros [N].
    source : {'interpolated', 'blended', 'solved'}
        Mixed from plans known before; solved for this wrench alone; or a mixture of both.
    winch_angle : ndarray, shape (hands, 4), or None
        Where the winches are then, from the open finger [rad].
    motor_torque, motor_current : ndarray, shape (hands, 4), or None
        Of motors that tighten the tendons to their tensions [N·m], and what they draw then [A].
    reason : str or None
        Why there is no plan.
    """

    status: Status
    body_wrench: Array
    verified: bool
    utilisation: float | None = None
    gap: float | None = None
    tensions: Array | None = None
    wrenches: Array | None = None
    loads: Array | None = None
    source: SetPointSource = "solved"
    winch_angle: Array | None = None
    motor_torque: Array | None = None
    motor_current: Array | None = None
    reason: str | None = None
