"""Ask the questions of a recording again, in this process, and find what has moved since."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

import msgspec

from hand_models.base import InvalidInputError
from hand_models.parameters import ParameterTable
from service.answering import SERVICES_BY_NAME, Robots, Streams, handle, robots_of
from service.recording.differences import Difference, differences, same_within_gaps
from service.recording.reading import Recorded, Recording
from service.replies import ErrorReply, PublishedReply, StreamReply
from service.requests import ClimbRequest, Query, SetPointsRequest
from service.wire import Format, ServiceName

__all__ = ["Moved", "Replay"]

CHANCE_ERRORS: Final = {"busy", "deadline", "cancelled", "lost"}
"""Kinds of errors that depend on what else a service had to do."""

UNSURE_STATES: Final = {"not_proven", "unknown"}
"""States of a climb whose search was ended by the time."""


@dataclass
class Moved:
    """A field of answers that has moved.

    Attributes
    ----------
    kind : str
        Name of the type of the answers.
    field : str
        Path of the field, without places in lists.
    answers : int
        Number of answers in which it has moved.
    number : int
        Question whose field has moved most.
    most : Difference
        That difference.
    """

    kind: str
    field: str
    answers: int
    number: int
    most: Difference


@dataclass
class Replay:
    """Replay of a recording: asks its questions again and compares the answers to the digit.

    A question is asked as it was, but without its deadline; only searches for climbs keep theirs.
    Not asked are questions whose answers depend on more than the question: refused or cut short for
    want of time, cancelled, or about a stream that was declared before the recording. Published
    wrenches that the service has skipped have no answers.

    Parameters
    ----------
    recording : Recording
    robots : Robots, optional
        Robots that questions may name; bundled robots by default.
    hand : ParameterTable, optional
        Entries that replace those of the bundled hand; by default those of the recorded service.

    Attributes
    ----------
    equal, moved, near, left_out, skipped : int
        Number of answers that are equal, that have moved, of set-points that differ within their
        proven gaps, of questions that are not asked, and of wrenches that the service has skipped.
    asked : Counter
        Number of questions that were asked, by kind.
    fields : dict
        What has moved, by kind and field.

    Raises
    ------
    InvalidInputError
        If the recording is of a robot that is not among ``robots``.
    """

    recording: Recording
    robots: Robots = field(default_factory=partial(robots_of, None))
    hand: ParameterTable | None = None
    equal: int = 0
    moved: int = 0
    near: int = 0
    left_out: int = 0
    skipped: int = 0
    asked: Counter[str] = field(default_factory=Counter)
    fields: dict[tuple[str, str], Moved] = field(default_factory=dict)

    def __post_init__(self) -> None:
        about = self.recording.about
        if about["robot"] not in self.robots:
            raise InvalidInputError(
                f"the recording is of the robot {about['robot']!r}; give its file with --robot",
                field="FILE",
            )
        if self.hand is None and "hand" in about:
            self.hand = ParameterTable.of(msgspec.json.decode(about["hand"]))
        self._streams = Streams()
        # a service keeps fewer at a time; those that it has given up are not asked any more
        self._streams.most = 64
        self._names: dict[str, str] = {}

    def run(self, questions: Iterable[Recorded]) -> Iterator[tuple[Recorded, list[Difference]]]:
        """Ask questions again; yield each that was asked, and what has moved in its answer.

        Parameters
        ----------
        questions : iterable of Recorded
            Of the recording, in order.
        """
        try:
            for recorded in questions:
                if recorded.about.status == "skipped":
                    self.skipped += 1
                    continue
                if self._depends_on_more(recorded):
                    self.left_out += 1
                    continue
                yield recorded, self._asked_again(recorded)
        finally:
            self._streams.close()

    def _depends_on_more(self, recorded: Recorded) -> bool:
        answer, about = recorded.answer, recorded.about
        name, stream = _name_of(about.key), self._stream_of(recorded)
        if answer is None or name not in SERVICES_BY_NAME:
            return True
        if stream is not None and stream not in self._names:
            return True
        # of a body space, the field of that name is how far its approximation is off
        fails = recorded.kind in {ErrorReply.__name__, PublishedReply.__name__}
        error = answer["error"] if fails else None
        if error is not None:
            # of too many bytes nothing is kept
            gone = about.payload == b"" and error["kind"] == "limit"
            return gone or error["kind"] in CHANCE_ERRORS or error["field"] == "stream"
        return bool(answer.get("unfinished")) or answer.get("status") in UNSURE_STATES

    def _stream_of(self, recorded: Recorded) -> str | None:
        """Return the identifier of the stream that a question is about, if there is one."""
        parts = recorded.about.key.split("/")
        if len(parts) > 3:
            return parts[3]
        if parts[2] != ServiceName.SET_POINTS:
            return None
        try:
            form = Format.named(recorded.about.encoding)
            return form.decode(recorded.request, _Asks).stream
        except (InvalidInputError, msgspec.ValidationError):
            return None

    def _asked_again(self, recorded: Recorded) -> list[Difference]:
        stream, about = self._stream_of(recorded), recorded.about
        own = None if stream is None else self._names[stream]
        published = "/" in about.key.partition(f"/{ServiceName.STREAM}/")[2]

        def revised(request: Any) -> Any:
            if isinstance(request, SetPointsRequest) and own is not None:
                request = msgspec.structs.replace(request, stream=own)
            if isinstance(request, Query) and not isinstance(request, ClimbRequest):
                request = msgspec.structs.replace(request, deadline=None)
            return request

        if own is not None:
            self._streams.settle(own)
        answer = handle(
            _name_of(about.key),
            recorded.request,
            about.encoding,
            self.hand,
            self.robots,
            streams=self._streams,
            revised=revised,
            stream=own if published else None,
            send=lambda _: None,
        )
        new: Any = Format.named(answer.encoding).decode(answer.payload, Any)
        kind = answer.encoding.partition(";crux.")[2].partition("@")[0]
        if kind == recorded.kind == StreamReply.__name__:
            self._names[recorded.answer["stream"]] = new["stream"]
        old = recorded.answer
        if published:
            old = old["set_points"] or {"error": old["error"]}
            if kind == ErrorReply.__name__:
                new = {"error": new["error"]}
            kind = recorded.kind
        self.asked[_name_of(about.key)] += 1
        return self._compared(about.number, kind, recorded.kind, old, new)

    def _compared(
        self, number: int, kind: str, before: str, old: Any, new: Any
    ) -> list[Difference]:
        found = list(differences(old, new))
        if kind != before:
            found = [Difference("(answer)", _words(before, old), _words(kind, new))]
        if not found:
            self.equal += 1
            return []
        if same_within_gaps(old, new):
            self.near += 1
            return []
        self.moved += 1
        seen: set[str] = set()
        for each in found:
            at = before, each.field
            moved = self.fields.setdefault(at, Moved(*at, 0, number, each))
            moved.answers += each.field not in seen
            seen.add(each.field)
            if each.size > moved.most.size:
                moved.number, moved.most = number, each
        return found


class _Asks(msgspec.Struct):
    stream: str | None = None


def _name_of(key: str) -> str:
    """Return the name of the service that answers at a key."""
    return key.rpartition("/")[2]


def _words(kind: str, answer: Any) -> str:
    """Return what an answer is, in a few words."""
    if kind == ErrorReply.__name__:
        return f"error: {answer['error']['kind']}"
    return f"{kind}: {answer.get('status', 'done')}"
