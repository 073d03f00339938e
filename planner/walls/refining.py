"""Make a wall finer about a stage of a climb: more places for its hands, more poses of the body."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from hand_models.base import BASE_TOLERANCES, Pose
from planner.search import State, Wall
from planner.walls.bodies import clear_of
from planner.walls.making import WallSource

__all__ = ["finer_about"]


def finer_about(source: WallSource, wall: Wall, state: State, times: int = 1) -> WallSource:
    """Return the source of a wall that is finer about a state of a climb.

    Hands are tried at the eight points about each hand of the state, at half of the grid's spacing,
    and the body may also be halfway to each pose to which it may be shifted. All placements and
    poses of the wall remain.

    Parameters
    ----------
    source : WallSource
        Source of the wall.
    wall : Wall
    state : State
        A state of the wall.
    times : int
        How often the spacing is halved.
    """
    step = source.places.spacing * 0.5**times
    sides = np.stack(np.meshgrid(*[[-step, 0.0, step]] * 2, indexing="ij"), axis=-1)
    beside = sides.reshape(-1, 2)[np.arange(9) != 4]
    into = source.rock_pose.inverse()
    points = [*source.more_points]
    for member in state.members:
        if member < 0:
            continue
        for x, y in (beside + (into @ wall.places[member].pose).position[:2]).tolist():
            if not any(math.hypot(x - a, y - b) < 0.5 * step for a, b in points):
                points.append((x, y))
    own = wall.bodies[state.body]
    there = (wall.shifts == state.body).any(axis=1)
    others = [wall.bodies[i] for i in np.unique(wall.shifts[there]) if i != state.body]
    halfway = [
        Pose(0.5 * (own.position + other.position), own.rotation)
        for other in others
        if np.abs(own.rotation - other.rotation).max() <= BASE_TOLERANCES.angle
    ]
    rock, robot, clear_by = source.rock, source.robot, source.bodies.clear
    free = clear_of(rock, robot, [into @ each for each in halfway], clear_by)
    more = [pose for pose, clear in zip(halfway, free, strict=True) if clear]
    return replace(source, more_points=points, more_bodies=[*source.more_bodies, *more])
