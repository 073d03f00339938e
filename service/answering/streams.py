"""Keep the wrench streams of a service's clients: declare streams, ask for set-points, release."""

from __future__ import annotations

import threading
import time
import uuid
from collections import Counter, OrderedDict
from collections.abc import Set
from typing import Final, NamedTuple

from msgspec import UNSET
from msgspec.structs import replace

from hand_models.base import InvalidInputError, UnsupportedError
from planner import SetPoints, WrenchStream, deadline
from service.answering.answers import cut_reason, finite, placed_poses
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.questions import question
from service.replies import HandColumns, HandSetPoints, ReleasedFinger, SetPointsReply, StreamReply
from service.requests import Detail, PlanRequest, SetPointsRequest, StreamRequest
from service.wire import Format

__all__ = ["LOCAL_STREAMS", "Streams", "brief_set_points", "opened", "set_points_reply"]


class _Kept(NamedTuple):
    """Stream, and the client that has declared it."""

    stream: WrenchStream
    owner: str


def opened(request: StreamRequest, robots: Robots = BUNDLED_ROBOTS) -> WrenchStream:
    """Build the wrench stream that a request declares; the caller has to close the stream.

    Parameters
    ----------
    request : StreamRequest
        Stance with fixed or compliant wrists, first body wrench or load, limits, and interpolation
        radius.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    WrenchStream
        Source of set-points for body wrenches near the first one.

    Raises
    ------
    InvalidInputError
        If the request is impossible. The error's ``field`` is a path in the request.
    UnsupportedError
        If streams do not support a part of the request, such as ``limits.tension_change``.
    """
    if request.limits.tension_change is not None:
        raise UnsupportedError(
            "not available for streams, whose tensions change with the wrench: leave it out",
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
    return WrenchStream(asked, radius=request.radius, lost=request.lost)


class Streams:
    """Wrench streams of a service, by identifier. Safe to use from several threads.

    Parameters
    ----------
    owner : str, optional
        Client that owns the streams which are declared through this object.
    among : Streams, optional
        Streams to share: the client can ask all of these, and owns only those that it declares.
    connected : set of str, optional
        Clients that are connected now; by default all are.

    Attributes
    ----------
    most : int
        Maximum number of streams. When one more is declared, a client that is no longer connected
        loses one, or if there is none, the client with most streams: of these streams the one that
        was used least recently.
    """

    def __init__(
        self,
        owner: str = "",
        among: Streams | None = None,
        connected: Set[str] | None = None,
    ) -> None:
        self.most = 16
        self._owner, self._connected = owner, connected
        self._lock: threading.Lock = threading.Lock() if among is None else among._lock
        self._kept: OrderedDict[str, _Kept] = OrderedDict() if among is None else among._kept

    def of(self, owner: str, connected: Set[str] | None = None) -> Streams:
        """Return a view of the same streams, through which a client declares streams as its own.

        Parameters
        ----------
        owner : str
            Identifier of the client.
        connected : set of str, optional
            Clients that are connected now; by default all are.
        """
        return Streams(owner, self, connected)

    def declare(self, request: StreamRequest, robots: Robots = BUNDLED_ROBOTS) -> StreamReply:
        """Build a stream, keep it under a new identifier, and plan its first body wrench.

        Parameters
        ----------
        request : StreamRequest
            Stance, first body wrench or load, limits, and interpolation radius.
        robots : Robots, optional
            Robots that a request may name; bundled robots by default.

        Returns
        -------
        StreamReply
            Identifier of the stream, interpolation radius [N], and status and utilisation at the
            first body wrench.

        Raises
        ------
        InvalidInputError
            If the request is impossible. The error's ``field`` is a path in the request.
        DeadlineError
            If the request's deadline has passed.
        """
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
                findings=list(stream.findings),
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
        """Remove and return the oldest stream of clients that have gone, or have most."""
        counts = Counter(each.owner for each in self._kept.values())
        losing = {owner for owner in counts if not self._is_connected(owner)}
        if not losing:
            most = max(counts.values())
            losing = {owner for owner, count in counts.items() if count == most}
        oldest = next(name for name, each in self._kept.items() if each.owner in losing)
        return self._kept.pop(oldest).stream

    def _is_connected(self, owner: str) -> bool:
        """Return whether a client is connected, as far as is known: of nameless ones it is not."""
        return not owner or self._connected is None or owner in self._connected

    def __len__(self) -> int:
        return len(self._kept)

    def names(self) -> tuple[str, ...]:
        """Return the identifiers of all streams of all clients."""
        with self._lock:
            return tuple(self._kept)

    def set_points(self, request: SetPointsRequest) -> SetPointsReply:
        """Return the tendon tensions of all hands for a body wrench, from a declared stream.

        Parameters
        ----------
        request : SetPointsRequest
            Identifier of the stream, and the body wrench in B [N, N·m].

        Returns
        -------
        SetPointsReply
            Set-points by hand, with status, utilisation and reason.

        Raises
        ------
        InvalidInputError
            If no stream has this identifier, or the body wrench is invalid.
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
        points = stream.set_points(request.body_wrench, request.lost)
        reply = set_points_reply(request.stream, stream, points, start, request.detail or "full")
        reply.id = request.id
        return reply

    def settle(self, identifier: str) -> None:
        """Wait until a stream has solved the plans that it interpolates between from now on.

        Set-points then depend only on the wrenches before. An unknown identifier is ignored.
        """
        with self._lock:
            kept = self._kept.get(identifier)
        if kept is not None:
            kept.stream.wait()

    def release(self, identifier: str) -> None:
        """Close the stream of an identifier; an unknown identifier is ignored."""
        with self._lock:
            kept = self._kept.pop(identifier, None)
        if kept is not None:
            kept.stream.close()

    def close(self) -> None:
        """Close all streams of all clients."""
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
    """Convert the set-points of a stream into a reply.

    Parameters
    ----------
    identifier : str
        Identifier of the stream.
    stream : WrenchStream
        Stream that the set-points come from.
    points : SetPoints
        Tensions, winch angles, wrenches and wrists of all hands.
    start : float
        Time when the request arrived, on the clock of `time.perf_counter` [s].
    detail : {'set_points', 'hands', 'full'}, optional
        With ``set_points``, hands have only tensions, winch angles and a pose of each compliant
        wrist; the other two values give the same whole reply.

    Returns
    -------
    SetPointsReply
        Tensions [N], winch angles [rad], motor torques [N·m], motor currents [A], wrenches [N, N·m]
        and twists of compliant wrists [m, rad] by hand; ``took`` is the time since ``start`` [s].
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
    if points.lost:
        reply.lost, reply.save_first = list(points.lost), points.save_first
        reply.released = [ReleasedFinger(limb=limb, finger=each) for limb, each in points.released]
    if points.findings:
        reply.findings = list(points.findings)
    return brief_set_points(reply) if detail == "set_points" else reply


def _hands(stream: WrenchStream, points: SetPoints) -> list[HandSetPoints] | None:
    """Return the set-points of each hand; None if there is no plan."""
    tensions, wrenches = points.tensions, points.wrenches
    angle, torque, current = points.winch_angle, points.motor_torque, points.motor_current
    if tensions is None or wrenches is None or angle is None or torque is None or current is None:
        return None
    wrists = points.wrists or (None,) * len(stream.limbs)
    return [
        HandSetPoints(
            limb=limb,
            tensions=tensions[h].tolist(),
            winch_angle=angle[h].tolist(),
            motor_torque=torque[h].tolist(),
            motor_current=current[h].tolist(),
            wrench=wrenches[h].tolist(),
            twist=UNSET if wrist is None else wrist.twist.tolist(),
            pose_target=UNSET
            if wrist is None or wrist.pose_target is None
            else wrist.pose_target.tolist(),
        )
        for h, (limb, wrist) in enumerate(zip(stream.limbs, wrists, strict=True))
    ]


def brief_set_points(whole: SetPointsReply) -> SetPointsReply:
    """Return set-points with only what a controller sends, and with a reason cut to 120 bytes."""
    return replace(
        whole,
        reason=cut_reason(whole.reason) if whole.reason else whole.reason,
        hands=None if whole.hands is None else [_brief(hand) for hand in whole.hands],
    )


def _brief(hand: HandSetPoints) -> HandSetPoints:
    """Return a hand's tensions, winch angles, and pose target or else twist."""
    return HandSetPoints(
        hand.limb,
        hand.tensions,
        hand.winch_angle,
        twist=hand.twist if hand.pose_target is UNSET else UNSET,
        pose_target=hand.pose_target,
    )


LOCAL_STREAMS: Final = Streams()
"""Wrench streams of this process that belong to no service."""
