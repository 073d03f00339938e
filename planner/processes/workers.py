"""Processes that do one kind of work, kept open; one that dies costs what it had in hand at most.

Work goes out ahead and comes back as it is done. What a process had in hand when it died is tried
once more, alone: whatever kills its process then is lost, and nothing else is.
"""

from __future__ import annotations

import logging
import math
import os
from collections import deque
from collections.abc import Callable, Hashable, Iterator, Sequence
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Final, Generic, Self, TypeVar, cast

from hand_models.base import CruxError
from planner.processes.stations import Lane, Make, Station

__all__ = ["Lost", "Workers", "cores"]

log = logging.getLogger(__name__)

T = TypeVar("T")
R = TypeVar("R")

Numbered = Lane[tuple[int, T], tuple[int, R]]
"""Of a process whose items and results have their indices with them."""

AHEAD: Final = 15
"""Most items that a process has in hand beside one: they are there before that is done."""

SHARE: Final = 4
"""These are no more than what is left by this and by the processes: less and less, so that none
waits long for the last one."""

PATIENCE: Final = 1.0
"""Longest time between the end of a process's pipe and its own [s]."""

NEXT: Final = 1
"""Items of those that were put which a process has in hand beside one."""

KNOWN: Final = 256
"""Things that items are about of which it is kept which process had them last."""

STARTS: Final = 2
"""Processes in a row that may not start, or die before they are ready; then no more are started."""

NO_GUARD: Final = (
    " while it started; a program that starts processes needs its 'if __name__ == \"__main__\":'"
)

UNCAUGHT: Final = 1
"""Status of a process whose program ends with an error."""


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
        How many processes, if any.

    Attributes
    ----------
    hands : dict of Lane to dict
        Items that each process has in hand by their numbers, the one in work first; of those
        processes that have been started and are not known to have died.
    stillborn : int
        Processes in a row that could not be started, or have died before they were ready.
    """

    def __init__(self, make: Make[T, R], count: int) -> None:
        self._make = partial(_numbered, make)
        self._count = count
        self.hands: dict[Numbered[T, R], dict[int, T]] = {}
        self.stillborn = 0
        self._line: deque[tuple[int, T, Hashable]] = deque()
        self._knows: dict[Hashable, Numbered[T, R]] = {}
        self._unborn = ""
        """Why."""

    def __enter__(self) -> Self:
        self._hire()
        return self

    def __exit__(self, *_: object) -> None:
        self._line.clear()
        for lane in list(self.hands):
            self._dismiss(lane)

    def wait(self) -> None:
        """Wait until all processes that have been started are ready, or have died."""
        for lane in [lane for lane in self.hands if not lane.ready]:
            try:
                lane.take()
                self.stillborn = 0
            except EOFError:
                self._bury(lane)

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
            while todo or again or any(self.hands.values()):
                self._hire()
                if not self.hands and (here is None or not todo):
                    for i in (*todo, *again):
                        yield i, Lost(self._unborn)
                    return
                for lane, hand in self.hands.items():
                    if not lane.ready:
                        continue
                    if again and not todo and not hand:
                        i = again.popleft()
                        self._give(lane, i, items[i])
                    share = math.ceil(len(todo) / (SHARE * self._count))
                    while todo and len(hand) <= min(AHEAD, share):
                        i = todo.popleft()
                        self._give(lane, i, items[i])
                if here is not None and todo:
                    i = todo.popleft()
                    yield i, here(items[i])
                if not self.hands:
                    continue
                owed = bool(again) or any(self.hands.values())
                block = here is None or (owed and not todo)
                lanes = {lane.pipe: lane for lane in self.hands}
                for pipe in wait(list(lanes), None if block else 0.0):
                    lane = lanes[cast(Connection, pipe)]
                    try:
                        done = lane.take()
                        self.stillborn = 0
                    except EOFError:
                        hand = self.hands[lane]
                        how = self._bury(lane)
                        for i in sorted(hand):
                            if i in tried:
                                yield i, Lost(f"its process died, twice; {how}")
                            else:
                                tried.add(i)
                                again.append(i)
                        continue
                    if done is not None:
                        del self.hands[lane][done[0]]
                        yield done
        finally:
            # what nobody waits for any more
            for lane in [lane for lane, hand in self.hands.items() if hand]:
                self._dismiss(lane)

    def put(self, number: int, item: T, about: Hashable = None) -> None:
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
        self._line.append((number, item, about))

    def collect(self) -> list[tuple[int, R | Lost]]:
        """Wait until something that was put has its result, and return all that have.

        A process that dies is replaced: what it was at work on is lost, once, and what else it had
        in hand goes to another.

        Raises
        ------
        CruxError
            If processes do not start.
        """
        found: list[tuple[int, R | Lost]] = []
        while not found and (self._line or any(self.hands.values())):
            self._hire()
            if not self.hands:
                raise CruxError(self._unborn)
            for lane in sorted(self.hands, key=lambda lane: len(self.hands[lane])):
                while self._line and lane.ready and len(self.hands[lane]) <= NEXT:
                    number, item, about = self._chosen(lane)
                    self._knows.pop(about, None)
                    self._knows[about] = lane
                    if len(self._knows) > KNOWN:
                        del self._knows[next(iter(self._knows))]
                    self._give(lane, number, item)
            lanes = {lane.pipe: lane for lane in self.hands}
            for pipe in wait(list(lanes)):
                lane = lanes[cast(Connection, pipe)]
                try:
                    done = lane.take()
                    self.stillborn = 0
                except EOFError:
                    hand = list(self.hands[lane].items())
                    lost = Lost(f"its process died; {self._bury(lane)}")
                    found += [(number, lost) for number, _ in hand[:1]]
                    self._line.extendleft((number, item, None) for number, item in hand[:0:-1])
                    continue
                if done is not None:
                    del self.hands[lane][done[0]]
                    found.append(done)
        return found

    def _chosen(self, lane: Numbered[T, R]) -> tuple[int, T, Hashable]:
        """Take what a process gets next: what it knows, or else nobody, or else what is first."""
        knows = [self._knows.get(about) for _, _, about in self._line]
        i = next((knows.index(one) for one in (lane, None) if one in knows), 0)
        chosen = self._line[i]
        del self._line[i]
        return chosen

    def _hire(self) -> None:
        while len(self.hands) < self._count and self.stillborn < STARTS:
            try:
                station = Station(self._make, ahead=True)
            except OSError as error:
                self._miss(f"processes do not start: {error.strerror or error}")
            else:
                self.hands[station.lanes[0]] = {}

    def _miss(self, why: str) -> None:
        """Count a process that did not live to be ready."""
        self.stillborn += 1
        self._unborn = why
        if self.stillborn == STARTS:
            log.warning(why)

    def _give(self, lane: Numbered[T, R], i: int, item: T) -> None:
        self.hands[lane][i] = item
        lane.give((i, item))

    def _bury(self, lane: Numbered[T, R]) -> str:
        """Dismiss a process that has died, and return how it did."""
        status = self._dismiss(lane, PATIENCE)
        how = _ending(status)
        if not lane.ready:
            # nothing of this house is at work before a process is, but the program's own beginning
            hint = NO_GUARD if status == UNCAUGHT else ""
            self._miss(f"processes do not start: {how}{hint}")
        return how

    def _dismiss(self, lane: Numbered[T, R], patience: float = 0.0) -> int | None:
        del self.hands[lane]
        self._knows = {about: one for about, one in self._knows.items() if one is not lane}
        return lane.station.kill(patience)


def _numbered(make: Make[T, R]) -> Callable[[tuple[int, T]], tuple[int, R]]:
    """Return what turns an item into its result, both with the item's index."""
    turn = make()
    return lambda asked: (asked[0], turn(asked[1]))


def _ending(status: int | None) -> str:
    """Return in words how a process ended."""
    if status is None:
        return "a worker did not answer"
    if status < 0:
        return f"a worker was killed by signal {-status}"
    return f"a worker ended with status {status}"
