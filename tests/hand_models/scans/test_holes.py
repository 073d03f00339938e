"""Holes, steps, stray points, and remedies that were tried before they are advised."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from hand_models import InvalidInputError
from hand_models.scans import drop_outliers, mesh_scan, read_scan, remedy
from hand_models.scans.holes import empty_circles
from tests.suite.helpers.scans import relief, wall, write_cloud


def scanned(points, folder):
    return read_scan(write_cloud(folder / "cloud.xyz", points), view=(0, 1, 0))


def strays(count, seed=0, step=0.002, half=0.12):
    """Points of a wall, and some before it that belong to nothing [m]."""
    rng = np.random.default_rng(seed)
    rock = wall(step, half)
    rock[:, 1] += rng.normal(0.0, 2e-4, len(rock))
    place = rng.uniform([-0.9 * half, 0.3, -0.9 * half], [0.9 * half, 0.9, 0.9 * half], (count, 3))
    return np.vstack([rock, place])


@pytest.mark.parametrize("seed", range(3))
def test_circles_are_the_largest_without_corners_whose_middle_is_in_the_triangle(seed):
    """Against a fine grid of middles in each triangle."""
    corners = np.random.default_rng(seed).random((3, 3))
    weights = np.array([(i, j, 300 - i - j) for i in range(301) for j in range(301 - i)]) / 300
    middles = weights @ corners[:, :2]
    nearest = np.linalg.norm(middles[:, None] - corners[:, :2], axis=2).min(axis=1)
    (found,) = empty_circles(corners[None])
    assert found == pytest.approx(2.0 * nearest.max(), rel=0.02)


@pytest.mark.parametrize("seed", range(3))
def test_the_rim_of_a_closed_wall_is_no_hole_whatever_its_rounding(seed, tmp_path):
    """Points of a straight rim lie off it by rounding, as those of 32-bit floats do."""
    rng = np.random.default_rng(seed)
    points = wall(0.004)
    points[:, [0, 2]] += 10.0 ** rng.uniform(-9, -6) * rng.normal(size=(len(points), 2))
    rock = mesh_scan(scanned(points, tmp_path))
    assert (rock.holes, rock.steps) == ((), ())


@pytest.mark.parametrize("seed", range(2))
def test_no_hole_is_wider_than_the_largest_empty_circle(seed, tmp_path):
    """Against the vertices of the Voronoi diagram that lie within the rock's outline."""
    rng = np.random.default_rng(seed)
    x, z = rng.uniform(-0.15, 0.15, (2, 600))
    rock = mesh_scan(scanned(np.column_stack([x, 1.0 - relief(x, z), z]), tmp_path), spacing=1e-5)
    assert rock.holes
    across = np.column_stack([x, z])
    middles = scipy.spatial.Voronoi(across).vertices
    middles = middles[scipy.spatial.Delaunay(across).find_simplex(middles) >= 0]
    widest = 2.0 * scipy.spatial.cKDTree(across).query(middles)[0].max()
    assert max(hole.width for hole in rock.holes) <= widest * (1.0 + 1e-9)
    assert min(hole.width for hole in rock.holes) > 0.02


@pytest.mark.parametrize("count", [1, 60])
def test_stray_points_leave_steps_and_no_holes_and_can_be_dropped(count, tmp_path):
    scan = scanned(strays(count), tmp_path)
    rock = mesh_scan(scan)
    assert not rock.holes
    assert 1 <= len(rock.steps) <= count
    assert max(step.height for step in rock.steps) > 0.05
    cleaned = drop_outliers(scan, 2.0)
    kept = mesh_scan(cleaned)
    assert (kept.holes, kept.steps) == ((), ())
    assert kept.outliers == len(scan.points) - len(cleaned.points) >= count
    assert cleaned.points[:, 1].min() > 0.95
    assert kept.dropped == 0


def test_outliers_are_those_of_the_definition(tmp_path):
    """Mean distance to the nearest others above the mean by so many standard deviations."""
    scan = scanned(np.random.default_rng(3).normal(size=(200, 3)), tmp_path)
    away = np.linalg.norm(scan.points[:, None] - scan.points, axis=2)
    mean = np.sort(away, axis=1)[:, 1:9].mean(axis=1)
    kept = scan.points[mean <= mean.mean() + 1.5 * mean.std()]
    found = drop_outliers(scan, 1.5, neighbours=8)
    np.testing.assert_array_equal(found.points, kept)
    assert 0 < found.outliers == 200 - len(kept)


@pytest.mark.parametrize(
    ("ratio", "neighbours", "field"),
    [
        (0.0, 5, "std_ratio"),
        (-1.0, 5, "std_ratio"),
        (np.nan, 5, "std_ratio"),
        (2.0, 0, "neighbours"),
        (2.0, 10**6, "neighbours"),
    ],
)
def test_wrong_numbers_of_outliers_are_named(ratio, neighbours, field, tmp_path):
    with pytest.raises(InvalidInputError) as error:
        drop_outliers(scanned(wall(0.02), tmp_path), ratio, neighbours=neighbours)
    assert error.value.field == field


def lines(seed, apart):
    """Scan lines, of points that are nearer along them than across [m]."""
    rng = np.random.default_rng(seed)
    x = np.repeat(np.arange(-0.3, 0.3, apart), 120) + rng.normal(
        0.0, 5e-4, len(np.arange(-0.3, 0.3, apart)) * 120
    )
    z = rng.uniform(-0.3, 0.3, len(x))
    return np.column_stack([x, 1.0 - relief(x, z), z])


@pytest.mark.parametrize(("seed", "apart"), [(0, 0.016), (1, 0.02), (2, 0.03)])
def test_what_is_advised_leaves_what_was_said(seed, apart, tmp_path):
    scan = scanned(lines(seed, apart), tmp_path)
    rock = mesh_scan(scan)
    found = remedy(scan, rock, 0.02)
    assert found is not None
    assert found.option == "hole"
    again = mesh_scan(scan, hole=found.value)
    left = len(again.holes) + len(again.steps)
    assert left == found.left <= 0.1 * max(len(rock.holes) + len(rock.steps), 50)
    assert again.covered > max(rock.covered, 0.5)


def test_stray_points_are_told_before_bridges(tmp_path):
    scan = scanned(strays(80), tmp_path)
    found = remedy(scan, mesh_scan(scan), 0.02)
    assert found == ("std_ratio", 2.0, 0, None, 1.0)


@pytest.mark.parametrize("count", [1, 40, 360])
def test_stray_points_in_place_of_rock_are_counted_and_dropped(count, tmp_path):
    """Measured too near, as by a mixed pixel: each leaves a gap in the rock behind it."""
    points, rng = wall(0.01, 0.3), np.random.default_rng(5)
    some = rng.choice(len(points), count, replace=False)
    points[some, 1] -= rng.uniform(0.05, 0.95, count)
    scan = read_scan(write_cloud(tmp_path / "cloud.xyz", points))
    rock = mesh_scan(scan)
    # where every tenth point is stray some hide others
    assert (0.5 if count > 100 else 1.0) * count <= rock.alone <= 1.1 * count
    found = remedy(scan, rock, 0.02)
    assert found is not None
    hole = found.value if found.option == "hole" else 0.02
    ratio = found.std_ratio or found.value
    assert ratio in (1.0, 2.0)
    again = mesh_scan(drop_outliers(scan, ratio), hole=hole)
    assert len(again.holes) + len(again.steps) == found.left
    assert found.left <= 0.1 * (len(rock.holes) + len(rock.steps))
    assert abs(again.pose.rotation[1, 2]) > 0.99


def test_a_block_that_stands_out_is_no_stray_point(tmp_path):
    points = wall(0.01, 0.2)
    points[np.abs(points[:, [0, 2]]).max(axis=1) < 0.06, 1] -= 0.1
    rock = mesh_scan(scanned(points, tmp_path))
    assert (rock.alone, len(rock.steps)) == (0, 1)


@pytest.mark.parametrize("place", [(0.0, -30.0, 0.1), (15.0, 0.9, 0.0)])
def test_one_point_far_off_does_not_turn_the_view(place, tmp_path):
    points = np.vstack([wall(0.01, 0.2), place])
    rock = mesh_scan(read_scan(write_cloud(tmp_path / "cloud.xyz", points)))
    assert rock.pose.rotation[1, 2] > 0.99
    assert len(rock.vertices) == len(points) - 1


def test_the_gap_between_scan_lines_is_measured(tmp_path):
    rock = mesh_scan(scanned(lines(0, 0.03), tmp_path))
    assert rock.gaps is not None
    assert rock.covered < 0.5
    assert rock.gaps.gap(0.02) == pytest.approx(0.03, rel=0.1)
    assert rock.gaps.gap(1e3) == 0.0


def test_nothing_is_advised_where_nothing_helps(tmp_path):
    """Rock with windows wider than a palm."""
    points = wall(0.004, 0.25)
    middles = np.stack(np.meshgrid(*2 * [np.arange(-0.15, 0.16, 0.15)]), axis=-1).reshape(-1, 2)
    away = np.linalg.norm(points[:, None, [0, 2]] - middles, axis=2).min(axis=1)
    scan = scanned(points[away > 0.04], tmp_path)
    rock = mesh_scan(scan)
    assert len(rock.holes) == 9
    assert remedy(scan, rock, 0.02) is None


def test_strays_and_lines_far_apart_need_both(tmp_path):
    points = lines(0, 0.03)
    far = np.random.default_rng(1).uniform([-0.3, 0.3, -0.3], [0.3, 0.9, 0.3], (90, 3))
    scan = scanned(np.vstack([points, far]), tmp_path)
    rock = mesh_scan(scan)
    found = remedy(scan, rock, 0.02)
    assert found is not None
    assert (found.option, found.std_ratio) == ("hole", 2.0)
    again = mesh_scan(drop_outliers(scan, 2.0), hole=found.value)
    assert len(again.holes) + len(again.steps) == found.left <= 50
    # who has bridged holes already is told to drop points, even where a tenth is not reached
    bridged = remedy(scan, mesh_scan(scan, hole=found.value), found.value)
    assert bridged is not None
    assert "std_ratio" in (bridged.option, bridged.std_ratio and "std_ratio")
