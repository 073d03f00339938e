"""A finger whose base has moved is where it would be if it had closed there."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.compliance import COMPLEX_STEP
from hand_models.compliance.link import STANDING_ANGLE, FingerLink, bearing_angle
from hand_models.compliance.rolling import MovedPosture, RollingContact
from hand_models.finger import settle_finger
from hand_models.hand import FINGERS, Grasp
from hand_models.rock import Cylinder, Edge, Ellipsoid, Plane, Sphere
from hand_models.tile import Surface
from tests.suite.helpers.hands import HAND

SHIFTS = st.floats(-6e-4, 6e-4)
TURNS = st.floats(-0.02, 0.02)
PINCH = Grasp(outer_rotation=math.pi)


def moving(hold, grasp=PINCH, finger="inner_left"):
    settled = HAND.settle(hold, Surface.named("rock"), grasp)
    section = HAND.section(finger, hold, grasp, settled.seating.pose)
    return RollingContact([settled.fingers[FINGERS.index(finger)]], [section]), section


def move(resettling, x, z, turn):
    """Return the postures of the only finger, for bases displaced by numbers or arrays (m,)."""
    found = resettling.move(*(np.atleast_1d(value)[None] for value in (x, z, turn)))
    return MovedPosture(*(np.moveaxis(part[0], -1, 0) for part in found))


@pytest.mark.parametrize("diameter", [0.2, 0.3, 0.7])
@given(x=SHIFTS, z=SHIFTS, turn=TURNS)
def test_on_a_cylinder_it_is_exactly_where_it_would_close(diameter, x, z, turn):
    resettling, section = moving(Cylinder(diameter))
    posture = move(resettling, x, z, turn)
    closed = settle_finger(replace(HAND.finger, joint_lower=(-1.5,) * 3), section, (x, z))
    # where a tile's end cuts its bed short, its force is 0.75 mm from where it touches
    aside = 0.0 if diameter < 0.5 else 1.0
    angles = [c.angle for c in closed.contacts]
    np.testing.assert_allclose(posture.angles[0], angles, atol=1e-9 + 1e-4 * aside)
    np.testing.assert_allclose(posture.points[0], closed.points, atol=1e-10 + 8e-4 * aside)


@pytest.mark.parametrize("hold", [Sphere(0.5), Ellipsoid((0.2, 0.3, 0.1))], ids=["sphere", "egg"])
def test_on_other_round_rock_it_is_where_it_would_close_but_for_the_circle(hold):
    resettling, section = moving(hold)
    for x, z, turn in ((3e-4, -5e-4, 0.004), (-4e-4, 2e-4, -0.006)):
        posture = move(resettling, x, z, turn)
        closed = settle_finger(replace(HAND.finger, joint_lower=(-1.5,) * 3), section, (x, z))
        angles = [c.angle for c in closed.contacts]
        np.testing.assert_allclose(posture.angles[0], angles, atol=2e-3)


@pytest.mark.parametrize(
    ("hold", "grasp"),
    [(Cylinder(0.3), PINCH), (Plane(), Grasp()), (Sphere(0.4), Grasp(outer_rotation=1.0))],
    ids=["cylinder", "plane", "sphere"],
)
@pytest.mark.parametrize("finger", FINGERS)
def test_at_rest_nothing_has_moved(hold, grasp, finger):
    resettling, _ = moving(hold, grasp, finger)
    rest = HAND.settle(hold, Surface.named("rock"), grasp).fingers[FINGERS.index(finger)]
    posture = move(resettling, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(posture.slips, 0.0, atol=1e-12)
    np.testing.assert_allclose(posture.turns, 0.0, atol=1e-12)
    np.testing.assert_allclose(posture.points[0], rest.points, atol=1e-12)
    assert posture.reached.all()


def test_a_finger_that_slides_along_flat_rock_slips_by_as_much():
    resettling, _ = moving(Plane(), Grasp())
    posture = move(resettling, 2e-4, 0.0, 0.0)
    # away from the base, while slips count toward it
    np.testing.assert_allclose(posture.slips[0], -2e-4, atol=1e-15)
    np.testing.assert_allclose(posture.turns[0], 0.0, atol=1e-12)


def test_a_finger_that_swings_about_its_cylinder_slips_by_the_arc():
    resettling, section = moving(Cylinder(0.3))
    swing = 0.004
    cx, cz, rotation = section.centre.real, section.centre.imag, np.array([swing])
    # the base moves on a circle about the axis, and turns with it: nothing changes but the place
    x = cx - cx * np.cos(rotation) + cz * np.sin(rotation)
    z = cz - cx * np.sin(rotation) - cz * np.cos(rotation)
    posture = move(resettling, x, z, rotation)
    np.testing.assert_allclose(posture.turns[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(posture.slips[0], -section.radius * swing, atol=1e-12)


def test_a_contact_stays_on_its_tile_and_goes_on_as_its_edge():
    resettling, section = moving(Cylinder(0.3))
    near, far = HAND.finger.tile_range
    pulls = np.linspace(0.0, -1.5e-3, 400)
    posture = move(resettling, 0.0 * pulls, pulls, 0.0 * pulls)
    u = np.stack([np.cos(posture.angles), np.sin(posture.angles)], axis=-1)
    along = ((posture.points - posture.joints) * u).sum(axis=-1)
    assert along.min() >= near - 1e-12
    assert along.max() <= far + 1e-12
    assert along.max() == pytest.approx(far)
    gaps = np.abs(posture.points @ [1.0, 1j] - section.centre) - section.radius
    np.testing.assert_allclose(gaps, 0.0, atol=1e-12)
    # and nothing jumps where it does
    steps = np.abs(np.diff(posture.slips, axis=0)).max(axis=0)
    assert (steps < 12.0 * np.median(np.abs(np.diff(posture.slips, axis=0)), axis=0)).all()


def test_a_base_too_far_off_finds_no_rock():
    resettling, _ = moving(Cylinder(0.3))
    assert not move(resettling, 0.0, -0.2, 0.0).reached[0]


def test_complex_steps_give_the_slopes_of_everything():
    resettling, _ = moving(Cylinder(0.3))
    at, small = np.array([2e-4, -3e-4, 0.004]), 1e-7
    exact = move(resettling, *(at[:, None] + 1j * COMPLEX_STEP * np.eye(3)))
    ends = [move(resettling, *(at[:, None] + side * small * np.eye(3))) for side in (1.0, -1.0)]
    for name in ("angles", "turns", "slips", "points", "joints"):
        slope = (getattr(ends[0], name) - getattr(ends[1], name)) / (2.0 * small)
        np.testing.assert_allclose(
            getattr(exact, name).imag / COMPLEX_STEP, slope, rtol=1e-6, atol=1e-6
        )


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_complex_angle_is_analytic(x, z, dx, dz):
    if math.hypot(x, z) < 1e-3:
        return
    value = bearing_angle(
        np.array(x + 1j * COMPLEX_STEP * dx), np.array(z + 1j * COMPLEX_STEP * dz)
    )
    assert value.real == pytest.approx(math.atan2(z, x), abs=1e-15)
    assert value.imag / COMPLEX_STEP == pytest.approx((x * dz - z * dx) / (x * x + z * z), abs=1e-9)


def test_an_edge_hold_is_met_with_points_that_slide():
    grasp = Grasp()
    hold = Edge(fillet_radius=0.02, angle=1.6)
    for finger in FINGERS:
        resettling, _ = moving(hold, grasp, finger)
        assert move(resettling, 1e-5, -1e-5, 1e-4).reached[0]


LENGTH = 0.04
"""From a joint to the point of a phalanx that slides along flat rock [m]."""


def leaning(angle):
    """Return a phalanx whose point slides on a flat rock, so far from the rock's normal [rad]."""
    place = np.array([math.sin(angle), math.cos(angle)]) * LENGTH
    fields = {
        "bearing": 0,
        "contact": LENGTH,
        "flat": True,
        "rest": place / LENGTH,
        "raised": (0.0, 0.0),
        "centre": place,
        "into": (0.0, 1.0),
        "back": (-1.0, 0.0),
    }
    one = FingerLink(*(np.array([value])[..., None] for value in FingerLink(**fields)))
    return one.settled(np.zeros((1, 2, 1)))


def turn_of(link, approach):
    """Return turn and slip of a phalanx whose joint has come nearer to the rock [rad, m]."""
    joint = np.stack([0.0 * approach, approach])[None]
    with np.errstate(invalid="ignore"):
        way, _, slip = link.turn(joint)
        return bearing_angle(way[:, 0], way[:, 1])[0], slip[0]


@given(st.floats(0.0, 1.2))
def test_a_phalanx_has_neither_turned_nor_slipped_at_rest_however_it_stands(angle):
    turn, slip = turn_of(leaning(angle), np.zeros(1))
    assert turn == pytest.approx(0.0, abs=1e-12)
    assert slip == pytest.approx(0.0, abs=1e-14)


@given(st.floats(STANDING_ANGLE + 0.01, 1.2), st.floats(0.0, 2e-3))
def test_a_leaning_phalanx_turns_by_the_arc_cosine(angle, approach):
    turn, slip = turn_of(leaning(angle), np.array([approach]))
    leans = math.acos(math.cos(angle) - approach / LENGTH)
    # x toward z: leaning farther turns it back toward x
    assert turn[0] == pytest.approx(angle - leans, abs=1e-11)
    assert slip[0] == pytest.approx(-LENGTH * (math.sin(leans) - math.sin(angle)), abs=1e-12)


@given(st.floats(0.0, 0.3), st.floats(-1e-4, 2e-3))
def test_no_way_of_the_base_turns_a_phalanx_without_bound(angle, approach):
    link = leaning(angle)
    turn, _ = turn_of(link, np.array([approach + 1j * COMPLEX_STEP]))
    assert abs(turn.imag[0]) / COMPLEX_STEP <= 1.001 / (LENGTH * math.sin(STANDING_ANGLE))
    # nor does it jump where the arm begins to stay as it is
    near, _ = turn_of(link, approach + np.array([0.0, 1e-9]))
    assert abs(near[1] - near[0]) < 1e-6


@pytest.mark.parametrize("angle", [0.0, 0.05, 0.2])
@pytest.mark.parametrize("step", [0.0, 1j * COMPLEX_STEP])
def test_a_phalanx_loses_the_rock_that_it_no_longer_reaches(angle, step):
    turn, _ = turn_of(leaning(angle), np.array([-0.15 * LENGTH + step]))
    assert np.isnan(turn[0])
