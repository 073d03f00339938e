"""Three services behind a router, under load, and one of them is killed: real processes."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import msgspec
import pytest
import zenoh
from msgspec.structs import replace

from service import CruxClient, SetPointsRequest
from service.replies import HealthReply
from service.requests import StreamRequest
from service.serving import open_session, zenoh_config
from service.wire import ServiceTimeout, server_key, service_key
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import plan_request, stream_request
from tests.suite.helpers.served import Served, client_config, free_endpoint

ROBOT = "robosimian"
pytestmark = pytest.mark.slow


class Site:
    """A router in this process, and services that are its clients."""

    def __init__(self) -> None:
        self._open = ExitStack()
        self.endpoint = free_endpoint()
        config = zenoh_config(mode="router", listen=[self.endpoint], multicast=False)
        self.router = self._open.enter_context(open_session(config))
        self.session = self._open.enter_context(open_session(client_config(self.endpoint)))
        self.servers: dict[str, Served] = {}

    def fill(self, count: int) -> None:
        """Start as many as are missing."""
        while len(self.servers) < count:
            self.start()

    def start(self) -> str:
        """Start one more; return its identifier."""
        served = Served(self.endpoint, "--workers", "1", routed=True)
        new: set[str] = set()

        def seen() -> bool:
            new.update(self.there() - self.servers.keys())
            return bool(new)

        assert soon(seen)
        (name,) = new
        self.servers[name] = served
        return name

    def there(self) -> set[str]:
        tokens = self.session.liveliness().get(server_key(ROBOT, "*"), timeout=PATIENCE)
        return {str(each.ok.key_expr).rpartition("/")[2] for each in tokens if each.ok}

    def signal(self, name: str, number: int) -> None:
        self.servers[name].process.send_signal(number)

    def kill(self, name: str) -> None:
        self.signal(name, signal.SIGKILL)
        served = self.servers.pop(name)
        served.process.communicate()

    def client(self, **more: object) -> CruxClient:
        config = client_config(self.endpoint)
        made = CruxClient(config, **{"timeout": PATIENCE, "spread": True} | more)
        return self._open.enter_context(made)

    def replied(self, name: str) -> int:
        key = server_key(ROBOT, name, "health")
        (reply,) = self.session.get(key, timeout=PATIENCE)
        return msgspec.json.decode(reply.ok.payload.to_bytes(), type=HealthReply).replied

    def close(self) -> None:
        self._open.close()
        for served in self.servers.values():
            served.process.kill()
            served.process.communicate()


@pytest.fixture(scope="module")
def opened() -> Iterator[Site]:
    site = Site()
    yield site
    site.close()


@pytest.fixture
def site(opened: Site) -> Site:
    opened.fill(3)
    return opened


def test_one_of_three_is_killed_and_nobody_is_without_an_answer(site: Site) -> None:
    client = site.client()
    assert soon(lambda: len(client._servers.names()) == 3)
    statuses: list[str] = []
    count, asked = threading.Event(), plan_request()

    def ask(number: int) -> None:
        for i in range(12):
            load = replace(asked.load, mass=100.0 + number + i)
            statuses.append(client.plan(replace(asked, load=load)).status)
            if len(statuses) > 20:
                count.set()

    with ThreadPoolExecutor(6) as pool:
        done = [pool.submit(ask, number) for number in range(6)]
        assert count.wait(PATIENCE)
        # all three are asked
        assert soon(lambda: all(site.replied(name) > 0 for name in site.servers))
        site.kill(next(iter(site.servers)))
        for each in done:
            each.result()
    assert len(statuses) == 72
    assert set(statuses) <= {"optimal", "overloaded"}
    # and by SIGTERM: what waits is asked of the last
    name = next(iter(site.servers))
    with ThreadPoolExecutor(6) as pool:
        done = [pool.submit(client.plan, asked) for _ in range(24)]
        site.signal(name, signal.SIGTERM)
        assert {each.result().status for each in done} == {"optimal"}
    site.servers.pop(name).process.communicate()


def test_streams_are_declared_again_where_a_service_is(site: Site) -> None:
    client = site.client()
    # it begins with the first that it sees
    assert soon(lambda: set(client._servers.names()) == set(site.servers))
    request = msgspec.convert(stream_request(), StreamRequest)
    declared = [client.stream(request) for _ in range(3)]
    kept = {each.stream: client._streams._kept[each.stream].server for each in declared}
    # by turns
    assert set(kept.values()) == set(site.servers)
    wrench = tuple(declared[0].body_wrench)

    def ask(stream: str) -> float | None:
        asked = SetPointsRequest(v=1, stream=stream, body_wrench=wrench)
        reply = client.set_points(asked)
        assert (reply.stream, reply.verified) == (stream, True)
        return reply.utilisation

    before = {stream: ask(stream) for stream in kept}
    with client.publish_stream(request) as published:
        published.publish(wrench)
        assert published.receive(PATIENCE).set_points.verified
        # of four wrenches three go to services that do not keep the stream: they say nothing
        assert published.declarations == 1
        victim = published._server
        site.kill(victim)
        assert {stream: ask(stream) for stream in kept} == before
        number = published.publish(wrench)
        found = None
        while found is None or found.number < number:
            found = published.receive(PATIENCE)
        assert found.set_points.verified
        assert published.declarations == 2
        assert published._server in site.servers
    moved = client._streams._kept[next(s for s, server in kept.items() if server == victim)]
    assert moved.server in site.servers


def test_a_deadline_holds_for_all_attempts_together(site: Site) -> None:
    """A service that is stopped takes the time; after that no other is asked."""
    stopped = next(iter(site.servers))
    for name in list(site.servers):
        if name != stopped:
            site.kill(name)
    client = site.client(timeout=2.0)
    assert soon(lambda: client._servers.names() == (stopped,))
    assert client.plan(plan_request()).status == "optimal"
    site.signal(stopped, signal.SIGSTOP)
    began = time.monotonic()
    with pytest.raises(ServiceTimeout):
        client.plan(plan_request())
    assert time.monotonic() - began >= 1.9
    # while it is in doubt, another is asked first
    other = site.start()
    assert soon(lambda: len(client._servers.names()) == 2)
    assert [client._servers.next() for _ in range(3)] == [other] * 3
    site.signal(stopped, signal.SIGCONT)


def test_without_spread_the_nearest_answers_and_others_stand_by(site: Site) -> None:
    client = site.client(spread=False)
    before = {name: site.replied(name) for name in site.servers}
    for _ in range(6):
        assert client.plan(plan_request()).status == "optimal"
    (nearest,) = [name for name in site.servers if site.replied(name) > before[name]]
    site.kill(nearest)
    assert client.plan(plan_request()).status == "optimal"
    assert list(zenoh_keys(site, "plan")) == [service_key(ROBOT, "plan")]


def zenoh_keys(site: Site, name: str) -> Iterator[str]:
    """Keys of the replies to wildcards: none of a single service."""
    payload = msgspec.json.encode(plan_request())
    # the last part of a key is no wildcard
    for key in (f"crux/*/{name}", f"crux/{ROBOT}/server/*/{name}"):
        replies = site.session.get(
            key, payload=payload, target=zenoh.QueryTarget.BEST_MATCHING, timeout=PATIENCE
        )
        yield from {str(reply.ok.key_expr) for reply in replies if reply.ok}
