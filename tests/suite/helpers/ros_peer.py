"""A caller of ROS 2 services and a subscriber of its topics, after rmw_zenoh's documents alone.

Keys, attachments, CDR and hashes are made here from the documents and the definition files: nothing
of the service's is used, nor of rosbags.
"""

from __future__ import annotations

import hashlib
import json
import struct
import time
from pathlib import Path
from typing import Any, NamedTuple

import zenoh

from tests.suite.helpers.patience import PATIENCE

DEFINITIONS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Wrench": "Vector3 force\nVector3 torque",
    "geometry_msgs/msg/WrenchStamped": "std_msgs/Header header\nWrench wrench",
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
        "float64[] effort"
    ),
    "diagnostic_msgs/msg/KeyValue": "string key\nstring value",
    "diagnostic_msgs/msg/DiagnosticStatus": (
        "byte level\nstring name\nstring message\nstring hardware_id\nKeyValue[] values"
    ),
    "diagnostic_msgs/msg/DiagnosticArray": "std_msgs/Header header\nDiagnosticStatus[] status",
    "std_msgs/msg/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "builtin_interfaces/msg/Duration": "int32 sec\nuint32 nanosec",
    "geometry_msgs/msg/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/msg/Pose": "Point position\nQuaternion orientation",
    "sensor_msgs/msg/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "visualization_msgs/msg/UVCoordinate": "float32 u\nfloat32 v",
    "visualization_msgs/msg/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/msg/Marker": (
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
        "builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
        "std_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nUVCoordinate[] uv_coordinates\nstring text\n"
        "string mesh_resource\nMeshFile mesh_file\nbool mesh_use_embedded_materials"
    ),
    "visualization_msgs/msg/MarkerArray": "Marker[] markers",
    "sensor_msgs/msg/PointField": "string name\nuint32 offset\nuint8 datatype\nuint32 count",
    "sensor_msgs/msg/PointCloud2": (
        "std_msgs/Header header\nuint32 height\nuint32 width\nPointField[] fields\n"
        "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense"
    ),
    "unique_identifier_msgs/msg/UUID": "uint8[16] uuid",
    "action_msgs/msg/GoalInfo": (
        "unique_identifier_msgs/UUID goal_id\nbuiltin_interfaces/Time stamp"
    ),
    "action_msgs/msg/GoalStatus": "GoalInfo goal_info\nint8 status",
    "action_msgs/msg/GoalStatusArray": "GoalStatus[] status_list",
    "service_msgs/msg/ServiceEventInfo": (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\n"
        "int64 sequence_number"
    ),
}
"""Types of ROS 2, as common_interfaces and rcl_interfaces define them, without constants."""

PLAIN = {
    "bool": (15, "?"),
    "byte": (16, "B"),
    "int8": (2, "b"),
    "uint8": (3, "B"),
    "int32": (6, "i"),
    "uint32": (7, "I"),
    "int64": (8, "q"),
    "float32": (10, "f"),
    "float64": (11, "d"),
    "string": (17, ""),
}
"""Number in a type description, and format in `struct`, of each type that is not a message."""


ME = bytes(range(100, 116))
"""Global identifier of a client."""


class Field(NamedTuple):
    """Field of a message; ``size`` is that of an array, 0 of a sequence, None of a single value."""

    name: str
    type: str
    size: int | None = None
    bounded: bool = False


class RosPeer:
    """Definitions of ROS 2, with a package of own ones, and messages of them."""

    def __init__(self, package: Path) -> None:
        self.fields: dict[str, list[Field]] = {}
        for name, text in DEFINITIONS.items():
            self.fields[name] = self._parsed(text, name.split("/")[0])
        for file in package.glob("msg/*.msg"):
            name = f"{package.name}/msg/{file.stem}"
            self.fields[name] = self._parsed(file.read_text("utf-8"), package.name)
        for file in package.glob("srv/*.srv"):
            self.add_service(f"{package.name}/srv/{file.stem}", file.read_text("utf-8"))
        info = "action_msgs/GoalInfo"
        cancel = f"{info} goal_info\n---\nint8 return_code\n{info}[] goals_canceling"
        self.add_service("action_msgs/srv/CancelGoal", cancel)
        for file in package.glob("action/*.action"):
            self.add_action(f"{package.name}/action/{file.stem}", file.read_text("utf-8"))

    def add_action(self, name: str, text: str) -> None:
        """Add the two services and the feedback of an action, after the design of actions."""
        package = name.split("/")[0]
        for part, lines in zip(("Goal", "Result", "Feedback"), text.split("---"), strict=True):
            self.fields[f"{name}_{part}"] = self._parsed(lines, package)
        me = Field("goal_id", "unique_identifier_msgs/msg/UUID")
        parts = {
            "SendGoal_Request": [me, Field("goal", f"{name}_Goal")],
            "SendGoal_Response": [
                Field("accepted", "bool"),
                Field("stamp", "builtin_interfaces/msg/Time"),
            ],
            "GetResult_Request": [me],
            "GetResult_Response": [Field("status", "int8"), Field("result", f"{name}_Result")],
            "FeedbackMessage": [me, Field("feedback", f"{name}_Feedback")],
        }
        self.fields |= {f"{name}_{part}": fields for part, fields in parts.items()}
        self._add_event(f"{name}_SendGoal")
        self._add_event(f"{name}_GetResult")

    def add_service(self, name: str, text: str) -> None:
        package = name.split("/")[0]
        asked, answered = f"{name}_Request", f"{name}_Response"
        for part, lines in zip((asked, answered), text.split("---"), strict=True):
            self.fields[part] = self._parsed(lines, package)
        self._add_event(name)

    def _add_event(self, name: str) -> None:
        asked, answered = f"{name}_Request", f"{name}_Response"
        self.fields[f"{name}_Event"] = [
            Field("info", "service_msgs/msg/ServiceEventInfo"),
            Field("request", asked, 1, bounded=True),
            Field("response", answered, 1, bounded=True),
        ]
        self.fields[name] = [
            Field("request_message", asked),
            Field("response_message", answered),
            Field("event_message", f"{name}_Event"),
        ]

    def _parsed(self, text: str, package: str) -> list[Field]:
        found = []
        for line in text.splitlines():
            if not (words := line.partition("#")[0].split()):
                continue
            kind, name = words
            kind, bracket, size = kind.partition("[")
            if kind not in PLAIN:
                named, _, last = kind.rpartition("/")
                kind = f"{named or package}/msg/{last}"
            found.append(Field(name, kind, int(size.strip("]") or 0) if bracket else None))
        # the interface language has no empty struct
        return found or [Field("structure_needs_at_least_one_member", "uint8")]

    # hashes, as rosidl's specification of RIHS01 -------------------------------------------------

    def type_hash(self, name: str) -> str:
        others = sorted(self._within(name) - {name})
        described = {
            "type_description": self._description(name),
            "referenced_type_descriptions": [self._description(each) for each in others],
        }
        return f"RIHS01_{hashlib.sha256(json.dumps(described).encode()).hexdigest()}"

    def _within(self, name: str) -> set[str]:
        nested = {field.type for field in self.fields[name]} - PLAIN.keys()
        return {name}.union(*(self._within(each) for each in nested))

    def _description(self, name: str) -> dict[str, Any]:
        fields = []
        for field in self.fields[name]:
            number = PLAIN[field.type][0] if field.type in PLAIN else 1
            if field.size is not None:
                number += 96 if field.bounded else 48 if field.size else 144
            kind = {
                "type_id": number,
                "capacity": field.size or 0,
                "string_capacity": 0,
                "nested_type_name": "" if field.type in PLAIN else field.type,
            }
            fields.append({"name": field.name, "type": kind})
        return {"type_name": name, "fields": fields}

    # CDR, little endian --------------------------------------------------------------------------

    def encode(self, name: str, message: dict[str, Any]) -> bytes:
        out = bytearray()
        self._write(out, name, message)
        return b"\x00\x01\x00\x00" + bytes(out)

    def _write(self, out: bytearray, name: str, value: Any) -> None:
        if name == "string":
            text = value.encode() + b"\x00"
            self._write(out, "uint32", len(text))
            out += text
        elif name in PLAIN:
            form = "<" + PLAIN[name][1]
            out += bytes(-len(out) % struct.calcsize(form)) + struct.pack(form, value)
        else:
            for field in self.fields[name]:
                given = value[field.name]
                if field.size is None:
                    self._write(out, field.type, given)
                    continue
                if not field.size:
                    self._write(out, "uint32", len(given))
                if field.type == "uint8":
                    out += bytes(given)
                    continue
                for each in given:
                    self._write(out, field.type, each)

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        assert data[:4] == b"\x00\x01\x00\x00"
        value, end = self._read(data[4:], 0, name)
        # at most filled up to a multiple of four
        assert 0 <= len(data) - 4 - end < 4
        return value

    def _read(self, data: bytes, at: int, name: str) -> tuple[Any, int]:
        if name == "string":
            size, at = self._read(data, at, "uint32")
            assert data[at + size - 1] == 0
            return data[at : at + size - 1].decode(), at + size
        if name in PLAIN:
            form = "<" + PLAIN[name][1]
            at += -at % struct.calcsize(form)
            return struct.unpack_from(form, data, at)[0], at + struct.calcsize(form)
        found = {}
        for field in self.fields[name]:
            if field.size is None:
                found[field.name], at = self._read(data, at, field.type)
                continue
            count = field.size
            if not count or field.bounded:
                count, at = self._read(data, at, "uint32")
            if field.type == "uint8":
                found[field.name], at = data[at : at + count], at + count
                continue
            found[field.name] = []
            for _ in range(count):
                value, at = self._read(data, at, field.type)
                found[field.name].append(value)
        return found, at

    # calls and topics ----------------------------------------------------------------------------

    def key(self, domain: int, name: str, kind: str) -> str:
        package, sort, last = kind.split("/")
        return f"{domain}{name}/{package}::{sort}::dds_::{last}_/{self.type_hash(kind)}"

    def call(
        self,
        session: zenoh.Session,
        domain: int,
        name: str,
        kind: str,
        request: dict[str, Any],
        me: bytes = ME,
    ) -> dict[str, Any]:
        data = self.encode(f"{kind}_Request", request)
        return self.call_with(session, domain, name, kind, data, me)

    def call_with(
        self,
        session: zenoh.Session,
        domain: int,
        name: str,
        kind: str,
        data: bytes,
        me: bytes = ME,
    ) -> dict[str, Any]:
        """Call as rmw_zenoh does, with a payload that may be wrong, as the client ``me``."""
        before, number = time.time_ns(), 7
        attached = struct.pack("<qqB", number, before, 16) + me
        replies = list(
            session.get(
                key := self.key(domain, name, kind),
                payload=data,
                attachment=attached,
                target=zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=PATIENCE,
            )
        )
        (reply,) = replies
        assert reply.ok is not None, reply.err.payload.to_string()
        assert str(reply.ok.key_expr) == key
        echoed = reply.ok.attachment.to_bytes()
        again, sent, size = struct.unpack_from("<qqB", echoed)
        assert (again, size, echoed[17:]) == (number, 16, me)
        assert before <= sent <= time.time_ns()
        return self.decode(f"{kind}_Response", reply.ok.payload.to_bytes())
