"""Hulls of planar wrenches: cuts, sections, reaches; worked values and linear programs."""

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import linprog

from hand_models.experiments import (
    PLANAR_SCALE,
    clipped_vertices,
    distance_along,
    extents,
    in_paper_signs,
    section,
    vertices,
    volume,
)

BOX = np.array([[x, z, m] for x in (-40.0, 40.0) for z in (-20.0, 30.0) for m in (-1.0, 1.0)])
CLOUDS = st.integers(0, 10_000).map(
    lambda seed: np.random.default_rng(seed).normal(size=(30, 3)) / PLANAR_SCALE
)


def inside(points, wrench):
    """Whether a wrench is a convex combination of points, by a linear program."""
    A = np.vstack([(points * PLANAR_SCALE).T, np.ones(len(points))])
    b = np.append(np.asarray(wrench) * PLANAR_SCALE, 1.0)
    found = linprog(np.zeros(len(points)), A_eq=A, b_eq=b, method="highs")
    return found.status == 0


def farthest(points, start, direction):
    """The largest s with start + s · direction a convex combination, by a linear program."""
    A = np.zeros((4, len(points) + 1))
    A[:3, :-1], A[3, :-1] = (points * PLANAR_SCALE).T, 1.0
    A[:3, -1] = -direction * PLANAR_SCALE
    found = linprog(
        np.append(np.zeros(len(points)), -1.0),
        A_eq=A,
        b_eq=np.append(start * PLANAR_SCALE, 1.0),
        method="highs",
    )
    return -found.fun if found.status == 0 else np.nan


def test_the_papers_moment_is_minus_the_contracts():
    wrench = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(in_paper_signs(wrench), [[1.0, 3.0, -5.0]])


def test_a_box_cut_at_no_pull_keeps_its_lower_part():
    below = clipped_vertices(np.vstack([BOX, BOX.mean(axis=0)]))
    assert {tuple(v) for v in below} == {
        (x, z, m) for x in (-40.0, 40.0) for z in (-20.0, 0.0) for m in (-1.0, 1.0)
    }
    assert extents(below) == (40.0, -20.0, 1.0)
    assert volume(below) == pytest.approx(80.0 * 20.0 * 2.0)
    assert clipped_vertices(np.add(BOX, (0.0, -50.0, 0.0))).shape == (8, 3)
    assert clipped_vertices(np.add(BOX, (0.0, 21.0, 0.0))).shape == (0, 3)


def test_a_box_in_the_plane_of_a_cable():
    """F_x = 80 M_y cuts F_x at ±40 with M_y at ±0.5: a rectangle."""
    corners = section(BOX, (1.0, 0.0, -80.0))
    assert {tuple(np.round(c, 12)) for c in corners} == {
        (x, z, x / 80.0) for x in (-40.0, 40.0) for z in (-20.0, 30.0)
    }
    assert section(np.add(BOX, (0.0, 0.0, 5.0)), (0.0, 0.0, 1.0)).shape == (0, 3)


def test_reaches_of_a_box():
    directions = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [80.0, 0.0, 1.0]])
    np.testing.assert_allclose(distance_along(BOX, directions), [40.0, 20.0, 0.5])
    np.testing.assert_allclose(
        distance_along(BOX, directions, (10.0, 0.0, 0.0)), [30.0, 20.0, 0.375]
    )
    # from beyond the box: toward it, away from it, past it
    away = distance_along(BOX, np.array([[-1.0, 0, 0], [1.0, 0, 0], [0, 1.0, 0]]), (50.0, 0.0, 0.0))
    np.testing.assert_allclose(away, [90.0, np.nan, np.nan])


# A hull with the origin on its boundary -----------------------------------------------------------

ROUNDING = (-1e-12, -1e-15, 0.0, 1e-15, 1e-12)
"""By how much rounding may move a hull of this size."""

HALF = np.array([[x, z, m] for x in (-40.0, 40.0) for z in (-20.0, 0.0) for m in (-1.0, 1.0)])
"""The box without its upper part: the origin is in the middle of a face."""


@pytest.mark.parametrize("tilt", ROUNDING)
@pytest.mark.parametrize("shift", ROUNDING)
def test_reaches_along_a_face_do_not_jump_with_rounding(shift, tilt):
    """F_x runs along the face the origin is on, which rounding tilts and shifts."""
    moved = HALF + np.outer(shift + tilt * HALF[:, 0], (0.0, 1.0, 0.0))
    directions = np.array([[1.0, 0, 0], [-1.0, 0, 0], [80.0, 0, 1.0], [0, -1.0, 0], [1.0, -1.0, 0]])
    expected = [40.0, 40.0, 0.5, 20.0, 20.0]
    np.testing.assert_allclose(distance_along(moved, directions), expected, rtol=1e-11)
    # out of the face, there is nothing
    assert distance_along(moved, np.array([[0.0, 1.0, 0.0]]))[0] == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("shift", ROUNDING)
def test_reaches_along_an_edge_and_from_a_corner_do_not_jump_with_rounding(shift):
    edge = HALF - (40.0, 0.0, 0.0) + shift
    directions = np.array([[0, 0, 1.0], [0, 0, -1.0], [-1.0, 0, 0], [0, -1.0, 0], [-1.0, -1.0, 0]])
    np.testing.assert_allclose(
        distance_along(edge, directions), [1.0, 1.0, 80.0, 20.0, 20.0], rtol=1e-10
    )
    corner = HALF - (40.0, 0.0, 1.0) + shift
    directions = np.array([[0, 0, -1.0], [-1.0, 0, 0], [0, -1.0, 0], [-1.0, 0, -1.0]])
    np.testing.assert_allclose(
        distance_along(corner, directions), [2.0, 80.0, 20.0, 2.0], rtol=1e-10
    )
    # what is more than rounding beyond the face misses the hull
    assert np.isnan(distance_along(HALF - (0.0, 1e-6, 0.0), np.array([[1.0, 0.0, 0.0]]))).all()


@pytest.mark.parametrize("shift", ROUNDING)
def test_a_plane_that_touches_a_hull_meets_its_face_its_edge_or_its_corner(shift):
    def met(normal, at=(0.0, 0.0, 0.0)):
        return sorted(tuple(np.round(c, 9) + 0.0) for c in section(HALF + shift - at, normal))

    face = [(x, 0.0, m) for x in (-40.0, 40.0) for m in (-1.0, 1.0)]
    assert met((0.0, 1.0, 0.0)) == face
    assert met((0.0, -1e3, 0.0)) == face
    assert met((1.0, 1.0, 0.0), (40.0, 0.0, 0.0)) == [(0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]
    assert met((1.0, 1.0, 1.0), (40.0, 0.0, 1.0)) == [(0.0, 0.0, 0.0)]
    # a plane of loading through the same edge, and through the middle of the face
    assert met((0.0, 0.0, 1.0)) == [(x, z, 0.0) for x in (-40.0, 40.0) for z in (-20.0, 0.0)]
    # beyond it by more than rounding
    assert met((0.0, 1.0, 0.0), (0.0, 1e-6, 0.0)) == []


@pytest.mark.parametrize("shift", ROUNDING)
def test_a_cut_along_a_face_takes_all_of_a_hull_or_nothing(shift):
    moved = np.sort(clipped_vertices(np.add(HALF, (0.0, shift, 0.0))), axis=0)
    np.testing.assert_allclose(moved, np.sort(HALF, axis=0), atol=1e-11)
    assert clipped_vertices(np.add(HALF, (0.0, 20.0 + shift, 0.0))).shape == (0, 3)


@given(CLOUDS)
def test_what_is_cut_through_the_origin_reaches_along_its_face_as_far_as_the_hull(points):
    """The origin is inside the whole hull, where nothing is in doubt, and on the part's face."""
    below = clipped_vertices(points)
    along = np.random.default_rng(0).normal(size=(6, 3)) * (1.0, 0.0, 1.0) / PLANAR_SCALE
    ways = np.vstack([along, -along])
    whole = distance_along(points, ways)
    for shift in ROUNDING:
        moved = below + shift / PLANAR_SCALE
        np.testing.assert_allclose(distance_along(moved, ways), whole, rtol=1e-7)
    # its highest vertices are on the plane
    height = below[:, 1]
    assert (height < 1e-13).all()
    assert ((height < -1e-9) | (height > -1e-13)).all()


# Against linear programs --------------------------------------------------------------------------


@given(CLOUDS, st.floats(-0.5, 0.5), st.integers(0, 1000))
def test_a_cut_holds_what_the_hull_holds_below_the_plane(points, offset, seed):
    points = points - (0.0, offset, 0.0)
    below = clipped_vertices(points)
    assert (below[:, 1] <= 1e-9).all()
    assert all(inside(points, vertex) for vertex in below)
    for wrench in np.random.default_rng(seed).dirichlet(np.ones(len(points)), 10) @ points:
        assert inside(below, wrench) == (wrench[1] <= 0.0)


@given(CLOUDS, st.integers(0, 1000))
def test_reach_is_that_of_a_linear_program(points, seed):
    rng = np.random.default_rng(seed)
    starts = 1.5 * rng.normal(size=(10, 3)) / PLANAR_SCALE
    directions = rng.normal(size=(10, 3)) / PLANAR_SCALE
    expected = [farthest(points, s, d) for s, d in zip(starts, directions, strict=True)]
    np.testing.assert_allclose(
        distance_along(points, directions, starts), expected, rtol=1e-6, atol=1e-8
    )


@given(CLOUDS, st.integers(0, 1000))
def test_a_section_is_bounded_by_reaches_in_its_plane(points, seed):
    direction = np.random.default_rng(seed).normal(size=3) / PLANAR_SCALE
    normal = np.cross(direction, (0.0, 1.0, 0.0))
    corners = section(points, normal)
    assert np.abs(corners @ normal).max() < 1e-9
    far = distance_along(points, direction[None])[0]
    assert inside(vertices(points), 0.999 * far * direction)
    # the point on the hull is a combination of the section's corners
    assert inside(np.vstack([corners, 0.0 * corners]), 0.999 * far * direction)
