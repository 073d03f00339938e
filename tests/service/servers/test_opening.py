"""Clients with several endpoints, of which some answer: real zenoh sessions on TCP loopback."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import pytest
import zenoh

from service import CruxClient
from service.servers import open_session as open_at_any
from service.serving import open_session, zenoh_config
from service.wire import NoServiceError, service_key
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.served import client_config, free_endpoint, lonely_config

WAIT = 0.6
"""Where nobody comes, a client waits so long: each endpoint is tried [s]."""


def config_of(*endpoints: str) -> zenoh.Config:
    return zenoh_config(mode="client", connect=endpoints, multicast=False)


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


@pytest.fixture
def router(endpoint: str) -> Iterator[zenoh.Session]:
    config = zenoh_config(mode="router", listen=[endpoint], multicast=False)
    with open_session(config) as opened:
        yield opened


@pytest.mark.parametrize(("place", "spread"), [(1, False), (2, True)])
def test_a_client_that_waits_finds_the_one_endpoint_that_answers(
    place: int, spread: bool, endpoint: str, router: zenoh.Session
) -> None:
    endpoints = [free_endpoint(), free_endpoint()]
    endpoints.insert(place, endpoint)
    with (
        router.liveliness().declare_token(service_key("robosimian", "alive")),
        CruxClient(config_of(*endpoints), wait=PATIENCE, spread=spread) as client,
    ):
        assert list(client._session.info.routers_zid()) == [router.info.zid()]


def test_a_session_goes_over_to_another_endpoint_when_its_own_ends(endpoint: str) -> None:
    dead, second = free_endpoint(), free_endpoint()
    with ExitStack() as opened:
        first = open_session(zenoh_config(mode="router", listen=[endpoint], multicast=False))
        opened.callback(first.close)
        session = opened.enter_context(open_at_any(config_of(dead, endpoint, second), PATIENCE))
        assert list(session.info.routers_zid()) == [first.info.zid()]
        first.close()
        config = zenoh_config(mode="router", listen=[second], multicast=False)
        other = opened.enter_context(open_session(config))
        assert soon(lambda: list(session.info.routers_zid()) == [other.info.zid()])


def test_where_no_endpoint_answers_all_are_named_in_their_order() -> None:
    dead = [free_endpoint(), free_endpoint()]
    with pytest.raises(NoServiceError, match=rf"within {WAIT:g} s .*\[{dead[0]}, {dead[1]}\]"):
        CruxClient(config_of(*dead), wait=WAIT)


def test_an_error_that_is_there_at_once_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[zenoh.Config] = []

    def refuse(config: zenoh.Config) -> None:
        tried.append(config)
        raise zenoh.ZError("no memory")

    monkeypatch.setattr(zenoh, "open", refuse)
    with pytest.raises(NoServiceError, match="no zenoh session: no memory"):
        open_at_any(config_of(free_endpoint(), free_endpoint()), PATIENCE)
    assert len(tried) == 1


def test_a_client_says_which_robots_have_services(endpoint: str, router: zenoh.Session) -> None:
    there = pytest.raises(NoServiceError, match=r"services of mine are there.*robot='mine'")
    with router.liveliness().declare_token(service_key("mine", "alive")), there:
        CruxClient(client_config(endpoint), "climber", wait=0.2)


def test_a_client_says_whether_it_is_connected(endpoint: str, router: zenoh.Session) -> None:
    with pytest.raises(NoServiceError, match=r"is connected, but .* compiles for minutes"):
        CruxClient(client_config(endpoint), wait=0.2)
    with pytest.raises(NoServiceError, match=r"within 0\.2 s: this session is connected to nobody"):
        CruxClient(lonely_config(), wait=0.2)
