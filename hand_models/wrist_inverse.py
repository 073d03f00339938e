"""Where `hand_models.compliance` was before: an import of old keeps working."""

from hand_models.compliance import WristPose, wrist_pose

__all__ = ["WristPose", "wrist_pose"]
