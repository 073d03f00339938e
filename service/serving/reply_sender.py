"""Send replies in threads, so that a client that takes none keeps nobody else waiting.

Zenoh's reply waits for a client whose link is full, for 5 s, after which the link is closed. So the
replies to one client go one after another, and those to others go meanwhile.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from queue import SimpleQueue

import zenoh

from hand_models.base import CruxError
from service.serving.monitor import ServiceMonitor
from service.serving.question import PendingQuestion
from service.wire import Answer, BusyError

__all__ = ["Replies", "ReplySender", "SharedQueue", "reply_to"]

log = logging.getLogger(__name__)


class SharedQueue(StrEnum):
    """Queues of what is sent to no known client."""

    OPERATORS = "operators"
    """Who asks how the service is, without a link to it."""
    UNREAD = "unread"
    """Whose query could not be read."""
    INQUIRIES = "inquiries"
    """Sessions that are asked to prove their names."""


class ReplySender:
    """Sends replies in the background. Safe to use from several threads.

    Parameters
    ----------
    threads : int, optional
        Clients that can be waited for at a time.
    """

    def __init__(self, threads: int = 32) -> None:
        self._threads = threads
        self._sent = threading.Condition()
        self._to: dict[str, deque[Callable[[], None]]] = {}
        self._clients: SimpleQueue[str | None] = SimpleQueue()
        for _ in range(self._threads):
            threading.Thread(target=self._run, name="crux-replies", daemon=True).start()

    def send(self, client: str, reply: Callable[[], None]) -> None:
        """Let a reply be sent after those to the same client that have been handed in before."""
        with self._sent:
            waiting = self._to.get(client)
            if waiting is not None:
                waiting.append(reply)
                return
            self._to[client] = deque([reply])
        self._clients.put(client)

    def close(self, seconds: float) -> None:
        """Wait until all that was handed in has been sent, but no longer than some seconds."""
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


def reply_to(query: zenoh.Query, key: str, make_answer: Callable[[], Answer]) -> None:
    """Reply to a query, and let it go."""
    with query:
        answer = make_answer()
        if answer.good:
            query.reply(key, answer.payload, encoding=answer.encoding)
        else:
            query.reply_err(answer.payload, encoding=answer.encoding)


class Replies:
    """Reply to each question once, and report every reply to a monitor.

    Parameters
    ----------
    monitor : ServiceMonitor
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
        """Let work that may wait for a client be done, after what was handed in for it before."""
        self._sender.send(client, work)

    def refuse(
        self, question: PendingQuestion, error: CruxError, status: str | None = None
    ) -> None:
        """Reply with an error; the status is its kind, unless another is given."""
        answer = question.refusal(error)
        self.reply(question, answer if status is None else answer._replace(status=status))

    def busy(self, question: PendingQuestion, ahead: float) -> None:
        """Refuse a question that has no room, for now; ``ahead``: questions for each process."""
        again = round(min(max(self._mean * ahead, 0.05), self._longest_retry), 3)
        busy = f"the service has too many questions; ask again in {again:g} s"
        self.refuse(question, BusyError(busy, again))

    def ending(self, question: PendingQuestion) -> None:
        """Refuse a question because the service is ending."""
        self.refuse(question, BusyError("the service is shutting down", self._longest_retry))

    def reply(self, question: PendingQuestion, answer: Answer) -> None:
        """Reply with an answer."""
        if answer.seconds > 0.0:
            # a mean over about 20 questions
            self._mean += (answer.seconds - self._mean) / 20
        question.replied, question.payload = True, b""
        self._monitor.count(question, answer.status, answer.seconds)
        # clients without a known name share 8 queues
        self._unnamed = (self._unnamed + 1) % 8
        send = partial(reply_to, question.query, question.key, lambda: answer)
        self._sender.send(question.place or str(self._unnamed), send)

    def close(self) -> None:
        """Wait a little for replies that are on their way."""
        # clients that do not read keep some from leaving
        self._sender.close(seconds=1.0)
