"""Offer the service as a node of ROS 2: services, an action, topics, and their tokens."""

from __future__ import annotations

import itertools
import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from typing import Any

import msgspec
import zenoh
import zenoh.ext

from hand_models.base import CruxError
from service.recording import RosSample
from service.replies import BriefPlanReply, HealthReply, PlanReply, StreamReply
from service.ros2.calls import RosCall, RosQuestion, ServiceCall
from service.ros2.climb_action import ClimbAction, ClimbTopics, Play
from service.ros2.clouds import RosRock
from service.ros2.health import DiagnosticState, service_state
from service.ros2.markers import PlanMarkers
from service.ros2.messages import AnyReply, RosMessages
from service.ros2.names import Attachment, Endpoint, EndpointKind, NodeNames, Quality
from service.ros2.settings import ROS_SETTINGS
from service.ros2.topics import RosStream
from service.wire import Answer, ServiceName, service_key

__all__ = ["RosNode", "check_node"]

log = logging.getLogger(__name__)

Ask = Callable[[RosQuestion, str], None]


def check_node(robot: str, domain: int) -> None:
    """Check that there can be a node of a robot in a ROS domain; raise as `RosNode`."""
    NodeNames(domain, "0", robot)
    RosMessages()


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
    names : tuple of str
        Names of its services, its action and its topics.

    Raises
    ------
    InvalidInputError
        If rosbags is not installed, or ROS 2 does not allow the robot's name.
    """

    def __init__(self, session: zenoh.Session, robot: str, domain: int) -> None:
        self._session, self._robot = session, robot
        self._names = NodeNames(domain, str(session.info.zid()), robot)
        self._messages = RosMessages()
        private = self._names.private
        kinds = {
            ServiceName.PLAN: "Plan",
            ServiceName.WRENCH_SPACE: "WrenchSpace",
            ServiceName.STREAM: "Stream",
            ServiceName.SET_POINTS: "SetPoints",
        }
        self._services = {
            name: self._endpoint(private(name), f"crux_msgs/srv/{kind}")
            for name, kind in kinds.items()
        }
        self._action = private("climb")
        joints, wrench = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"
        self._topics = {
            "diagnostics": self._endpoint("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),
            "body_wrench": self._endpoint(private("body_wrench"), wrench),
            "tendons": self._endpoint(private("tendons"), joints),
            "hand_wrenches": self._endpoint(private("hand_wrenches"), wrench),
            "plan_markers": self._endpoint(
                private("plan_markers"), "visualization_msgs/msg/MarkerArray", Quality.LATCHED
            ),
            "rock": self._endpoint(private("rock"), "sensor_msgs/msg/PointCloud2"),
            "climb_joints": self._endpoint(private("climb_joints"), joints),
            "climb_tendons": self._endpoint(private("climb_tendons"), joints),
            "slips": self._endpoint(private("slips"), "crux_msgs/msg/Tile"),
        }
        services, topics = self._services.values(), self._topics.values()
        self.names = (
            *(service.name for service in services),
            self._action,
            *(topic.name for topic in topics),
        )
        self._numbers = itertools.count(1)
        self._closing = threading.Event()
        self._open = ExitStack()

    def open(
        self,
        ask: Ask,
        health: Callable[[], Answer],
        play: Play,
        record: Callable[[RosSample], None] | None = None,
    ) -> None:
        """Declare services, topics and tokens; to be called when questions can be answered.

        Parameters
        ----------
        ask : callable
            Takes a question, and the key of crux's own service that answers it.
        health : callable
            Returns the health of the service, an encoded `HealthReply`.
        play : Play
            Sends the set-points of a climb.
        record : callable, optional
            Takes each message of each topic, to be recorded.
        """
        if record is not None:
            for topic in self._topics.values():
                self._until_the_end(self._recorded(topic, record))
        self._until_the_end(self._session.liveliness().declare_token(self._names.node_token()))
        publish = {
            name: self._publisher(self._topics[name])[0]
            for name in ("diagnostics", "tendons", "hand_wrenches", "plan_markers")
        }
        stream = RosStream(
            self._session,
            self._robot,
            self._messages,
            publish["tendons"],
            publish["hand_wrenches"],
            ask,
        )
        self._open.callback(stream.close)
        self._subscribe("body_wrench", stream.take)
        rock = RosRock(self._robot, self._messages)
        self._open.callback(rock.close)
        self._subscribe("rock", rock.take)
        markers = PlanMarkers(self._messages)
        drawing = self._open.enter_context(ThreadPoolExecutor(1, "crux-ros-markers"))

        def draw(request: bytes, reply: PlanReply | BriefPlanReply) -> None:
            try:
                publish["plan_markers"](markers.draw(request, reply))
            except Exception:
                log.exception("a plan could not be drawn")

        def answered(call: RosCall, reply: AnyReply) -> None:
            if isinstance(reply, StreamReply):
                stream.follow(reply.stream, bytes(call.payload), call.caller)
            elif isinstance(reply, PlanReply | BriefPlanReply):
                drawing.submit(draw, bytes(call.payload), reply)

        def ask_for(name: ServiceName, call: ServiceCall) -> None:
            question = RosCall(call, self._messages, rock.placed_in, answered)
            try:
                question.read(name)
            except CruxError as error:
                with question:
                    question.refuse(error)
                return
            ask(question, service_key(self._robot, name))

        for name, service in self._services.items():
            self._serve(service, partial(ask_for, name))
        self._offer_climbs(ask, rock, play)
        states = (stream.state, rock.state)
        thread = threading.Thread(
            target=self._report,
            args=(health, states, publish["diagnostics"]),
            name="crux-ros",
            daemon=True,
        )
        self._open.callback(thread.join)
        self._open.callback(self._closing.set)
        thread.start()

    def close(self) -> None:
        """Withdraw all declarations."""
        self._open.close()

    def _offer_climbs(self, ask: Ask, rock: RosRock, play: Play) -> None:
        """Declare the action for climbs, with its services and topics."""
        kind, at = "crux_msgs/action/Climb", f"{self._action}/_action"
        feedback, _ = self._publisher(self._endpoint(f"{at}/feedback", f"{kind}_FeedbackMessage"))
        status, _ = self._publisher(
            self._endpoint(f"{at}/status", "action_msgs/msg/GoalStatusArray", Quality.LATCHED)
        )
        joints, joints_followed = self._publisher(self._topics["climb_joints"])
        tendons, tendons_followed = self._publisher(self._topics["climb_tendons"])
        topics = ClimbTopics(
            feedback, status, joints, tendons, lambda: joints_followed() or tendons_followed()
        )
        action = ClimbAction(
            self._session, self._robot, self._messages, topics, ask, rock.placed_in, play
        )
        self._open.callback(action.close)
        self._subscribe("slips", action.take_slip)
        for name, service, take in (
            ("send_goal", f"{kind}_SendGoal", action.send_goal),
            ("cancel_goal", "action_msgs/srv/CancelGoal", action.cancel_goal),
            ("get_result", f"{kind}_GetResult", action.get_result),
        ):
            self._serve(self._endpoint(f"{at}/{name}", service), take)

    def _endpoint(self, name: str, kind: str, quality: Quality = Quality.VOLATILE) -> Endpoint:
        return Endpoint(name, kind, self._messages.types.type_hash(kind), quality)

    def _until_the_end(self, declared: Any) -> None:
        self._open.callback(declared.undeclare)

    def _recorded(self, topic: Endpoint, record: Callable[[RosSample], None]) -> Any:
        """Subscribe to a topic for a recording: what others publish there, only if it is taken."""
        name, kind, definition = topic.name, topic.type, self._messages.types.definition(topic.type)

        def take(sample: zenoh.Sample) -> None:
            record(RosSample(name, kind, definition, sample.payload.to_bytes()))

        taken = {self._topics[name].name for name in ("body_wrench", "rock", "slips")}
        origin = zenoh.Locality.ANY if name in taken else zenoh.Locality.SESSION_LOCAL
        return self._session.declare_subscriber(self._names.key(topic), take, allowed_origin=origin)

    def _announce(self, kind: EndpointKind, endpoint: Endpoint) -> str:
        """Declare the token of an endpoint, and return its key."""
        token = self._names.token(kind, endpoint, next(self._numbers))
        self._until_the_end(self._session.liveliness().declare_token(token))
        return token

    def _publisher(self, topic: Endpoint) -> tuple[Callable[[Any], None], Callable[[], bool]]:
        """Declare a topic.

        Returns
        -------
        publish : callable
            Publishes a message on it.
        followed : callable
            Returns whether anybody subscribes to it.
        """
        key = self._names.key(topic)
        publisher: Any
        if topic.quality is Quality.LATCHED:
            publisher = zenoh.ext.declare_advanced_publisher(
                self._session,
                key,
                cache=zenoh.ext.CacheConfig(max_samples=1),
                # numbers each message, as the session may give no time stamps
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=None
                ),
                publisher_detection=True,
            )
        else:
            publisher = self._session.declare_publisher(key)
        self._until_the_end(publisher)
        sender = Attachment.sender_of(self._announce(EndpointKind.PUBLISHER, topic))
        numbers = itertools.count(1)

        def publish(message: Any) -> None:
            attached = Attachment.sent_now(next(numbers), sender)
            publisher.put(self._messages.types.encode(message), attachment=attached.encode())

        return publish, lambda: bool(publisher.matching_status.matching)

    def _subscribe(self, name: str, take: Callable[[zenoh.Sample], None]) -> None:
        topic = self._topics[name]
        self._until_the_end(self._session.declare_subscriber(self._names.key(topic), take))
        self._announce(EndpointKind.SUBSCRIPTION, topic)

    def _serve(self, service: Endpoint, take: Callable[[ServiceCall], None]) -> None:
        key = self._names.key(service)
        call = partial(self._called, service, take)
        self._until_the_end(self._session.declare_queryable(key, call, complete=True))
        self._announce(EndpointKind.SERVICE, service)

    def _called(
        self, service: Endpoint, take: Callable[[ServiceCall], None], query: zenoh.Query
    ) -> None:
        try:
            take(ServiceCall(query, self._names.key(service), service, self._messages.types))
        except CruxError as error:
            # not by ROS 2, where no error reply is read
            log.warning("a call of %s is not answered: %s", service.name, error)
            query.drop()

    def _report(
        self,
        health: Callable[[], Answer],
        states: tuple[Callable[[], DiagnosticState], ...],
        publish: Callable[[Any], None],
    ) -> None:
        """Publish the state of the service until the node closes."""
        while not self._closing.wait(ROS_SETTINGS.diagnostics_period):
            reply = msgspec.json.decode(health().payload, type=HealthReply)
            publish(
                self._messages.diagnostics([service_state(reply), *(state() for state in states)])
            )
