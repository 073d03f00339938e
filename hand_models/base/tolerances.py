"""Base tolerances: differences that count as zero, unless a room has tolerances of its own."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["BASE_TOLERANCES", "BaseTolerances"]


@dataclass(frozen=True, slots=True)
class BaseTolerances:
    """Tolerances shared by all rooms (sub-packages), which use them directly or derive others."""

    length: float = 1e-9
    """A distance that is none [m]: far below any part of a hand, far above the rounding of it."""
    angle: float = 1e-9
    """A turn that is none [rad]: over the length of a hand it is less than `length`."""
    force: float = 1e-9
    """A force that is none [N]: far below what matters, and as exact as linear programs are."""
    relative: float = 1e-9
    """Share of a size up to which numbers count as equal that took many operations."""
    rounding: float = 1e-12
    """Share of its terms that a sum of a few may lose by rounding alone."""
    unit_norm: float = 1e-3
    """How far a quaternion's norm may be from one before it is refused: the contract's figure."""
    right_angle: float = 1e-3
    """How far two axes may be from right angles [rad]: what three digits of each may be off."""


BASE_TOLERANCES = BaseTolerances()
