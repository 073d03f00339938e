"""A service's processes: started, told from each other, replaced."""

from __future__ import annotations

import logging
import time
from multiprocessing.connection import Connection
from typing import Final

from planner import OUT_OF_MEMORY, Lane, Make, Station, resident
from service.processes import Job
from service.replies import ProcessHealth
from service.serving.question import Question
from service.wire import Answer

__all__ = ["Crew"]

log = logging.getLogger(__name__)

GRACE: Final = 0.5
"""How long beyond its deadline a process may take to say that it is over [s]."""

HANGS: Final = 30.0
"""The same of the process that has the streams: with it, they are lost [s]."""

RESTING: Final = 1.0
"""How long no process is started after one that could not be, or did not live to be ready; doubled
each time [s]."""

LONGEST_REST: Final = 30.0
"""The longest such time [s]."""

GROWN: Final = 700 * 2**20
"""Resident memory of a process that is replaced when it has nothing to do [bytes]."""

LAST_MOMENT: Final = 0.2
"""Longest time between the end of a process's pipes and its own [s]."""

STREAMS_LANES: Final = 2
"""Of the process that has the streams: one for set-points, one for what else is short."""

SET_POINTS_LANE: Final = 0


class Crew:
    """Processes that answer questions, and one that has the streams.

    Parameters
    ----------
    make : callable
        What answers, in each process.
    workers : int
        Processes that answer.
    memory : int
        Bytes that each may have.

    Attributes
    ----------
    workers : int
    work : dict of Lane to Question or None
        What each lane does.
    rests_until : float
        When processes are started again, on the clock of `time.perf_counter`.
    stillborn : int
        Processes in a row that could not be started, or died before they were ready.
    """

    def __init__(self, make: Make[Job, Answer], workers: int, memory: int) -> None:
        self._make, self.workers, self._memory = make, workers, memory
        self.work: dict[Lane[Job, Answer], Question | None] = {}
        self.rests_until = 0.0
        self.stillborn = 0
        self._streams: Station[Job, Answer] | None = None

    @property
    def stations(self) -> list[Station[Job, Answer]]:
        """The processes."""
        return list(dict.fromkeys(lane.station for lane in self.work))

    @property
    def pipes(self) -> dict[Connection, Lane[Job, Answer]]:
        """The lanes, by their pipes."""
        return {lane.pipe: lane for lane in self.work}

    @property
    def up(self) -> bool:
        """Whether questions of all kinds can be answered."""
        ready = [station for station in self.stations if station.ready]
        return self._streams in ready and len(ready) > 1

    def hire(self) -> None:
        """Start the processes that are missing; rest where the system refuses one."""
        if time.perf_counter() < self.rests_until:
            return
        try:
            if self._streams is None:
                self._streams = self._station(STREAMS_LANES)
                self.work |= dict.fromkeys(self._streams.lanes)
            for _ in range(1 + self.workers - len(self.stations)):
                self.work |= dict.fromkeys(self._station(1).lanes)
        except OSError as error:
            rest = self._rest()
            log.warning("no process can be started, again in %g s: %s", rest, error)

    def _rest(self) -> float:
        """Start none for a while, longer each time, and return how long [s]."""
        rest = min(RESTING * 2.0**self.stillborn, LONGEST_REST)
        self.rests_until = time.perf_counter() + rest
        self.stillborn += 1
        return rest

    def _station(self, lanes: int) -> Station[Job, Answer]:
        # what ends the service is for it to answer
        return Station(self._make, lanes, self._memory, stays=True)

    def has_streams(self, lane: Lane[Job, Answer]) -> bool:
        """Whether a lane is of the process that has the streams."""
        return lane.station is self._streams

    def is_for_set_points(self, lane: Lane[Job, Answer]) -> bool:
        """Whether a lane is kept for set-points."""
        return self.has_streams(lane) and lane.number == SET_POINTS_LANE

    def idle(self) -> list[Lane[Job, Answer]]:
        """Return the lanes that have nothing to do."""
        return [
            lane
            for lane, asked in self.work.items()
            # of one that has just died, its pipe tells next
            if asked is None and lane.ready and lane.station.process.is_alive()
        ]

    def dear(self) -> int:
        """Return how many processes that answer questions have one that may take long."""
        asked = [each for lane, each in self.work.items() if not self.has_streams(lane)]
        return sum(each is not None and each.dear for each in asked)

    def ends(self, lane: Lane[Job, Answer]) -> tuple[float, float]:
        """Return when the question that a lane works on, and then its process, are given up."""
        question = self.work[lane]
        assert question is not None
        late = question.deadline + GRACE
        return late, question.deadline + HANGS if self.has_streams(lane) else late

    def has_grown(self, lane: Lane[Job, Answer]) -> bool:
        """Whether a lane's process is seen to have so much memory that a new one is better."""
        size = None if self.has_streams(lane) else resident(lane.station.process.pid)
        return size is not None and size > GROWN

    def dismiss(
        self, station: Station[Job, Answer], *, dead: bool = False
    ) -> tuple[str, list[Question]]:
        """End a process; parameters as for `Station.kill`.

        Returns
        -------
        how : str
            It ended.
        left : list of Question
            That it had, and nobody has replied to.
        """
        asked = [self.work.pop(lane) for lane in station.lanes]
        if station is self._streams:
            self._streams = None
        if station.ready:
            self.stillborn = 0
        else:
            self._rest()
        left = [each for each in asked if each is not None and not each.replied]
        return _ending(station.kill(LAST_MOMENT if dead else 0.0)), left

    def left(self) -> list[Question]:
        """Return the questions in work that nobody has replied to."""
        return [each for each in self.work.values() if each is not None and not each.replied]

    def end(self) -> None:
        """End all processes."""
        for station in self.stations:
            station.kill()
        self.work.clear()

    def states(self) -> list[ProcessHealth]:
        """Return what each process does."""
        found = []
        for station in self.stations:
            busy = any(self.work[lane] is not None for lane in station.lanes)
            state = ProcessHealth(
                pid=station.process.pid,
                purpose="streams" if station is self._streams else "questions",
                state="starting" if not station.ready else "working" if busy else "idle",
                resident=resident(station.process.pid),
            )
            found.append(state)
        return found


def _ending(status: int | None) -> str:
    """Return in words how a process ended."""
    if status is None:
        return "was stopped"
    if status == OUT_OF_MEMORY:
        return "had not enough memory"
    return f"was ended by signal {-status}" if status < 0 else f"ended with status {status}"
