"""Which of several services is asked next: real zenoh tokens, on one session."""

from __future__ import annotations

import zenoh

from service.servers import LiveServers, rivals_in_words
from service.serving import open_session, zenoh_config
from service.wire import server_key
from tests.suite.helpers.patience import PATIENCE, soon
from tests.suite.helpers.served import client_config, free_endpoint


def test_services_are_asked_in_turns_and_least_first(alone: zenoh.Session) -> None:
    tokens = {
        name: alone.liveliness().declare_token(server_key("r", name)) for name in ("a", "b", "c")
    }
    servers = LiveServers(alone, "r", PATIENCE)
    assert soon(lambda: len(servers.names()) == 3)
    turns = [servers.next() for _ in range(6)]
    assert sorted(turns[:3]) == ["a", "b", "c"]
    assert turns[:3] == turns[3:]
    with servers.asking("a"), servers.asking("b"):
        assert [servers.next() for _ in range(3)] == ["c"] * 3
        assert {servers.next(["c"]) for _ in range(4)} == {"a", "b"}
        with servers.asking("c"), servers.asking("c"):
            assert {servers.next() for _ in range(4)} == {"a", "b"}
    assert servers.next(["a", "b", "c"]) is None
    # one that has not answered in time is asked if there is no other
    servers.doubt("a")
    assert {servers.next() for _ in range(6)} == {"b", "c"}
    assert servers.next(["b", "c"]) == "a"
    tokens["b"].undeclare()
    assert soon(lambda: set(servers.names()) == {"a", "c"})
    assert servers.next(["a"]) == "c"
    servers.close()


def test_a_service_says_what_others_of_its_robot_do() -> None:
    """Linked to it, both work; behind a router, the nearest does."""
    router, other = free_endpoint(), free_endpoint()
    relay = zenoh_config(mode="router", listen=[router], multicast=False)
    peer = zenoh_config(mode="peer", listen=[other], multicast=False)
    linked = zenoh_config(
        mode="peer", connect=[other], settings=["listen/endpoints:[]"], multicast=False
    )
    with (
        open_session(relay),
        open_session(client_config(router)) as first,
        open_session(client_config(router)) as second,
        open_session(peer) as third,
        open_session(linked) as fourth,
    ):
        assert rivals_in_words(second, "r", PATIENCE) is None
        held = [
            each.liveliness().declare_token(server_key("r", str(each.info.zid())))
            for each in (first, third)
        ]
        said: list[str] = []

        def heard(session: zenoh.Session) -> bool:
            words = rivals_in_words(session, "r", PATIENCE)
            said[:] = [] if words is None else [words]
            return bool(said)

        assert soon(lambda: heard(second))
        assert said[0].startswith("another service of r is behind a router: a question gets one")
        assert soon(lambda: heard(fourth))
        assert said[0].startswith("another service of r is linked to this one: a question to one")
        assert len(held) == 2
