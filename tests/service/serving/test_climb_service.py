"""Climbs over zenoh: progress, workers of their own, and what ends them; real sessions."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

import msgspec
import pytest
import zenoh
from msgspec.structs import replace

from service import CruxClient
from service.replies import HealthReply, PartReply
from service.requests import ClimbRequest, PlanRequest
from service.serving import PlanService, open_session, zenoh_config
from service.wire import ServiceError, service_key
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.requests import wall_request
from tests.suite.helpers.searched import asked, progress, searching
from tests.suite.helpers.served import client_config, free_endpoint

CLIMB = service_key("robosimian", "climb")
HEALTH = service_key("robosimian", "health")
METRICS = service_key("robosimian", "metrics")


class Site:
    """A service on loopback with one worker for questions, and clients of it."""

    def __init__(self, folder: Path) -> None:
        self._open = ExitStack()
        self.folder, self.endpoint = folder, free_endpoint()
        config = zenoh_config(mode="peer", listen=[self.endpoint], multicast=False)
        session = self._open.enter_context(open_session(config))
        self.service = PlanService(session, workers=1, make=searching)
        self._open.enter_context(self.service)
        self._operator = self._open.enter_context(zenoh.open(client_config(self.endpoint)))
        self._pool = self._open.enter_context(ThreadPoolExecutor(8))

    def close(self) -> None:
        self._open.close()

    def client(self) -> CruxClient:
        made = CruxClient(client_config(self.endpoint), timeout=PATIENCE)
        return self._open.enter_context(made)

    def later(self, work: Callable, *more: object) -> Future:
        return self._pool.submit(work, *more)

    def health(self) -> HealthReply:
        (reply,) = self._operator.get(HEALTH, timeout=PATIENCE)
        return msgspec.json.decode(reply.ok.payload.to_bytes(), type=HealthReply)

    def metrics(self) -> str:
        (reply,) = self._operator.get(METRICS, timeout=PATIENCE)
        return reply.ok.payload.to_string()

    def gone(self) -> float:
        """Count the climbs whose clients have gone."""
        lines = self.metrics().splitlines()
        name = 'crux_questions_total{key="climb",status="gone"} '
        return sum(float(line.removeprefix(name)) for line in lines if line.startswith(name))

    def wait_until(self, so: Callable[[HealthReply], bool]) -> HealthReply:
        seen = list[HealthReply]()

        def there() -> bool:
            seen.append(self.health())
            return so(seen[-1])

        assert soon(there), seen[-1]
        return seen[-1]

    def climbing(self) -> int:
        """Wait for the one climb in work; return the process that works on it."""
        health = self.wait_until(lambda health: working(health, "climbs") == 1)
        (pid,) = (each.pid for each in health.processes if each.purpose == "climbs")
        assert pid is not None
        return pid


def working(health: HealthReply, purpose: str) -> int:
    return sum((each.purpose, each.state) == (purpose, "working") for each in health.processes)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    opened = Site(tmp_path_factory.mktemp("climbs"))
    yield opened
    opened.close()


@contextmanager
def climb_in_work(site: Site, client: CruxClient, identifier: str) -> Iterator[Future]:
    """A climb that is in work until this is left, and then ends by itself."""
    file = site.folder / f"{identifier}-{time.monotonic_ns()}"
    held = site.later(client.climb, replace(asked(until=str(file)), id=identifier))
    site.climbing()
    yield held
    file.touch()


# Parts --------------------------------------------------------------------------------------------


def test_progress_comes_in_order_before_the_reply(site: Site) -> None:
    parts: list[PartReply] = []
    reply = site.client().climb(replace(asked(parts=5), id="mine"), parts.append)
    assert [part.progress for part in parts] == [progress(i) for i in range(5)]
    assert {part.id for part in parts} == {reply.id} == {"mine"}
    assert reply.status == "none"


def test_without_parts_there_is_one_reply(site: Site) -> None:
    assert site.client().climb(asked(parts=5)).bound == 0.9
    payload = msgspec.json.encode(asked(parts=5))
    with zenoh.open(client_config(site.endpoint)) as session:
        mode = zenoh.ConsolidationMode.NONE
        replies = list(session.get(CLIMB, payload=payload, consolidation=mode, timeout=PATIENCE))
    assert len(replies) == 1


def test_any_zenoh_program_sees_the_progress_as_replies(site: Site) -> None:
    """Not where it lets zenoh consolidate them: then it sees the last one alone."""
    payload = msgspec.json.encode(replace(asked(parts=3), parts=True))
    with zenoh.open(client_config(site.endpoint)) as session:
        for mode, count in (
            (zenoh.ConsolidationMode.NONE, 3),
            (zenoh.ConsolidationMode.MONOTONIC, 3),
            (zenoh.ConsolidationMode.AUTO, 0),
        ):
            replies = session.get(CLIMB, payload=payload, consolidation=mode, timeout=PATIENCE)
            *parts, last = (msgspec.json.decode(each.ok.payload.to_bytes()) for each in replies)
            assert [part["progress"]["done"] for part in parts] == list(range(count))
            assert (last["status"], "progress" in last) == ("none", False)


# Others -------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="no niceness on this system")
def test_a_climb_keeps_no_plan_waiting_and_yields_to_it(site: Site) -> None:
    client, other = site.client(), site.client()
    request = msgspec.convert(wall_request(), type=PlanRequest)
    with climb_in_work(site, client, "long"):
        assert all(other.plan(request).status == "optimal" for _ in range(3))
        # also of the client that climbs
        assert client.plan(request).status == "optimal"
        nice = {
            each.purpose: os.getpriority(os.PRIO_PROCESS, each.pid)
            for each in site.health().processes
            if each.pid is not None
        }
        least = os.getpriority(os.PRIO_PROCESS, 0)
        assert nice["climbs"] == max(10, least)
        assert {nice["questions"], nice["streams"]} == {least}


def test_climbs_of_two_clients_are_searched_for_one_after_the_other(site: Site) -> None:
    first, second = site.client(), site.client()
    with climb_in_work(site, first, "first") as held:
        waits = site.later(second.climb, asked())
        site.wait_until(lambda health: health.waiting["climb"] == 1)
        assert not waits.done()
    assert held.result(PATIENCE).programs == waits.result(PATIENCE).programs


# Ends ---------------------------------------------------------------------------------------------


def test_a_client_cancels_its_climb_and_no_other_can(site: Site) -> None:
    client, other = site.client(), site.client()
    with climb_in_work(site, client, "mine") as held:
        assert other.cancel("mine") == 0
        assert client.cancel("another") == 0
        assert client.cancel("mine") == 1
        with pytest.raises(ServiceError) as caught:
            held.result(PATIENCE)
        assert caught.value.kind == "cancelled"
    assert client.cancel("mine") == 0
    assert other.climb(asked()).status == "none"


def test_a_climb_that_waits_is_cancelled_and_the_one_in_work_goes_on(site: Site) -> None:
    client = site.client()
    with climb_in_work(site, client, "first") as held:
        waits = site.later(client.climb, replace(asked(), id="second"))
        site.wait_until(lambda health: health.waiting["climb"] == 1)
        assert client.cancel("second") == 1
        with pytest.raises(ServiceError, match="cancelled by its client"):
            waits.result(PATIENCE)
    assert held.result(PATIENCE).status == "none"


def test_what_fails_while_it_takes_progress_ends_the_climb(site: Site) -> None:
    def breaks(_: PartReply) -> None:
        raise KeyboardInterrupt

    file = site.folder / "never"
    with pytest.raises(KeyboardInterrupt):
        site.client().climb(asked(parts=1, until=str(file)), breaks)
    assert working(site.health(), "climbs") == 0


@pytest.mark.parametrize(
    "number", [signal.SIGKILL, pytest.param(signal.SIGSEGV, marks=pytest.mark.slow)]
)
def test_a_worker_that_is_killed_is_told_and_the_next_climb_has_another(
    site: Site, number: int
) -> None:
    client, file = site.client(), site.folder / "never"
    held = site.later(client.climb, replace(asked(until=str(file)), id="mine"))
    os.kill(site.climbing(), number)
    with pytest.raises(ServiceError, match=f"was killed by signal {int(number)}") as caught:
        held.result(PATIENCE)
    assert caught.value.kind == "lost"
    assert client.climb(asked()).status == "none"


def test_a_deadline_ends_a_climb(site: Site) -> None:
    client, file = site.client(), site.folder / "never"
    with pytest.raises(ServiceError, match=r"0\.3 s expired before the file was there") as caught:
        client.climb(replace(asked(until=str(file)), deadline=0.3))
    assert caught.value.kind == "deadline"
    assert client.climb(asked()).status == "none"


@pytest.mark.slow
def test_a_search_that_does_not_look_at_the_clock_loses_its_worker(site: Site) -> None:
    client = site.client()
    with pytest.raises(ServiceError, match=r"0\.3 s expired") as caught:
        client.climb(replace(asked(sleep=600), deadline=0.3))
    assert caught.value.kind == "deadline"
    assert client.climb(asked()).status == "none"


def test_a_climb_ends_when_its_client_leaves(site: Site) -> None:
    before, file = site.gone(), site.folder / "never"
    with CruxClient(client_config(site.endpoint), timeout=PATIENCE) as leaving:
        threading.Thread(target=_ignoring, args=(leaving, asked(until=str(file)))).start()
        site.climbing()
    site.wait_until(lambda health: working(health, "climbs") == 0)
    assert site.gone() == before + 1


LEAVING = """
import sys
from service import CruxClient
from tests.suite.helpers.searched import asked
from tests.suite.helpers.served import client_config
with CruxClient(client_config(sys.argv[1]), timeout=600.0) as client:
    client.climb(asked(until=sys.argv[2]))
"""


def test_a_climb_ends_when_its_client_is_killed(site: Site) -> None:
    before, file = site.gone(), site.folder / "never"
    client = subprocess.Popen(
        [sys.executable, "-c", LEAVING, site.endpoint, str(file)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    try:
        site.climbing()
    finally:
        client.kill()
        client.wait()
    site.wait_until(lambda health: working(health, "climbs") == 0)
    assert site.gone() == before + 1
    assert site.client().climb(asked()).status == "none"


@pytest.mark.slow
def test_a_service_that_ends_tells_the_client_of_a_climb(tmp_path: Path) -> None:
    ending = Site(tmp_path)
    client = CruxClient(client_config(ending.endpoint), timeout=PATIENCE)
    held = ending.later(client.climb, asked(until=str(tmp_path / "never")))
    ending.climbing()
    ending.service.__exit__(None, None, None)
    with pytest.raises(ServiceError) as caught:
        held.result(PATIENCE)
    assert caught.value.kind == "lost"
    client.close()
    ending.close()


def _ignoring(client: CruxClient, request: ClimbRequest) -> None:
    try:
        client.climb(request)
    except Exception:
        return
