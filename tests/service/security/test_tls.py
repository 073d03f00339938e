"""Who may do what by the keys: real zenoh sessions over TLS on loopback."""

from __future__ import annotations

import threading
from contextlib import ExitStack
from pathlib import Path

import msgspec
import pytest
import zenoh

from service import CruxClient, SetPointsRequest
from service.commands.stances import read_request
from service.replies import HealthReply
from service.requests import StreamRequest
from service.security import KeyFolder, Role
from service.serving import PlanService, open_session, zenoh_config
from service.wire import NoServiceError, ServiceError, server_key, service_key
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import plan_request, stream_request
from tests.suite.helpers.searched import asked, progress, searching
from tests.suite.helpers.served import free_endpoint

ROBOT = "robosimian"
HEALTH = service_key(ROBOT, "health")
PLAN = service_key(ROBOT, "plan")
pytestmark = pytest.mark.slow


class Site:
    """A service by its keys, and clients by theirs; through a router by its own, or not."""

    def __init__(self, folder: Path, *, routed: bool) -> None:
        self._open = ExitStack()
        self.keys = folder / "keys"
        self.endpoint = free_endpoint().replace("tcp/", "tls/")
        port = int(self.endpoint.rpartition(":")[2])
        hosts = ("localhost", "127.0.0.1")
        made = KeyFolder.make(self.keys, ROBOT, hosts, port, 2, 0)
        made.add("relay", Role.ROUTER, hosts, 2)
        made.add("stage", Role.PLAYER, (), 2)
        config = zenoh_config(file=self.keys / "service.json5")
        if routed:
            relay = zenoh_config(file=self.keys / "relay.json5")
            self._open.enter_context(open_session(relay))
            own, there = self.keys / "service.json5", [self.endpoint]
            config = zenoh_config(file=own, mode="client", connect=there)
        session = self._open.enter_context(open_session(config))
        self.service = PlanService(session, workers=1, make=searching)
        self._open.enter_context(self.service)

    def close(self) -> None:
        self._open.close()

    def session(self, name: str) -> zenoh.Session:
        config = zenoh_config(file=self.keys / f"{name}.json5", connect=[self.endpoint])
        return self._open.enter_context(open_session(config))

    def client(self, name: str, **more: object) -> CruxClient:
        made = CruxClient(self.session(name), timeout=PATIENCE, **more)  # type: ignore[arg-type]
        return self._open.enter_context(made)


@pytest.fixture(scope="module", params=[False, True], ids=["direct", "routed"])
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    opened = Site(tmp_path_factory.mktemp("tls"), routed=request.param)
    yield opened
    opened.close()


def replies(session: zenoh.Session, key: str, payload: bytes = b"") -> list[zenoh.Reply]:
    return list(session.get(key, payload=payload, timeout=PATIENCE))


def test_the_planner_plans_streams_climbs_and_cancels(site: Site, tmp_path: Path) -> None:
    client = site.client("planner", wait=PATIENCE)
    assert client.plan(plan_request()).status == "optimal"
    declaration = msgspec.convert(stream_request(), StreamRequest)
    declared = client.stream(declaration)
    wrench = tuple(declared.body_wrench)
    points = client.set_points(SetPointsRequest(v=1, stream=declared.stream, body_wrench=wrench))
    assert (points.stream, points.verified) == (declared.stream, True)
    with client.publish_stream(declaration) as stream:
        number = stream.publish(wrench)
        found = stream.receive(PATIENCE)
        assert found is not None
        assert (found.number, found.error) == (number, None)
        assert found.server == site.service.server
    parts = []
    assert client.climb(asked(parts=3), parts.append).status == "none"
    assert [part.progress for part in parts] == [progress(i) for i in range(3)]
    failed: list[ServiceError] = []

    def climb() -> None:
        try:
            # nothing makes the file
            client.climb(msgspec.structs.replace(asked(until=str(tmp_path / "x")), id="mine"))
        except ServiceError as error:
            failed.append(error)

    thread = threading.Thread(target=climb)
    thread.start()
    assert soon(lambda: client.cancel("mine"))
    thread.join()
    assert [error.kind for error in failed] == ["cancelled"]


def test_a_planner_s_name_is_proven_through_the_rights(site: Site) -> None:
    """Its secret is asked for, so that its turns are its own."""
    client = site.client("planner", wait=PATIENCE)
    name = str(client._session.info.zid())
    client.plan(plan_request())
    names = site.service._dispatcher._names
    assert soon(lambda: client.plan(plan_request()) and names.has_proof(name))


def test_the_observer_looks_and_nothing_else(site: Site) -> None:
    session = site.session("observer")
    assert soon(lambda: replies(session, HEALTH))
    for key in (HEALTH, server_key(ROBOT, site.service.server, "health")):
        (reply,) = replies(session, key)
        health = msgspec.json.decode(reply.ok.payload.to_bytes(), type=HealthReply)
        assert health.robot == ROBOT
    (metrics,) = replies(session, service_key(ROBOT, "metrics"))
    assert "crux_uptime_seconds" in metrics.ok.payload.to_string()
    alive = session.liveliness().get(service_key(ROBOT, "alive"), timeout=PATIENCE)
    assert [str(each.ok.key_expr) for each in alive] == [service_key(ROBOT, "alive")]
    payload = msgspec.json.encode(read_request("wall-300"))
    for key in (PLAN, server_key(ROBOT, site.service.server, "plan"), "crux/**", "crux/*/plan"):
        assert replies(session, key, payload) == []
    before = site.service._monitor._replied
    with pytest.raises(NoServiceError) as refused, CruxClient(session) as client:
        client.plan(plan_request())
    assert "is there, but does not answer at crux/robosimian/plan" in str(refused.value)
    assert "crux keys" in str(refused.value)
    assert site.service._monitor._replied == before


@pytest.mark.parametrize("name", ["planner", "observer"])
def test_what_zenoh_says_of_itself_is_closed(site: Site, name: str) -> None:
    session = site.session(name)
    assert soon(lambda: replies(session, HEALTH))
    zid = str(session.info.zid())
    own = [str(each.ok.key_expr) for each in replies(session, "@/**") if each.ok]
    # of its own session alone
    assert all(key.startswith(f"@/{zid}") for key in own)


def test_nobody_but_the_service_answers_or_plays(site: Site) -> None:
    """A planner's queryables and tokens are not passed on, nor what it publishes at other keys."""
    planner, observer = site.session("planner"), site.session("observer")
    key = service_key(ROBOT, "metrics")
    asked = threading.Event()

    def take(query: zenoh.Query) -> None:
        asked.set()
        query.drop()

    held = planner.declare_queryable(key, take, complete=True)
    token = planner.liveliness().declare_token(server_key(ROBOT, "false"))
    assert soon(lambda: replies(observer, HEALTH))
    for _ in range(5):
        assert len(replies(observer, key)) == 1
    tokens = observer.liveliness().get(server_key(ROBOT, "*"), timeout=PATIENCE)
    assert [str(each.ok.key_expr) for each in tokens] == [server_key(ROBOT, site.service.server)]
    assert not asked.is_set()
    held.undeclare()
    token.undeclare()


def test_only_a_player_plays(site: Site) -> None:
    got: list[bytes] = []
    controller, planner, stage = map(site.session, ("planner", "planner", "stage"))
    key = service_key(ROBOT, "play")
    controller.declare_subscriber(key, lambda sample: got.append(sample.payload.to_bytes()))

    def played() -> bool:
        planner.put(key, b"planner")
        stage.put(key, b"stage")
        return len(got) > 3

    assert soon(played)
    assert set(got) == {b"stage"}


def test_a_node_of_ros_is_in_its_domain_alone(site: Site) -> None:
    ros, planner = site.session("ros"), site.session("planner")
    assert soon(lambda: replies(planner, HEALTH))
    assert replies(ros, HEALTH) == []
    held = site.service._session.declare_queryable(
        "0/crux/robosimian/plan/t/h",
        lambda query: (query.reply(query.key_expr, b"x"), query.drop()),
    )
    assert soon(lambda: replies(ros, "0/crux/robosimian/plan/t/h"))
    assert replies(planner, "0/crux/robosimian/plan/t/h") == []
    held.undeclare()


def test_who_has_no_certificate_of_this_authority_is_refused(site: Site, tmp_path: Path) -> None:
    port = int(site.endpoint.rpartition(":")[2])
    KeyFolder.make(tmp_path / "other", ROBOT, ("localhost",), port, 2, None)
    text = (site.keys / "planner.json5").read_text().split("\n", 1)[1]
    without = msgspec.json.decode(text)
    tls = without["transport"]["link"]["tls"]
    for name in ("connect_certificate_base64", "connect_private_key_base64"):
        del tls[name]
    tls["enable_mtls"] = False
    (tmp_path / "without.json5").write_bytes(msgspec.json.encode(without))
    # an authority that it knows, and a certificate of another
    mixed = msgspec.json.decode((tmp_path / "other/planner.json5").read_text().split("\n", 1)[1])
    root = "root_ca_certificate_base64"
    mixed["transport"]["link"]["tls"][root] = tls[root]
    (tmp_path / "mixed.json5").write_bytes(msgspec.json.encode(mixed))
    for file in ("without.json5", "mixed.json5", "other/planner.json5"):
        config = zenoh_config(file=tmp_path / file, connect=[site.endpoint])
        with pytest.raises(NoServiceError) as refused:
            CruxClient(config, wait=2.0)
        assert "certificates" in str(refused.value)
    plain = zenoh_config(
        mode="client", connect=[site.endpoint.replace("tls/", "tcp/")], multicast=False
    )
    with pytest.raises(NoServiceError):
        open_session(plain)
