"""Sections of holds against the rock itself, sampled densely through its distance function."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.optimize import minimize_scalar

from hand_models import Cylinder, Edge, InvalidInputError, Plane, Sphere
from hand_models.sections import Disc, Face, FlatRock
from hand_models.sections.ellipses import Ellipse
from tests.suite.helpers.rocks import distance, random_axes, random_hold

LOW, HIGH = -0.52, 1.75
HEIGHT = 0.0047
FACE = Face(0.0085, 0.0431, HEIGHT)

seeds = st.integers(0, 2**32 - 1)


class Cut:
    """A hold and a plane through it, with the distance of the plane's points from the rock."""

    def __init__(self, hold, origin, s_axis, t_axis):
        self.hold, self.origin, self.s, self.t = hold, np.asarray(origin), s_axis, t_axis
        self.section = hold.section(origin, s_axis, t_axis)

    def distance(self, points):
        in_hold = self.origin + points[..., :1] * self.s + points[..., 1:] * self.t
        return distance(self.hold, in_hold)


def random_cut(seed, choose):
    rng = np.random.default_rng(seed)
    hold, axes = choose(rng), random_axes(rng)
    origin = np.array([*rng.uniform(-0.1, 0.1, 2), -rng.uniform(0.0, 0.03)])
    return Cut(hold, origin, axes[:, 0], axes[:, 2]), rng


def tile_point(angle, along, height=HEIGHT):
    """(x, z) of a point of a phalanx that turns about the joint."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([along * c - height * s, along * s + height * c], axis=-1)


@pytest.mark.parametrize("diameter", [0.3, 2.0, 8.0, 50.0])
@pytest.mark.parametrize("oblique", np.linspace(0.02, 1.2, 7))
def test_a_cylinder_cut_obliquely_is_the_ellipse_that_it_is(diameter, oblique):
    """Semi-axes r and r / cos(oblique): tangency with the ellipse's own offset curve."""
    r, c = diameter / 2.0, 0.02
    cylinder = Cylinder(diameter)
    s = np.array([math.cos(oblique), math.sin(oblique), 0.0])
    t = np.array([0.0, 0.0, 1.0])
    # the joint of a phalanx whose face touches the ellipse at parameter p, c ahead of the joint
    p = -0.3
    a = r / math.cos(oblique)
    touch = np.array([a * math.sin(p), r - r * math.cos(p)])
    along = np.array([a * math.cos(p), r * math.sin(p)])
    along /= np.hypot(*along)
    normal = np.array([-along[1], along[0]])
    joint = touch - c * along - HEIGHT * normal
    section = cylinder.section(joint[0] * s + joint[1] * t, s, t)
    assert isinstance(section, Ellipse)
    found = section.rest(0j, FACE, -1.0, HIGH)
    assert found is not None
    assert found.angle == pytest.approx(math.atan2(along[1], along[0]), abs=1e-9)
    assert found.distance == pytest.approx(c, abs=1e-8)


def test_oblique_sections_go_over_into_square_ones():
    for oblique in [1e-6, 1e-4, 1e-2]:
        s = np.array([math.cos(oblique), math.sin(oblique), 0.0])
        origin, t = np.array([0.05, 0.0, -0.01]), np.array([0.0, 0.0, 1.0])
        hold = Cylinder(0.3)
        square = hold.section(origin, np.array([1.0, 0.0, 0.0]), t).rest(0j, FACE, LOW, HIGH)
        turned = hold.section(origin, s, t).rest(0j, FACE, LOW, HIGH)
        assert turned[:2] == pytest.approx(square[:2], abs=2.0 * oblique**2 + 1e-9)


def test_a_finger_along_the_axis_lies_on_straight_rock():
    for way in [1.0, -1.0]:
        for hold in [Cylinder(0.3), Edge(0.1, 1.2)]:
            origin = np.array([0.05, 0.0, -0.02])
            cut = Cut(hold, origin, np.array([0.0, way, 0.0]), np.array([0.0, 0.0, 1.0]))
            assert isinstance(cut.section, FlatRock)
            angle, distance, flat = cut.section.rest(0j, Face(0.01, 0.04, 0.0), LOW, HIGH)
            assert (distance, flat) == (0.04, False)
            assert 0.0 < angle < math.pi / 2
            assert abs(cut.distance(tile_point(angle, 0.04, 0.0))) < 1e-12
            # and beside the axis by more than the radius there is no rock
            assert hold.section([0.5, 0.0, -0.02], cut.s, cut.t) is None or isinstance(hold, Edge)


def test_a_square_section_of_a_cylinder_and_any_of_a_ball_are_circles():
    square = Cylinder(0.3).section([0.05, 0.2, -0.01], [1.0, 0, 0], [0, 0, 1.0])
    assert square.radius == pytest.approx(0.15, abs=1e-15)
    assert square.centre == pytest.approx(-0.05 + 0.16j)
    # a plane 90 mm beside the centre of a 300 mm ball: 150² − 90² = 120²
    ball = Sphere(0.3).section([0.0, 0.09, 0.0], [1.0, 0, 0], [0, 0, 1.0])
    assert ball.radius == pytest.approx(0.12, abs=1e-12)
    assert ball.centre == pytest.approx(0.15j)


def test_a_plane_beside_a_ball_meets_no_rock():
    assert Sphere(0.3).section([0.0, 0.1501, 0.0], [1.0, 0, 0], [0, 0, 1.0]) is None


def test_a_finger_plane_parallel_to_a_wall_meets_no_rock():
    assert Plane().section([0.0, 0.0, -0.1], [1.0, 0, 0], [0, 1.0, 0]) is None


def test_a_face_that_turns_about_the_centre_of_a_disc_never_enters_it():
    assert Disc(0j, 0.1).rest(0j, FACE, LOW, HIGH) is None


@given(seeds)
def test_entry_is_where_a_line_first_meets_the_rock(seed):
    rng = np.random.default_rng(seed)
    hold, direction = random_hold(rng), random_axes(rng, 1.5)[:, 2]
    point = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(-0.3, 0.05)])
    found = hold.entry(point, direction)
    reach = np.linspace(-20.0, 20.0, 4001)

    def along(values):
        return distance(hold, point + np.asarray(values)[..., None] * direction)

    inside = np.flatnonzero(along(reach) < 0.0)
    if not math.isfinite(found):
        nearest = reach[along(reach).argmin()]
        best = minimize_scalar(along, bounds=(nearest - 0.02, nearest + 0.02), method="bounded")
        assert best.fun > -1e-9
        return
    assert abs(along(found)) < 1e-9
    if len(inside):
        assert found <= reach[inside[0]]
    if abs(found) < 19.0:
        assert along(found + 1e-6) < 1e-9
        assert along(np.linspace(-20.0, found, 1000)).min() > -1e-9


@given(seeds)
def test_the_crest_is_on_the_rock_nearest_the_palm_with_z_into_it(seed):
    rng = np.random.default_rng(seed)
    hold = random_hold(rng)
    assert distance(hold, np.zeros(3)) == pytest.approx(0.0, abs=1e-12)
    assert distance(hold, np.array([0.0, 0.0, 1e-4])) < 0.0
    beside = np.column_stack([rng.uniform(-1.0, 1.0, (200, 2)), np.full(200, -1e-9)])
    assert distance(hold, beside).min() > 0.0
    assert hold.entry([0.0, 0.0, -0.02], [0.0, 0.0, 1.0]) == pytest.approx(0.02, abs=1e-12)


def test_crest_circles_fit_the_rock_near_the_crest():
    for offset in [0.0, 0.0165, -0.05]:
        for hold in (Cylinder(0.3), Sphere(0.4), Edge(0.06, 1.5)):
            depth, radius = hold.crest_circle(offset)
            turn = np.linspace(-0.3, 0.3, 21)
            x, z = radius * np.sin(turn), depth - radius * np.cos(turn)
            on_rock = distance(hold, np.column_stack([x, np.full(21, offset), z]))
            np.testing.assert_allclose(on_rock, 0.0, atol=1e-12)
        assert Sphere(0.4).crest_circle(0.2) is None
        assert Plane().crest_circle(offset) is None


def test_impossible_sizes_are_refused_by_field():
    for value in [0.0, -0.3, math.nan, math.inf]:
        for make, field in [
            (lambda v: Cylinder(v), "diameter"),
            (lambda v: Sphere(v), "diameter"),
            (lambda v: Edge(v, 1.0), "fillet_radius"),
            (lambda v: Edge(0.1, v), "angle"),
        ]:
            with pytest.raises(InvalidInputError) as caught:
                make(value)
            assert caught.value.field == field
