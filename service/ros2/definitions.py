"""Know the ROS 2 types of services and topics: their CDR encoding and their hashes.

``crux_msgs`` beside this module is the ROS 2 package of the services' types. Types of others are
those of rosbags.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hand_models.base import InvalidInputError, to_install
from service.wire import MalformedError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

__all__ = ["RosTypes", "package_folder", "service_definitions"]


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
    from rosbags.typesys import get_types_from_msg

    # rosbags takes the fixed array of this type for characters, which have another hash
    info = "service_msgs/msg/ServiceEventInfo"
    event = (
        "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\n"
        "int64 sequence_number"
    )
    found: dict[str, Any] = dict(get_types_from_msg(event, info))
    parts = {f"{name}_Request": request, f"{name}_Response": response}
    for part, text in parts.items():
        # whatever is asked for, rosbags names it a message
        (found[part],) = get_types_from_msg(text, part.replace("/srv/", "/msg/")).values()
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


class RosTypes:
    """Types of ROS 2 messages and services, with those of ``crux_msgs``.

    The types of others are those of ROS 2 Jazzy; those that a service uses are the same from Iron
    to Lyrical.

    Raises
    ------
    InvalidInputError
        If rosbags is not installed.
    """

    def __init__(self) -> None:
        try:
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError:
            raise InvalidInputError(
                f"needs rosbags, which is not installed: {to_install('ros2')}", field="--ros2"
            ) from None
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        definitions: dict[str, Any] = {}
        for file in sorted(package_folder().glob("*/*.*")):
            text, name = file.read_text("utf-8"), f"crux_msgs/{file.parent.name}/{file.stem}"
            if file.suffix == ".msg":
                definitions |= get_types_from_msg(text, name)
            else:
                request, _, response = text.partition("\n---\n")
                definitions |= service_definitions(name, request, response)
        # the event's is not rosbags' own, and is hashed only
        del self._store.fielddefs["service_msgs/msg/ServiceEventInfo"]
        self._store.register(definitions)
        self.type_hash = cache(self._store.hash_rihs01)

    def fields(self, name: str) -> list[str]:
        """Return the names of a type's fields, in order."""
        return [field for field, _ in self._store.fielddefs[name][1]]

    def make(self, name: str, /, **fields: Any) -> Any:
        """Return a message of a type from all of its fields, by name.

        Sequences of numbers are NumPy arrays; others are lists.
        """
        return self._store.types[name](**fields)

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
