"""Define the times, sizes and bounds by which a service is seen in ROS 2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["ROS_SETTINGS", "RosSettings"]


@dataclass(frozen=True, slots=True)
class RosSettings:
    """Times, sizes and bounds by which a service is seen in ROS 2."""

    diagnostics_period: float = 1.0
    """Time from one message on ``/diagnostics`` to the next [s]; ROS's viewers take a state for
    stale after 5 s."""
    recent: float = 60.0
    """Time for which a failure of the service is a warning [s]: a person looks so often."""
    declaration_pause: float = 1.0
    """Least time from one declaration of a lost stream to the next [s]: a service that is busy is
    not to be asked with each wrench."""
    force_scale: float = 1e-3
    """Length of an arrow per newton [m/N]: a hand's share of the weight, 270 N, is then about as
    long as a hand."""
    arrow_width: float = 0.006
    """Diameter of an arrow's shaft [m]: a third of a tile's width, so that tiles stay visible."""
    marker_thickness: float = 0.004
    """Thickness of drawn tiles and palms [m]: about that of the tiles."""
    cloud_bytes: int = 2**26
    """Largest point cloud that is taken [bytes]: 4 million points of 16 bytes, as much as a scan of
    a wall has; crux's own requests have the same bound."""
    rock_vertices: int = 150_000
    """Most vertices of rock that is made of a cloud; it is thinned to so many. Their triangles take
    some 11 MB in a request, and the declaration of a stream may have 16 MiB."""
    mesh_time: float = 180.0
    """Longest time in which a cloud becomes rock [s]; a million points took 7 s of processor time,
    and 38 s beside much other work."""
    subscriber_wait: float = 1.0
    """Time for which a climb that is to be played waits for a subscriber by ROS 2 [s]."""
    goals: int = 4
    """Largest number of goals in work; each search for a climb has a process of its own."""
    results: int = 16
    """Number of ended goals whose results are kept."""
    set_point_rate: float = 50.0
    """Least number of set-points in a second, if a goal names none [1/s]; as of `crux play`."""


ROS_SETTINGS: Final = RosSettings()
