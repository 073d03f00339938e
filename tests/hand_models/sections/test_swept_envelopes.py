"""What a finger with a width meets on smooth shapes, against distances, hand work and meshes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hand_models import Cylinder, Edge, Ellipsoid, Grasp, Hold, Plane, Pose, SettledHand, Sphere
from hand_models.fixed_wrist import wrench_space
from hand_models.hand import FINGERS
from hand_models.rock import Mesh, Profile
from tests.suite.helpers.hands import HAND, PINCH, ROCK
from tests.suite.helpers.rocks import (
    cylinder_mesh,
    distance,
    height_map,
    random_axes,
    random_ellipsoid,
    random_hold,
)
from tests.suite.helpers.shares import given_some, some_and_all

SIZE = HAND.finger.size
WAYS = np.concatenate([np.eye(6), -np.eye(6)])
seeds = st.integers(0, 2**32 - 1)


def clearances(hold: Hold, plane: np.ndarray, places: np.ndarray, width: float) -> np.ndarray:
    """Least distance of the hold anywhere across places (s, t) in a plane, (n,) [m]."""
    origin, s, t = plane
    y = width * np.linspace(-0.5, 0.5, 201)
    points = origin + places @ plane[1:]
    whole = points[:, None] + y[:, None] * np.cross(t, s)
    return distance(hold, whole.reshape(-1, 3)).reshape(len(places), -1).min(axis=1)


@given_some(8, 150, seeds)
def test_an_envelope_parts_rock_from_where_none_is_across_the_finger(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hold = random_ellipsoid(rng) if rng.random() < 0.4 else random_hold(rng)
    axes = random_axes(rng, 0.3) @ Rotation.from_euler("z", rng.uniform(-3.0, 3.0)).as_matrix()
    plane = np.array([rng.uniform(-0.04, 0.01, 3), axes[:, 0], axes[:, 2]])
    rock = hold.finger_rock(*plane, SIZE)
    for section, width in ((rock.tile, SIZE.tile_width), (rock.frame, SIZE.frame_width)):
        if section is None:
            continue
        (points,) = (np.column_stack([v.real, v.imag]) for v in section.outline(0.2, 1e-3))
        near = np.flatnonzero(np.hypot(*points.T) < SIZE.reach)[1:-1:7]
        along = points[near + 1] - points[near - 1]
        out = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
        step = 2e-5  # between lines across the finger a ball stands out by less
        assert (clearances(hold, plane, points[near] - step * out, width) < 0.0).all()
        assert (clearances(hold, plane, points[near] + step * out, width) > 0.0).all()


def test_beside_the_crest_of_a_ball_a_tile_bears_on_one_side() -> None:
    radius, off = 0.15, 0.0165
    rock = Sphere(0.3).finger_rock([-0.03, off, -0.004], [1, 0, 0], [0, 0, 1], SIZE)
    # the nearest disc is that of the tile's inner side, and each strip has its own
    y = off - SIZE.strips
    discs = np.sqrt(radius**2 - y**2)
    nearest = math.sqrt(radius**2 - (off - 0.5 * SIZE.tile_width) ** 2)
    centre = 0.03 + 1j * (radius + 0.004)
    np.testing.assert_allclose(np.abs(rock.strips.places - centre), nearest, atol=1e-9)
    want = np.broadcast_to(nearest - discs[::-1], rock.strips.behind.shape)
    np.testing.assert_allclose(rock.strips.behind, want, atol=1e-9)


def test_rock_alike_across_a_finger_is_met_in_its_plane() -> None:
    for hold in (Plane(), Cylinder(0.3), Edge(0.03, 2.0)):
        for turn in (0.0, 1e-9, math.pi):
            along = np.array([math.cos(turn), math.sin(turn), 0.0])
            rock = hold.finger_rock([-0.03, 0.01, -0.004], along, [0, 0, 1], SIZE)
            assert rock.frame is None
            assert len(rock.strips.across) == 1


@pytest.mark.parametrize("hold", [Cylinder(0.3), Cylinder(626.0), Edge(0.1, 1.5)], ids=str)
def test_an_outline_along_an_axis_ends_within_a_thousand_reaches(hold) -> None:
    for turn in (90.0, 90.0 + 1e-12, -90.0):
        s = turned(turn)[:, 0]
        rock = hold.finger_rock([0.01, -0.03, -0.004], s, [0, 0, 1], SIZE)
        for section in (rock.tile, rock.frame):
            (points,) = section.outline(0.2, 1e-3)
            assert np.abs(points).max() <= 1.01e3 * SIZE.reach
            # straight under the finger, by the slab's distance from the crest
            near = np.abs(points.real) < SIZE.reach
            assert (np.abs(points[near].imag - 0.004) < 2e-3).sum() >= 2


@pytest.mark.parametrize("diameter", [626.1423534612566, 700.0, 5e4])
def test_along_a_log_of_hundreds_of_metres_a_hand_holds_as_on_a_plane(diameter) -> None:
    """The log falls by 8 μm below a hand."""
    pose = Pose(np.array([-0.02547901, 0.00589423, 0.00414809]), turned(90.0))
    log, plane = (
        reaches(HAND.settle(on, ROCK, PINCH, pose)) for on in (Cylinder(diameter), Plane())
    )
    np.testing.assert_allclose(log, plane, rtol=0.02, atol=0.01 * np.abs(plane).max())


def mesh_of(hold: Hold) -> Mesh:
    """The hold, within a hand's reach, as triangles of some millimetres."""
    if isinstance(hold, Sphere | Ellipsoid):
        axes = np.array(hold.semi_axes if isinstance(hold, Ellipsoid) else [hold.diameter / 2] * 3)
        ball = trimesh.creation.icosphere(subdivisions=6)
        return Mesh(ball.vertices * axes + [0.0, 0.0, axes[2]], ball.faces)
    if isinstance(hold, Cylinder):
        return Mesh(*cylinder_mesh(hold.diameter, 512, 0.8))
    x = 1e-3 * np.arange(-210, 211)
    places = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    begins = np.column_stack([places, np.full(len(places), -0.2)])
    heights = np.array(hold.entries(begins, [0.0, 0.0, 1.0])) - 0.2
    return Mesh(*height_map(heights.reshape(len(x), -1), 1e-3))


def turned(yaw: float, pitch: float = 0.0, roll: float = 0.0) -> np.ndarray:
    return Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()


MESHED = [
    (Sphere(0.3), math.pi, turned(0.0), [0.0, 0.0, 0.004]),
    (Cylinder(0.3), 0.0, turned(30.0), [0.0, 0.0, 0.004]),
    (Edge(0.1, 1.57), 0.0, turned(20.0, 3.0, 3.0), [0.0, 0.01, 0.006]),
    (Plane(), 0.0, turned(20.0, 4.0, 3.0), [0.0, 0.0, 0.012]),
    (Sphere(0.3), 0.0, turned(0.0), [0.0, 0.01, 0.004]),
    (Sphere(1.0), 2.0, turned(0.0, 6.0), [0.0, 0.02, 0.004]),
    (Cylinder(0.3), math.pi, turned(15.0), [0.0, 0.0, 0.004]),
    (Cylinder(0.3), math.pi, turned(90.0), [0.0, 0.005, 0.004]),
    (Cylinder(0.7), 1.0, turned(10.0, 3.0, 3.0), [0.01, 0.005, 0.006]),
    (Ellipsoid((0.1, 0.2, 0.15)), 0.0, turned(25.0, 5.0), [0.0, 0.01, 0.008]),
    (Edge(0.03, 2.0), 0.0, turned(15.0), [0.0, 0.01, 0.004]),
]


@some_and_all("cases", MESHED, 4)
def test_a_fine_mesh_of_a_shape_is_held_as_the_shape(cases) -> None:
    """Apart by 0.03 mm: that a mesh is smoothed to a tile's length."""
    for hold, rotation, axes, place in cases:
        pose, grasp = Pose(np.array(place), axes), Grasp(rotation)
        one, other = (HAND.settle(each, ROCK, grasp, pose) for each in (hold, mesh_of(hold)))
        np.testing.assert_allclose(
            other.postures.engagement, one.postures.engagement, atol=1e-2, err_msg=str(hold)
        )
        np.testing.assert_allclose(other.postures.across, one.postures.across, atol=2e-4)
        reach, want = (
            np.array([space.support(way) for way in WAYS])
            for space in map(wrench_space, (other, one))
        )
        size = np.tile(np.repeat(np.abs(want.reshape(2, 2, 3)).max(axis=(0, 2)), 3), 2)
        np.testing.assert_allclose(reach / size, want / size, atol=0.03, err_msg=str(hold))


def test_the_envelope_of_a_fine_mesh_is_that_of_the_shape_where_it_falls_off_steeply() -> None:
    hold, rotation, axes, place = MESHED[9]
    there, mesh = Pose(np.array(place), axes).inverse(), mesh_of(hold)
    for frame in HAND.frames(rotation):
        want, found = (frame.rock(each, there) for each in (hold, mesh))
        for section, other in zip(want.sections, found.sections, strict=True):
            (points,) = (np.asarray(piece) @ [1.0, 1.0j] for piece in other.pieces)
            # as far down as a finger reaches, where it is steeper than 3 in 1
            near = points[(points.real > -0.02) & (np.abs(points) < SIZE.reach)]
            assert np.abs(np.diff(near.imag) / np.diff(near.real)).max() > 3.0
            np.testing.assert_allclose(section.clearances(near), 0.0, atol=1e-4)


def reaches(hand: SettledHand) -> np.ndarray:
    return np.array([wrench_space(hand).support(way) for way in WAYS])


@pytest.mark.parametrize("ways", [(1.0, 0.0), (0.0, 1.0)], ids=["turned", "tilted"])
@pytest.mark.parametrize("hold", [Cylinder(0.3), Edge(0.1, 1.57), Plane()], ids=str)
def test_what_a_hand_holds_does_not_jump_as_it_turns_off_the_axis(hold, ways) -> None:
    def held(turn: float) -> np.ndarray:
        yaw, roll = np.degrees(turn) * np.array(ways)
        pose = Pose(np.array([0.0, 0.0, 0.0045]), turned(yaw, 0.0, roll))
        return reaches(HAND.settle(hold, ROCK, PINCH, pose))

    at_rest = held(0.0)
    size = np.tile(np.repeat(np.abs(at_rest.reshape(2, 2, 3)).max(axis=(0, 2)), 3), 2)
    for turn in (1e-7, 2e-6, 1e-5, 1e-4):
        np.testing.assert_allclose(held(turn) / size, at_rest / size, atol=5e-3 + 20.0 * turn)


def test_what_a_hand_holds_does_not_jump_as_a_ball_moves_aside() -> None:
    def held(aside: float) -> np.ndarray:
        return reaches(
            HAND.settle(Sphere(0.3), ROCK, PINCH, Pose(np.array([0, aside, 0.005]), np.eye(3)))
        )

    for middle in (0.0, HAND.inner_joint[1], HAND.inner_joint[1] - 0.5 * SIZE.tile_width):
        want = held(middle)
        for aside in (-1e-5, -1e-6, 1e-6, 1e-5):
            got = held(middle + aside)
            np.testing.assert_allclose(got, want, rtol=2e-3, atol=2e-3 * np.abs(want).max())


def test_on_a_log_along_the_fingers_it_is_that_of_a_drawn_one() -> None:
    turn = np.linspace(-1.5, 1.5, 3000)
    drawn = Profile(np.column_stack([0.15 * np.sin(turn), 0.15 - 0.15 * np.cos(turn)]))
    pose = Pose(np.array([0.0, 0.01, 0.004]), turned(90.0))
    one, other = (HAND.settle(hold, ROCK, Grasp(), pose) for hold in (Cylinder(0.3), drawn))
    np.testing.assert_allclose(other.postures.engagement, one.postures.engagement, atol=1e-3)
    np.testing.assert_allclose(other.positions, one.positions, atol=1e-4)


def test_mirrored_fingers_have_mirrored_places() -> None:
    hand = HAND.settle(Sphere(0.3), ROCK, PINCH)
    across = hand.postures.across
    inner = FINGERS.index("inner_left")
    assert (across[inner] < -1e-3).all()  # toward the ball's middle
    np.testing.assert_allclose(across, -across[::-1], atol=1e-15)
