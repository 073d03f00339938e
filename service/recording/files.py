"""Write one MCAP file, which is whole on the disk at each flush."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from hand_models.base import installed_version

if TYPE_CHECKING:
    from mcap.writer import Writer

__all__ = ["RecordingFile"]


class RecordingFile:
    """One file of a recording, which is being written.

    Parameters
    ----------
    path : Path
        File to create; there must be none.
    about : dict of str to str
        What is said of the service.
    chunk : int
        Size of a chunk, before it is compressed [bytes].
    """

    def __init__(self, path: Path, about: dict[str, str], chunk: int) -> None:
        from mcap.writer import Writer

        self.path = path
        self._stream = path.open("xb")
        self._writer: Writer = Writer(self._stream, chunk_size=chunk)
        self._writer.start(library=f"crux {installed_version()}")
        self._writer.add_metadata("crux", about)
        self._channels: dict[str, int] = {}
        self._whole = 0
        self.flush()

    @property
    def size(self) -> int:
        """Size of what has been flushed [bytes]."""
        return self._whole

    def add(
        self,
        topic: str,
        schema: Callable[[], tuple[str, str, bytes]],
        data: bytes,
        at: int,
        number: int = 0,
    ) -> None:
        """Add a message: topic, its schema (name, encoding, data), bytes, Unix time [ns].

        The schema is asked for with the first message of a topic.
        """
        if topic not in self._channels:
            name, encoding, described = schema()
            known = self._writer.register_schema(name, encoding, described)
            coded = "json" if encoding == "jsonschema" else "cdr"
            self._channels[topic] = self._writer.register_channel(topic, coded, known)
        # a sequence number has 32 bits
        self._writer.add_message(self._channels[topic], at, data, at, number % 2**32)

    def flush(self) -> None:
        """Finish the chunk, and wait until it is on the disk; raise an OSError if it cannot be."""
        self._writer.flush()
        os.fsync(self._stream.fileno())
        state = os.fstat(self._stream.fileno())
        if state.st_nlink == 0:
            raise FileNotFoundError(errno.ENOENT, f"{self.path} was deleted")
        self._whole = state.st_size

    def close(self) -> None:
        """Write the index, and close the file."""
        self._writer.finish()
        self._stream.close()

    def abandon(self) -> None:
        """Close the file as it was at the last flush, whatever the disk says."""
        with suppress(OSError):
            os.ftruncate(self._stream.fileno(), self._whole)
        # without what the stream still holds
        with suppress(OSError):
            self._stream.raw.close()
