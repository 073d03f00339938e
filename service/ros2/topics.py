"""Take body wrenches from a topic of ROS 2, and publish their set-points on another."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh
from msgspec import UNSET

from hand_models.base import CruxError
from service.replies import ErrorReply, PublishedReply, StreamReply
from service.requests import WrenchRequest
from service.ros2.calls import OwnQuestion, RosQuestion
from service.ros2.health import DiagnosticState
from service.ros2.messages import RosMessages, wrench_entries
from service.ros2.settings import ROS_SETTINGS
from service.wire import Format, ServiceName, read_reply, service_key, stream_key

__all__ = ["RosStream"]

log = logging.getLogger(__name__)


class RosStream:
    """Wrenches and set-points by ROS 2, of the stream that was last declared by ROS 2.

    A wrench is passed on to the stream as any client publishes it, and numbered by its time stamp
    in nanoseconds, so that its set-points have the same stamp.

    Parameters
    ----------
    session : zenoh.Session
        Session of the service.
    robot : str
        Name of the robot.
    messages : RosMessages
    publish_joints : callable
        Publishes the ``sensor_msgs/msg/JointState`` of all tendons.
    publish_wrench : callable
        Publishes the ``geometry_msgs/msg/WrenchStamped`` of one hand.
    ask : callable
        Takes a question, and the key of crux's own service that answers it.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        messages: RosMessages,
        publish_joints: Callable[[Any], None],
        publish_wrench: Callable[[Any], None],
        ask: Callable[[RosQuestion, str], None],
    ) -> None:
        self._session, self._robot, self._ask = session, robot, ask
        self._messages = messages
        self._publish_joints, self._publish_wrench = publish_joints, publish_wrench
        self._lock = threading.Lock()
        self._stream = ""
        self._points: zenoh.Subscriber[None] | None = None
        self._newest: PublishedReply | None = None
        self._refused = ""
        self._sent = 0
        self._declared: tuple[bytes, bytes] | None = None
        self._declarations, self._declared_at = 0, -math.inf

    def follow(self, stream: str, request: bytes, caller: bytes) -> None:
        """Take wrenches for a stream from now on, and publish its set-points.

        When the service no longer keeps the stream and a wrench comes, it is declared again.

        Parameters
        ----------
        stream : str
            Identifier of the stream.
        request : bytes
            The request that has declared it, in JSON.
        caller : bytes
            Global identifier of the caller by ROS 2, 16 bytes.
        """
        key = stream_key(self._robot, stream, ServiceName.SET_POINTS)
        # what the service itself publishes, and nobody else
        points = self._session.declare_subscriber(
            key, self._answered, allowed_origin=zenoh.Locality.SESSION_LOCAL
        )
        with self._lock:
            before, self._points, self._stream = self._points, points, stream
            self._newest, self._refused, self._sent = None, "", 0
            self._declared = request, caller
            self._declarations += 1
        if before is not None:
            before.undeclare()

    def close(self) -> None:
        """Publish no more set-points."""
        with self._lock:
            points, self._points, self._stream = self._points, None, ""
            self._declared = None
        if points is not None:
            points.undeclare()

    def take(self, sample: zenoh.Sample) -> None:
        """Take a ``geometry_msgs/msg/WrenchStamped`` with the body wrench in B."""
        try:
            given = self._messages.types.decode(
                sample.payload.to_bytes(), "geometry_msgs/msg/WrenchStamped"
            )
        except CruxError as error:
            self._refused = str(error)
            return
        self._refused = _refusal(given.header)
        stream, stamp = self._stream, given.header.stamp
        if not stream or self._refused:
            return
        number = stamp.sec * 10**9 + stamp.nanosec or time.time_ns()
        request = WrenchRequest(
            v=1,
            number=number,
            time=1e-9 * number,
            body_wrench=wrench_entries(given.wrench),
            detail="hands",
        )
        self._session.put(
            stream_key(self._robot, stream, ServiceName.WRENCH),
            Format.MSGPACK.encode(request),
            encoding=Format.MSGPACK.label(request),
            allowed_destination=zenoh.Locality.SESSION_LOCAL,
        )

    def state(self) -> DiagnosticState:
        """Return the state of the stream: an error if there are no set-points, by the newest."""
        with self._lock:
            stream, newest, sent = self._stream, self._newest, self._sent
        level, message = 0, "waits for wrenches" if stream else "no stream is declared by ROS 2"
        values = {"stream": stream, "set-points published": str(sent)}
        values["declarations"] = str(self._declarations)
        if newest is not None:
            values |= {"age [s]": f"{newest.age:.6f}", "skipped before it": str(newest.skipped)}
            if (error := newest.error) is not None:
                level, message = 2, f"{error.kind}: {error.field or 'wrench'}: {error.message}"
            elif (points := newest.set_points) is not None:
                odd = [] if points.findings is UNSET else points.findings
                level = 0 if points.status == "optimal" and not odd else 1
                message = "; ".join([points.reason or points.status, *(f.message for f in odd)])
                values |= {"utilisation": str(points.utilisation), "gap": str(points.gap)}
        if self._refused:
            level, message = 2, f"the newest wrench is refused: {self._refused}"
        return DiagnosticState(level, f"crux/{self._robot}: set-points", message, values)

    def _answered(self, sample: zenoh.Sample) -> None:
        reply = read_reply(sample, PublishedReply)
        found = self._messages.set_points(reply)
        if found is not None:
            joints, wrenches = found
            self._publish_joints(joints)
            for wrench in wrenches:
                self._publish_wrench(wrench)
        with self._lock:
            if reply.stream == self._stream:
                self._newest, self._sent = reply, self._sent + (found is not None)
            lost = reply.stream == self._stream and reply.error is not None
        if lost and reply.error is not None and reply.error.field == "stream":
            self._declare_again()

    def _declare_again(self) -> None:
        """Declare the stream again, with its first request; not more often than now and then."""
        now = time.monotonic()
        with self._lock:
            early = now < self._declared_at + ROS_SETTINGS.declaration_pause
            if self._declared is None or early:
                return
            (request, caller), self._declared_at = self._declared, now

        def replied(payload: bytes, encoding: str) -> None:
            reply = Format.named(encoding).decode(payload, StreamReply)
            log.warning("the stream that ROS 2 has declared was lost, and is declared again")
            self.follow(reply.stream, request, caller)

        def refused(error: ErrorReply) -> None:
            log.warning("the lost stream could not be declared again: %s", error.error.message)

        question = OwnQuestion(caller, request, replied, refused)
        self._ask(question, service_key(self._robot, ServiceName.STREAM))


def _refusal(header: Any) -> str:
    """Return why a wrench with this header is refused; empty where it is not."""
    frame, stamp = header.frame_id, header.stamp
    if frame not in ("", "B"):
        return f"frame_id {frame[:20]!r}; valid: 'B', or none"
    if stamp.sec < 0 or stamp.nanosec >= 10**9:
        return (
            f"stamp of {stamp.sec} s and {stamp.nanosec} ns; valid: 0 or more, and less than 1e9 ns"
        )
    return ""
