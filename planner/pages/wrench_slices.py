"""Slices of a hand's wrench space through the force that a plan uses of it."""

from __future__ import annotations

from typing import Any, NamedTuple

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
        Corners of the forces that can be had with any other components: the projection [N]; m is
        zero for an empty space.
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
        Of a hand.
    used : ndarray, shape (6,)
        Wrench on the rock, in H [N, N·m].
    """
    plane, others = [0, 2], [1, 3, 4, 5]
    missing = ((used - space.origin) * WRENCH_SCALE)[others]
    fixed = (space.generators * WRENCH_SCALE[:, None])[others]
    held = _outline(space, plane, A_eq=fixed, b_eq=missing)
    whole = _outline(space, plane)
    return WrenchSlice(held, np.zeros((0, 2)) if whole is None else whole, used[plane])


def _outline(space: WrenchSpace, plane: list[int], **equations: Any) -> Array | None:
    """Return the corners, in a plane, of the wrenches whose loads meet equations; None if none."""

    def touching(normal: Array) -> SupportPoint | None:
        cost = -normal @ space.generators[plane]
        loads = linear_program(cost, space.A, space.b, "slice of a wrench space", **equations)
        return None if loads is None else SupportPoint(normal, space.wrench(loads)[plane])

    found = enclose(touching, 32)  # directions at most
    return None if found is None else found.inner
