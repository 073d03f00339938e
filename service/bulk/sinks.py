"""Where answers go in the order of their requests: lines of replies, or rows of a table."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from io import FileIO
from pathlib import Path
from typing import Final, Protocol

import msgspec

from hand_models.base import InvalidInputError
from planner import Time
from service.bulk.columns import Row
from service.bulk.lines import Asked
from service.bulk.tables import Table
from service.bulk.tally import Tally
from service.replies import ErrorDetail
from service.wire import Format, identifier

__all__ = ["ReplyLines", "Rows", "Sink"]

REPLY: Final = b'{"v":1,'
"""How each line of replies begins."""

RESUME: Final = "--resume"


class Sink(Protocol):
    """Takes answers.

    Attributes
    ----------
    columns : tuple of str or None
        As `service.bulk.evaluate` takes them.
    tally : Tally
        Of all answers, with those that were there before.
    whole : int
        Answers that stay, whatever comes.
    """

    tally: Tally

    @property
    def columns(self) -> tuple[str, ...] | None: ...

    @property
    def whole(self) -> int: ...

    def open(self) -> AbstractContextManager[None]:
        """Be ready to write while this is entered; `OSError` where that cannot be."""

    def write(self, line: bytes, payload: bytes, seconds: float) -> None:
        """Take the answer to the next line; `OSError` where it cannot be written."""


class _Told(msgspec.Struct):
    """What the tally needs to know of a reply."""

    id: str | None = None
    status: str | None = None
    time: Time | None = None
    error: ErrorDetail | None = None

    def count(self, tally: Tally) -> None:
        """Add it to a tally."""
        tally.add(self.status, self.error, None if self.time is None else self.time.total)


class ReplyLines:
    """Replies, one a line, in a file, on standard output, or nowhere.

    A file has whole lines at any time but while one of them is being written.

    Parameters
    ----------
    file : Path or None
    shown : bool
        Whether they go to standard output where there is no file.
    resume : bool
        Whether the file's replies are kept.
    lines : Asked
        The requests.

    Raises
    ------
    InvalidInputError
        If the file's replies are none to these requests.
    OSError
        If it cannot be read or written.
    """

    columns = None

    def __init__(self, file: Path | None, shown: bool, resume: bool, lines: Asked) -> None:
        self._file, self._shown, self._resume = file, shown, resume
        self._out: FileIO | None = None
        self.tally = Tally()
        if file is not None and resume and file.exists():
            self._read(file, lines)

    @property
    def whole(self) -> int:
        """All that are written."""
        return self.tally.count

    @contextmanager
    def open(self) -> Iterator[None]:
        if self._file is None:
            yield
            return
        with self._file.open("ab" if self._resume else "wb", buffering=0) as self._out:
            yield

    def write(self, line: bytes, payload: bytes, seconds: float) -> None:
        # before it is written, so that next to nothing is between a line and its count
        told = msgspec.json.decode(payload, type=_Told)
        if self._out is not None:
            self._append(payload + b"\n", self._out)
        elif self._shown:
            sys.stdout.buffer.write(payload + b"\n")
            sys.stdout.buffer.flush()
        told.count(self.tally)

    def _append(self, line: bytes, out: FileIO) -> None:
        written = 0
        try:
            while written < len(line):
                written += out.write(line[written:])
        except BaseException:
            # a line that is cut off would be read by nobody
            with suppress(OSError):
                out.truncate(out.seek(0, 2) - written)
            raise

    def _read(self, file: Path, lines: Asked) -> None:
        """Count what the whole lines of a file tell, and drop a last one that is cut off."""
        with file.open("rb") as stream:
            count = sum(line.endswith(b"\n") for line in stream)
            if count > lines.count:
                raise InvalidInputError(
                    f"{file} has {count} replies, and there are {lines.count} requests; "
                    "is it of another batch?",
                    field=RESUME,
                )
            stream.seek(0)
            whole = 0
            for number, line in enumerate(lines, start=1):
                if number > count:
                    break
                reply = stream.readline()
                whole += len(reply)
                _checked(reply, line, f"{file}, line {number}").count(self.tally)
            last = stream.readline()
        if last:
            if not last.startswith(REPLY[: len(last)]):
                raise InvalidInputError(f"{file}: its end is of no reply", field=RESUME)
            with file.open("r+b") as stream:
                stream.truncate(whole)


def _checked(reply: bytes, line: bytes, where: str) -> _Told:
    """Return what a reply tells, if it is one to a request."""
    try:
        told = msgspec.json.decode(reply, type=_Told)
    except (msgspec.DecodeError, UnicodeDecodeError):
        raise InvalidInputError(f"{where}: no reply", field=RESUME) from None
    asked = identifier(line, Format.JSON)
    if told.id != asked:
        raise InvalidInputError(
            f"{where}: answers {told.id!r}, and the request is {asked!r}; is it of another batch?",
            field=RESUME,
        )
    if told.status is None and told.error is None:
        raise InvalidInputError(f"{where}: no reply", field=RESUME)
    return told


class Rows:
    """Rows of a table.

    Parameters
    ----------
    table : Table
    """

    def __init__(self, table: Table) -> None:
        self._table = table
        self.tally = Tally.of(table.manifest.statuses, table.manifest.errors)

    @property
    def columns(self) -> tuple[str, ...] | None:
        return tuple(column.name for column in self._table.columns)

    @property
    def whole(self) -> int:
        """Rows of whole parts."""
        return self._table.manifest.rows

    @contextmanager
    def open(self) -> Iterator[None]:
        with self._table:
            yield

    def write(self, line: bytes, payload: bytes, seconds: float) -> None:
        row = self.row(payload)
        error = None if row.error is None else row.error.kind
        self.tally.add(row.status, row.error, seconds)
        self._table.write(line, row.values, row.status, error)

    def row(self, payload: bytes) -> Row:
        """Return what the table tells of an answer."""
        return msgspec.msgpack.decode(payload, type=Row)
