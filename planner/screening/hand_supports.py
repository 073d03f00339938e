"""Hands on rock as arrays of wrenches in the world frame, and their support functions.

A hand's set is a sum of polytopes of its parts (fingers, palm), clipped by rows that concern the
whole hand, such as joint torques. In world axes a support does not depend on the robot's body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hand_models.base import (
    Array,
    EmptySetError,
    Indices,
    Pose,
    UnsupportedError,
    wrench_transport,
)
from hand_models.wrench_spaces import WrenchSpace, polytope
from planner.programs import WRENCH_UNIT, SilentHighs
from planner.screening.settings import SCREENING_SETTINGS

__all__ = ["HandParts", "WorldHands"]


class HandParts(NamedTuple):
    """A hand's set at utilisation 1 by the vertices of its parts: fingers and palm.

    Attributes
    ----------
    generators, origin : ndarray, shapes (6, m), (6,)
        The wrench on the rock in H is origin + generators y for loads y [N, N·m].
    vertices : ndarray, shape (n, m)
        Loads of the vertices of all parts, one part after the other, zero in the other parts [N].
    rows : ndarray, shape (n, k)
        What each vertex adds to those rows that couple parts and can be exceeded, over their size.
    room : ndarray, shape (k,)
        Capacities of these rows.
    lengths : tuple of int
        Number of vertices of each part.
    """

    generators: Array
    origin: Array
    vertices: Array
    rows: Array
    room: Array
    lengths: tuple[int, ...]

    @classmethod
    def of(cls, space: WrenchSpace) -> HandParts:
        """Return the parts of a hand's set.

        Raises
        ------
        EmptySetError
            If no loads of a part keep to its rows.
        UnsupportedError
            If a part bears loads without bounds of its own.
        """
        A, b = space.A, space.b
        part_names = [name.partition("/")[0] for name in space.columns]
        names = list(dict.fromkeys(part_names))
        member = np.array([[part == name for part in part_names] for name in names])
        used = (A != 0.0) @ member.T
        couples = used.sum(axis=1) > 1
        if (b[~used.any(axis=1)] < 0.0).any():
            raise EmptySetError("the wrench space is empty at utilisation 1")
        vertices, lengths = [], []
        for j, of_part in enumerate(member):
            bounded = (A[~couples] != 0.0).any(axis=0)
            moves = (space.generators != 0.0).any(axis=0) | (A != 0.0).any(axis=0)
            if (of_part & moves & ~bounded).any():
                raise UnsupportedError(
                    f"no limit of its own bounds {names[j]}, as screening requires; let fingers "
                    "have lateral reactions (grasp.lateral)"
                )
            own = np.flatnonzero(of_part & bounded)
            if not len(own):
                continue
            mine = used[:, j] & ~couples
            corners, _ = polytope(A[np.ix_(mine, own)], b[mine])
            if not len(corners):
                raise EmptySetError(f"the wrench space of {names[j]} is empty at utilisation 1")
            vertices.append(np.zeros((len(corners), len(space.columns))))
            vertices[-1][:, own] = corners
            lengths.append(len(corners))
        loads = np.concatenate([np.zeros((0, len(space.columns))), *vertices])
        size = np.abs(A[couples]).max(axis=1, initial=0.0) * 100.0  # [N] of a load
        rows, room = loads @ A[couples].T / size, b[couples] / size
        starts = np.cumsum([0, *lengths[:-1]])
        farthest = (
            np.maximum.reduceat(rows, starts, axis=0).sum(axis=0) if len(loads) else 0.0 * room
        )
        within = farthest <= room
        return cls(
            generators=space.generators,
            origin=space.origin,
            vertices=loads,
            rows=rows[:, ~within],
            room=room[~within],
            lengths=tuple(lengths),
        )


@dataclass(frozen=True, eq=False)
class WorldHands:
    """P hands on rock: the wrenches that each can make the rock exert on the robot.

    Wrenches are in the axes of the world frame W about one point, in `WRENCH_UNIT`. A hand's wrench
    is its base and one point, or a mean of points, of each of its parts, as far as rows of the
    whole hand allow.

    Attributes
    ----------
    points : ndarray, shape (n, 6)
        Wrenches of the vertices of all parts.
    rows : ndarray, shape (n, k)
        What each vertex adds to the rows of its whole hand, over the row's size.
    parts : ndarray of int, shape (parts + 1,)
        Index of the first vertex of each part.
    hands : ndarray of int, shape (P + 1,)
        Index of the first part of each hand.
    base : ndarray, shape (P, 6)
        Wrench of each hand without loads.
    room : ndarray, shape (P, k)
        Capacities of the rows; infinite for rows that a hand does not have or cannot exceed.
    about : ndarray, shape (3,)
        Point about which moments are, in W [m].
    """

    points: Array
    rows: Array
    parts: Indices
    hands: Indices
    base: Array
    room: Array
    about: Array

    @classmethod
    def of(cls, parts: Sequence[HandParts], poses: Sequence[Pose], about: Array) -> WorldHands:
        """Return hands from their sets and their poses.

        Parameters
        ----------
        parts : sequence of HandParts, length P
            Sets of hands with fixed wrists; several hands may share one.
        poses : sequence of Pose, length P
            Pose of each hand frame H in the world frame W.
        about : ndarray, shape (3,)
            Point about which moments are, in W [m]; best near the hands.
        """
        k = max((len(each.room) for each in parts), default=0)
        points, rows, base, room = [], [], [], np.full((len(parts), k), np.inf)
        sizes, counts = [0], [0]
        for i, (each, pose) in enumerate(zip(parts, poses, strict=True)):
            moved = Pose(pose.position - about, pose.rotation)
            carried = -wrench_transport(moved) / WRENCH_UNIT[:, None]
            points.append(each.vertices @ (carried @ each.generators).T)
            rows.append(np.pad(each.rows, ((0, 0), (0, k - len(each.room)))))
            base.append(carried @ each.origin)
            room[i, : len(each.room)] = each.room
            sizes += each.lengths
            counts.append(len(each.lengths))
        return cls(
            points=np.concatenate([np.zeros((0, 6)), *points]),
            rows=np.concatenate([np.zeros((0, k)), *rows]),
            parts=np.cumsum(sizes),
            hands=np.cumsum(counts),
            base=np.array(base).reshape(-1, 6),
            room=room,
            about=np.asarray(about, dtype=float),
        )

    def __len__(self) -> int:
        return len(self.base)

    def supports(self, directions: Array) -> Array:
        """Return the support functions of all hands, shape (P, D).

        Where several rows of the whole hand are in the way, a linear program finds the support; if
        its solver fails, an upper bound stands: the support with one of these rows.

        Parameters
        ----------
        directions : ndarray, shape (D, 6)
            Directions in wrenches over `WRENCH_UNIT`.
        """
        from planner.screening.compiled_screening import part_supports

        asked = np.ascontiguousarray(directions, dtype=float).reshape(-1, 6)
        found, exceeded = part_supports(
            self.points,
            self.rows,
            self.parts,
            self.hands,
            self.base,
            self.room,
            asked,
            SCREENING_SETTINGS.over,
        )
        for p in np.flatnonzero(exceeded.any(axis=1)).tolist():
            if p not in self._clipped:
                self._clipped[p] = _ClippedHand(self, p)
            clipped = self._clipped[p]
            for d in np.flatnonzero(exceeded[p]).tolist():
                found[p, d] = min(found[p, d], clipped.support(asked[d]))
        return found

    @cached_property
    def _clipped(self) -> dict[int, _ClippedHand]:
        """Programs of hands with rows of the whole hand, by index, which are kept."""
        return {}

    def part_of(self, p: int) -> tuple[slice, Array]:
        """Return a hand's vertices, as a slice of all, and the part of each, counted from zero."""
        first, end = self.hands[p], self.hands[p + 1]
        starts = self.parts[first : end + 1]
        return slice(starts[0], starts[-1]), np.repeat(np.arange(end - first), np.diff(starts))


class _ClippedHand:
    """The support of a hand with rows of the whole hand, by a linear program that is kept."""

    def __init__(self, hands: WorldHands, p: int) -> None:
        own, whose = hands.part_of(p)
        bounded = np.isfinite(hands.room[p])
        sums = (whose == np.arange(whose[-1] + 1)[:, None]).astype(float)
        A = np.vstack([sums, hands.rows[own][:, bounded].T])
        most = np.append(np.ones(len(sums)), hands.room[p, bounded])
        least = np.append(np.ones(len(sums)), np.full(bounded.sum(), -np.inf))
        self._points, self._base = hands.points[own], hands.base[p]
        self._columns = np.arange(len(self._points), dtype=np.int32)
        self._solver = SilentHighs({"presolve": "off", "solver": "simplex"})
        self._solver.load(A, (np.zeros(A.shape[1]), np.full(A.shape[1], np.inf)), (least, most))

    def support(self, direction: Array) -> float:
        """Return the support in a direction, shape (6,); infinite if the solver fails."""
        costs = -(self._points @ direction)
        self._solver.changeColsCost(len(costs), self._columns, costs)
        if not self._solver.optimal():
            return float(np.inf)
        return float(direction @ self._base) - float(self._solver.getObjectiveValue())
