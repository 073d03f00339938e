"""A climb as a table for a person. Apart from the other tables, which do not need the planner."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.text import Text

from planner import RouteResult, summary
from service.tables.layout import in_colour, name, number, print_rows

__all__ = ["print_route"]


def print_route(result: RouteResult, files: Mapping[str, Path], out: Console) -> None:
    """Print a climb, stage by stage, its crux, and where its files are."""
    out.print(f"[bold]{escape(result.route.name)}[/bold]: {len(result.route.moves)} moves")
    numbers = {"util": "utilisation", "load factor": "load_factor", "joints": "joint_utilisation"}
    if all(plan.joint_utilisation is None for plan in result.plans):
        del numbers["joints"]
    columns = (
        name("", lambda row: "crux" if row[0].index == result.crux else ""),
        *(name(part, f"0.{part}") for part in ("move", "phase", "limb")),
        name("status", lambda row: Text.from_markup(in_colour(row[1].status))),
        *(number(head, f"1.{part}", ".2f") for head, part in numbers.items()),
    )
    stages = zip(result.stages, result.plans, strict=True)
    print_rows(
        stages, columns, out, style=lambda row: "bold" if row[0].index == result.crux else ""
    )
    told = summary(result)
    for warning in told["warnings"]:
        out.print(f"[bold]warning:[/bold] {escape(warning)}")
    out.print(told["crux"]["sentence"], markup=False)
    for what, path in files.items():
        out.print(f"{what}: {path}", markup=False, soft_wrap=True)
