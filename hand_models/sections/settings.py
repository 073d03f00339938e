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
    alike_sine: float = 1e-6
    """Sine of the angle between a finger's axis across and a hold's axis, up to which the rock is
    alike across the finger: over its width, 29 mm, the rock then rises by 29 nm at most."""
    envelope_rays: int = 180
    """Rays from the middle of a smooth hold's envelope to its outline, before there are more of
    them where a finger reaches."""
    envelope_spacing: float = 5e-4
    """Distance of points of the outline there, as on smoothed rock: between two of them a fillet of
    5 mm stands out by 6 μm [m]."""
    envelope_end: float = 1e3
    """Multiple of a finger's reach beyond which an outline ends: along a log it would go on until
    rounding lets the axis of the log slope, by 10¹⁵ m."""
    standing_out: float = 1e-4
    """Height by which rock beside the tiles stands out of the rock under them from which on it
    counts with its whole length [m]: a tile's bed is pressed in by 0.07 to 0.2 mm."""
    no_length: float = 1e-12
    """Length of what is no rock, or is there already [m]: next to nothing, but divides."""
    most_circles: int = 10
    """Largest number of circles fitted to an ellipse in turn; two or three are mostly enough."""
    last_turn: float = 1e-8
    """Change of a direction at which the iteration ends: the next is lost in rounding [rad]."""


SECTION_SETTINGS = SectionSettings()
