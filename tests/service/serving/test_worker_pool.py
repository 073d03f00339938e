"""When a service's processes are started again after what did not start."""

from __future__ import annotations

import os
import re
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest
import zenoh

from service.serving import PlanService, worker_pool
from service.serving.settings import SERVING_SETTINGS, ServingSettings
from service.serving.worker_pool import WorkerPool
from service.wire import LostError
from tests.suite.helpers.odd_answers import obedient

MEMORY = 2**31


class Clock(SimpleNamespace):
    """Stands for `time`."""

    now = 1000.0

    def perf_counter(self) -> float:
        return self.now


@contextmanager
def no_file_more() -> Iterator[None]:
    """Let this process open nothing, as where it has all that it may."""
    following = os.dup(0)
    os.close(following)
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (following, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_the_rest_grows_while_no_process_can_be_started(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    monkeypatch.setattr(worker_pool, "time", clock)
    found = WorkerPool(obedient, 1, MEMORY)
    rests = []
    with no_file_more():
        for _ in range(8):
            clock.now = max(clock.now, found.rests_until)
            found.start_worker()
            rests.append(found.rests_until - clock.now)
            # nothing is tried before that is over
            found.start_worker()
            assert found.failed_starts == len(rests)
    first, longest = SERVING_SETTINGS.first_rest, SERVING_SETTINGS.longest_rest
    assert rests == [min(first * 2.0**i, longest) for i in range(8)]
    assert rests[0] < rests[-1] == longest
    assert len(caplog.messages) == 8
    # which file could not be opened is said, if one has a name
    assert re.fullmatch(
        r"no process can be started, again in 2 s: \[Errno 24\] Too many open files(: '[^']*')?",
        caplog.messages[1],
    )
    assert not found.work
    # as soon as it can be, all are there
    clock.now = found.rests_until
    found.start_worker()
    try:
        assert len(found.handles) == 2
    finally:
        found.end()


class Part(SimpleNamespace):
    """Stands for a process or one of its lanes; equal to itself alone."""

    __eq__, __hash__ = object.__eq__, object.__hash__


def handle(*, ready: bool) -> Any:
    made = Part(ready=ready)
    made.lanes = tuple(Part(handle=made, number=i) for i in range(2))
    made.process = SimpleNamespace(is_alive=lambda: True)
    return made


def pool_of(workers: int, ready: int, dear: int) -> WorkerPool:
    """A pool in which some processes are ready, and some of these have what may take long."""
    found = WorkerPool(obedient, workers, MEMORY)
    found.put(handle(ready=True), "streams")
    for i in range(workers):
        process = handle(ready=i < ready)
        found.put(process, "questions")
        if i < dear:
            found.work[process.lanes[0]] = SimpleNamespace(dear=True)  # type: ignore[assignment]
    return found


@pytest.mark.parametrize(
    ("workers", "ready", "dear", "takes"),
    [
        (1, 1, 0, True),
        (1, 1, 1, False),
        (2, 2, 0, True),
        (2, 2, 1, False),
        # the only one that is ready is left to the others
        (2, 1, 0, False),
        (3, 2, 0, True),
        (3, 2, 1, False),
        (3, 3, 1, True),
        (3, 1, 0, False),
        (8, 5, 3, True),
        (8, 5, 4, False),
    ],
)
def test_only_processes_that_are_ready_count(
    workers: int, ready: int, dear: int, takes: bool
) -> None:
    assert pool_of(workers, ready, dear).takes_dear() == takes


def test_a_service_for_which_no_process_can_be_started_says_so(
    monkeypatch: pytest.MonkeyPatch, alone: zenoh.Session
) -> None:
    tried = []

    def refused(*_: object, **__: object) -> None:
        tried.append(1)
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(worker_pool, "WorkerHandle", refused)
    monkeypatch.setattr(worker_pool, "SERVING_SETTINGS", ServingSettings(first_rest=0.05))
    with (
        pytest.raises(LostError, match="workers started"),
        PlanService(alone, make=obedient),
    ):
        pass
    # each after a rest, the last perhaps while the start is given up; not at each of its turns
    failed = SERVING_SETTINGS.failed_starts
    assert failed <= len(tried) < 2 * failed
