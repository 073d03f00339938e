"""A hand of a climb: one that opens, closes or is in the air; and any hand at a knot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, Pose, wrench_transport
from planner.question import ForceCap
from planner.result import LimitName

__all__ = ["HandKnot", "MovingHand"]


@dataclass(frozen=True, eq=False, kw_only=True)
class MovingHand:
    """A hand that opens, closes or is in the air, whose loads are given.

    Attributes
    ----------
    limb : str
    on_rock : bool
        Whether it touches its hold.
    tensions, winch_angles : ndarray, shape (4,)
        Tension [N] and winch angle [rad] of each tendon.
    wrench : ndarray, shape (6,)
        Wrench on the rock, in H [N, N·m].
    deviation : ndarray, shape (6,)
        How far the wrench may be from the straight line from the state before, each component
        [N, N·m].
    utilisation : float
        Largest load of its fingers over capacity.
    limiting : LimitName
        The limit of that load.
    """

    limb: str
    on_rock: bool
    tensions: Array
    winch_angles: Array
    wrench: Array
    deviation: Array
    utilisation: float
    limiting: LimitName

    def cap_use(self, cap: ForceCap, rotation: Array, body: Pose, beside: Array) -> float:
        """Return the share of a cap on its force that the hand has on its rock; none in the air.

        Parameters
        ----------
        cap : ForceCap
        rotation : ndarray, shape (3, 3)
            Axes of the hand frame H in the body frame B.
        body : Pose
            Pose of the body frame B in W.
        beside : ndarray, shape (3,)
            How far the force may be from the hand's, in H [N].
        """
        if not self.on_rock:
            return 0.0
        turn = np.eye(3) if cap.frame == "hand" else rotation
        if cap.frame == "world":
            turn = body.rotation @ turn
        force, around = turn @ self.wrench[:3], np.abs(turn) @ beside
        return cap.use(force.tolist(), around.tolist())


@dataclass(frozen=True, eq=False, kw_only=True)
class HandKnot:
    """A hand at a knot.

    Attributes
    ----------
    limb : str
    pose : Pose
        Pose of the hand frame H in the world frame W.
    on_rock : bool
        Whether the hand touches its hold.
    tensions, winch_angles : ndarray, shape (4,)
        Tension [N] and winch angle [rad] of each tendon.
    wrench : ndarray, shape (6,)
        Wrench of the hand on the rock, in H [N, N·m]; zero in the air.
    """

    limb: str
    pose: Pose
    on_rock: bool
    tensions: Array
    winch_angles: Array
    wrench: Array

    @property
    def wrench_in_world(self) -> Array:
        """Wrench of the rock on the hand, in W about its origin, shape (6,) [N, N·m]."""
        return -(wrench_transport(self.pose) @ self.wrench)
