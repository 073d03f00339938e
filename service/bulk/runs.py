"""Write the answers of a bulk run to a file of JSON lines, from which a broken run is resumed.

The file only grows. Its complete lines are the finished answers, however the run ended; the request
of an incomplete last line is asked again. Lines are replies, or table rows with a digest of the
request that they answer.
"""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from hashlib import blake2b
from io import FileIO
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import msgspec

from hand_models.base import InvalidInputError
from planner import Time
from service.bulk.columns import Column, TableRow, row_of
from service.bulk.exports import exporter_at
from service.bulk.headers import Header
from service.bulk.lines import Asked
from service.bulk.tally import Tally
from service.replies import ErrorDetail
from service.wire import Format, identifier

__all__ = ["AnswerOutcome", "ReplyLines", "Run", "TableLines", "question_digest"]


class AnswerOutcome(NamedTuple):
    """Outcome of a question, for the tally; the time is in s."""

    status: str | None
    error: ErrorDetail | None
    seconds: float | None = None


class Run(ABC):
    """Answers of a bulk run, in the order of the requests, appended to a file of JSON lines.

    Parameters
    ----------
    file : Path or None
        File of the lines; None to write no file.
    resume : bool
        True to keep the lines of an existing file, and to continue after them.
    asked : Asked
        All requests of the run, including those that the file answers.
    header : Header, optional
        First line of the file; None for a file without a header.

    Attributes
    ----------
    file : Path or None
        File of the lines.
    tally : Tally
        Counts of all answers, including those of an existing file.

    Raises
    ------
    InvalidInputError
        If the existing lines do not answer these requests.
    OSError
        If the file cannot be read.
    """

    def __init__(
        self, file: Path | None, resume: bool, asked: Asked, header: Header | None = None
    ) -> None:
        self.file, self._header = file, header
        self.tally = Tally()
        self._out: FileIO | None = None
        self._kept = 0
        if file is not None and resume and file.exists():
            self._kept = self._read(file, asked)

    @contextmanager
    def open(self) -> Iterator[None]:
        """Open the file for writing, as a context manager; an incomplete last line is removed.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        if self.file is None:
            yield
            return
        with self.file.open("r+b" if self._kept else "wb", buffering=0) as out:
            if self._kept:
                # what is cut off
                out.truncate(self._kept)
                out.seek(self._kept)
            elif self._header is not None:
                _append(msgspec.json.encode(self._header) + b"\n", out)
            self._out = out
            yield

    def write(self, question: bytes, payload: bytes, seconds: float) -> None:
        """Append a reply to the file, as the reply to the next request without one, and count it.

        Parameters
        ----------
        question : bytes
            The request, as `Asked` yields it.
        payload : bytes
            Encoded reply or error reply.
        seconds : float
            Time that the answer took [s].

        Raises
        ------
        OSError
            If the line cannot be written.
        """
        line, outcome = self._line(question, payload, seconds)
        if self._out is not None:
            _append(line, self._out, lambda: self.tally.add(*outcome))
        else:
            self.tally.add(*outcome)

    @abstractmethod
    def _line(self, question: bytes, payload: bytes, seconds: float) -> tuple[bytes, AnswerOutcome]:
        """Return the line of an answer, and what is to be counted."""

    @abstractmethod
    def _read_line(self, line: bytes, question: bytes, where: str) -> AnswerOutcome:
        """Return what is to be counted of a line, if it is an answer to a question."""

    def _read(self, file: Path, asked: Asked) -> int:
        """Count what the whole lines of a file are, and return their bytes."""
        heads = self._header is not None
        with file.open("rb") as stream:
            count = sum(line.endswith(b"\n") for line in stream) - heads
            if count < 0:
                # ended before its first line was whole
                return 0
            stream.seek(0)
            if self._header is not None:
                self._header.check(stream.readline(), file)
            if count > asked.count:
                raise InvalidInputError(
                    f"{file} has {count} replies, and there are {asked.count} requests; is it "
                    "the file of another batch? give another output, or leave out --resume",
                    field="--resume",
                )
            for number, question in enumerate(islice(asked, count), start=1 + heads):
                outcome = self._read_line(stream.readline(), question, f"{file}, line {number}")
                self.tally.add(*outcome)
            kept = stream.tell()
            last = stream.readline()
        # each line of replies begins so
        reply = b'{"v":1,'
        if last and not heads and not last.startswith(reply[: len(last)]):
            raise InvalidInputError(
                f"{file}: its last line, which has no end of line, is {_quoted(last)}, not the "
                "start of a reply; remove that line, or name the file of the batch with -o",
                field="--resume",
            )
        return kept


def _quoted(line: bytes) -> str:
    """Return the beginning of a line, in quotes."""
    return repr(line[:40].decode(errors="replace"))


def _append(line: bytes, out: FileIO, count: Callable[[], object] = bool) -> None:
    """Write a line and count it. Wherever a signal comes, a line in the file is one that counts."""
    begin, written = out.seek(0, 2), 0
    try:
        while written < len(line):
            written += out.write(line[written:])
        count()
    except BaseException:
        with suppress(OSError):
            out.truncate(out.seek(begin))
        raise


class _Reply(msgspec.Struct):
    """Fields of a reply that the tally needs."""

    id: str | None = None
    status: str | None = None
    time: Time | None = None
    error: ErrorDetail | None = None

    @property
    def outcome(self) -> AnswerOutcome:
        seconds = None if self.time is None else self.time.total
        return AnswerOutcome(self.status, self.error, seconds)


class ReplyLines(Run):
    """Replies of a bulk run as lines of JSON: in a file, on standard output, or nowhere.

    Parameters
    ----------
    file : Path or None
        File of the lines; None to write no file.
    shown : bool
        True to print the replies on standard output if ``file`` is None.
    resume : bool
        True to keep the lines of an existing file, and to continue after them.
    asked : Asked
        All requests of the run, including those that the file answers.
    """

    def __init__(self, file: Path | None, shown: bool, resume: bool, asked: Asked) -> None:
        super().__init__(file, resume, asked)
        self._shown = shown and file is None

    def _line(self, question: bytes, payload: bytes, seconds: float) -> tuple[bytes, AnswerOutcome]:
        reply = msgspec.json.decode(payload, type=_Reply)
        line = payload + b"\n"
        if self._shown:
            sys.stdout.buffer.write(line)
            sys.stdout.buffer.flush()
        return line, reply.outcome

    def _read_line(self, line: bytes, question: bytes, where: str) -> AnswerOutcome:
        try:
            reply = msgspec.json.decode(line, type=_Reply)
        except (msgspec.DecodeError, UnicodeDecodeError):
            raise InvalidInputError(
                f"{where}: not a reply of a batch; name the file of the batch with -o",
                field="--resume",
            ) from None
        name = identifier(question, Format.JSON)
        if reply.id != name:
            raise InvalidInputError(
                f"{where}: answers {reply.id!r}, and the request is {name!r}; is the file of "
                "another batch?",
                field="--resume",
            )
        if reply.status is None and reply.error is None:
            raise InvalidInputError(
                f"{where}: not a reply of a batch; name the file of the batch with -o",
                field="--resume",
            )
        return reply.outcome


class _RowLine(TableRow, omit_defaults=True, kw_only=True):
    """A row as a line: with a digest of the question that it answers."""

    asked: str


class TableLines(Run):
    """Rows of a table, appended to a file ``TABLE.jsonl``; the table itself is exported at the end.

    Parameters
    ----------
    table : Path
        File of the table, ``.csv`` or ``.parquet``.
    columns : sequence of Column
        Columns of the table.
    header : Header
        Header of the rows, which identifies the run.
    resume : bool
        True to keep the rows of an existing file, and to continue after them.
    asked : Asked
        All requests of the run, including those that the file answers.

    Raises
    ------
    InvalidInputError
        If an existing file is not from this program, or its rows are of another run.
    OSError
        If the file cannot be read.
    """

    def __init__(
        self,
        table: Path,
        columns: Sequence[Column],
        header: Header,
        resume: bool,
        asked: Asked,
    ) -> None:
        export = exporter_at(table)
        assert export is not None
        self._table, self._described, self._export = table, columns, export
        self._numbered = columns[0].is_index
        file = table.with_name(f"{table.name}.jsonl")
        if file.exists():
            self._check_own(file, resume)
        elif resume:
            self._refuse_other(table)
        super().__init__(file, resume, asked, header)

    @staticmethod
    def _check_own(file: Path, resume: bool) -> None:
        """Refuse to write over lines that are no table's."""
        with file.open("rb") as stream:
            first = stream.read(8)
        # an unfinished table may have less of its header
        if not b'{"crux":'.startswith(first):
            raise InvalidInputError(
                f"{file}: not a table of crux batch or crux sweep; give another output",
                field="--resume" if resume else "-o",
            )

    @staticmethod
    def _refuse_other(table: Path) -> None:
        """Refuse to go on with a table that has no lines beside it."""
        # versions before runs were lines had a manifest
        if Path(f"{table}.manifest.json").exists() or (table / "_manifest.json").exists():
            raise InvalidInputError(
                f"{table}: was started by an older version and cannot be resumed; start again "
                "without --resume",
                field="--resume",
            )
        if table.exists():
            raise InvalidInputError(
                f"{table}: not a table of crux batch or crux sweep, which has a file "
                f"{table.name}.jsonl beside it; give another output",
                field="--resume",
            )

    def row(self, payload: bytes) -> TableRow:
        """Return a row of the table from the reply to a request, in JSON."""
        return row_of(payload, self._described)

    @contextmanager
    def open(self) -> Iterator[None]:
        """Open the file of rows for writing, as a context manager; on exit, export the table.

        The table is not exported if the context ends with an exception.

        Raises
        ------
        OSError
            If the rows or the table cannot be written.
        """
        with super().open():
            yield
        self.export()

    def export(self) -> None:
        """Write the table of all rows so far, as CSV or Parquet; a failure leaves no partial table.

        Raises
        ------
        OSError
            If the table cannot be written.
        """
        values = (row.values for row in self.rows())
        if self._numbered:
            values = ([i, *each] for i, each in enumerate(values))
        self._export(self._table, self._described, values)

    def rows(self) -> Iterator[TableRow]:
        """Read the finished rows from the file, and yield them in the order of the requests."""
        assert self.file is not None
        with self.file.open("rb") as lines:
            for line in islice(lines, 1, 1 + self.tally.count):
                yield msgspec.json.decode(line, type=_RowLine)

    def _line(self, question: bytes, payload: bytes, seconds: float) -> tuple[bytes, AnswerOutcome]:
        row = self.row(payload)
        line = _RowLine(row.values, row.status, row.error, asked=question_digest(question))
        return msgspec.json.encode(line) + b"\n", AnswerOutcome(row.status, row.error, seconds)

    def _read_line(self, line: bytes, question: bytes, where: str) -> AnswerOutcome:
        try:
            row = msgspec.json.decode(line, type=_RowLine)
            whole = len(row.values) + self._numbered == len(self._described)
        except (msgspec.DecodeError, UnicodeDecodeError):
            whole = False
        if not whole:
            raise InvalidInputError(
                f"{where}: not a row of this table; is it the file of another batch or sweep? "
                "give another output, or leave out --resume",
                field="--resume",
            )
        if row.asked != question_digest(question):
            raise InvalidInputError(
                f"{where}: the rows answer other requests than those given now; give these again, "
                "as they were, or start again without --resume",
                field="--resume",
            )
        return AnswerOutcome(row.status, row.error)


def question_digest(question: bytes) -> str:
    """Return a digest of a question, or of a part of one."""
    return blake2b(question, digest_size=8).hexdigest()
