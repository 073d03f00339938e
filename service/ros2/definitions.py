"""Know the ROS 2 types of services, topics and actions: their CDR encoding and their hashes.

``crux_msgs`` beside this module is the ROS 2 package of the services' types. Types of others are
those of rosbags.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hand_models.base import InvalidInputError, to_install
from service.wire import MalformedError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = ["RosTypes", "action_definitions", "package_folder", "service_definitions"]


def package_folder() -> Path:
    """Return the folder of the ROS 2 package ``crux_msgs``."""
    return Path(__file__).parent / "crux_msgs"


def service_definitions(name: str, request: str, response: str) -> dict[str, Any]:
    """Return the definitions from which ROS 2 makes the type of a service, and its hash.

    A service is a struct of a request, a response and an event. rosbags knows messages only.

    Parameters
    ----------
    name : str
        Type of the service, such as ``crux_msgs/srv/Plan``.
    request, response : str
        Fields, as of the two parts of a ``.srv`` file.

    Returns
    -------
    dict of str to Any
        Definitions for `rosbags.typesys.store.Typestore`, by type.
    """
    from rosbags.interfaces import Nodetype

    # rosbags takes the fixed array of this type for characters, which have another hash
    info = "service_msgs/msg/ServiceEventInfo"
    event = (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\n"
        "int64 sequence_number"
    )
    parts = {f"{name}_Request": request, f"{name}_Response": response}
    found = _messages({info: event, **parts})
    asked, answered = ((Nodetype.NAME, part) for part in parts)
    found[f"{name}_Event"] = (
        [],
        [
            ("info", (Nodetype.NAME, info)),
            ("request", (Nodetype.SEQUENCE, (asked, 1))),
            ("response", (Nodetype.SEQUENCE, (answered, 1))),
        ],
    )
    found[name] = (
        [],
        [
            ("request_message", asked),
            ("response_message", answered),
            ("event_message", (Nodetype.NAME, f"{name}_Event")),
        ],
    )
    return found


def action_definitions(name: str, goal: str, result: str, feedback: str) -> dict[str, Any]:
    """Return the definitions of what a ROS 2 action has: two services, and its feedback.

    What cancels goals, and their status, is the same for all actions.

    Parameters
    ----------
    name : str
        Type of the action, such as ``crux_msgs/action/Climb``.
    goal, result, feedback : str
        Fields, as of the three parts of an ``.action`` file.

    Returns
    -------
    dict of str to Any
        Definitions for `rosbags.typesys.store.Typestore`, by type.
    """
    goal_id = "unique_identifier_msgs/UUID goal_id\n"
    return (
        _messages(
            {
                f"{name}_Goal": goal,
                f"{name}_Result": result,
                f"{name}_Feedback": feedback,
                f"{name}_FeedbackMessage": f"{goal_id}{name}_Feedback feedback",
            }
        )
        | service_definitions(
            f"{name}_SendGoal",
            f"{goal_id}{name}_Goal goal",
            "bool accepted\nbuiltin_interfaces/Time stamp",
        )
        | service_definitions(f"{name}_GetResult", goal_id, f"int8 status\n{name}_Result result")
    )


def _messages(texts: dict[str, str]) -> dict[str, Any]:
    """Return the definition of each message of the given fields."""
    from rosbags.typesys import get_types_from_msg

    found = {}
    for name, text in texts.items():
        package, _, last = name.split("/")
        # whatever is asked for, rosbags names it a message
        (found[name],) = get_types_from_msg(text, f"{package}/msg/{last}").values()
    return found


def _dtype(name: str) -> str:
    return "uint8" if name in ("octet", "byte", "char") else name


class RosTypes:
    """Types of ROS 2 messages and services, with those of ``crux_msgs``.

    The types of others are those of ROS 2 Jazzy; those that a service uses are the same from Iron
    to Lyrical.

    Parameters
    ----------
    more : dict of str to Any, optional
        Definitions of further types, by type.

    Raises
    ------
    InvalidInputError
        If rosbags is not installed.
    """

    def __init__(self, more: dict[str, Any] | None = None) -> None:
        try:
            from rosbags.typesys import Stores, get_typestore
        except ImportError:
            raise InvalidInputError(
                f"needs rosbags, which is not installed: {to_install('ros2')}", field="--ros2"
            ) from None
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        definitions = service_definitions(
            "action_msgs/srv/CancelGoal",
            "action_msgs/GoalInfo goal_info",
            "int8 return_code\naction_msgs/GoalInfo[] goals_canceling",
        )
        for file in sorted(package_folder().glob("*/*.*")):
            name = f"crux_msgs/{file.parent.name}/{file.stem}"
            parts = file.read_text("utf-8").split("\n---\n")
            if file.suffix == ".msg":
                definitions |= _messages({name: parts[0]})
            elif file.suffix == ".srv":
                definitions |= service_definitions(name, *parts)
            else:
                definitions |= action_definitions(name, *parts)
        # the event's is not rosbags' own, and is hashed only
        del self._store.fielddefs["service_msgs/msg/ServiceEventInfo"]
        self._store.register(definitions | (more or {}))
        self.type_hash = cache(self._store.hash_rihs01)

    def fields(self, name: str) -> list[str]:
        """Return the names of a type's fields, in order."""
        return [field for field, _ in self._store.fielddefs[name][1]]

    def definition(self, name: str) -> str:
        """Return the text of a message's type and of all types in it, as recordings have it."""
        text, _ = self._store.generate_msgdef(name, ros_version=2)
        return str(text)

    def make(self, name: str, /, **fields: Any) -> Any:
        """Return a message of a type from its fields, by name; those left out are zero or empty.

        Sequences of numbers are NumPy arrays; others are lists.
        """
        left = {
            field: self._blank(kind, of)
            for field, (kind, of) in self._store.fielddefs[name][1]
            if field not in fields
        }
        return self._store.types[name](**fields, **left)

    def _blank(self, kind: Any, of: Any) -> Any:
        """Return the zero or empty value of a field; kind and further words as rosbags has them."""
        from rosbags.interfaces import Nodetype

        if kind is Nodetype.NAME:
            return self.make(of)
        if kind is Nodetype.BASE:
            return "" if of[0] == "string" else np.zeros((), _dtype(of[0])).item()
        (inner, element), size = of
        if inner is Nodetype.BASE and element[0] != "string":
            count = size if kind is Nodetype.ARRAY else 0
            return np.zeros(count, _dtype(element[0]))
        return []

    def encode(self, message: Any) -> bytes:
        """Encode a message as CDR, little endian."""
        name: str = message.__msgtype__
        return bytes(self._store.serialize_cdr(message, name, little_endian=True))

    def decode(self, data: bytes, name: str) -> Any:
        """Decode a message from CDR.

        Raises
        ------
        MalformedError
            If the bytes are no message of the type.
        """
        from rosbags.serde import SerdeError

        try:
            return self._store.deserialize_cdr(data, name)
        except SerdeError as error:
            raise MalformedError(f"not the CDR of a {name}: {error}") from None
