"""`crux sweep`: what it writes and prints, its exit status, and what is left when it is ended."""

from __future__ import annotations

import csv
import signal
from pathlib import Path

import pytest

from service.bulk import answer_all
from service.commands.cli import run_command_line
from service.processes import Interrupted
from service.wire import LostError, encode_error
from tests.service.commands.test_interruption import limited
from tests.suite.helpers.commands import BAD_INPUT, DONE, FAILED, complaint, result
from tests.suite.helpers.processes import begun, ended, until, watched, workers

MASS = "load.mass=60:120:4"
WEAK = '[tendon]\nmaximum_tension = { value = 60.0, unit = "N", source = "assumed" }\n'


def test_a_sweep_writes_a_table_and_a_picture(tmp_path, capfd):
    folder = tmp_path / "new" / "there"
    for _ in range(2):
        # a folder that is there is written again
        assert (
            run_command_line(["sweep", "wall-300", "--vary", MASS, "-o", str(folder), "--json"])
            == DONE
        )
        told = result(capfd)
        assert told["points"] == told["answered"] == 4
        assert told["statuses"]["optimal"] == 3
        assert told["variations"][0]["unit"] == "kg"
        (border,) = told["borders"]
        assert 100.0 < border["holds"] < border["fails"] < 120.0
        assert told["files"] == {
            "table": str(folder / "sweep.csv"),
            "picture": str(folder / "sweep.png"),
        }
    with (folder / "sweep.csv").open(encoding="utf-8", newline="") as file:
        assert [float(line["load.mass [kg]"]) for line in csv.DictReader(file)] == [
            60.0,
            80.0,
            100.0,
            120.0,
        ]
    assert (folder / "sweep.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vary", MASS], ["load.mass [kg]", "3 optimal", "holds up to load.mass = 115"]),
        (
            ["--vary", MASS, "--vary", "hands.front_left.surface.shear_limit=20:80:13"],
            ["holds for load.mass [kg]", "up to 90.0"],
        ),
        (["--vary", MASS, "--samples", "5", "--seed", "1"], ["5 points"]),
        (["--vary", "load.mass=200:300:3"], ["holds nowhere from 200 to 300 of load.mass [kg]"]),
        (["--vary", "hands.*.surface=rock,sandpaper-36"], ["sandpaper-36", "overloaded"]),
        (
            ["--vary", "hands.front_left.grasp.closing_tension=1,40"],
            ["invalid", "no answer at some points", "must be at least"],
        ),
    ],
)
def test_what_is_printed_fits_a_terminal(arguments, words, tmp_path, capfd, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run_command_line(["sweep", "wall-300", *arguments, "-o", str(tmp_path)]) == DONE
    out, err = capfd.readouterr()
    assert err == ""
    for each in words:
        assert each in out
    sentences = ("no answer", "table:", "picture:", "holds")
    table = [line for line in out.splitlines() if not line.startswith(sentences)]
    assert max(map(len, table)) <= 80


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vary", "load.mas=1:2:3"], "--vary load.mas: load has no 'mas'; known are mass, com"),
        (["--vary", "load.mass=2:1:3"], "--vary load.mass: LOW must be below HIGH"),
        (["--vary", "load.mass=1:2:1"], "COUNT must be from 2"),
        (["--vary", MASS, "--seed", "1"], "--seed: requires --samples"),
        (["--vary", MASS, "--samples", "0"], "--samples"),
        (["--vary", MASS, "--tolerance", "nan"], "--tolerance"),
        (
            ["--vary", MASS, "--vary", "limits.tendon_tension=40,50", "--tolerance", "0.1"],
            "--tolerance: requires exactly one varied field, and numbers as its values; varied: ",
        ),
        (
            ["--vary", MASS, "--over", "load.mass"],
            "--over: requires two varied fields; only load.mass varies: vary another too",
        ),
        (
            ["--vary", MASS, "--vary", "limits.utilisation=0.5,1", "--over", "load.mass,x"],
            "--over: two different ones of load.mass, limits.utilisation are wanted",
        ),
        (["--vary", MASS, "--vary", MASS], "--vary load.mass: is given twice; vary the field once"),
        ([], "--vary"),
        (["--vary", "hands.*.grasp.closing_tension=1,2"], "no point can be answered: invalid: "),
    ],
)
def test_bad_input_is_a_line(arguments, words, tmp_path, capfd):
    given = ["sweep", "wall-300", *arguments, "-o", str(tmp_path / "out"), "--json"]
    assert run_command_line(given) == BAD_INPUT
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert words in err


def test_a_file_is_no_folder(tmp_path, capfd):
    file = tmp_path / "file"
    file.write_text("mine", encoding="utf-8")
    assert run_command_line(["sweep", "wall-300", "--vary", MASS, "-o", str(file)]) == BAD_INPUT
    assert "is a file" in complaint(capfd)
    assert file.read_text(encoding="utf-8") == "mine"


def test_numbers_of_a_hand_of_ones_own_count(tmp_path, capfd):
    weak = tmp_path / "weak.toml"
    weak.write_text(WEAK, encoding="utf-8")
    used = []
    for more in ([], ["--hand", str(weak)]):
        given = ["sweep", "wall-300", "--vary", "load.mass=100,110", "-o", str(tmp_path / "out")]
        assert run_command_line([*given, "--json", *more]) == DONE
        used.append(result(capfd)["most_utilisation"]["utilisation"])
    assert used[1] > used[0]


def test_a_point_that_is_lost_is_a_failure(tmp_path, capfd, monkeypatch):

    def losing(questions, **options):
        for i, answer in enumerate(answer_all(questions, **options)):
            lost = encode_error(LostError("its process died"), options["form"])
            yield lost if i == 1 else answer

    monkeypatch.setattr("service.sweeping.rows.answer_all", losing)
    values = "load.mass=60,80,100"
    assert (
        run_command_line(["sweep", "wall-300", "--vary", values, "-o", str(tmp_path), "--json"])
        == FAILED
    )
    told = result(capfd)
    assert told["errors"] == {"lost": 1}
    assert (told["points"], told["answered"]) == (3, 2)


def test_what_is_answered_is_kept(tmp_path, capfd, monkeypatch):

    def interrupted(questions, **options):
        yield next(answer_all(questions, **options))
        raise Interrupted

    monkeypatch.setattr("service.sweeping.rows.answer_all", interrupted)
    with pytest.raises(Interrupted) as caught:
        run_command_line(["sweep", "wall-300", "--vary", MASS, "-o", str(tmp_path)])
    table = tmp_path / "sweep.csv"
    assert str(caught.value) == f"1 of 4 points are answered in {table}.jsonl; --resume goes on"
    assert whole_rows(tmp_path) == 1
    assert not (tmp_path / "sweep.png").exists()


@watched
def test_a_sweep_ends_with_its_processes(tmp_path):
    varied = ["--vary", "load.mass=60:120:100", "--vary", "body.position.0=-1:0:20"]
    process = begun("sweep", "wall-300", *varied, "-o", str(tmp_path), "--workers", "2")
    until(lambda: workers(process), process)
    process.send_signal(signal.SIGINT)
    status, error = ended(process)
    assert status == FAILED
    assert error.startswith("crux: interrupted")
    assert error.count("\n") == 1


WIDE = ["--vary", "load.mass=60:140:30", "--vary", "body.position.0=-0.06:0.06:40"]

STOPPING = """
import itertools, threading
from service.sweeping import rows

answer_all = rows.answer_all

def first(questions, **options):
    yield from itertools.islice(answer_all(questions, **options), 400)
    print("400 are answered", flush=True)
    threading.Event().wait()

rows.answer_all = first
"""
"""What makes a sweep stop after 400 points, and stay until it is killed."""


def whole_rows(folder: Path) -> int:
    """Points that are whole in the state of a sweep; its first line says what they are of."""
    path = folder / "sweep.csv.jsonl"
    return max(path.read_bytes().count(b"\n") - 1, 0) if path.exists() else 0


@pytest.mark.slow
@watched
def test_a_sweep_that_is_killed_goes_on_and_no_point_is_asked_twice(tmp_path, capfd, monkeypatch):
    whole, folder = tmp_path / "whole", tmp_path / "broken"
    assert run_command_line(["sweep", "wall-300", *WIDE, "-o", str(whole), "--json"]) == DONE
    summary = result(capfd)
    process = begun(
        "sweep", "wall-300", *WIDE, "-o", str(folder), "--workers", "2", before=STOPPING
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"400 are answered\n"
    process.kill()
    ended(process)
    done = whole_rows(folder)
    assert 0 < done <= 400
    assert not (folder / "sweep.csv").exists()
    # a row that is cut off, as a kill in the middle of writing leaves it
    with (folder / "sweep.csv.jsonl").open("ab") as file:
        file.write(b'{"values":["60.0')
    asked = []

    def counting(questions, **options):
        questions = list(questions)
        asked.extend(questions)
        return answer_all(questions, **options)

    monkeypatch.setattr("service.sweeping.rows.answer_all", counting)
    again = ["sweep", "wall-300", *WIDE, "-o", str(folder), "--json", "--resume"]
    assert run_command_line(again) == DONE
    assert len(asked) == 1200 - done
    told = result(capfd)
    assert told | {"files": 0} == summary | {"files": 0}
    assert (folder / "sweep.csv").read_bytes() == (whole / "sweep.csv").read_bytes()
    assert whole_rows(folder) == 1200
    assert (folder / "sweep.png").exists()
    # nothing is left to do
    assert run_command_line(again) == DONE
    assert len(asked) == 1200 - done
    assert (folder / "sweep.csv").read_bytes() == (whole / "sweep.csv").read_bytes()


@pytest.mark.parametrize(
    "values",
    [MASS, "hands.front_left.grasp.closing_tension=1,40"],
)
def test_what_is_read_again_is_told_as_before(values, tmp_path, capfd):
    given = ["sweep", "wall-300", "--vary", values, "-o", str(tmp_path)]
    assert run_command_line(given) == DONE
    printed = capfd.readouterr().out
    assert run_command_line([*given, "--resume"]) == DONE
    assert capfd.readouterr().out == printed
    tables = [
        run_command_line([*given, "--json", *more]) or result(capfd) for more in ([], ["--resume"])
    ]
    assert tables[0] == tables[1]


@pytest.mark.parametrize(
    ("began", "others"),
    [
        (
            [MASS],
            {
                "another --vary ('load.mass=60:120:4'": ["load.mass=60:120:5"],
                "now 'gravity.2=-9:-8:4')": ["gravity.2=-9:-8:4"],
                "another hand": [MASS, "--hand", "weak.toml"],
            },
        ),
        (
            [MASS, "--samples", "4"],
            {
                "another --samples ('4 of seed 0'": [MASS],
                "('4 of seed 0', now '4 of seed 2')": [MASS, "--samples", "4", "--seed", "2"],
            },
        ),
    ],
)
def test_a_sweep_does_not_go_on_as_another(began, others, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("weak.toml").write_text(WEAK, encoding="utf-8")
    assert run_command_line(["sweep", "wall-300", "--vary", *began, "-o", "out", "--json"]) == DONE
    before = Path("out/sweep.csv").read_bytes()
    capfd.readouterr()
    for words, now in others.items():
        again = ["sweep", "wall-300", "--vary", *now, "-o", "out", "--resume"]
        assert run_command_line(again) == BAD_INPUT
        assert words in complaint(capfd)
        assert Path("out/sweep.csv").read_bytes() == before


def test_a_sweep_does_not_go_on_with_another_stance_or_what_is_none(tmp_path, capfd):
    given = ["--vary", MASS, "-o", str(tmp_path)]
    assert run_command_line(["sweep", "wall-300", *given, "--json"]) == DONE
    capfd.readouterr()
    assert run_command_line(["sweep", "wall-700", *given, "--resume"]) == BAD_INPUT
    assert "was started with another stance; give that again, or start again" in complaint(capfd)
    lines = tmp_path / "sweep.csv.jsonl"
    lines.write_text(lines.read_text().replace('"optimal",', ""))
    assert run_command_line(["sweep", "wall-300", *given, "--resume"]) == BAD_INPUT
    assert "not a row of this table" in complaint(capfd)
    lines.unlink()
    assert run_command_line(["sweep", "wall-300", *given, "--resume"]) == BAD_INPUT
    assert "not a table of crux batch or crux sweep" in complaint(capfd)
    # one that never began begins
    assert (
        run_command_line(
            ["sweep", "wall-300", "--vary", MASS, "-o", str(tmp_path / "new"), "--resume"]
        )
        == 0
    )


def test_a_sweep_goes_on_after_a_full_disk(tmp_path, capfd):
    folder = tmp_path / "out"
    varied = ["--vary", "load.mass=60:120:40", "-o", str(folder)]
    status, error = limited("sweep", "wall-300", *varied, size=2000)
    table = folder / "sweep.csv"
    done = whole_rows(folder)
    kept = f"{done} of 40 points are answered in {table}.jsonl; --resume goes on"
    assert 0 < done < 40
    assert (status, error) == (FAILED, f"crux: cannot write {table}: File too large; {kept}\n")
    assert run_command_line(["sweep", "wall-300", *varied, "--json", "--resume"]) == DONE
    assert result(capfd)["answered"] == 40
    with table.open(encoding="utf-8", newline="") as file:
        masses = [float(line["load.mass [kg]"]) for line in csv.DictReader(file)]
    assert masses == sorted(masses)
    assert len(masses) == 40
