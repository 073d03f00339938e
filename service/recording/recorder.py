"""Record what a service is asked and what it answers: in a thread of its own, never in its way."""

from __future__ import annotations

import errno
import logging
import re
import threading
import time
from functools import partial
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Final, NamedTuple

import msgspec

from hand_models.base import CruxError, InvalidInputError, installed_version, to_install
from hand_models.parameters import ParameterTable
from service.answering import SERVICES_BY_NAME
from service.recording.channels import QUESTIONS_TOPIC, QuestionRecord, channel_schema, topic_of
from service.recording.files import RecordingFile
from service.replies import RecordingHealth
from service.requests import CancelRequest, WrenchRequest
from service.wire import Answer, Format, ServiceName, schema, service_key

__all__ = ["RECORDER_SETTINGS", "Exchange", "Recorder", "RosSample"]

log = logging.getLogger(__name__)


class _Settings(NamedTuple):
    """Times [s] and sizes [bytes] of a recorder."""

    flush: float = 1.0
    """Time after which what has been recorded is on the disk."""
    rest: float = 10.0
    """Time after a failure, before another file is begun; and between lines of the log."""
    chunk: int = 2**20
    """Size of a chunk, before it is compressed."""
    held: int = 2**27
    """Largest sum of the messages that wait to be written; further ones are dropped."""
    overhead: int = 2**10
    """Size that a message counts beyond its bytes."""
    parts: int = 8
    """Number of files among which the limit of a recording is divided."""


RECORDER_SETTINGS: Final = _Settings()


class Exchange(NamedTuple):
    """A question and what was answered; either may be missing.

    Attributes
    ----------
    key : str
        Zenoh key of the question; of a published wrench, that of its set-points.
    age : float
        Time since the question arrived [s].
    encoding : str
        Zenoh encoding of the request.
    request : bytes or None
        Encoded request; None for a part of an answer.
    answer : Answer or None
        The answer; None for a published wrench that a newer one has replaced.
    client : str
        Identifier of the client's session; empty without one.
    waited : float
        Time from arrival to work [s].
    """

    key: str
    age: float
    encoding: str
    request: bytes | None
    answer: Answer | None
    client: str = ""
    waited: float = 0.0


class RosSample(NamedTuple):
    """Message of ROS 2: topic, type, definition of the type, and the message's CDR."""

    topic: str
    kind: str
    definition: str
    data: bytes

    def schema(self) -> tuple[str, str, bytes]:
        """Return the schema of its channel: name, encoding, and the definition of the type."""
        return self.kind, "ros2msg", self.definition.encode()


class Recorder:
    """Recorder of a service: writes MCAP files in a thread; what it is given, it takes at once.

    If the file exists, the next one of ``FILE-2.mcap``, ``FILE-3.mcap``, … is written: nothing is
    ever written over. If a file cannot be written further, it ends with what was flushed before,
    and another is begun after 10 s; what comes meanwhile is dropped.

    Parameters
    ----------
    path : Path
        File to write.
    robot : str
        Name of the robot.
    hand : ParameterTable, optional
        Entries that replace those of the bundled hand; a replay needs them.
    limit : int, optional
        Largest size of all files of the recording, of earlier ones, too [bytes]; the oldest are
        deleted. By default they have no limit.

    Raises
    ------
    InvalidInputError
        If the library mcap is not installed, or the file cannot be written.
    """

    def __init__(
        self, path: Path, robot: str, hand: ParameterTable | None = None, limit: int | None = None
    ) -> None:
        self._path, self._robot, self._limit = path, robot, limit
        self._about = {"version": installed_version() or "", "robot": robot}
        if hand is not None:
            self._about["hand"] = msgspec.json.encode(hand.sections).decode()
        self._queue: SimpleQueue[tuple[int, int, Exchange | RosSample] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._held = self._dropped = self._logged = self._count = 0
        # of what is recorded, what is not yet on the disk
        self._unsafe = 0
        self._problem: str | None = None
        self._again = self._logs_at = 0.0
        try:
            self._file: RecordingFile | None = self._begun()
        except ImportError:
            message = f"needs mcap, which is not installed: {to_install('record')}"
            raise InvalidInputError(message, field="--record") from None
        except OSError as error:
            message = f"cannot write {path}: {error.strerror}; give a file that can be written"
            raise InvalidInputError(message, field="--record") from None
        self._thread = threading.Thread(target=self._run, name="crux-record", daemon=True)
        self._thread.start()

    def add(self, item: Exchange | RosSample) -> None:
        """Record something; returns at once, also from several threads at a time."""
        size = RECORDER_SETTINGS.overhead
        if isinstance(item, RosSample):
            size += len(item.data)
        else:
            size += len(item.request or b"") + (len(item.answer.payload) if item.answer else 0)
        with self._lock:
            if self._held + size > RECORDER_SETTINGS.held:
                self._dropped += 1
                return
            self._held += size
        self._queue.put((time.time_ns(), size, item))

    def health(self) -> RecordingHealth:
        """Return what is recorded, and what is not."""
        file = self._file
        return RecordingHealth(
            file=None if file is None else str(file.path),
            bytes=0 if file is None else file.size,
            recorded=self._count,
            dropped=self._dropped,
            problem=self._problem,
        )

    def close(self) -> None:
        """Record what still waits, write the index, and end; wait for it up to 5 s."""
        self._queue.put(None)
        self._thread.join(timeout=5.0)

    # the thread ----------------------------------------------------------------------------------

    def _run(self) -> None:
        self._definitions: dict[str, Any] = schema()["$defs"]
        flush_at: float | None = None
        ended = False
        while not ended:
            try:
                rest = None if flush_at is None else max(flush_at - time.monotonic(), 0.0)
                found = self._queue.get(timeout=rest)
            except Empty:
                self._guarded(self._flush)
                flush_at = None
                continue
            if found is None:
                ended = True
            else:
                self._take(*found)
                if flush_at is None:
                    flush_at = time.monotonic() + RECORDER_SETTINGS.flush
                elif flush_at <= time.monotonic():
                    self._guarded(self._flush)
                    flush_at = None
            self._log_dropped()
        if self._file is not None:
            self._guarded(self._file.close)

    def _take(self, at: int, size: int, item: Exchange | RosSample) -> None:
        """Write something that waited, or drop it while nothing can be written."""
        if self._file is None and time.monotonic() >= self._again:
            self._guarded(self._begin)
        written = self._file is not None and self._guarded(self._write, self._file, at, item)
        with self._lock:
            self._held -= size
            self._dropped += not written

    def _guarded(self, step: Any, *given: Any) -> bool:
        """Do a step; if nothing can be written, end the file and begin another one later."""
        try:
            step(*given)
            return True
        except OSError as error:
            self._again = time.monotonic() + RECORDER_SETTINGS.rest
            self._problem = error.strerror or repr(error)
            log.error(
                "nothing is recorded: %s; another file is begun in %g s or later",
                self._problem,
                RECORDER_SETTINGS.rest,
            )
            file, self._file = self._file, None
            if file is not None:
                file.abandon()
            with self._lock:
                self._dropped += self._unsafe
            self._count, self._unsafe = self._count - self._unsafe, 0
        except Exception:
            log.exception("a message is not recorded")
        return False

    def _log_dropped(self) -> None:
        """Log how much has been dropped since the last time, now and then."""
        if self._dropped > self._logged and time.monotonic() >= self._logs_at:
            self._logs_at = time.monotonic() + RECORDER_SETTINGS.rest
            log.warning("%d messages are not recorded", self._dropped - self._logged)
            self._logged = self._dropped

    def _flush(self) -> None:
        if self._file is None:
            return
        self._file.flush()
        self._unsafe = 0
        if self._limit is not None and self._file.size >= self._limit // RECORDER_SETTINGS.parts:
            self._file.close()
            self._file = None
            self._begin()

    def _begin(self) -> None:
        self._file = self._begun()
        self._problem = None

    def _begun(self) -> RecordingFile:
        """Begin the next file; delete the oldest ones where the limit asks for it."""
        series = self._series()
        if self._limit is not None:
            most = self._limit - self._limit // RECORDER_SETTINGS.parts
            while series and sum(each.stat().st_size for each in series.values()) > most:
                series.pop(min(series)).unlink()
        number = max(series, default=0) + 1
        stem, ending = self._path.stem, self._path.suffix
        path = self._path if number == 1 else self._path.with_name(f"{stem}-{number}{ending}")
        try:
            return RecordingFile(path, self._about, RECORDER_SETTINGS.chunk)
        except OSError as error:
            # an empty file is of no use, and would make the next one another's successor
            if error.errno != errno.EEXIST:
                path.unlink(missing_ok=True)
            raise

    def _series(self) -> dict[int, Path]:
        """Return the files of this recording that there are, by number."""
        stem, ending = re.escape(self._path.stem), re.escape(self._path.suffix)
        named = re.compile(f"{stem}(?:-([1-9][0-9]*))?{ending}")
        found = {}
        for path in self._path.parent.iterdir():
            if match := named.fullmatch(path.name):
                found[int(match[1] or 1)] = path
        return found

    def _write(self, file: RecordingFile, at: int, item: Exchange | RosSample) -> None:
        if isinstance(item, RosSample):
            file.add(item.topic, item.schema, item.data, at)
            self._added()
            return
        number = 0 if item.request is None else self._count + 1
        arrived = at - round(1e9 * item.age)
        lost = None
        if item.request is not None:
            text = _as_json(item.request, item.encoding)
            if text is None:
                lost = item.request
            else:
                self._message(file, item.key, _request_kind(item.key), text, arrived, number)
        if item.answer is not None:
            kind = item.answer.encoding.partition(";crux.")[2].partition("@")[0]
            own = item.answer.encoding.startswith(Format.JSON.value)
            text = item.answer.payload if own else _as_json(*item.answer[:2])
            self._message(file, item.key, kind, text or b"null", at, number)
        if item.request is not None:
            about = QuestionRecord(
                number=number,
                key=item.key,
                client=item.client,
                status="skipped" if item.answer is None else item.answer.status,
                encoding=item.encoding,
                waited=item.waited,
                worked=0.0 if item.answer is None else item.answer.seconds,
                payload=lost,
            )
            kind, key = QuestionRecord.__name__, service_key(self._robot, QUESTIONS_TOPIC)
            described = partial(self._schema, kind, kind)
            file.add(f"/{key}/{kind}", described, msgspec.json.encode(about), at, number)
        self._added()

    def _added(self) -> None:
        self._count, self._unsafe = self._count + 1, self._unsafe + 1

    def _message(
        self, file: RecordingFile, key: str, kind: str, text: bytes, at: int, number: int
    ) -> None:
        described = partial(self._schema, f"crux.{kind}", kind)
        file.add(topic_of(key, kind), described, text, at, number)

    def _schema(self, name: str, kind: str) -> tuple[str, str, bytes]:
        """Return the schema of a channel of one kind of message: name, encoding, and the schema."""
        return name, "jsonschema", channel_schema(kind, self._definitions)


def _request_kind(key: str) -> str:
    """Return the name of the type of the requests at a key."""
    _, _, name, *more = key.split("/")
    if more:
        return WrenchRequest.__name__
    if name == ServiceName.CANCEL:
        return CancelRequest.__name__
    return SERVICES_BY_NAME[name].request.__name__


def _as_json(payload: bytes, encoding: str) -> bytes | None:
    """Return a message as JSON that says the same; None if there is none."""
    try:
        form = Format.named(encoding)
        value = form.decode(payload, Any)
        if form is Format.JSON:
            return payload
        text = msgspec.json.encode(value)
        return text if msgspec.json.decode(text) == value else None
    except (CruxError, msgspec.MsgspecError, RecursionError, ValueError):
        return None
