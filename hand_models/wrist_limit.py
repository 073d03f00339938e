"""Where `hand_models.compliance` was before: an import of old keeps working."""

from hand_models.compliance import Farthest, farthest

__all__ = ["Farthest", "farthest"]
