"""Read the requests of a file, one JSON document for each line."""

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
    """Protocol of a source of requests that can be read again to resume a run."""

    @property
    def count(self) -> int:
        """Number of requests."""

    def __iter__(self) -> Iterator[bytes]:
        """Yield bytes that identify each request when the run is resumed."""

    def questions(self) -> Iterator[bytes | Answer]:
        """Yield each encoded request, or an `Answer` for a request that need not be planned."""


class Lines:
    """Lines of a file or of standard input, without blank lines; each line is one request.

    Parameters
    ----------
    source : str
        Path of the file, or ``-`` for standard input, which is copied to a temporary file.
    field : str, optional
        Name of the source in errors.

    Attributes
    ----------
    count : int
        Number of lines that are not blank.

    Raises
    ------
    InvalidInputError
        If the file cannot be read.
    """

    def __init__(self, source: str, field: str = "REQUESTS") -> None:
        try:
            if source == "-":
                self._file: BinaryIO = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `close`
                shutil.copyfileobj(sys.stdin.buffer, self._file)
            else:
                self._file = Path(source).open("rb")  # noqa: SIM115
            self.count = sum(1 for _ in self)
        except OSError as error:
            raise InvalidInputError(f"{error.strerror}: {source}", field=field) from None

    def __iter__(self) -> Iterator[bytes]:
        return (line for _, line in self.numbered())

    def questions(self) -> Iterator[bytes]:
        """Yield the lines that are not blank."""
        return iter(self)

    def numbered(self) -> Iterator[tuple[int, bytes]]:
        """Yield each line that is not blank, with its line number.

        Yields
        ------
        number : int
            Line number in the file, from one.
        line : bytes
            The line without its end.
        """
        self._file.seek(0)
        for number, line in enumerate(self._file, start=1):
            if line.strip():
                yield number, line.removesuffix(b"\n")

    def number(self, index: int) -> int:
        """Return the line number in the file, from one, of a request.

        Parameters
        ----------
        index : int
            Index of the request among the lines that are not blank, from zero.
        """
        return next(number for i, (number, _) in enumerate(self.numbered()) if i == index)

    def close(self) -> None:
        """Close the file."""
        self._file.close()
