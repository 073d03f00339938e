"""Take events from other threads into one thread, which they wake by a socket."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from queue import Empty, SimpleQueue
from socket import socketpair

__all__ = ["Inbox"]


class Inbox:
    """Events that other threads post, for one thread that takes them in.

    Attributes
    ----------
    bell : socket.socket
        Readable while there may be events.
    """

    def __init__(self) -> None:
        self._events: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self.bell, self._waker = socketpair()
        self.bell.setblocking(False)
        self._ringing = threading.Lock()
        self._rung = False

    def post(self, event: Callable[[], None]) -> None:
        """Add an event, to be called in the thread that takes it in; from any thread, at once."""
        self._events.put(event)
        self._ring()

    @property
    def empty(self) -> bool:
        """True if no event is left."""
        return self._events.empty()

    def take(self) -> Iterator[Callable[[], None]]:
        """Yield the events that have come, but 32 at most: the rest keeps the bell readable."""
        with suppress(BlockingIOError):
            self.bell.recv(1)
        with self._ringing:
            self._rung = False
        # most events that are taken in before processes are looked at again
        for _ in range(32):
            try:
                yield self._events.get_nowait()
            except Empty:
                return
        self._ring()

    def _ring(self) -> None:
        with self._ringing:
            if not self._rung:
                self._rung = True
                self._waker.send(b"!")
