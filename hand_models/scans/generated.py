"""Walls of rough rock with knobs, generated from a few numbers and a seed; no file is stored."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from hand_models.base import Array, Indices, InvalidInputError, Pose
from hand_models.parameters import ParameterTable, wall_table
from hand_models.rock import Triangles, grid, read_mesh

__all__ = ["RockSource", "generate_wall", "named_wall", "read_rock", "wall_names"]


class RockSource(NamedTuple):
    """Triangles of rock as they were read or generated, and where the rock stands.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
        Corners of the triangles, in the rock's frame [m].
    faces : ndarray of int, shape (m, 3)
        Indices of each triangle's vertices, counterclockwise seen from outside the rock.
    pose : Pose
        The rock's frame in the world frame W; the identity for a file, which does not say it.
    """

    vertices: Array
    faces: Indices
    pose: Pose


def wall_names() -> tuple[str, ...]:
    """Return the names of the walls that can be generated."""
    return tuple(wall_table().sections)


def generate_wall(
    name: str, seed: int = 0, *, lean: float | None = None, table: ParameterTable | None = None
) -> RockSource:
    """Generate a wall of rough rock with knobs; equal arguments give equal walls.

    Rough rock is a sum of waves with random phases whose steps grow as a power of their length.
    The rock's frame is in the middle of the wall: x up along it, z into the rock, on average at
    its surface. In W the middle of the wall's foot is the origin, and a wall that does not lean
    back is in the plane of y and z, seen along x.

    Parameters
    ----------
    name : str
        Name of a bundled wall, or a section of ``table``.
    seed : int, optional
        Seed of the random numbers; at least 0.
    lean : float, optional
        Angle of the wall from the vertical, away from the climber; the wall's own by default [rad].
    table : ParameterTable, optional
        Numbers of walls by their names; ``parameters/walls.toml`` by default.

    Raises
    ------
    InvalidInputError
        If no wall has this name, or a number is not possible.
    """
    numbers = table or wall_table()
    if name not in numbers.sections:
        raise InvalidInputError(
            f"unknown wall {name!r}; known are {', '.join(numbers.sections)}", field="rock"
        )
    if seed < 0:
        raise InvalidInputError(f"must be at least 0, got {seed}", field="seed")
    spacing = numbers.positive(name, "spacing")
    sides = [numbers.positive(name, side) for side in ("height", "width")]
    rows, columns = (round(side / spacing) + 1 for side in sides)
    if min(rows, columns) < 2:
        raise InvalidInputError(
            f"must be at most the wall's sides, got {spacing:g} m", field=f"{name}.spacing"
        )
    rng = np.random.default_rng(seed)
    x, y = (spacing * np.arange(0.5 * (1 - count), 0.5 * count) for count in (rows, columns))
    z = _rough(rng, (rows, columns), spacing, numbers.scalar(name, "hurst"))
    z *= numbers.scalar(name, "roughness") / z.std()
    z -= _knobs(rng, x, y, numbers, name)
    z -= z.mean()
    # rows of the grid along y, so that triangles face −z
    points = np.stack([*np.meshgrid(x, y), z.T], axis=-1)
    vertices, faces = _without_gap(grid(points), *numbers.vector(name, "gap"))
    angle = numbers.scalar(name, "lean") if lean is None else lean
    sine, cosine = np.sin(angle), np.cos(angle)
    axes = np.array([[sine, 0.0, cosine], [0.0, -1.0, 0.0], [cosine, 0.0, -sine]])
    return RockSource(vertices, faces, Pose(-x[0] * axes[:, 0], axes))


def named_wall(rock: Path) -> tuple[str, int] | None:
    """Return the wall that a path names, as `generate_wall` takes it: its name and its seed.

    Parameters
    ----------
    rock : Path
        As of `read_rock`.

    Returns
    -------
    tuple of (str, int), or None
        None for a file, and for a name that is no wall's.

    Raises
    ------
    InvalidInputError
        If the seed is no whole number.
    """
    name, colon, seed = str(rock).partition(":")
    if name not in wall_names() or rock.exists():
        return None
    if colon and not (seed.isascii() and seed.isdigit()):
        raise InvalidInputError(
            f"the seed of a wall must be a whole number, got {seed!r}; valid is, for example, "
            f"{name}:3",
            field="rock",
        )
    return name, int(seed or 0)


def read_rock(rock: Path) -> RockSource:
    """Read a mesh file in metres, or generate the bundled wall of that name.

    Parameters
    ----------
    rock : Path
        A mesh file; or, where there is no such file, the name of a wall of `wall_names`, with a
        seed after a colon if it is not 0, such as ``leaning-wall:3``.

    Raises
    ------
    InvalidInputError
        If the file cannot be read, or there is neither a file nor a wall of this name.
    """
    wall = named_wall(rock)
    if wall is not None:
        return generate_wall(*wall)
    if not rock.suffix and not rock.exists():
        raise InvalidInputError(
            f"no file {rock}, and no wall of this name; generated walls are "
            f"{', '.join(wall_names())}",
            field="file",
        )
    return RockSource(*read_mesh(rock), Pose.identity())


def _rough(rng: np.random.Generator, shape: tuple[int, int], spacing: float, hurst: float) -> Array:
    """Return heights of rough rock at the points of a grid, of any size."""
    waves = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n, spacing) for n in shape), indexing="ij"))
    waves[0, 0] = np.inf  # no mean
    noise = np.fft.fft2(rng.normal(size=shape))
    return np.asarray(np.fft.ifft2(noise * waves ** -(1.0 + hurst)).real)


def _knobs(
    rng: np.random.Generator, x: Array, y: Array, numbers: ParameterTable, name: str
) -> Array:
    """Return how far knobs stand out at the points of a grid, shape (n, m) [m]."""
    found = np.zeros((len(x), len(y)))
    shape = numbers.scalar(name, "knob_shape")
    sizes = [numbers.vector(name, f"knob_{side}") for side in ("radius", "height")]
    for _ in range(round(numbers.scalar(name, "knobs"))):
        at = rng.uniform(x[0], x[-1]), rng.uniform(y[0], y[-1])
        radius, height = (rng.uniform(low, high) for low, high in sizes)
        inside = 1.0 - ((x - at[0])[:, None] ** 2 + (y - at[1]) ** 2) / radius**2
        # where two meet, the higher one is seen
        np.maximum(found, height * np.maximum(inside, 0.0) ** shape, out=found)
    return found


def _without_gap(wall: Triangles, low: float, high: float) -> Triangles:
    """Return a wall without the triangles that reach between two x, and without their corners."""
    if low >= high:
        return wall
    x = wall.vertices[wall.faces, 0]
    kept = wall.faces[(x.max(axis=1) <= low) | (x.min(axis=1) >= high)]
    used, faces = np.unique(kept, return_inverse=True)
    return Triangles(wall.vertices[used], faces.reshape(-1, 3))
