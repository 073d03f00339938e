"""The whole hand: where its tiles are and how it is seated."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import strategies as st

from hand_models import (
    FINGERS,
    CruxError,
    Cylinder,
    Edge,
    Grasp,
    InvalidInputError,
    Plane,
    Pose,
    Sphere,
)
from hand_models.finger import PHALANGES
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.hand import Placement
from tests.suite.helpers.hands import HAND, PINCH, ROCK, pinch, seating_on, settled_at
from tests.suite.helpers.rocks import in_hand
from tests.suite.helpers.shares import given_some

MESH_ORIGIN = np.array([-19.85, 0.0, 43.4])
"""Of H in the frame of the published CAD mesh, axes parallel [mm]."""

MIRROR = np.array([1.0, -1.0, 1.0])

seeds = st.integers(0, 2**32 - 1)


def off_a_wall(offs):
    """Hands whose outer fingers are not turned, off a wall by so much [m]."""
    poses = [Pose(np.array([0.0, 0.0, off]), np.eye(3)) for off in offs]
    grasp = Grasp(outer_rotation=0.0)
    return HAND.settle_each([Placement(Plane(), ROCK, grasp, pose) for pose in poses])


def test_the_hand_has_22_tiles_8_of_them_in_the_palm():
    settled = pinch()
    assert len(settled.tiles) + len(settled.palm.gaps) == 22
    assert len(settled.palm.gaps) == 8
    expected = [
        (finger, phalanx)
        for finger in FINGERS
        for phalanx in (("base", *PHALANGES) if finger.startswith("outer") else PHALANGES)
    ]
    assert [(tile.finger, tile.phalanx) for tile in settled.tiles] == expected


def test_palm_tiles_and_joints_are_where_the_cad_mesh_has_them():
    columns, rows = [-60.6, -33.1, -6.2, 20.9], [14.1, -14.1]
    mesh = np.array([(x, y, 43.4) for x in columns for y in rows]) - MESH_ORIGIN
    np.testing.assert_allclose(1e3 * HAND.palm_tiles, mesh, atol=0.011)
    joints = {f: 1e3 * frame.joint for f, frame in zip(FINGERS, HAND.frames(0.0), strict=True)}
    np.testing.assert_allclose(joints["inner_left"] + MESH_ORIGIN, [46.3, 16.5, 42.8], atol=0.01)
    np.testing.assert_allclose(joints["inner_right"] + MESH_ORIGIN, [46.3, -16.5, 42.8], atol=0.01)
    # outer fingers: 34.6 mm from an axis at (12.9, ±50.5), turned outward
    turned = HAND.frames(math.radians(11.3))[FINGERS.index("outer_left")]
    reach = 34.6 * np.array([math.cos(math.radians(11.3)), math.sin(math.radians(11.3))])
    np.testing.assert_allclose(
        (1e3 * turned.joint + MESH_ORIGIN)[:2], np.array([12.9, 50.5]) + reach, atol=0.01
    )


def test_base_tiles_turn_with_their_fingers_as_in_the_cad_mesh():
    settled = HAND.settle(Plane(), ROCK, Grasp(outer_rotation=math.radians(11.3)))
    base = settled.positions[[tile.phalanx == "base" for tile in settled.tiles]]
    mesh = 1e3 * base[:, :2] + MESH_ORIGIN[:2]
    np.testing.assert_allclose(mesh, [[24.3, 52.4], [24.3, -52.4]], atol=0.6)


def test_at_rest_all_fingers_are_alike_and_turned_by_pi_the_outer_ones_oppose():
    for frame in HAND.frames(0.0):
        np.testing.assert_allclose(frame.along, [1, 0, 0], atol=1e-15)
    for name, frame in zip(FINGERS, HAND.frames(math.pi), strict=True):
        sign = -1 if name.startswith("outer") else 1
        np.testing.assert_allclose(frame.along, [sign, 0, 0], atol=1e-15)
        np.testing.assert_allclose(np.cross([0, 0, 1], frame.along), frame.across, atol=1e-15)
    # outward: half way, each points to its own side
    left, *_, right = HAND.frames(math.pi / 2)
    np.testing.assert_allclose([left.along[1], right.along[1]], [1, -1])


def test_opposed_bases_are_68_mm_apart():
    outer, inner, *_ = HAND.frames(math.pi)
    assert inner.joint[0] - outer.joint[0] == pytest.approx(0.068, abs=1e-4)


def test_in_a_pinch_the_crest_is_midway_and_the_palm_stands_off():
    for diameter, stand_off in [(0.3, 2.3), (0.7, 3.3)]:
        settled = pinch(diameter)
        x, y, z = 1e3 * settled.seating.pose.position
        assert settled.seating.rule == "pinch"
        np.testing.assert_allclose(settled.seating.pose.rotation, np.eye(3))
        assert (x, y) == (pytest.approx(0.5 * (66.15 + 32.75 - 34.6)), 0.0)
        assert z == pytest.approx(stand_off, abs=0.06)
        for finger in settled.fingers:
            assert finger.contacts[0].along == pytest.approx(0.0247, abs=8e-4)


def test_in_other_grasps_the_palm_rests_on_the_rock_and_the_crest_is_where_inner_fingers_close():
    settled = HAND.settle(Cylinder(0.3), ROCK)
    x, y, z = 1e3 * settled.seating.pose.position
    assert settled.seating.rule == "palm_on_rock"
    # Pythagoras: joint to centre along x, (154.7² + 24.7² − 150.6²)^½ mm = 43.15 mm
    assert x == pytest.approx(66.15 - 43.15, abs=0.01)
    assert (y, z) == (0.0, 0.0)
    for name, finger in zip(FINGERS, settled.fingers, strict=True):
        if name.startswith("inner"):
            assert finger.contacts[0].along == pytest.approx(0.0247, abs=8e-4)


def test_on_a_plane_every_contact_is_at_its_tiles_centre():
    for grasp in (Grasp(), PINCH):
        settled = HAND.settle(Plane(), ROCK, grasp)
        assert settled.seating.rule == "flat"
        for finger in settled.fingers:
            assert [c.along for c in finger.contacts] == [HAND.finger.tile_centre] * 3
            np.testing.assert_allclose(finger.joint_angles, 0.0, atol=1e-12)
        assert settled.palm.engaged == tuple(range(8))


def test_where_no_seat_can_be_had_the_crest_is_under_the_palm():
    for hold in [Cylinder(0.005), Sphere(0.01), Edge(0.001, 0.5)]:
        for grasp in (Grasp(), PINCH):
            seating = seating_on(hold, grasp)
            assert seating.rule == "palm_on_rock_centred"
            np.testing.assert_array_equal(seating.pose.position, 0.0)


def test_four_of_eight_palm_tiles_engage_in_a_pinch_of_300_mm():
    palm = pinch().palm
    beside = np.array([-40.75, -13.25, 13.65, 40.75]) - 0.5 * (66.15 + 32.75 - 34.6)
    gaps = 2.3 + 150.0 - np.sqrt(150.0**2 - beside**2)
    np.testing.assert_allclose(1e3 * palm.gaps, np.repeat(gaps, 2), atol=0.1)
    assert palm.engaged == (4, 5, 6, 7)
    # of 5 mm of travel, what each tile's gap leaves
    share = 1.0 - palm.gaps[4:] / 0.005
    np.testing.assert_allclose(palm.engagement, share, rtol=1e-12)
    np.testing.assert_allclose(share[::2], 1.0 - gaps[2:] / 5.0, atol=0.02)
    x = share @ [0.01365, 0.01365, 0.04075, 0.04075] / share.sum()
    np.testing.assert_allclose(palm.centre[:2], [x, 0.0], atol=1e-12)
    assert palm.centre[2] == pytest.approx(share @ palm.gaps[4:] / share.sum())
    assert palm.pressing_limit == pytest.approx(250.0 * share.sum())
    assert palm.shear_limit == pytest.approx(
        ROCK.shear_limit * share.sum()
    )  # alike tiles share alike


@pytest.mark.parametrize("steps", [25, pytest.param(501, marks=pytest.mark.slow)])
def test_what_a_palm_carries_fades_with_its_distance_from_the_rock(steps):
    palms = [settled.palm for settled in off_a_wall(np.linspace(0.0, 5.01e-3, steps + 1))]
    found = np.array([(palm.shear_limit, palm.pressing_limit) for palm in palms])
    np.testing.assert_allclose(found[0], [8 * ROCK.shear_limit, 8 * 250.0], rtol=0.03)
    np.testing.assert_array_equal(found[-1], 0.0)
    # by a hundredth of a millimetre at a time, no more than a five-hundredth of it all
    assert (np.abs(np.diff(found, axis=0)) <= 1.05 / steps * found[0]).all()


def test_a_grasp_without_palm_has_none():
    palm = pinch(palm=False).palm
    assert palm.engaged == ()
    assert (palm.shear_limit, palm.pressing_limit) == (0.0, 0.0)


def test_left_and_right_mirror_each_other():
    for hold, rotation in [
        (Cylinder(0.3), 0.0),
        (Sphere(0.5), 0.7),
        (Edge(0.1, 1.5), 1.9),
        (Plane(), math.pi),
    ]:
        settled = HAND.settle(hold, ROCK, Grasp(outer_rotation=rotation))
        for left, right in ((0, 3), (1, 2)):
            a, b = (settled.finger_of == i for i in (left, right))
            np.testing.assert_allclose(
                settled.positions[a], settled.positions[b] * MIRROR, atol=1e-9
            )
            np.testing.assert_allclose(settled.loads[a], settled.loads[b], atol=1e-7)
            mirrored = settled.axes[b] * MIRROR * [[1], [1], [-1]]  # lateral: z × along turns round
            np.testing.assert_allclose(settled.axes[a], mirrored, atol=1e-9)
        np.testing.assert_allclose(settled.palm.gaps[::2], settled.palm.gaps[1::2])


@pytest.mark.slow
@pytest.mark.parametrize("hold", [Cylinder(0.3), Cylinder(8.0), Sphere(0.6)])
def test_tiles_move_continuously_as_the_outer_fingers_turn(hold):
    pose = seating_on(hold, PINCH).pose
    turns = np.linspace(0.0, math.pi, 315)
    grasps = [Grasp(outer_rotation=float(turn)) for turn in turns]
    hands = HAND.settle_each([Placement(hold, ROCK, grasp, pose) for grasp in grasps])
    for one, other in itertools.pairwise(hands):
        if one.tiles == other.tiles:
            # at most the 0.2 m arm times 0.01 rad, and the same again for closing; a tile that is
            # just held moves as far again
            assert np.abs(one.positions - other.positions).max() < 0.008
        else:
            changed = [a.finger for a, b in zip(one.tiles, other.tiles, strict=True) if a != b]
            assert all(finger.startswith("outer") for finger in changed)
    assert sum(a.tiles != b.tiles for a, b in itertools.pairwise(hands)) <= 20


def across_tiles(settled, places):
    """Distances [m] of rock from places (n, 3) in H, one a tile, moved across it, (n, y)."""
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    ways = np.array([frames[i].across for i in settled.finger_of])
    joints = np.array([frames[i].joint for i in settled.finger_of])
    middles = places - ((places - joints) * ways).sum(axis=1)[:, None] * ways
    y = settled.hand.finger.tile_width * np.linspace(-0.5, 0.5, 201)
    points = middles[:, None] + y[:, None] * ways[:, None]
    return in_hand(settled.hold, settled.seating.pose, points)


def most_engaged(settled):
    """The largest shares of the phalanges' tiles that distances allow, (12,): in space, not across.

    A strip's spines reach the rock of the strip, which is no nearer than any.
    """
    shape, strips = PhalanxShape.of(settled.hand.finger), settled.hand.finger.size.strips
    along = np.linspace(shape.near, shape.far, 97) + 1j * shape.lift
    found = []
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    for frame, finger in zip(frames, settled.fingers, strict=True):
        for contact in finger.contacts:
            places = complex(*contact.joint) + along * np.exp(1j * contact.angle)
            points = frame.joint + np.multiply.outer(places.real, frame.along)
            points[:, 2] += places.imag
            points = points[:, None] + strips[:, None] * frame.across
            away = in_hand(settled.hold, settled.seating.pose, points).min(axis=0) - shape.radius
            found.append(np.clip(1.0 - away / shape.travel, 0.0, 1.0).mean())
    return np.array(found)


def assert_on_rock(seed):
    settled = settled_at(seed)
    if settled is None:
        return
    on = settled.touching
    bases = np.array([tile.phalanx == "base" for tile in settled.tiles])
    clearance = in_hand(settled.hold, settled.seating.pose, settled.positions)
    assert (clearance[on] > -5e-5).all()
    # spines reach across gaps. Base tiles meet the rock at one point; others are where their bed
    # presses, with one of their sides, and the middle of their spines on rock may be farther off
    assert (clearance[on & bases] < HAND.spine_travel + 1e-9).all()
    clearances = across_tiles(settled, settled.positions)[on & ~bases]
    assert (clearances > -5e-5).all()
    assert (clearances.min(axis=1) < HAND.spine_travel + 1e-9).all()
    assert (settled.engagement[~bases] <= most_engaged(settled) + 1e-4).all()
    # all of them where the tile touches
    whole = on & (settled.engagement == 1.0)
    assert (clearance[whole] < 1e-3).all()
    for tile, place in zip(settled.tiles, settled.positions, strict=True):
        if tile.phalanx == "base" and tile.contact != "none":
            assert abs(place[2]) <= 0.005 + 1e-12
    z = np.column_stack([HAND.palm_tiles[:, :2], settled.palm.gaps])[list(settled.palm.engaged)]
    np.testing.assert_allclose(in_hand(settled.hold, settled.seating.pose, z), 0.0, atol=1e-9)


@given_some(5, 100, seeds)
def test_tiles_said_to_touch_are_on_the_rock(seed):
    assert_on_rock(seed)


def test_a_tile_with_spines_on_the_rock_at_one_side_only_is_on_it_there():
    """Its outermost strip is 4.93 mm off, its middle 5.5 mm: beyond the spines' travel."""
    assert_on_rock(459)
    settled = settled_at(459)
    (tile,) = (
        i
        for i, each in enumerate(settled.tiles)
        if (each.finger, each.phalanx) == ("outer_right", "middle")
    )
    clearances = across_tiles(settled, settled.positions)[tile]
    assert clearances[100] > HAND.spine_travel > clearances.min()
    assert 0.0 < settled.engagement[tile] < 1.0 / len(HAND.finger.size.strips)
    assert clearances[-1] == clearances.min()


def test_rock_stands_no_deeper_in_the_palm_than_spines_retract():
    for depth, possible in [(0.0049, True), (0.0051, False)]:
        log = Cylinder(0.3)  # its crest under a column of palm tiles, clear of the fingers
        pose = Pose(np.array([HAND.palm_tiles[4, 0], 0.0, -depth]), np.eye(3))
        if possible:
            assert HAND.settle(log, ROCK, None, pose).palm.gaps.min() == pytest.approx(-depth)
        else:
            with pytest.raises(CruxError, match=r"5\.1 mm inside the palm"):
                HAND.settle(log, ROCK, None, pose)


def test_a_hand_whose_fingers_stand_in_the_rock_is_refused():
    with pytest.raises(CruxError, match=r"4\.\d mm inside outer_left") as caught:
        HAND.settle(Plane(), ROCK, None, Pose(np.array([0.0, 0.0, -0.0049]), np.eye(3)))
    assert caught.value.field == "hold"


def test_impossible_grasps_are_refused_by_field():
    for values, field in [
        ({"outer_rotation": -0.1}, "outer_rotation"),
        ({"outer_rotation": 3.2}, "outer_rotation"),
        ({"outer_rotation": math.nan}, "outer_rotation"),
        ({"closing_tension": 0.0}, "closing_tension"),
        ({"closing_tension": -1.0}, "closing_tension"),
        ({"closing_tension": math.inf}, "closing_tension"),
        ({"closing_tension": math.nan}, "closing_tension"),
    ]:
        with pytest.raises(InvalidInputError) as caught:
            Grasp(**values)
        assert caught.value.field == field


def test_half_a_turn_that_is_rounded_up_is_half_a_turn():
    for rounded in [3.142, 3.1416, 3.141593, 3.1415927, 3.14159266, math.pi, math.pi + 4e-4]:
        grasp = Grasp(rounded)
        assert grasp.pinch
        assert grasp.outer_rotation == pytest.approx(math.pi, abs=1e-6)
        there, exact = (HAND.settle(Cylinder(0.3), ROCK, each) for each in (grasp, Grasp(math.pi)))
        np.testing.assert_allclose(there.positions, exact.positions, atol=1e-7)


def test_what_is_rounded_down_stays_as_it_is():
    for angle in [3.1, 3.14, 3.141, 3.1415, 3.14159]:
        assert Grasp(angle).outer_rotation == angle


def test_beyond_that_it_is_refused():
    for angle in [3.143, 3.15, 3.16, 22.0 / 7.0, 180.0, math.pi + 6e-4]:
        with pytest.raises(InvalidInputError, match="must be in"):
            Grasp(angle)


def test_a_base_tile_fades_with_its_distance_from_the_rock():
    """From rock that stands through its plane, within the spines' travel too, to beyond it."""
    found, offs = [], np.linspace(-2e-4, 6e-3, 32)
    for settled in off_a_wall(offs):
        assert settled.tiles[0].contact == ("face" if settled.engagement[0] > 0.0 else "none")
        others = settled.engagement[1:4].sum()
        found.append(
            (settled.engagement[0], *settled.loads[0, 0], settled.lateral_shares[0], others)
        )
    share, at_zero, gain, lateral, others = np.array(found).T
    np.testing.assert_allclose(share, np.clip(1.0 - np.abs(offs) / 5e-3, 0.0, 1.0), atol=1e-9)
    # of a whole tile 0.1317 of 37 N, and c_p k_c / (k_c + K_p) per newton
    each = 2.0 * 4.25 / (4.25 + 11.5)
    np.testing.assert_allclose(gain, share * each, rtol=1e-12)
    np.testing.assert_allclose(at_zero, share * 37.0 * (0.1317 - each), rtol=1e-9)
    np.testing.assert_allclose(lateral, share / (share + others), rtol=1e-12)


def test_lateral_reactions_are_shared_as_spines_are():
    settled = HAND.settle(Cylinder(0.3), ROCK, Grasp(outer_rotation=0.0))
    for i, name in enumerate(FINGERS):
        own = settled.finger_of == i
        share = settled.engagement[own]
        assert (share[-3:] == 1.0).all()
        assert not name.startswith("outer") or 0.1 < share[0] < 0.9
        np.testing.assert_allclose(settled.lateral_shares[own], share / share.sum(), rtol=1e-12)
