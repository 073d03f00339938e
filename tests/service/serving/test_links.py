"""Settings and sockets by which a client that does not read costs the others nothing."""

from __future__ import annotations

import os
import socket
import struct
from pathlib import Path

import pytest

from hand_models.base import LimitError
from service import CruxClient
from service.servers import asking
from service.serving import config, server, zenoh_config
from service.wire import LARGEST_REQUEST
from tests.service.serving.test_service import setting
from tests.suite.helpers.requests import plan_request
from tests.suite.helpers.served import lonely_config

LINGER = struct.pack("ii", 1, 10)
"""As zenoh sets it: closing waits for 10 s."""


def linger_of(link: socket.socket) -> tuple[int, ...]:
    return struct.unpack("ii", link.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8))


def descriptors() -> list[str]:
    return sorted(os.listdir("/dev/fd"))


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_connections_close_at_once_and_stay_open_until_then(host: str) -> None:
    with (
        socket.create_server((host, 0), family=family(host)) as listening,
        socket.create_connection(listening.getsockname()[:2]) as here,
        listening.accept()[0] as there,
    ):
        for each in (here, there):
            each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, LINGER)
        before = descriptors()
        for _ in range(50):
            server.close_at_once()
        # pipes and files among them
        assert descriptors() == before
        assert linger_of(here)[0] == linger_of(there)[0] == 0
        here.sendall(b"still open")
        assert there.recv(100) == b"still open"


def family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


@pytest.mark.parametrize("key", config.own_settings())
def test_settings_of_ours_give_way_to_a_file(key: str, tmp_path: Path) -> None:
    own = setting(zenoh_config(), key)
    assert own != setting(config.zenoh.Config(), key)
    other: object = [] if key == "qos/network" else 12_345
    *folders, name = key.split("/")
    # the file's own, and a flag's
    text = f'{{"{name}": {other}}}'
    for folder in reversed(folders):
        text = f'{{"{folder}": {text}}}'
    file = tmp_path / "zenoh.json5"
    file.write_text(text)
    expected = own if key == "qos/network" else other
    assert setting(zenoh_config(file=file), key) == expected
    assert setting(zenoh_config(settings=[f"{key}:{other}"]), key) == other


def test_every_request_that_is_allowed_is_taken_in() -> None:
    most = setting(zenoh_config(), "transport/link/rx/max_message_size")
    assert isinstance(most, int)
    assert LARGEST_REQUEST + 2**16 < most < 2 * LARGEST_REQUEST


def test_a_client_sends_nothing_that_no_service_takes_in(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(size: int, kind: type) -> None:
        raise LimitError(f"{size} bytes of {kind.__name__}")

    monkeypatch.setattr(asking, "check_size", refuse)
    refusal = pytest.raises(LimitError, match="bytes of PlanRequest")
    with CruxClient(lonely_config()) as client, refusal:
        client.plan(plan_request())
