"""Settings of sections that several modules use."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SECTION_SETTINGS"]


@dataclass(frozen=True, slots=True)
class SectionSettings:
    """Sizes and tolerances of the rock's sections."""

    points_per_circle: int = 16
    """Points of an outline in one bounding circle: 2 mm of rock for a finger's phalanges."""
    level_distance: float = 1e-4
    """A face whose ends are both this close to the rock at first contact lies flat [m]."""
    parallel_sine: float = 1e-3
    """Below this sine, a finger plane counts as parallel to the axis of an extruded hold."""
    fitted_length: float = 2e-3
    """Length of rock on each side of a contact to which a parabola is fitted to place it [m]."""
    most_circles: int = 10
    """Largest number of circles fitted to an ellipse in turn; two or three are mostly enough."""
    last_turn: float = 1e-8
    """Change of a direction at which the iteration ends: the next is lost in rounding [rad]."""


SECTION_SETTINGS = SectionSettings()
