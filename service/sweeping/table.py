"""The table of a sweep as it grows, and goes on: a row for each point, as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import msgspec

from planner import LimitName
from service import bulk
from service.bulk import Column, Header, TableLines
from service.replies import ErrorDetail
from service.requests import PlanRequest
from service.sweeping.design import Design, Point
from service.sweeping.evaluation import Row, row_of
from service.sweeping.variation import Value

__all__ = ["PointRows", "Points", "about", "columns_of", "table_text"]

LIMIT: Final = ("limb", "finger", "phalanx", "joint", "limit")

COLUMNS: Final = (
    Column("status", "text", "", "of the plan, or error"),
    Column("utilisation", "float", "1", "the largest of any limit"),
    Column("load_factor", "float", "1", "inf where there is no end to it"),
    *(Column(part, "text", "", f"{part} of the limit that is used most") for part in LIMIT),
    Column("error", "text", "", "why there is no plan"),
)
"""After what varies."""


def columns_of(design: Design) -> tuple[Column, ...]:
    """Return the columns of a design's table: what varies, and what that comes to."""
    varied = zip(design.labels, design.variations, design.targets, strict=True)
    return (
        *(
            Column(label, "float" if each.numbers else "text", target.unit or "", each.path)
            for label, each, target in varied
        ),
        *COLUMNS,
    )


def about(request: PlanRequest, design: Design, seed: int) -> dict[str, str]:
    """Return of what a sweep is, by name, for its header."""
    count = f"{len(design.points)} of seed {seed}" if design.sampled else "none"
    varied = [each.text(sampled=design.sampled) for each in design.variations]
    stance = bulk.digest_of(msgspec.json.encode(request))
    return {"stance": stance, "--samples": count, "--vary": " ".join(varied)}


def table_text(design: Design, rows: Sequence[Row]) -> str:
    """Return a whole table."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([each.name for each in columns_of(design)])
    writer.writerows(map(_cells, rows))
    return text.getvalue()


class Points:
    """The encoded request at each point of a design.

    Parameters
    ----------
    design : Design

    Attributes
    ----------
    count : int
    """

    def __init__(self, design: Design) -> None:
        self._design = design
        self.count = len(design.points)

    def __iter__(self) -> Iterator[bytes]:
        return self.questions()

    def questions(self) -> Iterator[bytes]:
        """Yield them in order."""
        return map(self._design.payload, self._design.points)


class PointRows(TableLines):
    """Rows of points, beside a table that is written of them.

    Parameters
    ----------
    design : Design
    path : Path
        Of the table.
    header : Header
    resume : bool
        Whether rows that are there are kept.

    Attributes
    ----------
    points : list of Row
        Those of the points that are answered.

    Raises
    ------
    InvalidInputError
        If the sweep of that file is another one.
    """

    def __init__(self, design: Design, path: Path, header: Header, resume: bool) -> None:
        self._design = design
        self.points: list[Row] = []
        super().__init__(path, columns_of(design), header, resume, Points(design))

    @property
    def columns(self) -> None:
        """None: whole replies are read."""
        return None

    def row(self, payload: bytes) -> bulk.Row:
        """Return the cells of the point that is next."""
        row = row_of(self._design, self._design.points[len(self.points)], payload)
        self.points.append(row)
        return bulk.Row(_cells(row), None if row.error else row.status, row.error)

    def known(self, row: bulk.Row) -> None:
        """Take note of a point that is answered already."""
        point = self._design.points[len(self.points)]
        self.points.append(_row_from(self._design, point, row.values))


def _cells(row: Row) -> list[str]:
    limiting = row.limiting
    return [
        *(_cell(value, "null") for value in row.point),
        row.status,
        _cell(row.utilisation),
        "inf" if row.load_factor_unbounded else _cell(row.load_factor),
        *(_cell(None if limiting is None else getattr(limiting, name)) for name in LIMIT),
        row.complaint or "",
    ]


def _cell(value: Value, none: str = "") -> str:
    if value is None:
        return none
    return str(value).lower() if isinstance(value, bool) else str(value)


def _row_from(design: Design, point: Point, cells: Sequence[str]) -> Row:
    """Return the row that was written as cells; an error's field is part of its message then."""
    known = dict(zip((each.name for each in COLUMNS), cells[len(point) :], strict=True))
    used, factor = (
        float(known[name]) if known[name] else None for name in ("utilisation", "load_factor")
    )
    unbounded = factor is not None and math.isinf(factor)
    limit = {name: known[name] or None for name in LIMIT}
    kind, _, message = known["error"].partition(": ")
    return Row(
        point,
        known["status"],
        used,
        None if unbounded else factor,
        unbounded,
        msgspec.convert(limit, LimitName) if limit["limit"] else None,
        ErrorDetail(kind, None, message) if known["status"] == "error" else None,
        design.cap(point),
    )
