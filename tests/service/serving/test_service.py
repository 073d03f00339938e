"""The service on zenoh: real sessions over TCP loopback, real ``crux serve`` processes."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import random
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
import zenoh

from hand_models.base import InvalidInputError
from planner.robots import RobotFile
from service import BodySpaceRequest, CruxClient, DiagnosisRequest, WrenchSpaceRequest
from service.answering import dispatch
from service.replies import ErrorReply, PlanReply
from service.serving import PlanService, closed, exposed, listening, open_session, zenoh_config
from service.wire import (
    Answer,
    Format,
    NoServiceError,
    ServiceError,
    ServiceTimeout,
    server_key,
    service_key,
)
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.replies import check_answer
from tests.suite.helpers.requests import (
    HEAVY,
    JSON,
    MSGPACK,
    flat_request,
    full_request,
    plan_request,
    request_with_joints,
    spoil,
    wall_request,
)
from tests.suite.helpers.served import Served, client_config, free_endpoint, lonely_config

PLAN = service_key("robosimian", "plan")
WRENCH_SPACE = service_key("robosimian", "wrench_space")
BODY_SPACE = service_key("robosimian", "body_space")
STREAM = service_key("robosimian", "stream")
SET_POINTS = service_key("robosimian", "set_points")
DIAGNOSIS = service_key("robosimian", "diagnosis")
ROUTE = service_key("robosimian", "route")
CLIMB = service_key("robosimian", "climb")
CANCEL = service_key("robosimian", "cancel")
KEYS = [PLAN, WRENCH_SPACE, BODY_SPACE, DIAGNOSIS, ROUTE, CLIMB, STREAM, SET_POINTS, CANCEL]


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    server = Served(free_endpoint(), "--workers", "1")
    yield server
    server.stop(signal.SIGTERM)
    assert server.process.returncode == 0


@pytest.fixture
def session(served: Served) -> Iterator[zenoh.Session]:
    with zenoh.open(client_config(served.endpoint)) as opened:
        yield opened


def ask(
    session: zenoh.Session, payload: bytes | None, encoding: str | None = None, key: str = PLAN
) -> list[Answer]:
    """Every reply to a raw query."""
    answers = []
    for reply in session.get(key, payload=payload, encoding=encoding, timeout=PATIENCE):
        part = reply.ok or reply.err
        answers.append(Answer(part.payload.to_bytes(), str(part.encoding), reply.ok is not None))
        if reply.ok is not None:
            assert str(reply.ok.key_expr) in KEYS
    return answers


# Queries ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("encoding", "replied"),
    [
        (None, JSON),
        (JSON, JSON),
        ("text/json", JSON),
        (MSGPACK, MSGPACK),
        ("application/msgpack;crux.PlanRequest@1", MSGPACK),
    ],
)
def test_a_reply_comes_in_the_encoding_of_the_request(
    session: zenoh.Session, encoding: str | None, replied: str
) -> None:
    form = Format.named(encoding or "")
    (answer,) = ask(session, form.encode(plan_request()), encoding)
    assert answer.good
    assert answer.encoding == f"{replied};crux.PlanReply@1"
    assert form.decode(answer.payload, PlanReply).status == "optimal"


@pytest.mark.parametrize("form", Format)
def test_an_error_comes_in_the_encoding_of_the_request(
    session: zenoh.Session, form: Format
) -> None:
    (answer,) = ask(session, form.encode(plan_request())[:-1], form.value)
    assert not answer.good
    assert answer.encoding == f"{form.value};crux.ErrorReply@1"
    assert form.decode(answer.payload, ErrorReply).error.kind == "malformed"


@pytest.mark.parametrize("key", [PLAN, ROUTE, SET_POINTS, CANCEL])
def test_an_encoding_that_no_request_has_is_refused_at_every_key(
    session: zenoh.Session, key: str
) -> None:
    (answer,) = ask(session, b'{"v": 1, "id": "x"}', "image/png", key)
    assert not answer.good
    assert msgspec.json.decode(answer.payload, type=ErrorReply).error.kind == "malformed"


def test_a_query_without_payload_is_an_error(session: zenoh.Session) -> None:
    (answer,) = ask(session, None)
    assert not answer.good


def test_a_wildcard_finds_the_robots_that_plan(session: zenoh.Session) -> None:
    (answer,) = ask(session, msgspec.json.encode(wall_request()), JSON, key="crux/*/plan")
    assert answer.good


def test_the_service_is_alive_while_it_serves(session: zenoh.Session) -> None:
    told = session.liveliness().get("crux/**", timeout=PATIENCE)
    shared, own = sorted(str(reply.ok.key_expr) for reply in told)
    assert shared == service_key("robosimian", "alive")
    # one of several services has a token of its own
    assert own.startswith(server_key("robosimian", ""))
    assert own.count("/") == 3


def test_fuzz_over_the_network(session: zenoh.Session) -> None:
    chance = random.Random(7)
    for i in range(40):
        asked = (full_request, flat_request, request_with_joints, flat_request)[i % 4]
        payload, encoding = spoil(asked(), chance)
        (answer,) = ask(session, payload, encoding)
        check_answer(answer, payload[:500])
    (answer,) = ask(session, msgspec.json.encode(wall_request()), JSON)
    assert answer.good


# The client ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", Format)
def test_the_client_gets_typed_replies(served: Served, form: Format) -> None:
    config = client_config(served.endpoint)
    with CruxClient(config, form=form, timeout=PATIENCE) as client:
        reply = client.plan(plan_request())
        assert (reply.id, reply.status) == ("wall", "optimal")
        assert client.plan(plan_request(wall_request(HEAVY))).status == "overloaded"
        stance = plan_request(flat_request()).stance
        space = client.wrench_space(WrenchSpaceRequest(v=1, stance=stance, limb="front_left"))
        assert space.limb == "front_left"
        assert space.vertices
        tensions = {"front_left": (50.0, 50.0, 50.0, 50.0)}
        found = client.diagnosis(DiagnosisRequest(v=1, stance=stance, tensions=tensions))
        assert {tile.limb for tile in found.tiles} == {"front_left"}
        body = client.body_space(BodySpaceRequest(v=1, stance=stance, axes=["fx", "my"]))
        assert body.section.axes == ["fx", "my"]
        assert body.section.inner


def test_the_client_raises_what_the_service_says(session: zenoh.Session) -> None:
    client = CruxClient(session, timeout=PATIENCE)
    request = msgspec.structs.replace(plan_request(), confidence=0.99)
    with pytest.raises(ServiceError, match="confidence: not supported") as caught:
        client.plan(request)
    assert (caught.value.kind, caught.value.field) == ("unsupported", "confidence")
    stance = plan_request(flat_request()).stance
    with pytest.raises(ServiceError, match="no hand 'nose'") as caught:
        client.wrench_space(WrenchSpaceRequest(v=1, stance=stance, limb="nose"))
    assert (caught.value.kind, caught.value.field) == ("invalid", "limb")
    client.close()
    assert not session.is_closed()


def test_the_client_asks_for_the_service_s_health(session: zenoh.Session) -> None:
    with CruxClient(session, timeout=PATIENCE) as client:
        before = client.health()
        client.plan(plan_request())
        after = client.health()
    assert (after.robot, after.replied - before.replied) == ("robosimian", 1)
    assert {"questions", "streams"} <= {each.purpose for each in after.processes}
    with pytest.raises(NoServiceError, match="no service answers at crux/loris/health"):
        CruxClient(session, "loris").health()


def test_nobody_there() -> None:
    with pytest.raises(NoServiceError, match="no zenoh session"):
        CruxClient(client_config(free_endpoint()))
    with (
        CruxClient(lonely_config(), timeout=PATIENCE) as client,
        pytest.raises(NoServiceError, match="no service answers at"),
    ):
        client.plan(plan_request())


def test_a_robot_that_nobody_plans_for(session: zenoh.Session) -> None:
    with pytest.raises(NoServiceError, match="crux/loris/plan"):
        CruxClient(session, "loris", timeout=PATIENCE).plan(plan_request())


def test_a_service_that_does_not_answer_in_time(alone: zenoh.Session) -> None:
    held: queue.SimpleQueue[zenoh.Query] = queue.SimpleQueue()
    with alone.declare_queryable(PLAN, held.put):
        with pytest.raises(ServiceTimeout, match=r"no answer at crux/robosimian/plan within 0.3 s"):
            CruxClient(alone, timeout=0.3).plan(plan_request())
        held.get().drop()


def test_an_empty_answer_is_asked_for_once_more(alone: zenoh.Session) -> None:
    asked = []
    good = wire_reply()

    def second_time(query: zenoh.Query) -> None:
        with query:
            asked.append(query)
            if len(asked) == 2:
                query.reply(PLAN, good, encoding=JSON)

    with alone.declare_queryable(PLAN, second_time):
        assert CruxClient(alone, timeout=PATIENCE).plan(plan_request()).status == "optimal"
    asked.clear()
    with (
        alone.declare_queryable(PLAN, lambda query: (asked.append(1), query.drop())),
        pytest.raises(NoServiceError),
    ):
        CruxClient(alone, timeout=PATIENCE).plan(plan_request())
    assert len(asked) == 2


def wire_reply() -> bytes:
    return dispatch.handle(PLAN, msgspec.json.encode(wall_request())).payload


@pytest.mark.parametrize("payload", [b"", b"\xff", b'{"v": 1}', b"[]"])
def test_a_reply_that_is_none(alone: zenoh.Session, payload: bytes) -> None:
    def nonsense(query: zenoh.Query) -> None:
        with query:
            query.reply(PLAN, payload, encoding=JSON)

    with (
        alone.declare_queryable(PLAN, nonsense),
        pytest.raises(ServiceError, match="the reply is not a PlanReply"),
    ):
        CruxClient(alone, timeout=PATIENCE).plan(plan_request())


# Faults and floods --------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_service_that_ends_is_not_there_any_more(alone: zenoh.Session) -> None:
    client = CruxClient(alone, timeout=PATIENCE)
    with PlanService(alone, workers=1):
        assert client.plan(plan_request()).status == "optimal"
    with pytest.raises(NoServiceError):
        client.plan(plan_request())


FLOOD, FLOODS = 100, 4
"""Questions that a flood has at once, and floods."""


def test_floods_without_a_name_leave_a_client_its_turn(served: Served) -> None:
    payload = msgspec.json.encode(wall_request() | {"want": ["load_factor"]})
    replies: queue.SimpleQueue[zenoh.Reply] = queue.SimpleQueue()
    with contextlib.ExitStack() as sessions, CruxClient(client_config(served.endpoint)) as client:
        client.timeout = PATIENCE
        for _ in range(FLOODS):
            mine = sessions.enter_context(zenoh.open(client_config(served.endpoint)))
            for _ in range(FLOOD):
                mine.get(PLAN, replies.put, payload=payload, timeout=PATIENCE)
        assert all(client.plan(plan_request()).status == "optimal" for _ in range(10))
        told = [replies.get(timeout=PATIENCE) for _ in range(FLOODS * FLOOD)]
    refused = [Format.JSON.decode(r.err.payload.to_bytes(), ErrorReply) for r in told if r.err]
    # everybody has a reply, and who is refused knows when to come again
    assert {reply.error.kind for reply in refused} == {"busy"}
    assert all(reply.error.retry_after > 0.0 for reply in refused)
    assert len(refused) < len(told)


# Processes ----------------------------------------------------------------------------------------


def test_a_server_says_what_it_serves(served: Served) -> None:
    assert served.ready == {"v": 1, "keys": KEYS, "listen": [served.endpoint]}


@pytest.mark.slow  # `served` is stopped by a signal at all times
@pytest.mark.parametrize(
    ("number", "busy"), [(signal.SIGINT, True), (signal.SIGTERM, True), (signal.SIGINT, False)]
)
def test_a_signal_stops_the_server_cleanly(number: int, busy: bool) -> None:
    server = Served(free_endpoint(), "--workers", "1")
    payload = msgspec.json.encode(wall_request())
    with zenoh.open(client_config(server.endpoint)) as mine:
        channels = []
        if busy:
            ask(mine, payload, JSON)
            channels = [mine.get(PLAN, payload=payload, timeout=PATIENCE) for _ in range(20)]
        out, err = server.stop(number)
        replies = [reply for channel in channels for reply in channel]
    assert server.process.returncode == 0
    # who has no answer is told so, and does not wait until his time is over
    assert len(replies) == len(channels)
    refused = [Format.JSON.decode(r.err.payload.to_bytes(), ErrorReply) for r in replies if r.err]
    assert {reply.error.kind for reply in refused} <= {"busy", "lost"}
    assert out == ""
    assert err.splitlines() == [
        f"crux: listening on {server.endpoint}; the start of the workers takes some seconds",
        f"crux: ready; serving {', '.join(KEYS)}",
    ]


@pytest.mark.slow
def test_a_server_says_that_its_first_start_compiles(tmp_path: Path) -> None:
    """Where numba has kept nothing; this one is not waited for."""
    flags = ["-m", "peer", "-l", free_endpoint(), "--no-multicast-scouting"]
    server = subprocess.Popen(
        [sys.executable, "-m", "service", "serve", *flags],
        stderr=subprocess.PIPE,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path)},
        start_new_session=True,
    )
    try:
        said = server.stderr.readline().decode()
    finally:
        # with the process that compiles
        os.killpg(server.pid, signal.SIGKILL)
        server.communicate(timeout=PATIENCE)
    assert said.startswith("crux: listening on ")
    assert said.endswith("; the start of the workers compiles for minutes, once per installation\n")


@pytest.mark.slow
def test_a_second_server_of_one_robot_warns(served: Served) -> None:
    def said() -> list[str]:
        second = Served(free_endpoint(), "-e", served.endpoint, "--workers", "1")
        return second.stop(signal.SIGTERM)[1].splitlines()

    # the first's token may not have been heard of yet
    for _ in range(10):
        *warnings, _, serving = said()
        if warnings:
            break
    assert warnings == [
        "crux: another service of robosimian is linked to this one: a question to one makes all of "
        "them work, and CruxClient takes the first good answer; to share the work, make them "
        "clients of a router (-m client -e ENDPOINT); --no-multicast-scouting keeps them apart"
    ]
    assert serving.startswith("crux: ready; serving ")


@pytest.mark.slow
def test_a_rival_is_one_of_the_same_robot_and_while_it_serves() -> None:
    endpoint = free_endpoint()
    first = zenoh_config(listen=[endpoint], multicast=False)
    second = zenoh_config(connect=[endpoint], settings=["listen/endpoints:[]"], multicast=False)
    with open_session(first) as there, open_session(second) as here:
        service = PlanService(here)
        assert not service.rivals()
        with PlanService(there) as other:
            assert soon(service.rivals)
            # its own token is none of a rival
            assert not other.rivals()
            with service:
                # both are ready, and each sees the other
                assert soon(other.rivals)
                assert soon(service.rivals)
            assert not PlanService(here, RobotFile("lemur", toml="", urdf="")).rivals()
        assert soon(lambda: not service.rivals())


@pytest.mark.slow
def test_a_killed_server_is_noticed_and_its_successor_found() -> None:
    endpoint = free_endpoint()
    server = Served(endpoint, "--workers", "1")
    config = zenoh_config(mode="client", connect=[endpoint], multicast=False)
    with CruxClient(config, timeout=0.5 * PATIENCE) as client:
        assert client.plan(plan_request()).status == "optimal"
        answered, outcome = threading.Event(), []

        def ask_until_it_fails() -> None:
            try:
                while True:
                    client.plan(plan_request())
                    answered.set()
            except BaseException as error:
                outcome.append(error)

        asking = threading.Thread(target=ask_until_it_fails)
        asking.start()
        assert answered.wait(PATIENCE)
        server.stop(signal.SIGKILL)
        asking.join(PATIENCE)
        # not that its time is over
        assert isinstance(outcome[0], NoServiceError)
        successor = Served(endpoint, "--workers", "1")

        def found() -> bool:
            with contextlib.suppress(NoServiceError):
                return client.plan(plan_request()).status == "optimal"
            return False

        try:
            assert soon(found)
        finally:
            successor.stop(signal.SIGTERM)
    assert successor.process.returncode == 0


# Configuration ------------------------------------------------------------------------------------


def setting(config: zenoh.Config, key: str) -> object:
    return json.loads(config.get_json(key))


def test_flags_become_a_configuration(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{mode: "client", connect: {endpoints: ["tcp/127.0.0.1:1"]}}')
    config = zenoh_config(file=file)
    assert setting(config, "mode") == "client"
    assert setting(config, "connect/endpoints") == ["tcp/127.0.0.1:1"]
    config = zenoh_config(
        file=file,
        mode="router",
        listen=["tcp/127.0.0.1:2", "tcp/127.0.0.1:3"],
        settings=["namespace:'arm'"],
        multicast=False,
    )
    assert setting(config, "mode") == "router"
    assert listening(config) == ["tcp/127.0.0.1:2", "tcp/127.0.0.1:3"]
    assert setting(config, "scouting/multicast/enabled") is False
    assert setting(config, "transport/shared_memory/enabled") is False
    assert setting(config, "namespace") == "arm"


def test_the_environment_names_a_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{mode: "client"}')
    monkeypatch.setenv("ZENOH_CONFIG", str(file))
    assert setting(zenoh_config(), "mode") == "client"


@pytest.mark.parametrize(
    ("flags", "field"),
    [
        ({"settings": ["scuting/multicast/enabled:false"]}, "--cfg"),
        ({"settings": ["mode"]}, "--cfg"),
        ({"mode": "boss"}, "--mode"),
        ({"connect": ["127.0.0.1"]}, "--connect"),
        ({"file": Path("/nowhere.json5")}, "--config"),
    ],
)
def test_a_bad_flag_is_named(flags: dict, field: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        zenoh_config(**flags)
    assert caught.value.field == field
    assert ".rs:" not in caught.value.message


# Who can ask --------------------------------------------------------------------------------------


def test_without_endpoints_a_service_listens_on_this_machine_alone() -> None:
    config = zenoh_config()
    closed(config)
    (endpoint,) = listening(config)
    assert re.fullmatch(r"tcp/127\.0\.0\.1:[1-9]\d*", endpoint)
    assert setting(config, "scouting/multicast/interface") == "127.0.0.1"
    assert exposed(config) == []
    router = zenoh_config(mode="router")
    closed(router)
    assert listening(router) == ["tcp/127.0.0.1:7447"]
    client = zenoh_config(mode="client", connect=["tcp/127.0.0.1:1"])
    before = client.get_json("listen/endpoints")
    closed(client)
    assert client.get_json("listen/endpoints") == before


@pytest.mark.parametrize("way", ["flag", "setting", "file", "environment"])
def test_endpoints_that_are_named_are_kept(
    way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{listen: {endpoints: ["tcp/0.0.0.0:7555"]}}')
    if way == "environment":
        monkeypatch.setenv("ZENOH_CONFIG", str(file))
    config = {
        "flag": lambda: zenoh_config(listen=["tcp/0.0.0.0:7555"]),
        "setting": lambda: zenoh_config(settings=['listen/endpoints:["tcp/0.0.0.0:7555"]']),
        "file": lambda: zenoh_config(file=file),
        "environment": zenoh_config,
    }[way]()
    closed(config)
    assert listening(config) == exposed(config) == ["tcp/0.0.0.0:7555"]
    assert setting(config, "scouting/multicast/interface") is None


@pytest.mark.parametrize(
    ("endpoint", "open_to_others"),
    [
        ("tcp/127.0.0.1:7447", False),
        ("tcp/[::1]:7447", False),
        ("tcp/localhost:7447", False),
        ("tcp/127.0.0.1:7447#iface=lo", False),
        ("tcp/[::]:7447", True),
        ("tls/robot.example:7447", True),
    ],
)
def test_what_others_may_reach_is_known(endpoint: str, open_to_others: bool) -> None:
    config = zenoh_config(listen=[endpoint])
    assert exposed(config) == ([endpoint] if open_to_others else [])


def test_a_port_that_is_the_systems_to_choose_is_told() -> None:
    config = zenoh_config(listen=["tcp/127.0.0.1:0", "tcp/[::1]:0", "tcp/127.0.0.1:7447"])
    closed(config)
    first, second, third = listening(config)
    assert re.fullmatch(r"tcp/127\.0\.0\.1:[1-9]\d*", first)
    assert re.fullmatch(r"tcp/\[::1\]:[1-9]\d*", second)
    assert third == "tcp/127.0.0.1:7447"


@pytest.mark.slow
def test_a_server_that_others_can_reach_says_what_that_exposes() -> None:
    port = free_endpoint().rpartition(":")[2]
    server = Served(f"tcp/0.0.0.0:{port}", "--workers", "1")
    listens, ready, exposes = server.stop(signal.SIGTERM)[1].splitlines()
    assert listens.startswith(f"crux: listening on tcp/0.0.0.0:{port}; ")
    assert ready.startswith("crux: ready; serving ")
    assert exposes.startswith(f"crux: tcp/0.0.0.0:{port}: whoever reaches it can ask")


@pytest.mark.slow
def test_a_log_line_a_question() -> None:
    server = Served(free_endpoint(), "--workers", "1", "-v", "--log-format", "json")
    with CruxClient(client_config(server.endpoint), timeout=PATIENCE) as client:
        client.plan(plan_request())
        bad = msgspec.structs.replace(plan_request(), confidence=0.99, id="bad")
        with pytest.raises(ServiceError):
            client.plan(bad)
    _, _, *lines = server.stop(signal.SIGTERM)[1].splitlines()
    first, second = (json.loads(line) for line in lines)
    assert (first["id"], first["status"], first["key"]) == ("wall", "optimal", PLAN)
    assert first["client"] == second["client"]
    assert first["worked"] > 0.0 <= first["waited"]
    assert (second["id"], second["status"]) == ("bad", "unsupported")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="makes a pipe small")
def test_a_log_that_nobody_reads_keeps_nobody_waiting() -> None:
    import fcntl

    server = Served(free_endpoint(), "--workers", "1", "-v", "--log-format", "json")
    # room for some twenty lines
    fcntl.fcntl(server.process.stderr, fcntl.F_SETPIPE_SZ, 4096)
    with zenoh.open(client_config(server.endpoint)) as session:
        for _ in range(100):
            (reply,) = session.get(PLAN, payload=b"{", timeout=PATIENCE)
            assert json.loads(reply.err.payload.to_bytes())["error"]["kind"] == "malformed"
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(PATIENCE) == 0
    lines = server.process.stderr.read().splitlines()
    assert all(json.loads(line)["status"] == "malformed" for line in lines[2:-1])
    assert len(lines) < 100
