"""The tree of a mesh's triangles: all that a box meets are found, and lines enter at the first."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.rock import Mesh, Triangles
from hand_models.rock.compiled_cells import neighbour_means
from hand_models.rock.triangles import TriangleCells
from tests.suite.helpers.rocks import (
    distance,
    fractal_wall,
    from_triangles,
    random_axes,
    random_mesh,
)

seeds = st.integers(0, 2**32 - 1)


def soup(rng: np.random.Generator) -> Triangles:
    """Triangles of all sizes anywhere."""
    count = int(rng.integers(1, 200))
    middles = rng.uniform(-1.0, 1.0, (count, 1, 3)) * [1.0, 0.3, 0.01]
    sizes = 10.0 ** rng.uniform(-3.0, 0.0, (count, 1, 1))
    corners = middles + sizes * rng.normal(size=(count, 3, 3))
    return Triangles(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


@given(seeds)
def test_all_triangles_that_reach_into_a_box_are_found(seed):
    rng = np.random.default_rng(seed)
    triangles = soup(rng)
    axes = random_axes(rng, 3.0)[: rng.integers(1, 4)]
    middle, half = rng.uniform(-0.5, 0.5, len(axes)), rng.choice([0.0, 0.1], len(axes))
    found = TriangleCells(triangles).within(axes, middle - half, middle + half)
    along = triangles.vertices[triangles.faces] @ axes.T
    inside = (along.min(axis=1) <= middle + half) & (along.max(axis=1) >= middle - half)
    assert (np.diff(found) > 0).all()
    assert set(np.flatnonzero(inside.all(axis=1))) <= set(found.tolist())


@pytest.mark.parametrize("seed", range(4))
def test_parallel_lines_enter_where_the_nearest_front_ahead_is(seed):
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng)
    direction = random_axes(rng, 3.0)[:, 2]
    corners = hold.triangles.vertices[hold.triangles.faces]
    points = rng.choice(hold.triangles.vertices, 12) + rng.normal(0.0, 0.05, (12, 3))
    for point, got in zip(points, hold.entries(points, direction), strict=True):
        # p + λ d = a + u (b − a) + v (c − a)
        a, b, c = corners.transpose(1, 0, 2)
        systems = np.stack([np.broadcast_to(-direction, a.shape), b - a, c - a], axis=-1)
        far, u, v = np.linalg.solve(systems, (point - a)[..., None])[..., 0].T
        met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
        fronts = np.cross(b - a, c - a) @ direction < 0.0
        behind = np.flatnonzero(met & (far <= 0.0))
        want = far[met & fronts & (far > 0.0)].min(initial=math.inf)
        if len(behind) and fronts[behind[far[behind].argmax()]]:
            want = far[behind].max()
        assert got == pytest.approx(want, abs=1e-9)
        assert hold.entry(point, direction) == got


def test_a_mesh_that_has_been_cut_may_go_to_another_process():
    hold = Mesh(*fractal_wall(0), anywhere=True)
    plane = np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    here, there = (each.section(*plane) for each in (hold, pickle.loads(pickle.dumps(hold))))
    np.testing.assert_array_equal(here.pieces[0], there.pieces[0])


@given(seeds)
def test_points_are_as_far_from_triangles_as_from_the_nearest(seed):
    rng = np.random.default_rng(seed)
    triangles, points = soup(rng), rng.normal(0.0, 0.7, (20, 3))
    corners = triangles.vertices[triangles.faces]
    want = np.abs(from_triangles(corners, points))
    cells = TriangleCells(triangles)
    assert np.abs(cells.distances(points, 10.0)) == pytest.approx(want, abs=1e-7)
    near = cells.distances(points, 0.3)
    assert np.abs(near) == pytest.approx(np.minimum(want, 0.3), abs=1e-7)
    assert (near[want > 0.3] == 0.3).all()


@pytest.mark.parametrize("seed", range(6))
def test_points_inside_a_boulder_are_behind_its_triangles(seed):
    """By solid angles, which say what is inside whatever is nearest."""
    rng = np.random.default_rng(seed)
    hold = random_mesh(rng)
    points = rng.choice(hold.triangles.vertices, 300)
    points = points + rng.normal(0.0, 0.1, points.shape) * np.ptp(points, axis=0)
    assert hold.cells.distances(points, 10.0) == pytest.approx(distance(hold, points), abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_means_of_neighbours_count_each_once_and_borders_have_edges_of_one_triangle(seed):
    """Of triangles at random, several of them at an edge, against sets of neighbours."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(4, 40))
    faces = np.array([rng.permutation(count)[:3] for _ in range(2 * count)])
    vertices = rng.normal(size=(count + 1, 3))
    means, spreads = neighbour_means(vertices, faces)
    for vertex in range(count + 1):
        own = faces[(faces == vertex).any(axis=1)]
        others, triangles = np.unique(own[own != vertex], return_counts=True)
        mean = vertices[others].mean(axis=0) if len(others) else np.zeros(3)
        np.testing.assert_allclose(means[vertex], mean, atol=1e-12)
        spread = np.inf if 1 in triangles else math.sqrt(((vertices[others] - mean) ** 2).sum())
        spread /= math.sqrt(max(len(others), 1))
        assert spreads[vertex] == pytest.approx(spread, abs=1e-7)
