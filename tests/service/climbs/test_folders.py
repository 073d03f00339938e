"""Folders of climbs: no file of somebody else is replaced or removed, and no old one stays."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hand_models.base import InvalidInputError
from hand_models.rock import Mesh
from hand_models.scans import generate_wall, write_rock
from service.bulk import read_climb
from service.climbs import ClimbFolder
from service.commands.cli import run_command_line
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint

TINY = ["--from", "height:0.8", "--to", "height:0.8", "--stand-off", "0.6"]
TINY += ["--spacing", "0.3", "--body-spacing", "0.3", "--workers", "1"]


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def own_rock(file: Path) -> str:
    wall = generate_wall("small-wall", 2)
    write_rock(Mesh(wall.vertices, wall.faces, anywhere=True).triangles, file)
    return str(file)


@pytest.fixture
def no_search(monkeypatch):
    def seek(*_):
        raise AssertionError("the search has begun")

    monkeypatch.setattr("service.climbs.seek", seek)


@pytest.fixture(scope="module")
def climbed(tmp_path_factory, blank_pictures_of_all) -> Path:
    folder = tmp_path_factory.mktemp("climb") / "out"
    given = ["climb", "small-wall:2", *TINY, "--at-least", "1", "-o", str(folder), "-q"]
    assert run_command_line(given) == DONE
    return folder


@pytest.mark.parametrize("link", ["", "hard", "symbolic"])
def test_the_scan_of_a_user_in_the_folder_stays(link, tmp_path, no_search, capfd):
    own = tmp_path / "own"
    own.mkdir()
    given = own_rock(tmp_path / "scan.ply" if link else own / "rock.ply")
    if link == "hard":
        (own / "rock.ply").hardlink_to(given)
    elif link:
        (own / "rock.ply").symlink_to(given)
    before = contents(tmp_path)
    assert run_command_line(["climb", given, *TINY, "-o", str(own)]) == BAD_INPUT
    said = complaint(capfd)
    assert f"crux: -o: {given} (ROCK) is a file of {own} that the climb would replace" in said
    assert "name another folder" in said
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    "name", ["route.json", "stages/07-old.json", "wall.npz", "trajectory.jsonl", "crux-climb.json"]
)
def test_a_file_of_a_user_under_the_name_of_one_of_a_climb_stays(name, tmp_path, no_search, capfd):
    own = tmp_path / "own"
    (own / name).parent.mkdir(parents=True)
    (own / name).write_text("{}")
    assert run_command_line(["climb", "small-wall:2", *TINY, "-o", str(own)]) == BAD_INPUT
    assert f"crux: -o: {own} has {name}, which the climb would replace or remove" in complaint(
        capfd
    )
    assert contents(own) == {name: b"{}"}


def test_other_files_are_in_nobodys_way(tmp_path):
    others = {"scan.ply": b"ply", "stages/own.json": b"{}", "stages/07.txt": b"", "notes.md": b""}
    (tmp_path / "stages").mkdir()
    for name, text in others.items():
        (tmp_path / name).write_bytes(text)
    folder = ClimbFolder(tmp_path, {"ROCK": str(tmp_path / "scan.ply"), "--from": "height:1"})
    with folder.filling():
        (tmp_path / "rock.ply").write_bytes(b"rock")
    assert contents(tmp_path).items() >= others.items()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "name"), [("ROCK", "rock.ply"), ("--from", "stages/00-start.json")]
)
def test_what_an_earlier_climb_has_left_is_no_input_of_the_next(
    option, name, climbed, no_search, capfd
):
    file, before = str(climbed / name), contents(climbed)
    given = ["climb", "small-wall:2", *TINY]
    if option == "ROCK":
        given[1] = file
    else:
        given[given.index(option) + 1] = file
    assert run_command_line([*given, "-o", str(climbed)]) == BAD_INPUT
    assert f"-o: {file} ({option}) is a file of {climbed}" in complaint(capfd)
    assert contents(climbed) == before


def test_a_file_that_was_changed_or_added_after_a_climb_stays(tmp_path):
    with ClimbFolder(tmp_path, {}).filling():
        (tmp_path / "route.json").write_text("written")
        (tmp_path / "summary.json").write_text("written")
    ClimbFolder(tmp_path, {})
    # crux route writes it again
    (tmp_path / "summary.json").write_text("again")
    ClimbFolder(tmp_path, {})
    (tmp_path / "route.json").write_text("of a user")
    with pytest.raises(InvalidInputError, match=r"^-o: .* has route\.json, which the climb"):
        ClimbFolder(tmp_path, {})
    (tmp_path / "route.json").write_text("written")
    (tmp_path / "rock.ply").write_text("of a user")
    with pytest.raises(InvalidInputError, match=r"^-o: .* has rock\.ply, which the climb"):
        ClimbFolder(tmp_path, {})


def test_a_climb_that_was_broken_off_while_it_was_written_is_written_again(tmp_path):
    def broken_off():
        with ClimbFolder(tmp_path, {}).filling():
            (tmp_path / "route.json").write_text("written")
            (tmp_path / "stages").mkdir()
            (tmp_path / "stages" / "00-start.json").write_text("{}")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        broken_off()
    with ClimbFolder(tmp_path, {}).filling():
        pass
    assert set(contents(tmp_path)) == {"crux-climb.json"}


@pytest.mark.slow
def test_all_files_of_an_earlier_climb_go_with_it(climbed, tmp_path, capfd):
    folder = tmp_path / "out"
    shutil.copytree(climbed, folder)
    (folder / "stages" / "own.json").write_text("{}")
    before = set(contents(folder))
    given = ["climb", "small-wall:2", *TINY, "--at-least", "9", "-o", str(folder)]
    assert run_command_line(given) == OVERLOADED
    assert "NONE" in capfd.readouterr().out
    left = {"wall.npz", "wall.png", "certificate.npz", "crux-climb.json", "stages/own.json"}
    kept = {name for name in before if name.endswith(".chunks")}
    assert set(contents(folder)) == left | kept
    assert before > left | kept
    assert run_command_line(["play", str(folder)]) == BAD_INPUT
    assert "trajectory.jsonl: No such file" in complaint(capfd)


@pytest.mark.slow
def test_a_trajectory_beside_a_search_that_found_no_climb_is_not_played(climbed, tmp_path, capfd):
    folder = tmp_path / "out"
    shutil.copytree(climbed, folder)
    knots, _ = read_climb(folder)
    assert knots
    for name in ("rock.ply", "route.json", "crux-climb.json"):
        (folder / name).unlink()
    assert run_command_line(["play", str(folder)]) == BAD_INPUT
    said = complaint(capfd)
    assert f"{folder}: has a search for a climb (wall.png) that found no route.json" in said
