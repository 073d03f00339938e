"""The action for a climb: goals by ROS 2's convention, of a node whose searches a test answers."""

from __future__ import annotations

import json
import queue
import struct
import time
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from itertools import pairwise
from typing import Any

import pytest
import zenoh
import zenoh.ext

from hand_models.base import CruxError
from service.replies import ClimbReply, ClimbSetPoints, HealthReply, KnotReply, PartReply
from service.requests import RouteRequest
from service.ros2 import RosNode, RosQuestion
from service.ros2.definitions import package_folder
from service.serving import open_session, play, zenoh_config
from service.wire import Answer, CancelledError, Format, decode_request, encode_error
from tests.service.ros2.test_retries import KNOTS
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import wall_request
from tests.suite.helpers.ros_peer import RosPeer
from tests.suite.helpers.searched import progress
from tests.suite.helpers.served import client_config, free_endpoint

DOMAIN = 9
ACTION = "/crux/robosimian/climb"
KIND = "crux_msgs/action/Climb"
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
REQUEST = json.dumps({"v": 1, "rock": "leaning-wall"})


def found(name: str, **other: Any) -> ClimbReply:
    route = {"v": 1, "stance": wall_request()["stance"], "moves": []}
    values = {
        "name": "climb",
        "robot": "robosimian",
        "status": "found",
        "least": 1.25,
        "bound": 1.5,
        "gap": 0.2,
        "deciding": None,
        "raises": [],
        "refused": [],
        "about": "this wall",
        "route": decode_request(json.dumps(route).encode(), RouteRequest),
        "stages": [],
        "knots": len(KNOTS),
        "placements": 0,
        "bodies": 0,
        "programs": 0,
        "seconds": {},
    }
    return ClimbReply(id=name, **(values | other))


class Site:
    """A node, what it asks of the service, and a caller of its action."""

    def __init__(self) -> None:
        self.open, endpoint = ExitStack(), free_endpoint()
        config = zenoh_config(mode="peer", listen=[endpoint], multicast=False)
        served = self.open.enter_context(open_session(config))
        self.asked: queue.Queue[tuple[RosQuestion, str]] = queue.Queue()
        node = RosNode(served, "robosimian", DOMAIN)
        self.played: list[list[KnotReply]] = []
        self.slips: dict[str, str] = {}

        def played(knots: list[KnotReply], *, sent: Callable, **how: Any) -> int:
            def stand_still(points: ClimbSetPoints) -> None:
                """Send no further set-points until the slip of this phase has come, if any."""
                if (limb := self.slips.pop(points.phase, None)) is not None:
                    self.slip(limb)
                    end = time.monotonic() + PATIENCE
                    while time.monotonic() < end:
                        sent(points)
                        time.sleep(0.01)
                sent(points)

            self.played.append(knots)
            return play(served, "robosimian", knots, sent=stand_still, **how)

        health = HealthReply(
            version="1",
            robot="robosimian",
            uptime=1.0,
            replied=0,
            waiting={},
            processes=[],
            last_failure=None,
        )
        told = Answer(Format.JSON.encode(health), Format.JSON.label(health))
        node.open(lambda *question: self.asked.put(question), lambda: told, played)
        self.open.callback(node.close)
        self.session = self.open.enter_context(open_session(client_config(endpoint)))
        self.peer = RosPeer(package_folder())
        self.pool = self.open.enter_context(ThreadPoolExecutor(8))
        self.feedback = self.subscribed(f"{ACTION}/_action/feedback", f"{KIND}_FeedbackMessage")

    def subscribed(self, name: str, kind: str) -> queue.Queue[dict[str, Any]]:
        got: queue.Queue[dict[str, Any]] = queue.Queue()
        key = self.peer.key(DOMAIN, name, kind)
        take = self.session.declare_subscriber(
            key, lambda sample: got.put(self.peer.decode(kind, sample.payload.to_bytes()))
        )
        self.open.callback(take.undeclare)
        return got

    def call(self, name: str, kind: str, **request: Any) -> dict[str, Any]:
        return self.peer.call(self.session, DOMAIN, f"{ACTION}/_action/{name}", kind, request)

    def send(self, request: str = REQUEST, **other: Any) -> tuple[bytes, dict[str, Any]]:
        name = uuid.uuid4().bytes
        goal = {"request": request, "play": False, "rate": 0.0, "speed": 0.0, "retries": 0}
        request_kind = f"{KIND}_SendGoal"
        answer = self.call("send_goal", request_kind, goal_id={"uuid": name}, goal=goal | other)
        return name, answer

    def result(self, name: bytes) -> Future[dict[str, Any]]:
        """The result, as soon as there is one."""
        return self.pool.submit(
            self.call, "get_result", f"{KIND}_GetResult", goal_id={"uuid": name}
        )

    def cancel(self, name: bytes = bytes(16)) -> dict[str, Any]:
        info = {"goal_id": {"uuid": name}, "stamp": {"sec": 0, "nanosec": 0}}
        return self.call("cancel_goal", "action_msgs/srv/CancelGoal", goal_info=info)

    def question(self) -> tuple[RosQuestion, dict[str, Any], str]:
        question, key = self.asked.get(timeout=PATIENCE)
        return question, json.loads(bytes(question.payload)), key

    def next(self, state: str) -> dict[str, Any]:
        while (told := self.feedback.get(timeout=PATIENCE)["feedback"])["state"] != state:
            continue
        return told

    def slip(self, limb: str) -> None:
        kind = "crux_msgs/msg/Tile"
        tile = {"limb": limb, "finger": "outer_left", "phalanx": "distal"}
        attached = struct.pack("<qqB", 1, 1, 16) + bytes(16)
        key = self.peer.key(DOMAIN, "/crux/robosimian/slips", kind)
        self.session.put(key, self.peer.encode(kind, tile), attachment=attached)


def reply(question: RosQuestion, message: Any, *, last: bool = True) -> None:
    question.reply(
        "crux/robosimian/climb", Format.JSON.encode(message), encoding=Format.JSON.label(message)
    )
    if last:
        question.__exit__()


@pytest.fixture
def site() -> Iterator[Site]:
    made = Site()
    key = made.peer.key(DOMAIN, f"{ACTION}/_action/send_goal", f"{KIND}_SendGoal")
    querier = made.session.declare_querier(key)
    assert soon(lambda: bool(querier.matching_status.matching))
    yield made
    made.open.close()


def test_a_search_tells_how_far_it_is_and_ends_with_the_climb(site: Site) -> None:
    name, answer = site.send()
    assert answer["accepted"]
    assert answer["stamp"]["sec"] > 1_700_000_000
    waiting = site.result(name)
    question, asked, key = site.question()
    assert key == "crux/robosimian/climb"
    assert asked == {"v": 1, "rock": "leaning-wall", "id": name.hex(), "parts": True}
    part = PartReply(id=name.hex(), progress=progress(2))
    assert soon(lambda: reply(question, part, last=False) or not site.feedback.empty())
    told = site.feedback.get()
    assert told["goal_id"]["uuid"] == name
    told = told["feedback"]
    assert (told["state"], told["phase"], told["knot"]) == ("SEARCH", "search", 0)
    assert (told["least"], told["bound"]) == pytest.approx((0.7, 1.8))
    assert not waiting.done()
    climb = found(name.hex())
    reply(question, climb)
    result = waiting.result(PATIENCE)
    assert result["status"] == SUCCEEDED
    result = result["result"]
    assert (result["status"], result["least"], result["bound"]) == ("found", 1.25, 1.5)
    assert (result["knots"], result["error"]["kind"], result["slipped"]) == (len(KNOTS), "", [])
    assert json.loads(result["reply"])["about"] == "this wall"
    # it is kept
    assert site.result(name).result(PATIENCE)["result"] == result
    assert site.result(bytes(16)).result(PATIENCE)["status"] == 0


def test_goals_without_a_climb_and_with_errors_are_aborted(site: Site) -> None:
    name, _ = site.send()
    question, _, _ = site.question()
    reply(question, found(name.hex(), status="none", least=None, route=None, knots=None))
    result = site.result(name).result(PATIENCE)
    assert (result["status"], result["result"]["status"]) == (ABORTED, "none")
    name, _ = site.send()
    question, _, _ = site.question()
    answer = encode_error(CruxError("no", field="start.height"), Format.JSON)
    question.reply_err(answer.payload, encoding=answer.encoding)
    result = site.result(name).result(PATIENCE)
    assert result["status"] == ABORTED
    assert result["result"]["error"]["field"] == "start.height"
    for request, other, field in (
        ("[", {}, "request"),
        (REQUEST, {"speed": -1.0}, "speed"),
        (REQUEST, {"rate": 0.01}, "rate"),
    ):
        name, answer = site.send(request, **other)
        assert answer["accepted"]
        result = site.result(name).result(PATIENCE)
        assert result["status"] == ABORTED
        assert (result["result"]["error"]["kind"], result["result"]["error"]["field"]) == (
            "invalid",
            field,
        )
    assert site.asked.empty()


def test_goals_are_cancelled_one_or_all_and_there_are_not_too_many(site: Site) -> None:
    names = [site.send()[0] for _ in range(4)]
    assert not site.send()[1]["accepted"]
    questions = {asked["id"]: question for question, asked, _ in (site.question() for _ in names)}
    answer = site.cancel(names[1])
    assert answer["return_code"] == 0
    assert [each["goal_id"]["uuid"] for each in answer["goals_canceling"]] == [names[1]]
    question, asked, key = site.question()
    assert (key, asked["id"]) == ("crux/robosimian/cancel", names[1].hex())
    # in the name of the same caller, whose question it ends
    assert question.caller == questions[names[1].hex()].caller
    ended = encode_error(CancelledError("cancelled"), Format.JSON)
    questions[names[1].hex()].reply_err(ended.payload, encoding=ended.encoding)
    assert site.result(names[1]).result(PATIENCE)["status"] == CANCELED
    assert site.cancel(names[1])["return_code"] == 3
    assert site.cancel(b"x" * 16)["return_code"] == 2
    left = {each["goal_id"]["uuid"] for each in site.cancel()["goals_canceling"]}
    assert left == {*names} - {names[1]}
    # a search that ends nevertheless
    reply(questions[names[0].hex()], found(names[0].hex()))
    assert site.result(names[0]).result(PATIENCE)["status"] == CANCELED


def test_who_subscribes_late_gets_the_status_of_all_goals(site: Site) -> None:
    name, _ = site.send()
    kind = "action_msgs/msg/GoalStatusArray"
    got: queue.Queue[dict[str, Any]] = queue.Queue()
    late = zenoh.ext.declare_advanced_subscriber(
        site.session,
        site.peer.key(DOMAIN, f"{ACTION}/_action/status", kind),
        lambda sample: got.put(site.peer.decode(kind, sample.payload.to_bytes())),
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
    )
    (status,) = got.get(timeout=PATIENCE)["status_list"]
    assert status["goal_info"]["goal_id"]["uuid"] == name
    assert status["status"] == 2
    late.undeclare()


def playing(site: Site, **goal: Any) -> tuple[bytes, dict[str, queue.Queue[dict[str, Any]]]]:
    """A goal that is played, ten times as fast, and what a robot gets."""
    joints = "sensor_msgs/msg/JointState"
    topics = {
        name: site.subscribed(f"/crux/robosimian/{name}", joints)
        for name in ("climb_joints", "climb_tendons")
    }
    name, _ = site.send(play=True, speed=10.0, rate=100.0, **goal)
    question, asked, _ = site.question()
    assert asked["want"] == ["trajectory"]
    reply(question, PartReply(id=name.hex(), knots=KNOTS[:4]), last=False)
    reply(question, PartReply(id=name.hex(), knots=KNOTS[4:]), last=False)
    reply(question, found(name.hex()))
    return name, topics


def test_a_climb_is_played_to_its_end(site: Site) -> None:
    name, topics = playing(site)
    result = site.result(name).result(PATIENCE)
    assert result["status"] == SUCCEEDED
    assert result["result"]["knot"] == len(KNOTS) - 1
    assert [len(knots) for knots in site.played] == [len(KNOTS)]
    angles = [topics["climb_joints"].get(timeout=PATIENCE) for _ in range(50)]
    assert {tuple(each["name"]) for each in angles} == {("front_left/joint_1",)}
    (first,) = angles[0]["position"]
    assert first == 0.0
    steps = [b["position"][0] - a["position"][0] for a, b in pairwise(angles)]
    assert min(steps) >= 0.0
    tendons = topics["climb_tendons"].get(timeout=PATIENCE)
    assert tendons["name"][0] == "front_left/outer_left"
    assert (tendons["position"], tendons["effort"]) == ([], [0.0] * 4)
    reached = [site.feedback.get(timeout=PATIENCE)["feedback"] for _ in KNOTS]
    assert [each["knot"] for each in reached] == list(range(len(KNOTS)))
    assert {each["state"] for each in reached} == {"PLAY"}
    assert [each["phase"] for each in reached] == [knot.phase for knot in KNOTS]


def test_a_hand_that_slips_on_its_hold_tries_again(site: Site) -> None:
    site.slips["close"] = "front_left"
    name, _ = playing(site, retries=1)
    told = site.next("SLIP")
    assert [tile["phalanx"] for tile in told["slipped"]] == ["distal"]
    assert site.next("RETRY")["knot"] == told["knot"]
    assert site.next("PLAY")["phase"] == "close"
    result = site.result(name).result(PATIENCE)
    assert (result["status"], result["result"]["retried"]) == (SUCCEEDED, 1)
    assert [tile["limb"] for tile in result["result"]["slipped"]] == ["front_left"]
    assert len(site.played) == 2


def test_a_slip_without_a_way_back_ends_the_climb(site: Site) -> None:
    published: list[ClimbSetPoints] = []
    take = site.session.declare_subscriber(
        "crux/robosimian/play",
        lambda sample: published.append(
            Format.JSON.decode(sample.payload.to_bytes(), ClimbSetPoints)
        ),
    )
    site.slips["open"] = "front_left"
    name, _ = playing(site, retries=5)
    result = site.result(name).result(PATIENCE)
    assert result["status"] == ABORTED
    error = result["result"]["error"]
    assert error["kind"] == "slipped"
    assert "front_left outer_left distal slipped at knot" in error["message"]
    assert result["result"]["knot"] < len(KNOTS) - 1
    # the robot is told to stay where it is
    assert soon(lambda: published[-1].state == "stopped")
    take.undeclare()


def test_a_cancelled_climb_stops(site: Site) -> None:
    # time passes until it is cancelled: this slip is of no hand
    site.slips["start"] = "tail"
    name, _ = playing(site)
    site.next("PLAY")
    assert site.cancel(name)["return_code"] == 0
    result = site.result(name).result(PATIENCE)
    assert result["status"] == CANCELED
    assert result["result"]["knot"] < len(KNOTS) - 1


def test_a_climb_that_nobody_follows_is_not_played(site: Site) -> None:
    name, _ = site.send(play=True)
    question, _, _ = site.question()
    reply(question, PartReply(id=name.hex(), knots=KNOTS), last=False)
    reply(question, found(name.hex()))
    result = site.result(name).result(PATIENCE)
    assert result["status"] == ABORTED
    assert "nobody subscribes" in result["result"]["error"]["message"]
