"""Plan many requests at once, on parallel worker processes, with replies as Python objects.

For more requests than a list can hold, or for a cluster, use `service.bulk`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

from hand_models.base import InvalidInputError, without_collection
from hand_models.parameters import ParameterTable
from planner import Workers, cores
from service.bulk import Setting, answered, pool_on, whole_number
from service.replies import BriefPlanReply, ErrorReply, PlanReply
from service.requests import PlanRequest
from service.wire import Answer, Format

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = ["Planners", "plan_many", "worth"]


class Planners:
    """Pool of worker processes that plan requests; it stays open inside a ``with`` block.

    Several calls of `plan_many` share the processes, whose start takes a second or two.

    Parameters
    ----------
    workers : int, optional
        Number of processes; by default the number of cores. With 1, this process plans itself.
    robot : RobotFile, optional
        The only robot that is planned for; by default the bundled robots.
    hand : ParameterTable, optional
        Entries that replace those of the bundled hand; entries in a request override them.
    folder : Path, optional
        Folder to which the names of mesh files in requests are relative; each process reads a file
        once. Without it, requests must not name files.

    Raises
    ------
    InvalidInputError
        If ``workers`` is not a whole number of at least 1.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        robot: RobotFile | None = None,
        hand: ParameterTable | None = None,
        folder: Path | None = None,
    ) -> None:
        count = cores() if workers is None else whole_number(workers)
        setting = Setting(robot, hand, folder, Format.MSGPACK)
        self._pool = pool_on("here" if count == 1 else "processes", count, setting)
        self._closed = False

    def __enter__(self) -> Self:
        self._closed = False
        self._pool.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._closed = True
        self._pool.__exit__(*error)

    def wait(self) -> None:
        """Wait until all processes have started; useful before a time measurement."""
        if isinstance(self._pool, Workers):
            self._pool.wait()

    def plan_many(
        self,
        requests: Sequence[PlanRequest],
        progress: Callable[[int, int], None] | None = None,
    ) -> list[PlanReply | BriefPlanReply | ErrorReply]:
        """Return the reply to each request, or an error reply in its place.

        Parameters
        ----------
        requests : sequence of PlanRequest
            The requests.
        progress : callable, optional
            Called after each answer with (number of requests done, number of requests).

        Returns
        -------
        list of PlanReply, BriefPlanReply or ErrorReply
            In the order of the requests; errors of single requests are not raised.

        Raises
        ------
        InvalidInputError
            After the end of the ``with`` block.
        CruxError
            If processes cannot be started.
        """
        if self._closed:
            raise InvalidInputError("is closed; use it inside a with block", field="planners")
        answers = []
        try:
            for answer in answered(requests, self._pool, Format.MSGPACK):
                answers.append(answer)
                if progress is not None:
                    progress(len(answers), len(requests))
        except BaseException:
            # what nobody waits for any more
            self._pool.__exit__()
            raise
        # the collector would go through all replies again and again
        with without_collection():
            return [_decoded(answer) for answer in answers]


def plan_many(
    requests: Sequence[PlanRequest],
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[PlanReply | BriefPlanReply | ErrorReply]:
    """Plan many requests in parallel; return the reply to each, or an error reply in its place.

    Parameters
    ----------
    requests : sequence of PlanRequest
        The requests.
    workers : int, optional
        Number of worker processes; by default the number of cores for 500 requests or more, else 1.
        With 1, this process plans itself. A program that starts processes needs its ``if __name__
        == "__main__":``.
    progress : callable, optional
        Called after each answer with (number of requests done, number of requests).

    Returns
    -------
    list of PlanReply, BriefPlanReply or ErrorReply
        In the order of the requests; errors of single requests are not raised.

    Raises
    ------
    InvalidInputError
        If ``workers`` is not a whole number of at least 1.
    CruxError
        If processes cannot be started.
    """
    with Planners(worth(len(requests), workers)) as planners:
        return planners.plan_many(requests, progress)


def worth(count: int, workers: int | None = None) -> int:
    """Return the number of worker processes that is worth starting for a number of requests.

    Parameters
    ----------
    count : int
        Number of plan requests.
    workers : int, optional
        Number of processes that the caller wants.

    Returns
    -------
    int
        ``workers``, but at most one per request; by default the number of cores for 500 requests or
        more, else 1.

    Raises
    ------
    InvalidInputError
        If ``workers`` is not a whole number of at least 1.
    """
    if workers is not None:
        return min(whole_number(workers), max(1, count))
    # fewer are planned faster here than in processes that must first start
    return cores() if count >= 500 else 1


def _decoded(answer: Answer) -> PlanReply | BriefPlanReply | ErrorReply:
    form = Format.MSGPACK
    if not answer.good:
        return form.decode(answer.payload, ErrorReply)
    if form.is_labelled(answer.encoding, BriefPlanReply):
        return form.decode(answer.payload, BriefPlanReply)
    return form.decode(answer.payload, PlanReply)
