"""Pure forces of a hand: forces along a direction alone, every other component of the wrench zero.

The moment is about the origin of H, so the line of a pure force passes through the palm's centre.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["TRIAL_WAYS", "force_directions", "pure_reaches"]

TRIAL_WAYS: Final = {"-fz": 2, "-fx": 0, "+fx": 0, "-fy": 1, "+fy": 1}
"""Forces on the rock, in H, with their axes: the pull-off, and shear to all sides."""


def force_directions(ways: Sequence[str] = tuple(TRIAL_WAYS)) -> Array:
    """Return the directions of forces, shape (k, 6), by sign and axis such as ``-fz``."""
    axes = np.eye(6)[["xyz".index(way[-1]) for way in ways]]
    return np.asarray(axes * [[1.0 if way[0] == "+" else -1.0] for way in ways] + 0.0)


def pure_reaches(space: WrenchSpace, directions: ArrayLike) -> Array:
    """Return the largest t for which the wrench t·d is in a set at u = 1, by linear programming.

    Parameters
    ----------
    space : WrenchSpace
    directions : array_like, shape (k, 6)
        Directions d of wrenches on the rock, in H; opposite ones share their programs.

    Returns
    -------
    ndarray, shape (k,)
        [N] along unit forces. Negative where every such wrench is at least so much against d; NaN
        where the set has none.

    Raises
    ------
    SolverError
        If a linear program fails.
    """
    lines: dict[tuple[float, ...], tuple[float, float] | None] = {}
    found = []
    for way in np.atleast_2d(np.asarray(directions, dtype=float)):
        sign = -1.0 if way[np.flatnonzero(way)[:1]].sum() < 0.0 else 1.0
        line = tuple((sign * way + 0.0).tolist())
        if line not in lines:
            lines[line] = space.capability(line)
        ends = lines[line]
        found.append(np.nan if ends is None else max(sign * ends[0], sign * ends[1]))
    return np.array(found)
