"""Tables of plans: their columns, and that they go on after anything."""

from __future__ import annotations

import csv
import errno
import json
import os
import signal
import sys
from io import FileIO
from pathlib import Path

import msgspec
import pytest

from hand_models.base import InvalidInputError
from service.answering import dispatch
from service.bulk import chosen_columns, columns_of, row_of
from service.bulk.chunks import BulkSettings
from service.bulk.runs import ReplyLines
from service.commands.cli import run_command_line
from tests.service.commands.test_interruption import limited
from tests.suite.helpers.commands import BAD_INPUT, FAILED, OVERLOADED, complaint
from tests.suite.helpers.processes import begun, ended, until, watched
from tests.suite.helpers.requests import HEAVY, compliant_request, plan_request, wall_request

LIMBS = ("front_right", "rear_right", "rear_left", "front_left")
COUNT = 24
TWIST = ("vx_m", "vy_m", "vz_m", "wx_rad", "wy_rad", "wz_rad")


def needs(ending: str) -> None:
    if ending == ".parquet":
        pytest.importorskip("pyarrow")


@pytest.fixture
def lines(tmp_path: Path) -> Path:
    """Requests that take a while each, one of them impossible, and blank lines."""
    path = tmp_path / "requests.jsonl"
    asked = [wall_request(HEAVY + i) | {"id": f"r{i}"} for i in range(COUNT)]
    asked[5] = {"v": 1, "id": 'bad, "quoted"'}
    path.write_text("\n\n".join(json.dumps(each) for each in asked) + "\n", encoding="utf-8")
    return path


def content(path: Path) -> list[dict]:
    """Rows of a table as Python has them."""
    if path.suffix == ".csv":
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))
    from pyarrow import parquet

    return parquet.read_table(path).to_pylist()


def state(path: Path) -> Path:
    return path.with_name(f"{path.name}.jsonl")


def whole_rows(path: Path) -> int:
    """Rows that are whole in the state of a table; its first line says what they are of."""
    there = state(path)
    return max(there.read_bytes().count(b"\n") - 1, 0) if there.exists() else 0


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_rows_tell_what_replies_do(ending, lines, tmp_path, capfd):
    needs(ending)
    path = tmp_path / f"table{ending}"
    assert run_command_line(["batch", str(lines), "-o", str(path), "--json"]) == BAD_INPUT
    out, err = capfd.readouterr()
    assert json.loads(out)["overloaded"] == COUNT - 1
    assert err.startswith("crux: line 11: stance: ")
    rows = content(path)
    assert [int(row["index"]) for row in rows] == list(range(COUNT))
    plan = dispatch.answer_plan(plan_request(wall_request(HEAVY + 1) | {"id": "r1"}))
    row = rows[1]
    assert (row["id"], row["status"]) == ("r1", "overloaded")
    assert float(row["utilisation"]) == plan.utilisation
    assert row["limiting_limb"] == plan.limiting.limb
    assert row["limiting_limit"] == plan.limiting.limit
    for hand in plan.hands:
        tensions = [finger.tendon_tension for finger in hand.fingers]
        names = ("outer_left", "inner_left", "inner_right", "outer_right")
        assert [float(row[f"{hand.limb}_{name}_tension_N"]) for name in names] == tensions
        axes = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")
        assert [float(row[f"{hand.limb}_{axis}"]) for axis in axes] == hand.wrench
    bad = rows[5]
    assert (bad["id"], bad["status"] or None) == ('bad, "quoted"', None)
    assert (bad["error_kind"], bad["error_field"]) == ("invalid", "stance")
    assert whole_rows(path) == COUNT


def test_units_are_in_the_schema_of_parquet(lines, tmp_path, capfd):
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "table.parquet"
    run_command_line(["batch", str(lines), "-o", str(path), "--json"])
    schema = parquet.read_schema(path)
    for column in columns_of(LIMBS):
        told = {
            key.decode(): text.decode() for key, text in schema.field(column.name).metadata.items()
        }
        assert told == {"unit": column.unit, "meaning": column.meaning}
    assert schema.field("rear_left_mx_Nm").metadata[b"unit"] == "N·m".encode()


def test_columns_are_chosen_by_name_and_pattern():
    def names(wanted: str, explained: bool = False) -> list[str]:
        return [column.name for column in chosen_columns(wanted, LIMBS, explained)]

    assert names("status,id") == ["index", "id", "status"]
    assert len(names("*_tension_N")) == 1 + 16
    assert names("index") == ["index"]
    assert names("sufficient", True) == ["index", "sufficient"]
    for wrong in ("tension", "id,", "", "sufficient"):
        with pytest.raises(InvalidInputError, match="no column"):
            names(wrong)


def test_explanations_are_in_a_table_if_they_are_asked_for(lines, tmp_path, capfd):
    path = tmp_path / "table.csv"
    asked = ["batch", str(lines), "-o", str(path), "--json"]
    run_command_line([*asked, "--explain", "--columns", "irreducible,sufficient"])
    row = content(path)[0]
    plan = dispatch.answer_plan(plan_request(wall_request(HEAVY)))
    assert len(row["irreducible"].split("; ")) == len(plan.certificate.irreducible)
    assert plan.certificate.irreducible[0].limb in row["irreducible"]
    run_command_line(asked)
    assert "irreducible" not in content(path)[0]
    capfd.readouterr()
    assert run_command_line([*asked, "--columns", "sufficient"]) == BAD_INPUT
    assert ", which needs --explain" in complaint(capfd)
    assert run_command_line(["batch", str(lines), "--columns", "id"]) == BAD_INPUT
    assert "requires a table" in complaint(capfd)


@watched
@pytest.mark.parametrize(
    ("ending", "number"),
    [(".csv", signal.SIGKILL), (".parquet", signal.SIGINT)],
)
def test_what_is_ended_by_a_signal_goes_on_and_is_the_same_table(
    ending, number, lines, tmp_path, capfd
):
    needs(ending)
    whole, path = tmp_path / f"whole{ending}", tmp_path / f"table{ending}"
    assert run_command_line(["batch", str(lines), "-o", str(whole), "--json"]) == BAD_INPUT
    summary = json.loads(capfd.readouterr().out)
    process = begun("batch", str(lines), "-o", str(path), "--workers", "2")
    until(lambda: whole_rows(path) >= 2, process)
    process.send_signal(number)
    status, error = ended(process)
    rows = whole_rows(path)
    kept = f"{rows} of {COUNT} requests are answered in {state(path)}; --resume goes on"
    if number == signal.SIGINT:
        assert (status, error) == (FAILED, f"crux: interrupted: {kept}\n")
    assert not path.exists()
    # what there is can be looked at
    asked = ["batch", str(lines), "-o", str(path), "--json"]
    run_command_line([*asked, "--export"])
    assert content(path) == content(whole)[:rows]
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    assert content(path) == content(whole)
    # nothing is left to do, and the status is that of all
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    said = json.loads(capfd.readouterr().out.splitlines()[-1])
    assert {**said, "time": 0, "file": 0} == {**summary, "time": 0, "file": 0}
    assert content(path) == content(whole)


@pytest.mark.parametrize("cut", ["in the header", "in a row"])
def test_what_a_kill_has_left_half_done_is_done_again(cut, lines, tmp_path, capfd):
    whole, path = tmp_path / "whole.csv", tmp_path / "table.csv"
    for each in (whole, path):
        run_command_line(["batch", str(lines), "-o", str(each), "--json"])
    data = state(path).read_bytes().splitlines(keepends=True)
    in_row = b"".join(data[:7]) + data[7][:20]
    state(path).write_bytes(in_row if cut == "in a row" else data[0][:30])
    capfd.readouterr()
    assert (
        run_command_line(["batch", str(lines), "-o", str(path), "--json", "--resume"]) == BAD_INPUT
    )
    assert json.loads(capfd.readouterr().out)["requests"] == COUNT
    assert path.read_bytes() == whole.read_bytes()
    assert state(path).read_bytes() == state(whole).read_bytes()


def test_a_table_does_not_go_on_with_other_work(lines, tmp_path, capfd):
    path, hand = tmp_path / "table.csv", tmp_path / "hand.toml"
    hand.write_text("[hand]\nmass = { value = 2.0, unit = 'kg', source = 'measured' }\n")
    asked = ["batch", str(lines), "-o", str(path), "--json"]
    run_command_line(asked)
    before = path.read_bytes()
    for more, words in (
        (["--columns", "id"], "another columns"),
        (["--explain"], "another"),
        (["--hand", str(hand)], "another hand"),
    ):
        capfd.readouterr()
        assert run_command_line([*asked, "--resume", *more]) == BAD_INPUT
        assert words in complaint(capfd)
    text = lines.read_text()
    for other, words in (
        (text.replace("r3", "other"), "answer other requests"),
        (text[: len(text) // 2], f"has {COUNT} replies"),
    ):
        lines.write_text(other)
        assert run_command_line([*asked, "--resume"]) == BAD_INPUT
        assert words in complaint(capfd)
    # more requests after those that are answered are the same work
    lines.write_text(text + json.dumps(wall_request() | {"id": "more"}) + "\n")
    assert run_command_line([*asked, "--resume"]) == BAD_INPUT
    assert json.loads(capfd.readouterr().out)["optimal"] == 1
    assert path.read_bytes().startswith(before)
    assert [row["id"] for row in content(path)][-1] == "more"


def test_a_table_does_not_write_over_what_is_none(lines, tmp_path, capfd):
    notes, folder = tmp_path / "notes.csv", tmp_path / "notes.parquet"
    notes.write_text("notes")
    assert run_command_line(["batch", str(lines), "-o", str(notes), "--resume"]) == BAD_INPUT
    assert "not a table of crux batch or crux sweep" in complaint(capfd)
    assert notes.read_text() == "notes"
    beside = notes.with_name("notes.csv.jsonl")
    for text in ("notes\n", "notes", lines.read_text()):
        beside.write_text(text)
        # the requests themselves, too
        for asked, more in ((lines, ["--resume"]), (lines, []), (beside, [])):
            assert run_command_line(["batch", str(asked), "-o", str(notes), *more]) == BAD_INPUT
            assert "not a table of crux batch or crux sweep" in complaint(capfd)
        assert beside.read_text() == text
    folder.mkdir()
    (folder / "notes").write_text("notes")
    needs(".parquet")
    for more in ([], ["--resume"]):
        assert run_command_line(["batch", str(lines), "-o", str(folder), *more]) == BAD_INPUT
        assert "is a folder; remove it" in complaint(capfd)
    assert [path.name for path in folder.iterdir()] == ["notes"]


def test_a_table_of_an_older_version_is_begun_anew(lines, tmp_path, capfd):
    path = tmp_path / "table.csv"
    path.write_text("index,id\n")
    path.with_name("table.csv.manifest.json").write_text("{}")
    for more in (["--resume"], ["--export"]):
        assert run_command_line(["batch", str(lines), "-o", str(path), *more]) == BAD_INPUT
        assert "was started by an older version" in complaint(capfd)
    assert path.read_text() == "index,id\n"
    assert run_command_line(["batch", str(lines), "-o", str(path)]) == BAD_INPUT
    assert len(content(path)) == COUNT


def test_a_full_disk_leaves_whole_rows(lines, tmp_path, capfd):
    path = tmp_path / "table.csv"
    status, error = limited("batch", str(lines), "-o", str(path), size=8000)
    kept = f"{whole_rows(path)} of {COUNT} requests are answered in {state(path)}"
    expected = f"crux: cannot write {path}: File too large; {kept}; --resume goes on\n"
    assert (status, error) == (FAILED, expected)
    assert 0 < whole_rows(path) < COUNT
    assert (
        run_command_line(["batch", str(lines), "-o", str(path), "--json", "--resume"]) == BAD_INPUT
    )
    assert [int(row["index"]) for row in content(path)] == list(range(COUNT))


@pytest.mark.parametrize(
    ("module", "more", "words"),
    [
        ("pyarrow", ["-o", "FOLDER/table.parquet"], "pip install -e '.[parquet]'"),
        ("distributed", ["--dask", "local"], "pip install -e '.[dask]'"),
    ],
)
def test_what_is_not_installed_is_told_in_one_line(
    module, more, words, lines, tmp_path, capfd, monkeypatch
):
    for name in [module, *(name for name in sys.modules if name.startswith(f"{module}."))]:
        monkeypatch.setitem(sys.modules, name, None)
    given = [part.replace("FOLDER", str(tmp_path)) for part in more]
    assert run_command_line(["batch", str(lines), *given]) == BAD_INPUT
    assert words in complaint(capfd)


def test_a_batch_without_errors_is_overloaded_at_worst(tmp_path, capfd):
    path, table = tmp_path / "requests.jsonl", tmp_path / "table.csv"
    path.write_text(json.dumps(wall_request(HEAVY)))
    assert run_command_line(["batch", str(path), "-o", str(table), "--json"]) == OVERLOADED
    assert (
        run_command_line(["batch", str(path), "-o", str(table), "--json", "--resume"]) == OVERLOADED
    )


@pytest.mark.parametrize("name", ["keep.jsonl", "keep.csv"])
@pytest.mark.parametrize(
    ("address", "status", "told"),
    [
        ("bogus", BAD_INPUT, "--dask: must be local, or tcp://HOST:PORT of a Dask scheduler"),
        ("processes", BAD_INPUT, "got 'processes'"),
        ("tcp://127.0.0.1:9", FAILED, "0 of 24 requests are answered\n"),
    ],
)
def test_answers_stay_where_no_others_take_their_place(
    name, address, status, told, lines, tmp_path, capfd, monkeypatch
):
    pytest.importorskip("distributed")
    settings = BulkSettings(scheduler_timeout=0.5)
    monkeypatch.setattr("service.bulk.pools.BULK_SETTINGS", settings)
    path = tmp_path / name
    path.write_text("answers\n")
    assert run_command_line(["batch", str(lines), "-o", str(path), "--dask", address]) == status
    assert told in capfd.readouterr().err
    assert path.read_text() == "answers\n"


def test_a_table_that_a_full_disk_kept_from_being_written_is_exported_later(
    lines, tmp_path, capfd, monkeypatch
):
    path = tmp_path / "table.csv"

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as there:
        there.setattr("csv.writer", full)
        assert run_command_line(["batch", str(lines), "-o", str(path)]) == FAILED
    assert "--resume goes on" in complaint(capfd)
    assert not path.exists()
    run_command_line(["batch", str(lines), "-o", str(path), "--export"])
    assert len(content(path)) == COUNT
    capfd.readouterr()
    assert run_command_line(["batch", str(lines), "--export"]) == BAD_INPUT
    assert "--export: requires a table" in complaint(capfd)


def test_less_is_said_of_a_batch(lines, tmp_path, capfd):
    for quiet in ([], ["-q"]):
        run_command_line(["batch", str(lines), "-o", str(tmp_path / "t.csv"), *quiet])
        out = capfd.readouterr().out
        assert "error: invalid" in out
        assert ("───" in out) == (not quiet)
        assert f"{COUNT} requests in" in out


def test_the_values_of_a_limb_are_found_whatever_its_name():
    hand = {"limb": "arm.1", "utilisation": 0.5, "tensions": [1, 2, 3, 4], "wrench": [5.0] * 6}
    columns = columns_of(["arm.1"])
    row = row_of(json.dumps({"status": "optimal", "hands": [hand]}).encode(), columns)
    values = dict(zip((column.name for column in columns[1:]), row.values, strict=True))
    assert values["arm.1_utilisation"] == 0.5
    assert values["arm.1_inner_left_tension_N"] == 2
    assert values["arm.1_mz_Nm"] == 5.0
    assert values["limiting_limb"] is None
    assert values["arm.1_twist_vx_m"] is None


@pytest.mark.parametrize("detail", ["full", "hands"])
def test_a_table_has_where_wrists_go_and_limbs_aim(detail):
    answer = dispatch.planned(plan_request(compliant_request() | {"detail": detail}))
    columns = columns_of(LIMBS)
    row = row_of(msgspec.json.encode(answer.reply), columns)
    values = dict(zip((column.name for column in columns[1:]), row.values, strict=True))
    for hand in answer.plan.hands:
        twist = [values[f"{hand.limb}_twist_{axis}"] for axis in TWIST]
        assert twist == hand.wrist.twist.tolist()
        aim = [values[f"{hand.limb}_pose_target_{axis}"] for axis in TWIST]
        assert aim == hand.wrist.pose_target.tolist()


def test_a_table_leaves_out_displaced_hands(tmp_path, capfd):
    asked = compliant_request() | {"want": ["open_loop"], "open_loop": {"samples": 1}}
    lines, path = tmp_path / "requests.jsonl", tmp_path / "table.csv"
    lines.write_text(json.dumps(asked) + "\n", encoding="utf-8")
    run_command_line(["batch", str(lines), "-o", str(path), "--json"])
    (row,) = content(path)
    assert row["status"] == "optimal"
    assert float(row["front_left_pose_target_vx_m"]) != 0.0


class LateSignal(FileIO):
    """A file in which a signal arrives just after a line is written."""

    late = False

    def write(self, line):
        written = super().write(line)
        if self.late:
            raise KeyboardInterrupt
        return written


def test_a_line_in_the_file_is_one_that_counts_wherever_a_signal_comes(tmp_path):
    reply = b'{"v":1,"status":"optimal"}'
    run = ReplyLines(tmp_path / "replies.jsonl", shown=False, resume=False, asked=None)
    with LateSignal(run.file, "wb") as out:
        run._out = out
        run.write(b"{}", reply, 0.1)
        out.late = True
        with pytest.raises(KeyboardInterrupt):
            run.write(b"{}", reply, 0.1)
    assert run.file.read_bytes() == reply + b"\n"
    assert run.tally.count == 1
