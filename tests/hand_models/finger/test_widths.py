"""Fingers with a width: what they meet across it, checked against the raw triangles of rock."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import strategies as st

from hand_models import Cylinder, Grasp, Pose, SettledHand
from hand_models.finger.phalanx_shape import PhalanxShape
from hand_models.hand import FINGERS
from hand_models.rock import Mesh, Profile
from tests.suite.helpers.hands import HAND, ROCK, line_hand
from tests.suite.helpers.rocks import fractal_wall, height_map, random_profile
from tests.suite.helpers.shares import given_some

seeds = st.integers(0, 2**32 - 1)
TILE, FRAME = 0.0215, 0.029


def points_of(rock: Mesh) -> np.ndarray:
    """Points of all triangles: corners, and 12 between them."""
    corners = rock.triangles.vertices[rock.triangles.faces]
    parts = [(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]
    return np.concatenate([np.einsum("c,ncx->nx", np.array(p) / 4.0, corners) for p in parts])


def depths(hand: SettledHand, rock: Mesh) -> np.ndarray:
    """How deep raw rock is in each phalanx, anywhere across it, (4, 3) [m]; negative off it."""
    points, shape = hand.seating.pose.apply(points_of(rock)), PhalanxShape.of(hand.hand.finger)
    found = np.zeros((4, 3))
    frames = hand.hand.frames(hand.grasp.outer_rotation)
    for i, (frame, finger) in enumerate(zip(frames, hand.fingers, strict=True)):
        x, y, z = ((points - frame.joint) @ np.array([frame.along, frame.across, [0, 0, 1.0]]).T).T
        near = np.abs(y) <= 0.5 * FRAME
        x, y, z = x[near], y[near], z[near]
        lift = np.where(np.abs(y) <= 0.5 * TILE, shape.lift, 0.0)
        for j, contact in enumerate(finger.contacts):
            u = np.exp(1j * contact.angle)
            seen = (x + 1j * z - complex(*contact.joint)) * np.conj(u)
            tile = seen - (np.clip(seen.real, shape.near, shape.far) + 1j * lift)
            slope = (shape.end - shape.far) - 1j * lift
            part = ((seen - shape.far - 1j * lift) * slope.conj()).real / np.abs(slope) ** 2
            end = seen - (shape.far + 1j * lift + np.clip(part, 0.0, 1.0) * slope)
            found[i, j] = shape.radius - np.minimum(np.abs(tile), np.abs(end)).min()
    return found


def rough(seed: int) -> Mesh:
    height, hurst = 0.004 + 0.002 * (seed % 4), 0.5 + 0.1 * (seed % 5)
    return Mesh(*fractal_wall(seed, size=0.45, count=151, height=height, hurst=hurst))


def assert_clear(seed: int) -> None:
    rock = rough(seed)
    hand = HAND.settle(rock, ROCK, Grasp(math.pi if seed % 2 else 2.0))
    # between the places along a finger at which heights are taken a ridge may stand out a little
    assert depths(hand, rock).max() < 2e-4


@pytest.mark.parametrize("seed", range(1))
def test_no_rock_is_in_a_frame_anywhere_across_it(seed: int) -> None:
    assert_clear(seed)


@pytest.mark.slow
def test_no_rock_is_in_any_frame_of_sixty_hands() -> None:
    for seed in range(1, 61):
        assert_clear(seed)


def test_strips_fill_the_width_evenly() -> None:
    middles = HAND.finger.size.strips
    assert len(middles) % 2 == 1
    np.testing.assert_allclose(middles, -middles[::-1], atol=1e-15)
    np.testing.assert_allclose(np.diff(middles), TILE / len(middles))
    assert middles[-1] + TILE / len(middles) / 2.0 == pytest.approx(TILE / 2.0)


@given_some(4, 40, seeds)
def test_on_rock_that_is_alike_across_a_finger_nothing_changes(seed: int) -> None:
    outlines = random_profile(np.random.default_rng(seed)).outlines
    grasp, pose = Grasp(math.pi), Pose(np.array([0.01, 0.0, 0.012]), np.eye(3))
    names = ("outer_left", "inner_left", "inner_right", "outer_right")
    drawn = outlines[0] if len(outlines) == 1 else dict(zip(names, outlines, strict=True))
    one, other = (
        hand.settle_each([_placed(Profile(drawn), grasp, pose)])[0] for hand in (HAND, line_hand())
    )
    if not isinstance(one, SettledHand):
        assert str(one) == str(other)
        return
    np.testing.assert_allclose(one.loads, other.loads, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-9)


def _placed(hold, grasp, pose):
    from hand_models.hand import Placement

    return Placement(hold, ROCK, grasp, pose)


def shelf(edge: float) -> Mesh:
    """Level rock for y above an edge, and 30 mm deeper below it."""
    y = 1e-3 * np.arange(-100, 101)
    heights = np.tile(np.where(y > edge, 0.0, 0.03), (201, 1))
    return Mesh(*height_map(heights, 1e-3))


@pytest.mark.parametrize("off", [-4e-3, 0.0, 5e-3])
def test_a_tile_that_bears_on_one_side_says_how_much_and_where(off: float) -> None:
    inner = FINGERS.index("inner_left")
    middle = HAND.frames(0.0)[inner].joint[1]
    pose = Pose(np.array([0.0, 0.0, 0.0041]), np.eye(3))
    hand = HAND.settle(shelf(middle + off), ROCK, Grasp(0.0), pose)
    contact = hand.fingers[inner].contacts[0]
    assert contact.kind == "face"
    # the step is a millimetre wide, a strip more
    assert contact.engagement == pytest.approx((TILE / 2.0 - off) / TILE, abs=0.1)
    assert contact.across == pytest.approx((TILE / 2.0 + off) / 2.0, abs=1.2e-3)
    (tile,) = [i for i in np.flatnonzero(hand.finger_of == inner) if hand.engagement[i] > 0.0]
    assert hand.positions[tile, 1] - middle == pytest.approx(contact.across, abs=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_mirrored_rock_is_met_mirrored(seed: int) -> None:
    vertices, faces = fractal_wall(seed, size=0.45, count=91)
    grasp = Grasp(math.pi)
    one = HAND.settle(Mesh(vertices, faces), ROCK, grasp)
    other = HAND.settle(Mesh(vertices * [1.0, -1.0, 1.0], faces[:, ::-1]), ROCK, grasp)
    np.testing.assert_allclose(other.postures.across, -one.postures.across[::-1], atol=2e-5)
    np.testing.assert_allclose(other.postures.engagement, one.postures.engagement[::-1], atol=2e-3)


def test_on_a_meshed_log_across_the_fingers_they_are_as_on_the_log() -> None:
    x = np.linspace(-0.14, 0.14, 561)
    heights = np.tile((0.15 - np.sqrt(0.15**2 - x**2))[:, None], (1, 561))
    hand = HAND.settle(Mesh(*height_map(heights, 5e-4)), ROCK, Grasp(math.pi))
    want = HAND.settle(Cylinder(0.3), ROCK, Grasp(math.pi))
    np.testing.assert_allclose(hand.postures.engagement, want.postures.engagement, atol=1e-3)
    np.testing.assert_allclose(hand.postures.across, 0.0, atol=1e-15)
