"""``crux climb`` and ``crux demo --climb``, on the bundled walls."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest

from hand_models.scans import generate_wall
from planner import ClimbCertificate, check_bound, robosimian
from service import climbs
from service.bulk import read_trajectory
from service.commands.cli import run_command_line
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint

ENDS = ("--from", "height:0.75", "--to", "height:1.1")
TINY = ["--from", "height:0.8", "--to", "height:0.8", "--stand-off", "0.6"]
TINY += ["--spacing", "0.3", "--body-spacing", "0.3"]
SMALL = ("climb", "small-wall", "--spacing", "0.16", "--stand-off", "0.6", "--stand-off", "0.7")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("climb", "no-wall", *ENDS), "generated walls are leaning-wall"),
        (("climb", "small-wall:x", *ENDS), "seed of a wall must be a whole number, got 'x'"),
        ((*SMALL, *ENDS, "--lean", "0.3"), "--lean"),
        ((*SMALL, "--from", "9,9,9", "--to", "height:1"), "--from: no pose"),
        ((*SMALL, "--from", "height:0.75", "--to", "height:9"), "--to: no pose"),
        ((*SMALL, "--from", "nan,0,0", "--to", "height:1"), "--from"),
        ((*SMALL, *ENDS, "--surface", "glass"), "surface"),
        ((*SMALL, *ENDS, "--time", "0"), "--time"),
        ((*SMALL, *ENDS, "--wrist-travel", "0.1", "0", "0"), "--wrist-travel"),
        ((*SMALL, *ENDS, "--wrist-travel", "0.01", "0", "0"), "requires wrist 'compliant'"),
        ((*SMALL, *ENDS, "--at-least", "nan"), "--at-least"),
        ((*SMALL, *ENDS, "--best-within", "x"), "--best-within"),
        ((*SMALL, "--to", "height:1"), "--from"),
        ((*SMALL, "--from", "9,9,9", "--to", "height:1"), "or a finer grid (--body-spacing)"),
        ((*SMALL, *ENDS, "--spacing", "0.001"), "--spacing: must be 0.005 to 10 m, got 0.001"),
        ((*SMALL, *ENDS, "--body-spacing", "0.001"), "--body-spacing: must be 0.005 to 10 m"),
        ((*SMALL, *ENDS, "--stand-off", "0.7"), "--stand-off: must be at least one number, and no"),
        (("climb", "small-wall", *ENDS, "--stand-off", "0.01"), "--stand-off: no pose of the body"),
    ],
)
def test_what_is_impossible_is_refused(given, said, tmp_path, capsys):
    assert run_command_line([*given, "-o", str(tmp_path / "out"), "--workers", "1"]) == 2
    assert said in capsys.readouterr().err


def test_the_picture_of_a_plan_is_no_part_of_a_climb(tmp_path, capsys):
    asked = ["demo", "--climb", str(tmp_path / "climb"), "-o", str(tmp_path / "demo.png")]
    assert run_command_line(asked) == BAD_INPUT
    assert "give --climb DIR, without -o" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_that_faces_the_other_way_is_refused(tmp_path, capsys):
    flipped = tmp_path / "flipped.off"
    flipped.write_text("OFF\n4 2 0\n0 0 0\n0 1 0\n1 0 0\n1 1 0\n3 0 2 1\n3 1 2 3\n")
    assert run_command_line(["climb", str(flipped), *ENDS, "-o", str(tmp_path / "out")]) == 2
    assert "crux: ROCK: hardly any rock faces −z of its frame; is" in capsys.readouterr().err
    # as of many rocks
    table = tmp_path / "climbs.csv"
    for options, field in (((), "ROCK"), (("--time", "601"), "--time")):
        given = ["climb", str(flipped), *ENDS, "-o", str(table), "--workers", "1", *options]
        assert run_command_line(given) == BAD_INPUT
        (row,) = rows(table)
        assert (row["error_kind"], row["error_field"]) == ("invalid", field)


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path, capsys):
    file = tmp_path / "out"
    file.write_text("")
    assert run_command_line([*SMALL, *ENDS, "-o", str(file)]) == 2
    assert "out" in capsys.readouterr().err


@pytest.mark.slow
def test_it_is_proven_that_a_wall_with_a_gap_cannot_be_climbed(tmp_path, capsys):
    folder = tmp_path / "out"
    given = ["climb", "blocked-wall", "--from", "height:1.0", "--to", "height:2.2"]
    given += ["--spacing", "0.2", "--body-spacing", "0.25"]
    status = run_command_line([*given, "-o", str(folder), "--json"])
    reply = json.loads(capsys.readouterr().out)
    assert (status, reply["status"], reply["least"]) == (3, "none", None)
    assert (folder / "wall.png").exists()
    assert not (folder / "route.json").exists()
    bound = check_bound(ClimbCertificate.read(folder / "certificate.npz"))
    assert bound.proven


@pytest.mark.slow
def test_a_search_whose_start_leads_nowhere_says_so(tmp_path, capsys):
    """Its first node alone is known when the stances of the way to it fail."""
    ends = ["--from", "height:0.8", "--to", "height:0.8", "--stand-off", "0.6"]
    grids = ["--spacing", "0.4", "--body-spacing", "0.3", "--at-least", "1.2"]
    given = ["climb", "small-wall:1", *ends, *grids, "-o", str(tmp_path), "-q"]
    assert run_command_line(given) == OVERLOADED
    assert "NONE" in capsys.readouterr().out


@pytest.mark.slow
def test_the_demonstration_climbs_and_its_route_is_planned_again(tmp_path, capsys, monkeypatch):
    # however slow the machine is
    patient = msgspec.structs.replace(climbs.demo_request(), time=None)
    monkeypatch.setattr(climbs, "demo_request", lambda: patient)
    folder, page = tmp_path / "out", str(tmp_path / "climb.html")
    assert run_command_line(["demo", "--climb", str(folder), "--html", page, "--json"]) == 0
    reply = json.loads(capsys.readouterr().out)
    assert (reply["status"], reply["files"]["page"]) == ("found", page)
    assert 1.0 <= reply["least"] <= 1.05 * reply["bound"]
    # its first stage is given: none of another climb can hold more than its linear program says
    assert reply["deciding"]["stage"] == 0
    assert reply["bound"] <= 1.05 * reply["least"]
    moves = reply["route"]["moves"]
    assert len(moves) >= 6
    assert {move["limb"] for move in moves} == set(robosimian().limbs)
    # placements and poses of its ends are those of the grid
    assert check_bound(ClimbCertificate.read(folder / "certificate.npz")).proven
    for path in reply["files"].values():
        assert (tmp_path / path).exists()
    knots = read_trajectory(folder)
    assert len(knots) > 100
    assert all(knot.verified for knot in knots)
    again = tmp_path / "again"
    assert run_command_line(["route", str(folder / "route.json"), "-o", str(again), "--json"]) == 0
    capsys.readouterr()
    # digits of the file may lead another way through the air, but to the same end
    repeated = read_trajectory(again)
    assert all(knot.verified for knot in repeated)
    assert [knot.move for knot in repeated if knot.phase == "load"][-1:] == [len(moves)]
    np.testing.assert_allclose(repeated[-1].body.position, knots[-1].body.position, atol=1e-9)


def lines(file: Path) -> list[dict]:
    """Replies in a file, without what depends on the clock."""
    found = [json.loads(line) for line in file.read_bytes().splitlines()]
    for each in found:
        each.pop("seconds", None)
    return found


def rows(file: Path) -> list[dict]:
    with file.open(newline="") as stream:
        return [{key: each or None for key, each in row.items()} for row in csv.DictReader(stream)]


def test_the_error_of_each_rock_is_in_its_place(tmp_path, capsys):
    file = tmp_path / "climbs.jsonl"
    given = ["climb", "no-wall", "small-wall:x", "small-wall", *TINY, "--lean", "0.1"]
    assert run_command_line([*given, "-o", str(file), "--json"]) == BAD_INPUT
    said = capsys.readouterr()
    assert json.loads(said.out)["errors"] == {"invalid": 3}
    assert said.err.startswith("crux: no-wall: ")
    assert "2 more rocks are bad input: small-wall:x, small-wall" in said.err
    fields = ["ROCK", "ROCK", "--lean"]
    assert [each["error"]["field"] for each in lines(file)] == fields
    assert [each["id"] for each in lines(file)] == given[1:4]
    table = tmp_path / "climbs.csv"
    assert run_command_line([*given, "-o", str(table)]) == BAD_INPUT
    assert [row["error_field"] for row in rows(table)] == fields
    assert "error: invalid" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["a", "b", "-o", "out"], "many rocks need a file that ends in .jsonl or .csv"),
        (["a", "-o", "out", "--resume"], "--resume: requires -o FILE"),
        (["a", "-o", "out.png"], "must be a folder, or end in .jsonl"),
        (["a", "b", "-o", "b.csv", "--best-within", "x"], "--best-within: must be a part"),
        (["a.csv", "-o", "a.csv"], "a.csv is one of the rocks and would be overwritten"),
    ],
)
def test_what_is_impossible_of_all_rocks_is_refused_at_once(
    given, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert run_command_line(["climb", *TINY, *given]) == BAD_INPUT
    assert said in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def flipped_rock(file: Path, width: int = 1) -> str:
    """Write rock that faces the other way, of which each search ends at once with an error."""
    points = f"0 0 0\n0 {width} 0\n1 0 0\n1 {width} 0\n"
    file.write_text(f"OFF\n4 2 0\n{points}3 0 2 1\n3 1 2 3\n")
    return str(file)


@pytest.mark.parametrize("ending", [".jsonl", ".csv"])
@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (["--at-least", "1.9"], "--at-least"),
        (["--from", "height:0.7", "--refine", "2"], "--from (or --radius) and --refine"),
        (["--lean", "0.1"], "ROCK (or --lean)"),
        ([], "ROCK (or --lean)"),
    ],
)
def test_other_options_or_another_rock_are_no_run_to_go_on_with(
    changes, named, ending, tmp_path, capfd
):
    rock, file = tmp_path / "flipped.off", tmp_path / f"climbs{ending}"
    first = [flipped_rock(rock), *TINY, "--at-least", "1.2", "--workers", "1"]
    asked = ["climb", *first, "-o", str(file)]
    assert run_command_line(asked) == BAD_INPUT
    # the same is answered
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    assert "1 were answered before" in capfd.readouterr().out
    before = file.read_bytes()
    if not changes:
        flipped_rock(rock, 2)
    assert run_command_line([*asked, *changes, "--resume"]) == BAD_INPUT
    said = complaint(capfd)
    assert "or start again without --resume" in said
    if ending == ".jsonl":
        assert f"{file}, line 1: answers {str(rock)!r} with another {named}; give that" in said
    assert file.read_bytes() == before


def test_what_could_be_read_once_has_to_be_read_again_and_an_error_stays(tmp_path, capfd):
    rock, file = tmp_path / "flipped.off", tmp_path / "climbs.jsonl"
    asked = ["climb", str(tmp_path / "none.off"), flipped_rock(rock), *TINY, "-o", str(file)]
    assert run_command_line(asked) == BAD_INPUT
    flipped_rock(tmp_path / "none.off")
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    assert "2 were answered before" in capfd.readouterr().out
    rock.unlink()
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    said = complaint(capfd)
    assert f"line 2: answers {str(rock)!r} with another content" in said
    assert "which cannot be read now" in said


def test_lines_that_do_not_say_what_was_asked_are_not_gone_on_with(tmp_path, capfd):
    file = tmp_path / "climbs.jsonl"
    asked = ["climb", flipped_rock(tmp_path / "flipped.off"), *TINY, "-o", str(file)]
    assert run_command_line(asked) == BAD_INPUT
    (line,) = lines(file)
    assert line.pop("asked").keys() >= {"rock", "start", "goal", "places", "crux", "robot_file"}
    file.write_text(json.dumps(line, separators=(",", ":")) + "\n")
    capfd.readouterr()
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    assert "line 1: does not say what was asked" in complaint(capfd)


@pytest.mark.slow
def test_many_rocks_are_searched_in_processes_and_go_on_where_they_were_broken_off(
    tmp_path, capsys
):
    """A robot of this weight holds nothing that is vertical: the second rock is the first, so."""
    leaning, upright = "small-wall:2", tmp_path / "upright.off"
    wall = generate_wall("small-wall", 2)
    points = wall.vertices - np.array([wall.vertices[:, 0].min(), 0.0, 0.0])
    head = f"OFF\n{len(points)} {len(wall.faces)} 0\n"
    faces = np.column_stack([np.full(len(wall.faces), 3), wall.faces])
    with upright.open("w") as out:
        out.write(head)
        np.savetxt(out, points, fmt="%.6f")
        np.savetxt(out, faces, fmt="%d")
    options = [*TINY, "--best-within", "10"]
    rocks = [leaning, "no-wall", str(upright)]
    whole, file = tmp_path / "whole.jsonl", tmp_path / "climbs.jsonl"
    asked = ["climb", *rocks, *options, "-o"]
    assert run_command_line([*asked, str(whole), "--workers", "2"]) == BAD_INPUT
    shown = capsys.readouterr().out
    assert shown.index("found") < shown.index("error: invalid") < shown.index("none")
    found, wrong, none = lines(whole)
    assert (found["status"], none["status"]) == ("found", "none")
    assert wrong["error"]["field"] == "ROCK"
    assert found["robot"] == none["robot"] == "robosimian"
    assert 1.0 <= found["least"] <= found["bound"]
    assert none["least"] is None
    # half of it, and a line that was cut off
    half = ["climb", *rocks[:2], *options, "-o", str(file), "--workers", "1"]
    assert run_command_line(half) == BAD_INPUT
    with file.open("ab") as stream:
        stream.write(b'{"v":1,')
    assert run_command_line([*asked, str(file), "--resume", "--workers", "2"]) == BAD_INPUT
    assert "1 rock in" in capsys.readouterr().out
    assert lines(file) == lines(whole)
    # the verdict of one alone, and the row of it
    table = tmp_path / "climbs.csv"
    assert run_command_line(["climb", leaning, *options, "-o", str(table)]) == DONE
    (row,) = rows(table)
    for name in ("status", "robot"):
        assert row[name] == found[name]
    for name in ("least", "bound", "gap", "placements", "bodies", "knots"):
        assert float(row[name]) == found[name]
    assert int(row["moves"]) == len(found["route"]["moves"])
    assert int(row["deciding_stage"]) == found["deciding"]["stage"]
    assert row["limiting_limb"] == found["deciding"]["limiting"]["limb"]
    assert run_command_line(["climb", str(upright), *options, "-o", str(table)]) == OVERLOADED
