"""Ask a question over zenoh, again where a service ends, within what is left of its deadline."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from queue import SimpleQueue
from typing import Final, Protocol

import msgspec
import zenoh
from msgspec import UNSET
from zenoh.handlers import Callback

from hand_models.base import CruxError
from service.replies import ErrorReply, PartReply
from service.requests import Request
from service.servers.absence import silence_in_words
from service.servers.live_servers import LiveServers
from service.wire import (
    Format,
    NoServiceError,
    ServiceError,
    ServiceTimeout,
    check_size,
    read_reply,
    server_key,
    service_key,
)

__all__ = ["Asker", "Identity", "Parts"]

Parts = Callable[[PartReply], None]
RETRY_AFTER: Final = 0.3
"""A service that has just come back needs so long until it is reached [s]."""


class Identity(Protocol):
    """Secret and numbered sources by which a service knows a client."""

    secret: bytes

    def source(self) -> zenoh.SourceInfo: ...


class Asker:
    """Sender of a client's questions. Safe to use from several threads.

    Parameters
    ----------
    session : zenoh.Session
        The client's session.
    robot : str
        Name of the robot.
    form : Format
        Encoding of the requests.
    identity : Identity
        What proves who asks.
    servers : LiveServers, optional
        Services among which the questions are spread; by default zenoh's nearest is asked.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        form: Format,
        identity: Identity,
        servers: LiveServers | None = None,
    ) -> None:
        self._session, self._robot, self._form = session, robot, form
        self._identity, self._servers = identity, servers

    def ask(
        self, name: str, request: Request, waits: float, parts: Parts | None = None
    ) -> zenoh.Reply:
        """Return the reply to a request that is no error.

        A question whose service ends is asked again, at once where there is another service to
        ask. So is one that a service is too busy for. Nothing is asked again after a part of its
        reply has come.

        Parameters
        ----------
        name : str
            Kind of the question.
        request : Request
        waits : float
            Longest wait, for all attempts together [s].
        parts : callable, optional
            Takes the parts that come before the last reply.

        Raises
        ------
        CruxError
            As `CruxClient.plan` raises.
        """
        attempt = _Attempt(name, request, waits, parts)
        tried: list[str] = []
        refused: CruxError | None = None
        servers = self._servers
        while servers is not None and (server := servers.next(tried)) is not None:
            tried.append(server)
            reply = self._at(server, attempt)
            if reply is None:
                continue
            if reply.ok is not None:
                return reply
            error = _error(reply)
            ended = error.kind == "lost" and server not in servers.names()
            if error.kind != "busy" and not ended:
                raise error
            refused = error
        if refused is not None:
            raise refused
        for pause in (0.0, RETRY_AFTER):
            time.sleep(pause)
            reply = self._get(service_key(self._robot, name), attempt)
            if reply is not None:
                return _good(reply)
        raise NoServiceError(silence_in_words(self._session, self._robot, name))

    def ask_one(self, server: str, name: str, request: Request, waits: float) -> zenoh.Reply | None:
        """Return the reply of one service that is no error; None if it does not reply.

        Parameters and errors are those of `ask`; ``server`` is the service's identifier.
        """
        reply = self._at(server, _Attempt(name, request, waits, None))
        return None if reply is None else _good(reply)

    def look(self, name: str, waits: float) -> zenoh.Sample:
        """Return the reply of the nearest service at a key that takes no request.

        Raises
        ------
        NoServiceError
            If nobody answers within the longest wait ``waits`` [s].
        """
        for reply in self._session.get(service_key(self._robot, name), timeout=waits):
            if reply.ok is not None:
                return reply.ok
        raise NoServiceError(silence_in_words(self._session, self._robot, name))

    def _at(self, server: str, attempt: _Attempt) -> zenoh.Reply | None:
        """Return the last reply of one service, or None."""
        asking = nullcontext() if self._servers is None else self._servers.asking(server)
        with asking:
            try:
                return self._get(server_key(self._robot, server, attempt.name), attempt)
            except ServiceTimeout:
                if self._servers is not None:
                    self._servers.doubt(server)
                raise

    def _get(self, key: str, attempt: _Attempt) -> zenoh.Reply | None:
        """Return the first last reply that is no error, else the first error, or None without any.

        Parts that come before it are taken of one server.
        """
        request, waits = attempt.next(key)
        payload, parts = self._form.encode(request), attempt.parts
        # what is larger, a service does not take in, and so cannot answer
        check_size(len(payload), type(request))
        replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
        self._session.get(
            key,
            Callback(replies.put, lambda: replies.put(None), indirect=False),
            payload=payload,
            encoding=self._form.label(request),
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=waits,
            source_info=self._identity.source(),
            attachment=self._identity.secret,
        )
        error = server = None
        while (reply := replies.get()) is not None:
            if reply.ok is None:
                # of servers that are linked, one may not know the stream that another has
                error = error or reply
            elif server not in (None, str(reply.replier_id)):
                continue
            elif parts is None or not Format.is_labelled(str(reply.ok.encoding), PartReply):
                return reply
            else:
                server = str(reply.replier_id)
                parts(read_reply(reply.ok, PartReply))
        if error is not None and not _is_crux(error):
            # an error of zenoh's own, in a plain string: of time that is over, or of a service that
            # was killed
            attempt.check_time(key)
            error = None
        if server is not None and error is None:
            raise NoServiceError(f"the service at {key} ended before it had answered; ask again")
        return error


class _Attempt:
    """A question, with the time that is left for it when it is sent.

    Parameters
    ----------
    name : str
    request : Request
    waits : float
    parts : callable or None
        Parameters of `Asker.ask`.
    """

    def __init__(self, name: str, request: Request, waits: float, parts: Parts | None) -> None:
        self.name, self.parts = name, parts
        self._request, self._waits, self._begun = request, waits, time.monotonic()
        self._sent = 0

    def next(self, key: str) -> tuple[Request, float]:
        """Return the request with what is left of its deadline, and how long is waited for it [s].

        Raises
        ------
        ServiceTimeout
            If nothing is left.
        """
        self._sent += 1
        if self._sent == 1:
            return self._request, self._waits
        passed = time.monotonic() - self._begun
        deadline = getattr(self._request, "deadline", None)
        if deadline is None:
            left, request = self._waits - passed, self._request
        else:
            left = deadline - passed
            request = msgspec.structs.replace(self._request, deadline=left)
        if left <= 0.0:
            raise ServiceTimeout(
                f"no answer at {key} within its deadline: a service that had the question ended"
            )
        return request, self._waits - passed

    def check_time(self, key: str) -> None:
        """Raise a `ServiceTimeout` if the time that the client waits is over."""
        # zenoh's clock may be a little before this one
        if time.monotonic() - self._begun >= 0.99 * self._waits:
            raise ServiceTimeout(
                f"no answer at {key} within {self._waits:g} s; wait longer (timeout, --timeout)"
            )


def _is_crux(reply: zenoh.Reply) -> bool:
    """Return whether an error is a service's, and not zenoh's own."""
    return reply.err is not None and str(reply.err.encoding).startswith("application/")


def _good(reply: zenoh.Reply) -> zenoh.Reply:
    """Return a reply that is no error; raise one that is."""
    if reply.ok is None:
        raise _error(reply)
    return reply


def _error(reply: zenoh.Reply) -> ServiceError:
    """Return the error of an error reply."""
    assert reply.err is not None
    detail = read_reply(reply.err, ErrorReply).error
    return ServiceError(
        detail.kind,
        detail.message,
        field=detail.field,
        retry_after=None if detail.retry_after is UNSET else detail.retry_after,
    )
