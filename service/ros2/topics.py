"""Take body wrenches from a topic of ROS 2, and publish their set-points on another."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh
from msgspec import UNSET

from hand_models.base import CruxError
from service.replies import PublishedReply
from service.requests import WrenchRequest
from service.ros2.health import DiagnosticState
from service.ros2.messages import RosMessages, wrench_entries
from service.wire import Format, ServiceName, read_reply, stream_key

__all__ = ["RosStream"]


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
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        messages: RosMessages,
        publish_joints: Callable[[Any], None],
        publish_wrench: Callable[[Any], None],
    ) -> None:
        self._session, self._robot = session, robot
        self._messages = messages
        self._publish_joints, self._publish_wrench = publish_joints, publish_wrench
        self._lock = threading.Lock()
        self._stream = ""
        self._points: zenoh.Subscriber[None] | None = None
        self._newest: PublishedReply | None = None
        self._refused = ""
        self._sent = 0

    def follow(self, stream: str) -> None:
        """Take wrenches for a stream from now on, and publish its set-points.

        Parameters
        ----------
        stream : str
            Identifier of the stream.
        """
        key = stream_key(self._robot, stream, ServiceName.SET_POINTS)
        # what the service itself publishes, and nobody else
        points = self._session.declare_subscriber(
            key, self._answered, allowed_origin=zenoh.Locality.SESSION_LOCAL
        )
        with self._lock:
            before, self._points, self._stream = self._points, points, stream
            self._newest, self._refused, self._sent = None, "", 0
        if before is not None:
            before.undeclare()

    def close(self) -> None:
        """Publish no more set-points."""
        with self._lock:
            points, self._points, self._stream = self._points, None, ""
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
            body_wrench=tuple(wrench_entries(given.wrench)),  # type: ignore[arg-type]
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
