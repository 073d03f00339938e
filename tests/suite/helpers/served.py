"""Real ``crux serve`` processes on TCP loopback."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh

from service.serving import open_session, zenoh_config
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE


def free_endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


class Served:
    """A ``crux serve`` process, to which clients connect; or one that is a client of a router."""

    def __init__(
        self, endpoint: str, *more: str, routed: bool = False, folder: Path = ROOT
    ) -> None:
        self.endpoint = endpoint
        linked = ["-m", "client", "-e"] if routed else ["-m", "peer", "-l"]
        flags = [*linked, endpoint, "--no-multicast-scouting", "--json", *more]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "service", "serve", *flags],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        )
        line = self.process.stdout.readline()
        assert line, self.process.stderr.read().decode()
        self.ready = json.loads(line)

    def stop(self, number: int) -> tuple[str, str]:
        """Send a signal; what the process had to say until its end."""
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=PATIENCE)
        return out.decode(), err.decode()


def lonely_config() -> zenoh.Config:
    """Configuration of a session that is its own whole network."""
    return zenoh_config(settings=["listen/endpoints:[]"], multicast=False)


@contextmanager
def lonely_session() -> Iterator[zenoh.Session]:
    """A session that is its own whole network."""
    with open_session(lonely_config()) as opened:
        yield opened


def client_config(endpoint: str) -> zenoh.Config:
    return zenoh_config(mode="client", connect=[endpoint], multicast=False)
