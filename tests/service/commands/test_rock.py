"""``crux rock``: from a scan to a mesh hold on which a plan is made."""

from __future__ import annotations

import json
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import trimesh

from service.commands.cli import run_command_line
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint, result
from tests.suite.helpers.replies import refusal
from tests.suite.helpers.requests import put, wall_request
from tests.suite.helpers.scans import relief, wall, write_cloud

TERRAIN = Path(mpl.get_data_path()) / "sample_data" / "jacksboro_fault_dem.npz"


def scanned(folder: Path) -> str:
    """A wall in millimetres with one point that is not finite, and a hole of 50 mm."""
    points = np.vstack([wall(0.004, 0.2, 0.05), [np.nan] * 3])
    return str(write_cloud(folder / "wall.xyz", 1e3 * points))


def test_it_is_said_which_axis_was_taken_for_up(tmp_path, capfd):
    """A wall seen along z is ground unless it is told what is up."""
    x, y, z = wall(0.01, 0.2, 0.0).T
    cloud = str(write_cloud(tmp_path / "cloud.xyz", np.column_stack([x, z, y])))
    output = ["-o", str(tmp_path / "rock.ply")]
    assert run_command_line(["rock", cloud, *output]) == DONE
    out = " ".join(capfd.readouterr().out.split())
    assert "up z of the file's axes, assumed" in out
    assert "warning: with z up this is ground, or a roof;" in out
    assert run_command_line(["rock", cloud, *output, "--up", "y"]) == DONE
    out = " ".join(capfd.readouterr().out.split())
    assert "up y of the file's axes view" in out
    assert "ground" not in out
    for more, up, assumed in (([], "z", True), (["--up", "z"], "z", False)):
        assert run_command_line(["rock", cloud, *output, *more, "--json"]) == DONE
        told = result(capfd)
        assert (told["up"], told["up_assumed"]) == (up, assumed)


def test_the_table_tells_what_was_read_and_what_is_open(tmp_path, capfd):
    output, picture = tmp_path / "rock.ply", tmp_path / "rock.png"
    arguments = [scanned(tmp_path), "-o", str(output), "--unit", "mm", "--plot", str(picture)]
    assert run_command_line(["rock", *arguments]) == DONE
    out, err = capfd.readouterr()
    assert err == ""
    assert str(output) in out
    *table, _, _ = out.splitlines()
    assert max(map(len, table)) <= 80
    rows = {line[:12].strip(): line[12:].split() for line in table}
    assert int(rows["points read"][0].replace(",", "")) > 10_000
    assert rows["dropped"][0] == "1"
    parts = ("dropped", "outliers", "alone", "passed over", "kept")
    counts = {name: int(rows[name][0].replace(",", "")) for name in parts if name in rows}
    assert sum(counts.values()) == int(rows["points read"][0].replace(",", ""))
    assert rows["holes"][0] == "1"
    assert float(rows["holes"][-2]) == pytest.approx(50, abs=5)
    mesh = trimesh.load_mesh(str(output), process=False)
    assert f"{len(mesh.faces):,}" == rows["triangles"][0]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_same_as_json(tmp_path, capfd):
    output = tmp_path / "rock.ply"
    options = ["--unit", "mm", "--view", "0,1,0", "--hole", "0.1", "--spacing", "0.01", "--json"]
    assert run_command_line(["rock", scanned(tmp_path), "-o", str(output), *options]) == DONE
    told = result(capfd)
    assert told["dropped"] == 1
    assert told["holes"] == []
    assert told["spacing"] == pytest.approx(0.01, rel=0.25)
    assert told["pose"]["orientation"] == pytest.approx([-0.5, -0.5, -0.5, 0.5])
    assert told["file"] == str(output)


def test_a_plan_is_made_on_scanned_terrain(tmp_path, stance_file, capfd):
    options = ["--cell", "90", "--width", "1", "--up", "y", "--spacing", "0.005", "--json"]
    assert (
        run_command_line(["rock", str(TERRAIN), "-o", str(tmp_path / "rock.ply"), *options]) == DONE
    )
    told = result(capfd)
    assert told["extent"][1] == pytest.approx(1.0, abs=0.01)
    assert told["filled"] == []
    request = wall_request(20.0)
    for i in range(len(request["stance"]["hands"])):
        request = put(
            request, ("stance", "hands", i, "hold"), {"shape": "mesh", "file": "rock.ply"}
        )
    assert run_command_line(["plan", stance_file(request), "--json"]) in (0, 3)
    reply = json.loads(capfd.readouterr().out)
    assert reply["verified"] is True


@pytest.mark.parametrize(
    ("text", "more", "words"),
    [
        ("0 0 0\n1 0 0\n0 1 1\n", ["--cell", "2"], "cell: is for grids of heights, "),
        (
            "0 0 0\n1e200 0 0\n0 1e200 1\n",
            [],
            "file: coordinates must be within ±1e+12, got 1e+200 in ",
        ),
    ],
)
def test_points_have_no_cells_and_are_near(text, more, words, tmp_path, capfd):
    file = tmp_path / "wall.xyz"
    file.write_text(text)
    assert (
        run_command_line(["rock", str(file), "-o", str(tmp_path / "rock.ply"), *more]) == BAD_INPUT
    )
    assert words in complaint(capfd)


def test_rock_is_not_written_over_its_scan(tmp_path, capfd):
    scan, link = tmp_path / "scan.ply", tmp_path / "link.ply"
    trimesh.creation.box().export(scan)
    before = scan.read_bytes()
    link.symlink_to(scan)
    for output in (scan, link):
        assert (
            run_command_line(["rock", str(scan), "-o", str(output), "--view", "0,0,1"]) == BAD_INPUT
        )
        assert f"{output} is the scan itself" in complaint(capfd)
    assert scan.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.pcd", "-o", "rock.ply"], "file: no such file: none.pcd"),
        (["wall.dxf", "-o", "rock.ply"], "file: wall.dxf: a scan's file ends in"),
        (["none.csv", "-o", "there.ply"], "file: no such file: none.csv"),
        (["none.pcd"], "Missing option '-o'"),
        (["none.pcd", "-o", "rock.stl"], "must end in .ply"),
        (["none.pcd", "-o", "none/rock.ply"], "no such folder"),
        (["none.pcd", "-o", "rock.ply", "--plot", "rock.txt"], "valid endings are"),
        (["none.pcd", "-o", "rock.ply", "--unit", "inch"], "'m', 'cm', 'mm'"),
        (["none.pcd", "-o", "rock.ply", "--up", "w"], "--up"),
        (["none.pcd", "-o", "rock.ply", "--view", "0,1"], "three numbers separated by commas"),
        (
            ["none.pcd", "-o", "rock.ply", "--view", "0,1,0", "--viewpoint", "0,0,0"],
            "view: give a view or a viewpoint",
        ),
        ([str(TERRAIN), "-o", "rock.ply", "--cell", "-1"], "cell: must be finite and above zero"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(arguments, words, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.ply").write_text("")
    assert run_command_line(["rock", *arguments]) == BAD_INPUT
    assert words in complaint(capfd)
    assert not (tmp_path / "rock.ply").exists()


def test_a_file_in_the_wrong_unit_is_warned_of(tmp_path, capfd):
    file = write_cloud(tmp_path / "wall.xyz", 100.0 * wall(0.01))
    assert (
        run_command_line(["rock", str(file), "-o", str(tmp_path / "rock.ply"), "--hole", "3"])
        == DONE
    )
    assert "m across, and a hold may be 10 m" in capfd.readouterr().out
    file = write_cloud(tmp_path / "wall.xyz", wall(0.004))
    assert (
        run_command_line(["rock", str(file), "-o", str(tmp_path / "rock.ply"), "--unit", "mm"])
        == DONE
    )
    said = " ".join(capfd.readouterr().out.split())
    assert " m across, less than a palm is long; is it in m (--unit)" in said


@pytest.mark.parametrize("up", ["z", pytest.param("y", marks=pytest.mark.slow)])
def test_a_grid_whose_holes_are_filled_with_zeros_is_warned_of(up, tmp_path, capfd):
    line = 2e-3 * np.arange(120)
    heights = 0.5 + relief(*np.meshgrid(line, line))
    options = [str(tmp_path / "heights.npy"), "-o", str(tmp_path / "rock.ply"), "--cell", "2e-3"]
    for holes, told in ((0, []), (20, [{"axis": up, "value": 0.0, "points": 400}])):
        heights[50 : 50 + holes, 70 : 70 + holes] = 0.0
        np.save(tmp_path / "heights.npy", heights)
        assert run_command_line(["rock", *options, "--up", up, "--json"]) == DONE
        found = result(capfd)["filled"]
        assert found == told
        assert run_command_line(["rock", *options, "--up", up]) == DONE
        said = "400 points are at exactly 0 m" in " ".join(capfd.readouterr().out.split())
        assert said == bool(holes)


@pytest.mark.slow
def test_a_scan_that_is_a_sieve_is_told_to_be_one(tmp_path, capfd):
    x, z = np.random.default_rng(0).uniform(0.0, 0.7, (2, 4400))
    cloud, rock = tmp_path / "cloud.xyz", tmp_path / "rock.ply"
    np.savetxt(cloud, np.c_[x, 0.02 * np.sin(x / 0.07) * np.cos(z / 0.09), z])
    asked = ["rock", str(cloud), "-o", str(rock), "--view", "0,1,0"]
    assert run_command_line([*asked, "--hole", "0.02"]) == DONE
    said = " ".join(capfd.readouterr().out.split())
    told = re.search(r"warning: (\d+) holes .*: with --hole ([\d.]+), (\d+) holes .* left", said)
    assert told is not None
    looked = ["holds", str(rock), "-o", str(tmp_path / "h.json"), "--spacing", "0.3"]
    assert run_command_line([*looked, "--workers", "1"]) == OVERLOADED
    said = " ".join(capfd.readouterr().out.split())
    assert "nothing holds: is the scan full of holes? `crux rock` says what helps" in said
    assert run_command_line([*asked, "--hole", told[2], "--json"]) == DONE
    made = result(capfd)
    assert len(made["holes"]) + len(made["steps"]) == int(told[3]) <= 0.1 * int(told[1])


def printed(arguments: list[str], capfd: pytest.CaptureFixture[str]) -> str:
    assert run_command_line(["rock", *arguments]) == DONE
    return " ".join(capfd.readouterr().out.split())


def test_a_printed_pose_has_the_digits_that_a_millimetre_needs(tmp_path, capfd):
    points = wall(0.01) + np.array([402117.25, 5310842.75, 812.5])
    cloud, output = str(tmp_path / "wall.xyz"), ["-o", str(tmp_path / "rock.ply")]
    np.savetxt(cloud, points, fmt="%.4f")
    assert run_command_line(["rock", cloud, *output]) == BAD_INPUT
    assert "view: the scanner's position is unknown" in complaint(capfd)
    view = ["--view", "0,1,0"]
    out = printed([cloud, *output, *view], capfd)
    pose = json.loads(re.findall(r"pose (\{.*?\})", out)[0])
    assert run_command_line(["rock", cloud, *output, *view, "--json"]) == DONE
    told = result(capfd)
    assert told["view_assumed"] is False
    for name, within in (("position", 1e-6), ("orientation", 1e-7)):
        assert pose[name] == pytest.approx(told["pose"][name], rel=0.0, abs=within)
    assert told["pose"]["position"][1] == pytest.approx(5310843.75, abs=0.05)
    # no request goes so far: where its world is to begin is told, and the pose there
    shifted = json.loads(re.findall(r"there the pose is (\{.*?\})", out)[0])
    assert "let the stance's world begin at (402000, 5311000, 0)" in out
    assert shifted["position"] == pytest.approx(
        np.subtract(told["pose"]["position"], [402000, 5311000, 0]), abs=1e-5
    )
    kind, field, message = refusal(put(wall_request(), ("stance", "body"), told["pose"]))
    assert (kind, field) == ("invalid", "stance.body.position[0]")
    assert "got 402117.25; in map coordinates" in message
    assert (
        refusal(put(wall_request(), ("stance", "body"), shifted | {"x": 1}))[1] == "stance.body.x"
    )


def test_few_stray_points_are_counted_and_scan_lines_told(tmp_path, capfd):
    points, output = wall(0.01, 0.2), ["-o", str(tmp_path / "rock.ply"), "--view", "0,1,0"]
    points[[200, 700, 1200], 1] -= (0.3, 0.6, 0.9)
    cloud = str(write_cloud(tmp_path / "few.xyz", points))
    out = printed([cloud, *output], capfd)
    assert "alone 3 left out, joined to nothing, maybe stray" in out
    assert "3 points before or behind the rock" in out
    advised = re.search(r"--std-ratio (\S+), and with --hole (\S+), 0 holes", out)
    assert advised is not None
    tried = ["--std-ratio", advised[1], "--hole", advised[2]]
    assert "warning" not in printed([cloud, *output, *tried], capfd)
    points = wall(0.002, 0.2)
    lines = points[(np.round(points[:, 2] / 0.002) % 13 == 0) | (points[:, 0] > 0.19)]
    out = printed([str(write_cloud(tmp_path / "lines.xyz", lines)), *output], capfd)
    assert "(points are 2 mm apart, in lines or patches 26 mm apart)" in out
    assert "warning: gaps over" in out


def test_stray_points_are_told_and_dropped(tmp_path, capfd):
    rng = np.random.default_rng(0)
    strays = rng.uniform([-0.17, 0.3, -0.17], [0.17, 0.9, 0.17], (90, 3))
    cloud = str(write_cloud(tmp_path / "wall.xyz", np.vstack([wall(0.004, 0.2), strays])))
    asked = [cloud, "-o", str(tmp_path / "rock.ply"), "--view", "0,1,0"]
    assert "without stray points, --std-ratio 2, 0 holes and steps are left" in printed(
        asked, capfd
    )
    out = printed([*asked, "--std-ratio", "2"], capfd)
    assert re.search(r"outliers \d+ dropped, far from their neighbours", out)
    assert "holes 0 wider than 20 mm steps 0 higher than 20 mm" in out
    assert "warning" not in out
    assert (
        run_command_line(["rock", *asked, "--std-ratio", "2", "--neighbours", "8", "--json"])
        == DONE
    )
    told = result(capfd)
    assert told["outliers"] >= 90
    assert told["covered"] > 0.95
    assert told["warnings"] == []
    for more, words in (
        (["--neighbours", "8"], "neighbours: requires --std-ratio"),
        (["--std-ratio", "0"], "std_ratio: must be finite and above zero"),
    ):
        assert run_command_line(["rock", *asked, *more]) == BAD_INPUT
        assert words in complaint(capfd)


@pytest.mark.parametrize(
    "ending", ["ply", "stl", *(pytest.param(e, marks=pytest.mark.slow) for e in ("obj", "off"))]
)
def test_the_triangles_of_a_file_are_kept(ending, tmp_path, capfd):
    mesh = trimesh.creation.icosphere(3, radius=0.2)
    path, output = tmp_path / f"ball.{ending}", tmp_path / "rock.ply"
    mesh.export(path)
    out = printed([str(path), "-o", str(output), "--plot", str(tmp_path / "rock.png")], capfd)
    assert f"triangles {len(mesh.faces):,} the file's own" in out
    assert "assumed: from above" in out
    assert "ground" not in out
    made = trimesh.load_mesh(str(output), process=False)
    assert made.volume == pytest.approx(mesh.volume, rel=1e-5)
    mesh.invert()
    mesh.update_faces(mesh.triangles_center[:, 0] < 0.0)
    mesh.export(path)
    out = printed([str(path), "-o", str(output), "--view", "1,0,0", "-q"], capfd)
    assert "points read" not in out
    assert out.startswith("pose {")
    assert "showed their backs to that view" in out


def test_a_large_rock_is_said_to_be_so_for_its_own_reason(tmp_path, capfd):
    output = ["-o", str(tmp_path / "rock.ply"), "--view", "0,1,0"]
    far = np.vstack([wall(0.004), [0.1, 400.0, 0.1], [40.0, 1.0, 30.0]])
    stray = str(write_cloud(tmp_path / "stray.xyz", far))
    assert "warning" not in printed([stray, *output, "--std-ratio", "2"], capfd)
    out = printed([stray, *output, "--hole", "1000"], capfd)
    assert "98 in a hundred points are within" in out
    assert "--unit" not in out
    thousand = str(write_cloud(tmp_path / "mm.xyz", 1e3 * wall(0.01)))
    out = printed([thousand, *output, "--hole", "30"], capfd)
    assert "is it in cm or mm (--unit)" in out
    line = 2e-3 * np.arange(60)
    heights = relief(*np.meshgrid(line, line))
    heights[20:30, 20:30] = -9999.0
    np.save(tmp_path / "a.npy", heights)
    grid = [str(tmp_path / "a.npy"), *output[:2], "--cell", "2e-3", "--hole", "1e5"]
    out = printed(grid, capfd)
    assert "100 points are at exactly -9999 m" in out
    assert "--unit" not in out
