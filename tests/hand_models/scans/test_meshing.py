"""Scans as triangles: where they are, which way they face, and which holes they keep."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import trimesh

from hand_models import Grasp, InvalidInputError, Mesh, Pose
from hand_models.rock import read_mesh
from hand_models.scans import Scan, mesh_scan, plot_rock, read_scan, write_rock
from hand_models.scans.scan import areas_of
from tests.suite.helpers.hands import HAND, ROCK
from tests.suite.helpers.scans import relief, wall, write_cloud

TERRAIN = Path(mpl.get_data_path()) / "sample_data" / "jacksboro_fault_dem.npz"


def meshed(points, folder, reading=None, **options):
    path = write_cloud(folder / "cloud.xyz", points)
    return mesh_scan(read_scan(path, **(reading or {})), **options)


def test_the_frame_begins_on_the_rock_z_goes_into_it_and_x_is_up(tmp_path):
    rock = meshed(wall(), tmp_path, {"view": (0, 1, 0)})
    np.testing.assert_allclose(rock.pose.rotation, [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-12)
    x, y, z = rock.pose.apply(rock.vertices).T
    np.testing.assert_allclose(y, 1.0 - relief(x, z), atol=1e-12)
    assert np.abs(rock.vertices).max(axis=1).min() == 0.0
    np.testing.assert_allclose(rock.extent[:2], [0.24, 0.24], atol=1e-9)
    assert rock.spacing == pytest.approx(0.004)
    assert (len(rock.vertices), len(rock.faces)) == (61**2, 2 * 60**2)


def test_normals_are_those_of_the_rock_toward_the_scanner(tmp_path):
    rock = meshed(wall(0.002), tmp_path, {"view": (0, 1, 0)})
    x, _, z = rock.pose.apply(rock.vertices).T
    slope = np.column_stack([-0.2 * np.cos(20 * x), -np.ones_like(x), 0.2 * np.sin(25 * z)])
    want = slope / np.linalg.norm(slope, axis=1)[:, None] @ rock.pose.rotation
    inside = np.abs(rock.vertices[:, :2]).max(axis=1) < 0.11
    write_rock(rock, tmp_path / "rock.ply")
    normals = trimesh.load(tmp_path / "rock.ply", process=False).vertex_normals
    assert (normals * want).sum(axis=1)[inside].min() > 0.999
    assert normals[:, 2].max() < 0.0


@pytest.mark.parametrize("up", ["z", "y", "-x"])
def test_looked_straight_down_the_picture_is_a_map(up, tmp_path):
    points = wall()[:, [0, 2, 1]] - [0, 0, 5]
    turn = {"z": points, "y": points[:, [1, 2, 0]], "-x": points[:, [2, 1, 0]] * [-1, 1, 1]}
    rock = meshed(turn[up], tmp_path, {"up": up, "viewpoint": (0, 0, 0)})
    assert rock.pose.rotation[2, 2] < -0.99


def test_a_hole_of_5_mm_is_bridged_and_one_of_50_mm_stays_and_is_told(tmp_path):
    for width, count in ((0.005, 0), (0.05, 1)):
        rock = meshed(wall(0.001, 0.06, width), tmp_path, {"view": (0, 1, 0)})
        assert len(rock.holes) == count
        met = Mesh(rock.vertices, rock.faces).entry(_middle(rock), (0, 0, 1))
        assert np.isfinite(met) == (count == 0)
    (hole,) = rock.holes
    assert hole.width == pytest.approx(0.05, abs=0.002)
    np.testing.assert_allclose(hole.place[:2], _middle(rock)[:2], atol=0.005)


def _middle(rock):
    """A point before the middle of the wall, in the rock's frame."""
    return rock.pose.inverse().apply((0.0, 0.5, 0.0))


def test_the_widest_hole_that_is_bridged_is_an_option(tmp_path):
    points = wall(0.002, 0.06, 0.03)
    assert len(meshed(points, tmp_path, {"view": (0, 1, 0)}).holes) == 1
    assert not meshed(points, tmp_path, {"view": (0, 1, 0)}, hole=0.04).holes


def test_a_step_that_hides_rock_is_open(tmp_path):
    points = wall(0.004)
    points[:, 1] += np.where(np.abs(points[:, [0, 2]]).max(axis=1) < 0.04, 0.1, 0.0)
    rock = meshed(points, tmp_path, {"view": (0, 1, 0)})
    (ring,) = rock.steps
    assert ring.height == pytest.approx(0.1, abs=0.01)
    assert not rock.holes


def test_a_spacing_keeps_one_point_a_square(tmp_path):
    rock = meshed(wall(0.002), tmp_path, {"view": (0, 1, 0)}, spacing=0.01)
    assert len(rock.vertices) <= 25**2
    assert rock.spacing == pytest.approx(0.01, rel=0.2)
    x, y, z = rock.pose.apply(rock.vertices).T
    np.testing.assert_allclose(y, 1.0 - relief(x, z), atol=1e-12)


def cloud(side, count=400_000):
    """Points at random places of a square wall that is seen from −y, in 32 bits [m]."""
    x, z = np.random.default_rng(0).uniform(0.0, side, (2, count))
    return np.column_stack([x, 1.0 - relief(x, z), z]).astype(np.float32).astype(float)


def seen(points, **options):
    """Rock of a cloud, seen along y."""
    view = np.array([0.0, 1.0, 0.0])
    return mesh_scan(Scan(points, len(points), view, np.zeros(3), None), **options)


def squares(points, side):
    return np.unique(np.floor(points[:, [0, 2]] / side + 0.25), axis=0)


@pytest.mark.slow
def test_a_large_cloud_keeps_a_point_every_2_mm_and_a_small_one_100_000():
    large, small = seen(cloud(0.7)), seen(cloud(0.2))
    assert len(large.vertices) == len(squares(cloud(0.7), 0.002)) > 100_000
    assert 50_000 < len(small.vertices) <= 100_000
    assert small.spacing < 0.001


def test_a_grid_of_2_mm_loses_no_row():
    points = np.stack(np.meshgrid(*2 * [0.002 * np.arange(400)], [1.0]), axis=-1)
    assert len(seen(points.reshape(-1, 3)[:, [0, 2, 1]]).vertices) == 400**2


def test_between_the_points_rock_is_as_far_off_as_its_curvature_makes_it():
    """By half the largest second derivative, 5 / m, times the squared radius of the circles."""
    rock = seen(cloud(0.7))
    corners = rock.vertices[rock.faces][:, :, :2]
    sides = [np.linalg.norm(corners[:, k - 2] - corners[:, k], axis=1) for k in range(3)]
    edges = corners[:, 1:] - corners[:, :1]
    area = np.abs(np.linalg.det(edges)) / 2.0
    # around the rim a triangle's circle may reach beyond it
    rim = np.abs(corners.mean(axis=1) - rock.vertices[:, :2].mean(axis=0)).max(axis=1) > 0.34
    radius = (np.prod(sides, axis=0) / (4.0 * area))[~rim].max()
    assert radius < 0.006
    x, z = np.random.default_rng(1).uniform(0.02, 0.68, (2, 2000))
    before = rock.pose.inverse().apply(np.column_stack([x, np.zeros_like(x), z]))
    away = Mesh(rock.vertices, rock.faces).entries(before, (0, 0, 1))
    assert np.abs(away - (1.0 - relief(x, z))).max() <= 0.5 * 5.0 * radius**2


@pytest.mark.parametrize("turn", [0.3, 0.6435011])
def test_along_the_outline_of_a_turned_grid_hardly_a_triangle_is_turned_over(turn):
    rows = np.stack(np.meshgrid(np.arange(150), np.arange(150)), -1).reshape(-1, 2) * 0.004
    c, s = np.cos(turn), np.sin(turn)
    across = np.round(rows @ [[c, s], [-s, c]], 9)
    depth = 1.0 + 0.01 * np.sin(30.0 * across[:, 0])
    rock = seen(np.column_stack([across[:, 0], depth, across[:, 1]]))
    areas = areas_of(rock.vertices, rock.faces)[:, 2]
    assert -areas.sum() == pytest.approx(0.596**2, rel=1e-6)
    assert (areas >= 0.0).sum() <= 5


def test_the_order_of_points_does_not_matter():
    points = cloud(0.7)
    rock, other = seen(points), seen(np.random.default_rng(2).permutation(points))
    np.testing.assert_array_equal(rock.vertices, other.vertices)
    np.testing.assert_array_equal(rock.faces, other.faces)


def test_a_crop_of_a_cloud_has_the_same_triangles():
    points = cloud(0.5, 50_000)
    part = points[points[:, 0] < 0.25]

    def within(rock):
        triangles = rock.pose.apply(rock.vertices.reshape(-1, 3))[rock.faces]
        inner = triangles[triangles[:, :, 0].max(axis=1) < 0.22]
        assert len(inner) > 10_000
        return {tuple(sorted(map(tuple, each))) for each in np.round(inner, 9).tolist()}

    assert within(seen(points, spacing=0.003)) == within(seen(part, spacing=0.003))


def test_points_that_were_seen_twice_are_taken_once(tmp_path):
    points = wall(0.004)
    again = points + np.random.default_rng(1).uniform(-1e-4, 1e-4, points.shape)
    rock = meshed(np.vstack([points, again, points]), tmp_path, {"view": (0, 1, 0)}, spacing=0.002)
    once = meshed(points, tmp_path, {"view": (0, 1, 0)})
    assert len(rock.vertices) < 2 * len(once.vertices)


def test_an_origin_may_be_chosen_and_must_be_on_the_rock(tmp_path):
    reading = {"view": (0, 1, 0), "unit": "mm"}
    rock = meshed(1e3 * wall(), tmp_path, reading | {"origin": (50, 0, -30)})
    np.testing.assert_allclose(rock.pose.position[[0, 2]], [0.05, -0.03], atol=0.003)
    with pytest.raises(InvalidInputError, match=r"^origin: the nearest rock is 0\.\d+ m away"):
        meshed(1e3 * wall(), tmp_path, reading | {"origin": (900, 0, 0)})


def test_a_turned_noisy_cloud_far_from_its_origin_is_the_same_rock(tmp_path):
    chance = np.random.default_rng(0)
    points = wall(0.003)
    points[:, 1] += chance.normal(0.0, 2e-4, len(points))
    far = points + np.array([5e5, 5e6, 300.0])
    near, moved = (meshed(p, tmp_path, {"view": (0, 1, 0)}) for p in (points, far))
    assert len(near.faces) == pytest.approx(len(moved.faces), rel=0.01)
    np.testing.assert_allclose(moved.extent, near.extent, atol=1e-6)


@pytest.mark.parametrize(
    ("points", "words"),
    [
        (np.empty((0, 3)), "is empty"),
        (np.ones((1, 3)), "at least three points are needed"),
        (np.ones((9, 3)), r"all 9 points of .* are at \(1, 1, 1\)"),
        (np.linspace(0, 1, 9)[:, None] * [1, 2, 3], "on one line"),
        (wall(0.004) * [0, 1, 1], "on one line"),
    ],
)
def test_what_is_no_surface_is_refused(points, words, tmp_path):
    with pytest.raises(InvalidInputError, match=words) as error:
        meshed(points, tmp_path, {"view": (0, 1, 0)})
    assert error.value.field == "file"


@pytest.mark.parametrize("field", ["spacing", "hole"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_lengths_are_above_zero(field, value, tmp_path):
    with pytest.raises(InvalidInputError, match=f"^{field}: must be finite and above zero"):
        meshed(wall(0.02), tmp_path, {"view": (0, 1, 0)}, **{field: value})


def test_a_spacing_that_leaves_no_surface_is_refused_by_its_name(tmp_path):
    with pytest.raises(InvalidInputError, match=r"^spacing: must leave points .* got 5 m; give a"):
        meshed(wall(0.02), tmp_path, {"view": (0, 1, 0)}, spacing=5.0)


def test_points_too_far_apart_are_told(tmp_path):
    with pytest.raises(InvalidInputError, match=r"^hole: points are 40 mm apart, .* --hole 0\.06 "):
        meshed(wall(0.04), tmp_path, {"view": (0, 1, 0)})
    assert meshed(wall(0.04), tmp_path, {"view": (0, 1, 0)}, hole=0.06).extent[0] > 0.2


def test_progress_is_told(tmp_path):
    told = []
    meshed(wall(0.02), tmp_path, report=lambda done, total: told.append((done, total)), hole=0.1)
    assert told == [(0, 3), (1, 3), (2, 3), (3, 3)]


@pytest.mark.slow
def test_a_hand_settles_on_real_terrain_that_is_made_a_wall(tmp_path):
    scan = read_scan(TERRAIN, cell=90.0, up="y", width=1.0)
    rock = mesh_scan(scan, spacing=0.004)
    np.testing.assert_allclose(rock.pose.rotation, [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-12)
    assert rock.extent[1] == pytest.approx(1.0, abs=0.01)
    assert 0.02 < rock.extent[2] < 0.03
    assert not rock.holes
    write_rock(rock, tmp_path / "rock.ply")
    vertices, faces = read_mesh(tmp_path / "rock.ply")
    np.testing.assert_allclose(vertices, rock.vertices, atol=1e-7)
    np.testing.assert_array_equal(faces, rock.faces)
    settled = HAND.settle(Mesh(vertices, faces), ROCK, Grasp(0.0))
    assert len(settled.tiles) > 8
    # the palm hangs between fingers, or one tile of it engages
    assert 0.0 < settled.palm.gaps.min() < 0.007
    plot_rock(rock, tmp_path / "rock.png", "terrain")
    assert (tmp_path / "rock.png").stat().st_size > 50_000


def test_the_pose_puts_the_rock_where_the_scan_has_it(tmp_path):
    rock = meshed(wall(0.01), tmp_path, {"view": (0.2, 1, -0.1)})
    again = Pose.from_quaternion(rock.pose.position, rock.pose.quaternion())
    x, y, z = again.apply(rock.vertices).T
    np.testing.assert_allclose(y, 1.0 - relief(x, z), atol=1e-9)


def test_strays_a_thousand_kilometres_off_are_refused_by_number_and_distance(tmp_path):
    points = np.vstack([wall(), [[1e6, 0.0, 0.0], [0.0, -1e5, 0.0]]])
    with pytest.raises(InvalidInputError, match=r"2 of 3723 points .* the farthest 1e") as error:
        meshed(points, tmp_path, {"view": (0, 1, 0)})
    assert error.value.field == "file"
    far = wall() + np.array([5e6, 4e5, 0.0])
    assert len(meshed(far, tmp_path, {"view": (0, 1, 0)}).faces) == 2 * 60**2
