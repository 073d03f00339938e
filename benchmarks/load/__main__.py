"""Studies of the service under load: real ``crux serve`` processes, clients in others."""

from __future__ import annotations

import os
import signal
import statistics
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

import click
import zenoh
from rich.console import Console
from rich.table import Table

from benchmarks.load.asking import (
    PLAN,
    Asked,
    Client,
    Tally,
    at_once,
    dear_questions,
    health,
    new_stances,
    new_wrenches,
    percentile,
    random_plans,
    spoilt,
)
from benchmarks.load.bulk import bulk
from benchmarks.load.others import climb, climbed, greedy, process, starve, starved, unread
from benchmarks.load.published import echo_published, published_table
from benchmarks.load.slips import slips_table
from benchmarks.load.soak import soak
from hand_models.base import stores
from planner import processes as proc
from service.answering import dispatch
from tests.suite.helpers.served import Served, free_endpoint

ECHO = "echo/plan"
ROUNDS = 5
console = Console()


@contextmanager
def served(*flags: str) -> Iterator[Served]:
    """A service until this is left; then it has to end cleanly."""
    server = Served(free_endpoint(), *flags)
    try:
        yield server
    finally:
        started = time.perf_counter()
        _, err = server.stop(signal.SIGTERM)
        took = time.perf_counter() - started
        console.print(f"SIGTERM: status {server.process.returncode} after {took:.1f} s")
        # where it listens, and that it is ready
        if len(err.splitlines()) > 2:
            console.print(f"its log has {len(err.splitlines())} lines; the last: {err[-300:]}")


def other(command: str, endpoint: str) -> AbstractContextManager[subprocess.Popen[bytes]]:
    """A process of this module until this is left."""
    return process("-m", "benchmarks.load", command, endpoint)


@click.group()
def main() -> None:
    """The service under load."""


@main.command()
@click.argument("endpoint")
def dear(endpoint: str) -> None:
    """Ask the dearest legal questions without pause, until killed."""
    client = Client(endpoint, timeout=60.0)
    print("on", flush=True)
    for key, payload, encoding in dear_questions():
        client.ask(key, payload, encoding)


@main.command()
@click.argument("endpoint")
def echo(endpoint: str) -> None:
    """Reply to each query with as many bytes as a plan has, until killed."""
    reply_to_all(endpoint, b"x" * 33_000)


@main.command()
@click.argument("endpoint")
def refuse(endpoint: str) -> None:
    """Reply to each query with as many bytes as ``busy`` has, until killed."""
    reply_to_all(endpoint, b"x" * 150)


def reply_to_all(endpoint: str, reply: bytes) -> None:
    """Reply to each query alike, until killed."""
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", f'["{endpoint}"]')
    config.insert_json5("scouting/multicast/enabled", "false")

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(ECHO, reply)

    with zenoh.open(config) as session:
        session.declare_queryable(ECHO, answer, complete=True)
        print("on", flush=True)
        threading.Event().wait()


def times(client: Client, key: str, payloads: Iterator[bytes], count: int) -> list[float]:
    """How long each of some questions takes, one after another [s]."""
    found = []
    for _ in range(count):
        payload = next(payloads)
        start = time.perf_counter()
        reply = client.ask(key, payload)
        found.append(time.perf_counter() - start)
        assert reply is not None
        assert reply.ok is not None, reply.err.payload.to_string()
    return found


def in_process(payloads: Iterator[bytes], count: int) -> list[float]:
    """How long planning takes in this process, from bytes to bytes [s]."""
    found = []
    for _ in range(count):
        payload = next(payloads)
        start = time.perf_counter()
        assert dispatch.handle(PLAN, payload).good
        found.append(time.perf_counter() - start)
    return found


@main.command()
@click.option("--count", default=400, show_default=True, help="Questions a round.")
def latency(count: int) -> None:
    """Compare plans over loopback with a bare echo and planning in process; quiet, and beside."""
    table = Table("", "p50 [ms]", "p99 [ms]", title=f"medians of {ROUNDS} rounds of {count}")
    where = free_endpoint()
    with served() as server, other("echo", where):
        client, bare = Client(server.endpoint), Client(where)
        payloads = new_wrenches()
        times(client, PLAN, payloads, 50), in_process(payloads, 50)
        rounds: dict[str, list[list[float]]] = {}
        for _ in range(ROUNDS):
            rounds.setdefault("bare echo", []).append(times(bare, ECHO, payloads, count))
            rounds.setdefault("plan in process", []).append(in_process(payloads, count))
            rounds.setdefault("plan over loopback", []).append(times(client, PLAN, payloads, count))
        for _ in range(ROUNDS):
            with other("dear", server.endpoint):
                time.sleep(1.0)
                rounds.setdefault("plan, beside dear questions", []).append(
                    times(client, PLAN, payloads, count)
                )
                rounds.setdefault("bare echo, beside them", []).append(
                    times(bare, ECHO, payloads, count)
                )
    middle = {
        name: tuple(
            statistics.median(percentile(one, part) for one in all_) for part in (0.5, 0.99)
        )
        for name, all_ in rounds.items()
    }
    for name, (half, most) in middle.items():
        table.add_row(name, f"{half:.2f}", f"{most:.2f}")
    console.print(table)
    floor = middle["bare echo"][0] + middle["plan in process"][0]
    console.print(
        f"p50 over loopback / (echo + in process): {middle['plan over loopback'][0] / floor:.2f}"
    )
    beside, quiet = middle["plan, beside dear questions"][1], middle["plan over loopback"][1]
    console.print(f"p99 beside dear questions / quiet: {beside / quiet:.2f}")
    echoes = middle["bare echo, beside them"][1] / middle["bare echo"][1]
    console.print(f"the same of the bare echo: {echoes:.2f}")


@main.command()
@click.option("--count", default=1000, show_default=True, help="Random slips.")
def slips(count: int) -> None:
    """Time set-points after slips of one to three tiles beside a bare echo, and both under load."""
    where = free_endpoint()
    with served() as server, other("refuse", where):
        table = slips_table(
            server.endpoint, Client(where), ECHO, count, lambda: other("ask", server.endpoint)
        )
    console.print(table)


@main.command()
@click.argument("endpoint")
def echo_wrenches(endpoint: str) -> None:
    """Publish for each message as many bytes as set-points have, until killed."""
    echo_published(endpoint)


@main.command()
@click.option("--seconds", default=10.0, show_default=True)
@click.option("--rate", default=1000.0, show_default=True, help="Wrenches a second.")
def published(seconds: float, rate: float) -> None:
    """Publish wrenches at a rate, and messages to a bare echo; how old the answers are."""
    where = free_endpoint()
    with served() as server, other("echo-wrenches", where):
        console.print(published_table(server.endpoint, where, seconds, rate))


@main.command()
@click.argument("endpoint")
def ask(endpoint: str) -> None:
    """Ask for plans of one new stance after another, one at a time, until killed."""
    client = Client(endpoint, timeout=60.0)
    print("on", flush=True)
    for payload in new_stances():
        client.ask(PLAN, payload)


def rate(endpoint: str, seconds: float, clients: int, deep: int) -> float:
    """How many new stances are planned a second, by clients that each have some questions open."""
    counts = []
    until = time.perf_counter() + seconds

    def ask(seed: int) -> None:
        client, payloads, count = Client(endpoint), new_stances(seed), 0
        while time.perf_counter() < until:
            reply = client.ask(PLAN, next(payloads))
            count += reply is not None and reply.ok is not None
        counts.append(count)
        client.close()

    at_once(clients * deep, ask)
    return sum(counts) / seconds


@main.command()
@click.option("--seconds", default=10.0, show_default=True)
def throughput(seconds: float) -> None:
    """Compare how many new stances one and two processes plan a second."""
    ratios = []
    for _ in range(ROUNDS):
        found = []
        for workers in ("1", "2"):
            with served("--workers", workers) as server:
                rate(server.endpoint, 2.0, 2, 2)
                found.append(rate(server.endpoint, seconds, 2, 2))
        ratios.append(found[1] / found[0])
        console.print(f"one process {found[0]:.1f}/s, two {found[1]:.1f}/s: {ratios[-1]:.2f}")
    console.print(f"median {statistics.median(ratios):.2f}")


@main.command()
@click.option("--seconds", default=60.0, show_default=True)
@click.option("--times", "factor", default=5.0, show_default=True, help="Of what it can do.")
def overload(seconds: float, factor: float) -> None:
    """Ask several times as much as the service can answer, by four clients, and count.

    The questions cost those who ask and refuse them time on the same cores. So what the service
    answers while as many go to a bare replier is told, too.
    """
    where = free_endpoint()
    with served() as server, other("refuse", where):
        rate(server.endpoint, 3.0, 2, 2)
        capacity = rate(server.endpoint, 10.0, 2, 2)
        gap = 1.0 / (factor * capacity)
        aside = threading.Thread(target=flood, args=(where, ECHO, gap, 12.0, Tally()))
        aside.start()
        floor = rate(server.endpoint, 10.0, 2, 2)
        aside.join()
        tally = Tally()
        asked = flood(server.endpoint, PLAN, gap, seconds, tally)
    good = tally.in_time / seconds
    console.print(f"capacity {capacity:.1f}/s; asked {asked / seconds:.1f}/s for {seconds:g} s")
    console.print(f"answered {good:.1f}/s: {good / capacity:.2f} of the capacity")
    console.print(f"while as many go to a bare replier {floor:.1f}/s: {good / floor:.2f} of that")
    console.print(f"{dict(tally.statuses)} of {asked}")
    console.print(
        f"good ones p50 {tally.percentile(0.5):.0f} ms, p99 {tally.percentile(0.99):.0f} ms"
    )
    console.print(f"the generator was late by p99 {percentile(tally.late, 0.99):.1f} ms")


def flood(endpoint: str, key: str, gap: float, seconds: float, tally: Tally) -> int:
    """Ask at a steady pace by four clients; return how many questions, once all have replies."""
    clients = [Client(endpoint) for _ in range(4)]
    payloads, asked, start = new_stances(99), 0, time.perf_counter()
    while (now := time.perf_counter()) < start + seconds:
        due = start + asked * gap
        if now < due:
            time.sleep(due - now)
        tally.late.append(max(0.0, now - due))
        clients[asked % 4].send(tally, key, next(payloads), "application/json")
        asked += 1
    tally.in_time = tally.statuses["good"]
    while sum(tally.statuses.values()) < asked and time.perf_counter() < start + seconds + 40.0:
        time.sleep(0.1)
    for client in clients:
        client.close()
    return asked


@main.command()
@click.option("--count", default=20_000, show_default=True)
@click.option("--seed", default=1, show_default=True)
def fuzz(count: int, seed: int) -> None:
    """Send spoilt payloads; none may be left without a reply, none may be `internal`."""
    tally = Tally()
    with served() as server:
        clients = [Client(server.endpoint, timeout=60.0) for _ in range(2)]
        questions: list[Iterator[Asked]] = [spoilt(seed + i) for i in range(2)]

        def ask(i: int) -> None:
            for _ in range(count // 2):
                start = time.perf_counter()
                reply = clients[i].ask(*next(questions[i]))
                tally.note(reply, time.perf_counter() - start)

        at_once(2, ask)
        state = health(clients[0])
        for client in clients:
            client.close()
    console.print(f"{dict(tally.statuses)}; the slowest reply took {tally.slowest:.2f} s")
    console.print(f"last failure: {state['last_failure']}")


@main.command()
@click.option("--first", default=5_000, show_default=True)
@click.option("--last", default=20_000, show_default=True)
@click.option("--seed", default=0, show_default=True)
def memory(first: int, last: int, seed: int) -> None:
    """Answer varied questions in one process, and compare its memory after many and after more."""
    sizes, statuses = {}, Counter[str]()
    kinds = [new_wrenches(seed), new_stances(seed), random_plans(seed), random_plans(seed + 1)]
    for i in range(last):
        payload = next(kinds[i % len(kinds)])
        statuses[dispatch.handle("plan", payload).status] += 1
        if i + 1 in (100, first, last):
            size = proc.resident(os.getpid())
            assert size is not None
            sizes[i + 1] = size
            console.print(f"after {i + 1:,} questions {size / 2**20:.0f} MB, {dict(statuses)}")
    console.print(f"{sizes[last] / sizes[first]:.2f} times as much")
    for name, info in stores().items():
        console.print(f"{name}: {info.kept} of {info.most} kept, {info.hits:,} hits")


for command in (bulk, climb, climbed, starve, starved, greedy, unread, soak):
    main.add_command(command)


if __name__ == "__main__":
    main()
