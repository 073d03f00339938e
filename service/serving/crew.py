"""Start the processes of a service, give each a purpose, and replace them."""

from __future__ import annotations

import logging
import time
from multiprocessing.connection import Connection
from typing import Final, Literal

from planner import Lane, Make, Station, resident
from service.processes import Job
from service.replies import ProcessHealth
from service.serving.question import PendingQuestion
from service.wire import Answer

__all__ = ["Crew"]

log = logging.getLogger(__name__)

GRACE: Final = 0.5
"""How long beyond its deadline a process may take to say that it is over [s]."""

HANGS: Final = 30.0
"""The same of the process that has the streams: with it, they are lost [s]."""

RESTING: Final = 1.0
"""Pause after a process that did not start or died before it was ready, until another is started;
doubled each time [s]."""

LONGEST_REST: Final = 30.0
"""Longest such pause [s]."""

GROWN: Final = 700 * 2**20
"""Resident memory of a process that is replaced when it has nothing to do [bytes]."""

STREAMS_LANES: Final = 2
"""Lanes of the process that has the streams: one for set-points, one for what else is short."""

SET_POINTS_LANE: Final = 0

Purpose = Literal["questions", "streams", "spare"]


class Crew:
    """Processes that answer questions, one that has the streams, and a spare for an empty place.

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
    failed_starts : int
        Processes in a row that could not be started, or died before they were ready.
    start : float
        How long the last process took to be ready [s]; zero before there is any.
    """

    def __init__(self, make: Make[Job, Answer], workers: int, memory: int) -> None:
        self._make, self.workers, self._memory = make, workers, memory
        self.work: dict[Lane[Job, Answer], PendingQuestion | None] = {}
        self.rests_until = 0.0
        self.failed_starts = 0
        self.start = 0.0
        self._purposes: dict[Station[Job, Answer], Purpose] = {}
        self._starting: dict[Station[Job, Answer], float] = {}

    @property
    def stations(self) -> list[Station[Job, Answer]]:
        """The processes."""
        return list(self._purposes)

    @property
    def pipes(self) -> dict[Connection, Lane[Job, Answer]]:
        """The lanes of all processes, by their pipes."""
        return {lane.pipe: lane for station in self._purposes for lane in station.lanes}

    @property
    def up(self) -> bool:
        """True if questions of all kinds can be answered."""
        return bool(self._ready("streams") and self._ready("questions"))

    def _all(self, purpose: Purpose) -> list[Station[Job, Answer]]:
        return [each for each, own in self._purposes.items() if own == purpose]

    def _ready(self, purpose: Purpose) -> list[Station[Job, Answer]]:
        return [each for each in self._all(purpose) if each.ready]

    def start_worker(self) -> None:
        """Fill empty places with the spare process, or with new ones.

        Where the system refuses a process, none is started for a while.
        """
        wanted: list[Purpose] = [] if self._all("streams") else ["streams"]
        wanted += ["questions"] * (self.workers - len(self._all("questions")))
        try:
            for purpose in wanted:
                spare = self._all("spare")
                if station := spare[0] if spare else self._started():
                    self.put(station, purpose)
            all_ready = self.up and len(self._ready("questions")) == self.workers
            if all_ready and not self._all("spare") and (station := self._started()):
                self.put(station, "spare")
        except OSError as error:
            rest = self._rest()
            log.warning("no process can be started, again in %g s: %s", rest, error)

    def put(self, station: Station[Job, Answer], purpose: Purpose) -> None:
        """Give a process its purpose from now on."""
        self._purposes[station] = purpose
        lanes: dict[Purpose, int] = {"streams": STREAMS_LANES, "questions": 1, "spare": 0}
        self.work |= dict.fromkeys(station.lanes[: lanes[purpose]])

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
        rest = min(RESTING * 2.0**self.failed_starts, LONGEST_REST)
        self.rests_until = time.perf_counter() + rest
        self.failed_starts += 1
        return rest

    def has_streams(self, lane: Lane[Job, Answer]) -> bool:
        """Return whether a lane is of the process that has the streams."""
        return self._purposes.get(lane.station) == "streams"

    def is_for_set_points(self, lane: Lane[Job, Answer]) -> bool:
        """Return whether a lane is kept for set-points."""
        return self.has_streams(lane) and lane.number == SET_POINTS_LANE

    def idle(self) -> list[Lane[Job, Answer]]:
        """Return the lanes that have nothing to do."""
        return [
            lane
            for lane, asked in self.work.items()
            # a process that has just died is reported by its pipe next
            if asked is None and lane.ready and lane.station.process.is_alive()
        ]

    def takes_dear(self) -> bool:
        """Return whether a question that may take long leaves a ready process to the others."""
        asked = [each for lane, each in self.work.items() if not self.has_streams(lane)]
        dear = sum(each is not None and each.dear for each in asked)
        return dear < (1 if self.workers == 1 else len(self._ready("questions")) - 1)

    def ends(self, lane: Lane[Job, Answer]) -> tuple[float, float]:
        """Return when the question that a lane works on, and then its process, are given up."""
        question = self.work[lane]
        assert question is not None
        late = question.deadline + GRACE
        return late, question.deadline + HANGS if self.has_streams(lane) else late

    def has_grown(self, lane: Lane[Job, Answer]) -> bool:
        """Return whether a lane's process uses so much memory that it is to be replaced."""
        size = None if self.has_streams(lane) else resident(lane.station.process.pid)
        return size is not None and size > GROWN

    def stop_worker(
        self, station: Station[Job, Answer], *, dead: bool = False
    ) -> tuple[str, list[PendingQuestion]]:
        """End a process; parameters as for `Station.kill`.

        Returns
        -------
        how : str
            How it ended.
        left : list of PendingQuestion
            Questions that it had, and nobody has replied to.
        """
        asked = [self.work.pop(lane, None) for lane in station.lanes]
        self._starting.pop(station, None)
        del self._purposes[station]
        if station.ready:
            self.failed_starts = 0
        else:
            self._rest()
        left = [each for each in asked if each is not None and not each.replied]
        return station.kill(dead=dead), left

    def left(self) -> list[PendingQuestion]:
        """Return the questions in work that nobody has replied to."""
        return [each for each in self.work.values() if each is not None and not each.replied]

    def end(self) -> None:
        """End all processes."""
        for station in self.stations:
            station.kill()
        self.work.clear()
        self._purposes.clear()

    def states(self) -> list[ProcessHealth]:
        """Return what each process does."""
        found = []
        for station, purpose in self._purposes.items():
            busy = any(self.work.get(lane) is not None for lane in station.lanes)
            state = ProcessHealth(
                pid=station.process.pid,
                purpose=purpose,
                state="starting" if not station.ready else "working" if busy else "idle",
                resident=resident(station.process.pid),
            )
            found.append(state)
        return found
