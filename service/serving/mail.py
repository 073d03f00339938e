"""What sends replies: threads in which a client that takes none keeps nobody else waiting.

Zenoh's reply waits for a client whose link is full, for 5 s, after which the link is closed. So the
replies to one client go one after another, and those to others go meanwhile.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final

import zenoh

from service.wire import Answer

__all__ = ["Mail", "reply_to"]

log = logging.getLogger(__name__)

SENDERS: Final = 32
"""Clients that can be waited for at a time."""


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


def reply_to(query: zenoh.Query, key: str, told: Callable[[], Answer]) -> None:
    """Reply to a query, and let it go."""
    with query:
        answer = told()
        if answer.good:
            query.reply(key, answer.payload, encoding=answer.encoding)
        else:
            query.reply_err(answer.payload, encoding=answer.encoding)
