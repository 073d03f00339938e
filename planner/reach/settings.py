"""Numbers of the search for joint angles of many hand poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from planner.robots import TOLERANCES

__all__ = ["REACH_SETTINGS", "ReachSettings"]


@dataclass(frozen=True, slots=True)
class ReachSettings:
    """Starts and steps of the damped least squares, and what counts as solved and as alike."""

    postures: int = 20_000
    """Random postures of each limb among which starts are looked up."""
    axis_weight: float = 0.35
    """Reaches that an axis of a hand counts beside its position, where starts are looked up."""
    starts: int = 4
    """Starts of every pose in the first round."""
    more_starts: int = 20
    """Starts of the poses that the first round has not solved."""
    steps: int = 40
    """Damped steps from one start at most."""
    early_steps: int = 11
    """Steps after which the error must at least halve in each, as it does near a solution."""
    longest_step: float = 1.0
    """Largest turn of a joint in a step [rad]."""
    damping: float = 0.1
    """Damping over the squared error (Sugihara 2011)."""
    least_damping: float = 1e-12
    """Damping that is left at a solution, where a stretched limb's matrix is singular."""
    pose_error: float = TOLERANCES.pose_error
    """Error of a solved pose's components, of the limb's reach [1] or [rad]."""
    branches: int = 3
    """Solutions of a pose that are kept."""
    alike: float = 0.2
    """Angle of the joint that differs most up to which two solutions count as one [rad]."""
    at_once: int = 2000
    """Solutions whose capsules are measured in one call: 20 MB."""


REACH_SETTINGS: Final = ReachSettings()
