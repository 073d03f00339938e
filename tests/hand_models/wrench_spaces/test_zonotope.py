"""Half-spaces of zonotopes, against hulls of all their corners and against pycapacity."""

import itertools

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog
from scipy.spatial import KDTree

from hand_models.wrench_spaces import WRENCH_SCALE, Row, WrenchSpace, hull_facets
from hand_models.wrench_spaces.half_spaces import affine_hull
from tests.suite.helpers.shares import given_some
from tests.suite.helpers.zonotopes import half_spaces

SEEDS = st.integers(0, 10**6)


def random_generators(rng: np.random.Generator) -> np.ndarray:
    """Few generators in 1 to 5 dimensions: general, dependent, parallel, zero or flat."""
    d = int(rng.integers(1, 6))
    n = int(rng.integers(1, 8))
    kind = rng.integers(4)
    if kind == 0:
        return rng.normal(size=(d, n))
    if kind == 1:
        return rng.integers(-1, 2, (d, n)).astype(float)
    if kind == 2:
        few = rng.normal(size=(d, max(1, n // 2)))
        return few[:, rng.integers(few.shape[1], size=n)] * rng.choice([-2.0, 0.5, 1.0], n)
    flat = int(rng.integers(1, d + 1))
    return rng.normal(size=(d, flat)) @ rng.normal(size=(flat, n))


def corners(G: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    return np.array([G @ x for x in itertools.product(*zip(lower, upper, strict=True))])


def brute_force(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Facets of the points' hull in their affine hull, (normal, offset) each, and its basis."""
    directions, reach = affine_hull(points - points[0])
    if not len(reach):
        return np.zeros((0, points.shape[1] + 1)), directions
    normals, offsets = hull_facets((points - points[0]) @ directions.T)
    normals = normals @ directions
    return np.column_stack([normals, offsets + normals @ points[0]]), directions


def same_rows(one: np.ndarray, other: np.ndarray, tolerance: float) -> None:
    """Each row of one has a partner in the other, and there are as many."""
    assert len(one) == len(other)
    if len(one):
        assert KDTree(one).query(other)[0].max() < tolerance
        assert KDTree(other).query(one)[0].max() < tolerance


@given(SEEDS)
def test_half_spaces_are_the_facets_of_the_hull_of_all_corners(seed):
    rng = np.random.default_rng(seed)
    G = random_generators(rng)
    lower = rng.uniform(-1.0, 1.0, G.shape[1])
    upper = lower + rng.uniform(0.1, 2.0, G.shape[1])
    origin = rng.normal(size=G.shape[0])
    found = half_spaces(G, lower, upper, origin)
    points = corners(G, lower, upper) + origin
    facets, directions = brute_force(points)
    same_rows(np.column_stack([found.normals, found.offsets]), facets, 1e-6)
    # the affine hull: all corners on the equations, which are orthogonal to its directions
    assert len(found.equation_normals) == G.shape[0] - len(directions)
    on = points @ found.equation_normals.T - found.equation_offsets
    np.testing.assert_allclose(on, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.equation_normals @ directions.T, 0.0, atol=1e-9)


@given_some(8, 100, SEEDS)
def test_no_corner_is_outside_and_every_half_space_is_a_facet(seed):
    rng = np.random.default_rng(seed)
    G = rng.integers(-2, 3, (6, 9)).astype(float)
    lower, upper = -rng.uniform(0.5, 1.0, 9), rng.uniform(0.5, 1.0, 9)
    found = half_spaces(G, lower, upper)
    points = corners(G, lower, upper)
    heights = points @ found.normals.T - found.offsets
    assert heights.max() < 1e-9
    rank = np.linalg.matrix_rank(G)
    for height in heights.T:
        touching = points[height > -1e-9]
        assert np.linalg.matrix_rank(touching - touching[0], tol=1e-9) == rank - 1
    assert len(np.unique(np.round(found.normals, 9) + 0.0, axis=0)) == len(found.normals)


def test_a_hexagon_by_hand():
    """Two sides of a square and its diagonal, from zero: (0,0) (1,0) (2,1) (2,2) (1,2) (0,1)."""
    found = half_spaces([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], np.zeros(3), np.ones(3))
    q = np.sqrt(0.5)
    by_hand = [[1, 0, 2], [-1, 0, 0], [0, 1, 2], [0, -1, 0], [q, -q, q], [-q, q, q]]
    same_rows(np.column_stack([found.normals, found.offsets]), np.array(by_hand), 1e-12)


def test_a_rhombic_dodecahedron_by_hand():
    """Four diagonals of a cube: twelve faces, normal to the diagonals of its faces."""
    G = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]]).T
    found = half_spaces(G, -np.ones(4), np.ones(4))
    q = np.sqrt(0.5)
    by_hand = [
        [*np.insert([a * q, b * q], zero, 0.0), 4.0 * q]
        for zero in range(3)
        for a in (-1.0, 1.0)
        for b in (-1.0, 1.0)
    ]
    same_rows(np.column_stack([found.normals, found.offsets]), np.array(by_hand), 1e-12)


def test_generators_that_differ_by_rounding_from_dependent_ones_cut_nothing_off():
    rng = np.random.default_rng(1)
    plain = rng.integers(-1, 2, (4, 7)).astype(float)
    for size in (1e-16, 1e-13, 1e-10, 1e-8, 1e-6):
        G = plain + size * rng.normal(size=plain.shape)
        found = half_spaces(G, np.zeros(7), np.ones(7))
        points = corners(G, np.zeros(7), np.ones(7))
        assert (points @ found.normals.T - found.offsets).max() < 1e-12
        for direction in rng.normal(size=(10, 4)):
            reach = linprog(-direction, found.normals, found.offsets, bounds=(None, None))
            assert -reach.fun == pytest.approx((points @ direction).max(), abs=1e-6 + 10.0 * size)


def test_a_point_and_a_segment():
    point = half_spaces(np.ones((3, 2)), [1.0, 2.0], [1.0, 2.0], [0.0, 0.0, 1.0])
    assert point.normals.shape == (0, 3)
    np.testing.assert_allclose(
        np.linalg.solve(point.equation_normals, point.equation_offsets), [3.0, 3.0, 4.0]
    )
    line = half_spaces([[3.0], [4.0]], [-1.0], [1.0])
    same_rows(
        np.column_stack([line.normals, line.offsets]),
        np.array([[0.6, 0.8, 5.0], [-0.6, -0.8, 5.0]]),
        1e-12,
    )


def test_more_than_64_generators_in_the_plane():
    turns = np.linspace(0.0, np.pi, 70, endpoint=False)
    found = half_spaces([np.cos(turns), np.sin(turns)], -np.ones(70), np.ones(70))
    assert len(found.normals) == 140
    # a regular polygon of 140 sides of length 2: its inner radius is cot(π/140)
    np.testing.assert_allclose(found.offsets, 1.0 / np.tan(np.pi / 140.0))


def twelve(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Twelve generators in 6-D, their moments ten times smaller, with bounds."""
    rng = np.random.default_rng(seed)
    G = rng.normal(size=(6, 12)) / WRENCH_SCALE[:, None]
    lower = rng.uniform(-1.0, 0.0, 12)
    return G, lower, lower + rng.uniform(0.5, 2.0, 12)


@pytest.mark.parametrize("seed", range(3))
def test_the_same_half_spaces_as_pycapacity(seed):
    algorithms = pytest.importorskip("pycapacity.algorithms")
    G, lower, upper = twelve(seed)
    found = half_spaces(G, lower, upper)
    H, d = algorithms.hyper_plane_shift_method(G, lower, upper)
    theirs = np.column_stack([H, np.ravel(d)])
    assert len(theirs) == 2 * 792
    same_rows(np.column_stack([found.normals, found.offsets]), theirs, 1e-9)


def test_a_wrench_space_of_independent_loads_is_a_zonotope_in_scaled_wrenches():
    G, lower, upper = twelve(7)
    names = [f"load{i}" for i in range(12)]
    space = WrenchSpace(
        origin=np.arange(6.0),
        generators=G,
        columns=tuple(names),
        rows=tuple(
            Row(None, None, name, kind, name) for kind in ("limit", "hard") for name in names
        ),
        L=np.eye(12),
        l0=10.0 * np.ones(12),
        s=upper + 10.0,
        H=-np.eye(12),
        h=-lower,
    )
    found = space.half_spaces()
    expected = half_spaces(G * WRENCH_SCALE[:, None], lower, upper, np.arange(6.0) * WRENCH_SCALE)
    same_rows(
        np.column_stack([found.normals / WRENCH_SCALE, found.offsets]),
        np.column_stack([expected.normals, expected.offsets]),
        1e-9,
    )
