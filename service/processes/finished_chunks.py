"""A file of finished chunks of work, with which work that was interrupted goes on."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from hashlib import sha256
from io import BufferedRandom
from pathlib import Path
from typing import ClassVar

from hand_models.base import InvalidInputError, reading_file

__all__ = ["FinishedChunks"]


class FinishedChunks:
    """Answers of the chunks of some work, by digests of what was asked; kept in a file, if any.

    The file only grows: a line with the digest of the work's inputs, then each answer behind its
    question's digest and its own length. What is cut off at the end is written anew.

    Parameters
    ----------
    path : Path or None
        The file, which need not exist; None to keep nothing.
    inputs : str
        Digest of all that the answers depend on, besides the questions.

    Raises
    ------
    InvalidInputError
        If the file is no such file, or of other inputs; the field is ``kept``.
    """

    begins: ClassVar[bytes] = b"crux finished chunks 1 "

    def __init__(self, path: Path | None, inputs: str) -> None:
        self._path = path
        self._first = self.begins + inputs.encode() + b"\n"
        self._answers: dict[bytes, bytes] = {}
        self._whole = 0
        self._out: BufferedRandom | None = None
        if path is not None and path.exists():
            with reading_file(path):
                self._read(path.read_bytes())

    def _read(self, content: bytes) -> None:
        """Take the answers of a file, as far as they are whole."""
        if not content.startswith(self._first):
            if self._first.startswith(content):
                return  # it was interrupted before its first line was whole
            if content.startswith(self.begins):
                raise InvalidInputError(
                    f"was begun with another rock, hand, robot or grid: {self._path}; give those "
                    "again, or another file",
                    field="kept",
                )
            raise InvalidInputError(
                f"is not a file of finished chunks: {self._path}; give another file", field="kept"
            )
        at = self._whole = len(self._first)
        digest, length = sha256().digest_size, 8
        while len(content) >= at + digest + length:
            start = at + digest + length
            end = start + int.from_bytes(content[at + digest : start], "big")
            if end > len(content):
                break
            self._answers[content[at : at + digest]] = content[start:end]
            at = self._whole = end

    @contextmanager
    def open(self) -> Generator[None, None, None]:
        """Open the file for further answers, as a context manager."""
        if self._path is None:
            yield
            return
        with self._path.open("r+b" if self._whole else "w+b") as out:
            if not self._whole:
                out.write(self._first)
            out.truncate(self._whole or None)
            out.seek(0, 2)
            self._out = out
            try:
                yield
            finally:
                self._out = None

    def find(self, question: bytes) -> bytes | None:
        """Return the answer to a question, or None."""
        return self._answers.get(sha256(question).digest())

    def add(self, question: bytes, answer: bytes) -> None:
        """Keep the answer to a question, in the file at once."""
        digest = sha256(question).digest()
        self._answers[digest] = answer
        if self._out is not None:
            self._out.write(digest + len(answer).to_bytes(8, "big") + answer)
            self._out.flush()
