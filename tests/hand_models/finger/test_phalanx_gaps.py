"""How near a phalanx is to rock: the level of a bed of springs, and where its force acts."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hand_models.finger.around import around_rock
from hand_models.finger.model import FingerModel
from hand_models.finger.path_state import SETTINGS_RECORD, OpenFinger, drives
from hand_models.finger.phalanx_shape import PhalanxShape, fan_out
from hand_models.parameters import ParameterTable, own_hand
from hand_models.sections import (
    Disc,
    FingerRock,
    FlatRock,
    Outlines,
    PolylineSection,
    RockStrips,
)
from hand_models.tile import Surface
from tests.suite.helpers import phalanges
from tests.suite.helpers.hands import HAND

MODEL = HAND.finger
SHAPE = PhalanxShape.of(MODEL)
H = MODEL.tile_height
DEPTH = 2e-4

seeds = st.integers(0, 2**32 - 1)


def beside(section, angle, joint=0.0, depth=DEPTH):
    """A phalanx at an angle beside rock."""
    rock = Outlines.of([FingerRock(section)], 0.2, SHAPE.spacing)
    u = np.exp(1j * np.asarray(angle, dtype=float))
    return phalanges.beside(rock, SHAPE, np.asarray(joint, dtype=complex), u, np.asarray(depth))


def flat(offset):
    return FlatRock(1j, offset)


def test_a_bar_is_as_high_as_its_tile_and_as_thick_as_the_frame():
    assert SHAPE.lift + SHAPE.radius == pytest.approx(H)
    assert SHAPE.radius == pytest.approx(MODEL.frame_radius)
    assert (SHAPE.near, SHAPE.far) == MODEL.tile_range
    assert SHAPE.end == MODEL.joint_spacing


def test_the_gap_of_a_face_that_lies_flat_is_its_distance():
    for off in [-1e-4, 0.0, 1e-4, 3e-3]:
        found = beside(flat(H + off), 0.0)
        assert found.gap == pytest.approx(off, abs=2e-7)
        assert found.tile_gap == pytest.approx(off, abs=2e-6)
        assert found.place.real == pytest.approx(MODEL.tile_centre, abs=5e-4)
        assert found.place.imag == pytest.approx(H, abs=1e-5)
        assert found.push == pytest.approx(1j, abs=0.03)


def test_the_force_wanders_to_the_edge_of_a_face_that_tilts_without_a_jump():
    """About the face's far end, which stays on the rock: from the middle to that."""
    tilts = np.arange(0.0, 0.03, 1e-4)
    corner = complex(SHAPE.far, SHAPE.lift)
    joints = corner - corner * np.exp(1j * tilts)
    found = beside(flat(H), tilts, joints)
    np.testing.assert_allclose(found.gap, 0.0, atol=8.0 * SHAPE.fine)
    place = found.place.real
    assert place[0] == pytest.approx(MODEL.tile_centre, abs=5e-4)
    assert place[-1] == pytest.approx(SHAPE.far, abs=2e-3)
    assert np.abs(np.diff(place)).max() < 1e-3
    assert np.diff(place).min() > -5e-5
    assert np.abs(np.diff(np.angle(found.push))).max() < 1e-2
    # it presses along the rock's normal, wherever on the bar it does
    np.testing.assert_allclose(found.push * np.exp(1j * tilts), 1j, atol=0.03)


def test_on_rock_that_bends_away_it_acts_where_the_distance_is_least():
    for along in (0.012, 0.02, 0.028):
        centre = along + 1j * (H + 0.05)
        found = beside(Disc(centre, 0.05), 0.0)
        assert found.place.real == pytest.approx(along, abs=3e-4)
        assert found.push == pytest.approx(1j, abs=0.02)
        assert -5.0 * SHAPE.fine < found.gap < 5.0 * SHAPE.fine


@pytest.mark.parametrize("radius", [0.01, 0.05, 0.3])
def test_the_force_keeps_its_place_on_a_bulge_that_moves(radius):
    """By less than a thousandth of the spacing of the points that stand for the rock."""
    for moved in np.arange(0.0, 3e-4, 7e-6):
        along = 0.02 + moved
        found = beside(Disc(along + 1j * (H + radius), radius), 0.0)
        assert found.place.real == pytest.approx(along, abs=1e-3 * SHAPE.spacing)


def test_the_end_of_a_phalanx_presses_as_a_disc():
    """On rock right ahead of it, and on rock behind its back."""
    wall = FlatRock(1.0 + 0j, SHAPE.end + SHAPE.radius)
    found = beside(wall, 0.0)
    assert found.gap == pytest.approx(0.0, abs=8.0 * SHAPE.fine)
    assert found.place == pytest.approx(SHAPE.end + SHAPE.radius, abs=3e-4)
    assert found.push == pytest.approx(1.0, abs=0.05)
    behind = FlatRock(-1j, SHAPE.radius)
    found = beside(behind, 0.0)
    assert found.gap == pytest.approx(0.0, abs=8.0 * SHAPE.fine)
    assert found.place == pytest.approx(complex(SHAPE.end, -SHAPE.radius), abs=5e-3)
    assert found.push == pytest.approx(-1j, abs=0.1)


def test_the_gap_of_the_tile_leaves_out_the_frame():
    """A rung under the end of the phalanx: on the bar, but off the tile."""
    centre = complex(SHAPE.end, SHAPE.radius + 0.003)
    found = beside(Disc(centre, 0.003), 0.0)
    corner = complex(SHAPE.far, SHAPE.lift)
    assert found.gap == pytest.approx(0.0, abs=8.0 * SHAPE.fine)
    off = abs(centre - corner) - 0.003 - SHAPE.radius
    assert found.tile_gap == pytest.approx(off, abs=1e-4)
    assert off > 5e-3


def bed(section, q, depth):
    """Level of a bed of springs under each phalanx, from the bar's distances alone.

    With the place and the direction of its force.
    """
    rock = Outlines.of([FingerRock(section)], 0.2, SHAPE.spacing)
    depths = np.full(3, depth)
    joints, u = fan_out(q, SHAPE.end)
    return phalanges.beside(rock, SHAPE, joints, u, depths), joints, u


@given(seeds)
def test_the_gap_falls_by_the_arm_of_the_push(seed):
    """Of a bed that is pressed in by no more than what makes its level: virtual work."""
    rng = np.random.default_rng(seed)
    if rng.random() < 0.5:
        turn = rng.uniform(-0.5, 0.8)
        section = FlatRock(1j * np.exp(1j * turn), float(rng.uniform(0.005, 0.03)))
    else:
        r = float(rng.uniform(0.01, 0.3))
        section = Disc(complex(rng.uniform(0.0, 0.1), r + rng.uniform(0.0, 0.03)), r)
    q = rng.uniform(-0.2, 0.6, 3)
    # level = gap + fine
    found, joints, u = bed(section, q, SHAPE.fine)
    if (found.gap < -2e-3).any():
        return
    step = 1e-8
    for j in range(3):
        above, below = (bed(section, q + s * step * np.eye(3)[j], SHAPE.fine)[0] for s in (1, -1))
        slope = (above.gap - below.gap) / (2.0 * step)
        arms = (joints + found.place * u) - joints[j]
        turned = (arms.conj() * found.push * u).imag
        # the push is a mean of unit vectors made one long again
        own = np.arange(3) >= j
        np.testing.assert_allclose(slope[own], -turned[own], rtol=2e-2, atol=1e-4)
        np.testing.assert_array_equal(slope[~own], 0.0)


def test_gaps_are_within_a_few_of_the_least_distance():
    rng = np.random.default_rng(1)
    for _ in range(40):
        r = float(rng.uniform(0.005, 0.3))
        centre = complex(rng.uniform(0.01, 0.04), H + r + rng.uniform(0.0, 0.005))
        found = beside(Disc(centre, r), 0.0)
        part = np.linspace(0.0, 1.0, 4001)
        corner = complex(SHAPE.far, SHAPE.lift)
        axis = np.concatenate(
            [
                SHAPE.near + part * (SHAPE.far - SHAPE.near) + 1j * SHAPE.lift,
                corner + part * (SHAPE.end - corner),
            ]
        )
        least = np.abs(axis - centre).min() - r - SHAPE.radius
        assert least - 2.0 * SHAPE.fine < found.gap < least + 8.0 * SHAPE.fine


def test_phalanges_fan_out_from_the_first_joint():
    q = np.array([0.3, -0.2, 0.5])
    joints, u = fan_out(q, 0.04)
    np.testing.assert_allclose(np.angle(u), [0.3, 0.1, 0.6])
    np.testing.assert_allclose(joints, [0.0, 0.04 * u[0], 0.04 * (u[0] + u[1])])


@given(seeds)
def test_of_the_points_that_may_press_phalanges_are_as_beside_all_rock(seed):
    """Where they are, and wherever they may yet turn to."""
    rng = np.random.default_rng(seed)
    r, turn = float(rng.uniform(0.003, 0.3)), float(rng.choice([0.0, 1e-7, 1e-3]))
    round_rock = Disc(complex(rng.uniform(0.0, 0.1), r + rng.uniform(0.0, 0.03)), r)
    q, depth = rng.uniform(-0.1, 0.4, 3), rng.uniform(0.0, 5e-4, 3)
    for section in (flat(H), round_rock):
        rock = Outlines.of([FingerRock(section)], 0.2, SHAPE.spacing)
        within = depth + turn * 6.0 * (SHAPE.end + SHAPE.radius + depth)
        near = phalanges.points_near(rock, SHAPE, *fan_out(q, SHAPE.end), within)
        joints, u = fan_out(q + turn * rng.uniform(-1.0, 1.0, 3), SHAPE.end)
        found = phalanges.beside(rock, SHAPE, joints, u, depth, near)
        for value, want in zip(found, phalanges.beside(rock, SHAPE, joints, u, depth), strict=True):
            np.testing.assert_allclose(value, want, rtol=1e-9, atol=1e-12)
        assert sum(len(each) for each in near) < 3 * rock.points.shape[1]


@pytest.mark.parametrize("exponent", [0.5, 1.0, 3.0])
def test_the_share_of_spines_across_a_gap_follows_the_hands_law(exponent):
    entry = {"value": exponent, "unit": "1", "source": "assumed"}
    table = own_hand(ParameterTable.of({"tile": {"engagement_exponent": entry}}))
    model = FingerModel.from_table(table)
    for gap in (1e-3, 2.5e-3, 4.9e-3):
        rock = FingerRock(flat(H + gap))
        drive = drives(model, [OpenFinger(rock, Surface.named("rock"), 37.0)])
        outlines = Outlines.of([rock], 0.2, SHAPE.spacing)
        around = around_rock(outlines, PhalanxShape.of(model), drive, np.zeros((1, 3)))
        expected = 1.0 - (gap / 5e-3) ** exponent
        np.testing.assert_allclose(around["share"][0], expected, atol=2e-3)


def rough_rock(rng):
    """Rock under a finger and beside it that goes up and down, in 17 strips across its tiles."""
    s = np.arange(-0.15, 0.15, 5e-4)
    waves = 10.0 ** rng.uniform(-4.0, -2.7, 4)[:, None] * np.sin(
        np.outer(rng.uniform(20.0, 400.0, 4), s) + rng.uniform(0.0, 6.0, (4, 1))
    )
    t = H + rng.uniform(0.0, 6e-3) + waves.sum(axis=0)
    beside = t - np.maximum(5e-4 * np.sin(rng.uniform(50.0, 300.0) * s), 0.0)
    tile, frame = (np.column_stack([s, each]) for each in (t, beside))
    behind = rng.uniform(0.0, 3e-3, (len(s), 17))
    behind[rng.random(behind.shape) < 0.1] = np.inf
    strips = RockStrips(np.linspace(-0.012, 0.012, 17), s + 1j * t, np.full(len(s), 1j), behind)
    return FingerRock(PolylineSection([tile]), PolylineSection([frame]), strips)


@given(seeds)
def test_derivatives_are_differences_from_a_finger_that_is_turned(seed):
    """Of all that is around it there, not only of the rock that counts where it is."""
    rng = np.random.default_rng(seed)
    rock, turn = rough_rock(rng), SETTINGS_RECORD["derivative_turn"][0]
    drive = drives(MODEL, [OpenFinger(rock, Surface.named("rock"), 37.0)] * 4)
    q = np.vstack([np.zeros(3), turn * np.eye(3)]) + rng.uniform(-0.1, 0.3, 3)
    outlines = Outlines.of([rock] * 4, MODEL.size.reach, SHAPE.spacing)
    here, *turned = around_rock(outlines, SHAPE, drive, q)
    for k, there in enumerate(turned):
        for name in ("gap", "share", "a", "b"):
            change = (there[name] - here[name]) / turn
            np.testing.assert_allclose(here[f"d_{name}"][..., k], change, atol=1e-8)
