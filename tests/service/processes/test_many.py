"""Many requests at once: order, errors in their places, and the command."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
import trimesh

from hand_models.base import InvalidInputError
from hand_models.rock import read_mesh
from planner.processes import cores
from service.answering import dispatch, mesh_files
from service.commands.cli import run_command_line
from service.processes import Planners, plan_many, worth
from service.replies import ErrorReply, PlanReply
from service.requests import PlanRequest
from service.wire import decode_request, schema
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.processes import ran
from tests.suite.helpers.requests import HEAVY, flat_request, plan_request, put, wall_request
from tests.suite.helpers.rocks import cylinder_mesh

MASSES = [40.0, HEAVY, 60.0, 80.0, 100.0, 55.0]


def asked(mass: float, name: str) -> PlanRequest:
    return plan_request(wall_request(mass) | {"id": name})


def mixed() -> list[PlanRequest]:
    """Good ones, with one that cannot be, one without a plan, and one without the time for one."""
    good = [asked(mass, f"number {i}") for i, mass in enumerate(MASSES)]
    unknown = msgspec.structs.replace(
        good[0], stance=msgspec.structs.replace(good[0].stance, robot="nobody")
    )
    free = plan_request(put(flat_request(), ("stance", "hands", 0, "grasp", "palm"), False))
    late = msgspec.structs.replace(good[1], deadline=1e-6)
    endless = msgspec.structs.replace(good[1], body_wrench=(math.nan,) * 6)
    return [good[0], unknown, *good[1:3], free, late, endless, object(), *good[3:]]


def summary(replies: list[PlanReply | ErrorReply]) -> list[str]:
    return [
        reply.status if isinstance(reply, PlanReply) else f"{reply.error.kind} {reply.error.field}"
        for reply in replies
    ]


EXPECTED = [
    "optimal",
    "invalid stance.robot",
    "overloaded",
    "optimal",
    "infeasible",
    "deadline deadline",
    "invalid body_wrench[0]",
    "malformed None",
    "optimal",
    "optimal",
    "optimal",
]


@pytest.fixture(scope="module")
def two() -> Iterator[Planners]:
    with Planners(2) as planners:
        yield planners


def test_errors_are_in_their_places_and_replies_in_their_order():
    seen = []
    replies = plan_many(mixed(), workers=1, progress=lambda *now: seen.append(now))
    assert summary(replies) == EXPECTED
    names = [reply.id for reply in replies if isinstance(reply, PlanReply)]
    assert names == [
        "number 0",
        "number 1",
        "number 2",
        "wall",
        *[f"number {i}" for i in (3, 4, 5)],
    ]
    assert seen == [(i, len(EXPECTED)) for i in range(1, len(EXPECTED) + 1)]


def test_each_reply_is_what_it_would_be_alone(two):
    requests = [asked(mass, str(i)) for i, mass in enumerate(MASSES)]
    for reply, request in zip(two.plan_many(requests), requests, strict=True):
        alone = dispatch.answer_plan(request)
        assert (reply.id, reply.status, reply.verified) == (request.id, alone.status, True)
        assert reply.utilisation == pytest.approx(alone.utilisation, rel=1e-9)


def test_processes_answer_as_this_process_does(two):
    seen = []
    assert summary(two.plan_many(mixed(), lambda *now: seen.append(now))) == EXPECTED
    assert sorted(seen) == seen
    assert seen[-1] == (len(EXPECTED), len(EXPECTED))
    assert two.plan_many([]) == []


def test_a_process_that_is_killed_while_it_plans_costs_no_reply(two):
    requests = [asked(50.0 + i, str(i)) for i in range(12)]
    killed = []

    def kill_one(done: int, total: int) -> None:
        if not killed:
            process, _ = multiprocessing.active_children()
            os.kill(process.pid, signal.SIGKILL)
            process.join(PATIENCE)
            killed.append(process)

    replies = two.plan_many(requests, kill_one)
    assert killed
    assert [reply.id for reply in replies] == [str(i) for i in range(12)]
    assert {reply.status for reply in replies} <= {"optimal", "overloaded"}
    # another has taken its place
    pids = [process.pid for process in multiprocessing.active_children()]
    assert len(pids) == 2
    assert killed[0].pid not in pids


def test_what_is_broken_off_is_no_answer_to_what_is_asked_next():
    def stop(done: int, total: int) -> None:
        raise KeyError(done)

    with Planners(2) as planners:
        with pytest.raises(KeyError):
            planners.plan_many([asked(50.0 + i, str(i)) for i in range(8)], stop)
        replies = planners.plan_many([asked(50.0 + i, f"next {i}") for i in range(8)])
    assert [reply.id for reply in replies] == [f"next {i}" for i in range(8)]


def test_few_requests_are_not_worth_processes():
    assert worth(499) == 1
    assert worth(500) == cores() >= 1
    assert [worth(count, 3) for count in (0, 1, 2, 4)] == [1, 1, 2, 3]


@pytest.mark.parametrize("workers", [0, -1, 1.5, "2", True])
def test_workers_are_a_whole_number(workers):
    for asked_for in (lambda: Planners(workers), lambda: plan_many([], workers=workers)):
        with pytest.raises(InvalidInputError, match="whole number of at least 1") as caught:
            asked_for()
        assert caught.value.field == "workers"


@pytest.mark.parametrize("workers", [1, 2])
def test_what_is_closed_plans_no_more(workers):
    with Planners(workers) as planners:
        pass
    before = multiprocessing.active_children()
    with pytest.raises(InvalidInputError, match="closed"):
        planners.plan_many([asked(50.0, "a")])
    assert multiprocessing.active_children() == before


def test_errors_carry_the_identifier_where_it_can_be_read():
    named = [reply.id for reply in plan_many(mixed(), workers=1) if isinstance(reply, ErrorReply)]
    assert named == ["number 0", "number 1", "number 1", None]


SCRIPT = """
from hand_models.base import CruxError
from tests.suite.helpers.requests import plan_request, wall_request
from service.processes.many import Planners, plan_many
{guard}
{body}
"""


def script(tmp_path: Path, body: str, guard: str = "") -> subprocess.CompletedProcess[str]:
    return ran(tmp_path, SCRIPT.format(guard=guard, body=body))


@pytest.mark.slow
def test_processes_that_come_too_late_are_not_heard_of(tmp_path):
    body = """
    with Planners(3) as planners:
        print(planners.plan_many([plan_request(wall_request())])[0].status)
    print(plan_many([plan_request(wall_request())], workers=3)[0].status)
"""
    found = script(tmp_path, body, 'if __name__ == "__main__":')
    assert (found.returncode, found.stdout, found.stderr) == (0, "optimal\n" * 2, "")


@pytest.mark.slow
def test_a_program_without_its_guard_is_told_so(tmp_path):
    body = """
try:
    plan_many([plan_request(wall_request())] * 20, workers=2)
except CruxError as error:
    print(error)
"""
    found = script(tmp_path, body)
    assert found.returncode == 0
    assert found.stdout.count("a program that starts processes needs its 'if __name__") == 1


# The command --------------------------------------------------------------------------------------


@pytest.fixture
def batch_file(tmp_path: Path):
    def write(*lines: object) -> str:
        path = tmp_path / "requests.jsonl"
        texts = [line if isinstance(line, str) else json.dumps(line) for line in lines]
        path.write_text("".join(text + "\n" for text in texts))
        return str(path)

    return write


GOOD = wall_request() | {"id": "a"}
OVERLOADED = wall_request(HEAVY) | {"id": "b"}
LATE = wall_request() | {"deadline": 1e-6}
BAD = {"v": 1}


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ([], 0),
        ([GOOD, GOOD], 0),
        ([GOOD, OVERLOADED], 3),
        ([GOOD, OVERLOADED, BAD], 2),
        ([LATE, GOOD, OVERLOADED, BAD], 1),
    ],
)
def test_the_exit_status_of_a_batch_is_that_of_its_worst_request(lines, code, batch_file, capfd):
    assert run_command_line(["batch", batch_file(*lines), "--workers", "1", "--json"]) == code
    out, err = capfd.readouterr()
    assert len(out.splitlines()) == len(lines)
    assert err.count("\n") == (BAD in lines)


def test_lines_are_replies_or_errors_in_order(batch_file, capfd):
    path = batch_file(GOOD, "", "{", " ", BAD | {"id": "c"}, OVERLOADED)
    assert run_command_line(["batch", path, "--workers", "1", "--json"]) == 2
    out, err = capfd.readouterr()
    replies = [json.loads(line) for line in out.splitlines()]
    assert [reply.get("status", reply.get("error", {}).get("kind")) for reply in replies] == [
        "optimal",
        "malformed",
        "invalid",
        "overloaded",
    ]
    assert [reply["id"] for reply in replies] == ["a", None, "c", "b"]
    assert err == (
        "crux: line 3: not valid JSON: Input data was truncated; 1 more line is bad input: line 5\n"
    )
    alone = dispatch.answer_plan(decode_request(msgspec.json.encode(GOOD), PlanRequest))
    assert replies[0]["utilisation"] == pytest.approx(alone.utilisation, rel=1e-9)


def test_with_a_file_the_summary_is_what_is_printed(batch_file, tmp_path, capfd):
    kept = tmp_path / "replies.jsonl"
    path = batch_file(GOOD, OVERLOADED, GOOD, LATE)
    assert run_command_line(["batch", path, "-o", str(kept), "--workers", "1", "--json"]) == 1
    told = json.loads(capfd.readouterr().out)
    assert len(kept.read_text().splitlines()) == told["requests"] == 4
    assert (told["optimal"], told["overloaded"], told["infeasible"], told["failed"]) == (2, 1, 0, 0)
    assert told["errors"] == {"deadline": 1}
    assert 0.0 < told["time"]["median"] <= told["time"]["longest"] <= told["time"]["elapsed"]
    assert run_command_line(["batch", path, "-o", str(kept), "--workers", "1"]) == 1
    out, err = capfd.readouterr()
    assert err == ""
    assert max(len(line) for line in out.splitlines() if "written:" not in line) <= 80
    cells = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.strip()}
    assert cells["optimal"][0] == "2"
    assert cells["infeasible"] == ["0", "-", "-"]
    assert cells["error:"] == ["deadline", "1", "-", "-"]
    assert run_command_line(["batch", path, "-o", str(kept), "--workers", "1", "-q"]) == 1
    assert capfd.readouterr().out.startswith("2 optimal, 1 overloaded, 1 error: deadline\n")


def test_there_is_nothing_to_export_before_a_batch_has_answered(batch_file, tmp_path, capfd):
    table = ["-o", str(tmp_path / "t.csv"), "--export"]
    assert run_command_line(["batch", batch_file(GOOD), *table]) == 2
    err = capfd.readouterr().err
    assert err == (
        f"crux: --export: {tmp_path}/t.csv.jsonl has no answers of these requests; answer some "
        "first\n"
    )


def test_a_batch_from_standard_input_goes_through_processes_of_its_own():
    lines = b"".join(msgspec.json.encode(wall_request() | {"id": str(i)}) + b"\n" for i in range(5))
    found = subprocess.run(
        [sys.executable, "-m", "service", "batch", "-", "--workers", "2", "--json"],
        input=lines,
        capture_output=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        timeout=PATIENCE,
        check=False,
    )
    assert (found.returncode, found.stderr) == (0, b"")
    assert [json.loads(line)["id"] for line in found.stdout.splitlines()] == list("01234")


@pytest.mark.parametrize("more", [["nowhere.jsonl"], ["FILE", "-o", "no/such/folder/file"]])
def test_files_that_cannot_be_read_or_written_are_bad_input(more, batch_file, capfd):
    path = batch_file(GOOD)
    assert run_command_line(["batch", *(path if part == "FILE" else part for part in more)]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("crux: ")
    assert err.count("\n") == 1


def test_what_a_deadline_leaves_unfinished_is_in_the_schema():
    assert "unfinished" in schema()["$defs"]["PlanReply"]["properties"]


def on_file(name: str = "log.ply", **more: object) -> dict:
    request = wall_request() | more
    for hand in request["stance"]["hands"]:
        hand["hold"] = {"shape": "mesh", "file": name}
    return request


@pytest.fixture
def log_file(tmp_path: Path) -> Path:
    path = tmp_path / "log.ply"
    trimesh.Trimesh(*cylinder_mesh(0.3), process=False).export(path)
    return path


def test_lines_name_mesh_files_which_are_read_once(batch_file, log_file, capfd, monkeypatch):
    read = []
    monkeypatch.setattr(mesh_files, "read_mesh", lambda path: read.append(path) or read_mesh(path))
    rocks = on_file()
    rocks["stance"]["rocks"] = {"log": {"shape": "mesh", "file": "log.ply"}}
    for hand in rocks["stance"]["hands"]:
        hand["hold"] = {"shape": "rock", "rock": "log"}
    path = batch_file(on_file(), rocks, *[on_file()] * 5, on_file("no.ply"))
    assert run_command_line(["batch", path, "--workers", "1", "--json"]) == 2
    out, err = capfd.readouterr()
    *replies, refused = (json.loads(line) for line in out.splitlines())
    assert len({reply["utilisation"] for reply in replies}) == 1
    assert refused["error"]["field"] == "stance.hands[0].hold.file"
    assert err.startswith("crux: line 8: stance.hands[0].hold.file: no such file")
    assert read == [log_file, log_file.with_name("no.ply")]


def test_a_mesh_file_that_changes_is_read_again(log_file):
    files = mesh_files.MeshFiles(log_file.parent)
    first, again = (files.whole(plan_request(on_file())).stance.hands for _ in range(2))
    assert first[0].hold.vertices is first[3].hold.vertices is again[0].hold.vertices
    trimesh.Trimesh(*cylinder_mesh(0.4), process=False).export(log_file)
    os.utime(log_file, ns=(0, log_file.stat().st_mtime_ns + 1))
    (other, *_) = files.whole(plan_request(on_file())).stance.hands
    assert other.hold.vertices != first[0].hold.vertices


def test_only_with_a_folder_requests_name_files(log_file):
    asked = [plan_request(on_file())]
    with Planners(1) as without, Planners(1, folder=log_file.parent) as within:
        (refused,), (reply,) = without.plan_many(asked), within.plan_many(asked)
    assert refused.error.field == "stance.hands[0].hold.file"
    assert reply.status == "optimal"
