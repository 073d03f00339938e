"""Survey of the wrenches of a floating hand: by a search over wrist poses, and limits by axis."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hand_models.base import Array, EmptySetError
from hand_models.compliance import (
    Farthest,
    FloatingWrist,
    WristSearch,
    farthest,
    search_grid,
)

__all__ = ["Survey", "survey"]


@dataclass(frozen=True, eq=False)
class Survey:
    """Wrenches that a floating hand can exert, found by search.

    Attributes
    ----------
    found : WristSearch
        Feasible wrist poses and extreme wrenches.
    ends : tuple of (Farthest or None), length 12
        Pose and wrench at which a limit is exceeded, along +x, −x, +y, … of hand frame H, forces
        before moments: a local maximum, searched for from the pose whose wrench reaches farthest.
        None if that search finds no feasible pose.
    """

    found: WristSearch
    ends: tuple[Farthest | None, ...]


def survey(
    wrist: FloatingWrist, per_axis: int, progress: Callable[[int, int], None] | None = None
) -> Survey:
    """Search the poses of a floating hand's wrist (Fig. 9), and find its limits along each axis.

    Parameters
    ----------
    wrist : FloatingWrist
        Model of the wrist, with its hand closed on its hold.
    per_axis : int
        Number of grid poses along each of six axes.
    progress : callable, optional
        Called with the number of steps done and the total.

    Returns
    -------
    Survey
        Feasible poses and wrenches, and the limit reached along each axis.

    Raises
    ------
    EmptySetError
        If no pose near rest is feasible.
    """
    directions = [sign * axis for axis in np.eye(6) for sign in (1.0, -1.0)]
    poses = per_axis**6
    each = max(1, poses // (2 * len(directions)))
    total = poses + each * len(directions)

    def report(done: int) -> None:
        if progress is not None:
            progress(done, total)

    found = search_grid(wrist, per_axis, lambda done, _: report(done))
    ends = []
    for i, direction in enumerate(directions):
        report(poses + i * each)
        ends.append(_end(wrist, found, direction))
    report(total)
    return Survey(found, tuple(ends))


def _end(wrist: FloatingWrist, found: WristSearch, direction: Array) -> Farthest | None:
    """Return the farthest limit that is reached, begun in each state of the palm."""
    reach = found.wrenches @ direction
    carries = wrist.hand_loads(found.poses).palm > 0.0
    starts, ends = [wrist.pressing], []
    for state in itertools.product((False, True), repeat=2):  # whether it drags, and presses
        those = np.flatnonzero((carries == state).all(axis=1))
        if len(those):
            starts.append(found.poses[those[int(reach[those].argmax())]])
    for start in starts:
        with contextlib.suppress(EmptySetError):
            ends.append(farthest(wrist, direction, start))
    return max(ends, key=lambda end: end.reach, default=None)
