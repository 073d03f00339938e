"""Rock of straight pieces: first contact, distances and normals, against sampling and circles."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.rock import Profile
from hand_models.sections import Disc, Face, PolylineSection, Rest, strung
from hand_models.sections.compiled_polylines import nearest_segments, segment_blocks
from tests.suite.helpers.rocks import distance
from tests.suite.helpers.shares import given_some

LOW, HIGH = -0.52, 1.75
START, END, HEIGHT = 0.0085, 0.0431, 0.0047
FACE = Face(START, END, HEIGHT)

seeds = st.integers(0, 2**32 - 1)


def ragged(rng: np.random.Generator) -> np.ndarray:
    """An outline with overhangs now and then, rock on its left, drawn as far as a face reaches."""
    x = np.sort(np.append(rng.uniform(-0.1, 0.2, int(rng.integers(1, 28))), [-0.1, 0.2]))
    z = 0.02 + rng.uniform(0.0, 0.04) * rng.random(len(x))
    return np.column_stack([x, z])


def face(joint: np.ndarray, angle: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Points of a face, shape (angles, points, 2)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([joint[0] + along * c - HEIGHT * s, joint[1] + along * s + HEIGHT * c], axis=-1)


def outside(outline: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance from rock below an outline, by a code of its own."""
    in_hold = np.stack([points[..., 0], 0.0 * points[..., 0], points[..., 1]], axis=-1)
    return distance(Profile(outline), in_hold)


@given_some(12, 150, seeds)
def test_a_face_rests_where_it_first_meets_the_rock(seed):
    rng = np.random.default_rng(seed)
    outline = ragged(rng)
    joint = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.03, 0.005)])
    section = PolylineSection([outline])
    if section.face_clearance(complex(*joint), cmath.rect(1.0, LOW), FACE) <= 0.0:
        return
    found = section.rest(complex(*joint), FACE, LOW, HIGH)
    along = np.linspace(START, END, 120)
    angles = np.linspace(LOW, HIGH if found is None else found.angle, 80)
    clear = outside(outline, face(joint, angles, along)).min(axis=1)
    assert clear[:-1].min() > -1e-6
    if found is not None:
        # it touches, at the place that is told, and a little further it would be in the rock
        assert clear[-1] > -1e-6
        place = face(joint, np.array([found.angle]), np.array([found.distance]))[0, 0]
        assert START <= found.distance <= END
        assert abs(outside(outline, place[None])[0]) < 2e-3
        # a spike may stand between the points of a grid: a fine one about where it touches
        about = found.distance + np.linspace(-1e-4, 1e-4, 2001)
        along = np.append(np.linspace(START, END, 4000), about)
        beyond = face(joint, np.array([found.angle + 1e-4]), along)
        assert outside(outline, beyond).min() < 0.0


@given(seeds)
def test_on_a_fine_circle_a_face_rests_as_on_the_disc(seed):
    rng = np.random.default_rng(seed)
    radius = 10.0 ** rng.uniform(-1.5, 0.0)
    centre = np.array([rng.uniform(-0.03, 0.03), radius + rng.uniform(0.008, 0.03)])
    turn = np.arange(-math.pi, math.pi, 0.0005 / radius)
    ring = centre + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    disc = Disc(complex(*centre), radius)
    ours = PolylineSection([np.vstack([ring, ring[:1]])])
    want = disc.rest(0j, FACE, LOW, HIGH)
    got = ours.rest(0j, FACE, LOW, HIGH)
    if want is None:
        assert got is None
        return
    assert got.angle == pytest.approx(want.angle, abs=1e-4)
    assert got.distance == pytest.approx(want.distance, abs=5e-5)
    points = rng.uniform(-0.1, 0.1, (50, 2))
    np.testing.assert_allclose(
        ours.clearances(points @ [1.0, 1j]), [disc.clearance(tuple(p)) for p in points], atol=2e-6
    )
    normal = ours.normal((float(ring[7, 0]), float(ring[7, 1])))
    np.testing.assert_allclose(normal, (ring[7] - centre) / radius, atol=0.02)


@given(seeds)
def test_clearance_is_the_signed_distance(seed):
    rng = np.random.default_rng(seed)
    outline = ragged(rng)
    section = PolylineSection([outline])
    # beside an open end there is no rock, and its own code takes the rock to go on below
    points = rng.uniform([outline[0, 0], -0.05], [outline[-1, 0], 0.08], (100, 2))
    want = outside(outline, points)
    ends = np.minimum(*(np.linalg.norm(points - outline[i], axis=1) for i in (0, -1)))
    inner = np.abs(want) < 0.999 * ends
    np.testing.assert_allclose(
        section.clearances(points @ [1.0, 1j])[inner], want[inner], atol=1e-12
    )


def test_a_face_on_a_straight_wall_lies_flat():
    wall = PolylineSection([np.array([[-0.2, 0.02], [0.2, 0.02]])])
    assert wall.rest(complex(0.0, 0.02 - HEIGHT), FACE, LOW, HIGH) == Rest(
        pytest.approx(0.0, abs=1e-12), pytest.approx(0.5 * (START + END)), flat=True
    )


def test_a_face_half_on_a_ledge_touches_in_the_middle_of_what_it_shares():
    ledge = PolylineSection([np.array([[-0.2, 0.02], [0.03, 0.02], [0.03, 0.2]])])
    rest = ledge.rest(complex(0.0, 0.02 - HEIGHT), FACE, LOW, HIGH)
    assert rest.angle == pytest.approx(0.0, abs=1e-9)
    assert not rest.flat
    assert rest.distance == pytest.approx(0.5 * (START + 0.03), abs=1e-5)


def test_a_face_meets_a_lone_tooth_with_its_inside():
    # a tooth at 25 mm whose tip is 10 mm above the joint: ρ² = a² + h²
    tooth = PolylineSection([np.array([[0.02, 0.3], [0.025, 0.01], [0.03, 0.3]])])
    rest = tooth.rest(0j, FACE, LOW, HIGH)
    along = math.sqrt(0.025**2 + 0.01**2 - HEIGHT**2)
    assert rest.distance == pytest.approx(along, abs=1e-9)
    assert rest.angle == pytest.approx(
        math.atan2(0.01, 0.025) - math.atan2(HEIGHT, along), abs=1e-12
    )


def test_where_rock_ends_nothing_is_touched():
    stub = PolylineSection([np.array([[-0.2, 0.02], [0.0, 0.02]])])
    assert stub.rest(0.01 + 0j, FACE, 0.0, HIGH) is None
    assert stub.clearance((0.01, 0.05)) > 0.0
    assert stub.clearance((-0.05, 0.05)) == pytest.approx(-0.03)


@given(seeds)
def test_the_nearest_segment_is_found_among_all(seed):
    rng = np.random.default_rng(seed)
    pieces = [
        # long segments beside short ones
        np.cumsum(10.0 ** rng.uniform(-4.0, -1.0, (n, 1)) * rng.normal(size=(n, 2)), axis=0)
        for n in rng.integers(2, 60, rng.integers(1, 4))
    ]
    points = rng.normal(size=(30, 2)) * 10.0 ** rng.uniform(-3.0, 0.0)
    start = np.concatenate([piece[:-1] for piece in pieces])
    step = np.concatenate([np.diff(piece, axis=0) for piece in pieces])
    along = ((points[:, None] - start) * step).sum(axis=2) / (step**2).sum(axis=1)
    places = start + np.clip(along, 0.0, 1.0)[..., None] * step
    want = np.linalg.norm(points[:, None] - places, axis=2)
    vertices, ends = strung(pieces)
    at, part, away = nearest_segments(vertices, segment_blocks(vertices, ends), points)
    segment = at - np.searchsorted(np.cumsum([len(piece) for piece in pieces]), at, side="right")
    np.testing.assert_allclose(np.hypot(*away.T), want.min(axis=1), atol=1e-14)
    np.testing.assert_allclose(want[np.arange(30), segment], want.min(axis=1), atol=1e-14)
    found = start[segment] + part[:, None] * step[segment]
    np.testing.assert_allclose(points - found, away, atol=1e-14)


def test_the_highest_rock_in_a_strip_counts_places_between_vertices():
    roof = PolylineSection([np.array([[-0.2, 0.2], [0.0, 0.0], [0.2, 0.2]])])
    windows = np.array([[-0.1, 0.1], [0.03, 0.05], [0.3, 0.4]])
    assert roof.highest(*windows.T) == pytest.approx([0.0, 0.03, math.inf])
