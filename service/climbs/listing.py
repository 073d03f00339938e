"""Print the results of many routes or climbs, of which a file has a row each."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from planner import RobotFile
from service import bulk, tables, wire
from service.climbs.naming import FIELD_OPTIONS, with_options

__all__ = ["Listing", "climb_listing", "route_listing"]


Answers = Generator[wire.Answer, None, None]


class Listing(NamedTuple):
    """Description of many questions of a kind, and the list of their results.

    Attributes
    ----------
    kind : str
        Of `service.bulk.answer_all`.
    noun : str
        Plural name of what is listed.
    work : str
        What is done with them, in words.
    plans : int
        Plans of stances that take as long as one of them.
    columns : tuple of Column
        Of a table in a file.
    printed : tuple of PrintedColumn
        Of the table that is printed, without the last one, their names.
    answers : callable
        Takes the answers, and returns them as they are kept.
    options : mapping of str to str
        Options of the fields of a request.
    """

    kind: str
    noun: str
    work: str
    plans: int
    columns: tuple[bulk.Column, ...]
    printed: tuple[tables.PrintedColumn, ...]
    answers: Callable[[Answers], Answers]
    options: Mapping[str, str]

    def refuse(self, file: Path, names: Sequence[str]) -> None:
        """Refuse a file for the results that is one of the names, or cannot be gone on with.

        Raises
        ------
        InvalidInputError
            If it is so.
        """
        if any(os.path.abspath(name) == os.path.abspath(file) for name in names):
            said = f"{file} is one of the {self.noun} and would be overwritten; name another file"
            raise InvalidInputError(said, field="-o")
        if file.suffix.lower() == ".jsonl" and file.exists() and not file.is_file():
            said = f"{file}: must be a file, not a device or pipe; name another"
            raise InvalidInputError(said, field="-o")

    def run(
        self,
        file: Path,
        asked: bulk.Asked,
        hand: ParameterTable | None,
        robot: RobotFile | None,
        *,
        explained: bool,
        resume: bool,
    ) -> bulk.Run:
        """Return the run that stores the answers: rows of a table, or lines of replies.

        Parameters
        ----------
        file : Path
            Of the results.
        asked : Asked
            All questions.
        hand, robot : ParameterTable, RobotFile or None
            The caller's own.
        explained : bool
            Whether the plans are explained by certificates.
        resume : bool
            True to keep answers that the file already has.
        """
        header = bulk.new_header(self.columns, explained, hand, robot)
        if bulk.exporter_at(file) is None:
            return bulk.AskedReplies(file, header, resume, asked, self.options)
        return bulk.TableLines(file, self.columns, header, resume, asked)

    def print(self, file: Path, names: Sequence[str], before: int, elapsed: float) -> None:
        """Print each result, and the file of the results.

        Parameters
        ----------
        file : Path
            Of the results: ``.jsonl``, ``.csv`` or ``.parquet``.
        names : sequence of str
            Of all that are listed.
        before : int
            Number of those that were answered before.
        elapsed : float
            Time for the others [s].
        """
        out = tables.console()
        one = self.noun.removesuffix("s")
        columns = (*self.printed, tables.text(one, "source"))
        if tables.verbosity() >= 0:
            most = 100
            named = zip(names, islice(self._rows(file), most), strict=False)
            tables.print_rows([row | {"source": name} for name, row in named], columns, out)
            if len(names) > most:
                out.print(f"and {len(names) - most} more", markup=False)
        known = f", {before} were answered before" if before else ""
        done = tables.counted(len(names) - before, one, self.noun)
        out.print(f"{done} in {elapsed:.1f} s{known}", markup=False)
        out.print(f"written: {file}", markup=False, soft_wrap=True)

    def _rows(self, file: Path) -> Iterator[dict[str, Any]]:
        """Yield each row of a file of any form."""
        if file.suffix.lower() == ".parquet":
            from pyarrow import parquet

            yield from parquet.read_table(file).to_pylist()
        elif file.suffix.lower() == ".csv":
            with file.open(newline="", encoding="utf-8") as stream:
                for row in csv.DictReader(stream):
                    yield {name: value or None for name, value in row.items()}
        else:
            names = [column.name for column in self.columns if not column.is_index]
            with file.open("rb") as lines:
                for line in lines:
                    yield dict(zip(names, bulk.row_of(line, self.columns).values, strict=True))


def route_listing() -> Listing:
    """Return how a number of routes is listed."""
    crux = ("crux_phase", "crux_limb")
    printed = (
        _status(),
        tables.name("crux", lambda row: " ".join(filter(None, map(row.get, crux))) or None),
        tables.number("move", "crux_move"),
        tables.number("util", "utilisation", _decimal),
        tables.number("load factor", "load_factor", _decimal),
    )
    kind, columns = wire.ServiceName.ROUTE, tuple(bulk.route_columns())
    return Listing(
        kind, "routes", "planning routes", 50, columns, printed, lambda answers: answers, {}
    )


def climb_listing() -> Listing:
    """Return how climbs on a number of rocks are listed."""
    printed = (
        _status(),
        tables.number("least", "least", _decimal),
        tables.number("bound", "bound", _decimal),
        tables.number("gap %", "gap", lambda value: f"{100.0 * float(value):.0f}"),
        tables.number("moves"),
        tables.number("knots"),
    )
    kind, columns = wire.ServiceName.CLIMB, tuple(bulk.climb_columns())
    return Listing(
        kind, "rocks", "searching rocks", 1000, columns, printed, with_options, FIELD_OPTIONS
    )


def _status() -> tables.PrintedColumn:
    return tables.name("status", lambda row: row["status"] or f"error: {row['error_kind']}")


def _decimal(value: float | str) -> str:
    return f"{float(value):.2f}"
