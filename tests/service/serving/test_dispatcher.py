"""Questions and processes: deadlines, deaths, turns, and the end; real sessions and processes."""

from __future__ import annotations

import itertools
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import zenoh

from hand_models.base import InvalidInputError
from planner.processes import starting
from service.serving import PlanService, dispatcher, open_session, zenoh_config
from service.serving.settings import SERVING_SETTINGS
from service.wire import LostError, service_key
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.odd_answers import never_ready, obedient
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.processes import ran
from tests.suite.helpers.served import client_config, free_endpoint

PLAN = service_key("robosimian", "plan")
WRENCH_SPACE = service_key("robosimian", "wrench_space")
STREAM = service_key("robosimian", "stream")
SET_POINTS = service_key("robosimian", "set_points")
HEALTH = service_key("robosimian", "health")
METRICS = service_key("robosimian", "metrics")

LONG = 600.0
"""Far longer than any test waits [s]."""


class Client:
    """A session of its own; named as `CruxClient` names itself, or not."""

    def __init__(self, session: zenoh.Session, *, named: bool = True) -> None:
        self.session = session
        self._numbers = itertools.count()
        self._source = session.declare_querier(PLAN) if named else None

    def send(self, asked: dict, key: str = PLAN) -> Iterator[zenoh.Reply]:
        source = None
        if self._source is not None:
            source = zenoh.SourceInfo(self._source.id, next(self._numbers))
        return self.session.get(
            key, payload=json.dumps(asked).encode(), timeout=PATIENCE, source_info=source
        )

    def ask(self, asked: dict, key: str = PLAN) -> dict:
        return result(self.send(asked, key))


def result(replies: Iterator[zenoh.Reply]) -> dict:
    """What the one reply says."""
    (reply,) = replies
    return json.loads((reply.ok or reply.err).payload.to_bytes())


def kind(answer: dict) -> str:
    return answer["error"]["kind"]


class Site:
    """A service on loopback, and clients of it."""

    def __init__(self, **settings: object) -> None:
        self._open = ExitStack()
        self.folder = Path(self._open.enter_context(TemporaryDirectory()))
        self.numbers = itertools.count()
        self.endpoint = free_endpoint()
        session = self._open.enter_context(open_session(self.config()))
        self.service = PlanService(session, make=obedient, **settings)  # type: ignore[arg-type]
        self._open.enter_context(self.service)

    def config(self) -> zenoh.Config:
        """Of the service's own session."""
        return zenoh_config(mode="peer", listen=[self.endpoint], multicast=False)

    def client(self, *, named: bool = True) -> Client:
        session = self._open.enter_context(zenoh.open(client_config(self.endpoint)))
        return Client(session, named=named)

    def close(self) -> None:
        self._open.close()

    def health(self, client: Client) -> dict:
        return client.ask({}, HEALTH)

    def wait_until(self, client: Client, so: Callable[[dict], bool]) -> dict:
        health: dict = {}

        def reached() -> bool:
            nonlocal health
            health = self.health(client)
            return so(health)

        assert soon(reached), health
        return health


def states(health: dict, purpose: str = "questions") -> list[str]:
    return [p["state"] for p in health["processes"] if p["purpose"] == purpose]


def of_streams(health: dict) -> list[dict]:
    return [each for each in health["processes"] if each["purpose"] == "streams"]


@contextmanager
def until(site: Site) -> Iterator[dict]:
    """A question that is in work until this is left."""
    file = site.folder / str(next(site.numbers))
    yield {"until": str(file), "deadline": LONG}
    file.touch()


@contextmanager
def all_working(site: Site, client: Client) -> Iterator[None]:
    """All processes that answer questions are at work until this is left."""
    with until(site) as go_on:
        held = [site.client().send(go_on) for _ in range(2)]
        site.wait_until(client, lambda health: states(health) == ["working"] * 2)
        yield
        assert states(site.health(client)) == ["working"] * 2
    assert all("pid" in result(each) for each in held)


def all_up(health: dict) -> bool:
    """Whether all processes are ready, the spare one, too."""
    all_states = [p["state"] for p in health["processes"]]
    return "starting" not in all_states and len(states(health, "spare")) == 1


def all_new(old: set[int], health: dict) -> bool:
    return not old & {each["pid"] for each in health["processes"]}


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    opened = Site(workers=2, memory=2**30)
    yield opened
    opened.close()


@pytest.fixture
def client(site: Site) -> Client:
    made = site.client()
    site.wait_until(made, all_up)
    return made


# Ends ---------------------------------------------------------------------------------------------


def test_a_question_that_hangs_ends_at_its_deadline_and_costs_nobody_else(
    site: Site, client: Client
) -> None:
    before = {p["pid"] for p in site.health(client)["processes"]}
    hanging = client.send({"sleep": LONG, "deadline": 0.3, "id": "mine"})
    other = site.client()
    assert all("echo" in other.ask({"echo": i}) for i in range(20))
    answer = result(hanging)
    assert (kind(answer), answer["id"]) == ("deadline", "mine")
    assert "0.3 s expired" in answer["error"]["message"]
    health = site.wait_until(client, all_up)
    assert len({p["pid"] for p in health["processes"]} & before) == len(before) - 1
    assert health["last_failure"] is not None


def test_a_deadline_that_comes_while_the_question_waits(site: Site, client: Client) -> None:
    with all_working(site, client):
        waits = client.ask({"echo": 1, "deadline": 0.2})
        assert kind(waits) == "deadline"
        assert "a worker was free" in waits["error"]["message"]


@pytest.mark.parametrize(
    "deadline", ["1e12", "1e308", "9" * 400, "-" + "9" * 400, "0", "true", '"soon"', "[[]]"]
)
def test_a_deadline_that_no_question_may_have_stops_nothing(client: Client, deadline: str) -> None:
    """The process says what is wrong with it; meanwhile it is the service's own."""
    (reply,) = client.session.get(PLAN, payload=f'{{"deadline": {deadline}}}', timeout=PATIENCE)
    assert reply.ok is not None
    assert "pid" in client.ask({"echo": 1})


def test_a_query_that_cannot_be_read_is_replied_to(
    client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as patch:
        patch.setattr(dispatcher, "received_question", fails)
        assert kind(client.ask({"echo": 1})) == "internal"
    assert "pid" in client.ask({"echo": 1})


@pytest.mark.slow
def test_a_process_that_stands_still_takes_nothing_and_stops_nobody(
    site: Site, client: Client
) -> None:
    """Not even by a question that its pipe has no room for."""
    before = [p["pid"] for p in site.health(client)["processes"] if p["purpose"] == "questions"]
    for pid in before:
        os.kill(pid, signal.SIGSTOP)
    large = client.send({"echo": "x" * 3_000_000, "deadline": 1.0})
    assert len(site.health(client)["processes"]) == 4
    assert kind(result(large)) == "deadline"
    assert "pid" in client.ask({"stream": "1"}, SET_POINTS)
    for pid in before:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
    site.wait_until(client, all_up)
    assert "pid" in client.ask({"echo": 1})


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT])
def test_a_process_that_dies_costs_its_own_question(
    site: Site, client: Client, number: int
) -> None:
    answer = client.ask({"signal": int(number), "id": "mine"})
    assert (kind(answer), answer["id"]) == ("lost", "mine")
    assert f"was killed by signal {int(number)}" in answer["error"]["message"]
    assert "pid" in client.ask({"echo": 1})
    site.wait_until(client, all_up)


@pytest.mark.skipif(sys.platform != "linux", reason="no other system keeps a process to its memory")
def test_a_process_that_eats_memory_costs_its_own_question(site: Site, client: Client) -> None:
    answer = client.ask({"eat": 2**31})
    assert kind(answer) == "lost"
    assert "had not enough memory" in answer["error"]["message"]
    assert "pid" in client.ask({"eat": 2**24})


def test_processes_that_are_killed_are_replaced_whatever_they_do(
    site: Site, client: Client
) -> None:
    for _ in range(2):
        before = site.wait_until(client, all_up)["processes"]
        for each in before:
            os.kill(each["pid"], signal.SIGKILL)
        gone = partial(all_new, {each["pid"] for each in before})
        site.wait_until(client, gone)
        assert "pid" in client.ask({"echo": 1})
        assert "pid" in client.ask({"stream": "1"}, SET_POINTS)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux alone")
def test_nobody_notices_the_death_of_what_processes_are_forked_from(
    site: Site, client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starting, "_fork_server_died", threading.Event())
    (first, *others) = [p["pid"] for p in site.wait_until(client, all_up)["processes"]]
    words = Path(f"/proc/{first}/stat").read_text().rpartition(")")[2].split()
    os.kill(int(words[1]), signal.SIGKILL)
    for _ in range(4):
        assert client.ask({"echo": 1})["pid"] in (first, *others)
    assert client.ask({"stream": "1"}, SET_POINTS)["pid"] in (first, *others)
    # one that hangs is ended all the same, and one that dies is replaced
    answer = client.ask({"sleep": LONG, "deadline": 0.5})
    assert kind(answer) == "deadline"
    assert kind(client.ask({"signal": int(signal.SIGKILL)})) == "lost"
    health = site.wait_until(client, all_up)
    assert len({first, *others} - {p["pid"] for p in health["processes"]}) == 2
    assert "pid" in client.ask({"echo": 1})


@pytest.mark.parametrize("purpose", ["questions", "streams", "spare"])
def test_a_process_that_stands_ready_takes_the_place_of_one_that_ends(
    site: Site, client: Client, purpose: str
) -> None:
    before = {p["pid"]: p["purpose"] for p in site.wait_until(client, all_up)["processes"]}
    (spare,) = (pid for pid, does in before.items() if does == "spare")
    killed = next(pid for pid, does in before.items() if does == purpose)
    os.kill(killed, signal.SIGKILL)

    def replaced(health: dict) -> bool:
        purposes = sorted(each["purpose"] for each in health["processes"])
        return all_new({killed}, health) and all_up(health) and purposes == sorted(before.values())

    health = site.wait_until(client, replaced)
    after = {p["pid"]: p["purpose"] for p in health["processes"]}
    assert after.get(spare) == (None if purpose == "spare" else purpose)
    assert "pid" in client.ask({"stream": "1"}, SET_POINTS)
    assert "pid" in client.ask({"echo": 1})


@pytest.mark.slow
def test_a_service_whose_processes_do_not_start_says_so(alone: zenoh.Session) -> None:
    with (
        pytest.raises(LostError, match="workers started"),
        PlanService(alone, make=never_ready),
    ):
        pass


UNGUARDED = """
from service.serving import PlanService
from tests.suite.helpers.served import lonely_session
with lonely_session() as alone, PlanService(alone, workers=1):
    print("ready")
"""


@pytest.mark.slow
def test_a_program_without_its_guard_ends_with_what_it_lacks(tmp_path: Path) -> None:
    done = ran(tmp_path, UNGUARDED)
    assert (done.returncode, done.stdout) == (1, "")
    assert "if __name__ == '__main__':" in done.stderr
    assert "LostError: none of the 1 workers started" in done.stderr


@pytest.mark.parametrize(
    ("settings", "field"), [({"workers": 0}, "workers"), ({"seconds": 0.0}, "seconds")]
)
def test_settings_that_cannot_be(settings: dict, field: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        PlanService(None, **settings)  # type: ignore[arg-type]
    assert caught.value.field == field


# Turns --------------------------------------------------------------------------------------------


def test_what_takes_long_leaves_a_process_to_others(site: Site, client: Client) -> None:
    other = site.client()
    with until(site) as go_on:
        dear = [client.send(go_on, WRENCH_SPACE) for _ in range(3)]
        site.wait_until(other, lambda health: "working" in states(health))
        assert len({other.ask({"echo": i})["pid"] for i in range(10)}) == 1
        health = site.health(client)
        assert (states(health).count("working"), health["waiting"]["dear"]) == (1, 2)
    assert all("pid" in result(each) for each in dear)


def test_nothing_delays_set_points(site: Site, client: Client) -> None:
    with all_working(site, client):
        streams = {client.ask({"echo": i}, SET_POINTS)["pid"] for i in range(20)}
        assert streams == {p["pid"] for p in of_streams(site.health(client))}


def test_a_stance_that_is_known_and_short_does_not_wait_for_long_questions(
    site: Site, client: Client
) -> None:
    asked = {"stance": {"a": 1}, "echo": 0}
    # known to both processes, and short there again
    for _ in range(20):
        client.ask(asked)
    with all_working(site, client):
        assert client.ask(asked)["pid"] == of_streams(site.health(client))[0]["pid"]


def test_a_stream_is_rehearsed_where_it_can_do_no_harm(site: Site, client: Client) -> None:
    answer = client.ask({"echo": 1}, STREAM)
    (streams,) = (p["pid"] for p in site.health(client)["processes"] if p["purpose"] == "streams")
    assert (answer["pid"], answer["rehearsal"]) == (streams, False)
    assert kind(client.ask({"signal": 9}, STREAM)) == "lost"
    # the process that has the streams lives
    assert client.ask({}, SET_POINTS)["pid"] == streams


def test_who_asks_too_much_is_told_to_come_again_and_others_have_their_turn(
    site: Site, client: Client
) -> None:
    flood, most = site.client(named=False), SERVING_SETTINGS.waiting_of_client
    asked = [flood.send({"sleep": 0.05, "id": "flood"}) for _ in range(3 * most)]
    named = [client.ask({"echo": i}) for i in range(5)]
    assert all(answer.get("echo") == i for i, answer in enumerate(named))
    answers = [result(each) for each in asked]
    busy = [answer for answer in answers if "error" in answer]
    assert {kind(answer) for answer in busy} == {"busy"}
    assert all(answer["error"]["retry_after"] > 0.0 for answer in busy)
    assert {answer["id"] for answer in busy} == {"flood"}
    # what was let in has been worked on
    assert len(answers) - len(busy) >= most


def test_what_a_client_asked_that_has_gone_is_not_worked_on(site: Site, client: Client) -> None:
    with all_working(site, client):
        with zenoh.open(client_config(site.endpoint)) as session:
            left = Client(session)
            for _ in range(5):
                left.send({"sleep": LONG, "deadline": LONG})
            site.wait_until(client, lambda health: sum(health["waiting"].values()) == 5)
        site.wait_until(client, lambda health: sum(health["waiting"].values()) == 0)
    assert 'status="gone"} 5.0' in metrics(client)


STALLED = """
import sys, time, zenoh
from tests.service.serving.test_dispatcher import PLAN, Client, client_config
with zenoh.open(client_config(sys.argv[1])) as session:
    client = Client(session)
    kept = []
    for _ in range(40):
        kept += [client.send({"pad": 2**20}) for _ in range(10)]
        print("asked", flush=True)
        time.sleep(0.05)
    time.sleep(600)
"""


def test_a_client_that_takes_no_replies_keeps_nobody_waiting(site: Site, client: Client) -> None:
    stalled = subprocess.Popen(
        [sys.executable, "-c", STALLED, site.endpoint],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert stalled.stdout is not None
        for _ in range(3):
            assert stalled.stdout.readline()
        stalled.send_signal(signal.SIGSTOP)
        assert all(client.ask({"echo": i})["echo"] == i for i in range(50))
    finally:
        stalled.kill()
        stalled.communicate()


# The end ------------------------------------------------------------------------------------------


def test_at_the_end_everybody_is_told() -> None:
    ending = Site(workers=2)
    client = ending.client()
    ending.wait_until(client, all_up)
    soon = client.send({"sleep": 1.0, "echo": "soon"})
    never = client.send({"sleep": LONG, "deadline": LONG, "echo": "never"})
    ending.wait_until(client, lambda health: states(health) == ["working"] * 2)
    waiting = [client.send({"echo": i}) for i in range(5)]
    ending.wait_until(client, lambda health: sum(health["waiting"].values()) == 5)
    answers: queue.SimpleQueue[dict] = queue.SimpleQueue()
    with ThreadPoolExecutor(7) as pool:
        for each in (soon, never, *waiting):
            pool.submit(lambda replies=each: answers.put(result(replies)))
        with ThreadPoolExecutor(1) as closing:
            closing.submit(ending.service.__exit__, None, None, None)
    told = [answers.get_nowait() for _ in range(7)]
    assert [a["echo"] for a in told if "echo" in a] == ["soon"]
    assert sorted(kind(a) for a in told if "error" in a) == ["busy"] * 5 + ["lost"]


# Operators ----------------------------------------------------------------------------------------


def metrics(client: Client) -> str:
    (reply,) = client.session.get(METRICS, timeout=PATIENCE)
    assert str(reply.ok.encoding).startswith("text/plain")
    return reply.ok.payload.to_string()


def test_an_operator_sees_what_is_going_on(site: Site, client: Client) -> None:
    client.ask({"echo": 1})
    health = site.health(client)
    assert health["robot"] == "robosimian"
    assert health["uptime"] > 0.0
    assert len(states(health)) == 2
    assert len(states(health, "streams")) == 1
    if sys.platform == "linux":
        assert all(p["resident"] > 2**20 for p in health["processes"])
    text = metrics(client)
    assert 'crux_questions_total{key="plan",status="done"}' in text
    assert "crux_processes_ended_total" in text
    assert 'crux_questions_waiting{kind="dear"} 0.0' in text


def test_metrics_over_http(site: Site) -> None:
    port = int(free_endpoint().rpartition(":")[2])
    site.service.serve_metrics(port)
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=PATIENCE) as page:
        text = page.read().decode()
    assert 'crux_processes{purpose="streams"' in text
    with pytest.raises(InvalidInputError, match="Address already in use") as caught:
        site.service.serve_metrics(port)
    assert caught.value.field == "--metrics-port"


@pytest.mark.parametrize(("key", "answered"), [("crux/**", 0), ("crux/*/plan", 1), ("**/plan", 1)])
def test_a_wildcard_is_answered_once_or_not_at_all(client: Client, key: str, answered: int) -> None:
    replies = list(client.send({"echo": 1}, key))
    assert len(replies) == answered
    assert all(str(reply.ok.key_expr) == PLAN for reply in replies)


def test_a_payload_that_is_too_large_is_refused_before_anything_reads_it(client: Client) -> None:
    answer = client.ask({"echo": "x" * 2**12}, SET_POINTS)
    assert kind(answer) == "limit"
    assert "4096 at most" in answer["error"]["message"]
