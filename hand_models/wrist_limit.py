"""Former place of `hand_models.compliance`: old imports keep working."""

from hand_models.compliance import Farthest, farthest

__all__ = ["Farthest", "farthest"]
