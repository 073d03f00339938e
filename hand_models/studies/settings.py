"""Settings of the studies that are used in several places, or that a coarse run reduces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["STUDY_SETTINGS", "StudySettings"]


@dataclass(frozen=True, slots=True)
class StudySettings:
    """Resolution of the studies' searches, and numbers of the paper that several studies use."""

    calibrate_sets: int = 30
    """Number of samples of the posterior to keep."""
    fig06_printed_gain: float = 0.14
    fig07_printed_gain: float = 0.24
    """Least relative gain of the maximum load by friction, with two tiles and with four in all 8
    configurations (Section 4.2).
    """
    fig07_tiles: int = 4
    fig10_seed: int = 10
    fig10_tiles: int = 4000
    """Seed of all random numbers, and number of tiles that are simulated for means and scatter."""
    fig12_points: int = 45
    """Number of points of each line, from no load to the figure's pull, and to the pull of slip."""
    fig13_pulls: int = 400
    fig14_pulls: int = 600
    """Number of directions of loads that are pulled until a tile exceeds a limit."""
    fig13_piece_directions: int = 48
    """Number of directions in which a list of linearised sets is made and tested."""
    fig13_supports: int = 2000
    """Number of directions in which support functions are compared, half of them with F_z < 0."""
    fig15_tensions: int = 29
    fig15_rays: int = 2000
    fig15_cuts: int = 12
    fig15_starts: int = 4
    """Number of tensions; of rays and cuts of each hull before its limits are sought; of starts of
    each search for a limit.
    """
    fig16_points: int = 16
    fig16_coarse_points: int = 6
    """Number of radii along an axis, at the printed tension and at the lower one.

    The latter are among the former: ``fig16_points - 1`` is a multiple of
    ``fig16_coarse_points - 1``.
    """


STUDY_SETTINGS: Final = StudySettings()
