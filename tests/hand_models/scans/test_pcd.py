"""PCD files: poses of scanners, and headers that name more than the file has."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from pypcd4.pypcd4 import PointCloud
from scipy.spatial.transform import Rotation

from hand_models import InvalidInputError
from hand_models.scans import mesh_scan, read_scan
from tests.suite.helpers.scans import relief, wall

HEAD = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE {size}\nTYPE {kind}\nCOUNT {count}\n"
    "WIDTH {width}\nHEIGHT {height}\nVIEWPOINT {pose}\nPOINTS {rows}\nDATA {data}\n"
)
USUAL = {
    "size": "4 4 4",
    "kind": "F F F",
    "count": "1 1 1",
    "height": 1,
    "pose": "0 0 0 1 0 0 0",
    "data": "binary",
}


def pcd(path, points, **change):
    full = USUAL | {"width": len(points), "rows": len(points)} | change
    path.write_bytes(HEAD.format(**full).encode() + points.astype("<f4").tobytes())
    return path


@pytest.mark.parametrize("seed", range(3))
def test_points_in_a_turned_scanners_frame_are_placed_by_its_pose(seed, tmp_path):
    rng = np.random.default_rng(seed)
    world = wall(0.01)
    place = np.array([0.3, -1.0, 0.2]) * rng.uniform(0.2, 1.0, 3)
    turn = Rotation.random(rng=rng)
    x, y, z, w = turn.as_quat()
    inside = turn.inv().apply(world - place)
    pose = " ".join(map(repr, (*place.tolist(), *map(float, (w, x, y, z)))))
    rock = mesh_scan(read_scan(pcd(tmp_path / "a.pcd", inside, pose=pose)))
    assert rock.pose.rotation[1, 2] > 0.99
    x, y, z = rock.pose.apply(rock.vertices).T
    np.testing.assert_allclose(y, 1.0 - relief(x, z), atol=1e-6)


def test_an_unturned_viewpoint_is_in_the_points_own_axes(tmp_path):
    for pose, side in (("0 -2 0 1 0 0 0", 1.0), ("0 5 0 1 0 0 0", -1.0)):
        path = pcd(tmp_path / "a.pcd", wall(0.01), pose=pose)
        assert side * read_scan(path).direction()[1] > 0.99
        np.testing.assert_allclose(read_scan(path).points, wall(0.01), atol=1e-7)


def test_a_view_is_used_in_place_of_the_whole_viewpoint(tmp_path):
    path = pcd(tmp_path / "a.pcd", wall(0.01), pose="0 0 0 0.5 0.5 0.5 0.5")
    scan = read_scan(path, view=(0, 1, 0))
    np.testing.assert_allclose(scan.points, wall(0.01), atol=1e-7)
    assert scan.direction().tolist() == [0, 1, 0]


@pytest.mark.parametrize("pose", ["0 0 0 0 0 0 0", "nan 0 0 1 0 0 0", "0 0 0 nan 0 0 0"])
def test_a_viewpoint_that_is_no_pose_is_refused(pose, tmp_path):
    with pytest.raises(InvalidInputError, match=r"^file: "):
        read_scan(pcd(tmp_path / "a.pcd", wall(0.02), pose=pose))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pose": "0 0 0"}, "VIEWPOINT of the header must be seven numbers, .* got 0 0 0: "),
        ({"kind": "F F Q"}, "TYPE of the header must be F, I or U for each field, got F F Q: "),
        ({"kind": "F F"}, "TYPE of the header"),
    ],
)
def test_a_line_of_the_header_that_is_wrong_is_named(change, words, tmp_path):
    with pytest.raises(InvalidInputError, match=rf"^file: {words}"):
        read_scan(pcd(tmp_path / "a.pcd", wall(0.02), **change))


HUGE = 10**9


@pytest.mark.parametrize(
    "change",
    [
        {"width": HUGE, "rows": HUGE},
        {"width": HUGE, "rows": HUGE, "data": "ascii"},
        {"width": HUGE, "rows": HUGE, "data": "binary_compressed"},
        {"count": f"1 1 {HUGE}"},
        {"count": f"{HUGE} {HUGE} {HUGE}"},
        {"count": f"1 1 {HUGE}", "data": "ascii"},
        {"count": f"1 1 {HUGE}", "data": "binary_compressed"},
        {"count": f"1 1 {HUGE}", "width": 0, "rows": 0},
        {"size": f"4 4 {HUGE}"},
        {"width": 10**5, "height": 10**5, "rows": 10**10},
        {"height": HUGE},
        {"width": -1, "rows": -1},
        {"rows": "many"},
        {"count": f"1 1 1\ncount 1 1 {HUGE}"},
        {"pose": f"0 0 0 1 0 0 0\nCOUNT 1 1 {HUGE}\nSIZE 4 4 4\nTYPE F F F"},
    ],
)
def test_counts_beyond_the_files_size_are_refused_before_it_is_read(change, tmp_path, monkeypatch):
    path = pcd(tmp_path / "a.pcd", np.zeros((3, 3)), **change)
    read = []
    monkeypatch.setattr(PointCloud, "from_path", read.append)
    with pytest.raises(InvalidInputError, match=r"^file: "):
        read_scan(path)
    assert not read


@pytest.mark.parametrize("sizes", [(2**32 - 1, 36), (12, 2**32 - 1), (2**32 - 1, 2**32 - 1)])
def test_compressed_sizes_beyond_the_files_are_refused(sizes, tmp_path):
    path = pcd(tmp_path / "a.pcd", np.zeros((3, 3)), data="binary_compressed")
    content = path.read_bytes()
    path.write_bytes(content[:-36] + struct.pack("<II", *sizes) + content[-36:])
    with pytest.raises(InvalidInputError, match="cut short"):
        read_scan(path)
