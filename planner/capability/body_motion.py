"""What a stance's programs need of the body's acceleration: how the balance and joint rows change.

The wrench that accelerates a robot whose joints stand still is affine in the acceleration, and so
are its joints' torques: one column for each component says all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from hand_models.base import Array
from planner.explanation import joint_name
from planner.prepare import Posture, posture_at
from planner.question import Question
from planner.result import LimitName

__all__ = ["Motion", "motion_of"]

Vector = tuple[float, float, float]

NONE: Final[Vector] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Motion:
    """How the body's acceleration in W enters, k components: three linear, and three angular.

    Attributes
    ----------
    wrench : ndarray, shape (6, k)
        Body wrench for one unit of each component [kg, kg·m, kg·m²].
    torque : mapping of LimitName to ndarray, shape (k,)
        By joint: its torque [N·m] for one unit of each.
    asked : ndarray, shape (k,)
        The acceleration that the question plans for [m/s², rad/s²].
    """

    wrench: Array
    torque: dict[LimitName, Array]
    asked: Array

    @property
    def angular(self) -> bool:
        """Whether angular accelerations are known as well."""
        return bool(self.wrench.shape[1] == 6)


def motion_of(question: Question, where: Posture | None) -> Motion | None:
    """Return how acceleration enters a question; None if its body wrench is given.

    Angular acceleration is known only for the robot's own weight at known joints.
    """
    if question.body_wrench is not None:
        return None
    load = question.load
    count = 6 if where is not None and load.own else 3
    rest_wrench, rest_torque = _statics(question, where, np.zeros(6))
    columns = [_statics(question, where, unit) for unit in np.eye(6)[:count]]
    return Motion(
        wrench=np.column_stack([wrench - rest_wrench for wrench, _ in columns]),
        torque={
            name: np.array([torque[name] - at_rest for _, torque in columns])
            for name, at_rest in rest_torque.items()
        },
        asked=np.array([*load.acceleration, *load.angular_acceleration])[:count],
    )


def _statics(
    question: Question, where: Posture | None, acceleration: Array
) -> tuple[Array, dict[LimitName, float]]:
    """Return the body wrench of an acceleration (6,) and each joint's torque without hands."""
    load = replace(
        question.load,
        acceleration=_vector(acceleration[:3]),
        angular_acceleration=_vector(acceleration[3:]),
    )
    moving = replace(question, load=load)
    if where is None:
        return moving.needed_wrench(), {}
    there = posture_at(moving, where.angles)
    torque = {
        joint_name(limb, joint): float(value)
        for limb, joints in there.joints.items()
        for joint, value in zip(joints.names, joints.gravity, strict=True)
    }
    return moving.needed_wrench(there.body_wrench), torque


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
