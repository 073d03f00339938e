"""Result of each point of a sweep: a row of a table, kept as a line that a sweep resumes from."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec

from hand_models.parameters import ParameterTable
from planner import LimitName
from service import bulk
from service.bulk import LOCAL_CLUSTER, Column, TableLines, evaluate
from service.processes import worth
from service.replies import ErrorDetail
from service.requests import PlanRequest
from service.sweeping.design import Design, Point
from service.sweeping.variation import word_of
from service.wire import REQUEST_KINDS, Answer, Format

if TYPE_CHECKING:
    from distributed import Client

    from planner import RobotFile

__all__ = ["Ask", "PointRows", "State", "SweepRow", "asking", "rows_at", "sweep_columns"]

Ask = Callable[[Iterable[bytes]], Generator[Answer, None, None]]
"""Yields the answers to encoded requests, in order."""

State = Literal["holds", "overloaded", "infeasible", "error"]

LIMIT_PARTS: Final = ("limb", "finger", "phalanx", "joint", "limit")

RESULT_COLUMNS: Final = (
    Column("status", "text", "", "of the plan, or error"),
    Column("utilisation", "float", "1", "the largest of any limit"),
    Column("load_factor", "float", "1", "inf where there is no end to it"),
    *(Column(part, "text", "", f"{part} of the limit that is used most") for part in LIMIT_PARTS),
    Column("error", "text", "", "why there is no plan"),
)
"""Columns after those of what varies."""


class SweepRow(msgspec.Struct, frozen=True):
    """Result of one point of a sweep; as in a reply, but for its point and cap.

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

    point: Point = ()
    status: str = "error"
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    limiting: LimitName | None = None
    error: ErrorDetail | None = None
    cap: float = 1.0

    @property
    def holds(self) -> bool:
        """True if there is a plan within its limits."""
        return self.status == "optimal"

    @property
    def state(self) -> State:
        """State as it is drawn; an error where the planner failed, too."""
        match self.status:
            case "optimal":
                return "holds"
            case "overloaded":
                return "overloaded"
            case "infeasible":
                return "infeasible"
            case _:
                return "error"

    @property
    def answered(self) -> bool:
        """True if there is an answer, if only that the request at this point is invalid."""
        if self.error is not None:
            return self.error.kind in REQUEST_KINDS
        return self.state != "error"

    @property
    def margin(self) -> float | None:
        """Utilisation over its cap; None where there is none."""
        return None if self.utilisation is None else self.utilisation / self.cap

    @property
    def complaint(self) -> str | None:
        """Error in one line; None where there is none."""
        if self.error is None:
            return "the planner failed" if self.state == "error" else None
        field = "" if self.error.field is None else f"{self.error.field}: "
        return f"{self.error.kind}: {field}{self.error.message}"

    @property
    def cells(self) -> list[Any]:
        """Cells of the point in the table."""
        point = [
            word_of(each) if each is None or isinstance(each, bool) else each for each in self.point
        ]
        factor = "inf" if self.load_factor_unbounded else self.load_factor
        limit = [getattr(self.limiting, part, None) for part in LIMIT_PARTS]
        return [*point, self.status, self.utilisation, factor, *limit, self.complaint]

    @classmethod
    def read(cls, design: Design, point: Point, line: bulk.TableRow) -> SweepRow:
        """Return the row of a point that was written as a line."""
        names = (column.name for column in RESULT_COLUMNS)
        known = dict(zip(names, line.values[len(point) :], strict=True))
        factor, unbounded = known["load_factor"], known["load_factor"] == "inf"
        limit = {part: known[part] for part in LIMIT_PARTS}
        return cls(
            point,
            known["status"],
            known["utilisation"],
            None if unbounded else factor,
            unbounded,
            msgspec.convert(limit, LimitName) if limit["limit"] else None,
            line.error,
            design.cap(point),
        )


def asking(
    count: int, workers: int | None, robot: RobotFile | None, on: str | Client | None = None
) -> Ask:
    """Return what answers encoded requests, some ``count`` of them in all.

    ``on`` is as of `service.bulk.evaluate`, or ``local``; by default processes, where they are
    worth it.
    """
    if on is None:
        workers = worth(count, workers)
        on = "here" if workers == 1 else "processes"
    place = LOCAL_CLUSTER if on == "local" else on
    return partial(evaluate, on=place, workers=workers, robot=robot, form=Format.MSGPACK)


def rows_at(design: Design, points: Sequence[Point], ask: Ask) -> Iterator[SweepRow]:
    """Yield the row of each point, in order."""
    answers = ask(design.payload(point) for point in points)
    for point, answer in zip(points, answers, strict=True):
        yield sweep_row(design, point, answer.payload)


def sweep_row(design: Design, point: Point, payload: bytes) -> SweepRow:
    """Return the row of a point whose answer is there."""
    row = msgspec.msgpack.decode(payload, type=SweepRow)
    return msgspec.structs.replace(row, point=point, cap=design.cap(point))


def sweep_columns(design: Design) -> tuple[Column, ...]:
    """Return the columns of a design's table: what varies, and what that comes to."""
    varied = zip(design.labels, design.variations, design.targets, strict=True)
    return (
        *(
            Column(label, "float" if each.numbers else "text", target.unit or "", each.path)
            for label, each, target in varied
        ),
        *RESULT_COLUMNS,
    )


class PointRows(TableLines):
    """Rows of points, beside a table that is written of them.

    Parameters
    ----------
    request : PlanRequest
    design : Design
        Of that request.
    seed : int
        Of its samples.
    path : Path
    resume : bool
        Whether rows that are there are kept.
    hand : ParameterTable or None
    robot : RobotFile or None

    Raises
    ------
    InvalidInputError
        If the sweep of that file is another one.
    """

    def __init__(
        self,
        request: PlanRequest,
        design: Design,
        seed: int,
        path: Path,
        resume: bool,
        hand: ParameterTable | None,
        robot: RobotFile | None,
    ) -> None:
        columns, self._design = sweep_columns(design), design
        about = {
            "stance": bulk.digest_of(msgspec.json.encode(request)),
            "--samples": f"{design.count} of seed {seed}" if design.sampled else "none",
            "--vary": " ".join(each.text(sampled=design.sampled) for each in design.variations),
        }
        header = bulk.new_header(columns, False, hand, robot, about)
        super().__init__(path, columns, header, resume, design)

    def row(self, payload: bytes) -> bulk.TableRow:
        """Return the cells of the point that is next."""
        row = sweep_row(self._design, self._design.points[self.tally.count], payload)
        return bulk.TableRow(row.cells, None if row.error else row.status, row.error)

    @property
    def points(self) -> list[SweepRow]:
        """Rows of the points that are answered."""
        pairs = zip(self._design.points, self.rows(), strict=False)
        return [SweepRow.read(self._design, point, line) for point, line in pairs]
