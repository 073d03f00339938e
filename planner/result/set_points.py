"""What the tendons of a stance are to hold for a body wrench: one answer of a stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hand_models.base import Array
from hand_models.tendon import TendonDrive
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
    drive : TendonDrive or None
        Of all tendons.
    winches : ndarray, shape (2, hands, 4), or None
        Angles from the open finger without a tension [rad], and per newton of it.
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
    drive: TendonDrive | None = None
    winches: Array | None = None
    reason: str | None = None

    @property
    def winch_angle(self) -> Array | None:
        """Where the winches are then, from the open finger, shape (hands, 4) [rad]."""
        if self.tensions is None or self.winches is None:
            return None
        at_zero, per_newton = self.winches
        return np.asarray(at_zero + per_newton * self.tensions)

    @property
    def motor_torque(self) -> Array | None:
        """Of motors that tighten the tendons to their tensions, shape (hands, 4) [N·m]."""
        if self.tensions is None or self.drive is None:
            return None
        return self.tensions * self.drive.torque_per_newton

    @property
    def motor_current(self) -> Array | None:
        """What they draw then, shape (hands, 4) [A]."""
        if self.tensions is None or self.drive is None:
            return None
        return self.tensions * self.drive.current_per_newton + self.drive.no_load_current
