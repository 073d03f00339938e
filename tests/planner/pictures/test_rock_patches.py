"""The rock around hands in pictures: where it is, how much of it, how fine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from hand_models import Cylinder, Edge, Ellipsoid, Grasp, Plane, Sphere
from hand_models.base import Pose
from hand_models.rock import Mesh, Profile
from hand_models.rock.profile import STRIP_NAMES
from planner.pictures.plan_scene import drawn_scene
from planner.pictures.rock_patches import rock_patch
from planner.pictures.settings import PICTURE_SETTINGS
from planner.question import Question
from planner.solving import solve
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.rocks import cylinder_mesh
from tests.suite.helpers.stances import on_wall

OUTLINES = dict(zip(STRIP_NAMES, (0.0, 0.002, 0.001, 0.003), strict=True))
HOLDS = {
    "plane": Plane(),
    "log": Cylinder(0.3),
    "large log": Cylinder(40.0),
    "ball": Sphere(0.22),
    "boulder": Ellipsoid((0.3, 0.2, 0.12)),
    "edge": Edge(0.05, 1.5),
    "rounded edge": Edge(3.0, 2.0),
    "profile": Profile([[-0.3, 0.1], [0.0, 0.0], [0.3, 0.1]]),
    "strips": Profile(
        {name: [[-0.3, 0.02 + d], [0.0, d], [0.3, 0.02 + d]] for name, d in OUTLINES.items()}
    ),
    "mesh": Mesh(*cylinder_mesh(0.2, 64)),
}


@pytest.mark.parametrize("name", HOLDS)
def test_rock_is_drawn_where_it_is(name):
    settled = HAND.settle(HOLDS[name], ROCK, Grasp(math.pi if name == "log" else 0.5))
    patch = rock_patch(settled)
    assert 0 < len(patch) < 2 * PICTURE_SETTINGS.rock_triangles
    assert np.abs(patch).max() <= PICTURE_SETTINGS.rock_around + 1e-9
    # in the hold's frame, every triangle has rock on one side, and begins there
    corners = settled.seating.pose.inverse().apply(patch.reshape(-1, 3)).reshape(-1, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2.0
    large = np.flatnonzero(areas > 1e-6)
    for i in large[:: max(1, len(large) // 60)]:
        n, centre = normals[i] / (2.0 * areas[i]), corners[i].mean(axis=0)
        begins = [settled.hold.entry(centre - 0.02 * s * n, s * n) - 0.02 for s in (1.0, -1.0)]
        assert min(map(abs, begins)) < 2e-3
    # nothing of the rock under the hand is missing
    flat = np.diff(patch, axis=1) * [1.0, 1.0, 0.0]
    seen = np.linalg.norm(np.cross(flat[:, 0], flat[:, 1]), axis=1).sum() / 2.0
    assert seen > 0.02


def test_a_fine_mesh_is_drawn_coarsely():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.15)
    assert len(ball.faces) > PICTURE_SETTINGS.rock_triangles
    hold = Mesh(ball.vertices + np.array([0.0, 0.0, 0.15]), ball.faces)
    settled = HAND.settle(hold, ROCK, Grasp())
    patch = rock_patch(settled)
    assert 100 < len(patch) < 2 * PICTURE_SETTINGS.rock_triangles
    centre = settled.seating.pose.apply((0.0, 0.0, 0.15))
    away = np.linalg.norm(patch.reshape(-1, 3) - centre, axis=1)
    # corners of a grid about points of the ball, and chords between them
    assert away.max() <= 0.15 + PICTURE_SETTINGS.rock_coarseness * math.sqrt(0.75)
    assert away.min() >= 0.15 - 2.0 * PICTURE_SETTINGS.rock_coarseness


def test_so_much_rock_is_drawn_that_one_sees_what_it_is():
    # a log all around and longer than it is thick, a whole boulder, a wall beyond the hand
    log = HAND.settle(Cylinder(0.3), ROCK, Grasp(math.pi))
    width = np.ptp(rock_patch(log).reshape(-1, 3), axis=0)
    np.testing.assert_allclose(width, [0.3, 2.0 * PICTURE_SETTINGS.rock_around, 0.3], rtol=0.01)
    assert width[1] > 2.0 * width[0]
    boulder = HAND.settle(Ellipsoid((0.3, 0.2, 0.12)), ROCK, Grasp(0.5))
    width = np.ptp(rock_patch(boulder).reshape(-1, 3), axis=0)
    np.testing.assert_allclose(width, [0.6, 0.4, 0.24], rtol=0.02)
    wall_patch = rock_patch(HAND.settle(Plane(), ROCK, Grasp()))
    assert np.ptp(wall_patch.reshape(-1, 3), axis=0)[:2].min() > 4.0 * HAND.palm_length


def test_a_flat_wall_is_drawn_to_the_edge_of_the_box():
    patch = rock_patch(HAND.settle(Plane(), ROCK, Grasp()))
    area = np.linalg.norm(np.cross(patch[:, 1] - patch[:, 0], patch[:, 2] - patch[:, 0]), axis=1)
    assert area.sum() / 2.0 == pytest.approx((2.0 * PICTURE_SETTINGS.rock_around) ** 2, rel=1e-9)


def test_a_scan_that_hands_share_is_drawn_once_and_whole():
    corners = np.array([(x, y, 0.0) for x in (-1.5, 1.5) for y in (-1.0, 1.0)])
    scan = Mesh(corners, np.array([(0, 1, 2), (1, 3, 2)]), anywhere=True)
    stance = on_wall(Plane(), outer_rotation=0.0)
    places = np.array([hand.pose.position for hand in stance.hands])
    there = Pose(places.mean(axis=0), stance.hands[0].pose.rotation)
    hands = tuple(replace(hand, hold=scan, hold_pose=there) for hand in stance.hands)
    shared = Question(replace(stance, hands=hands))
    (first,) = _rocks(shared)
    (low, high), reach = np.sort([first.min(axis=(0, 1)), first.max(axis=(0, 1))], axis=0), 0.4
    flat = np.ptp(places, axis=0) > 0.1
    assert (low <= places.min(axis=0) - reach)[flat].all()
    assert (high >= places.max(axis=0) + reach)[flat].all()
    sides = np.diff(first, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2.0
    assert area == pytest.approx(np.prod((high - low)[flat]), rel=1e-6)
    # of a copy each hand has its own
    apart = [replace(hands[0], hold=Mesh(corners, scan.triangles.faces, anywhere=True)), *hands[1:]]
    apart = Question(replace(stance, hands=tuple(apart)))
    rocks = [len(rock) for rock in _rocks(apart)]
    assert [count > 0 for count in rocks] == [True, True]


def _rocks(question):
    """Triangles of each hand's rock."""
    scene = drawn_scene(solve.plan(question), question)
    return [surface.triangles for surface in scene.surfaces if surface.kind == "rock"]


def test_rock_that_is_far_away_is_not_drawn():
    away = Pose(np.array([0.0, 0.0, 0.6]), np.eye(3))
    settled = HAND.settle(Sphere(0.2), ROCK, Grasp(), away)
    assert rock_patch(settled).shape == (0, 3, 3)
