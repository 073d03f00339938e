"""How many plans a second: a batch on one process and on several, and on threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

from benchmarks.measured_stances import question_of, request
from benchmarks.race import WARM, Race, Way, race
from benchmarks.results import Line, Table, times
from planner.solving import plan
from service.processes import Planners

__all__ = ["batch_tables", "batches", "rates"]

BATCH = 128
"""Stances in a batch, all of them new."""

PROCESSES = "`plan_many`, processes"
THREADS = "`plan`, threads"


def counts() -> list[int]:
    """Numbers of workers: powers of two up to the number of cores, two at least."""
    return [1, *(2**k for k in range(1, 7) if 2**k <= max(2, os.cpu_count() or 1))]


def batches(rounds: int, tick: Callable[[], object]) -> Race:
    """Time a batch with each kind and number of workers, by (kind, number)."""
    ways: dict[tuple[str, int], Way] = {}

    def numbers(k: int) -> range:
        return range(BATCH * k, BATCH * (k + 1))

    with ExitStack() as stack:
        for workers in counts():
            planners = stack.enter_context(Planners(workers))
            planners.wait()
            pool = stack.enter_context(ThreadPoolExecutor(workers))
            # twins, since one worker is this process, as are all threads
            requests = [
                [request(i, twin=2 * workers) for i in numbers(k)] for k in range(rounds + WARM)
            ]
            questions = [
                [question_of(i, twin=2 * workers + 1) for i in numbers(k)]
                for k in range(rounds + WARM)
            ]
            ways[PROCESSES, workers] = lambda k, planners=planners, asked=requests: (
                planners.plan_many(asked[k])
            )
            ways[THREADS, workers] = lambda k, pool=pool, asked=questions: list(
                pool.map(plan, asked[k])
            )
        return race(ways, rounds, tick)


def batch_tables(timed: Race) -> list[Table]:
    """Plans a second, over those of one worker."""
    lines = [
        Line(
            f"{name}: {workers}",
            (
                f"{BATCH / timed.median((name, workers)):.0f}",
                times(1.0 / timed.ratio((name, workers), (name, 1))),
            ),
        )
        for name, workers in sorted(timed.times)
    ]
    title = f"Batches of {BATCH} new stances of four hands"
    return [Table(title, ("plans a second", "× one worker"), lines)]


def rates(timed: Race) -> dict[str, list[tuple[int, float]]]:
    """Workers and plans a second of each kind."""
    found: dict[str, list[tuple[int, float]]] = {}
    for name, workers in sorted(timed.times):
        rate = BATCH / timed.median((name, workers))
        found.setdefault(name.replace("`", ""), []).append((workers, rate))
    return found
