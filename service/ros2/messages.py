"""Translate between the messages of crux and those of ROS 2."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from hand_models.hand import FINGERS
from service.replies import ErrorReply, PublishedReply
from service.ros2.definitions import RosTypes
from service.ros2.health import DiagnosticState
from service.wire import ServiceName

__all__ = ["RosMessages", "wrench_entries"]


class _Finger(msgspec.Struct):
    name: str
    tendon_tension: float
    winch_angle: float


class _Hand(msgspec.Struct):
    """Fields of a hand in replies: those of a plan have fingers, set-points four tensions."""

    limb: str
    fingers: list[_Finger] = []
    tensions: list[float] = []
    winch_angle: list[float] = []
    wrench: list[float] | None = None

    def drives(self) -> list[tuple[str, float, float]]:
        """Return name, tension [N] and winch angle [rad] of each tendon."""
        fingers = self.fingers or [
            _Finger(*each) for each in zip(FINGERS, self.tensions, self.winch_angle, strict=False)
        ]
        return [(f"{self.limb}/{f.name}", f.tendon_tension, f.winch_angle) for f in fingers]


class _Read(msgspec.Struct):
    """Fields of replies that responses of ROS 2 services have; each kind has some of them."""

    stream: str = ""
    status: str = ""
    verified: bool = False
    utilisation: float | None = None
    load_factor: float | None = None
    gap: float | None = None
    hands: list[_Hand] | None = None
    vertices: list[list[float]] | None = None


class RosMessages:
    """Translator between crux's messages and those of ROS 2.

    Attributes
    ----------
    types : RosTypes
        Types of all messages.
    """

    def __init__(self) -> None:
        self.types = RosTypes()

    def request(self, name: ServiceName, request: Any) -> bytes:
        """Return the request of a ROS 2 service as crux's request in JSON.

        Parameters
        ----------
        name : ServiceName
            Kind of question.
        request : object
            Decoded request of the ROS 2 service of that kind.
        """
        if name is not ServiceName.SET_POINTS:
            asked: str = request.request
            return asked.encode()
        named = ("limb", "finger", "phalanx")
        question = {
            "v": 1,
            "stream": request.stream,
            "body_wrench": wrench_entries(request.body_wrench),
            "detail": "set_points",
            "lost": [{part: getattr(tile, part) for part in named} for tile in request.lost],
            "deadline": request.deadline or None,
        }
        return msgspec.json.encode(question)

    def response(self, kind: str, reply: bytes) -> Any:
        """Return crux's reply, in JSON, as the response of a ROS 2 service.

        Parameters
        ----------
        kind : str
            Type of the response, such as ``crux_msgs/srv/Plan_Response``.
        reply : bytes
        """
        read = msgspec.json.decode(reply, type=_Read)
        hands = (read.hands if read.verified else None) or []
        return self._response(kind, self._error(), read, hands, reply.decode())

    def refusal(self, kind: str, error: ErrorReply) -> Any:
        """Return crux's error as the response of a ROS 2 service; parameters as `response`."""
        return self._response(kind, self._error(error), _Read(), [], "")

    def _response(
        self, kind: str, error: Any, read: _Read, hands: Sequence[_Hand], reply: str
    ) -> Any:
        now = time.time_ns()
        values = {
            "error": error,
            "stream": read.stream,
            "status": read.status,
            "verified": read.verified,
            "utilisation": _number(read.utilisation),
            "load_factor": _number(read.load_factor),
            "gap": _number(read.gap),
            "set_points": self._joints(hands, now),
            "wrenches": self._wrenches(hands, now),
            "vertices": [self.wrench(each) for each in read.vertices or []],
            "reply": reply,
        }
        return self.types.make(kind, **{name: values[name] for name in self.types.fields(kind)})

    def set_points(self, published: PublishedReply) -> tuple[Any, list[Any]] | None:
        """Return published set-points as ROS 2's messages; None where there are none.

        A message without a status must not have set-points that exceed a limit: there are some
        only where the status is ``optimal`` and the check passed. Their stamp is the number of
        their wrench.

        Returns
        -------
        joints : object
            ``sensor_msgs/msg/JointState`` of all tendons.
        wrenches : list of object
            ``geometry_msgs/msg/WrenchStamped`` of each hand, if the set-points have its wrench.
        """
        points, number = published.set_points, published.number
        if points is None or not points.verified or points.status != "optimal" or number is None:
            return None
        hands = [
            _Hand(
                hand.limb,
                tensions=hand.tensions,
                winch_angle=hand.winch_angle,
                wrench=None if hand.wrench is msgspec.UNSET else hand.wrench,
            )
            for hand in points.hands or []
        ]
        return self._joints(hands, number), self._wrenches(hands, number)

    def diagnostics(self, states: Sequence[DiagnosticState]) -> Any:
        """Return states as ``diagnostic_msgs/msg/DiagnosticArray``."""
        status, pair = "diagnostic_msgs/msg/DiagnosticStatus", "diagnostic_msgs/msg/KeyValue"
        return self.types.make(
            "diagnostic_msgs/msg/DiagnosticArray",
            header=self._header("", time.time_ns()),
            status=[
                self.types.make(
                    status,
                    level=level,
                    name=name,
                    message=message,
                    hardware_id="",
                    values=[self.types.make(pair, key=k, value=v) for k, v in values.items()],
                )
                for level, name, message, values in states
            ],
        )

    def wrench(self, entries: Sequence[float]) -> Any:
        """Return six entries as ``geometry_msgs/msg/Wrench``."""
        vector = "geometry_msgs/msg/Vector3"
        force, moment = (
            self.types.make(vector, **dict(zip("xyz", part, strict=True)))
            for part in (entries[:3], entries[3:])
        )
        return self.types.make("geometry_msgs/msg/Wrench", force=force, torque=moment)

    def _wrenches(self, hands: Sequence[_Hand], stamp: int) -> list[Any]:
        """Return the wrenches of the rock on the hands, which are minus the hands' own."""
        return [
            self.types.make(
                "geometry_msgs/msg/WrenchStamped",
                header=self._header(f"{hand.limb}/H", stamp),
                wrench=self.wrench([-entry for entry in hand.wrench]),
            )
            for hand in hands
            if hand.wrench is not None
        ]

    def _joints(self, hands: Sequence[_Hand], stamp: int) -> Any:
        drives = [drive for hand in hands for drive in hand.drives()]
        return self.types.make(
            "sensor_msgs/msg/JointState",
            header=self._header("", stamp),
            name=[name for name, _, _ in drives],
            position=np.array([angle for _, _, angle in drives]),
            velocity=np.array([]),
            effort=np.array([tension for _, tension, _ in drives]),
        )

    def _header(self, frame: str, stamp: int) -> Any:
        seconds, rest = divmod(stamp, 10**9)
        at = self.types.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self.types.make("std_msgs/msg/Header", stamp=at, frame_id=frame)

    def _error(self, reply: ErrorReply | None = None) -> Any:
        name = "crux_msgs/msg/Error"
        if reply is None:
            return self.types.make(name, kind="", field="", message="", retry_after=0.0)
        error = reply.error
        again = 0.0 if error.retry_after is msgspec.UNSET else error.retry_after
        return self.types.make(
            name,
            kind=error.kind,
            field=error.field or "",
            message=error.message,
            retry_after=again,
        )


def wrench_entries(wrench: Any) -> list[float]:
    """Return ``geometry_msgs/msg/Wrench`` as six entries."""
    parts = (wrench.force, wrench.torque)
    return [float(getattr(part, axis)) for part in parts for axis in "xyz"]


def _number(value: float | None) -> float:
    return math.nan if value is None else value
