"""How tables look, in 80 columns."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["console", "in_colour", "short", "show", "table_of", "unit_of"]


def console(stderr: bool = False) -> Console:
    """Return the console on standard output, or on standard error."""
    from rich.console import Console

    screen = Console(highlight=False, stderr=stderr)
    if not stderr and screen.width < NARROWEST:
        screen.width = NARROWEST
    return screen


COLOURS: Final = {
    "optimal": "green",
    "overloaded": "red",
    "infeasible": "red",
    "failed": "red",
}
"""Of a plan's status, where the terminal has them and ``NO_COLOR`` is not set."""


def in_colour(status: str, word: str | None = None) -> str:
    """Return a status, or a word in its place, as markup in bold and in its colour."""
    return f"[bold {COLOURS.get(status, 'default')}]{word or status}[/]"


NARROWEST: Final = 80
"""Letters of a line for which tables are made; a narrower terminal breaks it itself."""

LONG: Final = 1e4
"""From here on a number is written as a whole one, from a tenth of it on with one decimal."""


def short(value: float, digits: int) -> str:
    """Return a number with as many digits after its point, up to so many, as leave it short."""
    while digits and abs(value) >= LONG / 10.0**digits:
        digits -= 1
    return f"{value:z.{digits}f}"


def show(title: str, table: Table, out: Console) -> None:
    """Print a table under its title."""
    out.print(f"\n[bold]{title}[/bold]")
    out.print(table)


def table_of(*names: str, numbers: Iterable[str] = (), words: Iterable[str] = ()) -> Table:
    """Return a table with columns of names, then of numbers, then of words, which may wrap."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1), pad_edge=False)
    for name in names:
        table.add_column(name, no_wrap=True)
    for name in numbers:
        table.add_column(name, justify="right", overflow="fold")
    for name in words:
        table.add_column(name)
    return table


def unit_of(axis: str) -> str:
    """Return the unit of a component of a wrench."""
    return "N" if axis.startswith("f") else "N·m"
