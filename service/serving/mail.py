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
from typing import Final

import zenoh

from hand_models.base import CruxError
from service.serving.question import PendingQuestion
from service.serving.watch import Watch
from service.wire import Answer, BusyError

__all__ = ["Mail", "Replies", "Sender", "reply_to"]

log = logging.getLogger(__name__)

SENDERS: Final = 32
"""Clients that can be waited for at a time."""

UNNAMED: Final = 8
"""Reply queues that clients without a known name share."""

FIRST_GUESS: Final = 0.05
"""How long questions take, before any has been answered [s]."""

AVERAGED: Final = 20
"""About how many questions the mean time is averaged over."""

COME_AGAIN: Final = (0.05, 10.0)
"""Least and longest time after which a refused client is asked to come again [s]."""

MAILS: Final = 1.0
"""How long the end waits for replies that are on their way [s]; clients that do not read keep some
from leaving."""


class Sender(StrEnum):
    """Queues of what is sent to no known client."""

    OPERATORS = "operators"
    """Who asks how the service is, without a link to it."""
    UNREAD = "unread"
    """Whose query could not be read."""
    INQUIRIES = "inquiries"
    """Sessions that are asked to prove their names."""


class Mail:
    """Sends replies in the background. Safe to use from several threads."""

    def __init__(self) -> None:
        self._sent = threading.Condition()
        self._to: dict[str, deque[Callable[[], None]]] = {}
        self._clients: SimpleQueue[str | None] = SimpleQueue()
        for _ in range(SENDERS):
            threading.Thread(target=self._run, name="crux-mail", daemon=True).start()

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
        for _ in range(SENDERS):
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
    """Reply to each question once, and report every reply to a watch.

    Parameters
    ----------
    watch : Watch
    """

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._mail = Mail()
        self._unnamed = 0
        self._mean = FIRST_GUESS

    def later(self, client: str, work: Callable[[], None]) -> None:
        """Let work that may wait for a client be done, after what was handed in for it before."""
        self._mail.send(client, work)

    def refuse(
        self, question: PendingQuestion, error: CruxError, status: str | None = None
    ) -> None:
        """Reply with an error; the status is its kind, unless another is given."""
        answer = question.refusal(error)
        self.reply(question, answer if status is None else answer._replace(status=status))

    def busy(self, question: PendingQuestion, ahead: float) -> None:
        """Refuse a question that has no room, for now; ``ahead``: questions for each process."""
        low, high = COME_AGAIN
        again = round(min(max(self._mean * ahead, low), high), 3)
        busy = f"the service has too many questions; ask again in {again:g} s"
        self.refuse(question, BusyError(busy, again))

    def ending(self, question: PendingQuestion) -> None:
        """Refuse a question because the service is ending."""
        self.refuse(question, BusyError("the service is shutting down", COME_AGAIN[-1]))

    def reply(self, question: PendingQuestion, answer: Answer) -> None:
        """Reply with an answer."""
        if answer.seconds > 0.0:
            self._mean += (answer.seconds - self._mean) / AVERAGED
        question.replied, question.payload = True, b""
        self._watch.count(question, answer.status, answer.seconds)
        self._unnamed = (self._unnamed + 1) % UNNAMED
        send = partial(reply_to, question.query, question.key, lambda: answer)
        self._mail.send(question.place or str(self._unnamed), send)

    def close(self) -> None:
        """Wait a little for replies that are on their way."""
        self._mail.close(MAILS)
