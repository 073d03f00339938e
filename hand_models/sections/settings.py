"""Numbers of the room of sections that several of its modules, or other rooms, use."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["SECTION_SETTINGS"]


@dataclass(frozen=True, slots=True)
class SectionSettings:
    """Sizes and tolerances of what is cut of the rock."""

    points_per_circle: int = 16
    """Points of an outline that are looked for together: 2 mm of rock for a finger's phalanges."""
    level_distance: float = 1e-4
    """A face both of whose ends are this close to the rock when the first touches lies flat [m]."""
    parallel_sine: float = 1e-3
    """Below this sine, a finger plane counts as parallel to the axis of an extruded hold."""
    fitted_length: float = 2e-3
    """How far on both sides of a contact the rock is fitted with a parabola to place it [m]."""
    most_circles: int = 10
    """How many circles are fitted to an ellipse in turn; two or three are mostly enough."""
    last_turn: float = 1e-8
    """Change of a direction after which the next one would be lost in rounding [rad]."""


SECTION_SETTINGS = SectionSettings()
