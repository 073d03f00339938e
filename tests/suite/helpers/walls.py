"""Random walls of closed hands, and their load factors by another solver."""

from functools import cache
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import scipy

from hand_models.base import Pose, wrench_transport
from planner import search
from planner.prepare import prepare_stance
from planner.programs import WRENCH_UNIT
from planner.reach import ReachTable
from planner.robots import robosimian
from planner.screening import HandParts, ScreeningTable, WorldHands
from service.answering import questions
from service.commands import stances


class Wall(NamedTuple):
    """Hands of bundled stances, turned and moved at random on a plane that leans back."""

    spaces: list
    poses: list
    lean: np.ndarray

    @property
    def hands(self):
        parts = {id(space): HandParts.of(space) for space in self.spaces}
        return WorldHands.of([parts[id(space)] for space in self.spaces], self.poses, np.zeros(3))

    def wrench(self, com, mass=110.3):
        """The wrench that a robot's weight needs about the origin, in `WRENCH_UNIT`."""
        force = np.array([0.0, 0.0, 9.81 * mass])
        return np.concatenate([force, np.cross(self.lean @ com, force)]) / WRENCH_UNIT

    def load_factor(self, members, wrench):
        """The largest multiple of a wrench, by HiGHS on the rows of the sets; None without one."""
        sizes = [len(self.spaces[p].columns) for p in members]
        A = scipy.linalg.block_diag(*(self.spaces[p].A for p in members))
        A = np.hstack([np.zeros((len(A), 1)), A])
        carried = [-wrench_transport(self.poses[p]) / WRENCH_UNIT[:, None] for p in members]
        balance = [C @ self.spaces[p].generators for C, p in zip(carried, members, strict=True)]
        rest = -sum(C @ self.spaces[p].origin for C, p in zip(carried, members, strict=True))
        found = scipy.optimize.linprog(
            np.append(-1.0, np.zeros(sum(sizes))),
            A_ub=A,
            b_ub=np.concatenate([self.spaces[p].b for p in members]),
            A_eq=np.hstack([-wrench[:, None], *balance]),
            b_eq=rest,
            bounds=[(0.0, None)] + [(None, None)] * sum(sizes),
        )
        assert found.status in (0, 2)
        return -found.fun if found.status == 0 else None


@cache
def bundled_spaces():
    """Sets of hands of bundled stances; those of the slab are clipped by limits of whole hands."""
    names = ("wall-300", "slab", "boulders")
    prepared = [prepare_stance(questions.question(stances.read_request(each))) for each in names]
    return [space for each in prepared for space in each.hands.spaces]


def random_wall(seed, count, lean=0.6):
    """A wall with so many hands on it."""
    rng, Rotation = np.random.default_rng(seed), scipy.spatial.transform.Rotation
    back = Rotation.from_euler("y", lean).as_matrix()
    into = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # x up, z into the rock
    spaces = [bundled_spaces()[i] for i in rng.integers(len(bundled_spaces()), size=count)]
    turns = Rotation.from_euler("xyz", rng.uniform(-0.4, 0.4, (count, 3))).as_matrix()
    places = np.column_stack([np.zeros(count), rng.uniform(-0.7, 0.7, (count, 2))])
    poses = [
        Pose(back @ place, back @ into @ turn) for place, turn in zip(places, turns, strict=True)
    ]
    return Wall(spaces, poses, back)


def climbing_wall(
    seed,
    count,
    *,
    columns=2,
    rows=6,
    stand_offs=(0.35,),
    size=None,
    step=0.15,
    radius=0.45,
    lean=0.6,
    weighed=True,
    palms=0.12,
):
    """A wall with so many hands, bodies on a grid, and a plain rule for what each limb reaches.

    Each limb reaches hands in a circle beside its corner of the body; its weight is where its hand
    is, in part. The world is turned by ``lean``.
    """
    rng = np.random.default_rng([seed, 1])
    wall = random_wall(seed, count, lean)
    width, height = size or (step * (columns - 1) + 1.1, step * (rows - 1) + 1.1)
    flat = np.column_stack([rng.uniform(0.0, width, count), rng.uniform(0.0, height, count)])
    flat -= [width / 2.0, 0.55]
    poses = [
        Pose(wall.lean @ np.array([0.0, *place]), pose.rotation)
        for place, pose in zip(flat, wall.poses, strict=True)
    ]
    wall = Wall(wall.spaces, poses, wall.lean)
    grid = np.array(
        [
            [-off, step * (i - (columns - 1) / 2.0), step * j]
            for j in range(rows)
            for i in range(columns)
            for off in stand_offs
        ]
    )
    corners = 0.42 * np.array([[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]])
    away = flat[:, None, None] - (grid[:, None, 1:] + corners)
    reached = np.linalg.norm(away, axis=-1) < radius
    entry = np.full(reached.shape, -1)
    entry[reached] = np.arange(reached.sum())
    reach = ReachTable(
        entry, reached, np.arange(reached.sum() + 1), np.zeros((int(reached.sum()), 7))
    )
    wrenches = np.array([wall.wrench(place) for place in grid])
    moments = np.zeros((0, 0, 0, 0))
    if weighed:
        shifted = np.moveaxis(np.concatenate([np.zeros((*away.shape[:3], 1)), away], axis=-1), 0, 2)
        force = np.array([0.0, 0.0, 9.81 * 6.0])
        moments = np.cross(0.5 * shifted @ wall.lean.T, force) / WRENCH_UNIT[3:]
        moments *= np.moveaxis(reached, 0, 2)[..., None]
    near = np.abs(grid[:, None] - grid[None]).max(axis=2) < 1.2 * step
    near &= (np.abs(grid[:, None] - grid[None]) > 1e-6).sum(axis=2) == 1
    return search.Wall(
        robot=robosimian(),
        places=tuple(SimpleNamespace(pose=pose) for pose in poses),
        bodies=tuple(Pose(wall.lean @ place, wall.lean) for place in grid),
        shifts=np.argwhere(np.triu(near)),
        reach=reach,
        screening=ScreeningTable.of(wall.hands, wrenches, moments),
        apart=np.linalg.norm(flat[:, None] - flat[None], axis=2) > palms,
    ), wall
