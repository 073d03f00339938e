"""Tables that grow by whole parts, and go on after whatever has broken them off.

CSV is one file, of which its manifest says how much is whole; Parquet is a folder of parts, each of
which is there whole or not at all.
"""

from __future__ import annotations

import csv
import io
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any, Final, NamedTuple, Self

import msgspec

from hand_models.base import InvalidInputError, to_install, whole_file
from service.bulk.columns import INDEX, Column
from service.bulk.lines import Asked, LineDigest
from service.bulk.manifest import RESUME, Manifest, Part

__all__ = ["CSV", "PARQUET", "CsvTable", "ParquetTable", "Table", "table_at"]

CSV: Final = ".csv"
PARQUET: Final = ".parquet"

ROWS: Final = 4096
"""Of a part, at most."""

MANIFEST: Final = "_manifest.json"
"""In a folder of parts: a name that readers of data sets pass over."""


class _Kept(NamedTuple):
    """A row that is no part yet: the line that it answers, its values, and what they come to."""

    line: bytes
    values: Sequence[Any]
    status: str | None
    error: str | None


class _State(NamedTuple):
    """What is whole, and what is not yet; replaced at once, so that no interruption parts them."""

    manifest: Manifest
    digest: LineDigest
    kept: list[_Kept]


class Table(ABC):
    """Rows that are kept until they make a part, while it is entered.

    Parameters
    ----------
    path : Path
    columns : sequence of Column
    manifest : Manifest
        What is whole already.
    digest : LineDigest
        Of the lines that it answers.
    """

    seconds: float
    """Time after which rows make a part, few as they may be [s]."""

    def __init__(
        self, path: Path, columns: Sequence[Column], manifest: Manifest, digest: LineDigest
    ) -> None:
        self.path, self.columns = path, columns
        self._state = _State(manifest, digest, [])
        self._since = time.monotonic()

    @classmethod
    def opened(
        cls, path: Path, columns: Sequence[Column], begun: Manifest, resume: bool, asked: Asked
    ) -> Self:
        """Return a table that goes on, or one that is begun anew in place of what was there.

        Parameters
        ----------
        path : Path
        columns : sequence of Column
        begun : Manifest
            As it would be without rows.
        resume : bool
            Whether rows that are there are kept.
        asked : Asked
            All questions, those that they answer among them.

        Raises
        ------
        InvalidInputError
            If what is there is no such table, or, where it is to go on, one of other questions,
            numbers or columns.
        """
        there = Manifest.read(cls.manifest_path(path))
        if not resume or (there is None and not path.exists()):
            cls.check(path, there is not None)
            return cls(path, columns, begun, LineDigest())
        if there is None:
            raise InvalidInputError(
                f"{path}: no table that a batch has written, or a sweep", field=RESUME
            )
        return cls(path, columns, there, there.check(begun, asked, path))

    @property
    def manifest(self) -> Manifest:
        """What of it is whole."""
        return self._state.manifest

    @staticmethod
    @abstractmethod
    def manifest_path(path: Path) -> Path:
        """Return where a table's manifest is."""

    @staticmethod
    @abstractmethod
    def check(path: Path, ours: bool) -> None:
        """Refuse to write over what is something else.

        Parameters
        ----------
        path : Path
        ours : bool
            Whether a manifest is there.

        Raises
        ------
        InvalidInputError
        """

    @abstractmethod
    def begin(self) -> None:
        """Take away what is not whole."""

    @abstractmethod
    def _part(self, rows: list[list[Any]]) -> Part:
        """Write rows, and return the part that they are, or that they have made larger."""

    def __enter__(self) -> Self:
        self.begin()
        self._write_manifest(False)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self.keep(complete=True)
        elif not isinstance(error, OSError):
            # whole rows are whole, however the work has ended
            with suppress(OSError):
                self.keep()

    def write(
        self, line: bytes, values: Sequence[Any], status: str | None, error: str | None
    ) -> None:
        """Add the row of a request's line.

        Parameters
        ----------
        line : bytes
        values : sequence
            Of the columns but the index.
        status, error : str or None
            Of the plan, or the kind of the error.

        Raises
        ------
        OSError
            As `keep`.
        """
        self._state.kept.append(_Kept(line, values, status, error))
        many = len(self._state.kept) >= ROWS
        if many or time.monotonic() - self._since > self.seconds:
            self.keep()

    def keep(self, complete: bool = False) -> None:
        """Make the rows that there are a part.

        Raises
        ------
        OSError
            If that cannot be written; what was whole before is whole still.
        """
        manifest, digest, kept = self._state
        if kept:
            first = manifest.rows
            numbered = self.columns[0].name == INDEX
            part = self._part(
                [[*([first + i] if numbered else []), *each.values] for i, each in enumerate(kept)]
            )
            digest = digest.copy()
            for each in kept:
                digest.add(each.line)
            manifest = msgspec.structs.replace(
                manifest,
                parts=[*(each for each in manifest.parts if each.file != part.file), part],
                sha256=digest.hex(),
                statuses=_more(manifest.statuses, [each.status for each in kept]),
                errors=_more(manifest.errors, [each.error for each in kept]),
            )
            self._state = _State(manifest, digest, [])
        self._write_manifest(complete)
        self._since = time.monotonic()

    def _write_manifest(self, complete: bool) -> None:
        self.manifest.complete = complete
        self.manifest.write(self.manifest_path(self.path))


def _more(counts: dict[str, int], names: list[str | None]) -> dict[str, int]:
    return dict(Counter(counts) + Counter(name for name in names if name is not None))


class CsvTable(Table):
    """One file, of which more and more is whole."""

    seconds = 2.0

    @staticmethod
    def manifest_path(path: Path) -> Path:
        return path.with_name(f"{path.name}.manifest.json")

    @staticmethod
    def check(path: Path, ours: bool) -> None:
        if path.is_dir():
            raise InvalidInputError(f"{path}: is a folder", field="-o")

    def begin(self) -> None:
        if not self.manifest.parts:
            # a file without one could not be resumed
            self._write_manifest(False)
            self.path.write_bytes(b"")
            self._state = self._state._replace(
                manifest=msgspec.structs.replace(
                    self.manifest, parts=[self._append([[each.name for each in self.columns]], 0)]
                )
            )
        else:
            self._check_length()

    def _check_length(self) -> None:
        size = self.path.stat().st_size if self.path.exists() else 0
        if size < self.manifest.parts[0].bytes:
            raise InvalidInputError(
                f"{self.path}: is shorter than its manifest says; begin anew without it",
                field=RESUME,
            )

    def whole_rows(self) -> Iterator[list[str]]:
        """Yield the cells of each row that is whole.

        Raises
        ------
        InvalidInputError
            If the file has become shorter.
        """
        if not self.manifest.parts:
            return
        self._check_length()
        with self.path.open("rb") as file:
            whole = file.read(self.manifest.parts[0].bytes).decode()
        yield from islice(csv.reader(io.StringIO(whole, newline="")), 1, None)

    def _part(self, rows: list[list[Any]]) -> Part:
        return self._append(rows, len(rows))

    def _append(self, rows: list[list[Any]], count: int) -> Part:
        """Write rows after those that are whole, in place of whatever is there."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows(rows)
        data = text.getvalue().encode()
        before = sum(part.bytes for part in self.manifest.parts)
        with self.path.open("r+b", buffering=0) as file:
            file.truncate(before)
            file.seek(before)
            written = 0
            while written < len(data):
                written += file.write(data[written:])
        return Part(self.path.name, self.manifest.rows + count, before + len(data))


class ParquetTable(Table):
    """A folder of files, which together are the table."""

    seconds = 60.0

    @staticmethod
    def manifest_path(path: Path) -> Path:
        return path / MANIFEST

    @staticmethod
    def check(path: Path, ours: bool) -> None:
        if path.exists() and not ours and (not path.is_dir() or any(path.iterdir())):
            raise InvalidInputError(
                f"{path}: is there, and no table that a batch has written", field="-o"
            )

    def begin(self) -> None:
        self.path.mkdir(exist_ok=True)
        whole = {part.file for part in self.manifest.parts}
        for name in whole:
            if not (self.path / name).is_file():
                raise InvalidInputError(
                    f"{self.path}: its part {name} is missing; begin anew without it",
                    field=RESUME,
                )
        for file in [*self.path.glob("part-*.parquet"), *self.path.glob(".part-*.parquet")]:
            if file.name not in whole:
                file.unlink()

    def _part(self, rows: list[list[Any]]) -> Part:
        from pyarrow import parquet

        schema = _schema(self.columns)
        name = f"part-{len(self.manifest.parts):06d}.parquet"
        with whole_file(self.path / name) as part:
            parquet.write_table(_arrow_table(rows, schema), part)
        return Part(name, len(rows), (self.path / name).stat().st_size)


def _schema(columns: Sequence[Column]) -> Any:
    """Return the columns with their types, units and meanings."""
    import pyarrow as pa

    types = {"int": pa.int64(), "float": pa.float64(), "bool": pa.bool_(), "text": pa.string()}
    return pa.schema(
        [
            pa.field(
                each.name,
                types[each.kind],
                nullable=each.name != INDEX,
                metadata={"unit": each.unit, "meaning": each.meaning},
            )
            for each in columns
        ]
    )


def _arrow_table(rows: list[list[Any]], schema: Any) -> Any:
    import pyarrow as pa

    arrays = [
        pa.array(values, type=field.type)
        for values, field in zip(zip(*rows, strict=True), schema, strict=True)
    ]
    return pa.Table.from_arrays(arrays, schema=schema)


def table_at(path: Path) -> type[Table] | None:
    """Return the kind of table that a path's ending names; None where it names none.

    Raises
    ------
    InvalidInputError
        If it cannot be written, or something else is there.
    """
    ending = path.suffix.lower()
    if ending == CSV:
        return CsvTable
    if ending != PARQUET:
        return None
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise InvalidInputError(
            f"needs pyarrow, which is not installed: {to_install('parquet')}", field="-o"
        ) from None
    return ParquetTable
