"""Requests of a file, one a line, read as needed."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Protocol

from hand_models.base import InvalidInputError
from service.wire import Answer

__all__ = ["Asked", "Lines"]


class Asked(Protocol):
    """Questions whose answers are kept."""

    @property
    def count(self) -> int:
        """Number of questions."""

    def __iter__(self) -> Iterator[bytes]:
        """Yield what each is known by when its answer is found again."""

    def questions(self) -> Iterator[bytes | Answer]:
        """Yield them, encoded, or the answers of those that need not be asked."""


class Lines:
    """The lines of a file, or of standard input, that are not blank.

    Parameters
    ----------
    source : str
        A path, or ``-``: standard input is kept in a file of its own until the end.

    Attributes
    ----------
    count : int
        Number of lines.

    Raises
    ------
    InvalidInputError
        If the file cannot be read.
    """

    def __init__(self, source: str) -> None:
        try:
            if source == "-":
                self._file: BinaryIO = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `close`
                shutil.copyfileobj(sys.stdin.buffer, self._file)
            else:
                self._file = Path(source).open("rb")  # noqa: SIM115
            self.count = sum(1 for _ in self)
        except OSError as error:
            raise InvalidInputError(f"{error.strerror}: {source}", field="REQUESTS") from None

    def __iter__(self) -> Iterator[bytes]:
        return (line for _, line in self.numbered())

    def questions(self) -> Iterator[bytes]:
        """Yield the lines."""
        return iter(self)

    def numbered(self) -> Iterator[tuple[int, bytes]]:
        """Yield each line, without its end, and its number in the file, from one."""
        self._file.seek(0)
        for number, line in enumerate(self._file, start=1):
            if line.strip():
                yield number, line.removesuffix(b"\n")

    def number(self, index: int) -> int:
        """Return the number in the file of a line, by its place among those that are not blank."""
        return next(number for i, (number, _) in enumerate(self.numbered()) if i == index)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
