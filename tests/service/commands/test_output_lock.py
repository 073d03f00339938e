"""Two runs on one output: the second is refused for as long as the first one's process lives."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.commands.cli import run_command_line
from tests.suite.helpers.commands import BAD_INPUT, DONE, OVERLOADED, complaint
from tests.suite.helpers.processes import begun, until, watched
from tests.suite.helpers.requests import wall_request

COUNT = 2000

HOLDER = """
import fcntl, os, sys
lock = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
fcntl.lockf(lock, fcntl.LOCK_EX)
os.write(lock, b"%d\\n" % os.getpid())
print("locked", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def lines(tmp_path: Path) -> Path:
    path = tmp_path / "requests.jsonl"
    asked = [wall_request(1000.0 + i) | {"id": f"r{i}"} for i in range(COUNT)]
    path.write_text("".join(json.dumps(each) + "\n" for each in asked), encoding="utf-8")
    return path


@pytest.fixture
def few(tmp_path: Path) -> Path:
    path = tmp_path / "few.jsonl"
    path.write_text(json.dumps(wall_request()) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def hold_lock() -> Iterator[Callable[[Path], subprocess.Popen[bytes]]]:
    """Another process that has a lock, for as long as it lives."""
    processes: list[subprocess.Popen[bytes]] = []

    def hold(path: Path) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, "-c", HOLDER, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        processes.append(process)
        assert process.stdout.readline() == b"locked\n"
        return process

    yield hold
    for process in processes:
        process.kill()
        process.communicate()


@watched
@pytest.mark.parametrize("name", ["replies.jsonl", "table.csv"])
def test_the_second_of_two_runs_is_refused_until_the_first_is_killed(name, lines, tmp_path, capfd):
    output, lock = tmp_path / name, tmp_path / f".{name}.lock"
    first = begun("batch", str(lines), "-o", str(output), "--workers", "2", stderr=None)
    until(lambda: lock.exists() and lock.read_text().strip() and lines_there(output), first)
    for more in ([], ["--resume"]):
        assert run_command_line(["batch", str(lines), "-o", str(output), *more]) == BAD_INPUT
        assert complaint(capfd) == (
            f"crux: -o: {output}: another run (process {first.pid}) is writing there; wait until "
            "it has ended, or give another output\n"
        )
    assert first.poll() is None
    os.kill(first.pid, signal.SIGKILL)
    first.wait()
    assert lock.exists()
    few = lines.with_name("few.jsonl")
    few.write_text(lines.read_text("utf-8").partition("\n")[0] + "\n", encoding="utf-8")
    assert run_command_line(["batch", str(few), "-o", str(output)]) == OVERLOADED
    assert not lock.exists()


def lines_there(output: Path) -> bool:
    return output.exists() or output.with_name(f"{output.name}.jsonl").exists()


def commands(few: Path, rock: Path, folder: Path) -> dict[str, tuple[list[str], Path]]:
    """Commands on an output, and the lock that each has."""
    coarse = ["--spacing", "0.2", "--angles", "1", "--outer-rotation", "0", "--robust", "0"]
    table, replies, out = folder / "t.csv", folder / "r.jsonl", folder / "out"
    sweep = ["sweep", "wall-300", "--vary", "load.mass=100:120:2"]
    return {
        "batch, a table": (["batch", str(few), "-o", str(table)], folder / ".t.csv.lock"),
        "batch, replies": (["batch", str(few), "-o", str(replies)], folder / ".r.jsonl.lock"),
        "batch, resumed": (
            ["batch", str(few), "-o", str(replies), "--resume"],
            folder / ".r.jsonl.lock",
        ),
        "sweep": ([*sweep, "-o", str(out)], out / ".crux.lock"),
        "route": (["route", "six-moves", "-o", str(out)], out / ".crux.lock"),
        "routes": (["route", "six-moves", "-o", str(replies)], folder / ".r.jsonl.lock"),
        "holds": (
            ["holds", str(rock), "-o", str(folder / "h.json"), *coarse, "--workers", "1"],
            folder / ".h.json.lock",
        ),
        "rock": (
            ["rock", str(rock), "-o", str(folder / "rock.ply")],
            folder / ".rock.ply.lock",
        ),
        "demo": (["demo", "-o", str(folder / "d.png")], folder / ".d.png.lock"),
        "demo, a climb": (["demo", "--climb", str(out)], out / ".crux.lock"),
        "advice": (["plan", "wall-300", "--advice", str(out)], out / ".crux.lock"),
        "picture": (["plan", "wall-300", "--plot", str(folder / "p.svg")], folder / ".p.svg.lock"),
        "page": (["plan", "wall-300", "--html", str(folder / "p.html")], folder / ".p.html.lock"),
        "study": (["study", "fig06", "-o", str(out)], out / ".crux.lock"),
    }


NAMES = tuple(commands(Path(), Path(), Path()))
LONG = ("route", "routes", "demo", "demo, a climb", "advice", "picture", "page", "study")


@pytest.mark.parametrize("name", NAMES)
def test_every_command_that_fills_an_output_has_it_alone(
    name, few, rock, tmp_path, hold_lock, capfd
):
    words, lock = commands(few, rock, tmp_path)[name]
    lock.parent.mkdir(exist_ok=True)
    there = {*lock.parent.iterdir()}
    holder = hold_lock(lock)
    assert run_command_line(words) == BAD_INPUT
    assert f"another run (process {holder.pid}) is writing there" in complaint(capfd)
    assert {*lock.parent.iterdir()} == {*there, lock}  # nothing was written
    if name in LONG:
        return
    holder.kill()
    holder.wait()
    assert run_command_line(words) == DONE
    assert not lock.exists()


def test_another_name_of_the_file_is_the_same_output(few, tmp_path, hold_lock, capfd):
    (tmp_path / "real.jsonl").touch()
    (tmp_path / "link.jsonl").symlink_to("real.jsonl")
    hold_lock(tmp_path / ".real.jsonl.lock")
    assert run_command_line(["batch", str(few), "-o", str(tmp_path / "link.jsonl")]) == BAD_INPUT
    assert "another run" in complaint(capfd)


def test_other_outputs_in_the_folder_are_free_and_what_a_killed_run_left_is_no_lock(
    few, tmp_path, hold_lock
):
    hold_lock(tmp_path / ".a.jsonl.lock")
    lock = tmp_path / ".b.jsonl.lock"
    lock.write_text("1\n")
    assert run_command_line(["batch", str(few), "-o", str(tmp_path / "b.jsonl")]) == DONE
    assert not lock.exists()


def test_a_run_that_fails_leaves_no_lock(few, tmp_path, monkeypatch):
    def broken(*_: object, **__: object) -> None:
        raise OSError(5, "no more", "here")

    monkeypatch.setattr("service.commands.batch.answer_rest", broken)
    assert run_command_line(["batch", str(few), "-o", str(tmp_path / "a.jsonl")]) == 1
    assert [*tmp_path.glob(".*.lock")] == []


@pytest.mark.skipif(not Path("/dev/null").exists(), reason="no /dev/null")
def test_a_device_is_not_locked(few, capfd):
    assert run_command_line(["batch", str(few), "-o", "/dev/null"]) == DONE
    assert not Path("/dev/.null.lock").exists()
    capfd.readouterr()


def test_a_system_without_locks_says_so(few, tmp_path, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, "fcntl", None)
    output = tmp_path / "a.jsonl"
    assert run_command_line(["batch", str(few), "-o", str(output)]) == DONE
    told = f"crux: this system has no locks: no other run may write {output} now\n"
    assert capfd.readouterr().err == told
    assert len(output.read_text("utf-8").splitlines()) == 1
