"""A study of bulk work: a table of many mixed stances, whose processes are killed meanwhile."""

from __future__ import annotations

import itertools
import os
import random
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import click
import msgspec
from rich.console import Console

from benchmarks.load.asking import new_stances, new_wrenches, spoilt
from planner.processes import resident
from tests.suite.helpers.checkout import ROOT
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.requests import HEAVY, wall_request

EVERY = 0.25
"""How often memory is looked at [s]."""

console = Console()


def mixed_stances(seed: int = 0) -> Iterator[bytes]:
    """Stances that are new, known, overloaded, of all sorts, and no stances at all."""
    rng = random.Random(seed)
    stances, wrenches, bad = new_stances(seed), new_wrenches(seed), spoilt(seed)
    for i in itertools.count():
        kind = rng.random()
        if kind < 0.6:
            yield next(stances)
        elif kind < 0.8:
            yield next(wrenches)
        elif kind < 0.95:
            limbs = rng.sample(("front_right", "rear_right", "rear_left", "front_left"), 3)
            yield msgspec.json.encode(wall_request(rng.uniform(0.5, 1.2) * HEAVY, tuple(limbs)))
        elif kind < 0.99:
            yield msgspec.json.encode(random_request(seed * 10**6 + i))
        else:
            _, payload, encoding = next(bad)
            if encoding == "application/json" and payload.strip() and b"\n" not in payload:
                yield payload


def children(pid: int) -> list[int]:
    """Processes that a process has started, and those that these have."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            own = [int(each) for each in task.read_text().split()]
        except OSError:
            continue
        found += own + [each for one in own for each in children(one)]
    return found


def memory_of(pid: int) -> int:
    """Resident memory of a process and of all that it has started [bytes]."""
    return sum(resident(each) or 0 for each in (pid, *children(pid)))


def workers(pid: int) -> list[int]:
    """Those of them that plan."""
    found = []
    for each in children(pid):
        try:
            words = Path(f"/proc/{each}/cmdline").read_bytes()
        except OSError:
            continue
        if b"forkserver import main" in words:
            # those that are forked have its words, and start nothing themselves
            found += children(each)
        elif b"spawn_main" in words:
            found.append(each)
    return found


class Run:
    """A ``crux batch``, watched until it ends."""

    def __init__(self, requests: Path, table: Path, *flags: str) -> None:
        self.sizes: list[int] = []
        self._process = subprocess.Popen(
            [
                *(sys.executable, "-c", "from service.__main__ import main; main()"),
                *("batch", str(requests), "-o", str(table), *flags),
            ],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
        )
        self.started = time.perf_counter()

    def watch(self, until: float = float("inf")) -> float:
        """Look at the memory until so many seconds have passed, or it ends; return how many."""
        pid = self._process.pid
        while self._process.poll() is None and time.perf_counter() - self.started < until:
            self.sizes.append(memory_of(pid))
            time.sleep(EVERY)
        return time.perf_counter() - self.started

    def kill_worker(self, rng: random.Random) -> bool:
        """Kill one of its workers, if it has one; return whether it had."""
        found = workers(self._process.pid)
        if found:
            os.kill(rng.choice(found), signal.SIGKILL)
        return bool(found)

    def kill(self) -> None:
        """Kill it."""
        self._process.kill()
        self._process.wait()

    def told(self) -> str:
        """Memory of all its processes together, in words."""
        third = max(len(self.sizes) // 3, 1)
        middle, last = (
            statistics.median(part) / 2**20
            for part in (self.sizes[third : 2 * third] or self.sizes, self.sizes[-third:])
        )
        return (
            f"{max(self.sizes) / 2**20:.0f} MiB resident at most, median {middle:.0f} in its "
            f"middle third, {last:.0f} in its last"
        )


@click.command()
@click.option("--count", default=10_000, show_default=True, help="Stances.")
@click.option("--workers", "processes", default=2, show_default=True)
@click.option("--seed", default=0, show_default=True)
def bulk(count: int, processes: int, seed: int) -> None:
    """Plan mixed stances into Parquet; the same with kills and a resumption; compare the tables."""
    from pyarrow import parquet

    rng = random.Random(seed)
    folder = Path(tempfile.mkdtemp(prefix="crux-bulk-"))
    requests, whole, broken = (folder / name for name in ("q.jsonl", "whole", "broken"))
    whole, broken = whole.with_suffix(".parquet"), broken.with_suffix(".parquet")
    with requests.open("wb") as file:
        for payload in islice(mixed_stances(seed), count):
            file.write(payload + b"\n")
    flags = ("--workers", str(processes))
    quiet = Run(requests, whole, *flags)
    took = quiet.watch()
    console.print(f"undisturbed: {count} in {took:.1f} s, {count / took:.1f}/s; {quiet.told()}")
    first = Run(requests, broken, *flags)
    first.watch(took / 4)
    console.print(f"a worker is killed: {first.kill_worker(rng)}")
    at = first.watch(took * rng.uniform(0.5, 0.8))
    first.kill()
    # its first line says what the rows are of
    rows = Path(f"{broken}.jsonl").read_bytes().count(b"\n") - 1
    console.print(f"the command is killed after {at:.1f} s, {rows} rows are whole; {first.told()}")
    second = Run(requests, broken, *flags, "--resume")
    took = second.watch()
    console.print(f"resumed: {count - rows} in {took:.1f} s; {second.told()}")
    before, after = (parquet.read_table(path) for path in (whole, broken))
    indices = after["index"].to_pylist()
    console.print(f"each row once, in order: {indices == list(range(count))}")
    console.print(f"the table is that of the undisturbed run: {after.equals(before)}")
    if not after.equals(before):
        raise click.ClickException(f"they differ: {folder}")
    shutil.rmtree(folder)
