"""Slices of a hand's wrench space through the force that a plan uses of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hand_models.base import Array
from hand_models.wrench_spaces import WRENCH_SCALE, WrenchSpace, linear_program
from planner.capability import SupportPoint, enclose

__all__ = ["WrenchSlice", "wrench_slice"]


class WrenchSlice(NamedTuple):
    """Forces along x and z of H that a hand can exert on the rock, and the one that it does.

    Attributes
    ----------
    held : ndarray, shape (n, 2), or None
        Corners of the forces that can be had with the other four components of the wrench as they
        are used, counterclockwise [N]; None where there are none within the limits.
    whole : ndarray, shape (m, 2)
        Corners of the forces that can be had with any other components: the projection [N].
    used : ndarray, shape (2,)
        The force that is used [N].
    """

    held: Array | None
    whole: Array
    used: Array


def wrench_slice(space: WrenchSpace, used: Array) -> WrenchSlice:
    """Return the slice of a wrench space at utilisation 1 through a wrench, and its projection.

    Parameters
    ----------
    space : WrenchSpace
        Wrench space that is not empty.
    used : ndarray, shape (6,)
        Wrench on the rock, in H [N, N·m].
    """
    plane, others = [0, 2], [1, 3, 4, 5]
    scaled = space.generators * WRENCH_SCALE[:, None]
    missing = ((used - space.origin) * WRENCH_SCALE)[others]

    def beside(normal: Array) -> SupportPoint | None:
        cost = -normal @ space.generators[plane]
        equations = {"A_eq": scaled[others], "b_eq": missing}
        loads = linear_program(cost, space.A, space.b, "slice of a wrench space", **equations)
        return None if loads is None else SupportPoint(normal, space.wrench(loads)[plane])

    def beyond(normal: Array) -> SupportPoint:
        direction = np.zeros(6)
        direction[plane] = normal
        return SupportPoint(normal, space.extreme(direction)[plane])

    # directions that are asked for, at most
    held, whole = enclose(beside, 32), enclose(beyond, 32)
    corners = np.zeros((0, 2)) if whole is None else whole.inner
    return WrenchSlice(None if held is None else held.inner, corners, used[plane])
