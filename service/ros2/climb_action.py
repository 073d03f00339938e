"""Serve the action of ROS 2 for a climb: search for it, send its set-points, report on both."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import msgspec
import zenoh
from msgspec import UNSET

from hand_models.base import CruxError, InvalidInputError
from planner import LostTile
from service.replies import (
    ClimbReply,
    ClimbSetPoints,
    ErrorDetail,
    ErrorReply,
    KnotReply,
    PartReply,
)
from service.ros2.calls import OwnQuestion, RosQuestion, ServiceCall
from service.ros2.goals import ActionGoal, Goals, GoalStatus
from service.ros2.messages import RosMessages, number
from service.ros2.retries import Retry, SlipError, retry
from service.ros2.settings import ROS_SETTINGS
from service.wire import Format, ServiceName, encode_error, service_key

__all__ = ["ClimbAction", "ClimbTopics", "Play"]

log = logging.getLogger(__name__)

CLIMB_ACTION = "crux_msgs/action/Climb"


class Play(Protocol):
    """Player of a climb, as `service.serving.play`."""

    def __call__(
        self,
        knots: list[KnotReply],
        *,
        rate: float,
        speed: float,
        sent: Callable[[ClimbSetPoints], None],
    ) -> int: ...


class _StoppedError(Exception):
    """A goal was cancelled, or the node closes, while its climb is played."""


class _SlippedError(Exception):
    """Tiles were reported to have slipped while a climb is played."""


@dataclass(eq=False)
class _Played:
    """Climb of a goal, and how far it is played.

    Attributes
    ----------
    goal : ActionGoal
    knots : list of KnotReply
        Knots that are known, in climbing order.
    last : ClimbSetPoints or None
        Last set-points that were sent.
    back_until : float
        Time of the set-points up to which a hand goes back after a slip [s].
    slipped : list of LostTile
        Tiles that were reported since the last feedback.
    """

    goal: ActionGoal
    knots: list[KnotReply] = field(default_factory=list)
    last: ClimbSetPoints | None = None
    back_until: float = -math.inf
    slipped: list[LostTile] = field(default_factory=list)


@dataclass(frozen=True)
class ClimbTopics:
    """Publishers of the messages of climbs.

    Attributes
    ----------
    feedback, status : callable
        Publish ``Climb_FeedbackMessage`` and ``action_msgs/msg/GoalStatusArray``.
    joints, tendons : callable
        Publish ``sensor_msgs/msg/JointState``.
    followed : callable
        Returns whether anybody subscribes to ``joints`` or ``tendons``.
    """

    feedback: Callable[[Any], None]
    status: Callable[[Any], None]
    joints: Callable[[Any], None]
    tendons: Callable[[Any], None]
    followed: Callable[[], bool]


class ClimbAction:
    """Action server for climbs: searches for the climb of a goal, and plays it if wanted.

    Parameters
    ----------
    session : zenoh.Session
        Session of the service.
    robot : str
        Name of the robot.
    messages : RosMessages
    topics : ClimbTopics
    ask : callable
        Takes a question, and the key of crux's own service that answers it.
    prepare : callable
        Called with a climb's request, in JSON; returns it as it is to be asked.
    play : Play
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        messages: RosMessages,
        topics: ClimbTopics,
        ask: Callable[[RosQuestion, str], None],
        prepare: Callable[[bytes], bytes],
        play: Play,
    ) -> None:
        self._session, self._robot, self._messages = session, robot, messages
        self._make, self._topics = messages.types.make, topics
        self._ask, self._prepare, self._play = ask, prepare, play
        self._goals = Goals(messages, CLIMB_ACTION, topics.status)
        self._climbs: dict[bytes, _Played] = {}
        self._players: list[threading.Thread] = []
        self._closing = False

    def close(self) -> None:
        """Stop climbs that are played, and accept no more goals."""
        self._closing = True
        for each in self._players:
            each.join()

    def send_goal(self, call: ServiceCall) -> None:
        """Accept a goal, unless too many are in work, and begin its search."""
        goal = self._goals.send(call)
        call.end()
        if goal is not None:
            goal.values |= {"least": math.nan, "bound": math.nan, "retried": 0, "slipped": []}
            self._climbs[goal.id] = _Played(goal)
            self._search(self._climbs[goal.id])

    def cancel_goal(self, call: ServiceCall) -> None:
        """Cancel goals by identifier or time: end their searches, stop their set-points."""
        ends = self._goals.cancel(call)
        call.end()
        for goal in ends:
            request = msgspec.json.encode({"v": 1, "id": goal.id.hex()})
            question = OwnQuestion(goal.caller, request, lambda *_: None, lambda _: None)
            self._ask(question, service_key(self._robot, ServiceName.CANCEL))

    def get_result(self, call: ServiceCall) -> None:
        """Send the result of a goal as soon as it has one; of an unknown goal at once."""
        if self._goals.result(call):
            call.end()

    def take_slip(self, sample: zenoh.Sample) -> None:
        """Take a ``crux_msgs/msg/Tile`` that has slipped, while a climb is played."""
        try:
            tile = self._messages.types.decode(sample.payload.to_bytes(), "crux_msgs/msg/Tile")
        except CruxError as error:
            log.warning("a slip is not taken: %s", error)
            return
        lost = LostTile(tile.limb, tile.finger, tile.phalanx)
        for climb in list(self._climbs.values()):
            if climb.last is not None and lost.limb in climb.last.tensions:
                climb.goal.values["slipped"].append(tile)
                climb.slipped.append(lost)

    # search --------------------------------------------------------------------------------------

    def _search(self, climb: _Played) -> None:
        try:
            request = self._request(climb.goal)
        except CruxError as error:
            self._refused(climb, _error_reply(error))
            return
        question = OwnQuestion(
            climb.goal.caller,
            request,
            lambda payload, encoding: self._replied(climb, payload, encoding),
            lambda error: self._refused(climb, error),
        )
        self._ask(question, service_key(self._robot, ServiceName.CLIMB))

    def _request(self, goal: ActionGoal) -> bytes:
        """Return the climb's request, with parts, and with the goal as its ``id``."""
        # a goal is cancelled between two set-points
        for name, least in (("rate", 1.0), ("speed", 1e-3)):
            value = getattr(goal.asked, name)
            if value != 0.0 and not least <= value <= 1000.0:
                raise InvalidInputError(f"{value}; valid: {least:g} to 1000, or 0", field=name)
        try:
            asked = msgspec.json.decode(goal.asked.request, type=dict[str, msgspec.Raw])
        except (msgspec.DecodeError, msgspec.ValidationError) as error:
            raise InvalidInputError(f"no JSON object: {error}", field="request") from None
        asked["id"], asked["parts"] = (
            msgspec.Raw(msgspec.json.encode(each)) for each in (goal.id.hex(), True)
        )
        if goal.asked.play:
            asked["want"] = msgspec.Raw(b'["trajectory"]')
        return self._prepare(msgspec.json.encode(asked))

    def _replied(self, climb: _Played, payload: bytes, encoding: str) -> None:
        if not Format.is_labelled(encoding, PartReply):
            self._found(climb, Format.JSON.decode(payload, ClimbReply), payload.decode())
            return
        part = Format.JSON.decode(payload, PartReply)
        if part.knots is not UNSET:
            climb.knots += part.knots
        if part.progress is not UNSET:
            state = part.progress
            self._feedback(
                climb,
                state="SEARCH",
                least=number(state.best),
                bound=number(state.bound),
                phase=state.phase,
                time=state.seconds,
            )

    def _found(self, climb: _Played, reply: ClimbReply, text: str) -> None:
        goal = climb.goal
        goal.values |= {
            "status": reply.status,
            "least": number(reply.least),
            "bound": number(reply.bound),
            "knots": reply.knots or 0,
            "reply": text,
        }
        if goal.status is GoalStatus.CANCELING or self._closing:
            self._finish(climb, GoalStatus.CANCELED)
        elif goal.asked.play and climb.knots:
            name = "crux-ros-climb"
            player = threading.Thread(target=self._run, args=(climb,), name=name, daemon=True)
            self._players = [*filter(threading.Thread.is_alive, self._players), player]
            player.start()
        else:
            done = reply.route is not None and not goal.asked.play
            self._finish(climb, GoalStatus.SUCCEEDED if done else GoalStatus.ABORTED)

    def _refused(self, climb: _Played, error: ErrorReply) -> None:
        climb.goal.values["error"] = self._messages.error(error)
        cancelled = error.error.kind == "cancelled"
        self._finish(climb, GoalStatus.CANCELED if cancelled else GoalStatus.ABORTED)

    # playing -------------------------------------------------------------------------------------

    def _run(self, climb: _Played) -> None:
        """Play the climb of a goal to its end."""
        end = time.monotonic() + ROS_SETTINGS.subscriber_wait
        while not self._topics.followed() and time.monotonic() < end:
            time.sleep(0.02)
        relay: zenoh.Subscriber[None] | None = None
        if self._topics.followed():
            relay = self._session.declare_subscriber(
                service_key(self._robot, ServiceName.PLAY),
                self._pass_on,
                allowed_origin=zenoh.Locality.SESSION_LOCAL,
            )
        try:
            self._play_all(climb)
            self._finish(climb, GoalStatus.SUCCEEDED)
        except _StoppedError:
            self._finish(climb, GoalStatus.CANCELED)
        except CruxError as error:
            self._refused(climb, _error_reply(error))
        except Exception:
            log.exception("a climb could not be played")
            detail = ErrorDetail("internal", None, "the climb could not be played; see the log")
            self._refused(climb, ErrorReply(error=detail))
        finally:
            if relay is not None:
                relay.undeclare()

    def _play_all(self, climb: _Played) -> None:
        asked, knots = climb.goal.asked, climb.knots
        while True:
            try:
                self._play(
                    knots,
                    rate=asked.rate or ROS_SETTINGS.set_point_rate,
                    speed=asked.speed or 1.0,
                    sent=lambda points: self._sent(climb, points),
                )
                return
            except _SlippedError:
                way = self._after_slip(climb)
                knots, climb.back_until = way.knots, way.turn

    def _sent(self, climb: _Played, points: ClimbSetPoints) -> None:
        """Look what is to be done after set-points were sent."""
        before, climb.last = climb.last, points
        if climb.goal.status is GoalStatus.CANCELING or self._closing:
            raise _StoppedError
        back = points.time < climb.back_until
        # the hand that lets go may slip
        if {tile.limb for tile in climb.slipped} - ({points.limb} if back else set()):
            raise _SlippedError
        if before is None or before.knot != points.knot:
            climb.goal.values["knot"] = points.knot
            self._progress(climb, points, "RETRY" if back else "PLAY")

    def _after_slip(self, climb: _Played) -> Retry:
        """Return how the climb goes on after a slip.

        Raises
        ------
        CruxError
            If it does not go on.
        """
        points, tiles, values = climb.last, list(climb.slipped), climb.goal.values
        assert points is not None
        self._progress(climb, points, "SLIP")
        found = retry(climb.knots, points, {tile.limb for tile in tiles})
        where = ", ".join(f"{tile.limb} {tile.finger} {tile.phalanx}" for tile in tiles)
        if found is None or values["retried"] >= climb.goal.asked.retries:
            why = "no retry is left"
            if found is None:
                why = "only the hand that takes its hold can let go and try again"
            raise SlipError(
                f"{where} slipped at knot {points.knot} ({points.phase}), where the set-points "
                f"stop: {why}"
            )
        values["retried"] += 1
        self._progress(climb, points, "RETRY")
        return found

    def _pass_on(self, sample: zenoh.Sample) -> None:
        """Publish set-points that are played as ROS 2's messages."""
        points = Format.JSON.decode(sample.payload.to_bytes(), ClimbSetPoints)
        if points.state == "playing":
            now = time.time_ns()
            self._topics.joints(self._messages.joints(points.joints, now))
            self._topics.tendons(self._messages.tendons(points.tensions, now))

    # messages ------------------------------------------------------------------------------------

    def _progress(self, climb: _Played, points: ClimbSetPoints, state: str) -> None:
        tiles, climb.slipped = climb.slipped, []
        values = climb.goal.values
        self._feedback(
            climb,
            state=state,
            least=values["least"],
            bound=values["bound"],
            knot=points.knot,
            move=points.move,
            phase=points.phase,
            limb=points.limb or "",
            time=points.time,
            slipped=[self._messages.tile(tile) for tile in tiles],
        )

    def _feedback(self, climb: _Played, **values: Any) -> None:
        feedback = self._make(f"{CLIMB_ACTION}_Feedback", knots=len(climb.knots), **values)
        name = self._goals.identifier(climb.goal)
        self._topics.feedback(
            self._make(f"{CLIMB_ACTION}_FeedbackMessage", goal_id=name, feedback=feedback)
        )

    def _finish(self, climb: _Played, status: GoalStatus) -> None:
        self._climbs.pop(climb.goal.id, None)
        self._goals.finish(climb.goal, status)


def _error_reply(error: CruxError) -> ErrorReply:
    return Format.JSON.decode(encode_error(error, Format.JSON).payload, ErrorReply)
