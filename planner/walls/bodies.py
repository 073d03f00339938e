"""Poses of the body before a rock, on a grid, and between which of them it may be shifted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hand_models.base import (
    BASE_TOLERANCES,
    Array,
    Indices,
    InvalidInputError,
    Pose,
    turns_about,
)
from hand_models.rock import Mesh
from planner.motion import distances_from_rock
from planner.robots import Robot
from planner.walls.grids import BodyGrid

__all__ = ["BodyPoses", "body_poses", "clear_of", "equal_poses"]


class BodyPoses(NamedTuple):
    """Poses of the body on a grid before a rock.

    Attributes
    ----------
    poses : tuple of Pose, length B
        Poses of B in the world frame W.
    cells : ndarray of int, shape (B, 4)
        Place of each on the grid: steps up and across the rock, of stand-offs, and of tilts.
    shifts : ndarray of int, shape (E, 2)
        Pairs between which the body may be shifted: neighbours on the grid.
    in_rock : int
        Number of poses that were left out as the body would touch the rock.
    given : tuple of int
        Indices of the poses that `with_more` was given.
    """

    poses: tuple[Pose, ...]
    cells: Indices
    shifts: Indices
    in_rock: int
    given: tuple[int, ...] = ()

    @property
    def on_grid(self) -> int:
        """Number of poses of the grid, which come first."""
        return int((self.cells >= 0).all(axis=1).sum())

    def with_more(self, more: Sequence[Pose], near: float, turn: float) -> BodyPoses:
        """Return the poses with further ones, which may be shifted to those near them.

        Parameters
        ----------
        more : sequence of Pose
            Poses of B in W. They are not tried for rock. Those that are there already are named,
            the others are put at the end.
        near, turn : float
            Distance, and turn, up to which the body may be shifted from one of them [m, rad].
        """
        every, given = list(self.poses), list[int]()
        for pose in more:
            (same,) = np.nonzero(equal_poses(every, pose))
            given.append(int(same[0]) if len(same) else len(every))
            every += [] if len(same) else [pose]
        places = np.array([pose.position for pose in every]).reshape(-1, 3)
        axes = np.array([pose.rotation for pose in every]).reshape(-1, 3, 3)
        pairs = list[Indices]()
        for new in range(len(self.poses), len(every)):
            cosines = 0.5 * (np.einsum("bij,ij->b", axes[:new], axes[new]) - 1.0)
            turned = np.arccos(np.clip(cosines, -1.0, 1.0))
            away = np.linalg.norm(places[:new] - places[new], axis=1)
            others = np.flatnonzero((away <= near) & (turned <= turn))
            pairs.append(np.column_stack([others, np.full(len(others), new)]))
        cells = np.pad(self.cells, ((0, len(every) - len(self.poses)), (0, 0)), constant_values=-1)
        shifts = np.vstack([self.shifts, *pairs])
        return self._replace(poses=tuple(every), cells=cells, shifts=shifts, given=tuple(given))


def equal_poses(poses: Sequence[Pose], other: Pose) -> NDArray[np.bool_]:
    """Return which of P poses another one is, up to rounding, shape (P,)."""
    places = np.array([pose.position for pose in poses]).reshape(-1, 3)
    axes = np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3)
    near = np.linalg.norm(places - other.position, axis=1) <= BASE_TOLERANCES.length
    turned = np.abs(axes - other.rotation).max(axis=(1, 2)) > BASE_TOLERANCES.angle
    return np.asarray(near & ~turned)


def body_poses(grid: BodyGrid, rock: Mesh, rock_pose: Pose, robot: Robot) -> BodyPoses:
    """Return the poses of the body before a rock, without those in it.

    Parameters
    ----------
    grid : BodyGrid
    rock : Mesh
    rock_pose : Pose
        The rock's frame in the world frame W.
    robot : Robot

    Raises
    ------
    InvalidInputError
        If there is no rock below the grid, or no pose is clear of it.
    """
    measured = _measured(rock, grid.sample)
    centre = measured.mean(axis=0)
    axes, points = _mean_plane(measured - centre)
    extent = np.ptp(points[:, :2], axis=0)
    middle = points[:, :2].min(axis=0) + 0.5 * extent
    counts = [max(int((side - 2.0 * grid.margin) // grid.spacing) + 1, 1) for side in extent]
    steps = [grid.spacing * (np.arange(n) - 0.5 * (n - 1)) for n in counts]
    turns = [axes @ turns_about(np.array([0.0, tilt, 0.0])) for tilt in grid.tilts]
    poses, cells = list[Pose](), list[tuple[int, int, int, int]]()
    for i, up in enumerate(steps[0]):
        for j, across in enumerate(steps[1]):
            at = middle + np.array([up, across])
            below = (np.abs(points[:, :2] - at) <= 0.5 * grid.footprint).all(axis=1)
            height = float(points[below, 2].mean()) if below.any() else 0.0
            for k, stand_off in enumerate(grid.stand_offs):
                place = centre + axes @ np.append(at, height + stand_off)
                poses += [Pose(place, turn) for turn in turns]
                cells += [(i, j, k, m) for m in range(len(turns))]
    free = clear_of(rock, robot, poses, grid.clear)
    if not free.any():
        raise InvalidInputError(
            "no pose of the body is clear of the rock; give larger ones", field="stand_offs"
        )
    kept = np.array(cells)[free]
    bodies = tuple(rock_pose @ poses[i] for i in np.flatnonzero(free))
    return BodyPoses(bodies, kept, _neighbours(kept), int((~free).sum()))


def _measured(rock: Mesh, spacing: float) -> Array:
    """Return points of a rock that face −z of its frame, on a grid across z, shape (n, 3) [m]."""
    low, high = rock.triangles.vertices.min(axis=0), rock.triangles.vertices.max(axis=0)
    ends = zip(low[:2].tolist(), high[:2].tolist(), strict=True)
    sides = [np.arange(a + 0.5 * ((b - a) % spacing), b, spacing) for a, b in ends]
    x, y = (each.ravel() for each in np.meshgrid(*sides, indexing="ij"))
    starts = np.column_stack([x, y, np.full(len(x), low[2] - spacing)])
    depths = np.array(rock.entries(starts, (0.0, 0.0, 1.0)))
    starts[:, 2] += depths
    found: Array = starts[np.isfinite(depths)]
    if len(found) < 3:
        raise InvalidInputError(
            "hardly any rock faces −z of its frame; is the mesh flipped, or smaller than "
            f"{spacing:g} m?",
            field="sample",
        )
    return found


def _mean_plane(away: Array) -> tuple[Array, Array]:
    """Return axes of a body that faces the mean plane of points, and the points along them.

    The axes are in the rock's frame. Points are from their mean.
    """
    slopes = np.linalg.lstsq(away[:, :2], away[:, 2])[0]
    z = np.append(slopes, -1.0) / np.hypot(1.0, np.hypot(*slopes))
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(z, x), z])
    return axes, away @ axes


def clear_of(rock: Mesh, robot: Robot, poses: Sequence[Pose], clear: float) -> NDArray[np.bool_]:
    """Return at which poses in the rock's frame the body keeps so far from it [m]."""
    segments, radii = robot.body_capsules
    points, reaches = list[Array](), list[Array]()
    for (first, second), radius in zip(segments, radii, strict=True):
        length = float(np.linalg.norm(second - first))
        count = int(np.ceil(2.0 * length / radius)) + 1
        points.append(np.linspace(first, second, count))
        # what is nearest to a segment is beside it, at most half their distance from a point
        gap = 0.5 * length / max(count - 1, 1)
        reaches.append(np.full(count, np.hypot(radius + clear, gap)))
    every, least = np.concatenate(points), np.concatenate(reaches)
    found = np.empty(len(poses), dtype=bool)
    for i, pose in enumerate(poses):
        away = distances_from_rock(rock, pose.apply(every), float(least.max()))
        found[i] = (away >= least).all()
    return found


def _neighbours(cells: Indices) -> Indices:
    """Return the pairs of cells that are one step apart, shape (E, 2)."""
    index = {cell: i for i, cell in enumerate(map(tuple, cells.tolist()))}
    pairs = list[tuple[int, int]]()
    for cell, i in index.items():
        for axis in range(len(cell)):
            beside = (*cell[:axis], cell[axis] + 1, *cell[axis + 1 :])
            if beside in index:
                pairs.append((i, index[beside]))
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)
