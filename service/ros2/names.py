"""Name the services and topics of a ROS 2 node in zenoh's key space, as rmw_zenoh does.

The convention is that of ``docs/design.md`` of rmw_zenoh (ROS 2 Iron and later).
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from dataclasses import dataclass
from enum import StrEnum
from struct import Struct
from typing import NamedTuple, Self

from hand_models.base import InvalidInputError

__all__ = ["Attachment", "Endpoint", "EndpointKind", "NodeNames", "Quality", "ros_domain"]


class EndpointKind(StrEnum):
    """Kind of an endpoint, as its liveliness token names it."""

    PUBLISHER = "MP"
    SUBSCRIPTION = "MS"
    SERVICE = "SS"


class Quality(StrEnum):
    """Quality of service of an endpoint, as its liveliness token names it; all are reliable."""

    VOLATILE = "::,10:,:,:,,"
    """ROS 2's default, with a history of 10 messages."""
    LATCHED = ":1:,1:,:,:,,"
    """Transient local: who subscribes later gets the last message."""


class Endpoint(NamedTuple):
    """Service or topic of a node.

    Attributes
    ----------
    name : str
        Fully qualified name, such as ``/crux/robosimian/plan``.
    type : str
        Type, such as ``crux_msgs/srv/Plan``.
    type_hash : str
        Hash of the type, ``RIHS01_`` and 64 hexadecimal digits.
    quality : Quality
    """

    name: str
    type: str
    type_hash: str
    quality: Quality = Quality.VOLATILE

    @property
    def typed(self) -> str:
        """Last two parts of a key: name of the type in DDS, and its hash."""
        package, kind, name = self.type.split("/")
        return f"{package}::{kind}::dds_::{name}_/{self.type_hash}"


@dataclass(frozen=True, slots=True)
class NodeNames:
    """Names of a ROS 2 node, ``/crux/<robot>``, of its services and of its topics.

    Attributes
    ----------
    domain : int
        Number of the ROS domain.
    session : str
        Identifier of the zenoh session.
    robot : str
        Name of the robot, which is the node's name.

    Raises
    ------
    InvalidInputError
        If ROS 2 does not allow the robot's name.
    """

    domain: int
    session: str
    robot: str

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*_?", self.robot):
            raise InvalidInputError(
                f"the robot's name {self.robot!r} is no name in ROS 2, which takes letters, digits "
                "and single underscores, a letter first: rename the robot in its file",
                field="--ros2",
            )

    def private(self, name: str) -> str:
        """Return the fully qualified name of what ROS 2 calls ``~/name``."""
        return f"/crux/{self.robot}/{name}"

    def key(self, endpoint: Endpoint) -> str:
        """Return the zenoh key of an endpoint's messages."""
        return f"{self.domain}{endpoint.name}/{endpoint.typed}"

    def node_token(self) -> str:
        """Return the key of the node's liveliness token."""
        return f"@ros2_lv/{self.domain}/{self.session}/0/0/NN/{self._node}"

    def token(self, kind: EndpointKind, endpoint: Endpoint, number: int) -> str:
        """Return the key of an endpoint's liveliness token.

        Parameters
        ----------
        kind : EndpointKind
        endpoint : Endpoint
        number : int
            Number of the endpoint in the node, from 1.
        """
        mangled = endpoint.name.replace("/", "%")
        return (
            f"@ros2_lv/{self.domain}/{self.session}/0/{number}/{kind}/{self._node}/{mangled}/"
            f"{endpoint.typed}/{endpoint.quality}"
        )

    @property
    def _node(self) -> str:
        """Enclave (none), namespace and name of the node in its tokens."""
        return f"%/%crux/{self.robot}"


class Attachment(NamedTuple):
    """Attachment of each ROS 2 message, by which a reply is matched to its request.

    Attributes
    ----------
    number : int
        Number of the message, by its sender.
    time : int
        Unix time at which the message was sent [ns].
    sender : bytes
        Global identifier of the sender, 16 bytes.
    """

    number: int
    time: int
    sender: bytes

    @classmethod
    def read(cls, data: bytes) -> Self:
        """Read an attachment of a received message.

        Raises
        ------
        InvalidInputError
            If the bytes are no attachment of rmw_zenoh.
        """
        layout = _layout()
        if len(data) != layout.size or data[16] != 16:
            raise InvalidInputError(
                f"{len(data)} bytes; valid are {layout.size}: number and time (int64, little "
                "endian), the byte 16, and the sender's 16 bytes",
                field="attachment",
            )
        number, sent, _, sender = layout.unpack(data)
        return cls(number, sent, sender)

    @classmethod
    def sent_now(cls, number: int, sender: bytes) -> Self:
        """Return the attachment of a message that is sent now."""
        return cls(number, time.time_ns(), sender)

    @staticmethod
    def sender_of(token: str) -> bytes:
        """Return the global identifier of an endpoint of this node, from its liveliness token."""
        return hashlib.blake2b(token.encode(), digest_size=16).digest()

    def encode(self) -> bytes:
        """Encode the attachment as rmw_zenoh does."""
        return _layout().pack(self.number, self.time, len(self.sender), self.sender)


def _layout() -> Struct:
    return Struct("<qqB16s")


def ros_domain(given: int | None) -> int:
    """Return the number of the ROS domain: the given one, that of ``ROS_DOMAIN_ID``, or 0.

    Parameters
    ----------
    given : int or None
        Number that a user has given; None for that of the environment.

    Raises
    ------
    InvalidInputError
        If ``ROS_DOMAIN_ID`` is no number from 0 to 232.
    """
    if given is not None:
        return given
    text = os.environ.get("ROS_DOMAIN_ID") or "0"
    if not (text.isascii() and text.isdigit() and int(text) <= 232):
        raise InvalidInputError(
            f"{text[:20]!r} is no ROS domain; valid: a number from 0 to 232", field="ROS_DOMAIN_ID"
        )
    return int(text)
