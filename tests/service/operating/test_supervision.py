"""What is said to systemd, over a real socket."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator

import pytest

from service.operating import supervised
from tests.suite.helpers.patience import PATIENCE


@pytest.fixture(params=["file", "abstract"])
def listener(request, tmp_path, monkeypatch) -> Iterator[socket.socket]:
    name = str(tmp_path / "notify") if request.param == "file" else f"@crux-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as link:
        link.bind(name.replace("@", "\0"))
        link.settimeout(PATIENCE)
        monkeypatch.setenv("NOTIFY_SOCKET", name)
        yield link


def test_a_service_says_that_it_is_ready_and_that_it_stops(listener):
    with supervised(lambda: True):
        assert b"READY=1" in listener.recv(1000).split(b"\n")
    assert listener.recv(1000) == b"STOPPING=1"


def test_the_watchdog_is_fed_only_while_the_service_is_alive(listener, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "20000")
    monkeypatch.setenv("WATCHDOG_PID", str(os.getpid()))
    asked = []

    def is_alive() -> bool:
        asked.append(len(asked))
        return len(asked) != 2

    with supervised(is_alive):
        listener.recv(1000)
        assert [listener.recv(1000) for _ in range(3)] == [b"WATCHDOG=1"] * 3
        # of the second question nothing came
        assert len(asked) >= 4


def test_the_watchdog_of_another_process_is_not_fed(listener, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "1000")
    monkeypatch.setenv("WATCHDOG_PID", "1")
    with supervised(lambda: pytest.fail("asked")):
        listener.recv(1000)
    assert listener.recv(1000) == b"STOPPING=1"


@pytest.mark.parametrize("name", ["", "no-address", "/no/such/socket"])
def test_without_a_supervisor_nothing_is_said(monkeypatch, name):
    monkeypatch.setenv("NOTIFY_SOCKET", name)
    with supervised(lambda: True):
        pass
