"""Start the worker processes of a service, assign each a purpose, and replace those that end."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable
from multiprocessing.connection import Connection, wait
from typing import Literal

from planner import Make, PriorityLane, WorkerHandle, resident
from service.processes import Job
from service.replies import ProcessHealth
from service.serving.question import PendingQuestion
from service.serving.settings import SERVING_SETTINGS
from service.serving.waiting import Kind
from service.wire import Answer

__all__ = ["WorkerPool"]

log = logging.getLogger(__name__)

Purpose = Literal["questions", "streams", "climbs", "spare"]


class WorkerPool:
    """Workers of a service: for questions, for streams, a spare, and for climbs once there are any.

    Parameters
    ----------
    make : callable
        Called once in each worker process; returns the function that answers a `Job`.
    workers : int
        Number of workers that answer questions.
    memory : int
        Largest memory of each worker [bytes].
    keeps : callable, optional
        Called with the identifiers of all streams that are kept, whenever that changes.

    Attributes
    ----------
    workers : int
        Number of workers that answer questions.
    climbs : int
        Most climbs that are searched for at a time: half of ``workers``, but at least one.
    work : dict of PriorityLane to PendingQuestion or None
        Question that each lane of a worker is answering; None for an idle lane.
    rests_until : float
        Time before which no worker is started, on the clock of `time.perf_counter` [s].
    failed_starts : int
        Number of workers in a row that could not be started, or died before they were ready.
    start : float
        Time that the last worker took to become ready [s]; zero before there is any.
    streams : int
        Number of streams that are kept.
    """

    def __init__(
        self,
        make: Make[Job, Answer],
        workers: int,
        memory: int,
        keeps: Callable[[Iterable[str]], None] = lambda _: None,
    ) -> None:
        self._make, self.workers, self._memory, self._keeps = make, workers, memory, keeps
        self.climbs = max(1, workers // 2)
        self.work: dict[PriorityLane[Job, Answer], PendingQuestion | None] = {}
        self.rests_until = 0.0
        self.failed_starts = 0
        self.start = 0.0
        self.streams = 0
        self._purposes: dict[WorkerHandle[Job, Answer], Purpose] = {}
        self._starting: dict[WorkerHandle[Job, Answer], float] = {}
        self._reads_memory: dict[WorkerHandle[Job, Answer], float] = {}
        """When a worker's memory is to be read next."""

    @property
    def handles(self) -> list[WorkerHandle[Job, Answer]]:
        """All worker processes."""
        return list(self._purposes)

    @property
    def pipes(self) -> dict[Connection, PriorityLane[Job, Answer]]:
        """The lanes of all workers, by the pipes over which they send answers."""
        return {lane.pipe: lane for handle in self._purposes for lane in handle.lanes}

    @property
    def up(self) -> bool:
        """True if at least one worker for questions and the one for streams are ready."""
        return bool(self._ready("streams") and self._ready("questions"))

    def _all(self, purpose: Purpose) -> list[WorkerHandle[Job, Answer]]:
        return [each for each, own in self._purposes.items() if own == purpose]

    def _ready(self, purpose: Purpose) -> list[WorkerHandle[Job, Answer]]:
        return [each for each in self._all(purpose) if each.ready]

    def start_worker(self, climbs: int = 0) -> None:
        """Start missing workers, or use the spare; then start a new spare if all others are ready.

        ``climbs``: number of climbs that wait for a worker; without any, none is started for them.
        Where the operating system refuses a process, a warning is logged and no worker is started
        for a while.
        """
        wanted: list[Purpose] = [] if self._all("streams") else ["streams"]
        wanted += ["questions"] * (self.workers - len(self._all("questions")))
        climbing = self._all("climbs")
        at_work = sum(self.work[handle.lanes[0]] is not None for handle in climbing)
        wanted += ["climbs"] * (min(at_work + climbs, self.climbs) - len(climbing))
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
        """Assign a worker its purpose: ``questions``, ``streams``, ``climbs`` or ``spare``."""
        self._purposes[handle] = purpose
        # with the streams, one lane for set-points, and one for what else is short
        lanes: dict[Purpose, int] = {"streams": 2, "questions": 1, "climbs": 1, "spare": 0}
        self.work |= dict.fromkeys(handle.lanes[: lanes[purpose]])

    def _started(self) -> WorkerHandle[Job, Answer] | None:
        if time.perf_counter() < self.rests_until:
            return None
        # any process may come to have the streams; what ends the service is for it to answer
        handle = WorkerHandle(self._make, lanes=2, memory=self._memory, stays=True)
        self._starting[handle] = time.perf_counter()
        return handle

    def came_up(self, handle: WorkerHandle[Job, Answer]) -> None:
        """Record how long a worker took to become ready, if it has just become ready."""
        if handle.ready and (begun := self._starting.pop(handle, None)) is not None:
            self.start = time.perf_counter() - begun

    def _rest(self) -> float:
        """Start none for a while, longer each time, and return how long [s]."""
        rest = SERVING_SETTINGS.first_rest * 2.0**self.failed_starts
        rest = min(rest, SERVING_SETTINGS.longest_rest)
        self.rests_until = time.perf_counter() + rest
        self.failed_starts += 1
        return rest

    def take(self, lane: PriorityLane[Job, Answer]) -> Answer | None:
        """Return what a lane's worker has sent; None where it has become ready.

        Raises
        ------
        EOFError
            If the worker has ended.
        """
        done = lane.take()
        if done is not None and done.streams is not None:
            self._keep(done.streams)
        return done

    def _keep(self, streams: tuple[str, ...]) -> None:
        self.streams = len(streams)
        self._keeps(streams)

    def has_streams(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane belongs to the worker that keeps the streams."""
        return self._purposes.get(lane.handle) == "streams"

    def answers_any(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane is for questions of any kind but climbs and set-points."""
        return self._purposes.get(lane.handle) == "questions"

    def kinds(self, lane: PriorityLane[Job, Answer]) -> tuple[Kind, ...]:
        """Return the kinds for which a lane is reserved; none for one that answers any."""
        if self._purposes.get(lane.handle) == "climbs":
            return (Kind.CLIMB,)
        if not self.has_streams(lane):
            return ()
        # of two lanes, set-points have the first
        return (Kind.DECLARED, Kind.SHORT) if lane.number else (Kind.SET_POINTS,)

    def idle(self) -> list[PriorityLane[Job, Answer]]:
        """Return the lanes of ready workers that have no question to answer."""
        idle = {lane.pipe: lane for lane, asked in self.work.items() if asked is None}
        # a process that has just died is reported by its pipe next
        dead = wait(idle, 0.0)
        return [lane for pipe, lane in idle.items() if lane.ready and pipe not in dead]

    def takes_dear(self) -> bool:
        """Return whether one more question that may take long leaves a worker free for others.

        A pool with one worker takes one such question at a time.
        """
        asked = [each for lane, each in self.work.items() if self.answers_any(lane)]
        dear = sum(each is not None and each.dear for each in asked)
        return dear < (1 if self.workers == 1 else len(self._ready("questions")) - 1)

    def ends(self, lane: PriorityLane[Job, Answer]) -> tuple[float, float]:
        """Return the times at which the question of a lane, and then its worker, are given up.

        Returns
        -------
        late : float
            Half a second after the question's deadline, on the clock of `time.perf_counter` [s].
        ends : float
            The same time; for the worker that keeps the streams, 30 s after the deadline [s].
        """
        question = self.work[lane]
        assert question is not None
        # [s] beyond its deadline, a process may take so long to say that it is over
        late = question.deadline + 0.5
        # with the process that has the streams, they are lost: it is given longer
        return late, question.deadline + 30.0 if self.has_streams(lane) else late

    def has_grown(self, lane: PriorityLane[Job, Answer]) -> bool:
        """Return whether a lane's worker uses more than 700 MiB of memory, and must be replaced.

        Always false for the worker that keeps the streams. A worker's memory is read at most every
        0.1 s.
        """
        handle, now = lane.handle, time.perf_counter()
        if self.has_streams(lane) or now < self._reads_memory.get(handle, 0.0):
            return False
        self._reads_memory[handle] = now + 0.1
        size = resident(handle.process.pid)
        # [bytes] of resident memory
        return size is not None and size > 700 * 2**20

    def stop_worker(
        self, handle: WorkerHandle[Job, Answer], *, dead: bool = False
    ) -> tuple[str, list[PendingQuestion]]:
        """Kill a worker, and remove it from the pool.

        Parameters
        ----------
        handle : WorkerHandle
            The worker.
        dead : bool, optional
            True if the worker has already ended by itself.

        Returns
        -------
        how : str
            How the worker ended, in words.
        left : list of PendingQuestion
            Questions that the worker had and that have no reply yet.
        """
        asked = [self.work.pop(lane, None) for lane in handle.lanes]
        if self._purposes[handle] == "streams":
            self._keep(())
        self._starting.pop(handle, None)
        self._reads_memory.pop(handle, None)
        del self._purposes[handle]
        if handle.ready:
            self.failed_starts = 0
        else:
            self._rest()
        left = [each for each in asked if each is not None and not each.replied]
        return handle.kill(dead=dead), left

    def stop_climbs(self, unwanted: Callable[[PendingQuestion], bool]) -> list[PendingQuestion]:
        """Kill the workers of climbs that are not wanted any more; return those without a reply."""
        work = [
            (lane, asked) for lane, asked in self.work.items() if Kind.CLIMB in self.kinds(lane)
        ]
        ends = [lane.handle for lane, asked in work if asked is not None and unwanted(asked)]
        return [each for handle in ends for each in self.stop_worker(handle)[1]]

    def left(self) -> list[PendingQuestion]:
        """Return the questions that workers are answering and that have no reply yet."""
        return [each for each in self.work.values() if each is not None and not each.replied]

    def end(self) -> None:
        """Kill all workers."""
        for handle in self.handles:
            handle.kill()
        self.work.clear()
        self._purposes.clear()

    def states(self) -> list[ProcessHealth]:
        """Return the state of each worker: its purpose, what it does, and its memory."""
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
