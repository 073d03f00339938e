"""Rows of all hands that hold a robot, in all their loads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from hand_models.base import Array, Pose, wrench_transport
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["HoldRows"]


class HoldRows(NamedTuple):
    """Rows of all hands that hold the robot, in all their loads y, shape (M,).

    Attributes
    ----------
    used : ndarray, shape (k, M)
        Change of the utilisation of each limit with the loads [1/N].
    hard, most : ndarray, shapes (n, M), (n,)
        Hard rows: hard y ≤ most.
    wrench : ndarray, shape (6, M)
        Wrench on the rock, with axes of W, about a point.
    passive : ndarray of bool, shape (M,)
        True for loads that are no tensions.
    """

    used: Array
    hard: Array
    most: Array
    wrench: Array
    passive: NDArray[np.bool_]

    @classmethod
    def of(cls, spaces: Sequence[WrenchSpace], poses: Sequence[Pose], origin: Array) -> Self:
        """Return the rows of hands.

        Parameters
        ----------
        spaces : sequence of WrenchSpace
            Set of each hand.
        poses : sequence of Pose
            Pose of each hand's H in W.
        origin : ndarray, shape (3,)
            Point about which moments are taken, in W [m].
        """
        ends = np.cumsum([0, *(len(space.columns) for space in spaces)]).tolist()
        limits = [len(space.s) for space in spaces]
        used = np.zeros((sum(limits), ends[-1]))
        hard = np.zeros((sum(len(space.h) for space in spaces), ends[-1]))
        row = below = 0
        wrench = []
        for space, pose, begin, end in zip(spaces, poses, ends[:-1], ends[1:], strict=True):
            used[row : row + len(space.s), begin:end] = space.L / space.s[:, None]
            hard[below : below + len(space.h), begin:end] = space.H
            row, below = row + len(space.s), below + len(space.h)
            about = Pose(pose.position - origin, pose.rotation)
            wrench.append(wrench_transport(about) @ space.generators)
        passive = [not name.endswith("/tension") for space in spaces for name in space.columns]
        most = np.concatenate([space.h for space in spaces])
        return cls(used, hard, most, np.hstack(wrench), np.array(passive))
