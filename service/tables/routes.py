"""A climb as a table for a person. Apart from the other tables, which do not need the planner."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from planner import RouteResult, summary
from service.tables.layout import in_colour, table_of

__all__ = ["print_route"]


def print_route(result: RouteResult, files: Mapping[str, Path], out: Console) -> None:
    """Print a climb, stage by stage, its crux, and where its files are."""
    out.print(f"[bold]{escape(result.route.name)}[/bold]: {len(result.route.moves)} moves")
    joints = any(plan.joint_utilisation is not None for plan in result.plans)
    numbers = ("util", "load factor", "joints")[: 2 + joints]
    table = table_of("", "move", "phase", "limb", "status", numbers=numbers)
    for stage, plan in zip(result.stages, result.plans, strict=True):
        of_plan = (plan.utilisation, plan.load_factor, plan.joint_utilisation)[: 2 + joints]
        shown = ("-" if number is None else f"{number:.2f}" for number in of_plan)
        cells = (str(stage.move), stage.phase, stage.limb or "-", in_colour(plan.status), *shown)
        hard = stage.index == result.crux
        table.add_row("crux" if hard else "", *cells, style="bold" if hard else "")
    out.print(table)
    told = summary(result)
    for warning in told["warnings"]:
        out.print(f"[bold]warning:[/bold] {escape(warning)}")
    out.print(told["crux"]["sentence"], markup=False)
    for name, path in files.items():
        out.print(f"{name}: {path}", markup=False, soft_wrap=True)
