"""Rows of a sweep: the result of each point, and the file of rows from which a sweep is resumed."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec

from hand_models.parameters import ParameterTable
from planner import LimitName
from service import bulk
from service.bulk import LOCAL_CLUSTER, Column, TableLines, answer_all
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
"""Function that takes encoded requests and yields their answers, in order."""

State = Literal["holds", "overloaded", "infeasible", "error"]

STATES_BY_STATUS: Final[dict[str, State]] = {
    "optimal": "holds",
    "overloaded": "overloaded",
    "infeasible": "infeasible",
}

LIMIT_PARTS: Final = ("limb", "finger", "phalanx", "joint", "limit")

RESULT_COLUMNS: Final = (
    Column("status", "text", "", "of the plan, or error"),
    Column("utilisation", "float", "1", "the largest of any limit"),
    Column("load_factor", "float", "1", "inf where there is no end to it"),
    *(Column(part, "text", "", f"{part} of the limit that is used most") for part in LIMIT_PARTS),
    Column("warnings", "text", "", "with '; ' between them"),
    Column("error", "text", "", "why there is no plan"),
)
"""Columns of the results, which follow the columns of the variations."""


class SweepRow(msgspec.Struct, frozen=True):
    """Result of one point of a sweep.

    Attributes
    ----------
    point : tuple
        A value for each variation.
    status : str
        Status of the plan, or ``error``.
    utilisation : float or None
        Largest utilisation of all limits; None if there is no plan.
    load_factor : float or None
        Largest multiple of the body wrench at utilisation 1; None if unbounded or not known.
    load_factor_unbounded : bool
        True if there is no largest multiple.
    limiting : LimitName or None
        Limit with the largest utilisation.
    warnings : tuple of str
        What is odd or unfinished, in sentences; of a row of a file all in one.
    error : ErrorDetail or None
        Why there is no plan.
    cap : float
        Cap on the utilisation at this point, up to which the stance is feasible.
    """

    point: Point = ()
    status: str = "error"
    utilisation: float | None = None
    load_factor: float | None = None
    load_factor_unbounded: bool = False
    limiting: LimitName | None = None
    warnings: tuple[str, ...] = ()
    error: ErrorDetail | None = None
    cap: float = 1.0

    @property
    def holds(self) -> bool:
        """True if the point is feasible: its plan is within all limits."""
        return self.status == "optimal"

    @property
    def state(self) -> State:
        """Status for pictures: ``holds`` for optimal, and ``error`` for a failed plan, too."""
        return STATES_BY_STATUS.get(self.status, "error")

    @property
    def answered(self) -> bool:
        """True if the point need not be asked again: planned, or its request is invalid."""
        if self.error is not None:
            return self.error.kind in REQUEST_KINDS
        return self.state != "error"

    @property
    def margin(self) -> float | None:
        """Utilisation over cap, 1 at the limit (a ratio); None without a utilisation."""
        return None if self.utilisation is None else self.utilisation / self.cap

    @property
    def complaint(self) -> str | None:
        """The error as one line of kind, field and message; None without an error."""
        if self.error is None:
            return "the planner failed" if self.state == "error" else None
        field = "" if self.error.field is None else f"{self.error.field}: "
        return f"{self.error.kind}: {field}{self.error.message}"

    @property
    def cells(self) -> list[Any]:
        """Values of the row for the table: the point's values, then those of `RESULT_COLUMNS`."""
        point = [
            word_of(each) if each is None or isinstance(each, bool) else each for each in self.point
        ]
        factor = "inf" if self.load_factor_unbounded else self.load_factor
        limit = [getattr(self.limiting, part, None) for part in LIMIT_PARTS]
        warnings = "; ".join(self.warnings) or None
        return [*point, self.status, self.utilisation, factor, *limit, warnings, self.complaint]

    @classmethod
    def read(cls, design: Design, point: Point, line: bulk.TableRow) -> SweepRow:
        """Convert a row of the file, from which a sweep is resumed, into the result of a point.

        Parameters
        ----------
        design : Design
            Points of the sweep.
        point : Point
            The point's values.
        line : TableRow
            Row of the file, with the values that `cells` returns.
        """
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
            (known["warnings"],) if known["warnings"] else (),
            error=line.error,
            cap=design.cap(point),
        )


def asking(
    count: int, workers: int | None, robot: RobotFile | None, on: str | Client | None = None
) -> Ask:
    """Return a function that answers encoded requests in this process, in processes or on Dask.

    Parameters
    ----------
    count : int
        Number of requests, from which the number of processes is chosen.
    workers : int or None
        Number of processes; None to choose.
    robot : RobotFile or None
        The only robot that is planned for; None for the bundled robots.
    on : str or distributed.Client, optional
        ``processes``, ``here``, ``local`` for a temporary Dask cluster on this machine, the address
        of a Dask scheduler, or its client; by default ``here`` for one worker, otherwise
        ``processes``.

    Returns
    -------
    callable
        Takes encoded requests, and yields an `Answer` for each, in order.
    """
    if on is None:
        workers = worth(count, workers)
        on = "here" if workers == 1 else "processes"
    place = LOCAL_CLUSTER if on == "local" else on
    return partial(answer_all, on=place, workers=workers, robot=robot, form=Format.MSGPACK)


def rows_at(design: Design, points: Sequence[Point], ask: Ask) -> Iterator[SweepRow]:
    """Plan points of a sweep, and yield the result of each point, in order.

    Parameters
    ----------
    design : Design
        Builds the request at a point.
    points : sequence of Point
        Points to plan.
    ask : callable
        Answers encoded requests; see `asking`.

    Yields
    ------
    SweepRow
        Result of one point, or its error.
    """
    answers = ask(design.payload(point) for point in points)
    for point, answer in zip(points, answers, strict=True):
        yield sweep_row(design, point, answer.payload)


def sweep_row(design: Design, point: Point, payload: bytes) -> SweepRow:
    """Convert the answer for a point into the result of the point.

    Parameters
    ----------
    design : Design
        Points of the sweep.
    point : Point
        The point's values.
    payload : bytes
        Reply or error reply, encoded as MessagePack.
    """
    row = msgspec.msgpack.decode(payload, type=SweepRow)
    return msgspec.structs.replace(row, point=point, cap=design.cap(point))


def sweep_columns(design: Design) -> tuple[Column, ...]:
    """Return the columns of a sweep's table: one for each variation, then `RESULT_COLUMNS`."""
    varied = (
        Column(target.label, "float" if each.numbers else "text", target.unit or "", each.path)
        for each, target in zip(design.variations, design.targets, strict=True)
    )
    return (*varied, *RESULT_COLUMNS)


class PointRows(TableLines):
    """Rows of a sweep's points, appended to a file beside the table, from which a sweep is resumed.

    Parameters
    ----------
    request : PlanRequest
        Request in which fields vary.
    design : Design
        Points of the sweep.
    seed : int
        Seed of the design's samples.
    path : Path
        File of the table, ``.csv`` or ``.parquet``.
    resume : bool
        True to keep the rows of an existing file, and to continue after them.
    hand : ParameterTable or None
        Hand parameters that differ from the bundled hand.
    robot : RobotFile or None
        The only robot that is planned for; None for the bundled robots.

    Raises
    ------
    InvalidInputError
        If the existing rows are of another sweep.
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
        """Return the row of the first point without one, from its reply in MessagePack."""
        row = sweep_row(self._design, self._design.points[self.tally.count], payload)
        return bulk.TableRow(row.cells, None if row.error else row.status, row.error)

    @property
    def points(self) -> list[SweepRow]:
        """Results of all points that are answered so far."""
        pairs = zip(self._design.points, self.rows(), strict=False)
        return [SweepRow.read(self._design, point, line) for point, line in pairs]
