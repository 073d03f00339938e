"""Queues, lanes and deadlines by themselves, without a service around them."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from multiprocessing import Pipe
from types import SimpleNamespace

import pytest

from planner.processes import Lane, Station
from planner.processes.stations import PART, _send_parts
from service.serving.crew import Crew
from service.serving.dispatcher import Dispatcher
from service.serving.question import LARGE, Question, take
from service.serving.waiting import HELD, SHARE, Kind, Waiting
from tests.suite.helpers.checkout import ROOT


def question(client: str = "a", size: int = 10, seconds: float = 60.0) -> Question:
    now, payload = time.perf_counter(), bytes(size)
    return Question(SimpleNamespace(), "key", "plan", client, now, payload, "", seconds)  # type: ignore[arg-type]


# Room ---------------------------------------------------------------------------------------------


def test_large_questions_of_one_client_leave_room_for_all_others():
    waiting = Waiting()
    waiting.put(Kind.OTHER, question("greedy", SHARE))
    assert not waiting.has_room(Kind.OTHER, question("greedy", LARGE + 1))
    assert waiting.has_room(Kind.OTHER, question("greedy", LARGE))
    for client in "bcd":
        waiting.put(Kind.OTHER, question(client, SHARE))
    assert HELD == 4 * SHARE
    assert not waiting.has_room(Kind.OTHER, question("e", LARGE + 1))
    assert waiting.has_room(Kind.SET_POINTS, question("e"))
    gone = waiting.take(Kind.OTHER)
    assert gone is not None
    assert gone.client == "greedy"
    assert waiting.has_room(Kind.OTHER, question("greedy", SHARE))


def test_one_question_fits_however_large_it_is():
    assert Waiting().has_room(Kind.OTHER, question("a", HELD + 1))


# Lanes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0, 10, PART - 200, PART, 5 * PART, 1_000_000])
def test_an_answer_comes_in_parts_and_whole(size: int):
    here, there = Pipe()
    lane: Lane[object, object] = Lane(SimpleNamespace(), 0, here)  # type: ignore[arg-type]
    parts: list[bytes] = []
    _send_parts(SimpleNamespace(send_bytes=parts.append), b"x" * size)  # type: ignore[arg-type]
    assert all(len(part) == PART for part in parts[:-1])
    assert len(parts[-1]) < PART
    for part in parts[:-1]:
        there.send_bytes(part)
        # a process that stops now keeps nobody waiting
        assert lane.take() is None
        assert not here.poll()
    there.send_bytes(parts[-1])
    assert lane.take() == b"x" * size
    assert lane.ready


def test_parts_are_cut_where_they_fit_to_the_byte():
    """The last one is shorter than the others, be it empty."""
    for size in range(PART - 60, PART):
        parts: list[bytes] = []
        _send_parts(SimpleNamespace(send_bytes=parts.append), b"x" * size)  # type: ignore[arg-type]
        assert b"".join(parts).count(b"x") == size
        assert len(parts[-1]) < PART


# Deadlines ----------------------------------------------------------------------------------------


def test_a_deadline_that_is_over_already_is_not_slept_through():
    crew = Crew(lambda: lambda job: job, 1, 2**30)
    dispatcher = Dispatcher(crew, 10.0, "robot")
    assert dispatcher._pause() is None
    late = question(seconds=-1.0)
    dispatcher._waiting.put(Kind.OTHER, late)
    assert dispatcher._pause() == 0.0
    assert dispatcher._waiting.overdue(time.perf_counter()) == [late]
    station = Station.__new__(Station)
    lane: Lane[object, object] = Lane(station, 0, Pipe()[0])
    crew.work[lane] = question(seconds=-1.0)  # type: ignore[index]
    assert dispatcher._pause() == 0.0
    crew.work[lane].replied = True  # type: ignore[index, union-attr]
    crew._streams = station  # type: ignore[assignment]
    # it was told, and its process has a while to come back
    pause = dispatcher._pause()
    assert pause is not None
    assert 0.0 < pause < math.inf


# Heads --------------------------------------------------------------------------------------------


class Payload(bytes):
    def to_bytes(self) -> bytes:
        return bytes(self)


def taken_of(payload: bytes, encoding: str) -> Question:
    query = SimpleNamespace(payload=Payload(payload), encoding=encoding, source_info=None)
    return take(query, "crux/robosimian/plan", 0.0, 10.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("want", "dear"), [("load_factor", False), ("robust", True), ("spread", True)]
)
def test_what_takes_many_plans_is_known_by_its_head(want: str, dear: bool):
    payload = f'{{"want": ["prices", "{want}"]}}'.encode()
    assert taken_of(payload, "application/json").dear == dear


@pytest.mark.parametrize(
    ("payload", "encoding"),
    [
        (b'{"deadline": 1e400}', "application/json"),
        (b'{"id": [1e400], "want": 1e400}', "application/json"),
        (b"\x81\xa2id\xc7\x0c\xff" + b"\xff" * 12, "application/msgpack"),
        (b"\x81\xa8deadline\xd7\xff" + b"\xff" * 8, "application/msgpack"),
        (b"\x81\xa4want\xc7\x03\xffabc", "application/msgpack"),
    ],
)
def test_a_head_with_what_is_no_number_is_left_to_a_process(payload: bytes, encoding: str):
    taken = taken_of(payload, encoding)
    assert (taken.id, taken.seconds, taken.dear) == (None, 10.0, False)
    assert taken.payload == payload


# Ends ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("ends", "status"), [("pass", 0), ("raise ValueError('first')", 1)])
def test_a_session_that_does_not_close_does_not_keep_its_process(ends: str, status: int):
    program = (
        "import time\n"
        "from service.serving import ended_in_time\n"
        "class Session:\n"
        "    def close(self): time.sleep(600)\n"
        "with ended_in_time(Session()):\n"
        "    print('work is done')\n"
        f"    {ends}\n"
        "print('not reached')\n"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert (found.returncode, found.stdout) == (status, "work is done\n")
    assert ("first" in found.stderr) == bool(status)
