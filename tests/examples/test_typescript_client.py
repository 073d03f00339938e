"""The client in TypeScript: it is strictly typed, and reads what the client in Python reads."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh

from service import CruxClient, PlanRequest, SetPointsRequest, StreamRequest
from service.wire import decode_request
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.patience import PATIENCE
from tests.suite.helpers.remote_api import RemoteApi
from tests.suite.helpers.served import client_config, free_endpoint
from tests.suite.problems import problem

pytestmark = pytest.mark.slow

SOURCES = ROOT / "examples" / "typescript"
STANCE = ROOT / "service" / "examples" / "wall-300.json"
STEPS, SWAY = 20, 8.0
"""As in the client's source."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the example with its packages, built."""
    if shutil.which("npm") is None or shutil.which("node") is None:
        pytest.skip("npm and Node.js are not installed")
    folder = tmp_path_factory.mktemp("typescript") / "client"
    shutil.copytree(SOURCES, folder, ignore=shutil.ignore_patterns("node_modules", "build"))
    installed = npm(folder, "install", "--no-audit", "--no-fund", "--fetch-retries=0")
    if installed.returncode:
        pytest.skip(f"npm cannot install the packages: {installed.stderr[-300:]}")
    checked = npm(folder, "exec", "--", "tsc", "--noEmit")
    assert checked.returncode == 0, checked.stdout
    built = npm(folder, "run", "build")
    assert built.returncode == 0, built.stdout
    return folder


def npm(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["npm", *words], cwd=folder, capture_output=True, text=True, check=False, timeout=PATIENCE
    )


@contextmanager
def plugin(endpoint: str, folder: Path) -> Iterator[str]:
    """The plugin of a router where there is one, its stand-in otherwise; yields the WebSocket."""
    zenohd = shutil.which("zenohd")
    port = free_endpoint().rpartition(":")[2]
    if zenohd is not None:
        settings = {
            "mode": "router",
            "listen": {"endpoints": [free_endpoint()]},
            "connect": {"endpoints": [endpoint]},
            "scouting": {"multicast": {"enabled": False}},
            "plugins_loading": {"enabled": True},
            "plugins": {"remote_api": {"websocket_port": f"127.0.0.1:{port}"}},
        }
        file = folder / "router.json5"
        file.write_text(json.dumps(settings), encoding="utf-8")
        with (folder / "router.log").open("w+") as log:
            router = subprocess.Popen([zenohd, "-c", str(file)], stdout=log, stderr=log)
            try:
                yield f"ws/127.0.0.1:{port}"
            finally:
                router.kill()
                router.wait()
    else:
        with zenoh.open(client_config(endpoint)) as session, RemoteApi(session) as served:
            yield served.locator


@pytest.fixture(scope="module")
def locator(endpoint: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with plugin(endpoint, tmp_path_factory.mktemp("router")) as found:
        yield found


def run(project: Path, locator: str, stance: Path) -> subprocess.CompletedProcess[str]:
    return npm(project, "start", "--silent", "--", locator, str(stance))


def wrench_at(number: int, centre: tuple[float, ...]) -> tuple[float, ...]:
    return (centre[0] + SWAY * math.sin(2 * math.pi * number / STEPS), *centre[1:])


def test_it_prints_what_the_client_in_python_reads(
    project: Path, endpoint: str, locator: str
) -> None:
    done = run(project, locator, STANCE)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    request = decode_request(STANCE.read_bytes(), PlanRequest)
    with CruxClient(client_config(endpoint)) as client:
        plan = client.plan(request)
        stream = client.stream(StreamRequest(v=1, stance=request.stance))
        points = [
            client.set_points(
                SetPointsRequest(
                    v=1, stream=stream.stream, body_wrench=wrench_at(n, stream.body_wrench)
                )
            )
            for n in range(STEPS)
        ]
    assert any(line[:2] == ["robosimian:", "crux"] for line in lines)
    table = {line[0]: line[1:] for line in lines if len(line) == 6}
    for hand in plan.hands:
        shown = [f"{finger.tendon_tension:.1f}" for finger in hand.fingers]
        assert table[hand.limb] == [*shown, f"{hand.utilisation:.3f}"]
    (margin,) = (line for line in done.stdout.splitlines() if line.startswith("optimal: "))
    # the load factor is asked for by the client
    assert margin.startswith(f"optimal: utilisation {plan.utilisation:.3f}, load factor 1.04")

    told = [line for line in lines if line[-2:-1] == ["skipped"]]
    numbers = [int(line[0]) for line in told]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] == STEPS - 1
    for number, line in zip(numbers, told, strict=True):
        first = points[number].hands[0]
        assert line[1] == first.limb
        # blends depend on when plans near the wrench were found
        assert [float(x) for x in line[2:6]] == pytest.approx(first.tensions, abs=0.5)


def test_an_error_of_the_service_ends_it(project: Path, locator: str, tmp_path: Path) -> None:
    message = json.loads(STANCE.read_text("utf-8"))
    message["stance"]["hands"][0]["hold"]["diameter"] = -1.0
    file = tmp_path / "wrong.json"
    file.write_text(json.dumps(message), encoding="utf-8")
    done = run(project, locator, file)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("invalid: stance.hands[0].hold.diameter: ")


def test_where_no_plan_is_it_says_why(project: Path, locator: str, tmp_path: Path) -> None:
    file = tmp_path / "infeasible.json"
    file.write_text(json.dumps(problem("infeasible/infeasible-4").request), encoding="utf-8")
    done = run(project, locator, file)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("infeasible: ")
