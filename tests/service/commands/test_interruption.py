"""Signals, kills and full disks: how commands end then, and what is left."""

from __future__ import annotations

import json
import resource
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from hand_models.base import whole_file
from service.commands.cli import run_command_line
from service.commands.stances import read_route
from service.processes import Interrupted
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import BAD_INPUT, DONE, FAILED, OVERLOADED, complaint, result
from tests.suite.helpers.processes import begun, ended, loaded, until, watched, workers
from tests.suite.helpers.requests import HEAVY, wall_request
from tests.suite.helpers.served import free_endpoint

SIGNALS = (signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow))
COUNT = 24


@pytest.fixture
def lines(tmp_path: Path) -> Path:
    """Requests that take a while each."""
    path = tmp_path / "requests.jsonl"
    asked = [wall_request(HEAVY + i) | {"id": f"r{i}"} for i in range(COUNT)]
    path.write_text("".join(json.dumps(each) + "\n" for each in asked), encoding="utf-8")
    return path


def count(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


def told(path: Path) -> list[dict]:
    """Replies without their times."""
    replies = [json.loads(line) for line in path.read_bytes().splitlines()]
    return [{key: reply[key] for key in reply if key != "time"} for reply in replies]


@watched
@pytest.mark.parametrize("number", SIGNALS)
def test_a_route_ends_with_its_processes(number, tmp_path):
    route, folder = tmp_path / "route.json", tmp_path / "climb"
    # of palms with a margin no trajectory is looked for before the stages
    asked = msgspec.to_builtins(read_route("six-moves")) | {"limits": {"palm_margin": 1.0}}
    route.write_text(json.dumps(asked), encoding="utf-8")
    process = begun("route", str(route), "-o", str(folder), "--workers", "2")
    until(lambda: workers(process), process)
    process.send_signal(number)
    assert ended(process) == (FAILED, "crux: interrupted\n")


@watched
@pytest.mark.parametrize("number", SIGNALS)
def test_a_batch_keeps_what_is_answered(number, lines, tmp_path):
    output = tmp_path / "replies.jsonl"
    process = begun("batch", str(lines), "-o", str(output), "--workers", "2")
    until(lambda: count(output) >= 2, process)
    process.send_signal(number)
    status, error = ended(process)
    replies = told(output)
    kept = f"{len(replies)} of {COUNT} requests are answered in {output}; --resume goes on"
    assert (status, error) == (FAILED, f"crux: interrupted: {kept}\n")
    assert [reply["id"] for reply in replies] == [f"r{i}" for i in range(len(replies))]


@watched
@pytest.mark.parametrize("library", ["_multiarray_umath", "clarabel", "_ckdtree"])
def test_a_signal_while_modules_are_imported(library):
    process = begun("plan", "wall", "--robust")
    until(lambda: loaded(process, library), process)
    process.send_signal(signal.SIGINT)
    assert ended(process) == (FAILED, "crux: interrupted\n")


@pytest.mark.slow
@watched
def test_processes_end_soon_after_the_command_is_killed(lines, tmp_path):
    output = tmp_path / "replies.jsonl"
    process = begun("batch", str(lines), "-o", str(output), "--workers", "2")
    until(lambda: count(output) >= 1, process)
    process.kill()
    status, error = ended(process)
    assert (status, error) == (-signal.SIGKILL, "")


@pytest.mark.slow
def test_a_batch_that_was_killed_goes_on_where_it_ended(lines, tmp_path, capfd):
    output, whole = tmp_path / "replies.jsonl", tmp_path / "whole.jsonl"
    process = begun("batch", str(lines), "-o", str(output), "--workers", "1")
    until(lambda: count(output) >= 2, process)
    process.kill()
    process.communicate()
    first = output.read_bytes()
    before = first.count(b"\n")
    assert 2 <= before < COUNT
    # a line that is cut off is done again
    output.write_bytes(first[: first.rfind(b"\n") + 1] + b'{"v":1,"id":"r')
    more = ["--resume", "--json", "--workers", "1"]
    assert run_command_line(["batch", str(lines), "-o", str(output), *more]) == OVERLOADED
    assert result(capfd)["overloaded"] == COUNT
    assert output.read_bytes().startswith(first[: first.rfind(b"\n") + 1])
    assert (
        run_command_line(["batch", str(lines), "-o", str(whole), "--json", "--workers", "1"])
        == OVERLOADED
    )
    result(capfd)
    assert told(output) == told(whole)
    # there is nothing left to do
    assert run_command_line(["batch", str(lines), "-o", str(output), *more]) == OVERLOADED
    assert result(capfd)["overloaded"] == COUNT
    assert told(output) == told(whole)


def test_a_batch_does_not_go_on_with_the_replies_of_another_or_what_is_none(lines, tmp_path, capfd):
    output = tmp_path / "replies.jsonl"
    for content, words in (
        (b'{"v": 1, "id": "other"}\n{"v"', "answers 'other', and the request is 'r0'"),
        (b"x\n", "line 1: not a reply"),
        (b"notes", "not the start of a reply"),
        (b'{"vx', "not the start of a reply"),
        (b"{}\n" * (COUNT + 1), f"has {COUNT + 1} replies, and there are {COUNT} requests"),
    ):
        output.write_bytes(content)
        assert run_command_line(["batch", str(lines), "-o", str(output), "--resume"]) == BAD_INPUT
        assert words in complaint(capfd)
        assert output.read_bytes() == content
    assert run_command_line(["batch", str(lines), "--resume"]) == BAD_INPUT
    assert "requires -o FILE" in complaint(capfd)


def limited(*arguments: str, size: int) -> tuple[int, str]:
    """A command whose files cannot grow beyond a size."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))  # noqa: E731
    process = begun(*arguments, preexec_fn=limit)
    return ended(process)


def test_a_full_disk_leaves_whole_lines_of_a_batch(lines, tmp_path):
    output = tmp_path / "replies.jsonl"
    status, error = limited("batch", str(lines), "-o", str(output), size=100_000)
    kept = f"{len(told(output))} of {COUNT} requests are answered in {output}; --resume goes on"
    assert (status, error) == (FAILED, f"crux: cannot write {output}: File too large; {kept}\n")


def test_a_batch_does_not_write_where_its_requests_come_from(lines, capfd):
    before = lines.read_bytes()
    for more in ([], ["--resume"]):
        assert run_command_line(["batch", str(lines), "-o", str(lines), *more]) == BAD_INPUT
        assert "is the file of the requests" in complaint(capfd)
    with lines.open("rb") as given:
        status, error = ended(begun("batch", "-", "-o", str(lines), stdin=given))
    assert (status, error) == (
        BAD_INPUT,
        f"crux: -o: {lines}: is the file of the requests; give another output\n",
    )
    assert lines.read_bytes() == before


@pytest.mark.slow
def test_a_full_disk_leaves_no_half_file(tmp_path):
    picture = tmp_path / "plan.png"
    status, error = limited("plan", "wall", "--plot", str(picture), size=10_000)
    assert (status, error) == (FAILED, f"crux: cannot write {picture}: File too large\n")
    status, error = limited("route", "six-moves", "-o", str(tmp_path), size=10_000)
    file = tmp_path / "trajectory.jsonl"
    assert (status, error) == (FAILED, f"crux: cannot write {file}: File too large\n")
    assert [path.name for path in tmp_path.iterdir()] == []


@pytest.mark.parametrize("more", [pytest.param([], marks=pytest.mark.slow), ["--json"]])
def test_standard_output_that_is_full(more):
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("needs /dev/full")
    with full.open("wb") as out:
        found = ended(begun("schema", *more, stdout=out))
    assert found == (FAILED, "crux: cannot write standard output: No space left on device\n")


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    path, link = tmp_path / "a.json", tmp_path / "link.json"
    path.write_text("old", encoding="utf-8")
    link.symlink_to(path)

    def interrupted() -> None:
        with whole_file(link) as part:
            part.write_text("half", encoding="utf-8")
            raise Interrupted

    with pytest.raises(Interrupted):
        interrupted()
    assert path.read_text(encoding="utf-8") == "old"
    with whole_file(link) as part:
        part.write_text("new", encoding="utf-8")
    assert link.is_symlink()
    assert path.read_text(encoding="utf-8") == "new"
    assert len(list(tmp_path.iterdir())) == 2


@watched
@pytest.mark.parametrize("number", SIGNALS)
def test_a_service_that_starts_ends_at_once_with_its_processes(number):
    process = begun("serve", "-l", free_endpoint(), "--workers", "2")
    until(lambda: workers(process), process)
    process.send_signal(number)
    # a process that has just been born may say that its parent is gone
    assert ended(process)[0] == DONE


@watched
@pytest.mark.parametrize(
    "missing",
    [*(pytest.param(m, marks=pytest.mark.slow) for m in ("<&-", ">&-", "2>&-")), "<&- >&- 2>&-"],
)
def test_standard_streams_that_are_closed_cost_nothing_but_themselves(missing):
    own = f"{shlex.quote(sys.executable)} -c 'from service.__main__ import main; main()'"
    done = subprocess.run(
        ["sh", "-c", f"{own} plan wall-300 --json {missing}"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert (done.returncode, done.stderr) == (DONE, "")
    assert (done.stdout == "") == (" >&-" in f" {missing}")


TAKING_ITS_ARGUMENTS = """
import os, signal
from numba import float64, njit, types
from numba.core import serialize
from service.processes import interruptible

@njit(float64(float64))
def more(x):
    return x + 1.0

@njit(float64(types.FunctionType(float64(float64)), float64))
def of(function, x):
    return function(x)

class Interrupting(dict):
    def __getitem__(self, key):
        if not self.sent:
            self.sent = True
            os.kill(os.getpid(), signal.SIGINT)
        return super().__getitem__(key)

with interruptible():
    of(more, 1.0)
    serialize._unpickled_memo = Interrupting(serialize._unpickled_memo)
    serialize._unpickled_memo.sent = False
    while True:
        of(more, 1.0)
"""


def test_a_signal_while_a_compiled_function_takes_its_arguments_is_answered_after_it():
    called = [sys.executable, "-W", "ignore", "-c", TAKING_ITS_ARGUMENTS]
    done = subprocess.run(
        called, capture_output=True, text=True, cwd=ROOT, timeout=300.0, check=False
    )
    assert (done.returncode, done.stderr) == (FAILED, "crux: interrupted\n")
