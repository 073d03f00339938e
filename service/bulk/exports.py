"""Write tables as CSV or Parquet files; a failure leaves no partial file behind."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from hand_models.base import InvalidInputError, to_install, whole_file
from service.bulk.columns import Column

__all__ = ["exporter_at", "write_csv"]

Exporter = Callable[[Path, Sequence[Column], Iterable[list[Any]]], None]
"""Function that writes rows with given columns to a file; raises `OSError` if it cannot."""


def exporter_at(path: Path) -> Exporter | None:
    """Return the function that writes the file format of a path's ending.

    Parameters
    ----------
    path : Path
        File to write; the ending is ``.csv`` or ``.parquet``.

    Returns
    -------
    callable or None
        Takes a path, columns and rows; None for any other ending.

    Raises
    ------
    InvalidInputError
        If pyarrow, which Parquet needs, is not installed, or the path is a folder.
    """
    exporter = {".csv": write_csv, ".parquet": _write_parquet}.get(path.suffix.lower())
    if exporter is _write_parquet:
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise InvalidInputError(
                f"needs pyarrow, which is not installed: {to_install('parquet')}", field="-o"
            ) from None
    if exporter is not None and path.is_dir():
        raise InvalidInputError(
            f"{path}: is a folder; remove it, or give another output", field="-o"
        )
    return exporter


def write_csv(path: Path, columns: Sequence[Column], rows: Iterable[list[Any]]) -> None:
    """Write a table as a CSV file; the first line has the names of the columns.

    Parameters
    ----------
    path : Path
        File to write, which is replaced as a whole.
    columns : sequence of Column
        Columns of the table.
    rows : iterable of list
        Values of each row, in the order of the columns.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([each.name for each in columns])
        writer.writerows(rows)


def _write_parquet(path: Path, columns: Sequence[Column], rows: Iterable[list[Any]]) -> None:
    """Write Parquet, with the unit and the meaning of each column in its metadata."""
    import pyarrow as pa
    from pyarrow import parquet

    types = {"int": pa.int64(), "float": pa.float64(), "bool": pa.bool_(), "text": pa.string()}
    fields = [
        pa.field(
            each.name,
            types[each.kind],
            nullable=not each.is_index,
            metadata={"unit": each.unit, "meaning": each.meaning},
        )
        for each in columns
    ]
    schema, left = pa.schema(fields), iter(rows)
    with whole_file(path) as part, parquet.ParquetWriter(part, schema) as file:
        # rows that are in memory at a time: a row group of Parquet
        while group := list(islice(left, 4096)):
            values = zip(*group, strict=True)
            arrays = [pa.array(each, f.type) for each, f in zip(values, schema, strict=True)]
            file.write_table(pa.Table.from_arrays(arrays, schema=schema))
