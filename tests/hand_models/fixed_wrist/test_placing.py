"""Hands at points of a rock are where a hand is that is seated on that rock brought there."""

import math

import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hand_models import (
    Cylinder,
    Grasp,
    InvalidInputError,
    Mesh,
    Plane,
    Profile,
    Sphere,
    place,
)
from hand_models.fixed_wrist import approach_frame
from hand_models.hand import Placement
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import fractal_wall, random_mesh, random_profile
from tests.suite.helpers.shares import given_some, some_and_all

seeds = st.integers(0, 2**32 - 1)


def test_a_frame_has_z_along_the_approach_and_x_up():
    frame = approach_frame([1, 2, 3], [0, 5, 0], up=[0, 1, 1])
    np.testing.assert_allclose(frame.position, [1, 2, 3])
    np.testing.assert_allclose(frame.rotation.T, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)
    turned = approach_frame([1, 2, 3], [0, 5, 0], math.pi / 2, up=[0, 1, 1])
    np.testing.assert_allclose(turned.rotation.T, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"point": [0, math.nan, 0]}, "point"),
        ({"point": [0, 0]}, "point"),
        ({"approach": [0, 0, 0]}, "approach"),
        ({"approach": [2, 0, 0]}, "approach"),
        ({"wrist_angle": math.inf}, "wrist_angle"),
        ({"up": [0, 0, 0]}, "up"),
    ],
)
def test_what_makes_no_frame_is_refused_by_name(given, field):
    with pytest.raises(InvalidInputError) as caught:
        place(Plane(), **{"point": [0, 0, 0], "approach": [0, 0, 1], **given})
    assert caught.value.field == field


@pytest.mark.parametrize("rotation", [0.0, math.pi])
@pytest.mark.parametrize("hold", [Plane(), Cylinder(0.3), Sphere(0.4)])
def test_at_the_crest_a_hand_is_as_it_is_seated_there(hold, rotation):
    seated = HAND.settle(hold, ROCK, Grasp(rotation))
    placed = place(hold, [0, 0, 0], [0, 0, 1], 0.0, Grasp(rotation))
    assert placed.seating.rule == seated.seating.rule
    moved = placed.seating.pose.position - seated.seating.pose.position
    assert np.abs(moved).max() < 1e-6
    np.testing.assert_allclose(placed.loads, seated.loads, atol=2e-3)


def test_around_a_cylinder_a_hand_is_the_same_wherever_it_comes_from():
    radius, angle = 0.15, 0.7
    seated = place(Cylinder(2 * radius), [0, 0, 0], [0, 0, 1])
    # about the axis of the cylinder, which is y, and along it
    turn = Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix()
    point = turn @ [0.0, 0.0, -radius] + [0.0, 0.05, radius]
    placed = place(Cylinder(2 * radius), point, turn @ [0.0, 0.0, 1.0], up=turn @ [1.0, 0.0, 0.0])
    np.testing.assert_allclose(placed.loads, seated.loads, atol=1e-3)
    in_rock, there = seated.seating.pose.inverse(), placed.seating.pose.inverse()
    np.testing.assert_allclose(there.rotation, turn @ in_rock.rotation, atol=1e-12)
    moved = turn @ (in_rock.position - [0, 0, radius]) + [0.0, 0.05, radius]
    np.testing.assert_allclose(there.position, moved, atol=1e-6)


@given_some(5, 25, seeds)
def test_a_rock_in_another_frame_is_the_same_rock(seed):
    rng = np.random.default_rng(seed)
    rock, turn = random_mesh(rng), rng.uniform(-0.5, 0.5)
    point, approach = rng.uniform(-0.005, 0.005, 3), [*rng.uniform(-0.1, 0.1, 2), 1.0]
    at = approach_frame(point, approach, turn)
    moved = Mesh(at.inverse().apply(rock.triangles.vertices), rock.triangles.faces)
    seated, placed = HAND.settle_each(
        [Placement(moved, ROCK, Grasp(), None), Placement(rock, ROCK, Grasp(), None, at)]
    )
    if isinstance(seated, InvalidInputError):
        assert str(placed) == str(seated)
        return
    assert placed.seating.rule == seated.seating.rule
    np.testing.assert_allclose(placed.loads, seated.loads, atol=1e-6)
    whole = placed.seating.pose @ at
    np.testing.assert_allclose(whole.position, seated.seating.pose.position, atol=1e-9)
    assert placed.seating.backed_off == pytest.approx(seated.seating.backed_off, abs=1e-9)


@pytest.mark.slow
def test_the_best_seat_at_a_point_is_near_it_and_holds_no_less():
    rock = random_profile(np.random.default_rng(1))
    at = [0.002, 0.01, 0.0], [0.05, 0.0, 1.0], 0.2
    rest, best = place(rock, *at), place(rock, *at, seat="best")
    assert best.seating.rule == "best"
    moved = rest.seating.pose @ best.seating.pose.inverse()
    assert np.linalg.norm(moved.position) <= HAND.back_off + 1e-9


def test_where_rock_stands_in_the_fingers_a_placed_hand_backs_off():
    x = np.linspace(-0.4, 0.4, 801)
    bump = Profile(np.column_stack([x, -0.02 * np.exp(-(((x - 0.1) / 0.02) ** 2))]))
    placed = place(bump, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    assert placed.seating.backed_off > 0.0


@pytest.mark.parametrize("depth", [-0.03, 0.02])
def test_along_the_approach_the_point_may_be_anywhere_near(depth):
    rock = random_profile(np.random.default_rng(2))
    toward = np.array([0.1, 0.0, 1.0])
    on, off = (place(rock, k * depth * toward, toward, 0.1) for k in (0.0, 1.0))
    np.testing.assert_allclose(on.seating.pose.position, off.seating.pose.position, atol=1e-6)
    np.testing.assert_allclose(on.loads, off.loads, atol=1e-3)


def cropped(vertices, faces, middle, half):
    """Triangles of which every vertex is within a square about a point, across z."""
    inside = (np.abs(vertices[:, :2] - middle[:2]) <= half).all(axis=1)
    return vertices, faces[inside[faces].all(axis=1)]


@pytest.mark.slow
@some_and_all("seeds", range(12), 6)
def test_rock_told_finer_or_with_less_around_it_is_the_same_rock(seeds):
    vertices, faces = fractal_wall(5, size=1.6, count=201, height=0.01)
    wall = Mesh(vertices, faces, anywhere=True)
    finer = Mesh(*trimesh.remesh.subdivide(vertices, faces), anywhere=True)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        x, y = rng.uniform(-0.1, 0.1, 2)
        point = [x, y, wall.entry([x, y, -1.0], [0.0, 0.0, 1.0]) - 1.0]
        at = approach_frame(point, [*rng.uniform(-0.1, 0.1, 2), 1.0], rng.uniform(0.0, math.tau))
        rocks = [wall, finer]
        rocks += [
            Mesh(*cropped(vertices, faces, point, half), anywhere=True) for half in (0.35, 0.5)
        ]
        grasp = Grasp(math.pi * (seed % 2))
        whole, fine, *less = HAND.settle_each(
            [Placement(rock, ROCK, grasp, None, at) for rock in rocks]
        )
        if isinstance(whole, InvalidInputError):
            assert {str(whole)} == {str(each) for each in (fine, *less)}
            continue
        np.testing.assert_allclose(fine.loads, whole.loads, atol=1e-6)
        for each in less:
            np.testing.assert_array_equal(each.loads, whole.loads)
