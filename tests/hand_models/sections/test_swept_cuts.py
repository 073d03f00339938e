"""Planes through smooth holds, against distances of places in space from the holds' rock."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from hand_models import Cylinder, Edge, Ellipsoid, Plane, Sphere
from hand_models.rock import Hold
from hand_models.sections import Face, SmoothSection
from hand_models.sections.ellipses import Ellipse
from tests.suite.helpers.rocks import distance, random_axes, random_ellipsoid, random_hold
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)

FACE = Face(0.0085, 0.0431, 0.0047)


def cut_through(hold: Hold, origin: np.ndarray, axes: np.ndarray) -> SmoothSection | None:
    """The rock in the plane of the first and the third axis."""
    return hold.section(origin, axes[:, 0], axes[:, 2])


def random_cut(seed: int):
    """A cut, the distance of places in its plane from the rock, and a joint off the rock."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.2:
        # small against a phalanx, and far from round
        hold = Ellipsoid(tuple(10.0 ** rng.uniform([-1.7, -1.7, -1.7], [0.0, 0.0, -1.0])))
    else:
        hold = random_ellipsoid(rng) if rng.random() < 0.4 else random_hold(rng)
    axes = random_axes(rng, float(rng.choice([1e-4, 0.5])))
    origin = np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(-0.03, 0.0)])
    cut = cut_through(hold, origin, axes)

    def away(points):
        points = np.asarray(points)[..., None]
        return distance(hold, origin + points.real * axes[:, 0] + points.imag * axes[:, 2])

    joint = complex(*rng.uniform([-0.05, -0.05], [0.05, 0.01]))
    assume(cut is not None and away(joint) >= 1e-4)
    return cut, away, joint


@given(seeds)
def test_places_are_in_the_rock_where_their_distance_is_negative(seed):
    cut, away, joint = random_cut(seed)
    rng = np.random.default_rng(seed + 1)
    points = joint + rng.normal(0.0, 0.03, 20) + 1j * rng.normal(0.0, 0.03, 20)
    for point, far in zip(points.tolist(), away(points).tolist(), strict=True):
        told = cut.distance(point)
        assert abs(far) < 1e-9 or (told > 0.0) == (far > 0.0)
        # a plane's rock is no nearer than the rock in space
        assert far < 1e-9 or told > 0.0


@given_some(12, 300, seeds)
def test_a_tangent_line_touches_the_rock_and_does_not_cut_it(seed):
    cut, away, joint = random_cut(seed)
    tangent = cut.tangent(joint, FACE.height)
    if tangent is None:
        return
    u, reach = tangent
    assert abs(u) == pytest.approx(1.0, abs=1e-12)
    assert reach > 0.0
    contact = joint + complex(reach, FACE.height) * u
    assert away(contact) == pytest.approx(0.0, abs=1e-9 * (1.0 + reach))
    assert away(contact + u * np.linspace(-0.3, 0.3, 201)).min() > -1e-9
    # the rock is on the side to which the phalanx turns
    assert away(contact + 1j * u * 1e-6) < 0.0


@given_some(12, 300, seeds, st.sampled_from([FACE.start, FACE.end]))
def test_where_a_point_on_a_circle_enters_the_rock_is_found(seed, along):
    cut, away, joint = random_cut(seed)
    arm = abs(complex(along, FACE.height))
    ways = cut.entries(joint, arm)
    for way in ways:
        before, on, after = away(joint + arm * way * np.exp(1j * np.array([-1e-5, 0.0, 1e-5])))
        assert abs(on) < 1e-9
        assert before > after - 1e-12
    angles = np.linspace(-math.pi, math.pi, 2001)
    outside = away(joint + arm * np.exp(1j * angles)) > 0.0
    into = np.flatnonzero(outside[:-1] & ~outside[1:])
    told = sorted(cmath.phase(way) for way in ways)
    for i in into.tolist():
        assert any(angles[i] - 1e-7 <= angle <= angles[i + 1] + 1e-7 for angle in told)
    # a circle that dips into the rock between two samples may have one more
    assert len(into) <= len(told) <= len(into) + 1


@given_some(12, 300, seeds, st.floats(-3.1, 3.1))
def test_a_face_is_clear_where_all_its_places_are_outside(seed, angle):
    cut, away, joint = random_cut(seed)
    u = cmath.rect(1.0, angle)
    places = joint + (np.linspace(FACE.start, FACE.end, 201) + 1j * FACE.height) * u
    least = away(places).min()
    # some cuts look at samples only
    if abs(least) > 1e-4:
        assert cut.clear(joint, u, FACE) == (least > 0.0)
    for normal in cut.partings(joint, u, FACE):
        ahead = (normal.conjugate() * (places - joint)).real.max()
        grid = joint + normal * (ahead + 1j * np.linspace(-0.2, 0.2, 101))
        assert away(grid).min() > -1e-9


@given_some(12, 150, seeds)
def test_a_face_rests_where_it_first_meets_the_rock(seed):
    """By the rock's distance function alone: clear until then, and on it there."""
    cut, away, joint = random_cut(seed)
    low, high = -0.5, 1.7
    along = np.linspace(FACE.start, FACE.end, 100)

    def clearance(angle, along):
        return away(joint + (along + 1j * FACE.height) * np.exp(1j * np.asarray(angle)))

    if not cut.clear(joint, cmath.rect(1.0, low), FACE) or clearance(low, along).min() <= 1e-6:
        return
    rest = cut.rest(joint, FACE, low, high)
    angles = np.linspace(low, high if rest is None else rest.angle - 1e-5, 100)
    # what a sample between two places may miss of the sharpest edge
    missed = (along[1] - along[0]) ** 2 / 8.0 / 10.0**-3
    assert clearance(angles[:, None], along).min() > -missed
    if rest is not None:
        near = 1e-4 if rest.flat else 1e-9
        assert abs(clearance(rest.angle, rest.distance)) < near
        assert clearance(rest.angle, along).min() > -max(near, missed)


def test_the_kinds_of_cuts():
    level, tilted = np.eye(3), random_axes(np.random.default_rng(2), 0.5)
    origin = np.array([0.05, 0.0, -0.02])
    names = {
        (type(hold).__name__, axes is level): type(cut_through(hold, origin, axes)).__name__
        for hold in (Plane(), Cylinder(0.3), Sphere(0.4), Edge(0.1, 1.5))
        for axes in (level, tilted)
    }
    assert names == {
        ("Plane", True): "FlatRock",
        ("Plane", False): "FlatRock",
        ("Cylinder", True): "Disc",
        ("Cylinder", False): "Ellipse",
        ("Sphere", True): "Disc",
        ("Sphere", False): "Disc",
        ("Edge", True): "_Edge",
        ("Edge", False): "_Edge",
    }


@pytest.mark.parametrize(
    ("hold", "origin", "along", "into"),
    [
        (Plane(), (0.0, 0.0, -0.01), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        (Cylinder(0.3), (0.16, 0.0, -0.01), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        (Sphere(0.1), (0.0, 0.06, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        (Ellipsoid((0.2, 0.1, 0.3)), (0.0, 0.11, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ],
)
def test_a_plane_beside_the_rock_has_no_cut(hold, origin, along, into):
    axes = np.column_stack([along, np.cross(into, along), into])
    assert cut_through(hold, np.array(origin), axes) is None


def test_an_ellipse_in_hand_worked_places():
    """Half axes 2 along x and 1 along z about 3i: G = x²/4 + z²."""
    oval = Ellipse(3j, (0.75 + 0j, -0.25 + 0j), 1.0, 1.0)
    assert oval.distance(3j) == pytest.approx(-1.0)
    assert oval.distance(0j) == pytest.approx(2.0)
    # the lowest place is straight ahead of a face that is one above its phalanx
    u, reach = oval.tangent(-5.0 + 1j, 1.0)
    assert u == pytest.approx(1.0)
    assert reach == pytest.approx(5.0)
    # (x + 4)² + z² = 9.75 and x²/4 + z² = 1 at x = −1, z = −√3/2: coming from below
    (way,) = oval.entries(-4.0 + 3j, math.sqrt(9.75))
    assert way * math.sqrt(9.75) == pytest.approx(complex(3.0, -math.sqrt(0.75)))
    assert oval.entries(-4.0 + 3j, 1.9) == []
