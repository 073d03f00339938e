"""Processes that do one kind of work, kept open; one that dies costs what it had in work at most.

Work goes out ahead and comes back as it is done. What a process had in work when it died is tried
once more: whatever kills its process then is lost, and nothing else is. (Pools of ``pebble`` do
no more work once a process has died that had none.)
"""

from __future__ import annotations

import logging
import os
from collections import deque
from collections.abc import Hashable
from multiprocessing.connection import Connection, wait
from typing import Generic, NamedTuple, Self, TypeVar, cast

from cachetools import LRUCache

from hand_models.base import CruxError
from planner.processes.worker_handles import SETTINGS, Make, PriorityLane, WorkerHandle

__all__ = ["Lost", "Workers", "cores"]

log = logging.getLogger(__name__)

Input = TypeVar("Input")
Output = TypeVar("Output")


class Lost:
    """Placeholder for a result that was lost.

    Parameters
    ----------
    reason : str
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
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Workers(Generic[Input, Output]):
    """Processes that turn items into results, while it is entered. For one caller at a time.

    Parameters
    ----------
    make : callable
        Called once in each process; returns what turns an item into its result, which is not None.
        It, items and results can be pickled. What it raises ends its process.
    count : int
        How many processes, if any.

    Attributes
    ----------
    width : int
        How many processes.
    hands : dict of PriorityLane to dict
        Tasks that each process has by their numbers, the one in work first; of those processes
        that have been started and are not known to have died.
    failed_starts : int
        Processes in a row that could not be started, or have died before they were ready.
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
        """Wait until all processes that have been started are ready, or have died."""
        for lane in [lane for lane in self.hands if not lane.ready]:
            self._take(lane)

    def put(self, number: int, item: Input, about: Hashable = None) -> None:
        """Let an item be worked on; `collect` returns its result.

        Parameters
        ----------
        number : int
            Its own.
        item : object
        about : hashable, optional
            What it is about: a process that has had something about it before is the first to get
            it, if it has room.
        """
        self._queue.append(_Task(number, item, about))

    def collect(self) -> list[tuple[int, Output | Lost]]:
        """Wait until something that was put has its result, and return all that have.

        Raises
        ------
        CruxError
            If processes do not start.
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
