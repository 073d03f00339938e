"""Rock as points along its boundary: on it, and as long as it is; and places near it."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from hand_models import Cylinder, Edge
from hand_models.sections import (
    Disc,
    FingerRock,
    FlatRock,
    Outlines,
    PolylineSection,
)
from hand_models.sections.ellipses import Ellipse
from tests.suite.helpers.rocks import random_axes, random_ellipsoid, random_mesh, random_profile

REACH, SPACING = 0.16, 5e-4

seeds = st.integers(0, 2**32 - 1)


def outlines(section, reach=REACH, spacing=SPACING):
    """Of one section: points and lengths."""
    rock = Outlines.of([FingerRock(section)], reach, spacing)
    real = np.abs(rock.points[0]) < 1.0
    return tuple(each[0][real] for each in rock[:2])


def random_smooth(rng):
    """A half-plane, a disc, or an oblique cut of an edge, a cylinder or an ellipsoid."""
    kind = rng.integers(5)
    if kind == 0:
        turn = rng.uniform(-3.0, 3.0)
        return FlatRock(complex(math.cos(turn), math.sin(turn)), float(rng.uniform(-0.1, 0.1)))
    if kind == 1:
        centre = rng.uniform(-0.1, 0.1, 2)
        return Disc(complex(*centre), float(rng.uniform(0.01, 0.3)))
    hold = (
        Edge(float(rng.uniform(0.01, 0.1)), float(rng.uniform(0.5, 3.0))),
        Cylinder(float(rng.uniform(0.05, 1.0))),
        random_ellipsoid(rng),
    )[kind - 2]
    axes = random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
    return hold.section(origin, axes[:, 0], axes[:, 2])


def random_polyline(rng):
    """A cut of a profile, or of a mesh."""
    hold = random_mesh(rng) if rng.random() < 0.1 else random_profile(rng)
    axes = random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
    return hold.section(origin, axes[:, 0], axes[:, 2])


@given(seeds)
def test_points_lie_on_the_rock_at_most_a_spacing_apart(seed):
    section = random_smooth(np.random.default_rng(seed))
    assume(section is not None)
    points, lengths = outlines(section)
    assert (np.abs(points) <= REACH + 1e-12).all()  # but for rounding
    assert (lengths <= SPACING * (1.0 + 1e-6)).all()
    # chords of the sharpest rock here leave it by a few micrometres
    assert (np.abs(section.clearances(points)) < 5e-6).all()


@given(seeds)
def test_outlines_have_the_rock_on_their_left(seed):
    section = random_smooth(np.random.default_rng(seed))
    assume(section is not None)
    for chain in section.outline(REACH, SPACING):
        way = np.diff(chain)
        middle, left = chain[:-1] + 0.5 * way, 1e-4j * way / np.abs(way)
        near = np.abs(middle) <= REACH
        assert (section.clearances((middle + left)[near]) < 0.0).all()
        assert (section.clearances((middle - left)[near]) > 0.0).all()


@pytest.mark.parametrize("kind", [random_smooth, random_polyline])
@given(seeds)
def test_distances_of_many_places_are_their_clearances_one_by_one(kind, seed):
    rng = np.random.default_rng(seed)
    section = kind(rng)
    assume(section is not None)
    places = rng.uniform(-0.06, 0.06, (3, 10)) + 1j * rng.uniform(-0.06, 0.06, (3, 10))
    found = section.clearances(places)
    assert found.shape == places.shape
    for i, place in np.ndenumerate(places):
        exact = section.clearance((place.real, place.imag))
        assert found[i] == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.05, -0.1])
def test_flat_rock_is_as_long_as_within_reach(offset):
    points, lengths = outlines(FlatRock(complex(0.6, 0.8), offset))
    assert lengths.sum() == pytest.approx(2.0 * math.sqrt(REACH**2 - offset**2), abs=2 * SPACING)
    np.testing.assert_allclose((points * (0.6 - 0.8j)).real, offset, atol=1e-12)


@pytest.mark.parametrize("radius", [0.02, 0.05, 0.1])
def test_a_disc_within_reach_is_as_long_as_its_circle(radius):
    centre = 0.03 + 0.01j
    points, lengths = outlines(Disc(centre, radius))
    assert lengths.sum() == pytest.approx(math.tau * radius, rel=1e-3)
    np.testing.assert_allclose(np.abs(points - centre), radius, atol=SPACING**2 / radius)


def test_a_large_disc_is_as_long_as_its_arc_within_reach():
    centre, radius = 0.32j, 0.3
    _, lengths = outlines(Disc(centre, radius))
    cosine = (0.32**2 + radius**2 - REACH**2) / (2.0 * 0.32 * radius)
    assert lengths.sum() == pytest.approx(2.0 * radius * math.acos(cosine), abs=3 * SPACING)


def test_an_upright_cut_of_a_cylinder_is_a_circle():
    """The same points as the disc's, up to where along it they begin."""
    section = Ellipse(-0.01 + 0.08j, (1.0 + 0j, 0j), 0.06, 1.0)
    points, lengths = outlines(section)
    # the crest is where the profile is zero
    centre = -0.01 + 0.08j
    np.testing.assert_allclose(np.abs(points - centre), 0.06, atol=1e-5)
    inside = np.abs(points - centre)
    assert len(inside) > 100
    assert lengths.sum() <= math.tau * 0.06


def test_an_edge_has_its_rounding_and_both_faces():
    half = math.radians(45.0)
    section = Edge(0.01, 2.0 * half).section([0.0, 0.0, -0.03], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    points, _ = outlines(section)
    # as far from its axis as the rounding, along their normals
    normals = np.exp(1j * np.radians([-45.0, -135.0]))
    faces = [(np.abs(((points - 0.04j) * n.conj()).real - 0.01) < 1e-9).sum() for n in normals]
    assert min(faces) > 100
    assert (np.abs(points - 0.04j) < 0.0101).sum() > 10
    # without a gap between them
    order = np.argsort(points.real)
    assert np.abs(np.diff(points[order])).max() < 2.0 * SPACING


def test_pieces_of_a_polyline_are_parted_evenly():
    corners = np.array([[-0.05, 0.02], [0.0, 0.02], [0.0, 0.01], [0.03, 0.01]])
    points, lengths = outlines(PolylineSection([corners]), spacing=3e-3)
    assert lengths.sum() == pytest.approx(0.05 + 0.01 + 0.03, abs=1e-12)
    assert lengths.max() <= 3e-3
    level, step = points.imag == 0.02, points.real == 0.0
    assert level.sum() >= 16
    assert step.sum() >= 3


def test_closed_rock_is_seen_all_around():
    turn = np.linspace(0.0, math.tau, 200)
    ring = 0.04 + 0.02 * np.exp(1j * turn)
    section = PolylineSection([np.column_stack([ring.real, ring.imag])])
    points, lengths = outlines(section)
    assert lengths.sum() == pytest.approx(math.tau * 0.02, rel=1e-3)
    np.testing.assert_allclose(np.abs(points - 0.04), 0.02, atol=1e-5)


def test_what_is_out_of_reach_is_left_out():
    for section in (
        FlatRock(1j, 0.2),
        Disc(0.5j, 0.3),
        PolylineSection([np.array([[-1.0, 0.2], [1.0, 0.2]])]),
        None,
    ):
        points, _ = outlines(section)
        assert len(points) == 0


def test_fingers_with_less_rock_are_filled_with_places_far_off():
    rock = Outlines.of([FingerRock(None), FingerRock(FlatRock(1j, 0.0))], REACH, SPACING)
    assert rock.points.shape == rock.lengths.shape
    assert rock.points.shape[0] == 2
    assert (np.abs(rock.points[0]) > 100.0).all()
    assert rock.lengths[0].sum() < 1e-6
