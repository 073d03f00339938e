"""Offer the service as a node of ROS 2: services, topics, and the tokens by which ROS sees them."""

from __future__ import annotations

import itertools
import logging
import threading
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import Any

import msgspec
import zenoh

from hand_models.base import CruxError, InvalidInputError
from service.replies import HealthReply
from service.ros2.calls import RosCall
from service.ros2.health import service_state
from service.ros2.messages import RosMessages
from service.ros2.names import Attachment, Endpoint, EndpointKind, NodeNames
from service.ros2.settings import ROS_SETTINGS
from service.ros2.topics import RosStream
from service.wire import Answer, ServiceName, service_key

__all__ = ["RosNode"]

log = logging.getLogger(__name__)

Ask = Callable[[RosCall, str], None]


class RosNode:
    """Node of ROS 2, ``/crux/<robot>``, on the zenoh session of a service.

    Parameters
    ----------
    session : zenoh.Session
        Session of the service.
    robot : str
        Name of the robot.
    domain : int
        Number of the ROS domain.

    Attributes
    ----------
    services : tuple of str
        Names of its services.
    topics : tuple of str
        Names of its topics.

    Raises
    ------
    InvalidInputError
        If rosbags is not installed, or ROS 2 does not allow the robot's name.
    """

    def __init__(self, session: zenoh.Session, robot: str, domain: int) -> None:
        self._session, self._robot = session, robot
        self._names = NodeNames(domain, str(session.info.zid()), robot)
        self._messages = RosMessages()
        kinds = {
            ServiceName.PLAN: "Plan",
            ServiceName.WRENCH_SPACE: "WrenchSpace",
            ServiceName.STREAM: "Stream",
            ServiceName.SET_POINTS: "SetPoints",
        }
        self._services = {
            name: self._endpoint(self._names.private(name), f"crux_msgs/srv/{kind}")
            for name, kind in kinds.items()
        }
        self.services = tuple(service.name for service in self._services.values())
        self._diagnostics = self._endpoint("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
        private, wrench = self._names.private, "geometry_msgs/msg/WrenchStamped"
        self._body_wrenches = self._endpoint(private("body_wrench"), wrench)
        self._hand_wrenches = self._endpoint(private("hand_wrenches"), wrench)
        self._tendons = self._endpoint(private("tendons"), "sensor_msgs/msg/JointState")
        topics = (self._diagnostics, self._body_wrenches, self._tendons, self._hand_wrenches)
        self.topics = tuple(topic.name for topic in topics)
        self._numbers = itertools.count(1)
        self._closing = threading.Event()
        self._open = ExitStack()

    def open(self, ask: Ask, health: Callable[[], Answer]) -> None:
        """Declare services, topics and tokens; to be called when questions can be answered.

        Parameters
        ----------
        ask : callable
            Takes a call, and the key of crux's own service that answers it.
        health : callable
            Returns the health of the service, an encoded `HealthReply`.
        """
        liveliness = self._session.liveliness()
        self._until_the_end(liveliness.declare_token(self._names.node_token()))
        stream = RosStream(
            self._session,
            self._robot,
            self._messages,
            self._publisher(self._tendons),
            self._publisher(self._hand_wrenches),
        )
        self._open.callback(stream.close)
        key = self._names.key(self._body_wrenches)
        self._until_the_end(self._session.declare_subscriber(key, stream.take))
        self._announce(EndpointKind.SUBSCRIPTION, self._body_wrenches)

        def answered(response: Any) -> None:
            if response.__msgtype__ == "crux_msgs/srv/Stream_Response":
                stream.follow(response.stream)

        for name, service in self._services.items():
            key = self._names.key(service)
            call = partial(self._called, ask, answered, name, service)
            self._until_the_end(self._session.declare_queryable(key, call, complete=True))
            self._announce(EndpointKind.SERVICE, service)
        publish = self._publisher(self._diagnostics)
        thread = threading.Thread(
            target=self._report, args=(health, stream, publish), name="crux-ros", daemon=True
        )
        self._open.callback(thread.join)
        self._open.callback(self._closing.set)
        thread.start()

    def close(self) -> None:
        """Withdraw all declarations."""
        self._open.close()

    def _endpoint(self, name: str, kind: str) -> Endpoint:
        return Endpoint(name, kind, self._messages.types.type_hash(kind))

    def _until_the_end(self, declared: Any) -> None:
        self._open.callback(declared.undeclare)

    def _announce(self, kind: EndpointKind, endpoint: Endpoint) -> str:
        """Declare the token of an endpoint, and return its key."""
        token = self._names.token(kind, endpoint, next(self._numbers))
        self._until_the_end(self._session.liveliness().declare_token(token))
        return token

    def _publisher(self, topic: Endpoint) -> Callable[[Any], None]:
        """Declare a topic, and return what publishes a message on it."""
        publisher = self._session.declare_publisher(self._names.key(topic))
        self._until_the_end(publisher)
        sender = Attachment.sender_of(self._announce(EndpointKind.PUBLISHER, topic))
        numbers = itertools.count(1)

        def publish(message: Any) -> None:
            attached = Attachment.sent_now(next(numbers), sender)
            publisher.put(self._messages.types.encode(message), attachment=attached.encode())

        return publish

    def _called(
        self,
        ask: Ask,
        answered: Callable[[Any], None],
        name: ServiceName,
        service: Endpoint,
        query: zenoh.Query,
    ) -> None:
        try:
            call = RosCall(query, self._names.key(service), service, self._messages, answered)
        except InvalidInputError as error:
            # not by ROS 2, where no error reply is read
            log.warning("a call of %s is not answered: %s", service.name, error)
            query.drop()
            return
        try:
            call.read(name)
        except CruxError as error:
            with call:
                call.refuse(error)
            return
        ask(call, service_key(self._robot, name))

    def _report(
        self, health: Callable[[], Answer], stream: RosStream, publish: Callable[[Any], None]
    ) -> None:
        """Publish the state of the service until the node closes."""
        while not self._closing.wait(ROS_SETTINGS.diagnostics_period):
            reply = msgspec.json.decode(health().payload, type=HealthReply)
            publish(self._messages.diagnostics([service_state(reply), stream.state()]))
