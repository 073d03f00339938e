"""Triangulations against Qhull's and against what makes one Delaunay's; medians and normals."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from hand_models.scans.compiled_triangulation import (
    delaunay_triangles,
    median_points,
    vertex_normals,
)
from hand_models.scans.scan import areas_of


def joined(points):
    """Triangles of whole points in any order, and their neighbours."""
    centre = points.mean(axis=0).astype(int)
    order = np.argsort(((points - centre) ** 2).sum(axis=1), kind="stable")
    corners, beside = delaunay_triangles(points[order], centre)
    return order[corners], beside


def names(triangles):
    return set(map(tuple, np.sort(triangles, axis=1).tolist()))


@pytest.mark.parametrize("shape", [(1, 1), (1, 0.01), (0.001, 1)])
def test_points_in_general_position_are_joined_as_by_qhull(shape):
    points = np.rint(2**30 * np.random.default_rng(0).random((3000, 2)) * shape).astype(int)
    corners, _ = joined(points)
    assert names(corners) == names(scipy.spatial.Delaunay(points).simplices)


@pytest.mark.parametrize("seed", range(40))
def test_points_on_lines_and_circles_and_equal_ones_are_joined_without_gap_or_overlap(seed):
    """Of 25 places or fewer, so that most are in line and on circles with others, and repeated."""
    rng = np.random.default_rng(seed)
    size = rng.integers(1, 5, 2)
    points = rng.integers(0, size, (60, 2), endpoint=True) * 2 ** rng.integers(0, 28)
    corners, beside = joined(points)
    a, b, c = (points[corners[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert area.min() > 0
    assert area.sum() / 2 == pytest.approx(scipy.spatial.ConvexHull(points).volume)
    edges = {(*each[[k, k - 2]],): i for i, each in enumerate(corners) for k in range(3)}
    assert len(edges) == 3 * len(corners)
    for i, each in enumerate(corners):
        assert beside[i].tolist() == [edges.get((*each[[k - 2, k]],), -1) for k in range(3)]
    assert len(np.unique(corners)) == len(np.unique(points, axis=0))
    centre, size = np.empty((len(area), 2)), np.empty(len(area))
    for i, triangle in enumerate(np.stack([a, b, c], axis=1).astype(float)):
        sides = triangle[1:] - triangle[0]
        centre[i] = np.linalg.solve(2 * sides, (sides**2).sum(axis=1)) + triangle[0]
        size[i] = np.linalg.norm(centre[i] - triangle[0])
    away = np.linalg.norm(points[None] - centre[:, None], axis=2)
    assert (away >= size[:, None] * (1.0 - 1e-9)).all()


@pytest.mark.parametrize("depths", [1, 4, 10**9])
def test_of_each_square_the_point_of_median_depth_is_kept_and_of_equal_ones_the_first(depths):
    rng = np.random.default_rng(depths)
    # squares of one to hundreds of points, in no order
    squares = np.rint(rng.exponential(40.0, 2000)).astype(int)
    depth = rng.integers(0, depths, 2000).astype(float)
    order = rng.permutation(2000)
    kept = median_points(depth, squares, order[np.argsort(squares[order], kind="stable")])
    for square, own in zip(np.unique(squares), kept, strict=True):
        there = np.flatnonzero(squares == square)
        ranked = there[np.lexsort([there, depth[there]])]
        assert own == ranked[(len(there) - 1) // 2]


def test_a_vertex_has_the_mean_normal_of_its_triangles_by_their_area():
    rng = np.random.default_rng(0)
    points, faces = rng.normal(size=(40, 3)), rng.integers(0, 39, (90, 3))
    normals, areas = vertex_normals(points, faces), areas_of(points, faces)
    for vertex in range(39):
        total = areas[np.nonzero(faces == vertex)[0]].sum(axis=0)
        np.testing.assert_allclose(normals[vertex], total / np.linalg.norm(total), atol=1e-12)
    # and none without triangles
    assert normals[39].tolist() == [0.0, 0.0, 0.0]
