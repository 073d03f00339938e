"""Schedule questions on worker processes: one thread, which never blocks on a worker or a client.

Questions wait in queues by their kind (scheduling with priority queues): set-points; short
questions about known stances; other questions; and questions that may take long. The last kind
leaves one worker to the others. In each queue, the client that has used least of the workers' time
is next. A separate worker has the streams and a lane for short questions; climbs have workers of
their own. A question past its deadline is ended, and its worker killed if need be.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from typing import cast

import zenoh

from hand_models.base import CruxError, InvalidInputError
from planner import DeadlineError, PriorityLane, WorkerHandle
from service.processes import Job
from service.replies import CancelReply
from service.requests import CancelRequest
from service.serving.inbox import Inbox
from service.serving.monitor import ServiceMonitor, ServiceState
from service.serving.names import ClientNames
from service.serving.question import AnyQuery, PendingQuestion, client_of, received_question
from service.serving.reply_sender import Replies, SharedQueue, reply_to
from service.serving.settings import SERVING_SETTINGS
from service.serving.shares import Shares
from service.serving.waiting import Costs, Kind, Waiting
from service.serving.worker_pool import WorkerPool
from service.wire import Answer, CancelledError, Format, LostError, ServiceName, decode_request

__all__ = ["Dispatcher"]

log = logging.getLogger(__name__)


class Dispatcher:
    """Dispatcher of a service: gives questions to workers and sends their answers to clients.

    Runs in a thread of its own; public methods can be called from any thread.

    Parameters
    ----------
    pool : WorkerPool
        Workers that answer; of 2 or more, one is left to questions that do not take long.
    seconds : float
        Deadline of a question that names none [s].
    robot : str
        Name of the robot, for the health reply.
    inquire : callable, optional
        Called with a client's identifier; asks it for the digest of its secret, for `proven`.

    Attributes
    ----------
    monitor : ServiceMonitor
        Counts and logs questions, and reports the health of the service.
    """

    def __init__(
        self,
        pool: WorkerPool,
        seconds: float,
        robot: str,
        inquire: Callable[[str], None] | None = None,
    ) -> None:
        self._pool, self._seconds, self._inquire = pool, seconds, inquire
        self.monitor = ServiceMonitor(robot, self._state)
        self._replies = Replies(self.monitor)
        self._names, self._shares = ClientNames(), Shares()
        self._costs = Costs(self._shares)
        self._waiting = Waiting(self._shares)
        self._started = threading.Event()
        self._stops_at: float | None = None
        self._quiet_from = 0.0
        self._inbox = Inbox()
        self._thread = threading.Thread(target=self._run, name="crux-dispatcher", daemon=True)

    def start(self) -> None:
        """Start the workers and the dispatcher's thread; return when questions can be answered.

        Raises
        ------
        LostError
            If three workers in a row die before they are ready.
        """
        self._pool.start_worker()  # in this thread, so that the error of a missing guard ends it
        self._thread.start()
        while not self._started.wait(timeout=0.1):  # awake for signals in other threads
            continue
        if not self._pool.up:
            self.stop()
            self.close()
            raise LostError(
                f"none of the {self._pool.workers} workers started: their last lines above say why"
                "; a program that serves needs its 'if __name__ == \"__main__\":'"
            )

    def ask(self, query: AnyQuery, key: str) -> None:
        """Put a query, which arrived at a key, into its queue; returns at once."""
        self._inbox.post(partial(self._admit, query, key, time.perf_counter()))

    def look(self, make_answer: Callable[[], Answer], query: zenoh.Query, key: str) -> None:
        """Answer an operator's query, such as for health, in the background; returns at once.

        ``make_answer`` is called in the thread that sends the reply; ``key`` is where the query
        arrived.
        """
        client = client_of(query)
        known = client if client in self._names.linked else SharedQueue.OPERATORS
        self._replies.later(known, partial(reply_to, query, key, make_answer))

    def linked(self, client: str) -> None:
        """Record that a client's session has a link to the service's own session."""
        self._inbox.post(partial(self._names.linked.add, client))

    def proven(self, client: str, proof: bytes) -> None:
        """Record the digest that a client's session has sent as proof of its identifier.

        Waiting questions with that identifier are put into their queues anew.
        """
        self._inbox.post(partial(self._prove, client, proof))

    def gone(self, client: str, *, token: bool = False) -> None:
        """Drop waiting questions and climbs of a client that has disconnected; others go on.

        Parameters
        ----------
        client : str
            Identifier of the client's session.
        token : bool, optional
            True if the disconnection is known from the client's liveliness token, false if from its
            link. A token is believed only for a client that has proven its identifier and has no
            link.
        """
        self._inbox.post(partial(self._drop, client, token))

    def stop(self) -> None:
        """Refuse waiting and new questions, wait up to 2 s for those in work, end the workers."""
        self._inbox.post(self._end)
        self._thread.join()

    def close(self) -> None:
        """Refuse questions that came after `stop`; wait up to 1 s for replies to be sent."""
        while not self._inbox.empty:
            self._take_in()
        self._replies.close()

    def _run(self) -> None:
        while not self._ended():
            self._guarded(self._step)
        self._pool.end()

    def _guarded(self, step: Callable[[], None]) -> None:
        """Do a step; log its exception, so that it ends nothing else."""
        try:
            step()
        except Exception:
            log.exception("the dispatcher failed")

    def _step(self) -> None:
        if self._stops_at is None:
            self._pool.start_worker(climbs=self._waiting.count(Kind.CLIMB))
            self._deal()
        pipes = self._pool.pipes
        ready = wait([self._inbox.bell, *pipes], self._pause())
        for pipe in ready:
            if (
                pipe is not self._inbox.bell
                # not of a process whose end another lane has reported meanwhile
                and (lane := pipes[cast(Connection, pipe)]).handle in self._pool.handles
            ):
                self._take_back(lane)
        if self._inbox.bell in ready:
            if len(ready) > 1 and self._stops_at is None:
                # no lane waits for what has come
                self._deal()
            self._take_in()
        self._end_overdue()
        if self._pool.up or self._pool.failed_starts >= SERVING_SETTINGS.failed_starts:
            self._started.set()

    def _take_in(self) -> None:
        """Do what other threads have posted."""
        for event in self._inbox.take():
            self._guarded(event)

    def _pause(self) -> float | None:
        """Return how long there is nothing to do unless something comes [s]."""
        now = time.perf_counter()
        times = [self._waiting.first_deadline()]
        for lane, asked in self._pool.work.items():
            if asked is not None:
                late, ends = self._pool.ends(lane)
                times.append(ends if asked.replied else late)
        ending = self._stops_at
        held = now + self._waiting.held()
        own = [self._pool.rests_until, held] if ending is None else [ending, self._quiet_from]
        times += [each for each in own if each > now]
        least = min(times)
        return None if least == math.inf else max(least - now, 0.0)

    # questions -----------------------------------------------------------------------------------

    def _admit(self, query: AnyQuery, key: str, arrived: float) -> None:
        try:
            question = received_question(query, key, arrived, self._seconds)
        except Exception:
            log.exception("a query at %s cannot be read", key)
            self._replies.unread(query, key)
            return
        if self._stops_at is not None:
            self._replies.ending(question)
            self._quiet_from = time.perf_counter() + SERVING_SETTINGS.quiet_time
            return
        if question.fault is not None:
            self._replies.refuse(question, question.fault)
            return
        question.place = self._names.place(question.client, question.secret, question.caller)
        if self._inquire and self._names.is_to_prove(question.client, question.secret):
            self._replies.later(SharedQueue.INQUIRIES, partial(self._inquire, question.client))
        if question.name == ServiceName.CANCEL:
            self._cancel(question)
            return
        self._shares.asks(question.place)
        self._put(self._costs.kind(question), question)

    def _put(self, kind: Kind, question: PendingQuestion) -> None:
        """Let a question wait; refuse the one that then has no room as busy."""
        if refused := self._waiting.put(kind, question):
            self._replies.busy(refused, len(self._waiting) / self._pool.workers)

    def _prove(self, client: str, proof: bytes) -> None:
        self._names.proven(client, proof)
        for kind, question in self._waiting.take_out(lambda each: each.client == client):
            question.place = self._names.place(client, question.secret)
            self._put(kind, question)
        for asked in self._pool.left():
            if asked.client == client:
                asked.place = self._names.place(client, asked.secret)

    def _cancel(self, question: PendingQuestion) -> None:
        """Stop the questions of a client that have the id which it names."""
        try:
            form = Format.named(question.encoding)
            asked = decode_request(question.payload, CancelRequest, form)
        except InvalidInputError as error:
            self._replies.refuse(question, error)
            return
        named, why = (question.place, asked.id), CancelledError("cancelled by its client")
        count = self._stop(lambda each: (each.place, each.id) == named, why, why.kind)
        reply = CancelReply(id=asked.id, cancelled=count)
        self._replies.reply(question, Answer(form.encode(reply), form.label(reply)))

    def _stop(self, which: Callable[[PendingQuestion], bool], error: CruxError, kind: str) -> int:
        """Refuse questions that wait, and climbs in work, whose workers end; count them.

        Other questions in work go on: they take less time than a worker takes to start.
        """
        climbs = self._pool.stop_climbs(which)
        for climb in climbs:
            self._shares.charge(climb.place, self._shares.start)
        stopped = [*self._waiting.remove(which), *climbs]
        for question in stopped:
            self._replies.refuse(question, error, kind)
        return len(stopped)

    def _deal(self) -> None:
        """Give lanes that have nothing to do the questions whose turn it is."""
        idle = self._pool.idle()
        others = [lane for lane in idle if self._pool.answers_any(lane)]
        while others and (question := self._waiting.next(dear=self._pool.takes_dear())):
            knows, stance = self._costs.knows, question.stance
            knowing = [lane for lane in others if knows(lane.handle, stance)]
            lane = (knowing or others)[0]
            others.remove(lane)
            self._give(lane, question)
        for lane in idle:
            if question := self._waiting.take(*self._pool.kinds(lane)):
                self._give(lane, question)

    def _give(self, lane: PriorityLane[Job, Answer], question: PendingQuestion) -> None:
        question.begun = time.perf_counter()
        self._pool.work[lane] = question
        lane.give(question.job(question.begun, self._names.connected))

    def _drop(self, client: str, token: bool) -> None:
        names = self._names
        if token and (client in names.linked or not names.has_proof(client)):
            return
        names.gone(client)
        self._shares.gone(client)
        gone = LostError("the client disconnected: its link or its liveliness token is gone")
        self._stop(lambda each: each.place == client, gone, "gone")

    # answers -------------------------------------------------------------------------------------

    def _take_back(self, lane: PriorityLane[Job, Answer]) -> None:
        try:
            done = self._pool.take(lane)
        except EOFError:
            rest = "nothing else was lost with it"
            if self._pool.has_streams(lane):
                rest = "the streams are lost with it; declare them again"
            how, left = self._end_process(lane.handle)
            for question in left:
                self._shares.ended_process(question.place, time.perf_counter() - question.begun)
                lost = LostError(f"the question's worker {how}; {rest}")
                self._replies.refuse(question, lost)
            return
        if done is None:
            self._pool.came_up(lane.handle)
            self._shares.start = self._pool.start or self._shares.start
            return
        asked = self._pool.work[lane]
        assert asked is not None
        if not done.last:
            if not asked.replied:
                self._replies.part(asked, done)
            return
        self._pool.work[lane] = None
        cost = done.cost or done.seconds
        if asked.name != ServiceName.CLIMB:  # whose worker others do not wait for
            self._shares.charge(asked.place, cost)
        if asked.name == ServiceName.PLAN and asked.stance is not None:
            self._costs.took(asked.stance, lane.handle, cost)
        if asked.name == ServiceName.STREAM and not asked.rehearsed and done.good:
            asked.rehearsed = True
            self._put(Kind.DECLARED, asked)
        elif not asked.replied:
            self._replies.reply(asked, done)
        if self._pool.has_grown(lane):
            self._end_process(lane.handle, "had grown too large")

    def _end_overdue(self) -> None:
        """End questions whose time is over, and processes that do not stop at it."""
        now = time.perf_counter()
        for question in self._waiting.remove(lambda each: each.deadline <= now):
            self._replies.refuse(question, DeadlineError(question.seconds, "a worker was free"))
        for lane, asked in list(self._pool.work.items()):
            if asked is None or lane not in self._pool.work:
                continue
            late, ends = self._pool.ends(lane)
            if late > now:
                continue
            if not asked.replied:
                missing = "there was an answer, and its work was broken off"
                self._replies.refuse(asked, DeadlineError(asked.seconds, missing))
            if ends <= now:
                self._shares.ended_process(asked.place, now - asked.begun)
                self._end_process(lane.handle, "did not stop at a deadline")

    def _end_process(
        self, handle: WorkerHandle[Job, Answer], why: str | None = None
    ) -> tuple[str, list[PendingQuestion]]:
        """End a process, which another replaces; as `WorkerPool.stop_worker`."""
        how, left = self._pool.stop_worker(handle, dead=why is None)
        self.monitor.ended(handle.process.pid, why or how)
        return how, left

    def _state(self) -> ServiceState:
        """Return what the service does, to whatever thread."""
        if threading.current_thread() is self._thread or not self._thread.is_alive():
            # besides the service's own session
            clients, pool = max(len(self._names.connected()) - 1, 0), self._pool
            return ServiceState(pool.states(), self._waiting.counts(), clients, pool.streams)
        found: SimpleQueue[ServiceState] = SimpleQueue()
        self._inbox.post(lambda: found.put(self._state()))
        try:
            return found.get(timeout=1.0)
        except Empty:
            return ServiceState([], {})

    # the end -------------------------------------------------------------------------------------

    def _end(self) -> None:
        now = time.perf_counter()
        self._quiet_from = now + SERVING_SETTINGS.quiet_time
        # [s] questions in work are waited for so long
        self._stops_at = now + 2.0
        for question in self._waiting.remove(lambda _: True):
            self._replies.ending(question)

    def _ended(self) -> bool:
        if self._stops_at is None:
            return False
        left, now = self._pool.left(), time.perf_counter()
        if (left or now < self._quiet_from) and now < self._stops_at:
            return False
        lost = LostError("the service stopped before the question was answered")
        for question in left:
            self._replies.refuse(question, lost)
        return True
