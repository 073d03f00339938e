"""Answers to questions about a stance: a plan, and tension set-points for a stream of wrenches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace
from planner.deadline import Unfinished
from planner.question import LostTile
from planner.result.advice import Advice
from planner.result.certificate import CertificateOf
from planner.result.hand_plan import HandPlan, WristPlan
from planner.result.open_loop import OpenLoop
from planner.result.plain_parts import (
    Clearance,
    Finding,
    LimitName,
    LoadFactorStatus,
    Price,
    Reliability,
    Solver,
    Status,
    TensionPath,
    Time,
)
from planner.result.robust_load_factor import RobustLoadFactor
from planner.result.spread import Spread

__all__ = ["Certificate", "Plan", "SetPointSource", "SetPoints", "Status"]

SetPointSource = Literal["interpolated", "blended", "solved"]


class Certificate(CertificateOf[Array, WrenchSpace], frozen=True, kw_only=True, eq=False):
    """Infeasibility certificate of the planner: why there is no plan, in arrays and spaces."""

    @property
    def spaces(self) -> Mapping[str, WrenchSpace]:
        """Wrench spaces to which the certificate refers, by limb; empty if no hand has a part."""
        return self.wrench_spaces or {}


@dataclass(frozen=True, eq=False, kw_only=True)
class Plan:
    """Verified loads of all hands and tensions of all tendons: the answer to a question.

    A value that does not exist for a status is None.

    Attributes
    ----------
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
        Whether there is a plan within the cap, one beyond it, none, or no answer.
    body_wrench : ndarray, shape (6,)
        Body wrench that is planned for, in the body frame B [N, N·m].
    utilisation : float or None
        Largest load over capacity of all limits.
    effort : float or None
        Sum of squared relative tendon tensions and joint torques, of limbs whose hands are on rock.
    load_factor : float or None
        Largest s for which s × body wrench has a plan with utilisation ≤ 1; None if it was not
        asked for or does not exist.
    load_factor_status : {'found', 'at_least', 'unbounded', 'none', 'not_asked', 'not_finished'}
        Whether the load factor was found; if not, why.
    load_factor_unbounded : bool
        True if every multiple s has such a plan.
    limiting : LimitName or None
        The limit with the largest utilisation.
    hands : tuple of HandPlan or None
        Loads of each hand; None if nothing balances the body.
    prices : tuple of Price or None
        Shadow prices of the active limits: decrease of the utilisation per unit more of a limit.
    effort_prices : tuple of Price or None
        Decrease of the effort per unit more of a limit, if the objective is the effort. Relative
        tensions and torques still refer to the unchanged limits.
    reliability : Reliability or None
        Hazard and probability of no slip, if the objective is the hazard.
    certificate : Certificate or None
        Infeasibility certificate; None if there is a plan within the cap, or no explanation was
        asked for.
    residual : ndarray, shape (6,), or None
        Body wrench of the returned loads minus the one that is planned for, in B [N, N·m].
    joints, joint_torque : mapping of str to ndarray, shape (n,), or None
        Joint angles [rad] and torques [N·m] of every limb, by limb; of prismatic joints [m] and
        [N]. None if the stance gives no joints; torques also if nothing balances the body.
    joint_torque_limit : mapping of str to ndarray, shape (n,), or None
        Torque limits of the joints: the question's, else the robot's [N·m]; of prismatic joints
        [N]. Zero for a joint without a motor.
    path : TensionPath or None
        Path from the present tensions to the plan; None if no present tensions were given, or there
        is no plan.
    verified : bool
        Whether the independent check passed.
    reason : str
        One sentence that explains the status.
    warnings : tuple of str
        Messages of ``findings``, hands that touch nothing, and what a deadline left unfinished.
    solver : Solver
        Solver of the plan's program, with its status.
    time : Time
        Time that the answer took, by parts.
    findings : tuple of Finding
        What is odd about the stance as a scene, and may be a mistake.
    unfinished : tuple of str
        Names of the parts that a deadline left unfinished, and whose values are therefore None: see
        `planner.deadline.Unfinished`.
    robust : RobustLoadFactor or None
        Load factor over random placements of the hands, if asked for; None if the body wrench is
        zero, as all its multiples are the same.
    open_loop : OpenLoop or None
        Utilisation over displaced hands if the plan is executed as it is, if asked for; None
        without a plan.
    spread : Spread or None
        Utilisation and load factor over Monte Carlo samples of parameters, if asked for.
    clearance : Clearance or None
        Least distances between hands, links, body and rock, if asked for.
    margin_share : float or None
        Share of the margins that the plan keeps, from 0 to 1, if it is to keep them if possible;
        None without a plan.
    advice : tuple of Advice or None
        Changes that would make the stance feasible or lower its utilisation, if asked for. First
        the changes that make it feasible, the smallest first; then those with most gain for their
        size.
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
    reliability: Reliability | None = None
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
    open_loop: OpenLoop | None = None
    spread: Spread | None = None
    clearance: Clearance | None = None
    advice: tuple[Advice, ...] | None = None
    load_factor_status: LoadFactorStatus = "not_asked"
    margin_share: float | None = None

    @property
    def joint_shares(self) -> Mapping[str, Array] | None:
        """Torque over torque limit of each joint, shape (n,) by limb; None if no torques are known.

        Zero for a joint without a motor, whose limit is zero.
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
        """Largest ratio of torque to torque limit over all joints; None if no torques are known."""
        shares = self.joint_shares
        return None if shares is None else max(float(np.max(each)) for each in shares.values())


@dataclass(frozen=True, eq=False, slots=True)
class SetPoints:
    """Set-points of all tendons and wrists for one body wrench; hands in the stance's order.

    Attributes
    ----------
    status : {'optimal', 'overloaded', 'infeasible', 'failed'}
        Status as of a `Plan`. Without a plan, all numbers but the wrench are None.
    body_wrench : ndarray, shape (6,)
        Body wrench that is planned for, in B [N, N·m].
    verified : bool
        Whether the independent check of the plan, or of the infeasibility certificate, passed.
    utilisation : float or None
        Largest utilisation of all limits.
    gap : float or None
        Proven bound on how much lower the utilisation of another plan can be. With compliant
        wrists it covers plans nearby only: those in the sets linearised at the wrists' poses.
    tensions : ndarray, shape (hands, 4), or None
        Tendon tensions [N].
    wrenches : ndarray, shape (hands, 6), or None
        Wrench of each hand on the rock, in H [N, N·m].
    loads : ndarray, shape (hands, m), or None
        Loads y of each hand, in the order of `WrenchStream.columns`, then zeros [N]; those of a
        compliant wrist include its twist [m, rad].
    source : {'interpolated', 'blended', 'solved'}
        ``interpolated``: from known plans; ``solved``: for this wrench alone; ``blended``: a
        mixture of both.
    winch_angle : ndarray, shape (hands, 4), or None
        Angles of the winches at these tensions, from the open finger [rad].
    motor_torque, motor_current : ndarray, shape (hands, 4), or None
        Torque [N·m] and current [A] of each motor while it tightens its tendon to the tension.
    reason : str or None
        Why there is no plan, or which limit an overloaded one exceeds most.
    wrists : tuple of WristPlan or None, or None
        Planned pose of each compliant wrist, None of a fixed one; None where all are fixed.
    lost : tuple of LostTile
        Tiles that have slipped, without which the set-points do.
    released : tuple of (str, str)
        Limb and finger of each finger that the set-points take off the rock, as tiles of it have
        slipped: its tendon is slack.
    save_first : str or None
        Limb of the hand on whose limits the overload after slips depends most; None where there is
        a plan within the cap, or nothing has slipped.
    findings : tuple of Finding
        What is odd about the body wrench: its unit, or its direction.
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
    wrists: tuple[WristPlan | None, ...] | None = None
    lost: tuple[LostTile, ...] = ()
    released: tuple[tuple[str, str], ...] = ()
    save_first: str | None = None
    findings: tuple[Finding, ...] = ()
