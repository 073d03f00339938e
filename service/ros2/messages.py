"""Translate between the messages of crux and those of ROS 2."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import msgspec
import numpy as np
from msgspec import UNSET

from hand_models.hand import FINGERS
from planner import LostTile
from service.replies import (
    BriefPlanReply,
    ErrorReply,
    HandReply,
    HandSetPoints,
    PlanReply,
    PublishedReply,
    SetPointsReply,
    StreamReply,
    Vector,
    WrenchSpaceReply,
)
from service.requests import SetPointsRequest
from service.ros2.definitions import RosTypes
from service.ros2.health import DiagnosticState
from service.wire import Format, MalformedError, ServiceName

__all__ = ["AnyReply", "RosMessages", "number", "read_answer", "wrench_entries"]

AnyReply = PlanReply | BriefPlanReply | WrenchSpaceReply | StreamReply | SetPointsReply
"""Reply of crux to one of the services of ROS 2."""


def read_answer(payload: bytes, encoding: str) -> AnyReply:
    """Decode a reply of crux, of the type that its zenoh encoding names."""
    kinds: tuple[type[AnyReply], ...] = get_args(AnyReply)
    for kind in kinds:
        if Format.is_labelled(encoding, kind):
            return Format.named(encoding).decode(payload, kind)
    raise MalformedError(f"a reply {encoding!r} answers no service of ROS 2")


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
        question = SetPointsRequest(
            v=1,
            stream=request.stream,
            body_wrench=wrench_entries(request.body_wrench),
            detail="set_points",
            lost=[LostTile(tile.limb, tile.finger, tile.phalanx) for tile in request.lost],
            deadline=request.deadline or None,
        )
        return msgspec.json.encode(question)

    def response(self, kind: str, reply: AnyReply, text: str) -> Any:
        """Return crux's reply as the response of a ROS 2 service.

        Parameters
        ----------
        kind : str
            Type of the response, such as ``crux_msgs/srv/Plan_Response``.
        reply : AnyReply
        text : str
            The reply in JSON.
        """
        now = time.time_ns()
        values: dict[str, Any] = {"reply": text}
        hands: Sequence[HandReply | HandSetPoints] | None = None
        if isinstance(reply, WrenchSpaceReply):
            values["vertices"] = [self.wrench(each) for each in reply.vertices or []]
        else:
            values |= {"status": reply.status, "utilisation": number(reply.utilisation)}
        if isinstance(reply, PlanReply | BriefPlanReply):
            factor = None if reply.load_factor is UNSET else reply.load_factor
            values |= {"verified": reply.verified, "load_factor": number(factor)}
            hands = reply.hands if reply.verified else None
        elif isinstance(reply, SetPointsReply):
            values |= {"verified": reply.verified, "gap": number(reply.gap)}
            hands = reply.hands if reply.verified else None
        elif isinstance(reply, StreamReply):
            values |= {"stream": reply.stream, "gap": number(reply.gap)}
        points, wrenches = self._joints(hands or [], now), self._wrenches(hands or [], now)
        values |= {"set_points": points, "wrenches": wrenches}
        return self._response(kind, values)

    def refusal(self, kind: str, error: ErrorReply) -> Any:
        """Return crux's error as the response of a ROS 2 service; parameters as `response`."""
        return self._response(kind, {"error": self.error(error)})

    def _response(self, kind: str, values: dict[str, Any]) -> Any:
        """Return a response with those of the values that it has; numbers left out are NaN."""
        numbers = dict.fromkeys(("utilisation", "load_factor", "gap"), math.nan)
        fields = self.types.fields(kind)
        known = {name: value for name, value in (numbers | values).items() if name in fields}
        return self.types.make(kind, **known)

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
        hands = points.hands or []
        return self._joints(hands, number), self._wrenches(hands, number)

    def diagnostics(self, states: Sequence[DiagnosticState]) -> Any:
        """Return states as ``diagnostic_msgs/msg/DiagnosticArray``."""
        status, pair = "diagnostic_msgs/msg/DiagnosticStatus", "diagnostic_msgs/msg/KeyValue"
        return self.types.make(
            "diagnostic_msgs/msg/DiagnosticArray",
            header=self.header("", time.time_ns()),
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

    def _wrenches(self, hands: Sequence[HandReply | HandSetPoints], stamp: int) -> list[Any]:
        """Return the wrenches of the rock on the hands, which are minus the hands' own."""
        return [
            self.types.make(
                "geometry_msgs/msg/WrenchStamped",
                header=self.header(f"{hand.limb}/H", stamp),
                wrench=self.wrench([-entry for entry in hand.wrench]),
            )
            for hand in hands
            if hand.wrench is not UNSET
        ]

    def _joints(self, hands: Sequence[HandReply | HandSetPoints], stamp: int) -> Any:
        tensions = {hand.limb: _tensions(hand) for hand in hands}
        return self.tendons(tensions, stamp, [angle for hand in hands for angle in _angles(hand)])

    def tendons(
        self, tensions: Mapping[str, Vector], stamp: int, angles: Sequence[float] = ()
    ) -> Any:
        """Return tensions of the tendons by limb as ``sensor_msgs/msg/JointState``.

        Parameters
        ----------
        tensions : dict of str to sequence of float
            Of the four tendons, by limb [N].
        stamp : int
            Unix time [ns].
        angles : sequence of float, optional
            Angle of each winch [rad].
        """
        return self.types.make(
            "sensor_msgs/msg/JointState",
            header=self.header("", stamp),
            name=[f"{limb}/{finger}" for limb in tensions for finger in FINGERS],
            position=np.array(angles, float),
            effort=np.array([each for four in tensions.values() for each in four]),
        )

    def joints(self, angles: Mapping[str, Vector], stamp: int) -> Any:
        """Return joint angles by limb as ``sensor_msgs/msg/JointState``; parameters as `tendons`.

        Joints are named ``<limb>/joint_<n>``, numbered from 1, from the body outward.
        """
        return self.types.make(
            "sensor_msgs/msg/JointState",
            header=self.header("", stamp),
            name=[
                f"{limb}/joint_{i + 1}" for limb, each in angles.items() for i in range(len(each))
            ],
            position=np.array([angle for each in angles.values() for angle in each]),
        )

    def tile(self, lost: LostTile) -> Any:
        """Return a tile as ``crux_msgs/msg/Tile``."""
        return self.types.make(
            "crux_msgs/msg/Tile", limb=lost.limb, finger=lost.finger, phalanx=lost.phalanx
        )

    def header(self, frame: str, stamp: int) -> Any:
        """Return ``std_msgs/msg/Header`` with a frame and a Unix time [ns]."""
        seconds, rest = divmod(stamp, 10**9)
        at = self.types.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
        return self.types.make("std_msgs/msg/Header", stamp=at, frame_id=frame)

    def error(self, reply: ErrorReply) -> Any:
        """Return crux's error as ``crux_msgs/msg/Error``."""
        error = reply.error
        again = 0.0 if error.retry_after is UNSET else error.retry_after
        return self.types.make(
            "crux_msgs/msg/Error",
            kind=error.kind,
            field=error.field or "",
            message=error.message,
            retry_after=again,
        )


def wrench_entries(wrench: Any) -> tuple[float, float, float, float, float, float]:
    """Return ``geometry_msgs/msg/Wrench`` as six entries."""
    force, moment = wrench.force, wrench.torque
    return force.x, force.y, force.z, moment.x, moment.y, moment.z


def number(value: float | None) -> float:
    """Return a number, NaN where there is none."""
    return math.nan if value is None else value


def _tensions(hand: HandReply | HandSetPoints) -> Vector:
    if isinstance(hand, HandSetPoints):
        return hand.tensions
    return [finger.tendon_tension for finger in hand.fingers]


def _angles(hand: HandReply | HandSetPoints) -> Vector:
    if isinstance(hand, HandSetPoints):
        return hand.winch_angle
    return [finger.winch_angle for finger in hand.fingers]
