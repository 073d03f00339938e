"""Print the results of many routes, of which a file has a row each."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from service import bulk, tables

__all__ = ["print_routes"]


def print_routes(file: Path, names: Sequence[str], before: int, elapsed: float) -> None:
    """Print the result of each route, and the file of the results.

    Parameters
    ----------
    file : Path
        Of the results: ``.jsonl``, ``.csv`` or ``.parquet``.
    names : sequence of str
        Of all routes.
    before : int
        Number of routes that were answered before.
    elapsed : float
        Time for the others [s].
    """
    from service.tables import name

    out = tables.console()
    crux = ("crux_phase", "crux_limb")
    columns = (
        name("status", lambda row: row["status"] or f"error: {row['error_kind']}"),
        name("crux", lambda row: " ".join(filter(None, map(row.get, crux))) or None),
        tables.number("move", "crux_move"),
        tables.number("util", "utilisation", lambda value: f"{float(value):.2f}"),
        tables.number("load factor", "load_factor", lambda value: f"{float(value):.2f}"),
        tables.text("route"),
    )
    if tables.verbosity() >= 0:
        most = 100
        named = zip(names, islice(_rows(file), most), strict=False)
        tables.print_rows([row | {"route": route} for route, row in named], columns, out)
        if len(names) > most:
            out.print(f"and {len(names) - most} more", markup=False)
    known = f", {before} were answered before" if before else ""
    out.print(f"{len(names) - before} routes in {elapsed:.1f} s{known}", markup=False)
    out.print(f"written: {file}", markup=False, soft_wrap=True)


def _rows(file: Path) -> Iterator[dict[str, Any]]:
    """Yield each route's row of a file of any form."""
    if file.suffix.lower() == ".parquet":
        from pyarrow import parquet

        yield from parquet.read_table(file).to_pylist()
    elif file.suffix.lower() == ".csv":
        with file.open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                yield {name: value or None for name, value in row.items()}
    else:
        columns = bulk.route_columns()
        names = [column.name for column in columns if not column.is_index]
        with file.open("rb") as lines:
            for line in lines:
                yield dict(zip(names, bulk.row_of(line, columns).values, strict=True))
