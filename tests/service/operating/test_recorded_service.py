"""A real service that is recorded, watched and killed; then its recording is replayed."""

from __future__ import annotations

import json
import re
import signal
import socket
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.stream_reader import StreamReader

from service import CruxClient, ServiceError
from service.commands.cli import run_command_line
from service.recording import Recording
from service.requests import SetPointsRequest, StreamRequest, WrenchSpaceRequest
from service.ros2.definitions import package_folder
from service.wire import Format
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import DONE, OVERLOADED, process
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import plan_request, wall_request
from tests.suite.helpers.ros_peer import RosPeer
from tests.suite.helpers.served import Served, client_config, free_endpoint

pytestmark = pytest.mark.slow

WRENCH = (480.0, 0.0, 0.0, 0.0, 0.0, 0.0)
LAYOUT = ROOT / "examples" / "service" / "foxglove-layout.json"


class Watched(Served):
    """A service under a supervisor, which records."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "a.mcap"
        self.supervisor = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.supervisor.bind(str(folder / "notify"))
        self.supervisor.settimeout(PATIENCE)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("NOTIFY_SOCKET", str(folder / "notify"))
            patch.setenv("WATCHDOG_USEC", "400000")
            more = ("--workers", "1", "--ros2", "--domain", "8", "--record", str(self.file))
            super().__init__(free_endpoint(), *more)

    def flags(self) -> list[str]:
        return ["-m", "client", "-e", self.endpoint, "--no-multicast-scouting"]

    def top(self) -> dict[str, Any]:
        return json.loads(process("top", *self.flags(), "--once", "--json").stdout)


@pytest.fixture(scope="module")
def service(tmp_path_factory) -> Iterator[Watched]:
    watched = Watched(tmp_path_factory.mktemp("recorded"))
    with CruxClient(client_config(watched.endpoint), timeout=PATIENCE) as client:
        client.plan(plan_request())
    yield watched
    watched.process.kill()
    watched.process.communicate()


@pytest.fixture(scope="module")
def killed(service) -> dict[str, list[Any]]:
    """Messages by topic that a killed service leaves, all of which it had flushed."""
    peer = RosPeer(package_folder())
    with CruxClient(client_config(service.endpoint), timeout=PATIENCE) as client:
        stance = plan_request().stance
        client.plan(plan_request())
        with pytest.raises(ServiceError):
            client.plan(plan_request(wall_request() | {"body_wrench": [1e5] * 6, "load": {}}))
        client.form = Format.JSON
        client.wrench_space(WrenchSpaceRequest(v=1, stance=stance, limb="front_left"))
        stream = client.stream(StreamRequest(v=1, stance=stance)).stream
        for step in range(10):
            wrench = (WRENCH[0] + 5.0 * step, *WRENCH[1:])
            client.set_points(SetPointsRequest(v=1, stream=stream, body_wrench=wrench))
        with client.publish_stream(StreamRequest(v=1, stance=stance)) as published:
            for step in range(10):
                published.publish((WRENCH[0] - step, *WRENCH[1:]))
                published.receive(PATIENCE)
        kind = "geometry_msgs/msg/WrenchStamped"
        header = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "B"}
        parts = ({"x": 1.0, "y": 2.0, "z": 3.0}, {"x": 0.0, "y": 0.0, "z": 4.0})
        message = {"header": header, "wrench": dict(zip(("force", "torque"), parts, strict=True))}
        key = peer.key(8, "/crux/robosimian/body_wrench", kind)
        client._session.put(key, peer.encode(kind, message))
        wanted = {"/crux/robosimian/body_wrench", "/diagnostics"}
        assert soon(lambda: wanted <= messages(service.file).keys())
        assert soon(lambda: len(list(Recording(service.file).questions())) == 26)
    service.process.send_signal(signal.SIGKILL)
    service.process.communicate()
    return messages(service.file)


def messages(path: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = defaultdict(list)
    topics = {}
    try:
        with path.open("rb") as stream:
            for record in StreamReader(stream).records:
                if type(record).__name__ == "Channel":
                    topics[record.id] = record
                elif type(record).__name__ == "Message":
                    channel = topics[record.channel_id]
                    coded = channel.message_encoding == "json"
                    found[channel.topic].append(
                        msgspec.json.decode(record.data) if coded else record.data
                    )
    except Exception:
        # cut off
        return found
    return found


def test_the_supervisor_is_told_and_its_watchdog_fed(service):
    assert b"READY=1" in service.supervisor.recv(1000).split(b"\n")
    assert [service.supervisor.recv(1000) for _ in range(2)] == [b"WATCHDOG=1"] * 2


def test_top_shows_what_the_service_does(service):
    with CruxClient(client_config(service.endpoint), timeout=PATIENCE):
        # this client, and the one that looks; those of before are seen to go a moment later
        assert soon(lambda: service.top()["health"]["clients"] == 2)
        found = service.top()
    assert found["questions"]["plan"]["number"] == 1
    low, high = found["questions"]["plan"]["worked"]
    assert 0.0 < low <= high
    assert found["health"]["recording"]["file"] == str(service.file)
    out = process("top", *service.flags(), "--once").stdout.decode()
    assert re.search(r"^ plan +\d+\.\d +1 +0 ", out, re.M), out
    assert max(map(len, out.splitlines())) <= 80
    assert f"recording  {service.file}"[:40] in out


def test_top_prints_each_look_where_there_is_no_terminal(service):
    command = [sys.executable, "-m", "service", "top", *service.flags(), "--interval", "0.1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as top:
        heads = []
        for line in top.stdout:
            heads += [line] if line.startswith("service ") else []
            if len(heads) == 3:
                break
        top.send_signal(signal.SIGTERM)
        top.communicate(timeout=PATIENCE)
    assert all("version" in head for head in heads)


def test_a_killed_service_leaves_all_that_it_has_flushed(killed):
    topics = {topic.removeprefix("/crux/robosimian/"): len(each) for topic, each in killed.items()}
    assert topics | {"/diagnostics": 1, "body_wrench": 1} == {
        **{"plan/PlanRequest": 3, "plan/PlanReply": 2, "plan/ErrorReply": 1},
        **{"wrench_space/WrenchSpaceRequest": 1, "wrench_space/WrenchSpaceReply": 1},
        **{"stream/StreamRequest": 2, "stream/StreamReply": 2},
        **{"set_points/SetPointsRequest": 10, "set_points/SetPointsReply": 10},
        **{"stream/WrenchRequest": 10, "stream/PublishedReply": 10},
        **{"questions/QuestionRecord": 26, "/diagnostics": 1, "body_wrench": 1},
    }


def test_messages_of_ros_are_as_they_were_sent(killed):
    peer = RosPeer(package_folder())
    (sent,) = killed["/crux/robosimian/body_wrench"]
    wrench = peer.decode("geometry_msgs/msg/WrenchStamped", sent)["wrench"]
    assert wrench["force"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    state = peer.decode("diagnostic_msgs/msg/DiagnosticArray", killed["/diagnostics"][0])
    assert state["status"][0]["name"] == "crux/robosimian: service"


def paths_in(panel: dict[str, Any]) -> list[str]:
    return [path["value"] for path in panel.get("paths", [])] + [
        panel[name] for name in ("topicPath",) if name in panel
    ]


def test_the_layout_shows_what_is_recorded(killed):
    layout = json.loads(LAYOUT.read_text("utf-8"))
    paths = [path for panel in layout["configById"].values() for path in paths_in(panel)]
    assert len(paths) > 15
    for path in paths:
        topic, *fields = re.split(r"\.|\[(?=\d)", path)
        values = []
        for found in killed[topic]:
            for field in fields:
                found = found[int(field[:-1])] if field.endswith("]") else found[field]
            values.append(found)
        assert values, path
        assert all(value is not None for value in values), path
    placed = re.findall(r'"(?:first|second)": "([^"]+)"', json.dumps(layout["layout"]))
    assert sorted(placed) == sorted(layout["configById"])


def test_a_replay_is_equal_and_says_what_has_moved(killed, service, tmp_path, capfd):
    assert run_command_line(["replay", str(service.file), "--json", "-q"]) == DONE
    out, err = capfd.readouterr()
    assert "was cut off" in err
    found = json.loads(out)
    assert (found["whole"], found["moved"], found["left_out"]) == (False, 0, 0)
    assert found["equal"] + found["within_gap"] == 26
    # of the set-points, those that are interpolated by when a thread was ready
    assert found["within_gap"] <= 20
    hand = tmp_path / "hand.toml"
    hand.write_text("[motor]\nmaximum_torque = 0.02\n")
    arguments = ["replay", str(service.file), "--hand", str(hand)]
    assert run_command_line(arguments) == OVERLOADED
    out, _ = capfd.readouterr()
    assert "Fields that have moved most" in out
    assert "PlanReply" in out
    assert max(map(len, out.splitlines())) <= 80


def test_a_service_that_ends_says_so_and_leaves_a_whole_file(tmp_path):
    service = Watched(tmp_path)
    with CruxClient(client_config(service.endpoint), timeout=PATIENCE) as client:
        client.plan(plan_request())
    _, err = service.stop(signal.SIGTERM)
    assert service.process.returncode == 0, err
    recording = Recording(service.file)
    assert len(list(recording.questions())) == 1
    assert recording.whole
    told = []
    while not told or told[-1] != b"STOPPING=1":
        told.append(service.supervisor.recv(1000))
