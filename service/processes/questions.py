"""Answer queries in a service's worker processes: encoded request in, encoded answer out."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import closing, nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from hand_models.parameters import ParameterTable
from service.wire import Answer, ServiceName

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = ["Job", "answering"]


class Job(NamedTuple):
    """Query for a worker process.

    Attributes
    ----------
    name : str
        Kind of question: the last part of the query's key.
    payload : bytes
        Encoded request.
    encoding : str
        Zenoh's name of the payload's encoding.
    waited : float
        Time since the query's arrival [s].
    seconds : float or None
        Deadline by the service, from the query's arrival [s]; None without one.
    rehearsal : bool
        True if a stream that the query declares must be released again.
    client : str
        Client that asks; each client owns the streams that it declares.
    stream : str or None
        Stream on which the payload was published as a wrench; None for queries.
    connected : frozenset of str or None
        Clients that are connected, for a query that declares a stream; None for others.
    """

    name: str
    payload: bytes
    encoding: str
    waited: float = 0.0
    seconds: float | None = None
    rehearsal: bool = False
    client: str = ""
    stream: str | None = None
    connected: frozenset[str] | None = None


def answering(robot: RobotFile | None, hand: ParameterTable | None) -> Callable[[Job], Answer]:
    """Return the function with which a worker process answers jobs.

    What most questions need is imported by this call, so that they do not wait for it.

    Parameters
    ----------
    robot : RobotFile or None
        The only robot that is planned for; by default the bundled robots.
    hand : ParameterTable or None
        Entries that replace those of the bundled hand; entries in a request override them.

    Returns
    -------
    callable
        Takes a `Job` and returns its `Answer`; keeps declared streams from call to call.
    """
    # a single plan loads these only when it needs them
    import_module("service.processes.loaded")
    from planner import deadline, send_part
    from service.answering import Streams, handle, robots_of

    robots = robots_of(robot)
    streams = Streams()

    def answer(job: Job) -> Answer:
        if job.name == ServiceName.CLIMB and hasattr(os, "nice"):
            # a process that searches for climbs does nothing else: what others need comes first
            os.nice(max(0, 10 - os.nice(0)))
        start, begun = time.perf_counter(), time.thread_time()
        arrived = start - job.waited
        kept = streams.of(job.client, job.connected)
        own = closing(Streams()) if job.rehearsal else nullcontext(kept)
        with own as asked, deadline.within(job.seconds, started=arrived):
            found = handle(
                job.name,
                job.payload,
                job.encoding,
                hand,
                robots,
                started=arrived,
                streams=asked,
                stream=job.stream,
                send=send_part,
            )
        if job.name == ServiceName.STREAM and not job.rehearsal:
            found = found._replace(streams=streams.names())
        cost = time.thread_time() - begun
        return found._replace(seconds=time.perf_counter() - start, cost=cost)

    return answer
