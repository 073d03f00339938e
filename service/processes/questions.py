"""What a service's processes do: a query's bytes in, the bytes of its answer out."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from hand_models.parameters import ParameterTable

if TYPE_CHECKING:
    from planner.robots import RobotFile
    from service.answering import Answer

__all__ = ["Done", "Job", "answering"]


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
    seconds : float
        The service's own deadline, from where it came [s].
    rehearsal : bool
        Whether what is declared is let go again.
    """

    name: str
    payload: bytes
    encoding: str
    waited: float
    seconds: float
    rehearsal: bool = False


class Done(NamedTuple):
    """An answer, and how long the work took [s]."""

    answer: Answer
    seconds: float


def answering(robot: RobotFile | None, hand: ParameterTable | None) -> Callable[[Job], Done]:
    """Return what answers; here the planner is imported, in each process.

    Parameters
    ----------
    robot : RobotFile or None
        The only robot that is planned for; RoboSimian by default.
    hand : ParameterTable or None
        Entries in which its hands are not the bundled one; a request's own go on top.
    """
    from planner import deadline
    from service.answering import Streams, handle, robots_of

    robots = robots_of(robot)
    streams = Streams()

    def answer(job: Job) -> Done:
        start = time.perf_counter()
        arrived = start - job.waited
        own = Streams() if job.rehearsal else streams
        try:
            with deadline.within(job.seconds, started=arrived):
                found = handle(
                    job.name,
                    job.payload,
                    job.encoding,
                    hand,
                    robots,
                    started=arrived,
                    streams=own,
                )
        finally:
            if job.rehearsal:
                own.close()
        return Done(found, time.perf_counter() - start)

    return answer
