"""``crux holds``: holds proposed on a scan, and a plan with one of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import trimesh

from service.commands.cli import run
from tests.suite.helpers.commands import BAD_INPUT, DONE, complaint, result
from tests.suite.helpers.requests import wall_request
from tests.suite.helpers.rocks import fractal_wall

COARSE = ["--spacing", "0.15", "--angles", "1", "--outer-rotation", "0"]


@pytest.fixture(scope="module")
def rock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rock") / "wall.ply"
    trimesh.Trimesh(*fractal_wall(3, size=0.5, count=101), process=False).export(path)
    return path


def test_holds_are_written_sorted_told_and_drawn(
    rock: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    output, picture = tmp_path / "holds.json", tmp_path / "holds.png"
    options = ["-o", str(output), *COARSE, "--robust", "1", "--workers", "1"]
    assert run(["holds", str(rock), *options, "--plot", str(picture)]) == DONE
    out, _ = capfd.readouterr()
    assert max(map(len, out.splitlines()[:-1])) <= 80
    assert "16 trials at 16 points" in out
    assert picture.read_bytes().startswith(b"\x89PNG")
    told = json.loads(output.read_text(encoding="utf-8"))
    held = told["holds"]
    assert told["trials"] == 16
    assert len(held) + told["refused"] <= 16
    reaches = [hold["support"]["-fz"] for hold in held]
    assert reaches == sorted(reaches, reverse=True)
    first, *others = held
    assert first["worst"]["-fz"] <= first["tenth"]["-fz"]
    assert all(hold["worst"] is None for hold in others)


def test_a_plan_is_made_with_a_hold_that_was_proposed(
    rock: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "holds.json"
    options = ["-o", str(output), *COARSE, "--robust", "0", "--json"]
    assert run(["holds", str(rock), *options]) == DONE
    told = result(capfd)
    best = json.loads(output.read_text(encoding="utf-8"))["holds"][0]
    assert told["file"] == str(output)
    request = wall_request()
    hand = request["stance"]["hands"][0]
    # a wall that faces the body: z of the rock's frame along x of the world
    pose = {"position": hand["pose"]["position"], "orientation": [0.0, 0.70710678, 0.0, 0.70710678]}
    request["stance"]["rocks"] = {"wall": {"shape": "mesh", "file": str(rock), "pose": pose}}
    hand["hold"] = {"shape": "rock", "rock": "wall"}
    hand["grasp"] = best["grasp"]
    hand["place"] = best["place"]
    del hand["pose"]
    stance = tmp_path / "stance.json"
    stance.write_text(json.dumps(request), encoding="utf-8")
    run(["plan", str(stance), "--json"])
    reply = result(capfd)
    seating = reply["hands"][0]["seating"]
    assert seating["rule"] == best["seating"]["rule"]
    assert list(reply["poses"]) == [hand["limb"]]


def test_what_cannot_be_is_told_in_a_line(
    rock: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    output = str(tmp_path / "holds.json")
    for arguments, words in (
        ([str(tmp_path / "none.ply"), "-o", output], "no such file"),
        ([str(rock), "-o", output, "--surface", "cheese"], "cheese"),
        ([str(rock), "-o", output, "--spacing", "0"], "spacing"),
        ([str(rock), "-o", str(tmp_path / "x" / "holds.json")], "no such folder"),
        ([str(rock), "-o", str(tmp_path / "holds.txt")], "must end in .json"),
    ):
        assert run(["holds", *arguments]) == BAD_INPUT
        assert words in complaint(capfd)
