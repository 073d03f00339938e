"""Many plan requests at once, in processes: replies in their order, errors in their places.

Encoded requests and replies travel between processes, and each is answered as the service would
answer it.
"""

from __future__ import annotations

import gc
import operator
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner import Lost, Workers, cores
from service.processes.questions import Job, answering
from service.replies import BriefPlanReply, ErrorReply, PlanReply
from service.requests import PlanRequest
from service.wire import PLAN, Answer, Format, LostError, MalformedError, encode_error, identifier

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = ["Planners", "plan_many", "worth"]

WORTH_A_PROCESS: Final = 500
"""Requests below this many are planned faster here than in processes that must first start."""


class Planners:
    """Processes that plan, kept open while it is entered; their start is paid for once.

    Parameters
    ----------
    workers : int, optional
        Processes; as many as there are cores by default. One of them is this process itself, which
        plans alone until the others have started.
    robot : RobotFile, optional
        The only robot that is planned for; those that are bundled by default.
    hand : ParameterTable, optional
        Entries in which hands are not the bundled one; a request's own go on top.
    folder : Path, optional
        That names of mesh files in requests are relative to; each process reads a file once. By
        default requests name none.

    Raises
    ------
    InvalidInputError
        If ``workers`` is no whole number of at least 1, or after the end, when it is asked to plan.
    """

    def __init__(
        self,
        workers: int | None = None,
        *,
        robot: RobotFile | None = None,
        hand: ParameterTable | None = None,
        folder: Path | None = None,
    ) -> None:
        count = cores() if workers is None else _whole(workers)
        self._make = partial(answering, robot, hand, folder)
        self._closed = False
        self._workers = Workers(self._make, count - 1)

    def __enter__(self) -> Self:
        self._closed = False
        self._workers.__enter__()
        return self

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        self._closed = True
        self._workers.__exit__(kind, error, traceback)

    def wait(self) -> None:
        """Wait until all processes have started, if that is better than to begin without them."""
        self._workers.wait()

    def plan_many(
        self,
        requests: Sequence[PlanRequest],
        progress: Callable[[int, int], None] | None = None,
    ) -> list[PlanReply | BriefPlanReply | ErrorReply]:
        """Return the reply to each request, or the error in its place; as `plan_many`."""
        form = Format.MSGPACK
        found: dict[int, Answer] = {}
        good, payloads = [], []
        for i, request in enumerate(requests):
            try:
                payloads.append(form.encode(request))
                good.append(i)
            except (TypeError, ValueError, OverflowError, RecursionError) as error:
                name = getattr(request, "id", None)
                known = name if isinstance(name, str) else None
                found[i] = encode_error(MalformedError(f"no request: {error}"), form, known)
        for k, answer in self.answers(payloads, form):
            found[good[k]] = answer
            if progress is not None:
                progress(len(found), len(requests))
        with _no_collection():
            return [_decoded(found[i], form, each) for i, each in enumerate(requests)]

    def answers(
        self, payloads: Sequence[bytes], form: Format = Format.JSON
    ) -> Iterator[tuple[int, Answer]]:
        """Yield each encoded request's index and encoded answer, as they are done."""
        if self._closed:
            raise InvalidInputError("is closed; enter another, or this one again", field="planners")
        asked = [Job(PLAN, payload, form.value) for payload in payloads]
        for i, found in self._workers.each(asked, self._make()):
            if isinstance(found, Lost):
                yield i, encode_error(LostError(found.reason), form, identifier(payloads[i], form))
            else:
                yield i, found


def plan_many(
    requests: Sequence[PlanRequest],
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[PlanReply | BriefPlanReply | ErrorReply]:
    """Return the reply to each request, or the error in its place.

    Parameters
    ----------
    requests : sequence of PlanRequest
    workers : int, optional
        Processes; as many as there are cores where the requests are enough to be worth it. One is
        this process itself. A program that starts processes needs its
        ``if __name__ == "__main__":``.
    progress : callable, optional
        Called with (requests done, requests in all).

    Returns
    -------
    list of PlanReply, BriefPlanReply or ErrorReply
        In the order of the requests. Nothing that is wrong with one of them is raised.

    Raises
    ------
    InvalidInputError
        If ``workers`` is no whole number of at least 1.
    """
    with Planners(worth(len(requests), workers)) as planners:
        return planners.plan_many(requests, progress)


def worth(count: int, workers: int | None = None) -> int:
    """Return how many processes so many requests are worth: no more than are wanted.

    Raises
    ------
    InvalidInputError
        If ``workers`` is no whole number of at least 1.
    """
    if workers is not None:
        return min(_whole(workers), max(1, count))
    return cores() if count >= WORTH_A_PROCESS else 1


def _whole(workers: object) -> int:
    """Return a number of processes, checked."""
    try:
        count = 0 if isinstance(workers, bool) else operator.index(workers)  # type: ignore[arg-type]
    except TypeError:
        count = 0
    if count < 1:
        raise InvalidInputError(
            f"must be a whole number of at least 1, got {workers!r}", field="workers"
        )
    return count


@contextmanager
def _no_collection() -> Iterator[None]:
    """Let the garbage collector rest: it would go through all replies again and again."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def _decoded(
    answer: Answer, form: Format, request: PlanRequest
) -> PlanReply | BriefPlanReply | ErrorReply:
    if not answer.good:
        return form.decode(answer.payload, ErrorReply)
    if getattr(request, "detail", "full") == "full":
        return form.decode(answer.payload, PlanReply)
    return form.decode(answer.payload, BriefPlanReply)
