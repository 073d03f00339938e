"""Pure forces of a hand: forces along a direction alone, every other component of the wrench zero.

The moment is about the origin of H, so the line of a pure force passes through the palm's centre.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["FORCE_TOLERANCE", "TRIAL_WAYS", "force_directions", "impossible_forces", "pure_reaches"]

TRIAL_WAYS: Final = {"-fz": 2, "-fx": 0, "+fx": 0, "-fy": 1, "+fy": 1}
"""Forces on the rock, in H, with their axes: the pull-off, and shear to all sides."""

FORCE_TOLERANCE: Final = 0.1
"""Smallest force that counts as held [N]: the weight of 10 g, far above what linear programs leave
undecided, and far below any load of a hand."""


def force_directions(ways: Sequence[str] = tuple(TRIAL_WAYS)) -> Array:
    """Return unit wrenches, shape (k, 6), along forces named by sign and axis, such as ``-fz``."""
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
        Largest t of each direction; for a d that is a unit force, in newtons. Negative if the set
        has multiples of d with negative t only; NaN if it has none at all.

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


def impossible_forces(
    pure: Mapping[str, float | None], support: Mapping[str, float | None]
) -> dict[str, str]:
    """Return which forces a hand cannot exert alone, with a sentence that says why.

    Parameters
    ----------
    pure : mapping of str to float or None
        Largest force with every other component zero, by `TRIAL_WAYS` [N]; None or NaN where the
        hand's wrench space has no such wrench.
    support : mapping of str to float or None
        Largest force whatever the other components, likewise.

    Returns
    -------
    dict of str to str
        Sentences by direction, such as ``-fz``; none for a direction along which the hand can pull
        or shear with at least `FORCE_TOLERANCE`.
    """
    found = {}
    for way in TRIAL_WAYS:
        alone, most = pure[way], support[way]
        if alone is not None and alone >= FORCE_TOLERANCE:
            continue
        sign, back = ("−", "+") if way[0] == "-" else ("+", "−")
        pulls = way == "-fz"
        force = "pull-off" if pulls else "force"
        deed = f"cannot {'pull' if pulls else 'shear'} along {sign}{way[-1]}"
        must = "pressed on" if pulls else f"loaded along {back}{way[-1]}"
        if most is None or np.isnan(most):
            found[way] = f"{deed}: closing alone is more than the hand's tiles hold"
        elif most < FORCE_TOLERANCE:
            why = f"whatever comes with it, the largest {force} is {_ends(most, must)}"
            found[way] = f"{deed}: {why}"
        elif alone is None or np.isnan(alone):
            found[way] = (
                f"{deed} alone: it takes other forces or moments with it; with any, the largest "
                f"{force} is {_ends(most, must)}"
            )
        else:
            found[way] = f"{deed} alone: the largest pure {force} is {_ends(alone, must)}"
    return found


def _ends(force: float, must: str) -> str:
    """Return a force in words, with what the hand must be if it is below zero."""
    newtons = f"{force:z.1f} N".replace("-", "−")
    return f"{newtons}: the hand must be {must}" if force <= -FORCE_TOLERANCE else newtons
