"""What the tendons of a stance are to hold for a body wrench: one answer of a stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hand_models.base import Array
from planner.result.plan import Status

__all__ = ["SetPointSource", "SetPoints"]

SetPointSource = Literal["interpolated", "blended", "solved"]


@dataclass(frozen=True, eq=False, slots=True)
class SetPoints:
    """What tendons are to hold. Arrays are of all hands, in the stance's order.

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
