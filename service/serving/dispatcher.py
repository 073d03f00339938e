"""Decide when and by which process a question is answered: one thread, which waits for none.

Questions wait by their kind: set-points; those about known stances, which are short; others; and
those that may take long, which leave one process to the others. In each queue, who has had least of
the processes' time is next. One more process has the streams and a lane for what is short, so that
nothing delays these. What is over its deadline ends, with its process if it must be.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from typing import Final, cast

import zenoh

from hand_models.base import CruxError
from planner import DeadlineError, Lane, Station
from service.processes import Job
from service.serving.crew import Crew
from service.serving.mail import Replies, Sender, reply_to
from service.serving.names import ClientNames
from service.serving.question import PendingQuestion, client_of, received_question
from service.serving.shares import Shares
from service.serving.waiting import Costs, Kind, Waiting
from service.serving.watch import ServiceState, Watch
from service.wire import PLAN, STREAM, Answer, Format, LostError, encode_error

__all__ = ["Dispatcher"]

log = logging.getLogger(__name__)

FAILED_STARTS: Final = 3
"""Processes in a row that may die before they are ready, when a service starts."""

STOPS: Final = 2.0
"""How long the end of the service waits for questions in work [s]."""

QUIET: Final = 0.2
"""Time without a new question before the service ends [s]: those on their way get a reply."""

STATE_TIMEOUT: Final = 1.0
"""Timeout of another thread that asks what the service does [s]."""

AWAKE: Final = 0.1
"""Interval at which the wait for the start wakes up [s]."""

AT_ONCE: Final = 32
"""Most events that are taken in before processes are looked at again."""


class Dispatcher:
    """Hands questions to processes, and their answers to the mail, in a thread of its own.

    Parameters
    ----------
    crew : Crew
        With 2 processes or more, questions that may take long leave one to others.
    seconds : float
        The deadline of a question that names none [s].
    robot : str
        Whose service it is.
    inquire : callable, optional
        Asks the session of a name for its digest, which `proven` is given.

    Attributes
    ----------
    watch : Watch
        Records what happens.
    """

    def __init__(
        self,
        crew: Crew,
        seconds: float,
        robot: str,
        inquire: Callable[[str], None] | None = None,
    ) -> None:
        self._crew, self._seconds, self._inquire = crew, seconds, inquire
        self.watch = Watch(robot, self._state)
        self._replies = Replies(self.watch)
        self._names, self._shares = ClientNames(), Shares()
        self._costs = Costs(self._shares)
        self._waiting = Waiting(self._shares)
        self._started = threading.Event()
        self._stops_at: float | None = None
        self._quiet_from = 0.0
        self._inbox: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._woken, self._waker = Pipe(duplex=False)
        self._bell = threading.Lock()
        self._rung = False
        self._thread = threading.Thread(target=self._run, name="crux-dispatcher", daemon=True)

    def start(self) -> None:
        """Start the processes and the thread, and wait until questions can be answered.

        Raises
        ------
        LostError
            If processes die before they are ready.
        """
        self._thread.start()
        # now and then awake for signals, which may come in another thread
        while not self._started.wait(AWAKE):
            continue
        if not self._crew.up:
            self.stop()
            self.close()
            raise LostError("no worker starts; see the log")

    def ask(self, query: zenoh.Query, key: str) -> None:
        """Take a query at a key; returns at once, whatever the thread."""
        self._post(partial(self._admit, query, key, time.perf_counter()))

    def look(self, make_answer: Callable[[], Answer], query: zenoh.Query, key: str) -> None:
        """Take an operator's query; returns at once."""
        client = client_of(query)
        known = client if client in self._names.linked else Sender.OPERATORS
        self._replies.later(known, partial(reply_to, query, key, make_answer))

    def linked(self, client: str) -> None:
        """Say that a session has a link to the service's own."""
        self._post(partial(self._names.linked.add, client))

    def proven(self, client: str, proof: bytes) -> None:
        """Hand in the digest that the session of a name has sent itself."""
        self._post(partial(self._prove, client, proof))

    def gone(self, client: str, *, token: bool = False) -> None:
        """Say that a client has gone: what it asked is not answered unless it is in work.

        Parameters
        ----------
        client : str
        token : bool, optional
            Whether its liveliness token says so, and not its link. That is believed only of who has
            proven its name, and has no link.
        """
        self._post(partial(self._drop, client, token))

    def stop(self) -> None:
        """Refuse what waits and what still comes, and wait a little for what is in work."""
        self._post(self._end)
        self._thread.join()

    def close(self) -> None:
        """Refuse what has come since the stop, and wait a little for replies on their way."""
        while not self._inbox.empty():
            self._take_in()
        self._replies.close()

    def _post(self, event: Callable[[], None]) -> None:
        """Let the dispatcher's own thread do something; all that follows is in it."""
        self._inbox.put(event)
        self._ring()

    def _ring(self) -> None:
        with self._bell:
            if not self._rung:
                self._rung = True
                self._waker.send_bytes(b"!")

    def _run(self) -> None:
        while not self._ended():
            self._guarded(self._step)
        self._crew.end()

    def _guarded(self, step: Callable[[], None]) -> None:
        """Do a step; log its exception, so that it ends nothing else."""
        try:
            step()
        except Exception:
            log.exception("the dispatcher failed")

    def _step(self) -> None:
        if self._stops_at is None:
            self._crew.start_worker()
            self._deal()
        pipes = self._crew.pipes
        ready = wait([self._woken, *pipes], self._pause())
        for pipe in ready:
            if (
                pipe is not self._woken
                # not of a process whose end another lane has reported meanwhile
                and (lane := pipes[cast(Connection, pipe)]).station in self._crew.stations
            ):
                self._take_back(lane)
        if self._woken in ready:
            if len(ready) > 1 and self._stops_at is None:
                # no lane waits for what has come
                self._deal()
            self._take_in()
        self._end_overdue()
        if self._crew.up or self._crew.failed_starts >= FAILED_STARTS:
            self._started.set()

    def _take_in(self) -> None:
        """Do what other threads have posted."""
        if self._woken.poll():
            self._woken.recv_bytes()
        with self._bell:
            self._rung = False
        for _ in range(AT_ONCE):
            try:
                event = self._inbox.get_nowait()
            except Empty:
                return
            self._guarded(event)
        self._ring()

    def _pause(self) -> float | None:
        """Return how long there is nothing to do unless something comes [s]."""
        now = time.perf_counter()
        times = [self._waiting.first_deadline()]
        for lane, asked in self._crew.work.items():
            if asked is not None:
                late, ends = self._crew.ends(lane)
                times.append(ends if asked.replied else late)
        ending = self._stops_at
        held = now + self._waiting.held()
        own = [self._crew.rests_until, held] if ending is None else [ending, self._quiet_from]
        times += [each for each in own if each > now]
        least = min(times)
        return None if least == math.inf else max(least - now, 0.0)

    # questions -----------------------------------------------------------------------------------

    def _admit(self, query: zenoh.Query, key: str, arrived: float) -> None:
        try:
            question = received_question(query, key, arrived, self._seconds)
        except Exception:
            log.exception("a query at %s cannot be read", key)
            unread = CruxError("the service could not read the query; see its log")
            answer = encode_error(unread, Format.JSON, kind="internal")
            self._replies.later(Sender.UNREAD, partial(reply_to, query, key, lambda: answer))
            return
        if self._stops_at is not None:
            self._replies.ending(question)
            self._quiet_from = time.perf_counter() + QUIET
            return
        if question.fault is not None:
            self._replies.refuse(question, question.fault)
            return
        question.place = self._names.place(question.client, question.secret)
        if self._inquire and self._names.is_to_prove(question.client, question.secret):
            self._replies.later(Sender.INQUIRIES, partial(self._inquire, question.client))
        self._shares.asks(question.place)
        self._put(self._costs.kind(question), question)

    def _put(self, kind: Kind, question: PendingQuestion) -> None:
        """Let a question wait; refuse the one that then has no room as busy."""
        if refused := self._waiting.put(kind, question):
            self._replies.busy(refused, len(self._waiting) / self._crew.workers)

    def _prove(self, client: str, proof: bytes) -> None:
        self._names.proven(client, proof)
        for kind, question in self._waiting.take_out(lambda each: each.client == client):
            question.place = self._names.place(client, question.secret)
            self._put(kind, question)

    def _deal(self) -> None:
        """Give lanes that have nothing to do the questions whose turn it is."""
        idle = self._crew.idle()
        others = [lane for lane in idle if not self._crew.has_streams(lane)]
        while others and (question := self._waiting.next(dear=self._crew.takes_dear())):
            knows, stance = self._costs.knows, question.stance
            knowing = [lane for lane in others if knows(lane.station, stance)]
            lane = (knowing or others)[0]
            others.remove(lane)
            self._give(lane, question)
        for lane in idle:
            if not self._crew.has_streams(lane):
                continue
            short = (Kind.DECLARED, Kind.SHORT)
            kinds = (Kind.SET_POINTS,) if self._crew.is_for_set_points(lane) else short
            if question := self._waiting.take(*kinds):
                self._give(lane, question)

    def _give(self, lane: Lane[Job, Answer], question: PendingQuestion) -> None:
        question.begun = time.perf_counter()
        self._crew.work[lane] = question
        rehearsal = question.name == STREAM and not question.rehearsed
        lane.give(question.job(question.begun, rehearsal))

    def _drop(self, client: str, token: bool) -> None:
        names = self._names
        if token and (client in names.linked or not names.has_proof(client)):
            return
        names.gone(client)
        self._shares.gone(client)
        gone = LostError("the client disconnected: its link or its liveliness token is gone")
        for question in self._waiting.remove(lambda each: each.place == client):
            self._replies.refuse(question, gone, "gone")

    # answers -------------------------------------------------------------------------------------

    def _take_back(self, lane: Lane[Job, Answer]) -> None:
        try:
            done = lane.take()
        except EOFError:
            rest = "nothing else was lost with it"
            if self._crew.has_streams(lane):
                rest = "the streams are lost with it; declare them again"
            how, left = self._end_process(lane.station)
            for question in left:
                self._shares.ended_process(question.place, time.perf_counter() - question.begun)
                lost = LostError(f"its worker {how}; {rest}")
                self._replies.refuse(question, lost)
            return
        if done is None:
            self._crew.came_up(lane.station)
            self._shares.start = self._crew.start or self._shares.start
            return
        asked = self._crew.work[lane]
        self._crew.work[lane] = None
        assert asked is not None
        cost = done.cost or done.seconds
        self._shares.charge(asked.place, cost)
        if asked.name == PLAN and asked.stance is not None:
            self._costs.took(asked.stance, lane.station, cost)
        if asked.name == STREAM and not asked.rehearsed and done.good:
            asked.rehearsed = True
            self._put(Kind.DECLARED, asked)
        elif not asked.replied:
            self._replies.reply(asked, done)
        if self._crew.has_grown(lane):
            self._end_process(lane.station, "had grown too large")

    def _end_overdue(self) -> None:
        """End questions whose time is over, and processes that do not stop at it."""
        now = time.perf_counter()
        for question in self._waiting.remove(lambda each: each.deadline <= now):
            self._replies.refuse(question, DeadlineError(question.seconds, "a worker was free"))
        for lane, asked in list(self._crew.work.items()):
            if asked is None or lane not in self._crew.work:
                continue
            ends = self._crew.ends(lane)
            if ends[0] > now:
                continue
            if not asked.replied:
                missing = "there was an answer, and its work was broken off"
                self._replies.refuse(asked, DeadlineError(asked.seconds, missing))
            if ends[1] <= now:
                self._shares.ended_process(asked.place, now - asked.begun)
                self._end_process(lane.station, "did not stop at a deadline")

    def _end_process(
        self, station: Station[Job, Answer], why: str | None = None
    ) -> tuple[str, list[PendingQuestion]]:
        """End a process, which another replaces; as `Crew.stop_worker`."""
        how, left = self._crew.stop_worker(station, dead=why is None)
        self.watch.ended(station.process.pid, why or how)
        return how, left

    def _state(self) -> ServiceState:
        """Return what the service does, to whatever thread."""
        if threading.current_thread() is self._thread or not self._thread.is_alive():
            return ServiceState(self._crew.states(), self._waiting.counts())
        found: SimpleQueue[ServiceState] = SimpleQueue()
        self._post(lambda: found.put(self._state()))
        try:
            return found.get(timeout=STATE_TIMEOUT)
        except Empty:
            return ServiceState([], {})

    # the end -------------------------------------------------------------------------------------

    def _end(self) -> None:
        now = time.perf_counter()
        self._stops_at, self._quiet_from = now + STOPS, now + QUIET
        for question in self._waiting.remove(lambda _: True):
            self._replies.ending(question)

    def _ended(self) -> bool:
        if self._stops_at is None:
            return False
        left, now = self._crew.left(), time.perf_counter()
        if (left or now < self._quiet_from) and now < self._stops_at:
            return False
        lost = LostError("the service stopped before the question was answered")
        for question in left:
            self._replies.refuse(question, lost)
        return True
