"""Keep the goals of an action of ROS 2: accept and cancel them, publish their status."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

import numpy as np

from service.requests import ClimbRequest
from service.ros2.calls import ServiceCall
from service.ros2.messages import RosMessages
from service.ros2.settings import ROS_SETTINGS

__all__ = ["ActionGoal", "GoalStatus", "Goals"]


class GoalStatus(IntEnum):
    """Status of a goal, as ``action_msgs/msg/GoalStatus`` numbers it."""

    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class CancelCode(IntEnum):
    """Outcome of a cancellation, as ``action_msgs/srv/CancelGoal`` numbers it."""

    NONE = 0
    UNKNOWN_GOAL_ID = 2
    GOAL_TERMINATED = 3


@dataclass(eq=False)
class ActionGoal:
    """Goal that was accepted.

    Attributes
    ----------
    id : bytes
        Identifier, 16 bytes, that its client has chosen.
    stamp : int
        When it was accepted, Unix time [ns].
    caller : bytes
        Global identifier of its client.
    asked : object
        The goal, a message of the action's goal type.
    status : GoalStatus
    values : dict of str to Any
        Fields of the result; those left out are zero or empty.
    waiting : list of ServiceCall
        Calls that wait for the result.
    """

    id: bytes
    stamp: int
    caller: bytes
    asked: Any
    status: GoalStatus = GoalStatus.EXECUTING
    values: dict[str, Any] = field(default_factory=dict)
    waiting: list[ServiceCall] = field(default_factory=list)

    @property
    def active(self) -> bool:
        """True until the goal has a result."""
        return self.status in (GoalStatus.EXECUTING, GoalStatus.CANCELING)


class Goals:
    """Goals of an action: those in work, and the last ones that have ended. Thread-safe.

    Parameters
    ----------
    messages : RosMessages
    kind : str
        Type of the action, such as ``crux_msgs/action/Climb``.
    publish : callable
        Publishes ``action_msgs/msg/GoalStatusArray``.
    """

    def __init__(self, messages: RosMessages, kind: str, publish: Callable[[Any], None]) -> None:
        self._messages, self._make, self._kind = messages, messages.types.make, kind
        self._publish = publish
        self._lock = threading.RLock()
        self._goals: dict[bytes, ActionGoal] = {}

    def send(self, call: ServiceCall) -> ActionGoal | None:
        """Answer a call that sends a goal; return the goal, or None where it is not accepted.

        A goal is not accepted if too many are in work, or if its identifier is known.
        """
        given = call.read(ClimbRequest)
        goal = ActionGoal(bytes(given.goal_id.uuid), time.time_ns(), call.caller, given.goal)
        with self._lock:
            ended = [each.id for each in self._goals.values() if not each.active]
            many = len(self._goals) - len(ended) >= ROS_SETTINGS.goals
            accepted = not many and goal.id not in self._goals
            if accepted:
                for old in ended[: max(0, len(ended) + 1 - ROS_SETTINGS.results)]:
                    del self._goals[old]
                self._goals[goal.id] = goal
            stamp = self._messages.header("", goal.stamp).stamp
            kind = f"{self._kind}_SendGoal_Response"
            call.respond(self._make(kind, accepted=accepted, stamp=stamp))
            if accepted:
                self._publish_status()
        return goal if accepted else None

    def cancel(self, call: ServiceCall) -> list[ActionGoal]:
        """Answer a call that cancels goals, and return them.

        By ROS 2's convention: the goal of an identifier, and all up to a time; all goals if both
        are zero.
        """
        info = call.read(ClimbRequest).goal_info
        name, until = bytes(info.goal_id.uuid), info.stamp.sec * 10**9 + info.stamp.nanosec
        every = not any(name) and until == 0
        with self._lock:
            chosen = [
                goal
                for goal in self._goals.values()
                if goal.id == name or every or goal.stamp <= until
            ]
            ends = [goal for goal in chosen if goal.active]
            code = CancelCode.NONE
            if any(name) and not ends:
                code = CancelCode.GOAL_TERMINATED if chosen else CancelCode.UNKNOWN_GOAL_ID
            for goal in ends:
                goal.status = GoalStatus.CANCELING
            response = self._make(
                "action_msgs/srv/CancelGoal_Response",
                return_code=code,
                goals_canceling=[self._info(goal) for goal in ends],
            )
            call.respond(response)
            self._publish_status()
        return ends

    def result(self, call: ServiceCall) -> bool:
        """Answer a call for a result, or let it wait for it; return False where it waits."""
        with self._lock:
            goal = self._goals.get(bytes(call.read(ClimbRequest).goal_id.uuid))
            if goal is not None and goal.active:
                goal.waiting.append(call)
                return False
        self._respond(goal, call)
        return True

    def finish(self, goal: ActionGoal, status: GoalStatus) -> None:
        """End a goal, and send its result to those who wait for it."""
        with self._lock:
            goal.status, calls, goal.waiting = status, goal.waiting, []
            self._publish_status()
        for call in calls:
            self._respond(goal, call)
            call.end()

    def identifier(self, goal: ActionGoal) -> Any:
        """Return the identifier of a goal as ``unique_identifier_msgs/msg/UUID``."""
        name = np.frombuffer(goal.id, np.uint8)
        return self._make("unique_identifier_msgs/msg/UUID", uuid=name)

    def _respond(self, goal: ActionGoal | None, call: ServiceCall) -> None:
        """Send a goal's result; an empty one, with status 0, of an unknown goal."""
        values = {} if goal is None else goal.values
        response = self._make(
            f"{self._kind}_GetResult_Response",
            status=0 if goal is None else goal.status,
            result=self._make(f"{self._kind}_Result", **values),
        )
        call.respond(response)

    def _publish_status(self) -> None:
        kind = "action_msgs/msg/GoalStatus"
        states = [
            self._make(kind, goal_info=self._info(goal), status=goal.status)
            for goal in self._goals.values()
        ]
        self._publish(self._make("action_msgs/msg/GoalStatusArray", status_list=states))

    def _info(self, goal: ActionGoal) -> Any:
        stamp = self._messages.header("", goal.stamp).stamp
        name = self.identifier(goal)
        return self._make("action_msgs/msg/GoalInfo", goal_id=name, stamp=stamp)
