"""Make rock of a point cloud by ROS 2, to which requests by ROS 2 may refer by name."""

from __future__ import annotations

import logging
import multiprocessing
import threading
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final

import msgspec
import numpy as np
import zenoh

from hand_models import scans
from hand_models.base import Array, CruxError, InvalidInputError, LimitError, Pose, oriented_pose
from hand_models.parameters import scan_table
from service.requests import PoseMessage
from service.ros2.health import DiagnosticState
from service.ros2.messages import RosMessages
from service.ros2.settings import ROS_SETTINGS

__all__ = ["ROCK_NAME", "RosRock", "cloud_points", "make_rock"]

log = logging.getLogger(__name__)

ROCK_NAME: Final = "scan"
"""Name of the rock in requests."""

CLOUD_FRAMES: Final = ("W", "B")

POINT_FORMATS: Final = {7: "f4", 8: "f8"}
"""NumPy's names of the datatypes FLOAT32 and FLOAT64 of ``sensor_msgs/msg/PointField``."""


@dataclass(frozen=True)
class _Rock:
    """Rock made of a cloud.

    Attributes
    ----------
    vertices, faces : bytes
        Of a mesh in a request, in JSON.
    pose : Pose
        The rock's frame in that of the cloud.
    words : str
        What it has, for a person.
    """

    vertices: bytes
    faces: bytes
    pose: Pose
    words: str


class RosRock:
    """Rock of the newest point cloud that was taken from a topic of ROS 2.

    A process of its own makes a mesh of the points, as `crux rock` does. In requests by ROS 2 the
    rock is then `ROCK_NAME`: ``{"shape": "rock", "rock": "scan"}`` in a stance, ``"rock": "scan"``
    of a climb.

    Parameters
    ----------
    robot : str
        Name of the robot.
    messages : RosMessages
    """

    def __init__(self, robot: str, messages: RosMessages) -> None:
        self._robot, self._messages = robot, messages
        self._changed = threading.Condition()
        self._newest: tuple[Array, str] | None = None
        self._process: BaseProcess | None = None
        self._closed = False
        self._rock: _Rock | None = None
        self._frame, self._refused, self._meshing = "", "", False
        self._thread = threading.Thread(target=self._run, name="crux-ros-rock", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Take no more clouds."""
        with self._changed:
            self._closed = True
            if self._process is not None:
                self._process.kill()
            self._changed.notify_all()
        self._thread.join()

    def take(self, sample: zenoh.Sample) -> None:
        """Take a ``sensor_msgs/msg/PointCloud2``; one that comes while rock is made waits."""
        try:
            if len(sample.payload) > ROS_SETTINGS.cloud_bytes:
                raise LimitError(
                    f"{len(sample.payload)} bytes; the maximum is {ROS_SETTINGS.cloud_bytes}: thin "
                    "the cloud, or cut it to what is near the hands"
                )
            cloud = self._messages.types.decode(
                sample.payload.to_bytes(), "sensor_msgs/msg/PointCloud2"
            )
            frame, points = cloud.header.frame_id or "W", cloud_points(cloud)
            if frame not in CLOUD_FRAMES:
                raise InvalidInputError(
                    f"{frame[:20]!r}; valid: W, or none, and B: transform the points",
                    field="frame_id",
                )
        except CruxError as error:
            self._refuse(str(error))
            return
        with self._changed:
            self._newest = points, frame
            self._changed.notify_all()

    def placed_in(self, request: bytes) -> bytes:
        """Return a request with the rock's mesh, if the request refers to it and has none.

        Rock whose points came in B stands where the request's ``stance.body`` is; a request without
        a body pose cannot refer to it.

        Parameters
        ----------
        request : bytes
            Request of crux, in JSON.
        """
        with self._changed:
            rock, frame = self._rock, self._frame
        name = msgspec.json.encode(ROCK_NAME)
        if rock is None or name not in request:
            return request
        raw = dict[str, msgspec.Raw]
        # the service says what is wrong with a request
        with suppress(msgspec.DecodeError, msgspec.ValidationError, CruxError):
            asked = msgspec.json.decode(request, type=raw)
            if bytes(asked.get("rock", b"")) == name and frame == "W":
                asked["rock"] = _mesh(rock, rock.pose)
            elif "stance" in asked:
                stance = msgspec.json.decode(asked["stance"], type=raw)
                rocks = msgspec.json.decode(stance.get("rocks", b"{}"), type=raw)
                pose = rock.pose
                if frame == "B":
                    body = msgspec.json.decode(stance.get("body", b"null"), type=PoseMessage)
                    pose = (
                        oriented_pose(
                            body.position, body.orientation, body.rpy, body.x_axis, body.z_axis
                        )
                        @ pose
                    )
                rocks.setdefault(ROCK_NAME, _mesh(rock, pose))
                stance["rocks"] = msgspec.Raw(msgspec.json.encode(rocks))
                asked["stance"] = msgspec.Raw(msgspec.json.encode(stance))
            return msgspec.json.encode(asked)
        return request

    def state(self) -> DiagnosticState:
        """Return the state of the rock: an error if the newest cloud was refused."""
        with self._changed:
            rock, frame, refused, meshing = self._rock, self._frame, self._refused, self._meshing
        level, message = 0, "no cloud came yet" if rock is None else f"{ROCK_NAME}: {rock.words}"
        if refused:
            level, message = 2, f"the newest cloud is refused: {refused}"
        elif meshing:
            message = "makes rock of the newest cloud"
        values = {} if rock is None else {"name": ROCK_NAME, "frame": frame, "rock": rock.words}
        return DiagnosticState(level, f"crux/{self._robot}: rock", message, values)

    def _refuse(self, why: str) -> None:
        log.warning("a point cloud is refused: %s", why)
        with self._changed:
            self._refused = why

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._closed)
                if self._closed or self._newest is None:
                    return
                (points, frame), self._newest = self._newest, None
                ours, theirs = multiprocessing.Pipe()
                context = multiprocessing.get_context("spawn")
                made = context.Process(target=make_rock, args=(theirs, points, frame), daemon=True)
                self._process, self._meshing = made, True
            made.start()
            theirs.close()
            made_of_it: _Rock | str = "no rock was made of it within the time that is allowed"
            with suppress(EOFError):
                if ours.poll(ROS_SETTINGS.mesh_time):
                    made_of_it = ours.recv()
            made.kill()
            made.join()
            if isinstance(made_of_it, str):
                self._refuse(made_of_it)
            with self._changed:
                self._meshing = False
                if isinstance(made_of_it, _Rock):
                    self._rock, self._frame, self._refused = made_of_it, frame, ""


def cloud_points(cloud: Any) -> Array:
    """Return the points of a ``sensor_msgs/msg/PointCloud2``, shape (n, 3), as its numbers are.

    Raises
    ------
    InvalidInputError
        If the fields, or the sizes, do not fit the data.
    """
    fields = {field.name: field for field in cloud.fields}
    missing = [axis for axis in "xyz" if axis not in fields]
    if missing:
        names = ", ".join(name[:20] for name in list(fields)[:8]) or "none"
        raise InvalidInputError(f"no {', '.join(missing)} among {names}", field="fields")
    order, step = ">" if cloud.is_bigendian else "<", cloud.point_step
    formats = []
    for axis in "xyz":
        field = fields[axis]
        if field.datatype not in POINT_FORMATS or field.count != 1:
            raise InvalidInputError(
                f"{field.count} of datatype {field.datatype}; valid: one FLOAT32 (7) or FLOAT64 "
                "(8)",
                field=axis,
            )
        formats.append(order + POINT_FORMATS[field.datatype])
        if field.offset + np.dtype(formats[-1]).itemsize > step:
            raise InvalidInputError(
                f"at {field.offset}, which is beyond point_step, {step}", field=axis
            )
    width, height, row = cloud.width, cloud.height, cloud.row_step
    if width * step > row or row * height != len(cloud.data):
        raise InvalidInputError(
            f"{len(cloud.data)} bytes; {height} rows of {width} points of {step} bytes, and a "
            f"row_step of {row}, make {row * height}",
            field="data",
        )
    offsets = [fields[axis].offset for axis in "xyz"]
    kind = np.dtype(
        {"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": step}
    )
    rows = np.asarray(cloud.data, np.uint8).reshape(height, row)[:, : width * step]
    points = np.ascontiguousarray(rows).reshape(-1).view(kind)
    return np.column_stack([points[axis].astype(float) for axis in "xyz"])


def _mesh(rock: _Rock, pose: Pose) -> msgspec.Raw:
    """Return the rock as a mesh of a request, in JSON."""
    at = {"position": pose.position.tolist(), "orientation": pose.quaternion().tolist()}
    mesh = {
        "shape": "mesh",
        "pose": at,
        "vertices": msgspec.Raw(rock.vertices),
        "faces": msgspec.Raw(rock.faces),
    }
    return msgspec.Raw(msgspec.json.encode(mesh))


def make_rock(into: Connection, points: Array, frame: str) -> None:
    """Make rock of points, in a process of its own; send it, or why there is none.

    Parameters
    ----------
    into : multiprocessing.connection.Connection
        Where the rock is sent, or the reason as a text.
    points : ndarray, shape (n, 3)
        Points in the frame [m].
    frame : str
        ``W``, or ``B``, from whose origin they were seen.
    """
    finite = points[np.isfinite(points).all(axis=1)]
    try:
        if len(finite) < 3:
            raise InvalidInputError(f"{len(finite)} finite; at least 3 are needed", field="points")
        # in B the robot itself has seen them
        scan = scans.Scan(
            points=finite,
            read=len(points),
            view=None,
            viewpoint=np.zeros(3),
            origin=None,
            assumed=frame == "W",
        )
        made = scans.mesh_scan(scan)
        most = ROS_SETTINGS.rock_vertices
        if len(made.vertices) > most:
            # squares of that side, each of which keeps one point, cover the outline
            area = float(np.prod(made.extent[:2])) * made.covered
            spacing = (area / most) ** 0.5
            # holes of that width are bridged; points that are much more apart than half of it leave
            # holes everywhere
            widest = 0.5 * scan_table().scalar("mesh", "hole")
            if spacing > widest:
                raise LimitError(
                    f"rock of {area:.3g} m²; the maximum is {most * widest**2:.3g} m²: cut "
                    "the cloud to what is near the hands"
                )
            made = scans.mesh_scan(scan, spacing=spacing)
    except CruxError as error:
        hint = "; a cloud in W is to have W's origin before the rock, where it was seen from"
        into.send(f"{error}{hint if error.field == 'view' else ''}")
        return
    words = (
        f"{made.read:,} points, {len(made.faces):,} triangles, {made.extent.max():.3g} m, "
        f"{1e3 * made.spacing:.2g} mm apart, {len(made.holes)} holes"
    )
    # micrometres, which no scanner measures
    vertices = msgspec.json.encode(made.vertices.round(6).tolist())
    into.send(_Rock(vertices, msgspec.json.encode(made.faces.tolist()), made.pose, words))
