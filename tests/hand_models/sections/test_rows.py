"""Faces that turn over many sections at once: as over each of them, and first met as sampled."""

import math

import numpy as np
from hypothesis import given, settings, strategies as st

from hand_models import Edge
from hand_models.sections import ProfileSection, Span
from tests.suite.helpers.hands import HAND
from tests.suite.helpers.rocks import distance, random_axes, random_ellipsoid

MODEL = HAND.finger
FACE = (MODEL.tile_range[0], MODEL.joint_spacing, MODEL.tile_height)
seeds = st.integers(0, 2**32 - 1)


def random_faces(rng, count):
    """Joints, faces and ranges of angles, as of phalanges and of links of them."""
    joint = rng.uniform(-0.01, 0.05, count) + 1j * rng.uniform(-0.02, 0.01, count)
    start = rng.uniform(-0.01, 0.03, count)
    span = Span.of(start, start + rng.uniform(0.01, 0.05, count), rng.uniform(0.0, 0.01, count))
    low = rng.uniform(-0.8, 0.5, count)
    return joint, span, low, low + rng.uniform(0.2, 2.2, count)


def random_cuts(rng, count):
    """Oblique cuts of edges, or of ellipsoids."""
    edged = rng.random() < 0.6
    found = []
    while len(found) < count:
        if edged:
            hold = Edge(10.0 ** rng.uniform(-2.5, -0.5), rng.uniform(0.3, 3.0))
        else:
            hold = random_ellipsoid(rng)
        axes = random_axes(rng, 0.5)
        origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
        section = hold.section(origin, axes[:, 0], axes[:, 2])
        if isinstance(section, ProfileSection):
            found.append(section)
    return found


@settings(max_examples=150, deadline=None)
@given(seeds)
def test_rows_are_as_their_sections_one_by_one(seed):
    rng = np.random.default_rng(seed)
    sections = random_cuts(rng, int(rng.integers(1, 6)))
    of = rng.integers(len(sections), size=12)
    joint, span, low, high = random_faces(rng, len(of))
    with np.errstate(invalid="ignore", divide="ignore"):
        rock = ProfileSection.gathered(sections).take(of)
        rests = rock.rests(joint, span, low, high)
        clearances = rock.clearances(np.stack([joint, joint + 0.01]))
        faces = rock.face_clearances(joint, span, low)
    for i, section in enumerate(sections[k] for k in of):
        place = joint[i].real, joint[i].imag
        face = (*span.ends[:, i].tolist(), float(span.height[i]))
        np.testing.assert_allclose(clearances[0, i], section.clearance(place), rtol=1e-9)
        beside = place[0] + 0.01, place[1]
        np.testing.assert_allclose(clearances[1, i], section.clearance(beside), rtol=1e-9)
        cut = section.face_clearance(place, *face, float(low[i]))
        np.testing.assert_allclose(faces[i], cut, rtol=1e-8, atol=1e-14)
        assert rests.blocked[i] == (cut <= 0.0)
        alone = section.rest(place, *face, float(low[i]), float(high[i]))
        if rests.blocked[i]:
            continue
        assert math.isnan(rests.angle[i]) == (alone is None)
        if alone is not None:
            np.testing.assert_allclose(rests.angle[i], alone.angle, atol=1e-12)
            assert rests.flat[i] == alone.flat
            if not alone.flat:
                np.testing.assert_allclose(rests.distance[i], alone.distance, atol=1e-9)


@settings(max_examples=80, deadline=None)
@given(seeds)
def test_a_face_rests_where_it_first_meets_an_oblique_cut(seed):
    """By the rock's distance function alone: clear until then, and on it there."""
    rng = np.random.default_rng(seed)
    axes = random_axes(rng, 0.5)
    if rng.random() < 0.6:
        hold = Edge(10.0 ** rng.uniform(-2.5, -0.5), rng.uniform(0.3, 3.0))
    else:
        hold = random_ellipsoid(rng)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.0, 0.03)])
    section = hold.section(origin, axes[:, 0], axes[:, 2])
    low, high = -0.5, 1.7
    if not isinstance(section, ProfileSection):
        return

    def clearance(angle, along):
        u, v = np.cos(angle), np.sin(angle)
        s, t = along * u - FACE[2] * v, along * v + FACE[2] * u
        points = origin + s[..., None] * axes[:, 0] + t[..., None] * axes[:, 2]
        return distance(hold, points)

    face = np.linspace(*FACE[:2], 100)
    if clearance(np.array(low), face).min() <= 1e-6:
        return
    rest = section.rest((0.0, 0.0), *FACE, low, high)
    end = high if rest is None else rest.angle - 1e-5
    angles = np.linspace(low, end, 100)
    # what a sample between two places may miss of the sharpest edge
    missed = (face[1] - face[0]) ** 2 / 8.0 / 10.0**-2.5
    assert clearance(angles[:, None], face).min() > -missed
    if rest is not None:
        place = np.array(0.5 * sum(FACE[:2]) if rest.flat else rest.distance)
        near = 1e-4 if rest.flat else 1e-9
        assert abs(clearance(np.array(rest.angle), place)) < near
        assert clearance(np.array(rest.angle), face).min() > -max(near, missed)
