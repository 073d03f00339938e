"""Start the processes of a service, give each a purpose, and replace them."""

from __future__ import annotations

import logging
import time
from multiprocessing.connection import Connection
from typing import Literal

from planner import Make, PriorityLane, WorkerHandle, resident
from service.processes import Job
from service.replies import ProcessHealth
from service.serving.question import PendingQuestion
from service.serving.settings import SERVING_SETTINGS
from service.wire import Answer

__all__ = ["WorkerPool"]

log = logging.getLogger(__name__)

Purpose = Literal["questions", "streams", "spare"]


class WorkerPool:
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
    work : dict of PriorityLane to Question or None
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
        self.work: dict[PriorityLane[Job, Answer], PendingQuestion | None] = {}
        self.rests_until = 0.0
        self.failed_starts = 0
        self.start = 0.0
        self._purposes: dict[WorkerHandle[Job, Answer], Purpose] = {}
        self._starting: dict[WorkerHandle[Job, Answer], float] = {}

    @property
    def handles(self) -> list[WorkerHandle[Job, Answer]]:
        """The processes."""
        return list(self._purposes)

    @property
    def pipes(self) -> dict[Connection, PriorityLane[Job, Answer]]:
        """The lanes of all processes, by their pipes."""
        return {lane.pipe: lane for handle in self._purposes for lane in handle.lanes}

    @property
    def up(self) -> bool:
        """True if questions of all kinds can be answered."""
        return bool(self._ready("streams") and self._ready("questions"))

    def _all(self, purpose: Purpose) -> list[WorkerHandle[Job, Answer]]:
        return [each for each, own in self._purposes.items() if own == purpose]

    def _ready(self, purpose: Purpose) -> list[WorkerHandle[Job, Answer]]:
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
                if handle := spare[0] if spare else self._started():
                    self.put(handle, purpose)
            all_ready = self.up and len(self._ready("questions")) == self.workers
            if all_ready and not self._all("spare") and (handle := self._started()):
                self.put(handle, "spare")
        except OSError as error:
            rest = self._rest()
            log.warning("no process can be started, again in %g s: %s", rest, error)

    def put(self, handle: WorkerHandle[Job, Answer], purpose: Purpose) -> None:
        """Give a process its purpose from now on."""
        self._purposes[handle] = purpose
        # with the streams, one lane for set-points, and one for what else is short
        lanes: dict[Purpose, int] = {"streams": 2, "questions": 1, "spare": 0}
        self.work |= dict.fromkeys(handle.lanes[: lanes[purpose]])

    def _started(self) -> WorkerHandle[Job, Answer] | None:
        if time.perf_counter() < self.rests_until:
            return None
        # any process may come to have the streams; what ends the service is for it to answer
        handle = WorkerHandle(self._make, lanes=2, memory=self._memory, stays=True)
        self._starting[handle] = time.perf_counter()
        return handle

    def came_up(self, handle: WorkerHandle[Job, Answer]) -> None:
        """Take note of how long a process took to be ready, if it has just become so."""
        if handle.ready and (begun := self._starting.pop(handle, None)) is not None:
            self.start = time.perf_counter() - begun

    def _rest(self) -> float:
        """Start none for a while, longer each time, and return how long [s]."""
        rest = SERVING_SETTINGS.first_rest * 2.0**self.failed_starts
        rest = min(rest, SERVING_SETTINGS.longest_rest)
        self.rests_until = time.perf_counter() + rest
        self.failed_starts += 1
        return rest

    def has_streams(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane is of the process that has the streams."""
        return self._purposes.get(lane.handle) == "streams"

    def is_for_set_points(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane is kept for set-points."""
        # the first of two
        return self.has_streams(lane) and lane.number == 0

    def idle(self) -> list[PriorityLane[Job, Answer]]:
        """Return the lanes that have nothing to do."""
        return [
            lane
            for lane, asked in self.work.items()
            # a process that has just died is reported by its pipe next
            if asked is None and lane.ready and lane.handle.process.is_alive()
        ]

    def takes_dear(self) -> bool:
        """Return whether a question that may take long leaves a ready process to the others."""
        asked = [each for lane, each in self.work.items() if not self.has_streams(lane)]
        dear = sum(each is not None and each.dear for each in asked)
        return dear < (1 if self.workers == 1 else len(self._ready("questions")) - 1)

    def ends(self, lane: PriorityLane[Job, Answer]) -> tuple[float, float]:
        """Return when the question that a lane works on, and then its process, are given up."""
        question = self.work[lane]
        assert question is not None
        # [s] beyond its deadline, a process may take so long to say that it is over
        late = question.deadline + 0.5
        # with the process that has the streams, they are lost: it is given longer
        return late, question.deadline + 30.0 if self.has_streams(lane) else late

    def has_grown(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane's process uses so much memory that it is to be replaced."""
        size = None if self.has_streams(lane) else resident(lane.handle.process.pid)
        # [bytes] of resident memory
        return size is not None and size > 700 * 2**20

    def stop_worker(
        self, handle: WorkerHandle[Job, Answer], *, dead: bool = False
    ) -> tuple[str, list[PendingQuestion]]:
        """End a process; parameters as for `WorkerHandle.kill`.

        Returns
        -------
        how : str
            How it ended.
        left : list of PendingQuestion
            Questions that it had, and nobody has replied to.
        """
        asked = [self.work.pop(lane, None) for lane in handle.lanes]
        self._starting.pop(handle, None)
        del self._purposes[handle]
        if handle.ready:
            self.failed_starts = 0
        else:
            self._rest()
        left = [each for each in asked if each is not None and not each.replied]
        return handle.kill(dead=dead), left

    def left(self) -> list[PendingQuestion]:
        """Return the questions in work that nobody has replied to."""
        return [each for each in self.work.values() if each is not None and not each.replied]

    def end(self) -> None:
        """End all processes."""
        for handle in self.handles:
            handle.kill()
        self.work.clear()
        self._purposes.clear()

    def states(self) -> list[ProcessHealth]:
        """Return what each process does."""
        found = []
        for handle, purpose in self._purposes.items():
            busy = any(self.work.get(lane) is not None for lane in handle.lanes)
            state = ProcessHealth(
                pid=handle.process.pid,
                purpose=purpose,
                state="starting" if not handle.ready else "working" if busy else "idle",
                resident=resident(handle.process.pid),
            )
            found.append(state)
        return found
