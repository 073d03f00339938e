"""Tables as files: rows as CSV or Parquet, written whole or not at all."""

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
"""Writes rows with these columns at a path; `OSError` where that cannot be."""


def exporter_at(path: Path) -> Exporter | None:
    """Return the writer of the kind of table that a path's ending names; None where it names none.

    Raises
    ------
    InvalidInputError
        If it cannot be written, or a folder is there.
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
    """Write CSV, with the columns' names in its first line; `OSError` where that cannot be."""
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
