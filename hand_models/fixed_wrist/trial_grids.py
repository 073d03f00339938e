"""Places at which to try hands on a rock: on a grid across it, or at given points."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hand_models.base import Array, InvalidInputError, LimitError, Progress, check_positive
from hand_models.fixed_wrist.hold_trials import HoldTrial
from hand_models.rock import Mesh

__all__ = ["grid_of_trials", "trials_at"]


def grid_of_trials(
    rock: Mesh,
    spacing: float,
    angles: int,
    rotations: Sequence[float] = (0.0,),
    approach: tuple[float, float, float] | None = None,
    *,
    radius: float,
    most: int | None = None,
    report: Progress | None = None,
) -> list[HoldTrial]:
    """Return places at which to try a hand, on a square grid across z of a rock's frame.

    Parameters
    ----------
    rock : Mesh
    spacing : float
        Distance of the grid's points, at least 0.001 [m].
    angles : int
        Number of wrist angles at each point, evenly over a whole turn.
    rotations : sequence of float, optional
        Rotations of the outer fingers to try [rad].
    approach : tuple of float, optional
        Direction of approach of all hands; by default normal to the mean plane of the rock about
        each point.
    radius : float
        Half the side of the square about a point in which that plane is fitted [m].
    most : int, optional
        Largest number of places on the whole grid, on rock or not.
    report : callable, optional
        Called with (points done, points in all).

    Returns
    -------
    list of HoldTrial
        Places at each point on rock, one for every angle with every rotation.

    Raises
    ------
    InvalidInputError
        If a number is not possible.
    LimitError
        If the grid has more than ``most`` places; the field is ``spacing``.
    """
    if not 1e-3 <= spacing < math.inf:
        raise InvalidInputError(
            f"must be finite and at least 0.001 m, got {spacing:g}", field="spacing"
        )
    check_positive(radius, "m", "radius")
    if angles < 1:
        raise InvalidInputError(f"at least one is needed, got {angles}", field="angles")
    low, high = (end(rock.triangles.vertices, axis=0) for end in (np.min, np.max))
    each_way = [math.floor((b - a) / spacing) + 1 for a, b in zip(low[:2], high[:2], strict=True)]
    count = math.prod(each_way) * angles * len(rotations)
    if most is not None and count > most:
        raise LimitError(
            f"{spacing:g} m makes up to {count:,} places to try (a grid of {each_way[0]:,} by "
            f"{each_way[1]:,} points, {angles * len(rotations)} at each); the maximum is "
            f"{most:,}: use a wider spacing",
            field="spacing",
        )
    # in the middle of what is left over
    sides = [
        a + 0.5 * ((b - a) % spacing) + spacing * np.arange(number)
        for a, b, number in zip(low[:2], high[:2], each_way, strict=True)
    ]
    points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2)
    above = float(low[2]) - spacing
    return trials_at(rock, points, angles, rotations, approach, above, radius, report)


def trials_at(
    rock: Mesh,
    points: Array,
    angles: int,
    rotations: Sequence[float],
    approach: tuple[float, float, float] | None,
    above: float,
    radius: float,
    report: Progress | None = None,
) -> list[HoldTrial]:
    """Return places at which to try a hand, at points across z of a rock's frame.

    Parameters
    ----------
    rock, angles, rotations, approach, radius, report
        As of `grid_of_trials`.
    points : ndarray, shape (n, 2)
        Along x and y of the rock's frame [m].
    above : float
        Where rays along z begin, before all rock [m].

    Returns
    -------
    list of HoldTrial
        Places at each point on rock, one for every angle with every rotation.
    """
    # five rays along each side of the square in which the plane of the rock is found
    beside = np.stack(np.meshgrid(*[np.linspace(-radius, radius, 5)] * 2), axis=-1)
    found: list[HoldTrial] = []
    into = (0.0, 0.0, 1.0)  # z of a rock's frame
    for number, (x, y) in enumerate(points.tolist()):
        if report is not None:
            report(number, len(points))
        depth = rock.entry((x, y, above), into)
        if not math.isfinite(depth):
            continue
        point = x, y, above + depth
        toward = approach
        if toward is None:
            around = beside.reshape(-1, 2) + np.array([x, y])
            depths = np.array([rock.entry((*each, above), into) for each in around.tolist()])
            met = np.isfinite(depths)
            plane = np.column_stack([around[met], np.ones(met.sum())])
            slope = np.linalg.lstsq(plane, depths[met])[0]
            size = math.hypot(slope[0], slope[1], 1.0)
            toward = -float(slope[0]) / size, -float(slope[1]) / size, 1.0 / size
        found += [
            HoldTrial(point, toward, math.tau * k / angles, rotation)
            for k in range(angles)
            for rotation in rotations
        ]
    return found
