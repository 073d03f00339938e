"""A service's processes: started, told from each other, replaced."""

from __future__ import annotations

import logging
import time
from multiprocessing.connection import Connection
from typing import Final, Literal

from planner import Lane, Make, Station, ending_in_words, resident
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
    """Processes that answer questions, one that has the streams, and one to take a place at once.

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
    start : float
        How long the last process took to be ready [s]; zero before there is any.
    """

    def __init__(self, make: Make[Job, Answer], workers: int, memory: int) -> None:
        self._make, self.workers, self._memory = make, workers, memory
        self.work: dict[Lane[Job, Answer], Question | None] = {}
        self.rests_until = 0.0
        self.stillborn = 0
        self.start = 0.0
        self._streams: Station[Job, Answer] | None = None
        self._spare: Station[Job, Answer] | None = None
        self._starting: dict[Station[Job, Answer], float] = {}

    @property
    def stations(self) -> list[Station[Job, Answer]]:
        """The processes."""
        at_work = dict.fromkeys(lane.station for lane in self.work)
        return [*at_work] if self._spare is None else [*at_work, self._spare]

    @property
    def pipes(self) -> dict[Connection, Lane[Job, Answer]]:
        """The lanes of all processes, by their pipes."""
        return {lane.pipe: lane for station in self.stations for lane in station.lanes}

    @property
    def up(self) -> bool:
        """Whether questions of all kinds can be answered."""
        return self._streams is not None and self._streams.ready and bool(self._answering())

    def _answering(self) -> list[Station[Job, Answer]]:
        """Return the processes that answer questions and are ready."""
        at_work = dict.fromkeys(lane.station for lane in self.work)
        return [each for each in at_work if each.ready and each is not self._streams]

    def hire(self) -> None:
        """Fill places that are empty: with the one that is ready for that, or a new process.

        Where the system refuses one, none is started for a while.
        """
        try:
            if self._streams is None and (station := self._next()):
                self._streams = station
                self.work |= dict.fromkeys(station.lanes)
            has = len({lane.station for lane in self.work if not self.has_streams(lane)})
            for _ in range(self.workers - has):
                if station := self._next():
                    self.work[station.lanes[0]] = None
            if self._spare is None and self.up and len(self._answering()) == self.workers:
                self._spare = self._started()
        except OSError as error:
            rest = self._rest()
            log.warning("no process can be started, again in %g s: %s", rest, error)

    def _next(self) -> Station[Job, Answer] | None:
        """Return a process for an empty place; None while none is to be started."""
        spare, self._spare = self._spare, None
        return spare or self._started()

    def _started(self) -> Station[Job, Answer] | None:
        if time.perf_counter() < self.rests_until:
            return None
        # any process may come to have the streams; what ends the service is for it to answer
        station = Station(self._make, STREAMS_LANES, self._memory, stays=True)
        self._starting[station] = time.perf_counter()
        return station

    def came_up(self, station: Station[Job, Answer]) -> None:
        """Take note of how long a process took to be ready, if it has just become so."""
        if station.ready and (begun := self._starting.pop(station, None)) is not None:
            self.start = time.perf_counter() - begun

    def _rest(self) -> float:
        """Start none for a while, longer each time, and return how long [s]."""
        rest = min(RESTING * 2.0**self.stillborn, LONGEST_REST)
        self.rests_until = time.perf_counter() + rest
        self.stillborn += 1
        return rest

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

    def takes_dear(self) -> bool:
        """Whether a question that may take long leaves a process that is ready to the others."""
        asked = [each for lane, each in self.work.items() if not self.has_streams(lane)]
        dear = sum(each is not None and each.dear for each in asked)
        return dear < (1 if self.workers == 1 else len(self._answering()) - 1)

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
        asked = [self.work.pop(lane, None) for lane in station.lanes]
        self._starting.pop(station, None)
        if station is self._streams:
            self._streams = None
        if station is self._spare:
            self._spare = None
        if station.ready:
            self.stillborn = 0
        else:
            self._rest()
        left = [each for each in asked if each is not None and not each.replied]
        return ending_in_words(station.kill(LAST_MOMENT if dead else 0.0)), left

    def left(self) -> list[Question]:
        """Return the questions in work that nobody has replied to."""
        return [each for each in self.work.values() if each is not None and not each.replied]

    def end(self) -> None:
        """End all processes."""
        for station in self.stations:
            station.kill()
        self.work.clear()
        self._streams = self._spare = None

    def _purpose(self, station: Station[Job, Answer]) -> Literal["questions", "streams", "spare"]:
        if station is self._streams:
            return "streams"
        return "spare" if station is self._spare else "questions"

    def states(self) -> list[ProcessHealth]:
        """Return what each process does."""
        found = []
        for station in self.stations:
            busy = any(self.work.get(lane) is not None for lane in station.lanes)
            state = ProcessHealth(
                pid=station.process.pid,
                purpose=self._purpose(station),
                state="starting" if not station.ready else "working" if busy else "idle",
                resident=resident(station.process.pid),
            )
            found.append(state)
        return found
