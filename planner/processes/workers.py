"""Pool of worker processes for one kind of work, with load balancing and one retry after a crash.

Each worker gets its next item before the current item is done. The item on which a worker died is
retried once; if that kills another worker, the item is lost, and no other. (Pools of ``pebble``
stop working once an idle process has died.)
"""

from __future__ import annotations

import logging
import os
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from typing import Generic, NamedTuple, Self, TypeVar, cast

from cachetools import LRUCache

from hand_models.base import CruxError
from planner.processes.starting import SETTINGS
from planner.processes.worker_handles import Make, PriorityLane, WorkerHandle

__all__ = ["Lost", "Workers", "by_index", "cores"]

log = logging.getLogger(__name__)

Input = TypeVar("Input")
Output = TypeVar("Output")


class Lost:
    """Result of an item that was lost because it killed two workers.

    Parameters
    ----------
    reason : str
        How the second worker ended.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason


class _Task(NamedTuple, Generic[Input]):
    """An item with its number, what it is about, and whether a process has died of it."""

    number: int
    item: Input
    about: Hashable = None
    tried: bool = False


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers(Generic[Input, Output]):
    """Process pool that turns items into results; a context manager, for one thread.

    A ready worker with few items gets the next one, if possible of a subject that it has worked on
    before (an LRU cache keeps the last 256 subjects).

    Parameters
    ----------
    make : callable
        Factory that is called once in each worker and returns the function from an item to its
        result, which must not be None. Factory, items and results must be picklable. An exception
        in the worker ends it.
    count : int
        Number of workers.

    Attributes
    ----------
    width : int
        Number of workers.
    hands : dict of PriorityLane to dict
        Tasks of each running worker by their numbers; the first is in work.
    failed_starts : int
        Number of workers in succession that could not be started, or died before they were ready.
    """

    def __init__(self, make: Make[Input, Output], count: int) -> None:
        self._make, self.width = make, count
        self.hands: dict[PriorityLane[Input, Output], dict[int, _Task[Input]]] = {}
        self.failed_starts = 0
        self._queue: deque[_Task[Input]] = deque()
        self._knows: LRUCache[Hashable, PriorityLane[Input, Output]] = LRUCache(256)
        self._unborn = ""
        """Reason of the last failed start."""

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._queue.clear()
        for lane in list(self.hands):
            self._remove(lane)

    def wait(self) -> None:
        """Wait until each worker started so far is ready or has died."""
        for lane in [lane for lane in self.hands if not lane.ready]:
            self._take(lane)

    def put(self, number: int, item: Input, about: Hashable = None) -> None:
        """Queue an item; `collect` returns its result.

        Parameters
        ----------
        number : int
            Unique number of the item, by which `collect` identifies the result.
        item : object
            Argument of the function that `make` has returned in the worker.
        about : hashable, optional
            Subject of the item: a worker that had an item of this subject before is preferred, if
            it has room.
        """
        self._queue.append(_Task(number, item, about))

    def collect(self) -> list[tuple[int, Output | Lost]]:
        """Wait for at least one result, and return all results that have arrived.

        Returns
        -------
        list of (int, object)
            Number and result of each finished item; the result is a `Lost` if the item killed two
            workers. Empty if no item is queued or in work.

        Raises
        ------
        CruxError
            If workers cannot be started.
        """
        found: list[tuple[int, Output | Lost]] = []
        while not found and (self._queue or any(self.hands.values())):
            self._start()
            if not self.hands:
                raise CruxError(self._unborn)
            found = self._exchange()
        return found

    def _exchange(self) -> list[tuple[int, Output | Lost]]:
        """Give processes what they have room for, and return what comes next."""
        for lane in sorted(self.hands, key=lambda lane: len(self.hands[lane])):
            # one item beside that in work is there before that is done
            while self._queue and lane.ready and len(self.hands[lane]) <= 1:
                task = self._chosen(lane)
                self.hands[lane][task.number] = task
                lane.give(task.item)
        lanes = {lane.pipe: lane for lane in self.hands}
        ready = wait(list(lanes))
        return [each for pipe in ready for each in self._take(lanes[cast(Connection, pipe)])]

    def _take(self, lane: PriorityLane[Input, Output]) -> list[tuple[int, Output | Lost]]:
        """Return what a process has done, if anything; of one that has died, what is lost.

        What it had in work goes first in the queue again, once, and all else that it had.
        """
        try:
            done = lane.take()
        except EOFError:
            tasks = list(self.hands[lane].values())
            how = self._remove_dead(lane)
            lost = [task for task in tasks[:1] if task.tried]
            again = [task._replace(tried=True) for task in tasks[:1] if not task.tried]
            self._queue.extendleft(reversed([*again, *tasks[1:]]))
            return [(each.number, Lost(f"its process died, twice; {how}")) for each in lost]
        self.failed_starts = 0
        if done is None:
            return []
        # its lane answers one after another
        number = next(iter(self.hands[lane]))
        del self.hands[lane][number]
        return [(number, done)]

    def _chosen(self, lane: PriorityLane[Input, Output]) -> _Task[Input]:
        """Take what a process gets next: what it knows, or else nobody, or else what is first."""
        knows = [self._knows.get(task.about) for task in self._queue] if self._knows else []
        i = next((knows.index(one) for one in (lane, None) if one in knows), 0)
        task = self._queue[i]
        del self._queue[i]
        if task.about is not None:
            self._knows[task.about] = lane
        return task

    def _start(self) -> None:
        """Start processes in place of those that have died."""
        while len(self.hands) < self.width and self.failed_starts < SETTINGS.starts:
            try:
                handle = WorkerHandle(self._make)
            except OSError as error:
                self._miss(f"processes do not start: {error.strerror or error}")
            else:
                self.hands[handle.lanes[0]] = {}

    def _miss(self, why: str) -> None:
        """Count a process that could not be started, or died before it was ready."""
        self.failed_starts += 1
        self._unborn = why
        if self.failed_starts == SETTINGS.starts:
            log.warning(why)

    def _remove_dead(self, lane: PriorityLane[Input, Output]) -> str:
        """Remove a process that has died, and return how it died."""
        how = f"a worker {self._remove(lane, dead=True)}"
        if not lane.ready:
            # before a process is ready, only the program's own start-up runs in it
            hint = ""
            if lane.handle.process.exitcode == 1:  # the program has ended with an error
                hint = (
                    " while it started; a program that starts processes needs its "
                    "'if __name__ == \"__main__\":'"
                )
            self._miss(f"processes do not start: {how}{hint}")
        return how

    def _remove(self, lane: PriorityLane[Input, Output], *, dead: bool = False) -> str:
        del self.hands[lane]
        for about in [about for about, one in self._knows.items() if one is lane]:
            del self._knows[about]
        return lane.handle.kill(dead=dead)


def by_index(
    make: Callable[[], Callable[[int], Output]],
    here: Callable[[int], Output],
    count: int,
    workers: int,
) -> Iterator[tuple[int, Output]]:
    """Yield the index of each item, and its result, as it is found.

    Parameters
    ----------
    make : callable
        Factory that is called once in each process, and returns the function of an index.
    here : callable
        The same function, for this process.
    count : int
        Number of items.
    workers : int
        Number of processes; with one, all is done in this process.
    """
    left = dict.fromkeys(range(count))
    if workers > 1:
        with Workers(make, workers) as processes, suppress(CruxError):
            for i in left:
                processes.put(i, i)
            while found := processes.collect():
                for i, answer in found:
                    if not isinstance(answer, Lost):
                        del left[i]
                        yield i, answer
    # also what has cost a process, and all where none starts
    for i in left:
        yield i, here(i)
