"""A floating wrist's wrench space as a list of linearised sets.

One linearisation at rest is right near rest only. A few more, each at a pose where a wrench is
limiting and each for the poses about it, together cover the whole: the union of the list comes as
close to the exact set's support function as is asked, in the directions that were looked at. A
program that is linear in each set may choose the one that serves it best.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from hand_models.base import Array, EmptySetError, Progress
from hand_models.compliance.directional_limit import farthest, linear_extreme
from hand_models.compliance.grasp import CompliantGrasp
from hand_models.compliance.grid_search import WristSearch, boundary
from hand_models.compliance.pose_box import search_box
from hand_models.wrench_spaces import WrenchSpace

__all__ = ["Piece", "PieceList", "pieces"]

RAYS: Final = 1024
"""Of the search that limiting poses are looked for from."""

SHRINK: Final = 0.6
WIDEST: Final = 0.5
NARROWEST: Final = 0.02
"""The box of poses about a piece's, in half widths of all that hold: shrunk until it does not
reach beyond what holds."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A set linearised at a pose, for poses about it.

    Attributes
    ----------
    twist, within : ndarray, shape (d,)
        The pose, and how far from it each component may go [m, rad].
    space : WrenchSpace
    """

    twist: Array
    within: Array
    space: WrenchSpace


@dataclass(frozen=True, eq=False)
class PieceList:
    """Pieces, and how well their union stands for the exact set.

    Attributes
    ----------
    pieces : tuple of Piece
        The one at rest first.
    directions : ndarray, shape (n, 6)
        In which supports were compared.
    exact, covered : ndarray, shape (n,)
        Support of the exact set and of the union, both from the wrench at rest.
    """

    pieces: tuple[Piece, ...]
    directions: Array
    exact: Array
    covered: Array

    @property
    def error(self) -> float:
        """The largest relative difference of supports."""
        return float(np.abs(self.covered / self.exact - 1.0).max())


def pieces(
    grasp: CompliantGrasp,
    directions: ArrayLike,
    tolerance: float = 0.05,
    most: int = 64,
    progress: Progress | None = None,
) -> PieceList:
    """Return linearised sets whose union has the exact set's support function.

    Parameters
    ----------
    grasp : CompliantGrasp
    directions : array_like, shape (n, 6)
        In which supports are compared; the more, the surer that others agree as well.
    tolerance : float, optional
        Largest relative difference that is aimed at.
    most : int, optional
        Pieces at most.
    progress : callable, optional
        Told how many directions have their exact limit, of how many.

    Raises
    ------
    EmptySetError
        If no pose near rest holds.
    """
    towards = np.asarray(directions, dtype=float)
    box = search_box(grasp)
    rest = np.zeros(len(box.centre))
    offset = towards @ grasp.evaluate(rest[None]).wrenches[0]
    half = np.abs(box.axes) @ box.range
    seen = boundary(grasp, box, RAYS)
    poses, exact = [], np.empty(len(towards))
    for i, d in enumerate(towards):
        if progress is not None:
            progress(i, len(towards))
        pose, reach = _exact(grasp, d, seen)
        poses.append(pose)
        exact[i] = reach - offset[i]
    if progress is not None:
        progress(len(towards), len(towards))
    found: list[Piece] = []
    covered = np.full(len(towards), -np.inf)
    at = rest
    while len(found) < most:
        piece, supports = _piece(grasp, at, half, towards, offset, poses, exact, tolerance)
        found.append(piece)
        covered = np.maximum(covered, supports)
        worst = int(np.argmin(covered / exact))
        if covered[worst] >= (1.0 - tolerance) * exact[worst] or np.array_equal(at, poses[worst]):
            break
        at = poses[worst]
    return PieceList(tuple(found), towards, exact, covered)


def _exact(grasp: CompliantGrasp, d: Array, seen: WristSearch) -> tuple[Array, float]:
    """Return the limiting pose in a direction and its reach: the best of those seen, and beyond."""
    best = int((seen.wrenches @ d).argmax())
    pose, reach = seen.poses[best], float(d @ seen.wrenches[best])
    try:
        there = farthest(grasp, d, pose)
    except EmptySetError:
        return pose, reach
    return (there.twist, there.reach) if there.reach > reach else (pose, reach)


def _piece(
    grasp: CompliantGrasp,
    at: Array,
    half: Array,
    directions: Array,
    offset: Array,
    poses: list[Array],
    exact: Array,
    tolerance: float,
) -> tuple[Piece, Array]:
    """Return the widest piece about a pose that does not reach too far, and its supports.

    Where it seems to, the exact maximum is looked for again from there; ``poses`` and ``exact`` are
    mended in place if it is found.
    """
    share = WIDEST
    while True:
        within = share * half
        space = grasp.linearised(at, within=within)
        supports = np.empty(len(directions))
        for i, d in enumerate(directions):
            pose, reach = linear_extreme(space, d)
            supports[i] = reach - offset[i]
            if supports[i] > (1.0 + tolerance) * exact[i] and pose is not None:
                _mend(grasp, d, pose, i, offset, poses, exact)
        if share <= NARROWEST or (supports <= (1.0 + tolerance) * exact).all():
            return Piece(at, within, space), supports
        share *= SHRINK


def _mend(
    grasp: CompliantGrasp,
    d: Array,
    start: Array,
    i: int,
    offset: Array,
    poses: list[Array],
    exact: Array,
) -> None:
    try:
        there = farthest(grasp, d, start)
    except EmptySetError:
        return
    if there.reach - offset[i] > exact[i]:
        poses[i], exact[i] = there.twist, there.reach - offset[i]
