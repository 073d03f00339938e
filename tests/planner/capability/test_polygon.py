"""Inner and outer polygons of sets that are known by how far they reach."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.spatial import ConvexHull

from hand_models.base import SolverError
from planner.capability import Polygon
from planner.capability.polygon import SupportPoint, enclose
from tests.suite.helpers.polygons import hull_of

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def disc(radius, centre=(0.0, 0.0)):
    centre = np.array(centre)
    return lambda n: SupportPoint(n, centre + radius * n)


def area(points):
    x, y = np.asarray(points).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def same_corners(found, wanted, tolerance):
    assert len(found) == len(wanted)
    for corner in wanted:
        assert np.linalg.norm(found - corner, axis=1).min() <= tolerance


@given(st.integers(3, 40), st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0))
def test_a_polygon_is_found_exactly(count, seed, stretch):
    chance = np.random.default_rng(seed)
    points = chance.normal(size=(count, 2)) * [1.0, 10.0**stretch] + chance.normal(size=2)
    corners = points[ConvexHull(points).vertices]
    found = enclose(hull_of(points))
    size = np.ptp(corners, axis=0).max()
    assert found.gap <= 3e-4 * size + 1e-6
    # corners that stand out by less than the gap may be left out
    assert area(found.inner) == pytest.approx(area(corners), rel=2e-3)
    inner, outer, true = (hull_of(p) for p in (found.inner, found.outer, corners))
    for angle in np.linspace(0.0, math.tau, 25):
        normal = np.array([math.cos(angle), math.sin(angle)])
        reach = true(normal).reach
        assert inner(normal).reach <= reach + 1e-9 * (1.0 + size)
        assert outer(normal).reach >= reach - 1e-6 * (1.0 + size)
        assert outer(normal).reach - inner(normal).reach <= found.gap + 1e-5 * (1.0 + size)


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4])
def test_corners_of_a_square_and_no_more(turn):
    square = SQUARE @ [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
    calls = []
    found = enclose(hull_of(square, calls))
    same_corners(found.inner, square, 1e-6)
    same_corners(found.outer, square, 1e-6)
    assert found.gap <= 1e-6
    assert len(calls) <= 12
    assert area(found.inner) == pytest.approx(4.0)


def test_a_disc_is_closed_in_to_the_tolerance():
    found = enclose(disc(3.0, (1.0, -2.0)))
    assert 0.0 < found.gap <= 2e-3
    away = np.linalg.norm(found.inner - [1.0, -2.0], axis=1)
    np.testing.assert_allclose(away, 3.0)
    assert np.linalg.norm(found.outer - [1.0, -2.0], axis=1).min() >= 3.0
    assert area(found.inner) < math.pi * 9.0 < area(found.outer)


def test_no_more_directions_than_allowed_and_the_gap_says_so():
    found = enclose(disc(1.0), most=8)
    assert len(found.inner) == len(found.outer) == 8
    # an octagon in a circle and one around it
    corner = 1.0 / math.cos(math.pi / 8.0)
    assert found.gap == pytest.approx(corner - math.cos(math.pi / 8.0))


@pytest.mark.parametrize("angle", [0.0, 0.2, math.pi / 4, math.pi / 2, 2.0])
def test_a_segment_is_two_corners(angle):
    along = np.array([math.cos(angle), math.sin(angle)])
    ends = [[10.0, 3.0] - 2.0 * along, [10.0, 3.0] + 5.0 * along]
    found = enclose(hull_of(ends))
    same_corners(found.inner, ends, 1e-5)
    assert found.gap <= 1e-5


def test_a_point_is_one_corner():
    found = enclose(hull_of([[4.0, -7.0]]))
    np.testing.assert_allclose(found.inner, [[4.0, -7.0]])
    np.testing.assert_allclose(found.outer, [[4.0, -7.0]], atol=1e-6)
    assert found.gap == pytest.approx(0.0, abs=1e-9)


def test_an_empty_set_has_no_polygon():
    assert enclose(lambda normal: None) is None


def test_a_set_that_is_empty_only_in_one_direction_is_refused():
    touching = hull_of(SQUARE)
    with pytest.raises(SolverError, match="no farthest point toward"):
        enclose(lambda normal: touching(normal) if normal[0] > 0.5 else None)


def test_other_units():
    polygon = Polygon(SQUARE, 2.0 * SQUARE, 0.5, (None,) * 4).scaled(np.array([10.0, 0.1]))
    np.testing.assert_allclose(polygon.inner[2], [10.0, 0.1])
    np.testing.assert_allclose(polygon.outer[0], [-20.0, -0.2])
    assert polygon.gap == 0.5
