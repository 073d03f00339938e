"""Tolerances of robot files and of inverse kinematics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["TOLERANCES", "RobotTolerances"]


@dataclass(frozen=True, slots=True)
class RobotTolerances:
    """Largest numbers that a robot's files may have, and the accuracy of inverse kinematics.

    A larger number in a file most often is in another unit.
    """

    frame_distance: float = 100.0  # [m] from a frame to its parent's
    angle: float = 100.0  # [rad] of a URDF
    link_mass: float = 1e5  # [kg]
    link_inertia: float = link_mass * frame_distance**2  # [kg·m²] a moment of it
    mount_distance: float = 10.0  # [m] of a hand in its link, or of a centre of mass
    link_radius: float = 1.0  # [m]
    joint_torque: float = 1e6  # [N·m]
    pose_error: float = 1e-9  # [1] of the limb's reach, or [rad], of a solved pose's components
    place_error: float = 1e-3  # [m] of a hand that counts as in its place
    axis_distance: float = 1e-9  # [m] from a joint's axis of a next joint that is on it


TOLERANCES: Final = RobotTolerances()
