"""Many climbs: what each comes to, in order, whatever is wrong with some of them."""

from __future__ import annotations

import csv
import json
from importlib import resources
from pathlib import Path

import msgspec
import pytest

from service.bulk import answer_all
from service.commands.cli import run_command_line
from service.commands.stances import read_route
from service.replies import RouteReply
from service.wire import ServiceName
from tests.suite.helpers.commands import BAD_INPUT, FAILED, OVERLOADED, complaint, result
from tests.suite.helpers.processes import begun, ended, until, watched, workers

BUNDLED = "six-moves"


@pytest.fixture(scope="module")
def climbs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder: the bundled route's first two moves, no route, and the same with a great load."""
    folder = tmp_path_factory.mktemp("climbs")
    route = json.loads(
        (resources.files("service") / "examples" / "routes" / f"{BUNDLED}.json").read_bytes()
    )
    route["moves"] = route["moves"][:2]
    (folder / "a.json").write_text(json.dumps(route | {"name": "short"}))
    (folder / "b.json").write_text('{"v": 1, "moves": []}')
    heavy = {"id": "mine", "name": "heavy", "load": {"mass": 400.0}}
    (folder / "c.json").write_text(json.dumps(route | heavy))
    (folder / "notes.txt").write_text("no route")
    return folder


def replies(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_bytes().splitlines()]


def rows(file: Path) -> list[dict]:
    if file.suffix == ".parquet":
        parquet = pytest.importorskip("pyarrow.parquet")
        return parquet.read_table(file).to_pylist()
    with file.open(newline="") as stream:
        return [{key: each or None for key, each in row.items()} for row in csv.DictReader(stream)]


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_routes_of_a_folder_are_answered_in_order_as_each_is_alone(climbs, tmp_path, capfd):
    file = tmp_path / "routes.jsonl"
    assert run_command_line(["route", str(climbs), BUNDLED, "--json", "-o", str(file)]) == BAD_INPUT
    out, err = capfd.readouterr()
    told = json.loads(out)
    assert (told["routes"], told["errors"]) == (4, {"invalid": 1})
    assert err.startswith(f"crux: {climbs / 'b.json'}: stance: ")
    first, wrong, heavy, bundled = replies(file)
    ids = [each["id"] for each in (first, wrong, heavy, bundled)]
    assert ids == [str(climbs / "a.json"), str(climbs / "b.json"), "mine", BUNDLED]
    assert wrong["error"]["field"] == "stance"
    assert (bundled["name"], len(bundled["stages"])) == ("six moves on a steep slab", 17)
    for reply, source in ((first, ids[0]), (heavy, str(climbs / "c.json"))):
        alone = tmp_path / reply["name"]
        run_command_line(["route", source, "-o", str(alone), "--json"])
        summary = result(capfd)
        stages = rows(alone / "stages.csv")
        assert reply["name"] == summary["route"]
        assert reply["crux"] == summary["crux"]["stage"]
        assert reply["utilisation"] == summary["crux"]["utilisation"]
        assert [each["status"] for each in reply["stages"]] == [each["status"] for each in stages]
        assert reply["load_factor"] == min(float(each["load_factor"]) for each in stages)
    assert [first["status"], heavy["status"]] == ["optimal", "overloaded"]


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_tables_of_routes_tell_what_replies_do(ending, climbs, tmp_path, capfd):
    if ending == ".parquet":
        pytest.importorskip("pyarrow.parquet")
    file, table = tmp_path / "routes.jsonl", tmp_path / f"routes{ending}"
    for each in (file, table):
        assert run_command_line(["route", str(climbs), "-o", str(each)]) == BAD_INPUT
        shown = capfd.readouterr().out
        assert "error: invalid" in shown
        assert "overloaded" in shown
    for i, (row, reply) in enumerate(zip(rows(table), replies(file), strict=True)):
        assert int(row["index"]) == i
        assert row["id"] == reply["id"]
        assert row["status"] == reply.get("status")
        if "error" in reply:
            assert row["error_field"] == reply["error"]["field"]
            assert row["crux_move"] is None
            continue
        crux = reply["stages"][reply["crux"]]
        assert int(row["stages"]) == len(reply["stages"])
        assert int(row["crux_move"]) == crux["move"]
        assert [row["crux_phase"], row["crux_limb"]] == [crux["phase"], crux["limb"]]
        assert float(row["load_factor"]) == reply["load_factor"]
        assert row["limiting_limb"] == crux["limiting"]["limb"]


@pytest.mark.parametrize("ending", [".jsonl", ".csv"])
def test_routes_go_on_where_they_were_broken_off(ending, climbs, tmp_path, capfd):
    whole, file = tmp_path / f"whole{ending}", tmp_path / f"routes{ending}"
    asked = [str(climbs / "a.json"), str(climbs / "b.json"), str(climbs / "c.json")]
    run_command_line(["route", *asked, "-o", str(whole)])
    run_command_line(["route", *asked[:2], "-o", str(file)])
    capfd.readouterr()
    with file.open("ab") as stream:
        stream.write(whole.read_bytes()[file.stat().st_size :][:5])
    assert run_command_line(["route", *asked, "-o", str(file), "--resume"]) == BAD_INPUT
    assert "1 route in" in capfd.readouterr().out.replace("2 were answered", "")
    assert file.read_bytes() == whole.read_bytes()
    # other routes are no work to go on with
    assert (
        run_command_line(["route", asked[2], *asked[:2], "-o", str(file), "--resume"]) == BAD_INPUT
    )
    assert "--resume" in complaint(capfd)


def test_a_bundled_route_is_meant_where_a_folder_has_its_name(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / BUNDLED).mkdir()
    assert run_command_line(["route", BUNDLED, "-o", BUNDLED, "--resume"]) == BAD_INPUT
    assert "--resume: requires -o FILE" in complaint(capfd)


def test_many_routes_need_a_file_and_one_a_folder(climbs, tmp_path, capfd):
    out = str(tmp_path / "out")
    for asked, told in (
        (["route", BUNDLED, BUNDLED, "-o", out], "many routes need a file that ends in .jsonl"),
        (["route", str(climbs), "-o", out], "many routes need a file"),
        (["route", BUNDLED, "-o", out, "--resume"], "--resume: requires -o FILE"),
        (["route", BUNDLED, "-o", out, "--dask", "local"], "--dask: requires -o FILE"),
        (["route", "-", BUNDLED, "-o", f"{out}.csv"], "standard input is one route"),
        (["route", str(tmp_path), "-o", f"{out}.csv"], "no file in this folder ends in .json"),
        (["route", BUNDLED, "-o", str(climbs / "notes.txt")], "notes.txt: must be a folder"),
    ):
        assert run_command_line(asked) == BAD_INPUT
        assert told in complaint(capfd)
    assert not any(tmp_path.iterdir())


def test_the_worst_route_is_the_exit_status(climbs, tmp_path):
    good, heavy, file = str(climbs / "a.json"), str(climbs / "c.json"), tmp_path / "routes.csv"
    assert run_command_line(["route", good, good, "-o", str(file), "--no-explain"]) == 0
    assert run_command_line(["route", good, heavy, "-o", str(file), "--no-explain"]) == OVERLOADED


@watched
def test_processes_are_ended_and_what_is_whole_is_kept(climbs, tmp_path):
    file = tmp_path / "routes.jsonl"
    routes = [str(climbs / "a.json"), str(climbs / "c.json")] * 40
    process = begun("route", *routes, "-o", str(file), "--workers", "2")
    until(lambda: len(workers(process)) >= 2 and file.exists() and file.stat().st_size, process)
    process.terminate()
    status, error = ended(process)
    kept = f"{len(replies(file))} of 80 routes are answered in {file}; --resume goes on"
    assert (status, error) == (FAILED, f"crux: interrupted: {kept}\n")


@pytest.mark.slow
def test_routes_are_questions_of_bulk_work_in_processes_too(climbs):
    asked = [read_route(str(climbs / name)) for name in ("a.json", "c.json")]
    here, there = (
        list(answer_all(asked, on, kind=ServiceName.ROUTE)) for on in ("here", "processes")
    )
    assert [each.payload for each in here] == [each.payload for each in there]
    first, second = (msgspec.json.decode(each.payload, type=RouteReply) for each in here)
    assert first.load_factor > 1.0 > second.load_factor
