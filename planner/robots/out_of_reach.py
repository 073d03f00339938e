"""What a pose that no joint angles give lacks: the turn at its place, or the way with its axes.

Two least-squares problems in the joint angles, from several starts: the hand is put in its place
and turned as far as that lets it; or it is turned as asked and brought as near as that lets it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hand_models.base import Array, Pose
from planner.robots.kinematics import RobotModel

__all__ = ["PLACED", "TURNED", "PoseShortfall", "pose_shortfall"]

FIRST: Final = 300.0
"""How much heavier what comes first counts than what comes second."""

STEPS: Final = 40
"""Most steps from a start."""

PLACED: Final = 1e-3
"""Distance up to which a hand counts as in its place [m]."""

TURNED: Final = 2e-3
"""Angle up to which it counts as turned as asked [rad]."""


SMALL: Final = 1e-4
"""Angle below which a rotation's higher powers are nil [rad]."""


class PoseShortfall(NamedTuple):
    """How near a hand comes to a pose that is out of its reach.

    Attributes
    ----------
    place, turn : float
        Errors of the hand brought to its place first [m], [rad].
    way, askew : float
        Errors of the hand turned as asked first [m], [rad].
    """

    place: float
    turn: float
    way: float
    askew: float


def pose_shortfall(
    model: RobotModel, limb: str, pose: Pose, starts: Sequence[Array]
) -> PoseShortfall:
    """Return how near a limb's hand comes to a pose, from several starts.

    Parameters
    ----------
    model : RobotModel
    limb : str
    pose : Pose
        H in B.
    starts : sequence of ndarray, shape (n,)
        Joint angles [rad].
    """
    low, high = model.lower[limb], model.upper[limb]

    def errors(angles: Array) -> tuple[Array, Array]:
        there = model.hand_poses({limb: angles})[limb]
        turn = Rotation.from_matrix(there.rotation.T @ pose.rotation).as_rotvec()
        return pose.position - there.position, turn

    def slopes(angles: Array) -> tuple[Array, Array]:
        there = model.hand_poses({limb: angles})[limb]
        jacobian = model.jacobians({limb: angles})[limb]
        turn = Rotation.from_matrix(there.rotation.T @ pose.rotation).as_rotvec()
        return -there.rotation @ jacobian[:3], -_turning(turn) @ jacobian[3:]

    def nearest(place: float, turn: float) -> tuple[float, float]:
        """Return the errors where their weighted sum of squares is least."""

        def weighed(angles: Array) -> Array:
            off, askew = errors(angles)
            return np.concatenate([place * off, turn * askew])

        def slope(angles: Array) -> Array:
            off, askew = slopes(angles)
            return np.vstack([place * off, turn * askew])

        ends = [
            least_squares(
                weighed, np.clip(start, low, high), slope, bounds=(low, high), max_nfev=STEPS
            )
            for start in starts
        ]
        off, askew = errors(min(ends, key=lambda end: float(end.cost)).x)
        return float(np.linalg.norm(off)), float(np.linalg.norm(askew))

    place, turn = nearest(FIRST, 1.0)
    way, askew = nearest(1.0, FIRST)
    return PoseShortfall(place, turn, way, askew)


def _turning(turn: Array) -> Array:
    """Return how a rotation vector r changes with a rotation before it: Jₗ⁻¹(r), shape (3, 3).

    Solà, Deray, Atchuthan, *A micro Lie theory for state estimation in robotics*, Eq. 146.
    """
    angle = float(np.linalg.norm(turn))
    x, y, z = turn
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < SMALL:
        return np.asarray(np.eye(3) - 0.5 * cross)
    part = 1.0 / angle**2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
    return np.asarray(np.eye(3) - 0.5 * cross + part * cross @ cross)
