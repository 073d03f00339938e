"""What each point of a sweep comes to: its request is planned, and the answer read."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Literal

import msgspec

from planner import LimitName
from service.bulk import Question, Setting, answered, pool_on
from service.processes import worth
from service.replies import ErrorDetail
from service.sweeping.design import Design, Point
from service.wire import REQUEST_KINDS, Answer, Format

if TYPE_CHECKING:
    from distributed import Client

    from planner import RobotFile

__all__ = ["Ask", "Row", "State", "asking", "row_of", "rows_at"]

Ask = Callable[[Iterable[Question]], Generator[Answer, None, None]]
"""Yields the answers to encoded requests, in order; asked again only after the last of them."""

State = Literal["holds", "overloaded", "infeasible", "error"]

STATES: Final[dict[str, State]] = {
    "optimal": "holds",
    "overloaded": "overloaded",
    "infeasible": "infeasible",
}


class _Told(msgspec.Struct):
    """What a sweep needs to know of an answer."""

    status: str = "error"
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    limiting: LimitName | None = None
    error: ErrorDetail | None = None


class Row(msgspec.Struct, frozen=True):
    """What one point of a sweep comes to.

    Attributes
    ----------
    point : tuple
        A value of each variation.
    status : str
        Of the plan, or ``error``.
    utilisation, load_factor : float or None
    load_factor_unbounded : bool
    limiting : LimitName or None
        What limits the plan.
    error : ErrorDetail or None
        Why there is no plan.
    cap : float
        Utilisation up to which this point holds.
    """

    point: Point
    status: str
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    limiting: LimitName | None = None
    error: ErrorDetail | None = None
    cap: float = 1.0

    @property
    def holds(self) -> bool:
        """Whether there is a plan within its limits."""
        return self.status == "optimal"

    @property
    def state(self) -> State:
        """As it is drawn; an error where the planner failed, too."""
        return STATES.get(self.status, "error")

    @property
    def answered(self) -> bool:
        """Whether there is an answer, if only that the request at this point cannot be."""
        if self.error is not None:
            return self.error.kind in REQUEST_KINDS
        return self.state != "error"

    @property
    def margin(self) -> float | None:
        """Utilisation over its cap; None where there is none."""
        return None if self.utilisation is None else self.utilisation / self.cap

    @property
    def complaint(self) -> str | None:
        """What is wrong, in one line."""
        if self.error is None:
            return "the planner failed" if self.state == "error" else None
        field = "" if self.error.field is None else f"{self.error.field}: "
        return f"{self.error.kind}: {field}{self.error.message}"


@contextmanager
def asking(
    count: int, workers: int | None, robot: RobotFile | None, on: str | Client | None = None
) -> Iterator[Ask]:
    """Yield what answers encoded requests, some ``count`` of them in all.

    Raises
    ------
    InvalidInputError
        If ``workers`` is no whole number of at least 1, or ``on`` is impossible.
    """
    if on is None:
        workers = worth(count, workers)
        on = "here" if workers == 1 else "processes"
    form = Format.MSGPACK
    setting = Setting(robot, form=form)
    with pool_on(on, workers, setting) as pool:
        yield lambda payloads: answered(payloads, pool, form)


def rows_at(design: Design, points: Sequence[Point], ask: Ask) -> Iterator[Row]:
    """Yield the row of each point, in order."""
    answers = ask(design.payload(point) for point in points)
    for point, answer in zip(points, answers, strict=True):
        yield row_of(design, point, answer.payload)


def row_of(design: Design, point: Point, payload: bytes) -> Row:
    """Return the row of a point whose answer is there."""
    told = msgspec.msgpack.decode(payload, type=_Told)
    return Row(point, **msgspec.structs.asdict(told), cap=design.cap(point))
