"""Queues, lanes and deadlines by themselves, without a service around them."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from multiprocessing import Pipe
from types import SimpleNamespace

import pytest

from planner.processes import PriorityLane, WorkerHandle
from planner.processes.worker_handles import SETTINGS as PROCESS_SETTINGS, _send_parts
from service.processes import Job
from service.serving.dispatcher import Dispatcher
from service.serving.names import ClientNames, digest
from service.serving.question import PendingQuestion, received_question
from service.serving.settings import SERVING_SETTINGS as SETTINGS
from service.serving.shares import Shares
from service.serving.waiting import Costs, Kind, Waiting
from service.serving.worker_pool import WorkerPool
from service.wire import Answer
from tests.suite.helpers.checkout import ROOT


def question(
    place: str = "a", size: int = 10, seconds: float = 60.0, client: str | None = None
) -> PendingQuestion:
    now, payload, query = time.perf_counter(), bytes(size), SimpleNamespace()
    name = place if client is None else client
    return PendingQuestion(query, "key", "plan", name, now, payload, "", seconds, place=place)  # type: ignore[arg-type]


# Room ---------------------------------------------------------------------------------------------


def test_large_questions_of_one_client_leave_room_for_all_others():
    waiting = Waiting(Shares())

    def has_room(asked: PendingQuestion, kind: Kind = Kind.OTHER) -> bool:
        return waiting.put(kind, asked) is None

    assert has_room(question("greedy", SETTINGS.waiting_bytes_of_place))
    # by place, whatever the names
    assert not has_room(question("greedy", SETTINGS.large_payload + 1, client="other name"))
    assert all(has_room(question(client, SETTINGS.waiting_bytes_of_place)) for client in "bcd")
    assert SETTINGS.waiting_bytes == 4 * SETTINGS.waiting_bytes_of_place
    assert not has_room(question("e", SETTINGS.large_payload + 1))
    assert has_room(question("e"), Kind.SET_POINTS)
    gone = waiting.take(Kind.OTHER)
    assert gone is not None
    assert gone.client == "greedy"
    assert has_room(question("greedy", SETTINGS.waiting_bytes_of_place))
    assert has_room(question("greedy", SETTINGS.large_payload))


def test_one_question_fits_however_large_it_is():
    assert Waiting(Shares()).put(Kind.OTHER, question("a", SETTINGS.waiting_bytes + 1)) is None


@pytest.mark.parametrize("names", [9, 20, 100])
def test_however_many_names_one_place_takes_it_leaves_room_to_others(names: int):
    waiting = Waiting(Shares())
    for i in range(names):
        for _ in range(SETTINGS.waiting_of_client):
            waiting.put(Kind.OTHER, question("crowd", client=str(i)))
    assert len(waiting) == SETTINGS.waiting_in_queue
    # each has room, and the newest of those who have most go
    for client in "abcdefgh":
        gone = [
            waiting.put(Kind.OTHER, question(client)) for _ in range(SETTINGS.waiting_of_client)
        ]
        most = [each for each in gone if each is not None and each.place == client]
        assert len(waiting) == SETTINGS.waiting_in_queue
        assert len(gone) - len(most) >= SETTINGS.waiting_in_queue // 9 - 1
    places = [each.place for each in waiting]
    assert min(places.count(place) for place in set(places)) >= SETTINGS.waiting_in_queue // 9 - 1


def test_a_client_has_so_many_questions_and_no_more():
    waiting = Waiting(Shares())
    assert all(
        waiting.put(Kind.OTHER, question("a")) is None for _ in range(SETTINGS.waiting_of_client)
    )
    last = question("a")
    assert waiting.put(Kind.OTHER, last) is last
    assert waiting.put(Kind.OTHER, question("b")) is None


# Turns --------------------------------------------------------------------------------------------


def served(waiting: Waiting, shares: Shares, costs: dict[str, float], count: int) -> list[str]:
    """Places in the order in which they are next, where each has always one more question."""
    found = []
    for place in costs:
        shares.asks(place)
        waiting.put(Kind.OTHER, question(place))
    for _ in range(count):
        asked = waiting.take(Kind.OTHER)
        assert asked is not None
        shares.charge(asked.place, costs[asked.place])
        shares.asks(asked.place)
        waiting.put(Kind.OTHER, question(asked.place))
        found.append(asked.place)
    return found


@pytest.mark.parametrize("ratio", [1, 2, 3, 5, 10, 50])
def test_places_have_equal_time_and_not_equal_turns(ratio: int):
    shares = Shares()
    costs = {"short": 0.01, "long": 0.01 * ratio}
    found = served(Waiting(shares), shares, costs, 20 * (ratio + 1))
    assert abs(found.count("long") - 20) <= 1


def test_time_that_nobody_asked_for_is_not_saved_up():
    shares = Shares()
    waiting = Waiting(shares)
    served(waiting, shares, {"a": 0.1, "b": 0.1}, 100)
    for place in [place for place in "ab" for _ in range(30)]:
        waiting.put(Kind.OTHER, question(place))
    found = served(waiting, shares, {"new": 0.1, "a": 0.1, "b": 0.1}, 30)
    assert abs(found.count("new") - 10) <= 1


def test_places_and_names_of_one_place_have_their_turns():
    waiting = Waiting(Shares())
    for place in ("", "other"):
        for name in "xyz":
            for i in range(3):
                waiting.put(Kind.OTHER, question(place, client=name, size=i))
    found = [waiting.take(Kind.OTHER) for _ in range(18)]
    assert [each.place for each in found] == ["", "other"] * 9  # type: ignore[union-attr]
    for place in ("", "other"):
        own = [each for each in found if each.place == place]  # type: ignore[union-attr]
        assert [each.client for each in own] == list("xyz" * 3)  # type: ignore[union-attr]
        assert [len(each.payload) for each in own] == [0] * 3 + [1] * 3 + [2] * 3  # type: ignore[union-attr]


class Clock(SimpleNamespace):
    """Stands for `time`."""

    now = 1000.0

    def perf_counter(self) -> float:
        return self.now


def test_who_ends_a_process_pays_for_the_next_one(monkeypatch: pytest.MonkeyPatch):
    clock = Clock()
    monkeypatch.setattr("service.serving.shares.time", clock)
    shares = Shares()
    shares.start = 2.0
    waiting = Waiting(shares)
    shares.asks("killer")
    shares.ended_process("killer", 0.5)
    # alone, nobody is kept waiting for anybody
    assert waiting.put(Kind.OTHER, question("killer")) is None
    assert waiting.take(Kind.OTHER) is not None
    shares.asks("polite")
    shares.ended_process("killer", 0.5)
    waiting.put(Kind.OTHER, question("killer"))
    waiting.put(Kind.SET_POINTS, question("killer"))
    assert waiting.take(Kind.OTHER) is None
    assert waiting.held() == SETTINGS.starts_waited * 2.0
    # what ends no process is not held up by one that has ended
    assert waiting.take(Kind.SET_POINTS) is not None
    waiting.put(Kind.OTHER, question("polite"))
    assert waiting.take(Kind.OTHER).place == "polite"  # type: ignore[union-attr]
    clock.now += SETTINGS.starts_waited * 2.0
    waiting.put(Kind.OTHER, question("polite"))
    # and has less time for what it has cost
    assert waiting.take(Kind.OTHER).place == "polite"  # type: ignore[union-attr]
    assert waiting.take(Kind.OTHER).place == "killer"  # type: ignore[union-attr]


def test_who_ends_processes_does_not_wait_for_who_asks_no_more(monkeypatch: pytest.MonkeyPatch):
    clock = Clock()
    monkeypatch.setattr("service.serving.shares.time", clock)
    shares = Shares()
    shares.start = 100.0
    shares.asks("killer")
    shares.asks("polite")
    shares.ended_process("killer", 0.5)
    assert shares.waits("killer") == SETTINGS.active_time
    clock.now += SETTINGS.active_time
    assert shares.waits("killer") == 0.0
    shares.ended_process("killer", 0.5)
    shares.asks("polite")
    assert shares.waits("killer") == SETTINGS.active_time
    shares.gone("polite")
    assert shares.waits("killer") == 0.0


# Costs --------------------------------------------------------------------------------------------


def test_one_costly_question_changes_no_lane_and_cheap_ones_win_it_back():
    shares = Shares()
    for _ in range(5):
        shares.charge("a", 0.01)
    shares.charge("a", 100.0)
    assert not shares.is_dear("a")
    for _ in range(30):
        shares.charge("a", 1.0)
    assert shares.is_dear("a")
    for i in range(SETTINGS.remembered_costs):
        assert shares.is_dear("a") == (i <= SETTINGS.remembered_costs // 2)
        shares.charge("a", 0.01)


class Process:
    """Stands for one."""


def test_a_known_stance_has_its_lane_back():
    costs, process = Costs(Shares()), Process()

    def took(count: int, seconds: float) -> None:
        for _ in range(count):
            costs.took(1, process, seconds)

    took(1, 0.1)
    took(9, 0.01)
    assert costs.is_short(1)
    # some answers of a moment in which all took long
    for _ in range(5):
        took(1, 2.0)
        assert costs.is_short(1)
    took(10, 2.0)
    assert not costs.is_short(1)
    took(SETTINGS.remembered_costs // 2 + 1, 0.01)
    assert costs.is_short(1)


def test_a_stance_that_was_dear_where_it_was_new_has_the_lane_once_it_is_not():
    costs, processes = Costs(Shares()), [Process() for _ in range(3)]
    costs.took(1, processes[0], 5.0)
    costs.took(1, processes[0], 0.01)
    assert not costs.is_short(1)
    costs.took(1, processes[1], 0.1)
    assert costs.is_short(1)
    assert [costs.knows(each, 1) for each in processes] == [True, True, False]
    assert not costs.knows(processes[0], 2)


# Names --------------------------------------------------------------------------------------------


def test_only_who_is_linked_or_has_proven_a_name_has_its_place():
    names = ClientNames()
    names.linked.add("victim")
    assert names.place("victim", b"") == "victim"
    for made_up in ("x", "y", "", "victim "):
        assert names.place(made_up, b"") == ""
    assert names.is_to_prove("victim", b"secret")
    # not again at once
    assert not names.is_to_prove("victim", b"secret")
    assert not names.is_to_prove("victim", b"another")
    names.proven("victim", digest(b"secret"))
    assert names.place("victim", b"secret") == "victim"
    for forged in (b"", b"secre", b"secret ", digest(b"secret")):
        assert names.place("victim", forged) == ""
    # a second client of that session
    names.proven("victim", digest(b"mine"))
    assert names.place("victim", b"mine") == "victim"
    # behind a router
    names.proven("far", digest(b"far"))
    assert names.has_proof("far")
    assert names.place("far", b"far") == "far"
    names.gone("victim")
    assert names.place("victim", b"secret") == ""


def test_nothing_grows_with_names_that_are_made_up():
    names, shares = ClientNames(), Shares()
    for i in range(10_000):
        names.is_to_prove(str(i), b"x")
        names.proven(str(i), b"x")
        names.proven("one", str(i).encode())
        shares.asks(str(i))
    sizes = [len(names._proofs), len(names._asked), len(shares._places)]
    assert max(sizes) < 5000
    assert len(names._proofs["one"]) < 100


# Lanes --------------------------------------------------------------------------------------------


def test_an_answer_comes_in_parts_and_whole():
    # around where the last part is cut to the byte, too: it is shorter than others, be it empty
    whole = PROCESS_SETTINGS.part_bytes
    for size in (0, 10, *range(whole - 60, whole), 5 * whole, 1_000_000):
        here, there = Pipe()
        lane: PriorityLane[object, object] = PriorityLane(SimpleNamespace(), 0, here)  # type: ignore[arg-type]
        parts: list[bytes] = []
        _send_parts(SimpleNamespace(send_bytes=parts.append), b"x" * size)  # type: ignore[arg-type]
        assert all(len(part) == whole for part in parts[:-1])
        assert len(parts[-1]) < whole
        for part in parts[:-1]:
            there.send_bytes(part)
            # a process that stops now keeps nobody waiting
            assert lane.take() is None
            assert not here.poll()
        there.send_bytes(parts[-1])
        assert lane.take() == b"x" * size
        assert lane.ready


# Deadlines ----------------------------------------------------------------------------------------


def test_a_deadline_that_is_over_already_is_not_slept_through():
    pool = WorkerPool(lambda: lambda job: job, 1, 2**30)
    dispatcher = Dispatcher(pool, 10.0, "robot")
    assert dispatcher._pause() is None
    late = question(seconds=-1.0)
    dispatcher._waiting.put(Kind.OTHER, late)
    assert dispatcher._pause() == 0.0
    assert dispatcher._waiting.first_deadline() == late.deadline
    dispatcher._waiting.remove(lambda each: each is late)
    handle: WorkerHandle[Job, Answer] = WorkerHandle.__new__(WorkerHandle)
    lane: PriorityLane[Job, Answer] = PriorityLane(handle, 0, Pipe()[0])
    handle.lanes, asked = (lane,), question(seconds=-1.0)
    pool.put(handle, "questions")
    pool.work[lane] = asked
    assert dispatcher._pause() == 0.0
    pool.put(handle, "streams")
    pool.work[lane], asked.replied = asked, True
    # it was told, and its process has a while to come back
    pause = dispatcher._pause()
    assert pause is not None
    assert 0.0 < pause < math.inf


# Heads --------------------------------------------------------------------------------------------


class Payload(bytes):
    def to_bytes(self) -> bytes:
        return bytes(self)


def taken_of(payload: bytes, encoding: str, attached: bytes | None = None) -> PendingQuestion:
    query = SimpleNamespace(
        payload=Payload(payload),
        encoding=encoding,
        source_info=None,
        attachment=None if attached is None else Payload(attached),
    )
    return received_question(query, "crux/robosimian/plan", 0.0, 10.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("head", "dear"),
    [
        ('"want": ["prices", "load_factor"]', False),
        ('"want": ["prices", "robust"]', True),
        ('"want": ["prices", "spread"]', True),
        ('"objective": "min_effort"', False),
        ('"objective": "max_robust"', True),
        ('"objective": ["max_robust"]', False),
    ],
)
def test_what_takes_many_plans_is_known_by_its_head(head: str, dear: bool):
    assert taken_of(f"{{{head}}}".encode(), "application/json").dear == dear


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


def test_an_attachment_counts_too():
    taken = taken_of(b"{}", "application/json", b"x" * SETTINGS.most_attached)
    assert (taken.fault, len(taken.secret), taken.payload) == (
        None,
        SETTINGS.most_attached,
        b"{}",
    )
    refused = taken_of(b"{}", "application/json", b"x" * (SETTINGS.most_attached + 1))
    assert refused.fault is not None
    assert refused.fault.field == "attachment"
    assert (
        f"{SETTINGS.most_attached + 1} bytes; the maximum is {SETTINGS.most_attached}"
        in refused.fault.message
    )
    assert (refused.secret, refused.payload) == (b"", b"")


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
