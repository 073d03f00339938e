"""Fingers that close on rock of every kind end whole, clear of it and in balance (Section 5.1)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, strategies as st

from hand_models import Cylinder, Grasp, Plane, Surface
from hand_models.finger import (
    ClosedFinger,
    FingerModel,
    OpenFinger,
    Refused,
    cling,
    close_all,
    settle_finger,
)
from hand_models.finger.contact_states import _over
from hand_models.finger.path_state import SETTINGS_RECORD, drives
from hand_models.hand.tightening import resting_tensions
from hand_models.rock import Profile
from hand_models.sections import Disc, FingerRock, FlatRock, PolylineSection
from tests.suite.helpers.fingers import (
    GRASPS,
    any_hold,
    faults,
    lifted,
    random_opening,
    random_section,
    rough_opening,
)
from tests.suite.helpers.hands import HAND, PINCH, ROCK, random_surface
from tests.suite.helpers.plain_closing import LostError, PlainFinger
from tests.suite.helpers.shares import given_some

MODEL = HAND.finger
H = MODEL.tile_height

seeds = st.integers(0, 2**32 - 1)


def kinds(closed):
    return [(contact.kind, contact.stop) for contact in closed.finger.contacts]


def close_one(*opened, model=MODEL):
    (closed,) = close_all(model, [OpenFinger(FingerRock(opened[0]), *opened[1:])])
    return closed


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_spines_let_go_where_the_declared_law_of_their_tile_ends(exponent):
    surface = replace(ROCK, pull_off_exponent=exponent, friction=0.0)
    (drive,) = drives(MODEL, [OpenFinger(FingerRock(FlatRock(1j, H)), surface, 37.0)])
    drive["lowers"] = 1
    for angle in np.linspace(0.05, math.pi / 2, 12):
        for share in (1.0, 0.3):
            most = share * float(surface.strength(angle))
            for size, holds in ((0.999, True), (1.001, False)):
                load = size * most
                loads = share, load * math.cos(angle), -load * math.sin(angle)
                over = _over(SETTINGS_RECORD[0], drive, 0, *loads)
                assert (over <= 0.0) == holds, (angle, share)


# Everywhere ---------------------------------------------------------------------------------------


@given_some(8, 400, seeds)
@example(235630260)
def test_wherever_a_finger_closes_it_is_clear_of_rock_whole_and_in_balance(seed):
    on_hold = random_opening(MODEL, seed)
    (closed,) = close_all(MODEL, [on_hold.opened])
    if isinstance(closed, ClosedFinger):
        assert faults(on_hold, closed) == []


# Rough rock ---------------------------------------------------------------------------------------


def on_rough_rock(first, count):
    on_holds = [
        rough_opening(MODEL, ROCK, seed, GRASPS[seed % len(GRASPS)])
        for seed in range(first, first + count)
    ]
    found = close_all(MODEL, [on_hold.opened for on_hold in on_holds])
    wrong = {
        seed: what
        for seed, (on_hold, closed) in enumerate(zip(on_holds, found, strict=True), first)
        if isinstance(closed, ClosedFinger) and (what := faults(on_hold, closed))
    }
    assert wrong == {}
    refused = [
        (on_hold, closed)
        for on_hold, closed in zip(on_holds, found, strict=True)
        if isinstance(closed, Refused)
    ]
    assert sum(closed.depth == 0.0 for _, closed in refused) <= max(1, 0.003 * count)
    deep = [(on_hold, closed) for on_hold, closed in refused if closed.depth > 0.0]
    # one that is deeper in the rock than a phalanx is long may find no way out of it
    deepest = MODEL.joint_spacing
    assert all(math.isfinite(closed.lift) or closed.depth > deepest for _, closed in deep)
    deep = [(on_hold, closed) for on_hold, closed in deep if math.isfinite(closed.lift)]
    # lifted by as much as they say they have room
    higher = [lifted(on_hold, closed.lift + 1e-6) for on_hold, closed in deep]
    again = close_all(MODEL, [on_hold.opened for on_hold in higher]) if higher else []
    for on_hold, closed in zip(higher, again, strict=True):
        assert isinstance(closed, ClosedFinger) or closed.depth < 1e-6
        if isinstance(closed, ClosedFinger):
            assert faults(on_hold, closed) == []


@pytest.mark.slow
def test_on_rough_rock_fingers_close():
    on_rough_rock(0, 10)


@pytest.mark.slow
@pytest.mark.parametrize("first", [10_000])
def test_on_rough_rock_fingers_close_slow(first):
    on_rough_rock(first, 60)


def test_spines_are_pulled_off_where_their_drag_is_too_little_for_the_pull():
    on_hold = rough_opening(MODEL, ROCK, 206, GRASPS[206 % len(GRASPS)])
    bare = on_hold.opened._replace(surface=replace(ROCK, friction=0.0))
    held, pulled = close_all(MODEL, [bare, on_hold.opened])
    powers = np.array([1.0, bare.tension])
    # strong enough for the pull, but a newton of it needs more drag than there is
    drag, pull = held.shears[0] @ powers, -(held.normals[0] @ powers)
    assert 0.0 < drag < 0.95 * ROCK.friction * pull
    assert (pulled.normals @ powers >= 0.0).all()
    assert pulled.shears[0] @ powers == 0.0
    assert faults(on_hold, pulled) == []


def knob(height, slope):
    """A table of 80 mm that stands so high on level ground, with so steep sides."""
    foot = 0.04 + height / math.tan(math.radians(slope))
    x = [-0.5 - foot, -foot, -0.04, 0.04, foot, foot + 0.5]
    return Profile(np.column_stack([x, [height, height, 0.0, 0.0, height, height]]))


@pytest.mark.parametrize("slope", [30.0, pytest.param(45.0, marks=pytest.mark.slow), 60.0])
@pytest.mark.parametrize("height", [0.06, 0.07, pytest.param(0.08, marks=pytest.mark.slow), 0.12])
def test_a_hand_closes_around_a_knob(height, slope):
    settled = HAND.settle(knob(height, slope), ROCK, Grasp())
    for finger in settled.fingers:
        assert finger.bearing
        assert all(contact.stop != "lower" for contact in finger.contacts)
        assert finger.contacts[-1].angle > 0.5 * math.radians(slope)


@pytest.mark.slow
def test_beside_a_low_knob_fingertips_cling_to_the_ground():
    """The distal joint's 72 N·mm at 37 N do not draw the tip off the ground and in to the knob."""
    hold = knob(0.04, 60.0)
    settled = HAND.settle(hold, ROCK, Grasp())
    section = HAND.section("inner_left", hold, Grasp(), settled.seating.pose)
    plain = PlainFinger(MODEL, OpenFinger(FingerRock(section), ROCK, 37.0))
    plain.close()
    np.testing.assert_allclose(plain.q, settled.fingers[1].joint_angles, atol=SAME)
    for finger in settled.fingers:
        assert finger.bearing == (2,)
        assert finger.contacts[-1].kind == "edge"
        assert 0.0 < finger.contacts[-1].angle < math.radians(30.0)


# Against a plain simulation -----------------------------------------------------------------------

SAME = 1e-2
"""By how much the angles of a finger may differ [rad]: spines hold at the least gap that there was,
which the increments of a path find to a tenth of a millimetre."""


def compared(openings):
    """Seeds of fingers that end elsewhere than a plain simulation of the same law does."""
    apart, count = {}, 0
    found = close_all(MODEL, [opened for _, opened in openings])
    for (seed, opened), closed in zip(openings, found, strict=True):
        if isinstance(closed, Refused):
            continue
        plain = PlainFinger(MODEL, opened)
        count += 1
        try:
            plain.close()
        except LostError as lost:
            apart[seed] = str(lost)
            continue
        turned = float(np.abs(plain.q - closed.finger.joint_angles).max())
        loaded = np.abs(closed.normals @ [1.0, opened.tension]) > 0.05
        if turned > SAME or (loaded & ~plain.touching).any():
            apart[seed] = turned
    return apart, count


def openings_of(seeds):
    """Half of them over any hold, half over rough rock."""
    for seed in seeds:
        yield seed, random_opening(MODEL, seed).opened
        yield -seed - 1, rough_opening(MODEL, ROCK, seed).opened


@pytest.mark.slow
@pytest.mark.parametrize("part", range(4))
def test_fingers_end_where_a_plain_simulation_does(part):
    apart, count = compared(list(openings_of(range(8 * part, 8 * part + 5))))
    assert len(apart) <= 0.2 * count, apart


# Closed forms -------------------------------------------------------------------------------------


def on_cylinder(diameter):
    """The path on a cylinder in the seat of Fig. 12, and the finger laid there."""
    hold = Cylinder(diameter)
    settled = HAND.settle(hold, ROCK, PINCH)
    section = HAND.section("inner_left", hold, PINCH, settled.seating.pose)
    laid = settle_finger(MODEL, section, (0.0, 0.0))
    return close_one(section, ROCK, 37.0), laid


def balanced(finger, tension):
    """Normals with which f r − K q − Σ a × F vanishes at every joint, from the distal one on.

    Of a finger without tendon friction whose tiles have just closed.
    """
    normals = np.zeros(3)
    shears = tension * np.array([0.1317, 0.1801, 0.2006])
    turned = np.exp(1j * np.cumsum(finger.joint_angles))
    joints = MODEL.joint_spacing * np.array([0.0, turned[0], turned[0] + turned[1]])
    points = joints + (np.array([c.along for c in finger.contacts]) + 1j * H) * turned
    for i, radius in reversed(list(enumerate((5.5e-3, 3.195e-3, 1.945e-3)))):
        # the rock drags a phalanx outward along it, and presses it away from the rock
        forces = turned * (shears - 1j * normals)
        torque = tension * radius - 0.05 * finger.joint_angles[i]
        torque += ((points - joints[i]).conjugate() * forces).imag[i:].sum()
        normals[i] = torque / finger.contacts[i].along
    return normals


def test_on_a_cylinder_a_path_ends_where_a_finger_is_laid():
    for diameter in [0.3, 0.7]:
        closed, laid = on_cylinder(diameter)
        # tangents from a joint to a circle are alike: contacts alternate
        c = MODEL.joint_spacing - laid.contacts[0].along
        turns = [
            2.0 * math.atan(each / (0.5 * diameter + H)) for each in (c, laid.contacts[0].along)
        ]
        np.testing.assert_allclose(laid.joint_angles[1:], turns, atol=1e-9)
        np.testing.assert_allclose(closed.finger.joint_angles, laid.joint_angles, atol=1.5e-3)
        assert kinds(closed) == [("face", None)] * 3
        np.testing.assert_allclose(closed.normals @ [1.0, 37.0], balanced(laid, 37.0), atol=0.2)
        np.testing.assert_allclose(closed.finger.engagement, 1.0, atol=0.01)


def test_on_a_cylinder_phalanges_come_to_the_rock_one_after_the_other():
    """At the tension of each joint's spring where it then rests, 3.44, 3.73 and 8.16 N."""
    closed, laid = on_cylinder(0.3)
    np.testing.assert_allclose(closed.touches, [3.44, 3.73, 8.16], rtol=0.03)
    springs = resting_tensions(MODEL, laid.joint_angles, np.ones(3))
    np.testing.assert_allclose(closed.touches, springs, rtol=0.03)


def test_on_flat_rock_a_path_ends_as_laid():
    closed = close_one(FlatRock(1j, H), ROCK, 37.0)
    np.testing.assert_allclose(closed.finger.joint_angles, 0.0, atol=1e-4)
    assert kinds(closed) == [("face", None)] * 3
    along = [contact.along for contact in closed.finger.contacts]
    np.testing.assert_allclose(along, MODEL.tile_centre, atol=2e-4)
    laid = settle_finger(MODEL, FlatRock(1j, H), (0.0, 0.0))
    normals = laid.normals(laid.shears(37.0)) @ [1.0, 37.0]
    np.testing.assert_allclose(closed.normals @ [1.0, 37.0], normals, atol=0.2)


def test_a_hand_on_a_plane_is_as_laid():
    for finger in HAND.settle(Plane(), ROCK).fingers:
        np.testing.assert_allclose(finger.joint_angles, 0.0, atol=1e-4)
        assert all(finger.touching)


def test_without_rock_a_finger_turns_until_its_springs_or_stops_hold_it():
    for tension in (0.5, 5.0, 37.0):
        closed = close_one(None, ROCK, tension)
        free = tension * np.array(MODEL.pulley_radii) / np.array(MODEL.joint_stiffness)
        turned = np.minimum(free, MODEL.joint_upper)
        np.testing.assert_allclose(closed.finger.joint_angles, turned, atol=1e-7)
        assert [kind for kind, _ in kinds(closed)] == ["none"] * 3
        assert np.isnan(closed.touches).all()


# Properties ---------------------------------------------------------------------------------------


def random_closings(rng, count):
    return [
        OpenFinger(
            FingerRock(random_section(rng)),
            random_surface(rng),
            float(rng.uniform(15.0, 60.0)),
            bool(rng.random() < 0.5),
        )
        for _ in range(count)
    ]


def assert_alike(one, other, atol=1e-9):
    """Two fingers, or refusals."""
    assert type(one) is type(other)
    if isinstance(one, Refused):
        np.testing.assert_allclose(one, other, atol=atol)
        return
    assert kinds(one) == kinds(other)
    for mine, theirs in zip(one.finger.contacts, other.finger.contacts, strict=True):
        np.testing.assert_allclose(mine.angle, theirs.angle, atol=atol)
        np.testing.assert_allclose(mine.along, theirs.along, atol=atol)
    size = max(1.0, np.abs(one.normals).max())
    for mine, theirs in zip(one[1:4], other[1:4], strict=True):
        np.testing.assert_allclose(mine, theirs, atol=100.0 * atol * size)


@given_some(3, 30, seeds)
def test_fingers_close_together_as_they_do_alone(seed):
    rng = np.random.default_rng(seed)
    closings = random_closings(rng, 3)
    together = close_all(MODEL, closings)
    backward = close_all(MODEL, closings[::-1])[::-1]
    for closing, closed, other in zip(closings, together, backward, strict=True):
        (alone,) = close_all(MODEL, [closing])
        assert_alike(closed, alone)
        assert_alike(other, alone)


def test_a_hand_with_rock_in_a_finger_closes_no_other():
    free, deep = (FingerRock(Disc(complex(0.05, z), 0.05)) for z in (0.07, 0.02))
    closings = [OpenFinger(rock, ROCK, 37.0) for rock in (free, deep, free, free)]
    apart = close_all(MODEL, closings)
    found = close_all(MODEL, closings, ["one", "one", "two", "three"])
    assert found[0] == Refused(0.0, pytest.approx(math.nan, nan_ok=True))
    assert found[1] == apart[1]
    assert isinstance(apart[1], Refused)
    assert apart[1].depth > 0.0
    for closed, alone in zip(found[2:], apart[2:], strict=True):
        assert_alike(closed, alone)


@given_some(4, 40, seeds)
def test_what_is_scaled_closes_alike(seed):
    """Lengths by a, forces by b: springs' torques by a b, stiffness of the bed by b / a."""
    rng = np.random.default_rng(seed)
    centre = complex(rng.uniform(0.0, 0.1), rng.uniform(0.05, 0.2))
    section = Disc(centre, float(rng.uniform(0.02, 0.1)))
    tension, strength = float(rng.uniform(15.0, 60.0)), float(rng.uniform(10.0, 80.0))
    a, b = 1.25, 3.0
    long = ("joint_spacing", "tile_height", "tile_centre", "tile_length", "spine_travel")
    numbers = {name: a * getattr(MODEL, name) for name in (*long, "frame_radius")}
    numbers["pulley_radii"] = tuple(a * r for r in MODEL.pulley_radii)
    for name in ("joint_stiffness", "joint_preload"):
        numbers[name] = tuple(a * b * each for each in getattr(MODEL, name))
    numbers["bed_stiffness"] = MODEL.bed_stiffness * b / a
    larger = FingerModel(**{**vars(MODEL), **numbers})
    disc = Disc(a * section.centre, a * section.radius)
    surfaces = [Surface.from_values({"shear_limit": each * strength}) for each in (1.0, b)]
    one = close_one(section, surfaces[0], tension)
    other = close_one(disc, surfaces[1], b * tension, model=larger)
    assert type(one) is type(other)
    if isinstance(one, Refused):
        np.testing.assert_allclose([a * one.depth, a * one.lift], other, atol=1e-9)
        return
    assert kinds(one) == kinds(other)
    np.testing.assert_allclose(one.finger.joint_angles, other.finger.joint_angles, atol=1e-6)
    loads = one.normals @ [1.0, tension], other.normals @ [1.0, b * tension]
    np.testing.assert_allclose(b * loads[0], loads[1], atol=1e-4)


@given_some(7, 40, seeds)
def test_the_same_rock_told_otherwise_is_the_same(seed):
    """A plane with a normal, and a line drawn along it; holds drawn mirrored and seen mirrored."""
    rng = np.random.default_rng(seed)
    turn = float(rng.uniform(-0.4, 0.6))
    into = complex(-math.sin(turn), math.cos(turn))
    offset = float(rng.uniform(H, 0.03))
    line = into * (offset + 1j * np.array([0.3, -0.3]))
    flat = close_one(FlatRock(complex(into.real, into.imag), offset), ROCK, 37.0)
    drawn = close_one(
        PolylineSection([np.column_stack([line.real, line.imag])], faceted=True), ROCK, 37.0
    )
    assert type(flat) is type(drawn)
    if isinstance(flat, ClosedFinger):
        np.testing.assert_allclose(flat.finger.joint_angles, drawn.finger.joint_angles, atol=2e-4)


@given_some(5, 60, seeds)
def test_a_mirrored_hold_holds_a_mirrored_finger(seed):
    """Seen along −y in a hold that is alike on both sides of its plane y = 0."""
    rng = np.random.default_rng(seed)
    hold = any_hold(rng)
    if isinstance(hold, Profile) or not hasattr(hold, "diameter"):
        return
    x = np.array([1.0, rng.uniform(-0.3, 0.3), rng.uniform(-0.3, 0.3)])
    x /= np.linalg.norm(x)
    z = np.cross(x, [0.0, 1.0, 0.0])
    z /= np.linalg.norm(z)
    origin = np.array([*rng.uniform(-0.05, 0.05, 2), -rng.uniform(0.006, 0.02)])
    mirror = np.array([1.0, -1.0, 1.0])
    one, other = (
        close_one(hold.section(m * origin, m * x, m * z), ROCK, 37.0) for m in (1.0, mirror)
    )
    assert_alike(one, other, 1e-7)


def test_a_little_change_of_the_rock_changes_little():
    """But for the few that are about to slip off, or to touch."""
    rng = np.random.default_rng(5)
    discs = [
        ((float(x), float(z) + float(r)), float(r))
        for x, z, r in zip(
            rng.uniform(-0.02, 0.1, 30),
            rng.uniform(0.005, 0.03, 30),
            rng.uniform(0.02, 0.3, 30),
            strict=True,
        )
    ]
    one, other = (
        close_all(
            MODEL,
            [
                OpenFinger(FingerRock(Disc(complex(x, z + dz), r)), ROCK, 37.0)
                for (x, z), r in discs
            ],
        )
        for dz in (0.0, 1e-6)
    )
    moved = [
        np.abs(mine.finger.joint_angles - theirs.finger.joint_angles).max()
        for mine, theirs in zip(one, other, strict=True)
        if isinstance(mine, ClosedFinger) and isinstance(theirs, ClosedFinger)
    ]
    assert len(moved) > 20
    assert np.mean(np.array(moved) < 1e-3) > 0.95


def test_a_finger_that_snaps_ends_alike_at_every_tension():
    """Around a pipe of 100 mm the tip touches first and slides: its spines hold all the while."""
    for tension in (12.0, 13.0, 16.6, 25.0, 30.0, 32.0, 37.0):
        grasp = Grasp(math.pi, closing_tension=tension)
        finger = HAND.settle(Cylinder(0.1), ROCK, grasp).fingers[1]
        assert [contact.kind for contact in finger.contacts] == ["none", "face", "face"]


# Refused ------------------------------------------------------------------------------------------


def test_a_finger_in_the_rock_says_how_deep_and_how_to_leave_it():
    section = FlatRock(1j, -0.06)
    refused = close_one(section, ROCK, 37.0)
    assert isinstance(refused, Refused)
    # its joint is that deep, and the tiles' faces or the bar's end deeper still
    assert 0.06 < refused.depth < 0.2
    higher = close_one(FlatRock(1j, -0.06 + refused.lift + 1e-6), ROCK, 37.0)
    assert isinstance(higher, ClosedFinger)
    lower = close_one(FlatRock(1j, -0.06 + refused.lift - 1e-4), ROCK, 37.0)
    assert isinstance(lower, Refused)


def test_a_finger_amid_rock_cannot_be_lifted_out_of_it():
    for radius in [
        0.14,
        1.0,
    ]:
        refused = close_one(Disc(0.05 + 0j, radius), ROCK, 37.0)
        assert isinstance(refused, Refused)
        assert refused.depth > 0.0
        assert math.isinf(refused.lift)


def test_a_straight_finger_clings_where_no_rock_is_in_its_way():
    free = cling(MODEL, FlatRock(1j, 0.008))
    assert isinstance(free, ClosedFinger)
    np.testing.assert_array_equal(free.finger.joint_angles, 0.0)
    assert not free.finger.bearing
    deep = cling(MODEL, FlatRock(1j, 0.002))
    assert isinstance(deep, Refused)
    assert deep.depth == pytest.approx(H - 0.002, abs=5e-5)
    assert isinstance(cling(MODEL, None), ClosedFinger)
