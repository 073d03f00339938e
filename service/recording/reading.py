"""Read what a recording has of each question, in order, also of a file that was cut off."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from hand_models.base import InvalidInputError, to_install
from service.recording.channels import QUESTIONS_TOPIC, QuestionRecord
from service.wire import Format

if TYPE_CHECKING:
    from mcap.records import Chunk, McapRecord, Message

__all__ = ["Recorded", "Recording"]


class Recorded(NamedTuple):
    """A question and its answer, as they were recorded.

    Attributes
    ----------
    about : QuestionRecord
        What the recording has of the question.
    request : bytes
        The request, in its encoding.
    kind : str
        Name of the type of the answer; empty where there is none.
    answer : object
        The answer, decoded; None where there is none.
    """

    about: QuestionRecord
    request: bytes
    kind: str
    answer: Any


class Recording:
    """Recording of a service: an MCAP file, read from its beginning.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    about : dict of str to str
        What is said of the service: ``version``, ``robot`` and, if it has its own, ``hand``.
    whole : bool or None
        False if the file was cut off, as where its service was killed, or is damaged so that what
        follows cannot be found; None before it is read.
    read : int
        How much of the file has been read [bytes].
    chunks, damaged : int
        Number of chunks so far, and of those that are damaged: their questions are left out.

    Raises
    ------
    InvalidInputError
        If the library mcap is not installed, or the file cannot be read, or is not a recording of
        a service.
    """

    def __init__(self, path: Path) -> None:
        try:
            import mcap.records  # noqa: F401
        except ImportError:
            message = f"needs mcap, which is not installed: {to_install('record')}"
            raise InvalidInputError(message, field="FILE") from None
        self._path = path
        self.about: dict[str, str] = {}
        self.whole: bool | None = None
        self.read = self.chunks = self.damaged = 0
        for _ in self._records(until_about=True):
            pass
        if not self.about:
            raise InvalidInputError(
                f"{path} is not a recording of crux serve; give a file of --record", field="FILE"
            )

    def questions(self, step: Callable[[int, int], None] | None = None) -> Iterator[Recorded]:
        """Yield all questions in the order of their answers; those of damaged chunks are left out.

        Parameters
        ----------
        step : callable, optional
            Called now and then with how much of the file has been read, and its size [bytes].

        Raises
        ------
        InvalidInputError
            If the file cannot be read, or has questions of a form that is not known.
        """
        held: list[tuple[str, Message]] = []
        for topic, message in self._records(step):
            if message.sequence == 0:
                continue
            if not topic.endswith(f"/{QUESTIONS_TOPIC}/{QuestionRecord.__name__}"):
                held.append((topic, message))
                continue
            own = [each for each in held if each[1].sequence == message.sequence]
            held = []
            try:
                found = _recorded(message.data, own)
            except msgspec.DecodeError as error:
                raise InvalidInputError(
                    f"{self._path}: a question is recorded in a form that is not known: {error}; "
                    "read it with the version that has recorded it",
                    field="FILE",
                ) from None
            if found is not None:
                yield found

    def _records(
        self, step: Callable[[int, int], None] | None = None, *, until_about: bool = False
    ) -> Iterator[tuple[str, Message]]:
        """Yield all messages with their topics; read what is said of the service."""
        from mcap.records import Channel, Chunk, Message, Metadata, Statistics
        from mcap.stream_reader import StreamReader

        topics: dict[int, str] = {}
        self.damaged = self.chunks = 0
        try:
            with self._path.open("rb") as stream:
                size = self._path.stat().st_size
                try:
                    for record in StreamReader(stream, emit_chunks=True).records:
                        if isinstance(record, Metadata) and record.name == "crux":
                            self.about = dict(record.metadata)
                            if until_about:
                                return
                        elif isinstance(record, Statistics):
                            # one whose kind was damaged has been passed over
                            passed = max(record.chunk_count - self.chunks, 0)
                            self.damaged += passed
                            self.chunks += passed
                        elif isinstance(record, Chunk):
                            self.chunks += 1
                            for each in self._of_chunk(record):
                                if isinstance(each, Channel):
                                    topics[each.id] = each.topic
                                # a channel of a damaged chunk has no name
                                elif isinstance(each, Message) and each.channel_id in topics:
                                    yield topics[each.channel_id], each
                            self.read = stream.seek(0, os.SEEK_CUR)
                            if step is not None:
                                step(self.read, size)
                    self.whole = True
                except _unreadable():
                    self.whole = False
        except OSError as error:
            raise InvalidInputError(
                f"cannot read {self._path}: {error.strerror}", field="FILE"
            ) from None

    def _of_chunk(self, chunk: Chunk) -> list[McapRecord]:
        """Return the records of a chunk; none if its checksum says that it is damaged."""
        from mcap.stream_reader import breakup_chunk

        try:
            return list(breakup_chunk(chunk, validate_crc=True))
        except _unreadable():
            self.damaged += 1
            return []


def _unreadable() -> tuple[type[Exception], ...]:
    """Return what the library mcap raises where bytes are missing or damaged."""
    from mcap.exceptions import McapError
    from zstandard import ZstdError

    # ValueError: a checksum, or text that is not UTF-8
    return McapError, ZstdError, struct.error, ValueError, OverflowError, MemoryError


def _recorded(data: bytes, own: list[tuple[str, Message]]) -> Recorded | None:
    """Return a question of its record and its messages; None if the request is lost."""
    about = msgspec.json.decode(data, type=QuestionRecord)
    request = about.payload or b""
    if about.payload is None:
        if not own or not own[0][0].endswith("Request"):
            return None
        (_, asked), *own = own
        form = Format.named(about.encoding)
        request = asked.data
        if form is not Format.JSON:
            request = form.encode(msgspec.json.decode(request))
    kind, answer = "", None
    if own:
        kind = own[0][0].rpartition("/")[2]
        answer = msgspec.json.decode(own[0][1].data)
    return Recorded(about, request, kind, answer)
