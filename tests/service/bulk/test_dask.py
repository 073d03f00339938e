"""The same answers on a Dask cluster, whatever becomes of it."""

from __future__ import annotations

import itertools
import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from hand_models.base import CruxError
from planner import BodyGrid, PlaceGrid
from service import sweep
from service.bulk import answer_all
from service.bulk.chunks import BulkSettings
from service.commands.stances import read_request, read_route
from service.requests import ClimbEnd, ClimbRequest
from service.wire import ServiceName
from tests.service.bulk.test_evaluation import CASES, encoded, timeless
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.commands import FAILED
from tests.suite.helpers.processes import begun, ended, until, watched
from tests.suite.helpers.requests import HEAVY, wall_request

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def client() -> Iterator[object]:
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


def test_a_cluster_answers_to_the_last_digit_as_this_process_does(client):
    asked = encoded(CASES)
    here = [timeless(answer.payload) for answer in answer_all(asked, "here")]
    assert [timeless(answer.payload) for answer in answer_all(asked, client)] == here
    address = client.scheduler_info()["address"]
    assert [timeless(answer.payload) for answer in answer_all(asked, address)] == here
    # the client is its owner's
    assert client.status == "running"


def test_routes_and_sweeps_come_to_the_same_on_a_cluster(client):
    route = read_route("six-moves")
    asked = [msgspec.structs.replace(route, id=str(i)) for i in range(3)]
    here, there = (list(answer_all(asked, on, kind=ServiceName.ROUTE)) for on in ("here", client))
    assert [answer.payload for answer in there] == [answer.payload for answer in here]
    wall, varied = read_request("wall-300"), ["load.mass=60:120:7"]
    alone, spread = (sweep(wall, varied, on=on) for on in ("here", client))
    assert spread.rows == alone.rows
    assert spread.borders == alone.borders


def test_climbs_come_to_the_same_on_a_cluster(client):
    ends = {"start": ClimbEnd(height=0.8), "goal": ClimbEnd(height=0.8)}
    grids = {
        "places": PlaceGrid(spacing=0.3),
        "bodies": BodyGrid(spacing=0.3, stand_offs=(0.6,)),
    }
    asked = [
        ClimbRequest(v=1, rock=f"small-wall:{seed}", at_least=1.2, **ends, **grids)
        for seed in (1, 2)
    ]
    here, there = (
        [json.loads(answer.payload) for answer in answer_all(asked, on, kind=ServiceName.CLIMB)]
        for on in ("here", client)
    )
    for reply in (*here, *there):
        del reply["seconds"]
    assert there == here
    assert [reply["status"] for reply in here] == ["none", "found"]


def test_questions_without_end_go_to_a_cluster_as_they_are_answered(client):
    taken = 0

    def endless() -> Iterator[bytes]:
        nonlocal taken
        for taken in itertools.count(1):
            yield msgspec.json.encode({"v": 1, "id": str(taken)})

    answers = answer_all(endless(), client)
    found = [json.loads(answer.payload)["id"] for answer in itertools.islice(answers, 500)]
    answers.close()
    assert found == [str(i) for i in range(1, 501)]
    assert taken < 5000


def test_a_worker_that_is_killed_is_replaced(client):
    asked = encoded([wall_request(HEAVY + i / 100) | {"id": str(i)} for i in range(120)])
    killed, found = [], []
    for answer in answer_all(asked, client):
        found.append(timeless(answer.payload))
        if len(found) == 10:
            killed = list(client.run(os.getpid).values())[:1]
            os.kill(killed[0], signal.SIGKILL)
    assert killed
    assert [reply["id"] for reply in found] == [str(i) for i in range(120)]
    assert {reply["status"] for reply in found} == {"overloaded"}


def test_a_cluster_without_workers_is_told_and_waited_for(monkeypatch):
    settings = BulkSettings(check_interval=0.05)
    monkeypatch.setattr("service.bulk.pools.BULK_SETTINGS", settings)
    asked = encoded([wall_request(HEAVY + i / 100) | {"id": str(i)} for i in range(60)])
    told = []
    cluster = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster, set_as_default=False) as client:

        class Hire(logging.Handler):
            def emit(self, record: logging.LogRecord) -> None:
                told.append(record.getMessage())
                cluster.scale(1)

        log, hire = logging.getLogger("service.bulk.pools"), Hire()
        log.addHandler(hire)
        try:
            answers = answer_all(asked, client)
            found = [next(answers)]
            cluster.scale(0)
            while client.nthreads():
                time.sleep(0.01)
            found += answers
        finally:
            log.removeHandler(hire)
    assert [json.loads(answer.payload)["id"] for answer in found] == [str(i) for i in range(60)]
    assert told
    assert "has no worker left: waiting for one" in told[0]
    assert "--resume" in told[0]


def test_no_scheduler_is_told(monkeypatch):
    settings = BulkSettings(scheduler_timeout=0.5)
    monkeypatch.setattr("service.bulk.pools.BULK_SETTINGS", settings)
    with pytest.raises(CruxError, match=r"no Dask scheduler with a worker answers at tcp://"):
        list(answer_all([b"{}"], "tcp://127.0.0.1:9"))


def dask(*words: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words, "--no-dashboard"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


@watched
def test_a_scheduler_that_goes_away_leaves_what_is_whole(tmp_path: Path):
    contact, path, table = (tmp_path / name for name in ("scheduler.json", "q.jsonl", "t.csv"))
    state = tmp_path / "t.csv.jsonl"
    asked = [wall_request(HEAVY + i / 100) | {"id": str(i)} for i in range(2000)]
    path.write_text("".join(json.dumps(each) + "\n" for each in asked))
    scheduler = dask(
        "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(contact)
    )
    until(lambda: contact.exists() and contact.read_text().endswith("}"), scheduler)
    address = json.loads(contact.read_text())["address"]
    worker = dask("worker", address, "--nthreads", "1")
    try:
        batch = begun("batch", str(path), "-o", str(table), "--dask", address)
        until(lambda: state.exists() and state.read_bytes().count(b"\n") > 10, batch)
        scheduler.kill()
        _, error = batch.communicate()
        rows = state.read_bytes().count(b"\n") - 1
        kept = f"{rows} of 2000 requests are answered in {state}; --resume goes on"
        told = f"crux: the Dask scheduler at {address} is gone; {kept}\n"
        assert (batch.returncode, error.decode()) == (FAILED, told)
    finally:
        for process in (scheduler, worker):
            process.terminate()
            process.wait()


@watched
def test_an_interrupt_from_a_shell_is_one_line(tmp_path: Path):
    path, table, state = (tmp_path / name for name in ("q.jsonl", "t.csv", "t.csv.jsonl"))
    asked = [wall_request(HEAVY + i / 100) | {"id": str(i)} for i in range(4000)]
    path.write_text("".join(json.dumps(each) + "\n" for each in asked))
    batch = begun("batch", str(path), "-o", str(table), "--dask", "local")
    until(lambda: state.exists() and state.read_bytes().count(b"\n") > 10, batch)
    # a shell sends it to all processes
    os.killpg(batch.pid, signal.SIGINT)
    status, error = ended(batch)
    rows = state.read_bytes().count(b"\n") - 1
    kept = f"{rows} of 4000 requests are answered in {state}"
    assert (status, error) == (FAILED, f"crux: interrupted: {kept}; --resume goes on\n")
