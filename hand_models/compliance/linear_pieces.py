"""Wrench space of a compliant wrist as a union of linearised sets.

One linearisation at rest is valid near rest only. A few more, each about a limiting pose and for
poses near it, together cover the whole: the union's support function comes as close to the exact
set's as is asked, in the directions that were compared. A program that is linear in each set may
choose the best one for its objective.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, EmptySetError, Progress
from hand_models.compliance.directional_limit import farthest, linear_extreme
from hand_models.compliance.grasp import CompliantGrasp
from hand_models.compliance.grid_search import WristSearch, boundary
from hand_models.compliance.pose_box import search_box
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["Piece", "PieceList", "pieces"]


@dataclass(frozen=True, eq=False)
class Piece:
    """Wrench space linearised about a pose, for poses near it.

    Attributes
    ----------
    twist, within : ndarray, shape (d,)
        The pose of the wrist, and the largest change of each of its components for which the
        piece is used [m, rad].
    space : WrenchSpace
        The linearised set.
    """

    twist: Array
    within: Array
    space: WrenchSpace


@dataclass(frozen=True, eq=False)
class PieceList:
    """Linearised sets, and how closely their union approximates the exact wrench space.

    Attributes
    ----------
    pieces : tuple of Piece
        The one about rest first.
    directions : ndarray, shape (n, 6)
        Directions of the wrench in which support functions were compared.
    exact, covered : ndarray, shape (n,)
        Support function of the exact set and of the union, both less the product of the direction
        and the wrench at rest.
    """

    pieces: tuple[Piece, ...]
    directions: Array
    exact: Array
    covered: Array

    @property
    def error(self) -> float:
        """Largest relative difference between the union's support function and the exact one."""
        return float(np.abs(self.covered / self.exact - 1.0).max())


def pieces(
    grasp: CompliantGrasp,
    directions: ArrayLike,
    tolerance: float = 0.05,
    most: int = 64,
    progress: Progress | None = None,
) -> PieceList:
    """Return linearised sets whose union has nearly the support function of the exact wrench space.

    Parameters
    ----------
    grasp : CompliantGrasp
    directions : array_like, shape (n, 6)
        Directions of the wrench in which support functions are compared; the more there are, the
        better the tolerance holds between them.
    tolerance : float, optional
        Largest relative difference to aim for.
    most : int, optional
        Largest number of pieces.
    progress : callable, optional
        Called with the number of directions done and the number of all directions.

    Raises
    ------
    EmptySetError
        If no pose near rest is within every limit.
    """
    box = search_box(grasp)
    at = np.zeros(len(box.centre))
    half = np.abs(box.axes) @ box.range
    # rays of a search from whose ends limiting poses are sought
    rays = boundary(grasp, box, rays=1024)
    limits = _Limits(grasp, np.asarray(directions, dtype=float), rays)
    for i, pose in enumerate(limits.poses):
        if progress is not None:
            progress(i, len(limits.poses))
        limits.follow(i, pose)
    if progress is not None:
        progress(len(limits.poses), len(limits.poses))
    found: list[Piece] = []
    covered = np.full(len(limits.poses), -np.inf)
    while len(found) < most:
        piece, supports = _piece(limits, at, half, tolerance)
        found.append(piece)
        covered = np.maximum(covered, supports)
        worst = int(np.argmin(covered / limits.exact))
        enough = covered[worst] >= (1.0 - tolerance) * limits.exact[worst]
        if enough or np.array_equal(at, limits.poses[worst]):
            break
        at = limits.poses[worst].copy()
    return PieceList(tuple(found), limits.directions, limits.exact, covered)


class _Limits:
    """Limiting poses and supports in directions, from the wrench at rest: the best found so far."""

    def __init__(self, grasp: CompliantGrasp, directions: Array, seen: WristSearch) -> None:
        self.grasp = grasp
        self.directions = directions
        self.offset = directions @ grasp.evaluate(np.zeros((1, seen.poses.shape[1]))).wrenches[0]
        reaches = seen.wrenches @ directions.T
        self.poses = seen.poses[reaches.argmax(axis=0)]
        self.exact = np.asarray(reaches.max(axis=0) - self.offset)

    def follow(self, i: int, start: Array) -> None:
        """Look for a farther limit in a direction, from a pose on."""
        try:
            there = farthest(self.grasp, self.directions[i], start)
        except EmptySetError:
            return
        if there.reach - self.offset[i] > self.exact[i]:
            self.poses[i], self.exact[i] = there.twist, there.reach - self.offset[i]


def _piece(limits: _Limits, at: Array, half: Array, tolerance: float) -> tuple[Piece, Array]:
    """Return the widest piece about a pose that does not reach too far, and its supports.

    Where it seems to, the exact maximum is looked for again from there.
    """
    share, narrowest = 0.5, 0.02  # of the half widths of all that hold
    while True:
        within = share * half
        space = limits.grasp.linearised(at, within=within)
        supports = np.empty(len(limits.directions))
        for i, d in enumerate(limits.directions):
            pose, reach = linear_extreme(space, d)
            supports[i] = reach - limits.offset[i]
            if supports[i] > (1.0 + tolerance) * limits.exact[i] and pose is not None:
                limits.follow(i, pose)
        if share <= narrowest or (supports <= (1.0 + tolerance) * limits.exact).all():
            return Piece(at, within, space), supports
        share *= 0.6
