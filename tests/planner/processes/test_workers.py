"""Processes that are kept open: they die under their work, and nothing else is lost."""

from __future__ import annotations

import errno
import multiprocessing
import os
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from hand_models.base import THREAD_VARIABLES, CruxError
from planner.processes import starting
from planner.processes.workers import Lost, Workers
from tests.suite.helpers import workshop
from tests.suite.helpers.patience import PATIENCE, soon

forked = pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")

KILLED = "processes do not start: a worker was killed by signal 9"


def logged(log: Path) -> Counter[int]:
    return Counter(int(line.split()[0]) for line in log.read_text().splitlines())


def done(workers: Workers, items: list) -> dict:
    found: dict = {}
    for i, item in enumerate(items):
        workers.put(i, item)
    while results := workers.collect():
        found |= results
    assert sorted(found) == list(range(len(items)))
    return found


def not_started(workers: Workers) -> str:
    """What is said where no process starts."""
    with pytest.raises(CruxError) as caught:
        done(workers, [1, 2, 3])
    return caught.value.message


def processes(workers: Workers) -> list:
    return [lane.handle.process for lane in workers.hands]


def kill(workers: Workers, pid: int) -> None:
    """Kill a process from outside, and see that it is dead."""
    (process,) = (each for each in processes(workers) if each.pid == pid)
    os.kill(pid, 9)
    process.join(PATIENCE)
    assert process.exitcode == -9


@pytest.fixture(scope="module")
def nappers() -> Iterator[Workers]:
    with Workers(workshop.naps, 2) as workers:
        yield workers


def test_what_kills_its_process_is_tried_twice_and_costs_nothing_else(tmp_path):
    log = tmp_path / "log"
    with Workers(partial(workshop.squares, str(log)), 2) as workers:
        for _ in range(2):
            # nothing stays behind from one time to the next
            found = done(workers, list(range(100, 150)))
            assert [found[i] for i in range(50)] == [i * i for i in range(100, 150)]
        assert done(workers, []) == {}
        assert len({line.split()[1] for line in log.read_text().splitlines()}) <= 2
        found = done(workers, list(range(20)))
        again = done(workers, [2, 3])
    lost = {i for i, result in found.items() if isinstance(result, Lost)}
    assert lost == {13}
    assert found[13].reason == "its process died, twice; a worker was killed by signal 9"
    assert all(found[i] == i * i for i in found if i not in lost)
    # what dies once by chance is done again
    assert (logged(log)[13], logged(log)[7]) == (2, 2)
    assert again == {0: 4, 1: 9}
    alive = {process.pid for process in multiprocessing.active_children()}
    assert not alive & {int(line.split()[1]) for line in log.read_text().splitlines()}


def test_processes_that_are_killed_from_outside_cost_nothing(nappers):
    for i in range(30):
        nappers.put(i, 0.02)
    found = dict(nappers.collect())
    kill(nappers, next(iter(found.values())))
    while results := nappers.collect():
        found |= results
    assert sorted(found) == list(range(30))
    assert not any(isinstance(result, Lost) for result in found.values())
    # one that has nothing to do is replaced, too
    (first,) = done(nappers, [0.0]).values()
    kill(nappers, first)
    assert first not in done(nappers, [0.0] * 4).values()


def test_all_processes_are_ready_once_they_are_waited_for():
    with Workers(workshop.naps, 2) as workers:
        workers.wait()
        assert [lane.ready for lane in workers.hands] == [True, True]
        workers.wait()
        assert len(set(done(workers, [0.2] * 4).values())) == 2
    with Workers(workshop.nothing, 2) as workers:
        workers.wait()
        assert workers.hands == {}


def test_where_no_process_starts_that_is_told_and_nothing_hangs():
    with Workers(workshop.nothing, 2) as workers:
        assert not_started(workers) == KILLED


def test_the_guard_of_a_program_is_named_only_where_that_may_be_it(monkeypatch, caplog):
    """A process that cannot be made ready is not one whose program has no guard."""
    with Workers(workshop.fails, 2) as workers:
        reason = not_started(workers)
    assert reason == "processes do not start: a worker ended with status 70"
    assert caplog.messages == [reason]
    caplog.clear()
    monkeypatch.setattr("planner.processes.worker_handles._answer_each", workshop.exits)
    with Workers(workshop.naps, 2) as workers:
        reason = not_started(workers)
    assert reason.startswith(
        "processes do not start: a worker ended with status 1 while it started"
    )
    assert "'if __name__ == \"__main__\":'" in reason
    assert caplog.messages == [reason]


def test_what_the_system_does_not_start_is_told_in_a_line(monkeypatch, caplog):
    def refused(*_, **__):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    monkeypatch.setattr("planner.processes.workers.WorkerHandle", refused)
    reason = "processes do not start: Resource temporarily unavailable"
    with Workers(workshop.naps, 2) as workers:
        assert not_started(workers) == reason
    assert caplog.messages == [reason]


def test_processes_that_die_before_they_have_read_what_is_large_do_not_hang(monkeypatch):
    start = multiprocessing.process.BaseProcess.start

    def killed(process):
        start(process)
        process.kill()
        process.join(PATIENCE)

    monkeypatch.setattr(multiprocessing.process.BaseProcess, "start", killed)
    with Workers(partial(workshop.squares, "x" * 5_000_000), 2) as workers:
        assert not_started(workers) == KILLED


def test_each_process_does_its_linear_algebra_on_one_thread(monkeypatch):
    variables = THREAD_VARIABLES
    monkeypatch.setenv(variables[0], "7")
    monkeypatch.delenv(variables[1], raising=False)
    with Workers(workshop.threads, 1) as workers:
        assert set(done(workers, list(variables)).values()) == {"1"}
    assert os.environ[variables[0]] == "7"
    assert variables[1] not in os.environ


def test_a_process_has_the_variables_of_the_time_at_which_it_starts(monkeypatch, nappers):
    """Not those of the first that was started, from whose server it is forked."""
    nappers.wait()
    monkeypatch.setenv("CRUX_TEST", "now")
    with Workers(workshop.threads, 1) as workers:
        assert done(workers, ["CRUX_TEST"]) == {0: "now"}


def orphaned(pid: int, parent: int) -> bool:
    """Whether a process has another parent now, or has ended."""
    try:
        state, above = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:2]
    except OSError:
        return True
    return state == "Z" or int(above) != parent


@pytest.fixture
def fork_server(monkeypatch):
    """One that works: a test before may have killed that of this process, and so may this one."""
    monkeypatch.setattr(starting, "_fork_server_died", threading.Event())


@forked
@pytest.mark.usefixtures("fork_server")
def test_processes_are_forked_from_one_without_threads_that_has_loaded_the_planner():
    with Workers(workshop.forked_from, 2) as workers:
        found = done(workers, [None] * 8)
    servers = {server for _, server, _ in found.values()}
    assert all(loaded for *_, loaded in found.values())
    (server,) = servers - {os.getpid()}
    assert len(list(Path(f"/proc/{server}/task").iterdir())) == 1
    maps = Path(f"/proc/{server}/maps").read_text()
    assert "numba" in maps
    assert "zenoh" not in maps


@forked
@pytest.mark.usefixtures("fork_server")
def test_where_what_they_are_forked_from_is_killed_nothing_is_lost():
    with Workers(workshop.forked_from, 2) as workers:
        workers.wait()
        server = done(workers, [None])[0][1]
        os.kill(server, 9)
        first = [process.pid for process in processes(workers)]
        assert soon(lambda: all(orphaned(pid, server) for pid in first))
        # those that there are work on
        assert {pid for pid, *_ in done(workers, [None] * 8).values()} <= set(first)
        os.kill(first[0], 9)
        # and what dies now is replaced without it
        assert soon(lambda: first[0] not in {pid for pid, *_ in done(workers, [None] * 8).values()})
        assert not any(isinstance(each, Lost) for each in done(workers, [None] * 8).values())
        last = [process.pid for process in processes(workers)]
        assert (len(last), first[1] in last, first[0] in last) == (2, True, False)
        words = Path(f"/proc/{(set(last) - {first[1]}).pop()}/cmdline")
        # there are none yet of a process that has just been born
        assert soon(lambda: b"spawn_main" in words.read_bytes())
    # the end of the pool ends them all
    assert soon(lambda: not any(Path(f"/proc/{pid}").exists() for pid in {*first, *last}))


@pytest.mark.parametrize("error", [OSError("no address"), EOFError])
def test_where_none_can_be_forked_they_are_spawned(monkeypatch, error):
    def refused(*_):
        raise error

    monkeypatch.setattr(multiprocessing.context.ForkServerProcess, "_Popen", refused)
    starting._fork_server_works.cache_clear()
    try:
        with Workers(workshop.naps, 1) as workers:
            assert done(workers, [0.0])
            assert [type(process).__name__ for process in processes(workers)] == ["SpawnProcess"]
    finally:
        starting._fork_server_works.cache_clear()


def test_what_a_process_has_loaded_is_not_looked_through_for_garbage():
    """Nobody waits for that: of a planner it takes a quarter of a second."""
    with Workers(workshop.looked_through, 1) as workers:
        assert done(workers, [None]) == {0: False}


def test_neither_side_waits_for_the_other_to_take_what_is_large():
    """More than a pipe takes: items go out while results come back."""
    items = [bytes([i, 0]) * 400_000 for i in range(24)]
    with Workers(workshop.reversers, 1) as workers:
        found = done(workers, items)
    assert [found[i] for i in range(24)] == [item[::-1] for item in items]
