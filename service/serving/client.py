"""Define a typed client of the plan service: one method for each kind of request, one retry."""

from __future__ import annotations

import threading
import time
import uuid
from contextlib import suppress
from functools import partial
from typing import Self, TypeVar

import msgspec
import zenoh
from zenoh.handlers import Callback

from hand_models.base import CruxError, InvalidInputError
from service.publishing import PublishedStream
from service.replies import (
    BodySpaceReply,
    BriefPlanReply,
    CancelReply,
    ClimbReply,
    DiagnosisReply,
    HealthReply,
    PlanReply,
    RouteReply,
    SetPointsReply,
    StreamReply,
    WrenchSpaceReply,
)
from service.requests import (
    LONGEST_DEADLINE,
    BodySpaceRequest,
    CancelRequest,
    ClimbRequest,
    DiagnosisRequest,
    PlanRequest,
    Query,
    RouteRequest,
    SetPointsRequest,
    StreamRequest,
    WrenchSpaceRequest,
)
from service.servers import (
    HOW_TO_START,
    Asker,
    KeptStreams,
    LiveServers,
    Parts,
    open_session,
    why_absent,
)
from service.serving.names import ClientIdentity
from service.serving.settings import SERVING_SETTINGS
from service.wire import (
    DEFAULT_ROBOT,
    Format,
    NoServiceError,
    ServiceName,
    read_reply,
    service_key,
)

__all__ = ["CruxClient"]

QueryT = TypeVar("QueryT", bound=Query)


class CruxClient:
    """Client of a robot's plan service: sends requests over zenoh and returns typed replies.

    Use the client in a ``with`` block, or call `close`. If nobody answers a request, the client
    retries it once, after 0.3 s.

    Parameters
    ----------
    where : zenoh.Session or zenoh.Config
        An open session, which the client leaves open, or a configuration from which the client
        opens a session that `close` closes.
    robot : str, optional
        Name of the robot whose service is asked, such as ``climber``; it is the ``name`` in the
        file of a robot of your own.
    timeout : float, optional
        Longest wait for each reply [s]. By default 10 s, or 1/0.9 of the request's ``deadline`` if
        that is longer. A request without ``deadline`` is sent with a deadline of nine tenths of the
        timeout.
    form : Format, optional
        Encoding of the messages.
    wait : float, optional
        Longest wait for a service to appear, counted from this call [s]. If the configuration has
        several endpoints, they are tried in turn. Without it, the service must already run when the
        first request is sent.
    spread : bool, optional
        True to share the questions among all services of the robot that are there, in turns, each
        time one that has fewest of this client's questions. If a service ends or is too busy,
        another is asked at once, with what is left of the deadline. A stream stays at its service,
        and is declared again at another if that ends. By default zenoh's nearest service is asked.

    Attributes
    ----------
    robot, timeout, form
        The parameters of the same names.

    Raises
    ------
    InvalidInputError
        If ``wait`` is negative, not a number, or longer than `threading.TIMEOUT_MAX`.
    NoServiceError
        If no session can be opened, or no service appears within ``wait``.
    """

    def __init__(
        self,
        where: zenoh.Session | zenoh.Config,
        robot: str = DEFAULT_ROBOT,
        *,
        timeout: float | None = None,
        form: Format = Format.MSGPACK,
        wait: float | None = None,
        spread: bool = False,
    ) -> None:
        begun = time.monotonic()
        if wait is not None and not 0.0 <= wait <= threading.TIMEOUT_MAX:
            raise InvalidInputError(
                f"must be from 0 to {threading.TIMEOUT_MAX:g} s, got {wait:g}", field="wait"
            )
        self.robot = robot
        self.timeout = timeout
        self.form = form
        self._owned: zenoh.Session | None = None
        if isinstance(where, zenoh.Config):
            self._session = self._owned = self._opened(where, wait)
        else:
            self._session = where
        self._identity = ClientIdentity(self._session, robot)
        self._servers: LiveServers | None = None
        if wait is not None:
            try:
                self._await(wait, begun)
            except BaseException:
                self.close()
                raise
        if spread:
            self._servers = LiveServers(self._session, robot, SERVING_SETTINGS.search_timeout)
        self._asker = Asker(self._session, robot, form, self._identity, self._servers)
        declare = partial(self._replied, ServiceName.STREAM)
        self._streams = KeptStreams(self._asker, declare, renew=spread)

    def _opened(self, config: zenoh.Config, wait: float | None) -> zenoh.Session:
        try:
            return open_session(config, wait)
        except NoServiceError as error:
            if wait is None:
                raise NoServiceError(
                    f"{error}; {HOW_TO_START}, or wait for it (wait, --wait)"
                ) from None
            raise NoServiceError(
                f"{_not_within(self.robot, wait)} ({error}); {HOW_TO_START}"
            ) from None

    def _await(self, wait: float, begun: float) -> None:
        """Wait for the service's token, which is there when it answers."""
        there = threading.Event()

        def seen(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                there.set()

        key, taken = service_key(self.robot, ServiceName.ALIVE), Callback(seen, indirect=False)
        tokens = self._session.liveliness().declare_subscriber(key, taken, history=True)
        try:
            if not there.wait(max(wait - (time.monotonic() - begun), 0.0)):
                why = why_absent(self._session, self.robot)
                raise NoServiceError(f"{_not_within(self.robot, wait)}: {why}")
        finally:
            tokens.undeclare()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Withdraw the client's zenoh declarations; close the session if the client opened it."""
        if not self._session.is_closed():
            self._identity.withdraw()
            if self._servers is not None:
                self._servers.close()
        if self._owned is not None:
            self._owned.close()

    def plan(self, request: PlanRequest) -> PlanReply | BriefPlanReply:
        """Send a plan request and return the service's plan.

        Returns
        -------
        PlanReply or BriefPlanReply
            A `BriefPlanReply` where the request asks for less ``detail``, or where the whole plan
            is larger than the request's ``max_reply_bytes`` and the request names no ``detail``.

        Raises
        ------
        ServiceError
            If the service refuses the request or fails on it; a busy service sets ``retry_after``.
        NoServiceError
            If nobody answers, not even the retry.
        ServiceTimeout
            If no reply comes within the timeout.
        LimitError
            If the encoded request has too many bytes.
        """
        received = self._ask(ServiceName.PLAN, request)
        if Format.is_labelled(str(received.encoding), BriefPlanReply):
            return read_reply(received, BriefPlanReply)
        return read_reply(received, PlanReply)

    def wrench_space(self, request: WrenchSpaceRequest) -> WrenchSpaceReply:
        """Send a request for one hand's wrench space and return the reply.

        Raises the errors that `plan` raises.
        """
        return read_reply(self._ask(ServiceName.WRENCH_SPACE, request), WrenchSpaceReply)

    def body_space(self, request: BodySpaceRequest) -> BodySpaceReply:
        """Send a request for a stance's body space and return the reply.

        Raises the errors that `plan` raises.
        """
        return read_reply(self._ask(ServiceName.BODY_SPACE, request), BodySpaceReply)

    def route(self, request: RouteRequest, parts: Parts | None = None) -> RouteReply:
        """Send a request for a climb and return its stages, and the trajectory if it is wanted.

        Parameters
        ----------
        request : RouteRequest
        parts : callable, optional
            Takes the knots of a trajectory move by move, as soon as they are planned; the reply
            then has none. By default the reply has all.

        Raises
        ------
        CruxError
            As `plan` raises.
        """
        if parts is not None:
            request = msgspec.structs.replace(request, parts=True)
        return read_reply(self._ask(ServiceName.ROUTE, request, parts), RouteReply)

    def climb(self, request: ClimbRequest, parts: Parts | None = None) -> ClimbReply:
        """Search for the best climb on a rock and return it, with a bound of every other.

        An exception meanwhile, such as Ctrl-C or one of ``parts``, cancels the search.

        Parameters
        ----------
        request : ClimbRequest
            Without ``deadline`` and `timeout`, it is sent with the longest deadline there is.
        parts : callable, optional
            Takes how far the search is, several times a second at most; and the knots of a
            trajectory move by move, which the reply then leaves out.

        Raises
        ------
        CruxError
            As `plan` raises.
        """
        if parts is not None:
            request = msgspec.structs.replace(request, parts=True)
        if request.deadline is None and self.timeout is None:
            request = msgspec.structs.replace(request, deadline=LONGEST_DEADLINE)
        identifier = request.id or uuid.uuid4().hex
        request = msgspec.structs.replace(request, id=identifier)
        try:
            return read_reply(self._ask(ServiceName.CLIMB, request, parts), ClimbReply)
        except CruxError:
            raise
        except BaseException:
            # a service that has ended needs no word
            with suppress(CruxError):
                self.cancel(identifier)
            raise

    def cancel(self, identifier: str) -> int:
        """Cancel this client's questions of an ``id``: those that wait, and climbs in work.

        Returns
        -------
        int
            Number of questions that have ended by this, with errors of kind ``cancelled``.

        Raises
        ------
        CruxError
            As `plan` raises.
        """
        request, name = CancelRequest(v=1, id=identifier), ServiceName.CANCEL
        waits = self.timeout or SERVING_SETTINGS.client_timeout
        servers = () if self._servers is None else self._servers.names()
        replies = []
        for each in servers:
            # any of them may have the question, also if another has just ended
            with suppress(CruxError):
                replies.append(self._asker.ask_one(each, name, request, waits))
        if not any(replies):
            replies = [self._asker.ask(name, request, waits)]
        samples = [each.ok for each in replies if each is not None and each.ok is not None]
        return sum(read_reply(each, CancelReply).cancelled for each in samples)

    def stream(self, request: StreamRequest) -> StreamReply:
        """Declare a stance as a stream of body wrenches; the reply has the stream's identifier.

        Raises the errors that `plan` raises.
        """
        return self._streams.declare(request)[0]

    def publish_stream(self, request: StreamRequest) -> PublishedStream:
        """Declare a stream as `stream` does, to publish its wrenches; it takes up again by itself.

        Raises the errors that `plan` raises.
        """
        declare, identity = partial(self._streams.declare, request), self._identity
        return PublishedStream(self._session, self.robot, declare, self.form, identity)

    def set_points(self, request: SetPointsRequest) -> SetPointsReply:
        """Ask a declared stream for the set-points of one body wrench and return the reply.

        Raises the errors that `plan` raises.
        """
        return self._streams.set_points(*self._timed(request))

    def diagnosis(self, request: DiagnosisRequest) -> DiagnosisReply:
        """Ask which tile has probably slipped, by the data of motors, and return the reply.

        Raises the errors that `plan` raises.
        """
        return read_reply(self._ask(ServiceName.DIAGNOSIS, request), DiagnosisReply)

    def health(self) -> HealthReply:
        """Return the health of a service: workers, queue, streams, the last failure.

        It is that of zenoh's nearest service, which an observer may ask, too.

        Raises
        ------
        NoServiceError
            If nobody answers within the client's timeout.
        """
        waits = self.timeout or SERVING_SETTINGS.client_timeout
        return read_reply(self._asker.look(ServiceName.HEALTH, waits), HealthReply)

    def _replied(self, name: str, request: Query) -> zenoh.Reply:
        return self._asker.ask(name, *self._timed(request))

    def _ask(self, name: str, request: Query, parts: Parts | None = None) -> zenoh.Sample:
        """Return the reply that is no error; raise what `plan` raises."""
        sample = self._asker.ask(name, *self._timed(request), parts).ok
        assert sample is not None
        return sample

    def _timed(self, request: QueryT) -> tuple[QueryT, float]:
        """Return a request with a deadline, and how long its reply is waited for [s]."""
        waits = self.timeout
        # of the time that the client waits, for the answer
        part = 0.9
        if waits is None:
            waits = max(SERVING_SETTINGS.client_timeout, (request.deadline or 0.0) / part)
        if request.deadline is None:
            # nobody waits for an answer that comes later
            own = min(part * waits, LONGEST_DEADLINE)
            request = msgspec.structs.replace(request, deadline=own)
        return request, waits


def _not_within(robot: str, wait: float) -> str:
    return f"no service of {robot} within {wait:g} s"
