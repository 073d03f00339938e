"""The suite as a table: what is asked, what came out, how long it took, what changed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import groupby
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from tests.suite.adapter import ask
from tests.suite.answers import read_answers, rounded, told, write_answers
from tests.suite.comparison import Difference, differences, worst
from tests.suite.problems import Problem, problems

__all__ = ["answer", "main", "status_of"]

SHOWN = 3
"""Differences of a problem that are printed."""


def answer(problem: Problem) -> dict[str, Any]:
    """Return what the code says of a problem, as it is kept."""
    return told(ask(problem.ask), problem.full)


def status_of(found: dict[str, Any]) -> str:
    """Return in a word or a few how a question ended."""
    if "error" in found:
        return f"error {found['error']['kind']}"
    if "points" in found:
        counts = [(point["status"], point["source"]) for point in found["points"]]
        return ", ".join(f"{counts.count(c)} {' '.join(c)}" for c in dict.fromkeys(counts))
    said = found["said"][0] if found.get("said") else found
    return str(said.get("status", f"exit {found['exit']}" if "exit" in found else "told"))


def asked(pattern: str, quick: bool) -> list[Problem]:
    """Return the problems that match, without slow ones if it is to be quick."""
    return [each for each in problems(pattern) if not (quick and each.slow)]


def answered(chosen: list[Problem]) -> Iterator[tuple[Problem, dict[str, Any], float]]:
    """Yield problems with their answers and the time that these took [s]."""
    for each in chosen:
        start = time.perf_counter()
        yield each, answer(each), time.perf_counter() - start


quick_option = click.option("--quick", is_flag=True, help="Without the slow ones.")


@click.group(invoke_without_command=True)
@click.option("--only", "pattern", default="*", help="Kind, name or kind/name; * and ? match any.")
@quick_option
@click.pass_context
def main(context: click.Context, pattern: str, quick: bool) -> None:
    """Ask every question, and compare with the answers that are recorded."""
    if context.invoked_subcommand is not None:
        if pattern != "*" or quick:
            raise click.UsageError(f"options of {context.invoked_subcommand} go after its name")
        return
    out, table = Console(), Table("problem", "status", "s", "off", "")
    failed, started = 0, time.perf_counter()
    for each, found, took in answered(asked(pattern, quick)):
        known = read_answers(each.kind).get(each.name)
        off, changes = worst(differences(known, found)), each.changes(known, found)
        failed += bool(changes)
        verdict = "[bold]changed" if changes else "ok"
        table.add_row(each.label, status_of(found), f"{took:.2f}", f"{off:.1e}", verdict)
        tell(each, changes)
    out.print(table)
    out.print(f"{table.row_count} asked, {failed} changed, {time.perf_counter() - started:.0f} s")
    context.exit(int(failed > 0))


def tell(each: Problem, off: list[Difference]) -> None:
    """Print the largest differences of a problem."""
    for difference in off[:SHOWN]:
        click.echo(f"{each.label} {difference}"[:400])


@main.command("list")
@click.option("--only", "pattern", default="*", help="As of the table.")
def list_problems(pattern: str) -> None:
    """Name every problem."""
    out, table = Console(), Table("problem", "marks")
    for each in problems(pattern):
        marks = [name for name in ("slow", "full") if getattr(each, name)]
        table.add_row(each.label, ", ".join([*marks, *(f"loose: {f}" for f in each.loose)]))
    out.print(table)
    out.print(f"{table.row_count} problems")


@main.command()
@click.option("--only", "pattern", default="*", help="As of the table.")
@quick_option
def record(pattern: str, quick: bool) -> None:
    """Write the answers of today, and print what they change.

    Answers that agree within the tolerance stay as they are, to the last digit.
    """
    chosen = asked(pattern, quick)
    for kind, some in groupby(chosen, key=lambda each: each.kind):
        known = read_answers(kind)
        order = [each.name for each in problems(kind) if each.kind == kind]
        for each, found, _ in answered(list(some)):
            before = known.get(each.name)
            changes = each.changes(before, found)
            if changes:
                news = f"{changes[0].size:.1e}" if before else "new"
                click.echo(f"{each.label}: {status_of(found)}, {news}")
                tell(each, changes if before else [])
                known[each.name] = rounded(each, found)
        write_answers(kind, {name: known[name] for name in order if name in known})
