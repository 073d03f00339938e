"""Publish body wrenches on a stream and take its set-points, at a client of the service."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Protocol, Self

import zenoh
from msgspec import UNSET
from msgspec.structs import replace
from zenoh.handlers import Callback

from hand_models.base import CruxError, InvalidInputError
from planner import LostTile
from service.replies import PublishedReply, StreamReply
from service.requests import Detail, WrenchRequest
from service.wire import (
    REQUEST_KINDS,
    Format,
    ServiceName,
    read_reply,
    service_key,
    stream_key,
)

__all__ = ["PublishedStream"]


class _Identity(Protocol):
    """Secret and numbered sources by which a service knows a client."""

    secret: bytes

    def source(self) -> zenoh.SourceInfo: ...


class PublishedStream:
    """Stream of a client: wrenches are published, and set-points come, the newest first.

    If the service no longer keeps the stream, because it was restarted, has lost the worker or has
    put the stream out, a thread declares it again, and publishes the newest wrench again if that
    has no answer. Use it in a ``with`` block, or call `close`. Safe to use from several threads.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot.
    declare : callable
        Declares the stream; returns the reply, and the identifier of the service that keeps it.
    form : Format
        Encoding of the wrenches.
    identity : object
        The client's ``secret`` and next ``source()``.

    Attributes
    ----------
    declared : StreamReply
        Reply to the newest declaration.
    declarations : int
        How often the stream has been declared.
    lost : int
        Number of wrenches that have no answer and are not counted as skipped either: lost on the
        way, with the service, or while the stream was declared again.
    replaced : int
        Number of answers that newer ones replaced before they were received; the wrenches that they
        had skipped are counted as skipped by the answer that is received.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        declare: Callable[[], tuple[StreamReply, str]],
        form: Format,
        identity: _Identity,
    ) -> None:
        self._session, self._robot, self._declare = session, robot, declare
        self._form, self._identity = form, identity
        self._changed = threading.Condition()
        self._service_came = threading.Event()
        self._newest: WrenchRequest | None = None
        self._published = -1
        self._times: deque[tuple[int, float]] = deque(maxlen=4096)
        """Numbers and times of wrenches that may still be answered."""
        self._unread: PublishedReply | None = None
        self._fault: CruxError | None = None
        self._junk: CruxError | None = None
        """Why the last message could not be read, until that is said."""
        self._last = -1
        self._away = self._closed = False
        self.lost = self.replaced = 0
        self.declarations = 1
        self.declared, self._server = declare()
        self._points = self._subscribed()
        liveliness = session.liveliness()
        self._tokens = [
            # without history, a client does not see a token go that was there before
            liveliness.declare_subscriber(key, Callback(seen, indirect=False), history=True)
            for key, seen in (
                (stream_key(robot, "*"), self._see_stream),
                (service_key(robot, ServiceName.ALIVE), self._see_service),
            )
        ]
        self._thread = threading.Thread(target=self._keep, name="crux-stream", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def away(self) -> bool:
        """True while no service is known to keep the stream: nothing that is published is answered.

        It becomes true when the service's token of the stream is gone, at once where a link breaks,
        and within 10 s where a machine is cut off; false once the stream is declared again.
        """
        with self._changed:
            return self._away

    def close(self) -> None:
        """Publish and receive no more; the service keeps the stream until others put it out."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._service_came.set()
        if not self._session.is_closed():
            for each in (self._points, *self._tokens):
                with suppress(zenoh.ZError):
                    each.undeclare()

    def publish(
        self,
        body_wrench: Sequence[float],
        lost: Sequence[LostTile] = (),
        detail: Detail | None = None,
    ) -> int:
        """Publish a body wrench; returns without waiting for its set-points.

        Parameters
        ----------
        body_wrench : sequence of float
            Wrench that the rock must exert on the robot, in B [N, N·m].
        lost : sequence of LostTile, optional
            All tiles that have slipped, besides those of the declaration.
        detail : {'set_points', 'hands', 'full'}, optional
            How much the set-points have, as of `CruxClient.set_points`.

        Returns
        -------
        int
            Number of the wrench; from zero, one more each time.

        Raises
        ------
        CruxError
            If the stream could not be declared again, or is closed.
        """
        with self._changed:
            if self._fault is not None:
                raise self._fault
            if self._closed:
                raise InvalidInputError("is closed; declare another stream", field="stream")
            self._published += 1
            now = time.time()
            self._times.append((self._published, now))
            wrench = self._newest = WrenchRequest(
                v=1,
                number=self._published,
                time=now,
                # numbers of NumPy's own are not of the wire
                body_wrench=tuple(map(float, body_wrench)),  # type: ignore[arg-type]
                detail=detail,
                lost=list(lost),
            )
        self._send(wrench)
        return wrench.number

    def receive(self, timeout: float | None = None) -> PublishedReply | None:
        """Return the newest set-points, or error, that have not been returned before.

        Parameters
        ----------
        timeout : float, optional
            Longest time to wait for any [s]; unlimited by default.

        Returns
        -------
        PublishedReply or None
            None if none has come: there are no news, or no service, if `away` is true.

        Raises
        ------
        CruxError
            If the stream could not be declared again; once, if a message is none of a service's.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: self._unread or self._junk or self._fault or self._closed, timeout
            )
            if self._fault is not None:
                raise self._fault
            if self._junk is not None:
                junk, self._junk = self._junk, None
                raise junk
            found, self._unread = self._unread, None
            return found

    def _send(self, wrench: WrenchRequest) -> None:
        self._session.put(
            stream_key(self._robot, self.declared.stream, ServiceName.WRENCH),
            self._form.encode(wrench),
            encoding=self._form.label(wrench),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
            attachment=self._identity.secret,
            source_info=self._identity.source(),
        )

    def _subscribed(self) -> Any:
        key = stream_key(self._robot, self.declared.stream, ServiceName.SET_POINTS)
        return self._session.declare_subscriber(key, Callback(self._received, indirect=False))

    def _received(self, sample: zenoh.Sample) -> None:
        with self._changed:
            try:
                reply = read_reply(sample, PublishedReply)
            except CruxError as error:
                self._junk = error
                self._changed.notify_all()
                return
            number = -1 if reply.number is None else reply.number
            # of another one's wrenches, numbers may be larger
            late = 0 <= number < self._last or number > self._published
            if reply.stream != self.declared.stream or late or self._is_others(number, reply.time):
                return
            if reply.error is not None and reply.error.field == "stream":
                # another service may not know yet that it is not its own
                self._away |= reply.server in (UNSET, self._server)
            else:
                if number >= 0:
                    self.lost += max(number - self._last - 1 - reply.skipped, 0)
                    self._last = number
                unread = self._unread
                if unread is not None and unread.number is not None:
                    self.replaced += 1
                    reply = replace(reply, skipped=reply.skipped + unread.skipped)
                self._unread = reply
            self._changed.notify_all()

    def _is_others(self, number: int, at: float | None) -> bool:
        """Return whether a number is that of another one's wrench: it has another time."""
        while self._times and self._times[0][0] < number:
            self._times.popleft()
        return bool(self._times and self._times[0][0] == number and self._times[0][1] != at)

    def _see_stream(self, sample: zenoh.Sample) -> None:
        """See the token of a stream come or go: a link that is there again has lost nothing."""
        with self._changed:
            if str(sample.key_expr) == stream_key(self._robot, self.declared.stream):
                self._away = sample.kind == zenoh.SampleKind.DELETE
                self._changed.notify_all()

    def _see_service(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.PUT:
            self._service_came.set()

    def _keep(self) -> None:
        """Declare the stream again whenever the service does not keep it."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._away or self._closed)
                if self._closed:
                    return
            self._service_came.clear()
            try:
                self._renew(*self._declare())
            except CruxError as error:
                if error.kind in REQUEST_KINDS:
                    with self._changed:
                        self._fault = error
                        self._changed.notify_all()
                    return
                # [s] a service that is busy, or whose token is not seen, is asked again then
                self._service_came.wait(1.0)
            except zenoh.ZError:
                # the session may be closed before this is
                self._service_came.wait(1.0)

    def _renew(self, declared: StreamReply, server: str) -> None:
        with self._changed:
            if self._closed:
                return
            self._server = server
            before, self.declared, self._away = self._points, declared, False
            self.declarations += 1
        points = self._subscribed()
        with self._changed:
            self._points, wrench, last = points, self._newest, self._last
            ends = points if self._closed else before
        with suppress(zenoh.ZError):
            ends.undeclare()
        if wrench is not None and wrench.number > last:
            self._send(wrench)
