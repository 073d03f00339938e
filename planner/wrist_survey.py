"""What a floating hand really holds: the search over poses of its wrist, and its limits by axis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from hand_models.errors import EmptySetError
from hand_models.floating_wrist import FloatingWrist, PalmMode
from hand_models.frames import Array
from hand_models.wrist_limit import Farthest, farthest
from hand_models.wrist_search import WristSearch, search

__all__ = ["Survey", "survey"]

MODES: Final[dict[tuple[bool, bool], PalmMode]] = {
    (False, False): "off",
    (True, False): "drags",
    (False, True): "presses",
    (True, True): "drags_and_presses",
}


@dataclass(frozen=True, eq=False)
class Survey:
    """A floating hand's wrenches, found by search.

    Attributes
    ----------
    found : WristSearch
    ends : tuple of (Farthest or None), length 12
        Where the hand lets go along + and − each axis of H in turn, begun at the search's farthest
        wrench; None where no way from there holds.
    """

    found: WristSearch
    ends: tuple[Farthest | None, ...]


def survey(
    wrist: FloatingWrist, per_axis: int, progress: Callable[[int, int], None] | None = None
) -> Survey:
    """Search the poses of a hand's wrist (Fig. 9), and follow its limits along the axes.

    Parameters
    ----------
    wrist : FloatingWrist
    per_axis : int
        Poses along each of the six axes of the search.
    progress : callable, optional
        Told how many poses are done, of how many.

    Raises
    ------
    EmptySetError
        If no pose near rest holds.
    """
    found = search(wrist, per_axis, progress)
    ends = [_end(wrist, found, sign * axis) for axis in np.eye(6) for sign in (1.0, -1.0)]
    return Survey(found, tuple(ends))


def _end(wrist: FloatingWrist, found: WristSearch, direction: Array) -> Farthest | None:
    pose = found.poses[int((found.wrenches @ direction).argmax())]
    drags, presses = wrist.hand.palm_loads(pose[None])[0] > 0.0
    try:
        return farthest(replace(wrist, palm=MODES[bool(drags), bool(presses)]), direction, pose)
    except EmptySetError:
        return None
