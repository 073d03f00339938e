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
    from mcap.records import Message

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
        False if the file was cut off, as where its service was killed; None before it is read.

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
        for _ in self._records(until_about=True):
            pass
        if not self.about:
            raise InvalidInputError(
                f"{path} is not a recording of crux serve; give a file of --record", field="FILE"
            )

    def questions(self, step: Callable[[int, int], None] | None = None) -> Iterator[Recorded]:
        """Yield all questions in the order of their answers.

        Parameters
        ----------
        step : callable, optional
            Called now and then with how much of the file has been read, and its size [bytes].
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
            about = msgspec.json.decode(message.data, type=QuestionRecord)
            request = about.payload or b""
            if about.payload is None:
                (_, asked), *own = own
                form = Format.named(about.encoding)
                request = asked.data
                if form is not Format.JSON:
                    request = form.encode(msgspec.json.decode(request))
            kind, answer = "", None
            if own:
                kind = own[0][0].rpartition("/")[2]
                answer = msgspec.json.decode(own[0][1].data)
            yield Recorded(about, request, kind, answer)

    def _records(
        self, step: Callable[[int, int], None] | None = None, *, until_about: bool = False
    ) -> Iterator[tuple[str, Message]]:
        """Yield all messages with their topics; read what is said of the service."""
        from mcap.exceptions import EndOfFile, McapError
        from mcap.records import Channel, Message, Metadata
        from mcap.stream_reader import StreamReader
        from zstandard import ZstdError

        topics: dict[int, str] = {}
        try:
            with self._path.open("rb") as stream:
                size = self._path.stat().st_size
                try:
                    for record in StreamReader(stream).records:
                        if isinstance(record, Metadata) and record.name == "crux":
                            self.about = dict(record.metadata)
                            if until_about:
                                return
                        elif isinstance(record, Channel):
                            topics[record.id] = record.topic
                        elif isinstance(record, Message):
                            yield topics[record.channel_id], record
                            if step is not None:
                                step(stream.seek(0, os.SEEK_CUR), size)
                    self.whole = True
                except (EndOfFile, ZstdError, struct.error):
                    self.whole = False
        except OSError as error:
            raise InvalidInputError(
                f"cannot read {self._path}: {error.strerror}", field="FILE"
            ) from None
        except McapError as error:
            raise InvalidInputError(f"{self._path}: {error}", field="FILE") from None
