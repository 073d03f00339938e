"""Draw a plan as markers of ROS 2: palms, tiles coloured by utilisation, forces as arrows."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import Any, Final

import msgspec
import numpy as np
from msgspec import UNSET

from hand_models.base import Array, Pose, oriented_pose
from hand_models.hand import FINGERS
from hand_models.parameters import ParameterTable, hand_table
from planner import Finger
from service.replies import BriefPlanReply, HandReply, HandSetPoints, PlanReply
from service.requests import PoseMessage
from service.ros2.messages import RosMessages
from service.ros2.settings import ROS_SETTINGS

__all__ = ["PlanMarkers"]


class MarkerKind(IntEnum):
    """Kind of a marker, as ``visualization_msgs/msg/Marker`` numbers it."""

    ARROW = 0
    CUBE = 1
    TEXT = 9


class MarkerAction(IntEnum):
    """Action on a marker, as ``visualization_msgs/msg/Marker`` numbers it."""

    ADD = 0
    DELETE = 2


TILE_PHALANGES: Final = ("base", "proximal", "middle", "distal", "nail")


class _Hand(msgspec.Struct):
    """Fields of a request's hand by which it is drawn; its hold may be a large mesh."""

    limb: str
    pose: PoseMessage | None = None


class _Stance(msgspec.Struct):
    body: PoseMessage | None = None
    hands: list[_Hand] = []


class _Request(msgspec.Struct):
    stance: _Stance


class PlanMarkers:
    """Markers of plans, in W. What a plan has not, and the one before had, is deleted.

    A marker of the same part has the same ``ns`` and ``id`` in all plans.

    Parameters
    ----------
    messages : RosMessages
    """

    def __init__(self, messages: RosMessages) -> None:
        self._messages, self._make = messages, messages.types.make
        self._shown: set[tuple[str, int]] = set()

    def draw(self, request: bytes, reply: PlanReply | BriefPlanReply) -> Any:
        """Return a plan as ``visualization_msgs/msg/MarkerArray``.

        Hands whose pose in W is neither in the request nor in the reply are left out.

        Parameters
        ----------
        request : bytes
            The plan's request, in JSON.
        reply : PlanReply or BriefPlanReply
        """
        asked = msgspec.json.decode(request, type=_Request).stance
        poses = {hand.limb: _pose(hand.pose) for hand in asked.hands if hand.pose is not None}
        for limb, frame in (reply.poses or {}).items() if reply.poses is not UNSET else ():
            poses[limb] = Pose.from_quaternion(frame.position, frame.orientation)
        stamp = time.time_ns()
        found = {(mark.ns, mark.id): mark for mark in self._marks(asked, reply, poses)}
        gone = sorted(self._shown - found.keys())
        self._shown = set(found)
        markers = [
            self._make("visualization_msgs/msg/Marker", ns=ns, id=i, action=MarkerAction.DELETE)
            for ns, i in gone
        ]
        markers += found.values()
        for marker in markers:
            marker.header = self._messages.header("W", stamp)
        return self._make("visualization_msgs/msg/MarkerArray", markers=markers)

    def _marks(
        self, asked: _Stance, reply: PlanReply | BriefPlanReply, poses: Mapping[str, Pose]
    ) -> Iterator[Any]:
        above = _pose(asked.body).position if asked.body is not None else np.zeros(3)
        used = "" if reply.utilisation is None else f", utilisation {reply.utilisation:.3f}"
        text = f"{reply.status}{used}\n{reply.reason}"
        yield self._marker(
            "plan",
            0,
            MarkerKind.TEXT,
            _color(reply.utilisation),
            Pose(above, np.eye(3)),
            (0.0, 0.0, 0.05),
            text=text,
        )
        for hand in reply.hands or []:
            if (pose := poses.get(hand.limb)) is not None:
                yield from self._hand(hand, pose, hand_table())

    def _hand(
        self, hand: HandReply | HandSetPoints, pose: Pose, table: ParameterTable
    ) -> Iterator[Any]:
        limb, thin = hand.limb, ROS_SETTINGS.marker_thickness
        length, width = (table.scalar("finger", f"tile_{side}") for side in ("length", "width"))
        x, y = (np.ptp(table.vector("palm", f"tile_{axis}")) for axis in "xy")
        used = None if hand.utilisation is UNSET else hand.utilisation
        size = (float(x) + length, float(y) + width, thin)
        yield self._marker(f"{limb}/palm", 0, MarkerKind.CUBE, _color(used), pose, size)
        if hand.wrench is not UNSET:
            # of the rock on the hand: what holds the robot
            force = -np.asarray(hand.wrench[:3])
            yield from self._arrow(f"{limb}/hand_force", 0, force, np.zeros(3), pose, None)
        if isinstance(hand, HandSetPoints):
            return
        palm = hand.palm
        at, force = np.asarray(palm.position), -np.asarray(palm.force)
        yield from self._arrow(f"{limb}/palm_force", 0, force, at, pose, palm.utilisation)
        for finger in hand.fingers:
            yield from self._tiles(limb, finger, pose, (length, width, thin))

    def _tiles(
        self, limb: str, finger: Finger, pose: Pose, size: tuple[float, float, float]
    ) -> Iterator[Any]:
        for tile in finger.tiles:
            number = len(TILE_PHALANGES) * FINGERS.index(finger.name) + TILE_PHALANGES.index(
                tile.phalanx
            )
            at = np.asarray(tile.position)
            z = np.asarray(tile.normal_axis)
            x = -np.asarray(tile.shear_axis)
            on_tile = pose @ Pose(at, np.column_stack([x, np.cross(z, x), z]))
            color = _color(tile.utilisation)
            yield self._marker(f"{limb}/tiles", number, MarkerKind.CUBE, color, on_tile, size)
            force = -np.asarray(tile.force)
            yield from self._arrow(f"{limb}/forces", number, force, at, pose, tile.utilisation)

    def _arrow(
        self, ns: str, number: int, force: Array, at: Array, pose: Pose, used: float | None
    ) -> Iterator[Any]:
        """Yield the arrow of a force of the rock on the hand, in H; none for a force of zero."""
        if not force.any():
            return
        ends = (at, at + ROS_SETTINGS.force_scale * force)
        points = [self._point(pose.apply(end)) for end in ends]
        width = ROS_SETTINGS.arrow_width
        size = (width, 2.0 * width, 0.0)
        still = Pose.identity()
        yield self._marker(ns, number, MarkerKind.ARROW, _color(used), still, size, points=points)

    def _marker(
        self,
        ns: str,
        number: int,
        kind: int,
        color: tuple[float, float, float],
        pose: Pose,
        size: tuple[float, float, float],
        **more: Any,
    ) -> Any:
        make = self._make
        turn = dict(zip("xyzw", pose.quaternion().tolist(), strict=True))
        return make(
            "visualization_msgs/msg/Marker",
            ns=ns,
            id=number,
            type=kind,
            action=MarkerAction.ADD,
            pose=make(
                "geometry_msgs/msg/Pose",
                position=self._point(pose.position),
                orientation=make("geometry_msgs/msg/Quaternion", **turn),
            ),
            scale=make("geometry_msgs/msg/Vector3", **dict(zip("xyz", size, strict=True))),
            color=make("std_msgs/msg/ColorRGBA", **dict(zip("rgb", color, strict=True)), a=1.0),
            **more,
        )

    def _point(self, position: Array) -> Any:
        entries = zip("xyz", position.tolist(), strict=True)
        return self._make("geometry_msgs/msg/Point", **dict(entries))


def _pose(message: PoseMessage) -> Pose:
    return oriented_pose(
        message.position, message.orientation, message.rpy, message.x_axis, message.z_axis
    )


def _color(utilisation: float | None) -> tuple[float, float, float]:
    """Return red, green and blue: green to red up to the limit, magenta beyond, grey if unknown."""
    if utilisation is None:
        return 0.6, 0.6, 0.6
    if utilisation > 1.0:
        return 1.0, 0.0, 1.0
    return min(1.0, 2.0 * utilisation), min(1.0, 2.0 - 2.0 * utilisation), 0.0
