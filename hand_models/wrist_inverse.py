"""Former place of `hand_models.compliance`: old imports keep working."""

from hand_models.compliance import WristPose, wrist_pose

__all__ = ["WristPose", "wrist_pose"]
