"""Where a finger comes to rest, on which phalanges, and that it can stay there (Section 5.7)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hand_models import Cylinder, Edge, Grasp, InvalidInputError, Plane, Pose, Surface
from hand_models.finger import settle_finger
from hand_models.finger.contact_states import close
from hand_models.finger.limit_postures import PATTERNS, at_limits
from hand_models.rock import Profile
from hand_models.sections import RoundSection, section_rows
from tests.suite.helpers.fingers import torques
from tests.suite.helpers.hands import HAND, PINCH, ROCK
from tests.suite.helpers.rocks import (
    distance,
    random_axes,
    random_ellipsoid,
    random_hold,
    random_mesh,
    random_profile,
)

MODEL = HAND.finger
DEEPEST = 1e-4
"""How far a tile may stand in the rock [m]."""

seeds = st.integers(0, 2**32 - 1)


def any_hold(rng):
    """Of every kind; meshes seldom, as they take long to make."""
    kinds = (random_hold, random_ellipsoid, random_profile, random_mesh)
    hold = kinds[rng.choice(4, p=[0.6, 0.2, 0.17, 0.03])](rng)
    # a finger takes the outline of its own strip only
    return Profile(hold.outlines[0]) if isinstance(hold, Profile) else hold


def random_close(seed):
    """A finger closed on any kind of hold, with distances from its rock and its tension."""
    rng = np.random.default_rng(seed)
    hold, axes = any_hold(rng), random_axes(rng, 0.4)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.004, 0.03)])
    if rng.random() < 0.7:
        below = hold.entry(origin, np.array([0.0, 0.0, 1.0]))
        reach = below if math.isfinite(below) else 0.0
        origin[2] += reach - MODEL.tile_height - rng.uniform(0.0, 0.005)
    surface = Surface.from_values({"shear_limit": float(rng.uniform(10.0, 80.0))})
    tension = float(rng.uniform(15.0, 60.0))
    outer = bool(rng.random() < 0.5)
    section = hold.section(origin, axes[:, 0], axes[:, 2])
    closed = close(MODEL, section, surface, tension, outer)

    def clearance(points):
        return distance(hold, origin + points[..., :1] * axes[:, 0] + points[..., 1:] * axes[:, 2])

    return closed, clearance, tension, outer


@settings(max_examples=700, deadline=None)
@given(seeds)
def test_wherever_a_finger_closes_it_is_clear_of_rock_whole_and_in_balance(seed):
    closed, clearance, closing, outer = random_close(seed)
    if closed is None:
        return  # rock wherever its joints turn: refused by name
    finger = closed.finger
    near, far = MODEL.tile_range
    # no tile stands in the rock
    for contact, u in zip(finger.contacts, finger.directions, strict=True):
        n = np.array([-u[1], u[0]])
        face = np.array(contact.joint) + MODEL.tile_height * n
        tile = face + np.linspace(near, far, 25)[:, None] * u
        assert clearance(tile).min() > -DEEPEST
    # no phalanx leaves its joint, no joint its limits
    for i, (contact, u) in enumerate(zip(finger.contacts[:-1], finger.directions, strict=False)):
        end = np.array(contact.joint) + MODEL.joint_spacing * u
        np.testing.assert_allclose(finger.contacts[i + 1].joint, end, atol=1e-12)
    q = finger.joint_angles
    assert (q >= np.array(MODEL.joint_lower) - 1e-9).all()
    assert (q <= np.array(MODEL.joint_upper) + 1e-9).all()
    # joints and tiles balance at any tension
    for tension in (closing, 1.7 * closing):
        powers = np.array([1.0, tension])
        shear, normal, stop = (v @ powers for v in closed[1:])
        local = (1.0 - MODEL.friction) ** (np.arange(3) + (1 if outer else 0))
        drag = np.array(MODEL.engagement) * closing + MODEL.shear_gain * (tension - closing)
        on = np.array(finger.touching)
        np.testing.assert_allclose(shear, np.where(on, local * drag, 0.0), atol=1e-9)
        found = torques(finger, tension, outer, shear, normal)
        size = max(1.0, np.abs(normal).max())
        np.testing.assert_allclose(found, stop, atol=1e-9 * size)
        np.testing.assert_array_equal(stop[list(finger.free)], 0.0)


@settings(max_examples=300, deadline=None)
@given(seeds)
def test_what_has_not_been_laid_bottom_up_balances_at_the_closing_tension(seed):
    """Its stops push, and a joint without contact or stop is about free of torque."""
    closed, _, closing, _ = random_close(seed)
    if closed is None or not closed.finger.bearing:
        return
    torque = closed.torques @ np.array([1.0, closing])
    for contact, turned in zip(closed.finger.contacts, torque, strict=True):
        if contact.stop == "balance":
            assert abs(turned) < 1e-3
            assert contact.kind == "none"
        elif contact.stop is not None and len(closed.finger.bearing) < 3:
            assert turned * (1.0 if contact.stop == "upper" else -1.0) > -1e-9


def placed(hold, x, z, tilt=0.0, surface=ROCK, grasp=None):
    turn = np.array(
        [[math.cos(tilt), 0, math.sin(tilt)], [0, 1, 0], [-math.sin(tilt), 0, math.cos(tilt)]]
    )
    return HAND.settle(hold, surface, grasp or Grasp(), Pose(np.array([x, 0.0, z]), turn))


def kinds(settled, finger=1):
    return [(contact.kind, contact.stop) for contact in settled.fingers[finger].contacts]


def test_seated_every_phalanx_is_on_the_rock():
    settled = HAND.settle(Cylinder(0.3), ROCK, PINCH)
    assert kinds(settled) == [("face", None)] * 3


@pytest.mark.parametrize("stand_off", [0.02, 0.03])
def test_a_pinch_whose_palm_is_far_from_the_rock_holds_without_its_proximal_contacts(stand_off):
    """Fig. 8 (b), found from the hold: bottom-up the proximal phalanx would push the middle off."""
    settled = placed(Cylinder(0.3), 0.03226, stand_off, grasp=PINCH)
    for i in range(4):
        (proximal, held), middle, distal = kinds(settled, i)
        assert (proximal, held) == ("none", "balance")
        assert middle[0] in ("face", "edge")
        assert distal[0] in ("face", "edge")
    plain = settle_finger(
        MODEL,
        RoundSection((0.03226 - 0.06615, stand_off + 0.15 + 0.0006), 0.15),
        (0.0, 0.0),
    )
    assert plain.contacts[0].angle > settled.fingers[1].contacts[0].angle


def test_a_contact_that_is_pulled_off_gives_way_on_weak_rock_and_not_on_strong():
    """On sandpaper the proximal tile cannot hold 5.5 N of pull-off; it eases to none."""
    for surface, pulled in ((ROCK, True), (Surface.named("sandpaper-36"), False)):
        settled = placed(Cylinder(0.3), 0.03226, 0.004, surface=surface, grasp=PINCH)
        tile = np.flatnonzero(settled.finger_of == 1)[-3]
        normal = settled.loads[tile, 1] @ [1.0, 37.0]
        assert (normal < -5.0) == pulled
        assert pulled or normal == pytest.approx(0.0, abs=0.01)
        assert settled.tiles[tile].contact == "edge"


def test_a_crimp_holds_with_its_distal_contact_alone():
    """Fig. 8 (a): a flake out in front of the fingers, which stand at their lower stops."""
    hold = Edge(0.0019812, 1.24626)
    rng = np.linspace(-1.2, 0.5, 35)
    alone = []
    for tilt in rng:
        try:
            settled = placed(hold, 0.14341582, -0.05887669, float(tilt), grasp=Grasp(palm=False))
        except InvalidInputError:
            continue
        if [kind for kind, _ in kinds(settled)] == ["none", "none", "face"]:
            alone.append(settled)
    assert alone
    for settled in alone:
        assert [stop for _, stop in kinds(settled)] == ["lower", "lower", None]
        finger = settled.fingers[1]
        # by hand: the distal joint alone gives the normal load
        contact, u = finger.contacts[2], finger.directions[2]
        tile = np.flatnonzero(settled.finger_of == 1)[-1]
        shear, normal = settled.loads[tile] @ [1.0, 37.0]
        spring = MODEL.joint_stiffness[2] * finger.joint_angles[2]
        by_hand = 37.0 * MODEL.pulley_radii[2] - spring - MODEL.tile_height * shear
        assert normal == pytest.approx(by_hand / contact.along, rel=1e-9)
        assert normal > 0.0
        assert np.hypot(*u) == pytest.approx(1.0)


def test_a_rung_is_hooked_by_the_middle_and_distal_phalanges():
    settled = placed(Cylinder(0.03), 0.13, 0.02)
    assert [kind for kind, _ in kinds(settled)] == ["none", "face", "face"]
    assert kinds(settled)[0][1] == "balance"
    loads = settled.tile_loads(np.full(4, 37.0))
    inner = np.flatnonzero(settled.finger_of == 1)
    assert (loads[inner[1:], :2] > 0.0).all()


def test_a_pattern_has_a_contact_for_each_joint_that_is_free():
    assert len(PATTERNS) == 43
    for pattern in PATTERNS:
        assert pattern.stops.count(None) == len(pattern.bearing)
    counts = [len(pattern.bearing) for pattern in PATTERNS]
    assert counts == sorted(counts, reverse=True)


@settings(max_examples=200, deadline=None)
@given(seeds)
def test_a_posture_is_as_its_pattern_says(seed):
    rng = np.random.default_rng(seed)
    index = int(rng.integers(len(PATTERNS)))
    pattern = PATTERNS[index]
    centre = (float(rng.uniform(0.0, 0.12)), float(rng.uniform(0.01, 0.1)))
    rock = section_rows([RoundSection(centre, float(rng.uniform(0.005, 0.06)))])
    with np.errstate(invalid="ignore"):
        fingers, possible = at_limits(MODEL, rock, np.array([index]))
    if not possible[0]:
        return
    finger = fingers.finger(MODEL, 0)
    assert tuple(contact.stop for contact in finger.contacts) == pattern.stops
    assert finger.bearing == pattern.bearing
    limits = {"lower": MODEL.joint_lower, "upper": MODEL.joint_upper}
    for i, (stop, angle) in enumerate(zip(pattern.stops, finger.joint_angles, strict=True)):
        if stop is not None:
            assert angle == pytest.approx(limits[stop][i], abs=1e-12)


def test_a_tile_that_only_slips_keeps_its_contact():
    """Closed with more than sandpaper holds in shear: overloaded, but on the rock."""
    weak = replace(
        Surface.named("sandpaper-36"), shear_limit=5.0, pull_off_limit=1.4, lateral_limit=4.3
    )
    settled = HAND.settle(Cylinder(0.3), weak, PINCH)
    assert kinds(settled) == [("face", None)] * 3
    finger = settled.fingers[1]
    shears = finger.shears(37.0)
    assert (shears @ [1.0, 37.0] > weak.shear_limit).any()


def test_an_open_hand_in_the_air_touches_nothing_and_stays():
    settled = placed(Plane(), 0.0, 0.3)
    assert not settled.touching.any()
    for i in range(4):
        assert kinds(settled, i) == [("none", "upper")] * 3
    closed = close(MODEL, None, ROCK, 37.0)
    assert (closed.torques @ [1.0, 37.0] > 0.0).all()
