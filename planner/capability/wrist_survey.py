"""Survey of the wrenches of a floating hand: by a search over wrist poses, and limits by axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hand_models.base import Array, EmptySetError
from hand_models.compliance import (
    PALM_MODES,
    Farthest,
    FloatingWrist,
    WristSearch,
    farthest,
    search,
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
        before moments: the farthest of the local maxima that start at the search's farthest
        wrenches. None if no search from there finds a feasible pose.
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
    per_axis : int
        Number of grid poses along each of six axes.
    progress : callable, optional
        Called with the number of steps done and the total.

    Returns
    -------
    Survey

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

    found = search(wrist, per_axis, lambda done, _: report(done))
    ends = []
    for i, direction in enumerate(directions):
        report(poses + i * each)
        ends.append(_end(wrist, found, direction))
    report(total)
    return Survey(found, tuple(ends))


def _end(wrist: FloatingWrist, found: WristSearch, direction: Array) -> Farthest | None:
    """Return the farthest limit that is reached, begun in each of the palm's ways of carrying."""
    reach = found.wrenches @ direction
    carries = wrist.hand.palm_loads(found.poses) > 0.0
    best: Farthest | None = None
    for (drags, presses), mode in PALM_MODES.items():
        those = np.flatnonzero((carries == (drags, presses)).all(axis=1))
        # a way of carrying whose farthest wrench is less than half as far is not tried
        if not len(those) or reach[those].max() < 0.5 * reach.max():
            continue
        start = found.poses[those[int(reach[those].argmax())]]
        try:
            there = farthest(replace(wrist, palm=mode), direction, start)
        except EmptySetError:
            continue
        if best is None or there.reach > best.reach:
            best = there
    return best
