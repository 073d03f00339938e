"""``crux serve``, ``query`` and ``demo``: real sessions, and what cannot be had is a line."""

from __future__ import annotations

import io
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
import zenoh

from hand_models import InvalidInputError
from service import CruxClient, NoServiceError
from service.commands.cli import run_command_line
from service.commands.stances import read_request
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import (
    BAD_INPUT,
    DONE,
    FAILED,
    OVERLOADED,
    complaint,
    result,
)
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.processes import begun
from tests.suite.helpers.requests import (
    HEAVY,
    put,
    wall_request,
)
from tests.suite.helpers.served import Served, client_config, free_endpoint


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    server = Served(free_endpoint(), "--workers", "1")
    yield server
    server.process.terminate()
    server.process.communicate()


def flags_to(endpoint: str) -> list[str]:
    flags = ["-m", "client", "-e", endpoint, "--no-multicast-scouting"]
    return [*flags, "--timeout", str(PATIENCE)]


def test_query_and_serve(served, stance_file, capfd):
    flags = flags_to(served.endpoint)
    assert run_command_line(["query", stance_file(wall_request()), *flags, "--json"]) == DONE
    reply = result(capfd)
    assert (reply["status"], reply["load_factor"] > 1.0) == ("optimal", True)
    assert reply["prices"]


def test_a_query_from_standard_input(served, capfd, monkeypatch):
    heavy = io.BytesIO(json.dumps(wall_request(HEAVY)).encode())
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=heavy))
    assert run_command_line(["query", "-", *flags_to(served.endpoint)]) == OVERLOADED
    out, err = capfd.readouterr()
    assert err == ""
    assert out.startswith("OVERLOADED")


def test_what_the_service_refuses_is_bad_input(served, stance_file, capfd):
    twice = put(wall_request(), ("stance", "hands", 1, "limb"), "front_right")
    flags = flags_to(served.endpoint)
    assert run_command_line(["query", stance_file(twice), *flags, "--json"]) == BAD_INPUT
    assert complaint(capfd).startswith("crux: stance.hands[1].limb: limb 'front_right' appears")


def test_an_endpoint_that_is_taken_is_not_served(served, capfd):
    assert (
        run_command_line(["serve", "-l", served.endpoint, "--no-multicast-scouting", "--json"])
        == BAD_INPUT
    )
    told = complaint(capfd)
    assert told.startswith(f"crux: --listen: {served.endpoint} cannot be opened: Address already")


def test_a_query_where_nobody_listens(stance_file, capfd):
    flags = flags_to(free_endpoint())
    assert run_command_line(["query", stance_file(wall_request()), *flags, "--json"]) == FAILED
    out, err = capfd.readouterr()
    assert out == ""
    assert err.splitlines()[-1].startswith("crux: no zenoh session: ")
    assert "start a service with `crux serve`" in err
    assert "--wait" in err


def test_zenoh_may_talk_but_not_on_standard_output(stance_file):
    arguments = [
        "query",
        stance_file(wall_request()),
        "--no-multicast-scouting",
        "-l",
        free_endpoint(),
    ]
    asked = subprocess.run(
        [sys.executable, "-m", "service", *arguments, "--json"],
        capture_output=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "RUST_LOG": "debug"},
        timeout=PATIENCE,
        check=False,
    )
    assert (asked.returncode, asked.stdout) == (FAILED, b"")
    assert b"DEBUG" in asked.stderr
    # colours are for terminals
    assert b"\x1b[" not in asked.stderr
    told = asked.stderr.splitlines()[-1]
    assert told.startswith(
        b"crux: no service answers at crux/robosimian/plan: this session is connected to nobody; "
        b"start a service with `crux"
    )


@pytest.mark.parametrize("mode", ["client", pytest.param("peer", marks=pytest.mark.slow)])
def test_a_query_waits_for_a_service_that_is_not_there_yet(mode, stance_file):
    endpoint = free_endpoint()
    flags = ["-m", mode, "-e", endpoint, "--no-multicast-scouting", "--wait", str(PATIENCE)]
    asked = begun("query", stance_file(wall_request()), *flags, "--json")
    server = Served(endpoint, "--workers", "1")
    try:
        out, err = asked.communicate(timeout=PATIENCE)
    finally:
        server.process.kill()
        server.process.communicate()
    assert (asked.returncode, err) == (DONE, b"")
    assert json.loads(out)["status"] == "optimal"


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_a_service_that_does_not_come_is_waited_for_no_longer(mode, stance_file, capfd):
    flags = ["-m", mode, "-e", free_endpoint(), "--no-multicast-scouting", "--wait", "0.3"]
    assert run_command_line(["query", stance_file(wall_request()), *flags]) == FAILED
    told = complaint(capfd)
    assert told.startswith("crux: no service of robosimian within 0.3 s")
    assert "start a service with `crux serve`" in told


@pytest.mark.parametrize("wait", ["-1", "nan", "soon", "1e7"])
def test_how_long_is_waited_is_a_number_of_seconds(wait, capfd):
    assert run_command_line(["query", "wall-300", "--wait", wait]) == BAD_INPUT
    assert "--wait" in complaint(capfd)


@pytest.mark.parametrize("wait", [-1.0, -1e-9, math.nan, math.inf, -math.inf, 1e308])
def test_how_long_a_client_waits_is_checked_before_it_does(wait):
    with pytest.raises(InvalidInputError, match="must be from 0 to") as caught:
        CruxClient(zenoh.Config(), wait=wait)
    assert caught.value.field == "wait"


def test_a_client_of_another_robot_s_service_waits_in_vain(served):
    with zenoh.open(client_config(served.endpoint)) as session:
        with pytest.raises(
            NoServiceError,
            match=r"no service of loris within 0\.2 s: services of robosimian are there",
        ):
            CruxClient(session, "loris", wait=0.2)
        assert not session.is_closed()
        with CruxClient(session, wait=PATIENCE) as client:
            assert client.plan(read_request("wall-300")).status == "optimal"


def test_a_configuration_stays_as_it_was():
    config = client_config(free_endpoint())
    before = str(config)
    with pytest.raises(NoServiceError, match=r"within 0\.1 s"):
        CruxClient(config, wait=0.1)
    assert str(config) == before


VALID = "valid is, for example, tcp/127.0.0.1:7447"


@pytest.mark.parametrize(
    ("flags", "line"),
    [
        (["--cfg", "colour:1"], "crux: --cfg: colour: unknown key; got '1'"),
        (["--cfg", "mode:["], "crux: --cfg: mode: JSON5, line 1, column 2: expected array,"),
        (["--cfg", "mode:5"], "crux: --cfg: mode: invalid type: integer `5`, expected either"),
        (["--cfg", "mode"], "crux: --cfg: KEY:VALUE is needed, such as mode:'client', got 'mode'"),
        (["-c", "/nowhere.json5"], "crux: --config: /nowhere.json5: No such file or directory"),
        (["-c", "/"], "crux: --config: /: Is a directory"),
        (["-l", "foo"], f"crux: --listen: 'foo' is not an endpoint (no protocol/address); {VALID}"),
        (
            ["-e", "foo"],
            f"crux: --connect: 'foo' is not an endpoint (no protocol/address); {VALID}",
        ),
        (["-l", "tcp/foo"], f"crux: --listen: 'tcp/foo' is not an endpoint (no port); {VALID}"),
        (
            ["-e", "tcp/[::1]:y"],
            "crux: --connect: 'tcp/[::1]:y' is not an endpoint ('y' is no port)",
        ),
        (["-m", "boss"], "crux: Invalid value for '-m' / '--mode': 'boss' is not one of"),
        *(
            (["--timeout", value], f"crux: Invalid value for '--timeout': {value} is not in the")
            for value in ("0.0", "-1.0", "nan", "inf")
        ),
    ],
)
def test_bad_flags(flags, line, stance_file, capfd):
    assert run_command_line(["query", stance_file(wall_request()), *flags]) == BAD_INPUT
    assert complaint(capfd).startswith(line)


def test_demo(tmp_path, capfd):
    picture = tmp_path / "demo.png"
    assert run_command_line(["demo", "-o", str(picture), "--json"]) in (DONE, OVERLOADED)
    assert result(capfd)["verified"] is True
    assert picture.read_bytes().startswith(b"\x89PNG")
