"""``crux view`` as a process: its address, its signals, and what it refuses."""

from __future__ import annotations

import json
import signal
import urllib.request

from service.commands.cli import run_command_line
from tests.suite.helpers.commands import BAD_INPUT, DONE, complaint
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.processes import begun


def test_it_prints_its_address_and_ends_with_ctrl_c(tmp_path):
    file = tmp_path / "moved.json"
    process = begun("view", "wall-300", "--no-browser", "--json", "-o", str(file))
    address = json.loads(process.stdout.readline())["address"]
    with urllib.request.urlopen(address, timeout=PATIENCE) as page:
        assert page.status == 200
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out) == (DONE, b"")
    assert err.decode().splitlines() == ["crux: Ctrl-C ends it", "crux: ended"]
    assert not file.exists()


def test_a_port_that_is_taken_is_refused(tmp_path, monkeypatch, capfd):
    import socket

    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        asked = ["view", "wall-300", "--no-browser", "--port", port]
        assert run_command_line(asked) == BAD_INPUT
    assert f"--port: port {port} cannot be had" in complaint(capfd)
