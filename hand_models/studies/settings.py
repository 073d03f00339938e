"""Numbers of the studies that are used in several places, or that a coarse run makes smaller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["STUDY_SETTINGS", "StudySettings"]


@dataclass(frozen=True, slots=True)
class StudySettings:
    """Resolution of the studies' searches, and numbers of the paper that several of them take."""

    calibrate_starts: int = 3
    """Starts of the search, the recorded set among them."""
    calibrate_evaluations: int = 2400
    calibrate_refits: int = 1000
    """Sets tried from each start, and where something is held or asked for more closely."""
    calibrate_sets: int = 30
    """Sets that meet the data, to be kept."""
    calibrate_spread: float = 0.06
    """First standard deviation of a search from a known set, in plausible ranges."""
    fig06_printed_gain: float = 0.14
    fig07_printed_gain: float = 0.24
    """Section 4.2: with two tiles, and with four in all 8 configurations, friction improves the
    maximum load by at least this."""
    fig07_tiles: int = 4
    fig10_seed: int = 10
    fig10_tiles: int = 4000
    """Seed of all random numbers, and tiles that are simulated for means and scatter."""
    fig12_points: int = 45
    """Points of the lines, from no load to the pull of the figure, and to slip."""
    fig13_pulls: int = 400
    fig14_pulls: int = 600
    """Directions of loads that are pulled until a tile lets go."""
    fig13_piece_directions: int = 48
    """Directions in which a list of linearised sets is made and tried."""
    fig13_supports: int = 2000
    """Directions in which supports are compared, half of them with F_z < 0."""
    fig15_tensions: int = 29
    fig15_rays: int = 2000
    fig15_cuts: int = 12
    fig15_starts: int = 4
    """Rays and cuts of each hull before its limits are sought; starts of each search for them."""
    fig16_points: int = 16
    fig16_coarse_points: int = 6
    """Radii along an axis, at the printed tension and at the lower one; the latter among the
    former: ``fig16_points - 1`` is a multiple of ``fig16_coarse_points - 1``."""

    @property
    def calibrate_looks(self) -> int:
        """Sets that are looked at on the fine hull."""
        return 3 * self.calibrate_sets


STUDY_SETTINGS: Final = StudySettings()
