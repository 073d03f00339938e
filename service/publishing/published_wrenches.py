"""Take in wrenches that clients publish on streams, and publish their set-points.

A published wrench is asked as a query is; only its reply is published. Of each stream, two wrenches
are taken in at a time, one that a worker has and one that waits. Newer ones replace each other
until there is room again, so that a slow answer makes no queue.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple, Self, cast

import msgspec
import zenoh
from zenoh.handlers import Callback

from hand_models.base import LimitError
from service.recording import Exchange
from service.replies import ErrorReply, PublishedReply, SetPointsReply
from service.requests import WrenchRequest
from service.wire import Answer, Format, MalformedError, ServiceName, check_size, stream_key

__all__ = ["PublishedWrench", "PublishedWrenches"]


class _Head(msgspec.Struct):
    """Fields of a wrench that are repeated, also if the rest of it is wrong."""

    number: int | None = None
    time: float | None = None


class _Status(msgspec.Struct):
    status: str = ""


class _Arrival(NamedTuple):
    """Wrench as it has arrived.

    Attributes
    ----------
    sample : zenoh.Sample
    at : float
        When it arrived, on the clock of `time.perf_counter` [s].
    skipped : int
        Number of wrenches before it that it has replaced.
    """

    sample: zenoh.Sample
    at: float
    skipped: int = 0


class _Incoming:
    """Wrenches of one stream: those that are taken in, and the newest that is not.

    Attributes
    ----------
    newest : _Arrival or None
        Newest wrench, if it is not yet taken in.
    asked : int
        Number of wrenches that are taken in, and not yet answered.
    waits : bool
        True if the last of them waits for a worker.
    """

    def __init__(self) -> None:
        self.newest: _Arrival | None = None
        self.asked = 0
        self.waits = False

    def take(self) -> _Arrival | None:
        """Return the newest wrench, if it is not yet taken in, and take it in."""
        found, self.newest = self.newest, None
        return found


class PublishedWrench:
    """Wrench that a client has published on a stream, with the face of a zenoh query.

    Leaving its ``with`` block makes room for the next wrench of the stream.

    Attributes
    ----------
    stream : str
        Identifier of the stream.
    arrived : float
        When the wrench arrived, on the clock of `time.perf_counter` [s].
    """

    def __init__(
        self, among: PublishedWrenches, stream: str, arrival: _Arrival, *, begun: bool = False
    ) -> None:
        self._among, self._begun, self.stream = among, begun, stream
        self._sample, self.arrived, self._skipped = arrival

    @property
    def payload(self) -> zenoh.ZBytes:
        """The encoded `WrenchRequest`."""
        return self._sample.payload

    @property
    def encoding(self) -> zenoh.Encoding:
        """Encoding of the payload."""
        return self._sample.encoding

    @property
    def attachment(self) -> zenoh.ZBytes | None:
        """Secret by which the client proves its identifier, as of a query."""
        return self._sample.attachment

    @property
    def source_info(self) -> zenoh.SourceInfo | None:
        """Identifier of the client's session, as of a query."""
        return self._sample.source_info

    def begin(self) -> Self:
        """Become the newest wrench of the stream, which skips this one; return itself.

        To be called when a worker gets the wrench.
        """
        self._begun = True
        if found := self._among.begin(self.stream):
            self._among.recorded(self.stream, self._sample, self.arrived, None)
            self._sample, self.arrived, late = found
            self._skipped += 1 + late
        return self

    def reply(self, key: str, payload: bytes, *, encoding: str) -> None:
        """Publish set-points, an encoded `SetPointsReply`.

        Parameters
        ----------
        key : str
            Key of the stream's set-points.
        payload : bytes
        encoding : str
            Zenoh encoding of the payload; the published message has the same format.
        """
        # they are encoded already
        points = cast(SetPointsReply, msgspec.Raw(payload))
        head = Format.named(encoding).decode(payload, _Status) if self._among.record else _Status()
        self._publish(encoding, head.status, set_points=points)

    def reply_err(self, payload: bytes, *, encoding: str) -> None:
        """Publish an error, an encoded `ErrorReply`; parameters as for `reply`."""
        error = Format.named(encoding).decode(payload, ErrorReply).error
        self._publish(encoding, error.kind, error=error)

    def _publish(self, encoding: str, status: str, **content: Any) -> None:
        form = Format.named(encoding)
        try:
            given = Format.named(str(self.encoding))
            head = given.decode(self.payload.to_bytes()[: 2**12], _Head)
        except (MalformedError, msgspec.ValidationError):
            head = _Head()
        message = PublishedReply(
            stream=self.stream,
            number=head.number,
            time=head.time,
            age=time.perf_counter() - self.arrived,
            skipped=self._skipped,
            server=self._among.server,
            **content,
        )
        answer = Answer(form.encode(message), form.label(message), status=status)
        self._among.recorded(self.stream, self._sample, self.arrived, answer)
        self._among.publish(self.stream, answer.payload, answer.encoding)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._among.answered(self.stream, begun=self._begun)


Ask = Callable[[PublishedWrench, str], None]


class PublishedWrenches:
    """Wrenches that clients publish on the streams of a service, and tokens of these streams.

    Parameters
    ----------
    session : zenoh.Session
        Session of the service.
    robot : str
        Name of the robot.

    Attributes
    ----------
    server : str
        Identifier of the service's session.
    record : callable or None
        Takes each wrench and its answer, to be recorded.
    """

    def __init__(self, session: zenoh.Session, robot: str) -> None:
        self._session, self._robot = session, robot
        self.server = str(session.info.zid())
        self.record: Callable[[Exchange], None] | None = None
        self._ask: Ask | None = None
        self._subscribers: list[Any] = []
        self._lock = threading.Lock()
        self._streams: dict[str, _Incoming] = {}
        # a declaration may wait for a client that does not read
        self._declaring = ThreadPoolExecutor(1, "crux-tokens")
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._own: frozenset[str] = frozenset()
        # streams that have a token, of this service or of another
        self._kept: set[str] = set()

    def take(self, ask: Ask) -> None:
        """Subscribe to wrenches.

        Parameters
        ----------
        ask : callable
            Called with each wrench and the key of its set-points, in a thread of zenoh's: it must
            not wait.
        """
        self._ask = ask
        seen, key = Callback(self._see, indirect=False), stream_key(self._robot, "*")
        tokens = self._session.liveliness().declare_subscriber(key, seen, history=True)
        came, key = Callback(self._came, indirect=False), f"{key}/{ServiceName.WRENCH}"
        self._subscribers = [tokens, self._session.declare_subscriber(key, came)]

    def close(self) -> None:
        """Take in no more wrenches, and withdraw the tokens."""
        for each in self._subscribers:
            each.undeclare()
        self.keep(())
        self._declaring.shutdown()

    def keep(self, streams: Iterable[str]) -> None:
        """Declare the liveliness tokens of these streams alone, in the background.

        Parameters
        ----------
        streams : iterable of str
            Identifiers of all streams that the service keeps.
        """
        self._own = frozenset(streams)
        self._declaring.submit(self._declare, self._own)

    def _declare(self, streams: frozenset[str]) -> None:
        for stream in self._tokens.keys() - streams:
            self._tokens.pop(stream).undeclare()
        for stream in streams - self._tokens.keys():
            key = stream_key(self._robot, stream)
            self._tokens[stream] = self._session.liveliness().declare_token(key)

    def _see(self, sample: zenoh.Sample) -> None:
        """See the token of a stream come or go."""
        stream = str(sample.key_expr).rpartition("/")[2]
        if sample.kind == zenoh.SampleKind.PUT:
            self._kept.add(stream)
        else:
            self._kept.discard(stream)

    def _came(self, sample: zenoh.Sample) -> None:
        now, stream = time.perf_counter(), str(sample.key_expr).split("/")[-2]
        # another service answers those of its streams
        elsewhere = stream in self._kept and stream not in self._own
        if sample.kind != zenoh.SampleKind.PUT or elsewhere:
            return
        try:
            check_size(len(sample.payload), WrenchRequest)
        except LimitError:
            # to be refused by itself: it replaces none that can be answered
            with self._lock:
                self._streams.setdefault(stream, _Incoming()).asked += 1
            self._give(PublishedWrench(self, stream, _Arrival(sample, now), begun=True))
            return
        with self._lock:
            known = self._streams.setdefault(stream, _Incoming())
            replaced = known.newest
            if replaced is not None:
                self.recorded(stream, replaced.sample, replaced.at, None)
            known.newest = _Arrival(sample, now, 0 if replaced is None else replaced.skipped + 1)
            wrench = self._next(stream, known)
        self._give(wrench)

    def _next(self, stream: str, known: _Incoming) -> PublishedWrench | None:
        """Take in the newest wrench, if there is one, and room for it."""
        # of two that wait, the first would take what is newer than the second
        if known.asked >= 2 or known.waits or (arrival := known.take()) is None:
            return None
        known.asked, known.waits = known.asked + 1, True
        return PublishedWrench(self, stream, arrival)

    def _give(self, wrench: PublishedWrench | None) -> None:
        if wrench is not None and self._ask is not None:
            self._ask(wrench, stream_key(self._robot, wrench.stream, ServiceName.SET_POINTS))

    def begin(self, stream: str) -> _Arrival | None:
        """Return the newest wrench of a stream, for the one that waits and now begins.

        None where the one that waits is the newest.
        """
        with self._lock:
            known = self._streams[stream]
            known.waits = False
            return known.take()

    def answered(self, stream: str, *, begun: bool) -> None:
        """Make room for the next wrench of a stream, as one has been answered.

        Parameters
        ----------
        stream : str
        begun : bool
            True if a worker had it, false if it was refused while it waited.
        """
        with self._lock:
            known = self._streams[stream]
            known.asked -= 1
            known.waits = known.waits and begun
            wrench = self._next(stream, known)
            if not known.asked:
                del self._streams[stream]
        self._give(wrench)

    def recorded(self, stream: str, sample: zenoh.Sample, at: float, answer: Answer | None) -> None:
        """Record a wrench of a stream that has arrived, with its answer if it has one."""
        if self.record is None:
            return
        key, age = stream_key(self._robot, stream, ServiceName.SET_POINTS), time.perf_counter() - at
        source = sample.source_info
        client = "" if source is None else str(source.source_id.zid)
        request, encoding = sample.payload.to_bytes(), str(sample.encoding)
        self.record(Exchange(key, age, encoding, request, answer, client))

    def publish(self, stream: str, payload: bytes, encoding: str) -> None:
        """Publish an encoded `PublishedReply` of a stream."""
        self._session.put(
            stream_key(self._robot, stream, ServiceName.SET_POINTS),
            payload,
            encoding=encoding,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )
