"""Ask a client's streams at the services that keep them; declare them again where one has ended."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, TimeoutError as FutureTimeout
from typing import Final

import msgspec
import zenoh
from cachetools import LRUCache

from hand_models.base import CruxError
from service.replies import SetPointsReply, StreamReply
from service.requests import SetPointsRequest, StreamRequest
from service.servers.asking import Asker
from service.wire import ServiceName, ServiceTimeout, read_reply

__all__ = ["KeptStreams"]

REMEMBERED_STREAMS: Final = 64
"""Number of streams of a client of which it is known where they are kept: an LRU cache."""


class _Kept:
    """Place of a stream: its service, its identifier there, and a declaration again in work."""

    def __init__(self, request: StreamRequest, stream: str, server: str) -> None:
        self.request, self.stream, self.server = request, stream, server
        self.again: Future[None] | None = None


class KeptStreams:
    """Streams that a client has declared. Safe to use from several threads.

    Parameters
    ----------
    asker : Asker
    renew : bool
        True to declare a stream again, at another service, if the one that keeps it has ended or
        does not know it any more.
    declare : callable
        Declares a stream at a service that is there; returns the service's reply.
    """

    def __init__(
        self, asker: Asker, declare: Callable[[StreamRequest], zenoh.Reply], *, renew: bool
    ) -> None:
        self._asker, self._declare, self._renew = asker, declare, renew
        self._lock = threading.Lock()
        self._kept: LRUCache[str, _Kept] = LRUCache(REMEMBERED_STREAMS)

    def declare(self, request: StreamRequest) -> tuple[StreamReply, str]:
        """Declare a stream; return the reply, and the identifier of the service that keeps it."""
        received = self._declare(request)
        assert received.ok is not None
        reply = read_reply(received.ok, StreamReply)
        replier = received.replier_id
        server = "" if replier is None else str(replier.zid)
        with self._lock:
            self._kept[reply.stream] = _Kept(request, reply.stream, server)
        return reply, server

    def set_points(self, request: SetPointsRequest, waits: float) -> SetPointsReply:
        """Return the set-points of a stream, from the service that keeps it.

        Parameters
        ----------
        request : SetPointsRequest
        waits : float
            Longest wait [s].

        Raises
        ------
        CruxError
            As `CruxClient.set_points` raises.
        """
        begun = time.monotonic()
        with self._lock:
            kept = self._kept.get(request.stream)
        if kept is None or not kept.server:
            return _read(self._asker.ask(ServiceName.SET_POINTS, request, waits))
        if kept.again is None and (found := self._at(kept, request, waits)) is not None:
            return found
        if not self._renew:
            return _read(self._asker.ask(ServiceName.SET_POINTS, request, waits))
        left = min(waits, request.deadline or waits) - (time.monotonic() - begun)
        self._wait_for(kept, left)
        left = min(waits, request.deadline or waits) - (time.monotonic() - begun)
        late = msgspec.structs.replace(request, deadline=max(left, 1e-3))
        if (found := self._at(kept, late, left)) is None:
            return _read(self._asker.ask(ServiceName.SET_POINTS, late, left))
        return found

    def _at(self, kept: _Kept, request: SetPointsRequest, waits: float) -> SetPointsReply | None:
        """Return the set-points of the service that keeps a stream; None if it has them no more."""
        asked = msgspec.structs.replace(request, stream=kept.stream)
        try:
            reply = self._asker.ask_one(kept.server, ServiceName.SET_POINTS, asked, waits)
        except CruxError as error:
            if self._renew and error.field == "stream":
                return None
            raise
        if reply is None:
            return None
        found = _read(reply)
        found.stream = request.stream
        return found

    def _wait_for(self, kept: _Kept, left: float) -> None:
        """Wait until a stream is declared again, which goes on also if that takes longer."""
        with self._lock:
            if kept.again is None:
                again = kept.again = Future()
                work = (kept, again)
                threading.Thread(target=self._again, args=work, name="crux-stream").start()
        again = kept.again
        if again is None:
            return
        try:
            again.result(timeout=max(left, 0.0))
        except FutureTimeout:
            raise ServiceTimeout(
                f"the service of stream {kept.stream} ended; the stream is being declared at "
                "another: ask again"
            ) from None

    def _again(self, kept: _Kept, done: Future[None]) -> None:
        try:
            reply, server = self.declare(kept.request)
            kept.stream, kept.server = reply.stream, server
        except Exception as error:
            kept.again = None
            done.set_exception(error)
        else:
            kept.again = None
            done.set_result(None)


def _read(reply: zenoh.Reply) -> SetPointsReply:
    assert reply.ok is not None
    return read_reply(reply.ok, SetPointsReply)
