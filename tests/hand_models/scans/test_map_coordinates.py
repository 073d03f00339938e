"""Scans far from their origin: from where they were seen, and which digits they have left."""

from __future__ import annotations

import numpy as np
import pytest

from hand_models import InvalidInputError
from hand_models.scans import mesh_scan, read_scan
from tests.suite.helpers.scans import wall, write_cloud

OFFSETS = [
    (402117.0, 5310842.0, 812.0),
    (5e5, 0.0, 0.0),
    (0.0, 5e6, 0.0),
    (-3e5, 4e6, 100.0),
    (2600000.0, 1200000.0, 500.0),
    (1000.0, 2000.0, 100.0),
    (0.0, 0.0, 4e5),
    (0.0, 120.0, 0.0),
    (691000.0, 5335000.0, -3.0),
    (4.2e6, 8.9e5, 4.7e6),
]


def text_of(folder, points):
    path = folder / "wall.xyz"
    np.savetxt(path, points, fmt="%.4f")
    return path


@pytest.mark.parametrize("offset", OFFSETS)
def test_the_origin_of_a_map_is_not_where_a_scanner_was(offset, tmp_path):
    points = wall(0.01) + offset
    path = text_of(tmp_path, points)
    with pytest.raises(InvalidInputError, match=r"--view X,Y,Z.*--viewpoint") as error:
        mesh_scan(read_scan(path))
    assert error.value.field == "view"
    rock = mesh_scan(read_scan(path, viewpoint=np.add(offset, (0.0, -2.0, 0.0))))
    assert rock.pose.rotation[1, 2] > 0.99
    there = rock.pose.apply(rock.vertices)
    found = np.abs(there[:, None, :] - points[None, ::37]).sum(axis=2).min(axis=0)
    assert found.max() < 2e-4


@pytest.mark.parametrize("away", [0.5, 1.0, 3.0, 10.0])
def test_an_origin_from_which_rock_is_seen_is_where_the_scanner_was(away, tmp_path):
    scan = read_scan(text_of(tmp_path, wall(0.01) + np.array((0.0, away - 1.0, 0.0))))
    assert scan.assumed
    assert scan.direction()[1] > 0.99


@pytest.mark.parametrize(
    "place",
    [
        (0.0, 0.25, 0.0),  # behind a wall that is 0.8 m wide and high
        (0.3, 0.35, 0.0),
        (0.4, -0.3, -0.4),  # before it, but nearer than half its width
        (1.8, -0.6, 0.0),  # far to the side
        (0.0, -1.5, 3.0),
    ],
)
def test_an_origin_that_an_offset_left_near_the_rock_is_not_where_a_scanner_was(place, tmp_path):
    path = text_of(tmp_path, wall(0.02, half=0.4) - [0.0, 1.0, 0.0] - place)
    with pytest.raises(InvalidInputError, match=r"offset.*--view X,Y,Z.*--viewpoint") as error:
        read_scan(path).direction()
    assert error.value.field == "view"
    assert read_scan(path, view=(0, 1, 0)).direction().tolist() == [0, 1, 0]


def test_rock_is_small_or_large_by_how_far_a_scanner_stands_from_it(tmp_path):
    small = text_of(tmp_path, wall(0.01) - [0.0, 0.8, 0.0])
    with pytest.raises(InvalidInputError, match=r"0\.2 m before or behind rock of 0\.24 m"):
        read_scan(small).direction()
    large = text_of(tmp_path, wall(0.02, half=0.4) - [0.2, 0.5, 0.2])
    assert read_scan(large).direction()[1] > 0.99


@pytest.mark.parametrize("offset", [o for o in OFFSETS if max(map(abs, o)) > 2e4])
@pytest.mark.parametrize("ending", [".xyz", ".ply", ".pcd", ".csv"])
def test_floats_of_32_bits_do_not_hold_map_coordinates(offset, ending, tmp_path):
    points = (wall(0.01) + offset).astype(np.float32).astype(float)
    path = write_cloud(tmp_path / f"wall{ending}", points, "binary")
    with pytest.raises(InvalidInputError, match=r"32 bits.*offset.*64-bit") as error:
        read_scan(path, view=(0, 1, 0))
    assert error.value.field == "file"
    step = np.spacing(np.float32(np.abs(points).max()))
    assert f"steps of {step:g} m" in str(error.value)


def test_floats_of_32_bits_in_millimetres_and_near_the_origin(tmp_path):
    near = (1e3 * wall(0.01)).astype(np.float32).astype(float)
    path = write_cloud(tmp_path / "wall.ply", near)
    assert len(read_scan(path, unit="mm", view=(0, 1, 0)).points) == len(near)
    far = (1e3 * (wall(0.01) + OFFSETS[0])).astype(np.float32).astype(float)
    with pytest.raises(InvalidInputError, match="steps of 512 mm"):
        read_scan(write_cloud(tmp_path / "far.ply", far), unit="mm", view=(0, 1, 0))


@pytest.mark.parametrize("digits", [6, 7])
@pytest.mark.parametrize("offset", [OFFSETS[0], OFFSETS[4], OFFSETS[8]])
def test_numbers_that_were_written_with_few_digits_are_named(digits, offset, tmp_path):
    path = tmp_path / "wall.xyz"
    np.savetxt(path, wall(0.01) + offset, fmt=f"%.{digits}g")
    with pytest.raises(InvalidInputError, match=r"have [67] digits.*write more digits"):
        read_scan(path, view=(0, 1, 0))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("form", "words"), [("%.8g", "have 8 digits"), (None, "floats of 32 bits")]
)
def test_steps_of_the_largest_coordinate_alone_are_named(form, words, seed, tmp_path):
    """Of scattered points no two are at one place, whatever is lost of one coordinate."""
    points = np.random.default_rng(seed).uniform(-0.3, 0.3, (2000, 3)) + OFFSETS[0]
    if form is None:
        points, form = points.astype(np.float32).astype(float), "%.5f"
    np.savetxt(tmp_path / "wall.xyz", points, fmt=form)
    with pytest.raises(InvalidInputError, match=words):
        read_scan(tmp_path / "wall.xyz", view=(0, 1, 0))


def test_a_regular_table_in_map_coordinates_is_none_of_these(tmp_path):
    path = tmp_path / "wall.xyz"
    np.savetxt(path, wall(0.01) + OFFSETS[0], fmt="%.2f")
    assert not mesh_scan(read_scan(path, view=(0, 1, 0))).holes


@pytest.mark.parametrize("name", ["a.las", "a.laz", "a.e57", "a.glb", "a.dem", "a.fbx", "a.nc"])
def test_what_to_do_with_other_formats_is_said(name, tmp_path):
    with pytest.raises(InvalidInputError, match=r"; (save|make) "):
        read_scan(tmp_path / name)


# Why no triangle is left --------------------------------------------------------------------------


def test_a_grid_whose_cell_is_in_degrees_is_not_said_to_be_of_another_unit(tmp_path):
    heights = 400.0 + 30.0 * np.random.default_rng(0).random((40, 40))
    np.save(tmp_path / "a.npy", heights)
    with pytest.raises(InvalidInputError, match="is the cell in degrees") as error:
        mesh_scan(read_scan(tmp_path / "a.npy", cell=2.8e-4))
    assert error.value.field == "cell"


def test_a_coarse_grid_is_told_its_cells_and_millimetres_their_unit(tmp_path):
    np.save(tmp_path / "a.npy", np.random.default_rng(0).random((40, 40)))
    with pytest.raises(InvalidInputError, match=r"cells are 1e\+03 mm apart.*--width"):
        mesh_scan(read_scan(tmp_path / "a.npy", cell=1.0))
    path = write_cloud(tmp_path / "wall.xyz", 1e3 * wall(0.004))
    with pytest.raises(InvalidInputError, match=r"is it in cm or mm \(--unit\)"):
        mesh_scan(read_scan(path, view=(0, 1, 0)))


def test_points_behind_one_another_are_said_to_be_seen_from_the_wrong_side(tmp_path):
    i, j = (v.ravel() for v in np.meshgrid(np.arange(30), np.arange(30)))
    points = np.column_stack([0.004 * i, 0.004 * j, 0.1 * ((i + j) % 2)])
    path = write_cloud(tmp_path / "wall.xyz", points)
    with pytest.raises(InvalidInputError, match="another side") as error:
        mesh_scan(read_scan(path, view=(0, 0, 1)))
    assert error.value.field == "view"
