"""A study of two services over hours: everything is asked, over TLS, and processes are killed."""

from __future__ import annotations

import itertools
import os
import random
import signal
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from math import sin
from pathlib import Path

import click
import msgspec
import numpy as np
import zenoh
from rich.console import Console
from rich.table import Table

from benchmarks.load.asking import Client, Tally, health, mixed, new_stances
from benchmarks.load.bulk import memory_of
from hand_models.base import CruxError
from service import CruxClient, SetPointsRequest
from service.commands.stances import read_request
from service.publishing import PublishedStream
from service.recording import Recording
from service.requests import PlanRequest, StreamRequest
from service.ros2.definitions import package_folder
from service.security import KeyFolder, Role
from service.serving import open_session, zenoh_config
from service.wire import Format, decode_request
from tests.suite.helpers.requests import wall_request
from tests.suite.helpers.ros_peer import RosPeer
from tests.suite.helpers.served import Served, free_endpoint

__all__ = ["soak"]

ROBOT, DOMAIN = "robosimian", 0
PART = 0.2
"""Share of the time over which memory is taken, once all is warm (after as much) and at the end."""

console = Console()


class Site:
    """Two services behind a router, by keys over TLS; both record, the first is a ROS 2 node, too.

    Attributes
    ----------
    servers : list of Served
    files : list of Path
        Their recordings.
    """

    def __init__(self, open_: ExitStack) -> None:
        self._open = open_
        folder = Path(open_.enter_context(tempfile.TemporaryDirectory()))
        self._folder = folder / "keys"
        endpoint = free_endpoint().replace("tcp/", "tls/")
        hosts, port = ("127.0.0.1",), int(endpoint.rpartition(":")[2])
        keys = KeyFolder.make(self._folder, ROBOT, hosts, port, 30, DOMAIN)
        keys.add("relay", Role.ROUTER, hosts, 30)
        open_.enter_context(open_session(zenoh_config(file=self._folder / "relay.json5")))
        own = ("-c", str(self._folder / "service.json5"))
        ros = ("--ros2", "--domain", str(DOMAIN))
        self.files = [folder / f"{name}.mcap" for name in ("first", "second")]
        self.servers = [
            Served(endpoint, *own, *more, "--record", str(file), routed=True)
            for more, file in zip((ros, ()), self.files, strict=True)
        ]

    def config(self, name: str) -> zenoh.Config:
        """Of a client of a name; its configuration has the router's address."""
        return zenoh_config(file=self._folder / f"{name}.json5")

    def session(self, name: str) -> zenoh.Session:
        return self._open.enter_context(open_session(self.config(name)))

    def memory(self) -> int:
        return sum(memory_of(each.process.pid) for each in self.servers)


@dataclass
class Asking:
    """What asks until it is over, and counts."""

    stop: threading.Event
    tallies: dict[str, Tally]

    def repeat(self, name: str, ask: Callable[[int], object], rate: float = 0.0) -> None:
        """Ask again and again, at a rate [1/s] or one after another."""
        tally, start = self.tallies.setdefault(name, Tally()), time.perf_counter()
        for number in itertools.count():
            if self.stop.is_set():
                break
            if rate:
                time.sleep(max(start + number / rate - time.perf_counter(), 0.0))
            asked = time.perf_counter()
            try:
                reply = ask(number)
            except CruxError as error:
                tally.statuses[error.kind] += 1
            else:
                took = time.perf_counter() - asked
                if isinstance(reply, zenoh.Reply) or reply is None:
                    tally.note(reply, took)
                elif isinstance(reply, str):
                    tally.statuses[reply] += 1
                    tally.times.append(took)
                else:
                    tally.statuses["good"] += 1
                    tally.times.append(took)
            tally.slowest = max(tally.slowest, time.perf_counter() - asked)


def plans(client: CruxClient) -> Callable[[int], object]:
    """Plans of new stances, by a client that spreads them."""
    payloads = new_stances(17)
    return lambda _: client.plan(decode_request(next(payloads), PlanRequest, Format.JSON))


def stream_of(request: StreamRequest) -> Callable[[int], tuple[float, ...]]:
    """Wrenches of a stream, up to 5 % less than it is held by."""
    assert request.body_wrench is not None
    middle = np.array(request.body_wrench)
    return lambda number: tuple((middle * (0.975 + 0.025 * sin(0.1 * number))).tolist())


def publishing(stream: PublishedStream, stop: threading.Event) -> Callable[[], dict[str, int]]:
    """Take what comes of a stream; return the function that tells the counts."""
    counts = {"answered": 0, "skipped": 0, "errors": 0}

    def receive() -> None:
        while not stop.is_set():
            found = stream.receive(0.2)
            if found is not None:
                counts["skipped"] += found.skipped
                counts["answered" if found.error is None else "errors"] += 1

    threading.Thread(target=receive, daemon=True).start()
    return lambda: (
        counts | {"replaced": stream.replaced, "lost": stream.lost, "declared": stream.declarations}
    )


@click.command()
@click.option("--minutes", default=10.0, show_default=True)
@click.option("--every", default=10.0, show_default=True, help="A process is killed [s].")
@click.option("--rate", default=50.0, show_default=True, help="Of set-points, and of wrenches.")
@click.option("--seed", default=0, show_default=True)
def soak(minutes: float, every: float, rate: float, seed: int) -> None:
    """Ask everything, with a process killed again and again; count, and watch the memory.

    Two services behind a router, which record, by keys over TLS: mixed questions of zenoh alone,
    plans spread over both, set-points and published wrenches at a rate, and plans by ROS 2.
    """
    rng, sizes, killed = random.Random(seed), list[tuple[float, int]](), 0
    stop, tallies = threading.Event(), dict[str, Tally]()
    asking = Asking(stop, tallies)
    with ExitStack() as open_:
        site = Site(open_)
        asked = read_request("wall-300")
        spread = open_.enter_context(
            CruxClient(site.session("planner"), timeout=30.0, spread=True, wait=60.0)
        )
        first = StreamRequest(v=1, stance=asked.stance, load=asked.load, limits=asked.limits)
        declared = spread.stream(first)
        wrench = stream_of(msgspec.structs.replace(first, body_wrench=tuple(declared.body_wrench)))
        published = open_.enter_context(spread.publish_stream(first))
        told = publishing(published, stop)
        ros, session = RosPeer(package_folder()), site.session("ros")
        text = msgspec.json.encode(wall_request()).decode()

        def set_points(number: int) -> object:
            return spread.set_points(
                SetPointsRequest(v=1, stream=declared.stream, body_wrench=wrench(number))
            )

        def by_ros(_: int) -> object:
            kind = "crux_msgs/srv/Plan"
            name = f"/crux/{ROBOT}/plan"
            try:
                answer = ros.call(session, DOMAIN, name, kind, {"request": text})
            except ValueError:
                # not one reply
                return None
            # an error is a reply, too
            return answer["error"]["kind"] or "good"

        threads = []
        for i in range(2):
            client = Client.of(site.session("planner"), timeout=60.0)
            questions = mixed(seed * 100 + i)
            work = (f"mixed {i}", lambda _, c=client, q=questions: c.ask(*next(q)))
            threads.append(threading.Thread(target=asking.repeat, args=work))
        for name, ask, often in (
            ("plans, spread", plans(spread), 0.0),
            ("set-points", set_points, rate),
            ("published", lambda number: published.publish(wrench(number)), rate),
            ("ROS 2", by_ros, 2.0),
        ):
            threads.append(threading.Thread(target=asking.repeat, args=(name, ask, often)))
        for thread in threads:
            thread.start()
        operator = Client.of(site.session("observer"), timeout=60.0)
        names = sorted(spread._servers.names()) if spread._servers is not None else []
        start = time.perf_counter()
        while (now := time.perf_counter() - start) < 60.0 * minutes:
            time.sleep(min(every, 60.0 * minutes - now))
            sizes.append((time.perf_counter() - start, site.memory()))
            there = health(operator, rng.choice(names))["processes"]
            if ready := [each for each in there if each["state"] != "starting"]:
                os.kill(rng.choice(ready)["pid"], signal.SIGKILL)
                killed += 1
        stop.set()
        for thread in threads:
            thread.join()
        time.sleep(1.0)
        wrenches = told()
        for server in site.servers:
            server.stop(signal.SIGTERM)
        codes = [server.process.returncode for server in site.servers]
        recordings = [Recording(file) for file in site.files]
        counts = [sum(1 for _ in each.questions()) for each in recordings]
        whole = all(each.whole and not each.damaged for each in recordings)
    _tell(tallies, minutes, killed, sizes)
    console.print(f"published wrenches: {wrenches}")
    console.print(f"exit status of the services at SIGTERM: {codes}")
    console.print(
        f"questions recorded: {counts}; the files are {'whole' if whole else 'not whole'}"
    )


def _tell(
    tallies: dict[str, Tally], minutes: float, killed: int, sizes: list[tuple[float, int]]
) -> None:
    title = f"{minutes:g} minutes, {killed} processes killed"
    table = Table("", "asked", "no reply", "replies", "p50 [ms]", "slowest [s]", title=title)
    for name, tally in sorted(tallies.items()):
        statuses = dict(tally.statuses)
        none = sum(statuses.pop(each, 0) for each in ("no reply", "no_service", "timeout"))
        middle = f"{tally.percentile(0.5):.1f}" if tally.times else "-"
        words = ", ".join(f"{count} {kind}" for kind, count in statuses.items())
        count = str(tally.statuses.total())
        table.add_row(name, count, str(none), words, middle, f"{tally.slowest:.2f}")
    console.print(table)
    length = 60.0 * minutes
    early = [size for at, size in sizes if PART * length <= at <= 2.0 * PART * length]
    late = [size for at, size in sizes if at >= (1.0 - PART) * length]
    before, after = statistics.median(early), statistics.median(late)
    console.print(
        f"memory of both services with their processes: {before / 2**20:.0f} MB after "
        f"{100 * PART:.0f} to {200 * PART:.0f} % of the time, {after / 2**20:.0f} MB in the last "
        f"{100 * PART:.0f} %: {after / before:.2f}"
    )
