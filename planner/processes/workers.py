"""Processes that do one kind of work, kept open; one that dies costs what it had in hand at most.

Work goes out in chunks and comes back as it is done. What a process had in hand when it died is
tried once more, alone: whatever kills its process then is lost, and nothing else is.
"""

from __future__ import annotations

import logging
import math
import os
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from typing import Any, Final, Generic, Self, TypeVar

from planner.processes.child_processes import begin_child, spawned

__all__ = ["Lost", "Worker", "Workers", "cores"]

log = logging.getLogger(__name__)

T = TypeVar("T")
R = TypeVar("R")

CHUNK: Final = 8
"""Most items that go out together."""

SHARE: Final = 4
"""What goes out together is what is left by this and by the processes: less and less, so that none
waits long for the last one."""

FLUSH: Final = 0.05
"""How long results wait for the rest of their chunk [s]."""

PATIENCE: Final = 1.0
"""How long processes that are to end may take [s]."""

STARTS: Final = 2
"""Processes in a row that may die before they are ready; after that no more are started."""

NO_GUARD: Final = (
    " while it started; a program that starts processes needs its 'if __name__ == \"__main__\":'"
)

UNCAUGHT: Final = 1
"""Status of a process whose program ends with an error."""

UNREADY: Final = 70
"""Status of a process that cannot be made ready for its work."""


class Lost:
    """Takes the place of a result that there is none of.

    Parameters
    ----------
    reason : str
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers(Generic[T, R]):
    """Processes that turn items into results, while it is entered. For one caller at a time.

    Parameters
    ----------
    make : callable
        Called once in each process; returns what turns an item into its result. It, items and
        results can be pickled. What it raises ends its process.
    count : int
        How many processes.

    Attributes
    ----------
    running : list of Worker
        Those that have been started and are not known to have died.
    stillborn : int
        Processes in a row that have died before they were ready.
    """

    def __init__(self, make: Callable[[], Callable[[T], R]], count: int) -> None:
        self._make = make
        self._count = max(1, count)
        self.running: list[Worker[T, R]] = []
        self.stillborn = 0
        self._unborn = ""
        """Why."""

    def __enter__(self) -> Self:
        self._hire()
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        for worker in self.running:
            worker.pipe.close()
        until = time.monotonic() + (PATIENCE if error is None else 0.0)
        for worker in self.running:
            worker.end(until)
        self.running.clear()

    def wait(self) -> None:
        """Wait until all processes that have been started are ready, or have died."""
        for worker in [worker for worker in self.running if not worker.ready]:
            if worker.take() is None:
                self._bury(worker)
            else:
                self.stillborn = 0

    def each(
        self, items: Sequence[T], here: Callable[[T], R] | None = None
    ) -> Iterator[tuple[int, R | Lost]]:
        """Yield each item's index and result, as they are done.

        Parameters
        ----------
        items : sequence
        here : callable, optional
            What this process turns items into results with meanwhile, so that nothing waits for
            processes to start; it does not try what has cost a process. By default it does none.
        """
        todo = deque(range(len(items)))
        tried: set[int] = set()
        again: deque[int] = deque()
        try:
            while todo or again or any(worker.hand for worker in self.running):
                self._hire()
                if not self.running and (here is None or not todo):
                    for i in (*todo, *again):
                        yield i, Lost(self._unborn)
                    return
                for worker in self.running:
                    if worker.idle and again and not todo:
                        worker.give([(i := again.popleft(), items[i])])
                    # the next ones are there before these are done
                    while worker.wants and todo:
                        size = min(CHUNK, math.ceil(len(todo) / (SHARE * self._count)))
                        chunk = [todo.popleft() for _ in range(size)]
                        worker.give([(i, items[i]) for i in chunk])
                if here is not None and todo:
                    i = todo.popleft()
                    yield i, here(items[i])
                if not self.running:
                    continue
                owed = bool(again) or any(worker.hand for worker in self.running)
                block = owed and not todo if here is not None else True
                for pipe in wait([worker.pipe for worker in self.running], None if block else 0.0):
                    worker = next(each for each in self.running if each.pipe is pipe)
                    done = worker.take()
                    if done is not None:
                        self.stillborn = 0
                        yield from done
                        continue
                    how = self._bury(worker)
                    for i in sorted(worker.hand):
                        if i in tried:
                            yield i, Lost(f"its process died, twice; {how}")
                        else:
                            tried.add(i)
                            again.append(i)
        finally:
            # what nobody waits for any more
            for worker in [worker for worker in self.running if worker.hand]:
                self._dismiss(worker)

    def _hire(self) -> None:
        while len(self.running) < self._count and self.stillborn < STARTS:
            self.running.append(Worker(self._make))

    def _bury(self, worker: Worker[T, R]) -> str:
        """Dismiss a process that has died, and return how it did."""
        worker.process.join(PATIENCE)
        status = worker.process.exitcode
        how = _ending(status)
        if not worker.ready:
            self.stillborn += 1
            # nothing of this house is at work before a process is, but the program's own beginning
            hint = NO_GUARD if status == UNCAUGHT else ""
            self._unborn = f"processes do not start: {how}{hint}"
            if self.stillborn == STARTS:
                log.warning(self._unborn)
        self._dismiss(worker)
        return how

    def _dismiss(self, worker: Worker[T, R]) -> None:
        self.running.remove(worker)
        worker.pipe.close()
        worker.process.kill()
        worker.process.join()


def _ending(status: int | None) -> str:
    """Return in words how a process ended."""
    if status is None:
        return "a worker did not answer"
    if status < 0:
        return f"a worker was killed by signal {-status}"
    return f"a worker ended with status {status}"


class Worker(Generic[T, R]):
    """One process, and what it has in hand.

    Parameters
    ----------
    make : callable
        As in `Workers`.

    Attributes
    ----------
    process : Process
    pipe : Connection
        To it.
    ready : bool
        Whether it has said that it can work.
    hand : set of int
        Indices of the items that it has not returned.
    """

    def __init__(self, make: Callable[[], Callable[[T], R]]) -> None:
        self.process, (self.pipe,) = spawned(_work, make)
        self.ready = False
        self.hand: set[int] = set()
        self._last: set[int] = set()

    @property
    def idle(self) -> bool:
        """Whether it waits for work."""
        return self.ready and not self.hand

    @property
    def wants(self) -> bool:
        """Whether it has no more in hand than the chunk that it was given last."""
        return self.ready and self.hand <= self._last

    def give(self, chunk: list[tuple[int, T]]) -> None:
        """Send a chunk of work."""
        self._last = {i for i, _ in chunk}
        self.hand |= self._last
        # of a process that has died, its pipe tells next
        with suppress(OSError):
            self.pipe.send(chunk)

    def take(self) -> list[tuple[int, R]] | None:
        """Return the results that have come; None if the process has died."""
        try:
            done: list[tuple[int, R]] = self.pipe.recv()
        except (EOFError, OSError):
            return None
        self.ready = True
        self.hand -= {i for i, _ in done}
        return done

    def end(self, until: float) -> None:
        """Let the process come to its end, and kill it if it is not there in time or not ready."""
        if self.ready:
            self.process.join(max(0.0, until - time.monotonic()))
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


def _work(pipes: list[Connection]) -> None:
    """Do chunks of work until nobody sends any more; what a process of `Workers` runs."""
    begin_child()
    (pipe,) = pipes
    try:
        make: Callable[[], Callable[[Any], Any]] = pipe.recv()
    except (EOFError, OSError):
        return
    try:
        turn = make()
    except BaseException:
        traceback.print_exc()
        sys.exit(UNREADY)
    chunks: SimpleQueue[list[tuple[int, Any]] | None] = SimpleQueue()
    # who sends must not wait for the chunk before to be done, nor for its results to be taken
    threading.Thread(target=_receive, args=(pipe, chunks), daemon=True).start()
    with suppress(OSError):
        pipe.send([])
        while (chunk := chunks.get()) is not None:
            done: list[tuple[int, Any]] = []
            flushed = time.monotonic()
            for i, item in chunk:
                done.append((i, turn(item)))
                if time.monotonic() > flushed + FLUSH:
                    pipe.send(done)
                    done, flushed = [], time.monotonic()
            if done:
                pipe.send(done)


def _receive(pipe: Connection, chunks: SimpleQueue[Any]) -> None:
    """Take chunks in as they come, and nothing at their end."""
    try:
        with suppress(EOFError, OSError):
            while True:
                chunks.put(pipe.recv())
    finally:
        chunks.put(None)
