"""Whoever asks in another's name, or in many, takes nothing from others; real sessions."""

from __future__ import annotations

import itertools
import json
import threading
from collections.abc import Iterator

import pytest
import zenoh

from service.serving import CruxClient, open_session, zenoh_config
from service.serving.names import ClientIdentity, ClientNames
from service.serving.settings import SERVING_SETTINGS
from service.wire import ServiceName, service_key
from tests.service.serving.test_dispatcher import LONG, PLAN, Site, all_up, kind, result, until
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.served import client_config

SET_POINTS = service_key("robosimian", "set_points")


class Routed(Site):
    """A service that clients reach through a router."""

    def config(self) -> zenoh.Config:
        router = zenoh_config(mode="router", listen=[self.endpoint], multicast=False)
        self.router = open_session(router)
        return zenoh_config(mode="client", connect=[self.endpoint], multicast=False)

    def close(self) -> None:
        super().close()
        self.router.close()


class Asker:
    """A session that proves its name as `CruxClient` does, and asks what it likes."""

    def __init__(self, site: Site) -> None:
        self.session = zenoh.open(client_config(site.endpoint))
        self.client = CruxClient(self.session)
        self.name = str(self.session.info.zid())
        self._numbers = itertools.count()

    def send(self, asked: dict, **forged: object) -> Iterator[zenoh.Reply]:
        own = {
            "source_info": zenoh.SourceInfo(self.client._identity._querier.id, next(self._numbers)),
            "attachment": self.client._identity.secret,
        }
        payload = json.dumps(asked).encode()
        return self.session.get(PLAN, payload=payload, timeout=PATIENCE, **own | forged)

    def ask(self, asked: dict) -> dict:
        return result(self.send(asked))


@pytest.fixture(scope="module", params=[Site, Routed])
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    opened = request.param(workers=2, memory=2**30)
    yield opened
    opened.close()


@pytest.fixture
def victim(site: Site) -> Iterator[Asker]:
    asker = Asker(site)
    operator = site.client()
    site.wait_until(operator, all_up)
    with asker.session:
        # by then its name is proven
        assert [asker.ask({"echo": i})["echo"] for i in range(50)] == list(range(50))
        yield asker


@pytest.fixture
def other(site: Site) -> Iterator[Asker]:
    asker = Asker(site)
    with asker.session:
        yield asker


def test_a_token_of_another_ends_no_question(site: Site, victim: Asker, other: Asker) -> None:
    key = service_key("robosimian", f"{ServiceName.CLIENTS}/{victim.name}")
    operator = site.client()
    with until(site) as go_on:
        held = [victim.send(go_on) for _ in range(2)]
        site.wait_until(operator, lambda health: len(working(health)) == 2)
        waiting = [victim.send({"echo": i}) for i in range(3)]
        site.wait_until(operator, lambda health: sum(health["waiting"].values()) == 3)
        for _ in range(3):
            token = other.session.liveliness().declare_token(key)
            # it is seen once it has been heard of
            assert any(reply.ok for reply in other.session.liveliness().get(key, timeout=PATIENCE))
            token.undeclare()
        assert "echo" in site.client().ask({"stream": ""}, SET_POINTS)
        assert sum(site.health(operator)["waiting"].values()) == 3
    assert [result(each)["echo"] for each in waiting] == [0, 1, 2]
    assert all("pid" in result(each) for each in held)


def working(health: dict) -> list[dict]:
    at_work = ("questions", "working")
    return [p for p in health["processes"] if (p["purpose"], p["state"]) == at_work]


@pytest.mark.parametrize("secret", [None, b"guessed"])
def test_a_name_that_is_another_s_takes_no_room_from_him(
    victim: Asker, other: Asker, secret: bytes | None
) -> None:
    source = zenoh.SourceInfo(victim.client._identity._querier.id, 7)
    most = SERVING_SETTINGS.waiting_of_client
    forged = [
        other.send({"sleep": 0.02}, source_info=source, attachment=secret) for _ in range(3 * most)
    ]
    own = [victim.send({"echo": i}) for i in range(most // 2)]
    assert [result(each).get("echo") for each in own] == list(range(most // 2))
    answers = [result(each) for each in forged]
    assert {kind(each) for each in answers if "error" in each} == {"busy"}


def test_nine_names_are_one_place(victim: Asker, other: Asker) -> None:
    """Made up, as no session has them."""
    ids = [querier_of(name) for name in "123456789"]
    crowd = [
        other.send({"sleep": 0.01}, source_info=zenoh.SourceInfo(each, i), attachment=None)
        for i in range(2 * SERVING_SETTINGS.waiting_of_client)
        for each in ids
    ]
    own = [victim.ask({"echo": i}).get("echo") for i in range(27)]
    assert own == list(range(27))
    assert all(result(each) for each in crowd)


def querier_of(digit: str) -> zenoh.EntityGlobalId:
    """An identifier of a session that has closed."""
    config = zenoh_config(settings=["listen/endpoints:[]", f'id:"{digit * 8}"'], multicast=False)
    with zenoh.open(config) as session:
        return session.declare_querier(PLAN).id


def test_who_says_that_he_has_gone_is_told_so() -> None:
    """Behind a router only a token tells, and only of him whose it is."""
    site = Routed(workers=2)
    try:
        operator = site.client()
        site.wait_until(operator, all_up)
        leaving, staying = Asker(site), Asker(site)
        with leaving.session, staying.session:
            for asker in (leaving, staying):
                assert all("echo" in asker.ask({"echo": i}) for i in range(50))
            with until(site) as go_on:
                held = [site.client().send(go_on) for _ in range(2)]
                site.wait_until(operator, lambda health: len(working(health)) == 2)
                waiting = [
                    asker.send({"echo": 1, "deadline": LONG}) for asker in (leaving, staying)
                ]
                site.wait_until(operator, lambda health: sum(health["waiting"].values()) == 2)
                leaving.client._identity._token.undeclare()
                told = result(waiting[0])
                assert kind(told) == "lost"
                assert "the client disconnected" in told["error"]["message"]
            assert result(waiting[1])["echo"] == 1
            assert all("pid" in result(each) for each in held)
    finally:
        site.close()


def test_callers_by_ros_2_have_places_of_their_own_but_not_without_end() -> None:
    known = ClientNames()
    places = [known.place("", b"", bytes([i]) * 16) for i in range(100)]
    own = places[: SERVING_SETTINGS.ros_callers]
    assert len({*own}) == SERVING_SETTINGS.ros_callers
    assert {*places[len(own) :]} == {""}
    # who has one keeps it, and counts as connected
    assert known.place("", b"", bytes(16)) == own[0]
    assert known.connected() == {*own}
    # by another identifier nothing is taken from them
    assert known.place(own[0], b"") == ""


def test_a_thread_that_still_asks_while_the_client_withdraws_has_a_source():
    with open_session(zenoh_config(multicast=False)) as session:
        identity, numbers, wrong = ClientIdentity(session, "robosimian"), [], []

        def ask() -> None:
            try:
                for _ in range(20_000):
                    numbers.append(identity.source().source_sn)
            except Exception as error:
                wrong.append(error)

        asking = threading.Thread(target=ask)
        asking.start()
        identity.withdraw()
        asking.join()
    assert not wrong
    assert numbers == list(range(20_000))
