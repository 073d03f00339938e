"""Tolerances of joint motions, and of the search for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["MOTION_SETTINGS", "MotionSettings"]


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """Steps of joint motions, accuracy of distances, and the extent of searches."""

    largest_step: float = 0.2
    """Largest turn of a joint from a pose to the next one that is followed [rad]; an elbow that
    flips turns by more."""
    newton_steps: int = 12
    """Newton's steps from one pose to the next."""
    pose_error: float = 1e-11
    """Error of a pose that is followed, of the limb's reach [1] or [rad]."""
    slope_step: float = 1e-4
    """Difference quotient's step of how well a limb moves every way [rad]."""
    least_damping: float = 1e-12
    """Damping of a step, over the squares of reach and turn [1]: a stretched limb's is singular."""
    missed: float = 1e-6
    """Error of a pose beyond which a limb of few joints misses it, of its reach [1] or [rad]."""
    at_limit: float = 1e-3
    """Distance of a joint from its limit at which it counts as there [rad]."""
    singular: float = 0.02
    """Least singular value of a hand's Jacobian over the reach at which it is singular [1]."""
    finest: int = 10
    """Times that a step between two poses is halved before a branch counts as ended."""
    shift_steps: int = 8
    """Parts of a body's shift at which what is met is looked for where a limb cannot follow."""
    short_of: float = 0.98
    """Part of the way to a branch's end up to which the limb is followed to look for it."""
    point_spacing: float = 0.03
    """Largest distance of the points along a capsule from which rock is measured [m]; what it
    leaves out is taken off the distance."""
    farthest: float = 0.2
    """Distance up to which rock of triangles is measured, and capsules exactly [m]."""
    touch: float = 0.02
    """Distance of a palm from rock up to which a closed hand touches it [m]; a pinch leaves some
    millimetres."""
    alike: float = 0.2
    """Angle of the joint that differs most up to which two solutions count as one [rad]."""
    starts: int = 24
    """Random postures that solutions of a pose are searched from."""
    branch_steps: int = 25
    """Damped steps from each of them."""
    node_step: float = 0.5
    """Distance in joint space of the nodes of a search [rad]."""
    search_step: float = 0.04
    """Bound of the motion between two postures that a search looks at [m]."""
    tries: int = 200
    """Directions in which a search grows, of each of its trees."""
    first_tries: int = 40
    """Of them, for each end of a way alone, the nearest first, before all ends at once."""
    shortcuts: int = 40
    """Pairs of places on a way found that a straight line is tried between."""


MOTION_SETTINGS: Final = MotionSettings()
