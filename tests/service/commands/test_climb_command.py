"""``crux climb`` and ``crux demo --climb``, on the bundled walls."""

from __future__ import annotations

import json

import pytest

from planner import ClimbCertificate, check_bound
from service.bulk import read_trajectory
from service.commands.cli import run_command_line

ENDS = ("--from", "height:0.75", "--to", "height:1.1")
SMALL = ("climb", "small-wall", "--spacing", "0.16", "--stand-off", "0.6", "--stand-off", "0.7")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("climb", "no-wall", *ENDS), "generated walls are leaning-wall"),
        (("climb", "small-wall:x", *ENDS), "seed of a wall must be a whole number, got 'x'"),
        ((*SMALL, *ENDS, "--lean", "0.3"), "--lean"),
        ((*SMALL, "--from", "9,9,9", "--to", "height:1"), "start.near"),
        ((*SMALL, "--from", "height:0.75", "--to", "height:9"), "goal.height"),
        ((*SMALL, "--from", "nan,0,0", "--to", "height:1"), "--from"),
        ((*SMALL, *ENDS, "--surface", "glass"), "surface"),
        ((*SMALL, *ENDS, "--time", "0"), "--time"),
        ((*SMALL, *ENDS, "--at-least", "nan"), "--at-least"),
        ((*SMALL, *ENDS, "--best-within", "x"), "--best-within"),
        ((*SMALL, "--to", "height:1"), "--from"),
    ],
)
def test_what_is_impossible_is_refused(given, said, tmp_path, capsys):
    assert run_command_line([*given, "-o", str(tmp_path / "out"), "--workers", "1"]) == 2
    assert said in capsys.readouterr().err


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path, capsys):
    file = tmp_path / "out"
    file.write_text("")
    assert run_command_line([*SMALL, *ENDS, "-o", str(file)]) == 2
    assert "out" in capsys.readouterr().err


@pytest.mark.slow
def test_it_is_proven_that_a_wall_with_a_gap_cannot_be_climbed(tmp_path, capsys):
    folder = tmp_path / "out"
    given = ["climb", "blocked-wall", "--from", "height:1.0", "--to", "height:2.2"]
    status = run_command_line([*given, "-o", str(folder), "--json"])
    reply = json.loads(capsys.readouterr().out)
    assert (status, reply["status"], reply["least"]) == (3, "none", None)
    assert (folder / "wall.png").exists()
    assert not (folder / "route.json").exists()
    bound = check_bound(ClimbCertificate.read(folder / "certificate.npz"))
    assert bound.proven


@pytest.mark.slow
def test_the_demonstration_climbs_and_its_route_is_planned_again(tmp_path, capsys):
    folder = tmp_path / "out"
    assert run_command_line(["demo", "--climb", str(folder), "--json"]) == 0
    reply = json.loads(capsys.readouterr().out)
    assert reply["status"] in ("found", "not_proven")
    assert 1.0 <= reply["least"] <= reply["bound"]
    for path in reply["files"].values():
        assert (tmp_path / path).exists()
    knots = read_trajectory(folder)
    assert all(knot.verified for knot in knots)
    again = tmp_path / "again"
    assert run_command_line(["route", str(folder / "route.json"), "-o", str(again), "--json"]) == 0
    capsys.readouterr()
    assert len(read_trajectory(again)) == len(knots)
