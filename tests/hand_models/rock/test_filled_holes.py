"""Cells without a height that were filled with one number: told, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st

from hand_models.rock import FilledCells, Mesh, Triangles, filled_cells, read_mesh, weld
from hand_models.rock.triangles import wound_alike
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.rocks import cylinder_mesh, height_map, random_mesh
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)
SPACING = 2e-3


def rough(seed: int, count: int = 200, digits: int = 17) -> np.ndarray:
    """Heights some millimetres about half a metre, as rough as they are wavy [m]."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(*2 * [SPACING * np.arange(count)], indexing="ij")
    waves = sum(np.sin((a * x + b * y) * 20.0) for a, b in rng.normal(size=(4, 2)))
    return (0.5 + 2e-3 * waves + 5e-4 * rng.normal(size=x.shape)).round(digits)


def found(heights: np.ndarray) -> list[FilledCells]:
    """In a mesh of depths, whose z goes into the rock, and the same turned about an axis."""
    vertices, faces = height_map(-heights, SPACING)
    upright = filled_cells(Triangles(vertices, faces))
    turned = filled_cells(Triangles(np.roll(vertices, 1, axis=1), faces))
    assert [cells._replace(axis=(cells.axis + 1) % 3) for cells in upright] == turned
    return upright


@given_some(4, 30, seeds, st.integers(5, 40), st.integers(5, 40), st.sampled_from([17, 3]))
def test_a_hole_filled_with_zeros_is_found(seed, rows, columns, digits):
    heights = rough(seed, digits=digits)
    assert found(heights) == []
    rng = np.random.default_rng(seed)
    i, j = (int(rng.integers(0, 200 - side)) for side in (rows, columns))
    heights[i : i + rows, j : j + columns] = 0.0
    assert found(heights) == [FilledCells(2, 0.0, rows * columns)]


def test_holes_are_told_by_what_they_are_filled_with():
    heights = rough(1)
    heights[20:30, 20:30] = heights[100:120, 3:9] = 0.0
    heights[150:160, 150:160] = 9.999
    assert found(heights) == [FilledCells(2, -9.999, 100), FilledCells(2, 0.0, 220)]


def test_it_is_odd_about_a_mesh():
    heights = rough(2)
    vertices, faces = height_map(heights.mean() - heights, SPACING)
    assert Mesh(vertices, faces).oddities == ()
    heights[20:40, 20:40] = 0.0
    vertices, faces = height_map(0.5 - heights, SPACING)
    assert Mesh(vertices, faces).oddities == (
        "vertices: 400 vertices are at exactly z = 0.5 m, with cliffs around them; leave out cells "
        "that have no height",
    )


# What is not --------------------------------------------------------------------------------------


@given_some(12, 100, seeds)
def test_nothing_is_found_in_boulders(seed):
    assert filled_cells(random_mesh(np.random.default_rng(seed)).triangles) == []


def step(count: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Two flat treads and the riser between, drawn out in many strips; open."""
    outline = np.array([[-0.2, 0.0], [-0.1, 0.0], [0.0, 0.0], [0.0, 0.2], [0.1, 0.2], [0.2, 0.2]])
    y = np.linspace(-0.1, 0.1, count)
    i = np.arange(len(outline) * count).reshape(len(outline), count)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[1:, :-1], i[:-1, 1:], i[1:, 1:]))
    vertices = np.array([[x, v, z] for x, z in outline for v in y])
    return vertices, np.vstack([np.column_stack([a, c, b]), np.column_stack([b, c, d])])


def solid(seed: int) -> trimesh.Trimesh:
    """A height map closed by walls and a flat floor, as for printing."""
    vertices, faces = height_map(rough(seed, 40), SPACING)
    (loop,) = trimesh.Trimesh(vertices, faces, process=False).outline().entities
    rim = loop.points[:-1]
    n, k = len(vertices), len(rim)
    below, after = n + np.arange(k), np.roll(np.arange(k), -1)
    walls = [
        np.column_stack([rim, rim[after], below]),
        np.column_stack([rim[after], below[after], below]),
        np.column_stack([below, below[after], np.full(k, n + k)]),
    ]
    points = [vertices, vertices[rim] * [1.0, 1.0, 0.0], [[0.0, 0.0, 0.0]]]
    closed = wound_alike(weld(Triangles(np.vstack(points), np.vstack([faces, *walls]))))
    assert trimesh.Trimesh(*closed, process=False).is_watertight
    return trimesh.Trimesh(*closed)


MESHES = {
    "wall": lambda: trimesh.Trimesh(*height_map(np.zeros((50, 50)), SPACING)),
    "wall of wide triangles": lambda: trimesh.Trimesh(*height_map(np.zeros((9, 9)), 0.2)),
    "box": lambda: trimesh.creation.box((0.4, 0.3, 0.2)).subdivide_to_size(0.02),
    "box of eight vertices": lambda: trimesh.creation.box((0.4, 0.3, 0.2)),
    "tube": lambda: trimesh.Trimesh(*cylinder_mesh(0.3)),
    "log": lambda: trimesh.creation.cylinder(0.15, 0.6, sections=64),
    "cone": lambda: trimesh.creation.cone(0.15, 0.6, sections=64),
    "capsule": lambda: trimesh.creation.capsule(0.6, 0.1),
    "step": lambda: trimesh.Trimesh(*step()),
    "solid": lambda: solid(3),
    "boulder": lambda: trimesh.Trimesh(*read_mesh(ROOT / "service" / "examples" / "boulder.ply")),
}


@pytest.mark.parametrize("name", MESHES)
def test_nothing_is_found_where_nothing_is_filled(name):
    mesh = MESHES[name]()
    whole = weld(Triangles(np.array(mesh.vertices), np.array(mesh.faces)))
    assert filled_cells(whole) == []
    raw = Triangles(np.array(mesh.vertices), np.array(mesh.faces)[:, ::-1])
    assert filled_cells(raw) == []
