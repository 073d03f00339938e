"""A finger settles on the rock, and its joints balance by virtual work.

Forces are checked against energy, not against the code's formulas: at fixed contacts on the rock a
joint's torque is minus the derivative of the work of tendon, springs and contact forces.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models import Plane, spiny_hand
from hand_models.finger import Contact, SettledFinger, settle_finger
from hand_models.sections import SECTION_SETTINGS, Disc, FlatRock
from tests.suite.helpers.rocks import distance, random_axes, random_hold

MODEL = spiny_hand().finger
L, H = MODEL.joint_spacing, MODEL.tile_height
FIG12_SHEAR, FIG12_NORMAL = np.array([4.85, 6.95, 8.05]), np.array([8.45, 1.0, 1.85])
OF_FIG12 = replace(
    MODEL, pulley_radii=(5.5e-3, 3.08e-3, 2.69e-3), engagement=tuple((FIG12_SHEAR / 37.0).tolist())
)
"""A finger fitted to Fig. 12 alone."""

ENGAGED = 37.0 * np.array([0.1317, 0.1801, 0.2006])
"""Shear of the hand's own tiles when they have closed at 37 N [N]."""

seeds = st.integers(0, 2**32 - 1)


def on_circle(radius, first_contact=0.0247, first_angle=0.25, model=MODEL):
    """A finger on a disc, its proximal tile tangent ``first_contact`` from its joint."""
    u = np.array([math.cos(first_angle), math.sin(first_angle)])
    n = np.array([-u[1], u[0]])
    centre = first_contact * u + (radius + H) * n
    return settle_finger(model, Disc(complex(*centre), radius), (0.0, 0.0))


def random_finger(seed):
    """A finger on a random hold, with the distance of its plane's points from the rock."""
    rng = np.random.default_rng(seed)
    hold, axes = random_hold(rng), random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.004, 0.03)])
    if rng.random() < 0.7:
        # a joint from which a tile can lie tangent to rock of little curvature
        below = hold.entry(origin, np.array([0.0, 0.0, 1.0]))
        origin[2] += (below if math.isfinite(below) else 0.0) - H - rng.uniform(0.0, 0.005)
    finger = settle_finger(MODEL, hold.section(origin, axes[:, 0], axes[:, 2]), (0.0, 0.0))

    def clearance(points):
        return distance(hold, origin + points[..., :1] * axes[:, 0] + points[..., 1:] * axes[:, 2])

    return finger, clearance


def reached(angles, contacts, heights):
    """Places of points fixed on the phalanges of a chain with the given joint angles, (3, 2)."""
    places, joint, turned = [], np.zeros(2), 0.0
    for angle, along, height in zip(angles, contacts, heights, strict=True):
        turned += angle
        u = np.array([math.cos(turned), math.sin(turned)])
        places.append(joint + along * u + height * np.array([-u[1], u[0]]))
        joint = joint + L * u
    return np.array(places)


def test_on_a_circle_contacts_alternate_and_joints_turn_by_the_closed_form():
    for radius in [0.1, 0.15, 0.35, 2.0]:
        finger = on_circle(radius)
        assert [c.kind for c in finger.contacts] == ["face"] * 3
        c = [contact.along for contact in finger.contacts]
        np.testing.assert_allclose(c, [0.0247, L - 0.0247, 0.0247], atol=1e-9)
        turns = [2.0 * math.atan(along / (radius + H)) for along in (L - 0.0247, 0.0247)]
        np.testing.assert_allclose(finger.joint_angles, [0.25, *turns], atol=1e-9)


@given(seeds)
def test_contacts_lie_on_the_rock_and_tangent_faces_do_not_cut_it(seed):
    finger, clearance = random_finger(seed)
    near, far = MODEL.tile_range
    for contact, point, u in zip(finger.contacts, finger.points, finger.directions, strict=True):
        if contact.kind == "none":
            continue
        # spines at an edge reach across a gap; a face or a frame is on the rock
        gap = clearance(point)
        if contact.kind == "edge":
            assert -1e-9 < gap < MODEL.spine_travel + 1e-9
            assert contact.along in (near, far)
        else:
            lies = contact.along == MODEL.tile_centre
            assert -1e-9 < gap < (SECTION_SETTINGS.level_distance if lies else 1e-9)
            assert (near < contact.along < far) == (contact.kind == "face")
            assert contact.along <= L
        face = point + np.linspace(near - contact.along, L - contact.along, 41)[:, None] * u
        assert clearance(face).min() > -1e-9


def off_disc(stand_off, radius=0.3):
    """A finger whose joint is off the crest of a disc."""
    centre = np.array([0.0, stand_off + radius])
    return settle_finger(MODEL, Disc(complex(*centre), radius), (0.0, 0.0)), centre


def test_a_phalanx_that_touches_beyond_its_tile_holds_by_its_edge_if_spines_reach():
    """On a disc of 600 mm, from joints farther and farther off it."""
    radius, far = 0.3, MODEL.tile_range[1]
    for stand_off, kind in ((0.006, "face"), (0.007, "edge"), (0.012, "edge")):
        finger, centre = off_disc(stand_off)
        contact = finger.contacts[0]
        assert contact.kind == kind
        # tangent at the length of the tangent from the joint, or with the end of the phalanx
        tangent = math.sqrt((radius + stand_off) ** 2 - (radius + H) ** 2)
        bearing = math.pi / 2 - math.asin((radius + H) / (radius + stand_off))
        if tangent <= L:
            assert contact.angle == pytest.approx(bearing, abs=1e-9)
        else:
            end = np.hypot(*(replace(contact, along=L).point(H) - centre))
            assert contact.angle > bearing
            assert end == pytest.approx(radius, abs=1e-9)
        assert contact.along == pytest.approx(min(tangent, far), abs=1e-9)
        gap = np.hypot(*(contact.point(H) - centre)) - radius
        assert (1e-6 < gap < MODEL.spine_travel) == (kind == "edge")


def test_a_bare_frame_presses_where_spines_cannot_reach():
    """A rung of 6 mm under the end of the first phalanx, 30 degrees down."""
    angle = math.radians(30.0)
    u = np.array([math.cos(angle), math.sin(angle)])
    n = np.array([-u[1], u[0]])
    centre = 0.042 * u + (H + 0.003) * n
    contact = settle_finger(MODEL, Disc(complex(*centre), 0.003), (0.0, 0.0)).contacts[0]
    assert (contact.kind, contact.stop) == ("frame", None)
    assert contact.angle == pytest.approx(angle, abs=1e-9)
    assert contact.along == pytest.approx(0.042, abs=1e-9)


def test_from_a_joint_close_to_the_rock_a_tile_touches_with_its_near_edge():
    section = Disc(0.303j, 0.3)
    contact = settle_finger(MODEL, section, (0.0, 0.0)).contacts[0]
    assert (contact.kind, contact.along) == ("edge", MODEL.tile_range[0])
    assert np.hypot(*(contact.point(H) - np.array([0.0, 0.303]))) == pytest.approx(0.3, abs=1e-9)


@given(seeds)
def test_phalanges_form_a_chain_within_their_joints_limits(seed):
    finger, _ = random_finger(seed)
    q = finger.joint_angles
    assert (q >= np.array(MODEL.joint_lower) - 1e-9).all()
    assert (q <= np.array(MODEL.joint_upper) + 1e-9).all()
    c = [contact.along for contact in finger.contacts]
    np.testing.assert_allclose(finger.points, reached(q, c, [H] * 3), atol=1e-12)
    limits = zip(MODEL.joint_lower, MODEL.joint_upper, strict=True)
    for contact, angle, (lower, upper) in zip(finger.contacts, q, limits, strict=True):
        assert (contact.stop is None) == (contact.kind != "none")
        if contact.stop is not None:
            assert angle == pytest.approx({"lower": lower, "upper": upper}[contact.stop])


def test_on_flat_rock_at_tile_height_every_tile_lies_flat_at_its_centre():
    finger = settle_finger(MODEL, FlatRock(1j, H), (0.0, 0.0))
    np.testing.assert_allclose(finger.joint_angles, 0.0, atol=1e-12)
    assert [c.along for c in finger.contacts] == [MODEL.tile_centre] * 3
    assert all(finger.touching)


def test_without_rock_a_finger_closes_fully_and_carries_nothing():
    finger = settle_finger(MODEL, None, (0.0, 0.0))
    np.testing.assert_allclose(finger.joint_angles, MODEL.joint_upper)
    shears = finger.shears(37.0)
    np.testing.assert_array_equal(shears, 0.0)
    np.testing.assert_array_equal(finger.normals(shears), 0.0)


def loads(finger, tension, closing=37.0, base_tile=False):
    shears = finger.shears(closing, base_tile)
    normals = finger.normals(shears, base_tile)
    stops = finger.stop_torques(shears, normals, base_tile)
    return (np.array([1.0, tension]) * v for v in (shears, normals, stops))


def torque_by_virtual_work(finger, tension, shear, normal, base_tile):
    """Of each joint: −dE/dq with the contacts' forces, tendon and springs as potentials.

    The rock pushes on tile j with +T u − N n; the tendon shortens by r_i dq_i at joint i.
    """
    model, q = finger.model, finger.joint_angles
    c = [contact.along for contact in finger.contacts]
    u = finger.directions
    force = shear[:, None] * u - normal[:, None] * np.column_stack([-u[:, 1], u[:, 0]])
    local = tension * (1.0 - model.friction) ** (np.arange(3) + (1 if base_tile else 0))

    def energy(angles):
        work = (force * reached(angles, c, [model.tile_height] * 3)).sum()
        work += (local * np.array(model.pulley_radii) * angles).sum()
        springs = 0.5 * np.array(model.joint_stiffness) * angles**2
        return (springs + np.array(model.joint_preload) * angles).sum() - work

    step = 1e-5
    return np.array(
        [-(energy(q + step * e) - energy(q - step * e)) / (2.0 * step) for e in np.eye(3)]
    )


@given(seeds, st.floats(0.0, 700.0), st.floats(1.0, 100.0), st.booleans(), st.floats(0.0, 0.5))
def test_joints_balance_by_virtual_work(seed, tension, closing, base_tile, friction):
    finger, _ = random_finger(seed)
    model = replace(MODEL, friction=friction, joint_preload=(0.01, -0.02, 0.03))
    finger = SettledFinger(model, finger.contacts)
    shear, normal, stop = (v.sum(axis=1) for v in loads(finger, tension, closing, base_tile))
    torque = torque_by_virtual_work(finger, tension, shear, normal, base_tile)
    size = 1.0 + np.abs(normal).max()
    # a free joint balances; a stop pushes back what is left at a joint that touches nothing
    np.testing.assert_allclose(torque, stop, atol=1e-8 * size)
    np.testing.assert_array_equal(stop[list(finger.free)], 0.0)


@given(seeds, st.floats(0.0, 700.0))
def test_tiles_that_touch_nothing_carry_nothing_and_leave_the_equations(seed, tension):
    finger, _ = random_finger(seed)
    shear, normal, _ = (v.sum(axis=1) for v in loads(finger, tension))
    kinds = np.array([contact.kind for contact in finger.contacts])
    np.testing.assert_array_equal(shear[(kinds == "none") | (kinds == "frame")], 0.0)
    np.testing.assert_array_equal(normal[kinds == "none"], 0.0)


def test_with_its_middle_tile_in_the_air_two_phalanges_become_one_link():
    """Section 5.7, by hand: distal joint first, then the proximal one with both contacts."""
    angle = 0.3
    straight = [
        Contact(angle, (i * L * math.cos(angle), i * L * math.sin(angle)), 0.02, kind, stop)
        for i, (kind, stop) in enumerate((("face", None), ("none", "upper"), ("face", None)))
    ]
    finger = SettledFinger(MODEL, tuple(straight))
    f, r, k = 50.0, MODEL.pulley_radii, 0.05
    shear, normal, stop = (v.sum(axis=1) for v in loads(finger, f))
    expected_shear = ENGAGED + np.array(MODEL.shear_gain) * (f - 37.0)
    np.testing.assert_allclose(shear, expected_shear * [1, 0, 1], rtol=1e-6)
    # shear acts H off every joint's line, along the straight finger: moment −H T
    distal = (f * r[2] - H * shear[2]) / 0.02
    proximal = (f * r[0] - k * angle - H * (shear[0] + shear[2]) - (2 * L + 0.02) * distal) / 0.02
    np.testing.assert_allclose(normal, [proximal, 0.0, distal], atol=1e-9)
    at_stop = f * r[1] - H * shear[2] - (L + 0.02) * distal
    np.testing.assert_allclose(stop, [0.0, at_stop, 0.0], atol=1e-12)


def test_few_spines_across_a_gap_bear_a_share_of_their_joint():
    """By hand, of a straight finger: the distal joint, taken as locked, carries the rest."""
    angle, f, r, k = 0.3, 50.0, MODEL.pulley_radii, 0.05
    for share in (1e-9, 0.3, 1.0):
        straight = [
            Contact(angle, (i * L * math.cos(angle), i * L * math.sin(angle)), 0.02, "face")
            for i in range(3)
        ]
        straight[2] = replace(straight[2], engagement=0.1 * share, bearing_share=share)
        finger = SettledFinger(MODEL, tuple(straight))
        shear, normal, _ = (v.sum(axis=1) for v in loads(finger, f))
        distal = share * (f * r[2] - H * shear[2]) / 0.02
        middle = (f * r[1] - H * (shear[1] + shear[2]) - (L + 0.02) * distal) / 0.02
        proximal = f * r[0] - k * angle - H * shear.sum()
        proximal -= (L + 0.02) * middle + (2.0 * L + 0.02) * distal
        np.testing.assert_allclose(normal, [proximal / 0.02, middle, distal], rtol=1e-9)


def test_unloaded_forces_are_those_of_figure_12():
    """Two fingers at 37 N on 300 mm: 14.6° at the base, contact 24.7 mm from the joint."""
    finger = on_circle(0.15, first_angle=math.radians(14.6), model=OF_FIG12)
    shear, normal, _ = (v.sum(axis=1) for v in loads(finger, 37.0))
    np.testing.assert_allclose(shear, FIG12_SHEAR, atol=1e-6)
    assert (np.abs(normal - FIG12_NORMAL) <= np.maximum(0.03 * FIG12_NORMAL, 0.2)).all()


def test_friction_divides_the_tendon_from_phalanx_to_phalanx():
    """Eq. 8: M = diag(1, 1 − μ, (1 − μ)²), one step later where a base tile comes first."""
    model = replace(MODEL, friction=0.2)
    finger = SettledFinger(model, on_circle(0.15).contacts)
    free, lossy = on_circle(0.15).shears(37.0), finger.shears(37.0)
    np.testing.assert_allclose(lossy, free * np.array([[1.0], [0.8], [0.64]]), rtol=1e-12)
    np.testing.assert_allclose(finger.shears(37.0, base_tile=True), 0.8 * lossy, rtol=1e-12)


def test_shear_grows_by_the_gain_of_pulleys_and_contact_springs():
    """g = c_p k_c / (k_c + K_p) = 2 · 4.25 / 15.75, 2 · 6.543 / 18.043, 2 · 8.215 / 19.715."""
    gains = [8.5 / 15.75, 13.086 / 18.043, 16.43 / 19.715]
    assert MODEL.shear_gain == pytest.approx(gains)
    np.testing.assert_allclose(on_circle(0.15).shears(37.0)[:, 1], gains)
    closings = on_circle(0.15).shears(10.0)
    np.testing.assert_allclose(closings @ [1.0, 10.0], [1.317, 1.801, 2.006], rtol=1e-9)


def test_a_wall_turned_away_from_the_finger_is_not_touched():
    plane = Plane()
    tilt = 0.9  # rad: steeper than the hyperextension of the first joint allows
    s = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    t = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    finger = settle_finger(MODEL, plane.section([0.0, 0.0, -0.05], s, t), (0.0, 0.0))
    assert not finger.touching[0]
