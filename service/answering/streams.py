"""Keep the wrench streams of a service: declare, ask and release them."""

from __future__ import annotations

import threading
import time
import uuid
from collections import Counter, OrderedDict
from typing import Final, NamedTuple

from msgspec.structs import replace

from hand_models.base import InvalidInputError, UnsupportedError
from planner import SetPoints, WrenchStream, deadline
from service.answering.answers import cut_reason, finite, placed_poses
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.questions import question
from service.replies import HandColumns, HandSetPoints, SetPointsReply, StreamReply
from service.requests import Detail, PlanRequest, SetPointsRequest, StreamRequest
from service.wire import Format

__all__ = ["LOCAL_STREAMS", "Streams", "brief_set_points", "opened", "set_points_reply"]


class _Kept(NamedTuple):
    """Stream, and the client that has declared it."""

    stream: WrenchStream
    owner: str


def opened(request: StreamRequest, robots: Robots = BUNDLED_ROBOTS) -> WrenchStream:
    """Return the stream that a request declares, for the caller to close.

    Parameters
    ----------
    request : StreamRequest
    robots : Robots, optional
        Those that may be asked about.

    Raises
    ------
    InvalidInputError
        If the request is impossible; the field is relative to it.
    """
    if request.limits.tension_change is not None:
        raise UnsupportedError(
            "not available for streams, whose tensions change with the wrench: remove it",
            field="limits.tension_change",
        )
    first = PlanRequest(
        v=1,
        stance=request.stance,
        body_wrench=request.body_wrench,
        load=request.load,
        limits=request.limits,
    )
    asked = question(first, robots)
    return WrenchStream(asked, radius=request.radius)


class Streams:
    """Streams by their identifiers. Safe to use from several threads.

    Parameters
    ----------
    owner : str, optional
        Client that declares the streams.
    among : Streams, optional
        Streams to share: the client can use all of them, and owns those that it declares.

    Attributes
    ----------
    most : int
        Most streams; beyond it, the client with most loses the one that was used longest ago.
    """

    def __init__(self, owner: str = "", among: Streams | None = None) -> None:
        self.most = 16
        self._owner = owner
        self._lock: threading.Lock = threading.Lock() if among is None else among._lock
        self._kept: OrderedDict[str, _Kept] = OrderedDict() if among is None else among._kept

    def of(self, owner: str) -> Streams:
        """Return the same streams for a client."""
        return Streams(owner, self)

    def declare(self, request: StreamRequest, robots: Robots = BUNDLED_ROBOTS) -> StreamReply:
        """Answer a declaration; parameters and errors as of `opened`."""
        start = time.perf_counter()
        stream, identifier = opened(request, robots), uuid.uuid4().hex
        try:
            # with fewer plans, later set-points would not be the same
            step = "the plans about the first body wrench were there"
            deadline.check(step)
            first = stream.set_points(stream.first)
            deadline.check(step)
            named = zip(stream.limbs, map(list, stream.columns), strict=True)
            reply = StreamReply(
                id=request.id,
                poses=placed_poses(stream.question.stance),
                stream=identifier,
                radius=finite(stream.interpolates),
                status=first.status,
                reason=first.reason,
                body_wrench=stream.first.tolist(),
                utilisation=finite(first.utilisation),
                gap=finite(first.gap),
                hands=[HandColumns(limb=limb, columns=columns) for limb, columns in named],
                took=time.perf_counter() - start,
            )
            # a stream whose reply cannot be encoded would be kept without a client
            Format.MSGPACK.encode(reply)
        except BaseException:
            stream.close()
            raise
        with self._lock:
            self._kept[identifier] = _Kept(stream, self._owner)
            gone = self._taken_out() if len(self._kept) > self.most else None
        if gone is not None:
            gone.close()
        return reply

    def _taken_out(self) -> WrenchStream:
        """Remove and return the oldest stream of the client that has most."""
        counts = Counter(each.owner for each in self._kept.values())
        most = max(counts.values())
        oldest = next(name for name, each in self._kept.items() if counts[each.owner] == most)
        return self._kept.pop(oldest).stream

    def __len__(self) -> int:
        return len(self._kept)

    def set_points(self, request: SetPointsRequest) -> SetPointsReply:
        """Answer a question for set-points.

        Raises
        ------
        InvalidInputError
            If there is no such stream.
        """
        start = time.perf_counter()
        with self._lock:
            kept = self._kept.get(request.stream)
            if kept is not None:
                self._kept.move_to_end(request.stream)
        if kept is None:
            raise InvalidInputError(
                f"no stream {request.stream!r}: declare one; the last {self.most} that were used "
                "are kept",
                field="stream",
            )
        stream = kept.stream
        points = stream.set_points(request.body_wrench)
        reply = set_points_reply(request.stream, stream, points, start, request.detail or "full")
        reply.id = request.id
        return reply

    def release(self, identifier: str) -> None:
        """Release a stream."""
        with self._lock:
            kept = self._kept.pop(identifier, None)
        if kept is not None:
            kept.stream.close()

    def close(self) -> None:
        """Release all streams."""
        with self._lock:
            gone = list(self._kept.values())
            self._kept.clear()
        for kept in gone:
            kept.stream.close()


def set_points_reply(
    identifier: str,
    stream: WrenchStream,
    points: SetPoints,
    start: float,
    detail: Detail = "full",
) -> SetPointsReply:
    """Return set-points as a reply.

    Parameters
    ----------
    identifier : str
    stream : WrenchStream
    points : SetPoints
    start : float
        Time of arrival of the question, on the clock of `time.perf_counter`.
    detail : {'set_points', 'hands', 'full'}, optional
        With ``set_points``, hands have their tensions alone; the other two are the same.
    """
    reply = SetPointsReply(
        stream=identifier,
        status=points.status,
        reason=points.reason,
        body_wrench=points.body_wrench.tolist(),
        utilisation=finite(points.utilisation),
        gap=finite(points.gap),
        hands=_hands(stream, points),
        verified=bool(points.verified),
        source=points.source,
        took=time.perf_counter() - start,
    )
    return brief_set_points(reply) if detail == "set_points" else reply


def _hands(stream: WrenchStream, points: SetPoints) -> list[HandSetPoints] | None:
    """Return the set-points of each hand; None if there is no plan."""
    tensions, wrenches = points.tensions, points.wrenches
    angle, torque, current = points.winch_angle, points.motor_torque, points.motor_current
    if tensions is None or wrenches is None or angle is None or torque is None or current is None:
        return None
    return [
        HandSetPoints(
            limb=limb,
            tensions=tensions[h].tolist(),
            winch_angle=angle[h].tolist(),
            motor_torque=torque[h].tolist(),
            motor_current=current[h].tolist(),
            wrench=wrenches[h].tolist(),
        )
        for h, limb in enumerate(stream.limbs)
    ]


def brief_set_points(whole: SetPointsReply) -> SetPointsReply:
    """Return set-points with the hands' tensions and winches alone, and a short reason."""
    return replace(
        whole,
        reason=cut_reason(whole.reason) if whole.reason else whole.reason,
        hands=None
        if whole.hands is None
        else [HandSetPoints(h.limb, h.tensions, h.winch_angle) for h in whole.hands],
    )


LOCAL_STREAMS: Final = Streams()
"""Streams of this process that belong to no service."""
