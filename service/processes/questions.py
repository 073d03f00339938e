"""Answer queries in worker processes: a query's bytes in, the bytes of its answer out."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing, nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from hand_models.parameters import ParameterTable
from service.wire import Answer

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = ["Job", "answering"]


class Job(NamedTuple):
    """A query for a process.

    Attributes
    ----------
    name : str
        The last part of its key.
    payload : bytes
    encoding : str
        Zenoh's name of it.
    waited : float
        How long ago it came [s].
    seconds : float or None
        The service's own deadline, from where it came [s].
    rehearsal : bool
        Whether what is declared is let go again.
    client : str
        Who asks: streams are shared out by it.
    """

    name: str
    payload: bytes
    encoding: str
    waited: float = 0.0
    seconds: float | None = None
    rehearsal: bool = False
    client: str = ""


def answering(robot: RobotFile | None, hand: ParameterTable | None) -> Callable[[Job], Answer]:
    """Return the function that answers; here the planner is imported, in each process.

    Parameters
    ----------
    robot : RobotFile or None
        The only robot that is planned for; those that are bundled by default.
    hand : ParameterTable or None
        Entries in which its hands are not the bundled one; a request's own go on top.
    """
    from planner import deadline
    from service.answering import Streams, handle, robots_of

    # a single plan loads these only when it needs them
    scipy = ("linalg", "optimize", "spatial", "stats")
    for name in ("cvxpy", *(f"scipy.{part}" for part in scipy), "trimesh"):
        import_module(name)
    robots = robots_of(robot)
    streams = Streams()

    def answer(job: Job) -> Answer:
        start, begun = time.perf_counter(), time.thread_time()
        arrived = start - job.waited
        own = closing(Streams()) if job.rehearsal else nullcontext(streams.of(job.client))
        with own as asked, deadline.within(job.seconds, started=arrived):
            found = handle(
                job.name,
                job.payload,
                job.encoding,
                hand,
                robots,
                started=arrived,
                streams=asked,
            )
        cost = time.thread_time() - begun
        return found._replace(seconds=time.perf_counter() - start, cost=cost)

    return answer
