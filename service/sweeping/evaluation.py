"""What each point of a sweep comes to: its request is planned, and the answer read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final, Literal

import msgspec

from planner import LimitName
from service.processes import Planners, worth
from service.replies import ErrorDetail
from service.sweeping.design import Design, Point
from service.wire import REQUEST_KINDS, Answer, Format

if TYPE_CHECKING:
    from planner import RobotFile

__all__ = ["Ask", "Row", "State", "asking", "rows_at"]

Ask = Callable[[Sequence[bytes]], Iterator[tuple[int, Answer]]]
"""Yields each encoded request's index and its answer, as they are done."""

State = Literal["holds", "overloaded", "infeasible", "error"]

STATES: Final[dict[str, State]] = {
    "optimal": "holds",
    "overloaded": "overloaded",
    "infeasible": "infeasible",
}
AT_ONCE: Final = 2**26
"""Bytes of requests that are kept for processes to take, but at least two requests."""


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
def asking(count: int, workers: int | None, robot: RobotFile | None) -> Iterator[Ask]:
    """Yield what answers encoded requests, some ``count`` of them in all.

    Raises
    ------
    InvalidInputError
        If ``workers`` is no whole number of at least 1.
    """
    with Planners(worth(count, workers), robot=robot) as planners:
        yield lambda payloads: planners.answers(payloads, Format.MSGPACK)


def rows_at(design: Design, points: Sequence[Point], ask: Ask) -> Iterator[tuple[int, Row]]:
    """Yield the index and the row of each point, as they are done."""
    begin, size = 0, 2
    while begin < len(points):
        payloads = [design.payload(point) for point in points[begin : begin + size]]
        for i, answer in ask(payloads):
            point = points[begin + i]
            told = msgspec.msgpack.decode(answer.payload, type=_Told)
            row = Row(point, **msgspec.structs.asdict(told), cap=design.cap(point))
            yield begin + i, row
        begin += len(payloads)
        size = max(2, AT_ONCE // max(map(len, payloads)))
