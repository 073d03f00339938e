"""Describe a query that waits for a worker, with the few fields that are read before its turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
import zenoh

from hand_models.base import CruxError, LimitError
from planner import objective_needs
from service.answering import SERVICES_BY_NAME
from service.processes import Job
from service.publishing import PublishedWrench
from service.requests import LEAST_REPLY_BYTES, LONGEST_DEADLINE, CancelRequest, WrenchRequest
from service.ros2 import RosQuestion
from service.serving.settings import SERVING_SETTINGS
from service.wire import (
    LARGEST_ERROR,
    Answer,
    Format,
    MalformedError,
    ServiceName,
    check_size,
    encode_error,
)

__all__ = ["AnyQuery", "PendingQuestion", "client_of", "received_question"]

AnyQuery = zenoh.Query | PublishedWrench | RosQuestion
"""What is answered: a query, a published wrench, whose answer is published, or a ROS 2 caller's."""


class _Head(msgspec.Struct):
    """Fields of a request that decide when it is answered."""

    id: msgspec.Raw = msgspec.Raw()
    deadline: msgspec.Raw = msgspec.Raw()
    max_reply_bytes: msgspec.Raw = msgspec.Raw()
    want: msgspec.Raw = msgspec.Raw()
    objective: msgspec.Raw = msgspec.Raw()
    stance: msgspec.Raw = msgspec.Raw()


@dataclass(eq=False, slots=True)
class PendingQuestion:
    """Query that has arrived at a service and is not yet answered.

    All times are on the clock of `time.perf_counter` [s].

    Attributes
    ----------
    query : zenoh.Query, PublishedWrench or RosQuestion
        The query, which gets exactly one last reply, and before it parts if it asks for them.
    key : str
        Key at which the query arrived.
    name : str
        Last part of the key: the kind of question.
    client : str
        Identifier of the client's session, as the query gives it; empty without one.
    place : str
        Client for which the question counts when workers' time is shared; empty for clients that
        cannot be distinguished.
    caller : bytes
        Global identifier of the caller by ROS 2; empty for other clients.
    secret : bytes
        Secret by which the client proves its identifier; empty without one.
    arrived : float
        Time of arrival.
    payload : bytes
        Encoded request; emptied after the reply.
    encoding : str
        Zenoh's name of the payload's encoding.
    seconds : float
        Deadline, from the arrival [s].
    id : str or None
        The request's ``id``.
    most : int
        Largest size of an error reply [bytes].
    stance : int or None
        Hash of the request's stance; None where the stance could not be read.
    dear : bool
        True if the question may take long.
    rehearsed : bool
        True for the declaration of a stream that another worker has already planned successfully.
    fault : LimitError or None
        Error for a payload or an attachment with too many bytes, whose bytes are then not kept.
    replied : bool
        True after the last reply.
    replies_by : str
        Queue by which all replies to the question are sent; empty before the first.
    begun : float
        Time at which a worker got the question; negative before.
    """

    query: AnyQuery
    key: str
    name: str
    client: str
    arrived: float
    payload: bytes
    encoding: str
    seconds: float
    id: str | None = None
    most: int = LARGEST_ERROR
    stance: int | None = None
    dear: bool = False
    rehearsed: bool = False
    fault: LimitError | None = None
    replied: bool = False
    replies_by: str = ""
    begun: float = -1.0
    place: str = ""
    secret: bytes = b""
    caller: bytes = b""

    @property
    def deadline(self) -> float:
        """Time at which the question's deadline ends, on the clock of `time.perf_counter` [s]."""
        return self.arrived + self.seconds

    @property
    def form(self) -> Format:
        """Format of the payload; JSON where the encoding is unknown."""
        try:
            return Format.named(self.encoding)
        except MalformedError:
            return Format.JSON

    def refusal(self, error: CruxError) -> Answer:
        """Return an error as an encoded answer, in the question's format and with its ``id``."""
        return encode_error(error, self.form, self.id, most=self.most)

    def job(self, now: float, connected: Callable[[], frozenset[str]]) -> Job:
        """Return the question as a job for a worker; of a stream's wrenches, with the newest.

        Parameters
        ----------
        now : float
            Present time on the clock of `time.perf_counter` [s].
        connected : callable
            Returns the clients that are connected; called for a declaration of a stream, which the
            worker must release again unless it is ``rehearsed``.
        """
        stream = None
        if isinstance(self.query, PublishedWrench):
            stream, newest = self.query.stream, self.query.begin()
            self.payload, self.encoding = newest.payload.to_bytes(), str(newest.encoding)
            self.arrived = self.query.arrived
        waited = now - self.arrived
        declares = self.name == ServiceName.STREAM
        return Job(
            self.name,
            self.payload,
            self.encoding,
            waited,
            self.seconds,
            declares and not self.rehearsed,
            self.place,
            stream,
            connected() if declares else None,
        )


def client_of(query: AnyQuery) -> str:
    """Return the session identifier of a query's client; empty where the query has none."""
    source = query.source_info
    return "" if source is None else str(source.source_id.zid)


def received_question(query: AnyQuery, key: str, arrived: float, longest: float) -> PendingQuestion:
    """Return a query as a pending question, with its payload copied and its main fields read.

    Payloads above 1 MiB are not decoded here, except for climbs; a worker reads them. A payload or
    attachment with too many bytes is not copied, and the question's ``fault`` is set.

    Parameters
    ----------
    query : zenoh.Query, PublishedWrench or RosQuestion
        The query.
    key : str
        Key at which the query arrived; of a wrench, where its set-points are published.
    arrived : float
        Time of arrival on the clock of `time.perf_counter` [s].
    longest : float
        Deadline of a question that names none [s].
    """
    given, attached = query.payload, query.attachment
    fault, payload, secret = None, b"", b""
    name = key.rpartition("/")[2]
    try:
        if attached is not None:
            most = SERVING_SETTINGS.most_attached
            if len(attached) > most:
                raise LimitError(
                    f"the query's attachment has {len(attached)} bytes; the maximum is "
                    f"{most}: send the request as the payload",
                    field="attachment",
                )
            secret = attached.to_bytes()
        if given is not None:
            cancels = name == ServiceName.CANCEL
            kind = CancelRequest if cancels else SERVICES_BY_NAME[name].request
            published = isinstance(query, PublishedWrench)
            check_size(len(given), WrenchRequest if published else kind)
            payload = given.to_bytes()
    except LimitError as error:
        fault = error
    question = PendingQuestion(
        query=query,
        key=key,
        name=name,
        client=client_of(query),
        arrived=arrived,
        payload=payload,
        encoding="" if query.encoding is None else str(query.encoding),
        seconds=longest,
        dear=name in (ServiceName.WRENCH_SPACE, ServiceName.BODY_SPACE, ServiceName.ROUTE)
        or len(payload) > SERVING_SETTINGS.large_payload,
        fault=fault,
        secret=secret,
        caller=query.caller if isinstance(query, RosQuestion) else b"",
        # a client that reads no set-points may read replies
        replies_by=key if isinstance(query, PublishedWrench) else "",
    )
    if isinstance(query, PublishedWrench):
        return question
    # a process reads larger ones; of a climb the deadline must be known: a scan takes 1 ms a MB
    if len(payload) <= 2**20 or name == ServiceName.CLIMB:
        _read(question)
    return question


def _read(question: PendingQuestion) -> None:
    try:
        head = question.form.decode(question.payload, _Head)
    except (MalformedError, msgspec.ValidationError):
        # its process says what is wrong with it
        return
    name, seconds, want, objective = (
        _value(field, question.form)
        for field in (head.id, head.deadline, head.want, head.objective)
    )
    if isinstance(name, str):
        question.id = name
    # what no request may have is refused by its process, in the service's own time
    if isinstance(seconds, int | float) and 0.0 < seconds <= LONGEST_DEADLINE:
        question.seconds = float(seconds)
    # these take many plans
    extras = {"robust", "open_loop", "spread", "advice", "survival"}
    many = isinstance(want, list) and any(each in want for each in extras)
    many = many or (isinstance(objective, str) and objective_needs(objective).samples)
    question.dear = question.dear or many or _is_long(head.want)
    most = _value(head.max_reply_bytes, question.form)
    if isinstance(most, int) and most >= LEAST_REPLY_BYTES:
        question.most = min(most, LARGEST_ERROR)
    question.stance = hash(bytes(head.stance)) if bytes(head.stance) else None


def _is_long(field: msgspec.Raw) -> bool:
    """Return whether a field is too long to be read before its turn; a process reads it, too."""
    return len(bytes(field)) > 2**12


def _value(field: msgspec.Raw, form: Format) -> Any:
    """Return what a field says; None where that is long, or nothing."""
    if not bytes(field) or _is_long(field):
        return None
    try:
        return form.decode(bytes(field), Any)
    except (MalformedError, msgspec.ValidationError):
        # its process reports a field that cannot be read
        return None
