"""Send replies in background threads, so that a client that does not read delays nobody else.

Zenoh's reply call blocks while the client's link is full, for up to 5 s, after which zenoh closes
the link. Therefore the replies to one client are sent one after another, and those to other clients
meanwhile.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from queue import SimpleQueue

from hand_models.base import CruxError
from service.publishing import PublishedWrench
from service.recording import Exchange
from service.serving.monitor import ServiceMonitor
from service.serving.question import AnyQuery, PendingQuestion
from service.wire import Answer, BusyError, Format, encode_error, shared_key

__all__ = ["Replies", "ReplySender", "SharedQueue", "reply_to"]

log = logging.getLogger(__name__)


class SharedQueue(StrEnum):
    """Names of the queues for messages to clients whose identifiers are not known."""

    OPERATORS = "operators"
    """Operators who ask for health or metrics, without a link to the service."""
    UNREAD = "unread"
    """Clients whose query could not be read."""
    INQUIRIES = "inquiries"
    """Sessions that are asked to prove their identifiers."""


class ReplySender:
    """Sender of replies in background threads, one queue for each client. Thread-safe.

    Parameters
    ----------
    threads : int, optional
        Number of threads: as many clients can block at a time without delaying others.
    """

    def __init__(self, threads: int = 32) -> None:
        self._threads = threads
        self._sent = threading.Condition()
        self._to: dict[str, deque[Callable[[], None]]] = {}
        self._clients: SimpleQueue[str | None] = SimpleQueue()
        for _ in range(self._threads):
            threading.Thread(target=self._run, name="crux-replies", daemon=True).start()

    def send(self, client: str, reply: Callable[[], None]) -> None:
        """Queue a reply, to be sent after earlier replies to the same client; returns at once.

        Parameters
        ----------
        client : str
            Identifier of the client, or name of a shared queue.
        reply : callable
            Sends the reply; called without arguments in a background thread.
        """
        with self._sent:
            waiting = self._to.get(client)
            if waiting is not None:
                waiting.append(reply)
                return
            self._to[client] = deque([reply])
        self._clients.put(client)

    def close(self, seconds: float) -> None:
        """Wait until all queued replies are sent, or until the timeout; then end the threads.

        Parameters
        ----------
        seconds : float
            Timeout [s].
        """
        with self._sent:
            self._sent.wait_for(lambda: not self._to, seconds)
        for _ in range(self._threads):
            self._clients.put(None)

    def _run(self) -> None:
        while (client := self._clients.get()) is not None:
            while (reply := self._next(client)) is not None:
                try:
                    reply()
                except Exception:
                    log.exception("a reply was lost")

    def _next(self, client: str) -> Callable[[], None] | None:
        with self._sent:
            if self._to[client]:
                return self._to[client].popleft()
            del self._to[client]
            self._sent.notify_all()
            return None


def reply_to(query: AnyQuery, key: str, make_answer: Callable[[], Answer]) -> None:
    """Send the reply to a query, and drop the query.

    Parameters
    ----------
    query : zenoh.Query, PublishedWrench or RosQuestion
        The query.
    key : str
        Key under which the reply is sent.
    make_answer : callable
        Returns the answer; an error is sent as zenoh's error reply.
    """
    with query:
        answer = make_answer()
        if answer.good:
            query.reply(key, answer.payload, encoding=answer.encoding)
        else:
            query.reply_err(answer.payload, encoding=answer.encoding)


class Replies:
    """Replies of a service to questions, sent in the background; a monitor counts the last ones.

    Parameters
    ----------
    monitor : ServiceMonitor
        Counts and logs each reply.
    """

    def __init__(self, monitor: ServiceMonitor) -> None:
        self._monitor = monitor
        self._sender = ReplySender()
        self._unnamed = 0
        # [s] how long questions take, before any has been answered
        self._mean = 0.05
        # [s] the longest time after which a refused client is asked to come again
        self._longest_retry = 10.0

    def later(self, client: str, work: Callable[[], None]) -> None:
        """Run a task that may block on a client in the background, after its earlier tasks.

        Parameters
        ----------
        client : str
            Identifier of the client, or name of a shared queue.
        work : callable
            The task; called without arguments.
        """
        self._sender.send(client, work)

    def refuse(
        self, question: PendingQuestion, error: CruxError, status: str | None = None
    ) -> None:
        """Reply to a question with an error.

        Parameters
        ----------
        question : PendingQuestion
            The question.
        error : CruxError
            The error in the reply.
        status : str, optional
            Status for the monitor; by default the kind of the error.
        """
        answer = question.refusal(error)
        self.reply(question, answer if status is None else answer._replace(status=status))

    def busy(self, question: PendingQuestion, ahead: float) -> None:
        """Refuse a question because its queue is full, with a time to retry after.

        The time is the mean duration of an answer times ``ahead``, from 0.05 s to 10 s.

        Parameters
        ----------
        question : PendingQuestion
            The question.
        ahead : float
            Waiting questions per worker.
        """
        again = round(min(max(self._mean * ahead, 0.05), self._longest_retry), 3)
        busy = f"the service has too many questions; ask again in {again:g} s"
        self.refuse(question, BusyError(busy, again))

    def ending(self, question: PendingQuestion) -> None:
        """Refuse a question as busy because the service is shutting down; retry after 10 s."""
        self.refuse(question, BusyError("the service is shutting down", self._longest_retry))

    def unread(self, query: AnyQuery, key: str) -> None:
        """Reply to a query that could not be read, for an unknown cause."""
        unread = CruxError("the service could not read the query; see its log")
        answer = encode_error(unread, Format.JSON, kind="internal")
        self.later(SharedQueue.UNREAD, partial(reply_to, query, key, lambda: answer))

    def part(self, question: PendingQuestion, answer: Answer) -> None:
        """Send a part of an answer in the background; the question is still to be answered."""
        query, key = question.query, question.key
        send = partial(query.reply, key, answer.payload, encoding=answer.encoding)
        self._record(question, answer, None)
        self._sender.send(self._queue_of(question), send)

    def reply(self, question: PendingQuestion, answer: Answer) -> None:
        """Send an answer to a question in the background, and count the answer."""
        if answer.seconds > 0.0:
            # a mean over about 20 questions
            self._mean += (answer.seconds - self._mean) / 20
        self._record(question, answer, question.payload)
        question.replied, question.payload = True, b""
        self._monitor.count(question, answer.status, answer.seconds)
        send = partial(reply_to, question.query, question.key, lambda: answer)
        self._sender.send(self._queue_of(question), send)

    def _record(self, question: PendingQuestion, answer: Answer, request: bytes | None) -> None:
        """Record an answer, or a part of it, unless it is published: then it is recorded there."""
        recorder = self._monitor.recorder
        if recorder is None or isinstance(question.query, PublishedWrench):
            return
        now, key, encoding = time.perf_counter(), shared_key(question.key), question.encoding
        waited = (now if question.begun < 0.0 else question.begun) - question.arrived
        age, client = now - question.arrived, question.client
        recorder.add(Exchange(key, age, encoding, request, answer, client, waited))

    def _queue_of(self, question: PendingQuestion) -> str:
        """Return the queue of all replies to a question: its client's, or one of 8 shared ones."""
        if not question.replies_by:
            self._unnamed = (self._unnamed + 1) % 8
            question.replies_by = question.place or str(self._unnamed)
        return question.replies_by

    def close(self) -> None:
        """Wait up to 1 s for replies that are being sent, and end the sender's threads."""
        # clients that do not read keep some from leaving
        self._sender.close(seconds=1.0)
