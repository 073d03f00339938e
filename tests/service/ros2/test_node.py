"""The service as a node of ROS 2, through a zenoh router, by a caller of its own making."""

from __future__ import annotations

import itertools
import math
import os
import queue
import signal
import struct
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import zenoh
import zenoh.ext

from service.answering import answer_plan
from service.commands.cli import run_command_line
from service.replies import HealthReply, PlanReply, WrenchSpaceReply
from service.ros2 import RosNode
from service.ros2.definitions import package_folder
from service.serving import open_session, zenoh_config
from tests.service.ros2.test_clouds import cloud
from tests.suite.helpers.commands import BAD_INPUT, complaint
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.replies import departures
from tests.suite.helpers.requests import (
    HEAVY,
    JSON,
    plan_request,
    pose_of,
    stream_request,
    wall_request,
)
from tests.suite.helpers.ros_peer import RosPeer
from tests.suite.helpers.served import Served, client_config, free_endpoint

DOMAIN = 7
NODE = "/crux/robosimian"
NO_ERROR = {"kind": "", "field": "", "message": "", "retry_after": 0.0}
FINGERS = ("outer_left", "inner_left", "inner_right", "outer_right")


class Caller:
    """Session of a ROS 2 process, which reaches the service through the router."""

    def __init__(self, session: zenoh.Session) -> None:
        self.session, self.peer = session, RosPeer(package_folder())

    def __call__(self, name: str, kind: str, **request: Any) -> dict[str, Any]:
        kind = f"crux_msgs/srv/{kind}"
        return self.peer.call(self.session, DOMAIN, f"{NODE}/{name}", kind, request)

    def tokens(self) -> list[str]:
        replies = self.session.liveliness().get(f"@ros2_lv/{DOMAIN}/**", timeout=PATIENCE)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def subscribe(self, name: str, kind: str) -> tuple[zenoh.Subscriber, queue.Queue]:
        got: queue.Queue[dict[str, Any]] = queue.Queue()

        def take(sample: zenoh.Sample) -> None:
            number, _, size = struct.unpack_from("<qqB", sample.attachment.to_bytes())
            assert number > 0
            assert size == 16
            got.put(self.peer.decode(kind, sample.payload.to_bytes()))

        key = self.peer.key(DOMAIN, name, kind)
        return self.session.declare_subscriber(key, take), got

    def publish(self, wrench: list[float], stamp: int, frame: str = "B") -> None:
        """Publish a body wrench, in B if nothing else is said, with a stamp in ns."""
        name, kind = f"{NODE}/body_wrench", "geometry_msgs/msg/WrenchStamped"
        at = dict(zip(("sec", "nanosec"), divmod(stamp, 10**9), strict=True))
        header = {"stamp": at, "frame_id": frame}
        message = {"header": header, "wrench": as_wrench(wrench)}
        attached = struct.pack("<qqB", 1, stamp, 16) + bytes(16)
        key = self.peer.key(DOMAIN, name, kind)
        self.session.put(key, self.peer.encode(kind, message), attachment=attached)


@pytest.fixture(scope="module")
def router() -> Iterator[str]:
    endpoint = free_endpoint()
    config = zenoh_config(mode="router", listen=[endpoint], multicast=False)
    with open_session(config):
        yield endpoint


@pytest.fixture(scope="module")
def service(router: str) -> Iterator[Served]:
    flags = ["--workers", "1", "--ros2", "--domain", str(DOMAIN), "-e", router]
    served = Served(free_endpoint(), *flags)
    yield served
    _, said = served.stop(signal.SIGTERM)
    assert served.process.returncode == 0
    assert f"in ROS 2: {NODE}/plan, " in said


@pytest.fixture(scope="module")
def call(router: str, service: Served) -> Iterator[Caller]:
    with open_session(client_config(router)) as session:
        caller = Caller(session)
        assert soon(lambda: len(caller.tokens()) >= 6)
        yield caller


def as_wrench(entries: list[float]) -> dict[str, dict[str, float]]:
    return {
        part: dict(zip("xyz", numbers, strict=True))
        for part, numbers in (("force", entries[:3]), ("torque", entries[3:]))
    }


def test_ros_sees_the_node_with_its_services_and_topics(call: Caller, service: Served) -> None:
    tokens = sorted(token.split("/") for token in call.tokens())
    assert len({token[2] for token in tokens}) == 1
    assert {tuple(token[:2]) for token in tokens} == {("@ros2_lv", str(DOMAIN))}
    nodes = [token for token in tokens if token[5] == "NN"]
    assert [token[3:] for token in nodes] == [["0", "0", "NN", "%", "%crux", "robosimian"]]
    ends = {(token[5], token[9].replace("%", "/")): token for token in tokens if token[5] != "NN"}
    assert len({token[4] for token in ends.values()} | {"0"}) == len(tokens)
    named = []
    for name, kind in [
        ("plan", "Plan"),
        ("wrench_space", "WrenchSpace"),
        ("stream", "Stream"),
        ("set_points", "SetPoints"),
    ]:
        token = ends.pop(("SS", f"{NODE}/{name}"))
        full = f"crux_msgs/srv/{kind}"
        key = f"{token[1]}{token[9]}/{token[10]}/{token[11]}".replace("%", "/")
        assert key == call.peer.key(DOMAIN, f"{NODE}/{name}", full)
        assert token[12:] == ["::,10:,:,:,,"]
        named.append(f"{NODE}/{name}")
    topics = [
        ("MP", "/diagnostics"),
        ("MS", f"{NODE}/body_wrench"),
        ("MP", f"{NODE}/tendons"),
        ("MP", f"{NODE}/hand_wrenches"),
        ("MP", f"{NODE}/plan_markers"),
        ("MS", f"{NODE}/rock"),
        ("MP", f"{NODE}/climb_joints"),
        ("MP", f"{NODE}/climb_tendons"),
        ("MS", f"{NODE}/slips"),
    ]
    of_action = [
        *(
            ("SS", f"{NODE}/climb/_action/{name}")
            for name in ("send_goal", "cancel_goal", "get_result")
        ),
        *(("MP", f"{NODE}/climb/_action/{name}") for name in ("feedback", "status")),
    ]
    assert {*ends} == {*topics, *of_action}
    latched = {name for (_, name), token in ends.items() if token[12:] == [":1:,1:,:,:,,"]}
    assert latched == {f"{NODE}/plan_markers", f"{NODE}/climb/_action/status"}
    names = [*named, f"{NODE}/climb", *(name for _, name in topics)]
    assert service.ready["ros2"] == names


def test_health_is_among_the_diagnostics(diagnostics: queue.Queue) -> None:
    state = state_with(diagnostics, 0, level=0)
    assert state["name"] == "crux/robosimian: service"
    values = values_of(state)
    assert values["processes: streams, idle"] == "1"
    assert int(values["replied"]) >= 0


def test_a_plan_is_the_one_in_process_and_wrenches_are_of_the_world_on_the_robot(
    call: Caller,
) -> None:
    request = wall_request()
    answer = call("plan", "Plan", request=msgspec.json.encode(request).decode())
    expected = answer_plan(plan_request(request))
    assert answer["error"] == NO_ERROR
    assert (answer["status"], answer["verified"]) == ("optimal", True)
    assert answer["utilisation"] == pytest.approx(expected.utilisation, rel=1e-9)
    # not asked for
    assert math.isnan(answer["load_factor"])
    points = answer["set_points"]
    assert points["name"] == [f"{h.limb}/{f}" for h in expected.hands for f in FINGERS]
    planned = [finger for hand in expected.hands for finger in hand.fingers]
    tensions, angles = zip(*((f.tendon_tension, f.winch_angle) for f in planned), strict=True)
    assert points["effort"] == pytest.approx(tensions, rel=1e-6)
    assert points["position"] == pytest.approx(angles, rel=1e-6)
    assert points["velocity"] == []
    for got, hand in zip(answer["wrenches"], expected.hands, strict=True):
        assert got["header"]["frame_id"] == f"{hand.limb}/H"
        given = [got["wrench"][part][axis] for part in ("force", "torque") for axis in "xyz"]
        assert given == pytest.approx([-entry for entry in hand.wrench], abs=1e-6)
    document = msgspec.json.decode(answer["reply"])
    assert not departures("PlanReply", document)
    assert msgspec.convert(document, PlanReply).id == "wall"


def test_a_plan_that_does_not_hold_says_so(call: Caller) -> None:
    request = wall_request(HEAVY) | {"explain": False, "detail": "set_points"}
    answer = call("plan", "Plan", request=msgspec.json.encode(request).decode())
    assert answer["error"] == NO_ERROR
    assert answer["status"] == "overloaded"
    assert answer["utilisation"] > 1.0
    assert len(answer["set_points"]["effort"]) == 16
    # set-points have none
    assert answer["wrenches"] == []


def test_errors_are_fields_of_the_response(call: Caller) -> None:
    answer = call("plan", "Plan", request="{")
    assert answer["error"]["kind"] == "malformed"
    assert answer["set_points"]["name"] == []
    assert math.isnan(answer["utilisation"])
    assert (answer["status"], answer["verified"], answer["reply"]) == ("", False, "")

    wrong = wall_request()
    wrong["stance"]["hands"][1]["limb"] = 5
    answer = call("plan", "Plan", request=msgspec.json.encode(wrong).decode())
    assert answer["error"]["kind"] == "invalid"
    assert answer["error"]["field"] == "stance.hands[1].limb"

    zero = as_wrench([0.0] * 6)
    answer = call("set_points", "SetPoints", stream="none", body_wrench=zero, lost=[], deadline=0.0)
    assert (answer["error"]["kind"], answer["error"]["field"]) == ("invalid", "stream")
    answer = call("set_points", "SetPoints", stream="x", body_wrench=zero, lost=[], deadline=-1.0)
    assert (answer["error"]["kind"], answer["error"]["field"]) == ("invalid", "deadline")
    # more bytes than a request for set-points may have
    answer = call(
        "set_points", "SetPoints", stream="x" * 5000, body_wrench=zero, lost=[], deadline=0.0
    )
    assert answer["error"]["kind"] == "limit"


def test_bytes_of_another_type_get_an_error_and_calls_without_attachment_nothing(
    call: Caller,
) -> None:
    name, kind = f"{NODE}/plan", "crux_msgs/srv/Plan"
    answer = call.peer.call_with(call.session, DOMAIN, name, kind, b"\x00\x01\x00\x00\xff")
    assert answer["error"]["kind"] == "malformed"
    assert "crux_msgs/srv/Plan_Request" in answer["error"]["message"]
    key = call.peer.key(DOMAIN, name, kind)
    assert list(call.session.get(key, payload=b"\x00\x01\x00\x00", timeout=PATIENCE)) == []
    # another domain is another key
    other = call.peer.key(DOMAIN + 1, name, kind)
    assert list(call.session.get(other, payload=b"", timeout=PATIENCE)) == []


def test_a_wrench_space_has_the_vertices_that_its_reply_has(call: Caller) -> None:
    stance = wall_request()["stance"]
    asked = {"v": 1, "stance": stance, "limb": "front_left", "want": ["vertices"]}
    answer = call("wrench_space", "WrenchSpace", request=msgspec.json.encode(asked).decode())
    assert answer["error"] == NO_ERROR
    reply = msgspec.json.decode(answer["reply"], type=WrenchSpaceReply)
    assert len(reply.vertices) > 20
    assert answer["vertices"] == [as_wrench(each) for each in reply.vertices]


def test_a_stream_gives_set_points_also_without_a_tile(call: Caller) -> None:
    answer = call("stream", "Stream", request=msgspec.json.encode(stream_request()).decode())
    assert answer["error"] == NO_ERROR
    assert answer["status"] == "optimal"
    first = msgspec.json.decode(answer["reply"])["body_wrench"]
    asked = {"stream": answer["stream"], "body_wrench": as_wrench(first), "deadline": 5.0}
    whole = call("set_points", "SetPoints", lost=[], **asked)
    assert (whole["error"], whole["status"], whole["verified"]) == (NO_ERROR, "optimal", True)
    assert whole["utilisation"] == pytest.approx(answer["utilisation"], abs=whole["gap"] + 1e-6)
    assert len(whole["set_points"]["effort"]) == 16
    tile = {"limb": "front_left", "finger": "outer_left", "phalanx": "distal"}
    without = call("set_points", "SetPoints", lost=[tile], **asked)
    assert msgspec.json.decode(without["reply"])["lost"] == [tile]
    assert without["verified"]
    assert without["set_points"]["effort"] != whole["set_points"]["effort"]


def test_a_plan_is_drawn_for_those_who_subscribe_later(call: Caller) -> None:
    call("plan", "Plan", request=msgspec.json.encode(wall_request()).decode())
    kind, got = "visualization_msgs/msg/MarkerArray", queue.Queue()
    late = zenoh.ext.declare_advanced_subscriber(
        call.session,
        call.peer.key(DOMAIN, f"{NODE}/plan_markers", kind),
        lambda sample: got.put(call.peer.decode(kind, sample.payload.to_bytes())),
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
    )
    names = {(mark["ns"], mark["id"]) for mark in got.get(timeout=PATIENCE)["markers"]}
    assert {("plan", 0), ("front_left/palm", 0), ("rear_right/hand_force", 0)} <= names
    late.undeclare()


def test_a_request_refers_to_the_rock_of_a_cloud(call: Caller, diagnostics: queue.Queue) -> None:
    request = wall_request()
    for each in request["stance"]["hands"]:
        each["hold"] = {"shape": "rock", "rock": "scan"}
        each["grasp"] = {"outer_rotation": 0.0}
    asked = msgspec.json.encode(request).decode()
    answer = call("plan", "Plan", request=asked)
    assert answer["error"]["kind"] == "invalid"
    state = state_with(diagnostics, 2, level=0)
    assert (state["name"], state["message"]) == ("crux/robosimian: rock", "no cloud came yet")
    poses = [pose_of(each["pose"]) for each in request["stance"]["hands"]]
    across, up = poses[0].rotation[:, 0], poses[0].rotation[:, 1]
    steps = np.arange(-0.15, 0.15, 0.004)
    grid = np.array([(a, b) for a in steps for b in steps])
    places = [pose.position + grid @ np.array([across, up]) for pose in poses]
    in_body = pose_of(request["stance"]["body"]).inverse()
    points = np.array([in_body.apply(point) for point in np.concatenate(places)])
    name, kind = f"{NODE}/rock", "sensor_msgs/msg/PointCloud2"
    key, message = call.peer.key(DOMAIN, name, kind), cloud(points, "B")
    call.session.put(
        key, call.peer.encode(kind, message), attachment=bytes(16) + b"\x10" + bytes(16)
    )

    def made() -> bool:
        state = state_with(diagnostics, 2, level=0)
        return "name" in values_of(state)

    assert soon(made)
    answer = call("plan", "Plan", request=asked)
    assert answer["error"] == NO_ERROR
    hands = msgspec.json.decode(answer["reply"])["hands"]
    contacts = [tile["contact"] for tile in hands[0]["fingers"][0]["tiles"]]
    assert contacts != ["none"] * len(contacts)


def test_a_stream_that_was_lost_is_declared_again(
    call: Caller, service: Served, diagnostics: queue.Queue
) -> None:
    answer = call("stream", "Stream", request=msgspec.json.encode(stream_request()).decode())
    first = msgspec.json.decode(answer["reply"])["body_wrench"]
    assert values_of(state_with(diagnostics, 1, level=0))["stream"] == answer["stream"]
    (reply,) = call.session.get("crux/robosimian/health", timeout=PATIENCE)
    health = msgspec.json.decode(reply.ok.payload.to_bytes(), type=HealthReply)
    (keeper,) = [each.pid for each in health.processes if each.purpose == "streams"]
    os.kill(keeper, signal.SIGKILL)
    subscriber, got = call.subscribe(f"{NODE}/tendons", "sensor_msgs/msg/JointState")
    stamp = itertools.count(1_700_000_000_000_000_000)

    def has_set_points() -> bool:
        call.publish(first, next(stamp))
        return not got.empty()

    def has_another_stream() -> bool:
        # a state of before may be on its way
        return values_of(state_with(diagnostics, 1, level=0))["stream"] != answer["stream"]

    assert soon(has_set_points)
    assert soon(has_another_stream)
    subscriber.undeclare()


@pytest.fixture(scope="module")
def diagnostics(call: Caller) -> Iterator[queue.Queue]:
    subscriber, got = call.subscribe("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    yield got
    subscriber.undeclare()


def state_with(got: queue.Queue, which: int, level: int) -> dict[str, Any]:
    """The next state of a level; of the service (0) or of the stream (1)."""
    while not got.empty():
        got.get()
    while (state := got.get(timeout=PATIENCE)["status"][which])["level"] != level:
        continue
    return state


def values_of(state: dict[str, Any]) -> dict[str, str]:
    return {each["key"]: each["value"] for each in state["values"]}


def test_published_wrenches_get_set_points_with_their_stamp(
    call: Caller, diagnostics: queue.Queue
) -> None:
    answer = call("stream", "Stream", request=msgspec.json.encode(stream_request()).decode())
    first = msgspec.json.decode(answer["reply"])["body_wrench"]
    subscriber, got = call.subscribe(f"{NODE}/tendons", "sensor_msgs/msg/JointState")
    wrenches, exerted = call.subscribe(f"{NODE}/hand_wrenches", "geometry_msgs/msg/WrenchStamped")
    stamp = 1_700_000_000_123_456_789

    def sees_set_points() -> bool:
        call.publish(first, stamp)
        return not got.empty() and exerted.qsize() >= 8

    # a subscription takes its time to reach the service
    assert soon(sees_set_points)
    points = got.get()
    assert points["header"]["stamp"] == {"sec": 1_700_000_000, "nanosec": 123_456_789}
    asked = {"stream": answer["stream"], "body_wrench": as_wrench(first), "deadline": 0.0}
    called = call("set_points", "SetPoints", lost=[], **asked)["set_points"]
    for part in ("name", "effort", "position"):
        assert points[part] == called[part]
    # what the world exerts on the robot balances the body: the body wrench is the sum of it
    by_hand = {one["header"]["frame_id"]: one for one in [exerted.get() for _ in range(4)]}
    assert all(one["header"]["stamp"] == points["header"]["stamp"] for one in by_hand.values())
    total = np.zeros(6)
    stance = wall_request()["stance"]
    body = pose_of(stance["body"])
    for hand in stance["hands"]:
        turned, wrench = body.inverse() @ pose_of(hand["pose"]), by_hand[f"{hand['limb']}/H"]
        force, moment = (
            turned.rotation @ [wrench["wrench"][part][axis] for axis in "xyz"]
            for part in ("force", "torque")
        )
        total += np.concatenate([force, moment + np.cross(turned.position, force)])
    assert total == pytest.approx(first, abs=1e-3)

    # set-points that another session makes up are not the service's
    made_up = msgspec.json.decode(call("set_points", "SetPoints", lost=[], **asked)["reply"])
    forged = {"v": 1, "stream": answer["stream"], "number": 5, "time": 0.0, "age": 0.0}
    forged |= {"skipped": 0, "set_points": made_up}
    assert not departures("PublishedReply", forged)
    key = f"crux/robosimian/stream/{answer['stream']}/set_points"
    call.session.put(key, msgspec.json.encode(forged), encoding=JSON)

    values = values_of(state_with(diagnostics, 1, level=0))
    assert values["stream"] == answer["stream"]
    assert int(values["set-points published"]) > 0
    assert float(values["utilisation"]) == pytest.approx(answer["utilisation"], abs=1e-3)

    # an overloaded plan has tensions, but a message without a status must not have them
    call.publish([10.0 * entry for entry in first], stamp + 1)
    state = state_with(diagnostics, 1, level=1)
    assert float(values_of(state)["utilisation"]) > 1.0
    # further ones of the first stamp may have come late
    assert all(one["header"]["stamp"] == points["header"]["stamp"] for one in [*got.queue])

    # in kN, as it seems
    call.publish([1e-3 * entry for entry in first], stamp + 2)
    assert soon(lambda: "in kN" in state_with(diagnostics, 1, level=1)["message"])

    call.publish([math.nan, *first[1:]], stamp + 3)
    assert state_with(diagnostics, 1, level=2)["message"].startswith("invalid: body_wrench[0]")
    call.publish(first, stamp + 4, frame="torso")
    assert soon(
        lambda: "frame_id 'torso'; valid: 'B'" in state_with(diagnostics, 1, level=2)["message"]
    )
    subscriber.undeclare()
    wrenches.undeclare()


def test_a_node_that_closes_is_gone(router: str, call: Caller) -> None:
    before = call.tokens()
    with open_session(client_config(router)) as session:
        node = RosNode(session, "other", DOMAIN)
        node.open(lambda *_: None, lambda: pytest.fail("too early"), lambda *_, **__: 0)
        assert soon(lambda: len(call.tokens()) == 2 * len(before))
        node.close()
        assert soon(lambda: sorted(call.tokens()) == sorted(before))


def test_a_domain_without_ros_is_bad_input(capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["serve", "--domain", "3"]) == BAD_INPUT
    assert complaint(capfd).startswith("crux: --domain: has no meaning without --ros2; give both")
