"""Studies of what one client costs the others: by starving them, or by not reading."""

from __future__ import annotations

import itertools
import os
import random
import signal
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import click
import msgspec
from rich.console import Console

from benchmarks.load.asking import PLAN, WRENCH_SPACE, Client, Tally, at_once, new_stances
from service import CruxClient
from service.requests import ClimbEnd, ClimbRequest
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.requests import wall_request
from tests.suite.helpers.served import Served, client_config, free_endpoint

SPIN = "print('on', flush=True)\nwhile True: pass"
console = Console()


def starving(half_planes: int, seed: int = 0) -> Iterator[bytes]:
    """Small legal questions that take far longer than they allow."""
    rng = random.Random(seed)
    while True:
        stance = wall_request()["stance"]
        hand = stance["hands"][0]
        hand["hold"]["diameter"] = rng.uniform(0.25, 0.35)
        numbers = {"shear_limit": 60.0, "pull_off_limit": 15.0, "pull_off_angle": 0.7}
        hand["surface"] = numbers | {"half_planes": half_planes}
        asked = {"v": 1, "stance": stance, "limb": hand["limb"], "want": ["vertices"]}
        yield msgspec.json.encode(asked | {"deadline": 0.05})


@click.command()
@click.argument("endpoint")
@click.option("--half-planes", default=3)
def starve(endpoint: str, half_planes: int) -> None:
    """Ask one small legal question after another that overruns its deadline, until killed."""
    client, tally = Client(endpoint, timeout=60.0), Tally()
    print("on", flush=True)
    for payload in starving(half_planes):
        start = time.perf_counter()
        tally.note(client.ask(WRENCH_SPACE, payload), time.perf_counter() - start)


@click.command()
@click.argument("endpoint")
@click.argument("count", type=int)
def greedy(endpoint: str, count: int) -> None:
    """Ask for large replies by some clients, each all the time, until killed."""
    # its reply has a megabyte, which a process has at once when it knows the question
    payload = msgspec.json.encode(msgspec.json.decode(next(starving(3))) | {"deadline": 60.0})

    def ask(_: int) -> None:
        client = Client(endpoint, timeout=60.0)
        while True:
            client.ask(WRENCH_SPACE, payload)

    print("on", flush=True)
    at_once(count, ask)


@contextmanager
def process(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of this module, or other Python, until this is left."""
    made = subprocess.Popen(
        [sys.executable, *command],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    try:
        assert made.stdout is not None
        assert made.stdout.readline()
        yield made
    finally:
        made.kill()
        made.wait()


@contextmanager
def spinning(count: int) -> Iterator[None]:
    """Busy processes on the machine."""
    with ExitStack() as open_:
        for _ in range(count):
            open_.enter_context(process("-c", SPIN))
        yield


def polite(endpoint: str, seconds: float, seed: int, clients: int = 2) -> Tally:
    """Ask new stances, and known ones, by clients that wait for each answer."""
    tally = Tally(seconds=seconds)
    until = time.perf_counter() + seconds

    def ask(number: int) -> None:
        client, new = Client(endpoint), new_stances(seed + number)
        known = itertools.cycle([next(new)])
        for payload in itertools.chain.from_iterable(zip(new, known, strict=False)):
            if time.perf_counter() >= until:
                break
            start = time.perf_counter()
            tally.note(client.ask(PLAN, payload), time.perf_counter() - start)
        client.close()

    at_once(clients, ask)
    return tally


def ratios(without: list[Tally], with_: list[Tally]) -> tuple[float, float]:
    """Median ratios of the rates, and of the 99th percentiles."""
    pairs = list(zip(without, with_, strict=True))
    rate = statistics.median(b.rate / a.rate for a, b in pairs)
    return rate, statistics.median(b.percentile(0.99) / a.percentile(0.99) for a, b in pairs)


@click.command()
@click.option("--seconds", default=15.0, show_default=True, help="Of each half of a pair.")
@click.option("--pairs", default=3, show_default=True)
@click.option("--busy", default=8, show_default=True, help="Busy processes on the machine.")
@click.option("--half-planes", default=3, show_default=True)
def starved(seconds: float, pairs: int, busy: int, half_planes: int) -> None:
    """Compare what polite clients get beside one that starves them, and without it, in turns."""
    without, with_ = [], []
    server = Served(free_endpoint())
    try:
        with spinning(busy):
            polite(server.endpoint, 5.0, 10_000)
            for i in range(pairs):
                without.append(polite(server.endpoint, seconds, 100 * i))
                console.print(f"without: {without[-1].in_words()}")
                more = ("-m", "benchmarks.load", "starve", server.endpoint)
                with process(*more, "--half-planes", str(half_planes)):
                    with_.append(polite(server.endpoint, seconds, 100 * i + 50))
                console.print(f"beside it: {with_[-1].in_words()}")
    finally:
        _, err = server.stop(signal.SIGTERM)
    rate, late = ratios(without, with_)
    console.print(f"processes ended: {err.count('another takes its place')}")
    console.print(f"goodput beside it / without: {rate:.2f}; p99: {late:.2f}")


@click.command()
@click.argument("endpoint")
def climb(endpoint: str) -> None:
    """Let the service search for a climb, from the bottom of a wall to its top, until killed."""
    ends = ClimbEnd(height=1.0), ClimbEnd(height=2.0)
    asked = ClimbRequest(v=1, rock="leaning-wall", start=ends[0], goal=ends[1])
    with CruxClient(client_config(endpoint)) as client:
        client.climb(asked, lambda _: print("on", flush=True))


@click.command()
@click.option("--seconds", default=15.0, show_default=True, help="Of each half of a pair.")
@click.option("--pairs", default=3, show_default=True)
@click.option("--clients", default=1, show_default=True, help="That ask for plans.")
def climbed(seconds: float, pairs: int, clients: int) -> None:
    """Compare what polite clients get beside a search for a climb, and without it, in turns."""
    without, with_ = [], []
    server = Served(free_endpoint())
    try:
        polite(server.endpoint, 5.0, 10_000, clients)
        for i in range(pairs):
            without.append(polite(server.endpoint, seconds, 100 * i, clients))
            console.print(f"without: {without[-1].in_words()}")
            with process("-m", "benchmarks.load", "climb", server.endpoint):
                with_.append(polite(server.endpoint, seconds, 100 * i + 50, clients))
            console.print(f"beside it: {with_[-1].in_words()}")
    finally:
        server.stop(signal.SIGTERM)
    rate, late = ratios(without, with_)
    console.print(f"goodput beside it / without: {rate:.2f}; p99: {late:.2f}")


@click.command()
@click.option("--seconds", default=15.0, show_default=True, help="Of each half of a pair.")
@click.option("--pairs", default=2, show_default=True)
@click.option("--clients", default=24, show_default=True)
def unread(seconds: float, pairs: int, clients: int) -> None:
    """Compare a polite client beside clients that do not read with one beside as many that do.

    Each half has a service of its own, which is ended by SIGTERM while the polite client waits.
    """
    reading, not_reading = [], []
    for i in range(pairs):
        for stopped, found in ((False, reading), (True, not_reading)):
            server = Served(free_endpoint())
            command = ("-m", "benchmarks.load", "greedy", server.endpoint, str(clients))
            with process(*command) as others:
                time.sleep(3.0)
                if stopped:
                    others.send_signal(signal.SIGSTOP)
                time.sleep(2.0)
                found.append(polite(server.endpoint, seconds, 100 * i, clients=1))
                last = at_the_end(server)
            name = "that do not read" if stopped else "that read"
            console.print(
                f"beside {clients} {name}: {found[-1].in_words()}; at SIGTERM {dict(last)}"
            )
    rate, late = ratios(reading, not_reading)
    console.print(f"goodput beside those that do not read / that do: {rate:.2f}; p99: {late:.2f}")


def at_the_end(server: Served, waiting: int = 8) -> Counter[str]:
    """End a service while a polite client's questions wait; return what these got."""
    client, tally, new = Client(server.endpoint, timeout=60.0), Tally(), new_stances(7)
    for _ in range(waiting):
        client.send(tally, PLAN, next(new), "application/json")
    server.stop(signal.SIGTERM)
    until = time.perf_counter() + 60.0
    while sum(tally.statuses.values()) < waiting and time.perf_counter() < until:
        time.sleep(0.05)
    client.close()
    return tally.statuses
