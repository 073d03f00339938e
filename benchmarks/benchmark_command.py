"""The command that measures everything: ``python -m benchmarks``, from a checkout.

Needs what ``pip install -e '.[test,bench]'`` brings. Everything is measured on this machine in this
run: ways to the same answer take turns, times are medians, ratios medians of each round's ratio.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from benchmarks.batch_table import batch_tables, batches, rates
from benchmarks.centroidal_table import CASES, centroidal_tables
from benchmarks.growth import draw, growth, steps as growth_steps
from benchmarks.known_table import known_tables
from benchmarks.placement_table import placement_tables
from benchmarks.plan_table import plan_tables
from benchmarks.race import Race
from benchmarks.random_plans import answers, iteration_tables
from benchmarks.results import Table, into, markdown, print_tables
from benchmarks.set_table import set_tables


class Size(NamedTuple):
    """How much is measured.

    Attributes
    ----------
    rounds, few : int
        Rounds of what is short, and of what is long.
    stances : int
        Random ones.
    step : float
        Of tensions in the paper's search [N].
    every : int
        Of the sizes over which growth is drawn, which are measured.
    """

    rounds: int
    few: int
    stances: int
    step: float
    every: int


FULL = Size(rounds=200, few=20, stances=300, step=2.0, every=1)
QUICK = Size(rounds=3, few=2, stances=4, step=10.0, every=5)

Tick = Callable[[], object]


class Part(NamedTuple):
    """One part of the whole: its name, how often it ticks, and what makes its tables."""

    name: str
    steps: int
    tables: Callable[[Tick], list[Table]]


def parts(size: Size, workers: int, batch_race: Callable[[Tick], Race]) -> list[Part]:
    """Return what makes the tables."""
    return [
        Part(
            "plans",
            2 * size.rounds + size.few,
            lambda tick: plan_tables(size.rounds, size.few, tick),
        ),
        Part("known", size.rounds, lambda tick: known_tables(size.rounds, tick)),
        Part("batches", size.few, lambda tick: batch_tables(batch_race(tick))),
        Part(
            "sets",
            size.rounds + size.few,
            lambda tick: set_tables(size.rounds, size.few, size.step, tick),
        ),
        Part("placements", size.few, lambda tick: placement_tables(size.few, tick)),
        Part("centroidal", size.few * CASES, lambda tick: centroidal_tables(size.few, tick)),
        Part(
            "stances",
            size.stances,
            lambda tick: iteration_tables(answers(range(size.stances), workers, tick)),
        ),
    ]


def machine() -> str:
    """Return on what, and with what, is measured."""
    packages = ("numpy", "scipy", "clarabel", "cvxpy", "qoco", "pycapacity", "highspy")
    return (
        f"{os.cpu_count()} cores, Python {platform.python_version()}, "
        + ", ".join(f"{name} {version(name)}" for name in packages if _there(name))
        + "."
    )


def _there(name: str) -> bool:
    try:
        version(name)
    except ImportError:
        return False
    return True


@click.command()
@click.option("--quick", is_flag=True, help="A few rounds of each, to see that all of it runs.")
@click.option(
    "--only",
    multiple=True,
    type=click.Choice(["plans", "known", "batches", "sets", "placements", "centroidal", "stances"]),
    help="Leave the other parts out.",
)
@click.option("--stances", type=click.IntRange(1), help="Random stances to plan [300].")
@click.option("--workers", type=click.IntRange(1), default=os.cpu_count, help="For these.")
@click.option(
    "--page",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Put the tables between the marks of this file.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Measure growth too, and draw it into this file.",
)
def main(
    quick: bool,
    only: tuple[str, ...],
    stances: int | None,
    workers: int,
    page: Path | None,
    plot: Path | None,
) -> None:
    """Measure crux beside its peers, and print the table."""
    size = QUICK if quick else FULL
    if stances is not None:
        size = size._replace(stances=stances)
    raced: list[Race] = []

    def batch_race(tick: Tick) -> Race:
        if not raced:
            raced.append(batches(size.few, tick))
        return raced[0]

    console = Console()
    made = parts(size, workers, batch_race)
    chosen = [part for part in made if not only or part.name in only]
    tables: list[Table] = []
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    with Progress(*columns, TimeElapsedColumn(), console=Console(stderr=True)) as bar:
        for part in chosen:
            task = bar.add_task(part.name, total=part.steps)
            tables += part.tables(partial(bar.advance, task))
        if plot is not None:
            total = growth_steps(size.few) + (0 if raced else size.few)
            tick = partial(bar.advance, bar.add_task("growth", total=total))
            draw(growth(size.few, size.every, tick), rates(batch_race(tick)), plot)
    print_tables(tables, console)
    note = f"Medians of {size.rounds} rounds on {machine()}"
    console.print(note)
    if page is not None:
        into(page, f"{note}\n\n{markdown(tables)}")
