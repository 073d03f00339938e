"""What was measured, as tables: for a terminal, and in Markdown between two marks of a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table as Grid

from benchmarks.race import Race

__all__ = [
    "BEGIN",
    "END",
    "Line",
    "Table",
    "into",
    "lines",
    "markdown",
    "print_tables",
    "span",
    "times",
]

BEGIN = "<!-- benchmarks:begin -->"
END = "<!-- benchmarks:end -->"


class Line(NamedTuple):
    """What was done, and a cell for each further column."""

    what: str
    cells: tuple[str, ...]


class Table(NamedTuple):
    """Lines under a title.

    Attributes
    ----------
    title : str
    columns : tuple of str
        Of the cells.
    lines : list of Line
    note : str
        A sentence below it, or nothing.
    """

    title: str
    columns: tuple[str, ...]
    lines: list[Line]
    note: str = ""


def span(seconds: float) -> str:
    """A duration with three digits."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= 0.9995 * size or unit == "µs":
            return f"{_three(seconds / size)} {unit}"
    raise AssertionError


def times(ratio: float) -> str:
    """A ratio with three digits."""
    return _three(ratio)


def _three(number: float) -> str:
    if number >= 99.95:
        return f"{number:.0f}"
    return f"{number:.1f}" if number >= 9.995 else f"{number:.2f}"


def lines(timed: Race, to: Sequence[str], *named: tuple[str, str]) -> list[Line]:
    """Lines (what, way) of a race: the median, and the ratio to each of some ways."""
    return [
        Line(what, (span(timed.median(name)), *(times(timed.ratio(name, way)) for way in to)))
        for what, name in named
    ]


def shown(table: Table) -> Grid:
    """A table for the terminal."""
    grid = Grid(title=table.title, title_justify="left", caption=table.note or None)
    grid.caption_justify = "left"
    grid.add_column("what", overflow="fold")
    for column in table.columns:
        grid.add_column(column, justify="right")
    for line in table.lines:
        strong = line.what.startswith("**")
        plain = line.what.replace("**", "").replace("`", "")
        grid.add_row(plain, *line.cells, style="bold" if strong else None)
    return grid


def markdown(tables: list[Table]) -> str:
    """All tables as Markdown."""
    parts = []
    for table in tables:
        rows = [["what", *table.columns], ["---", *["---:"] * len(table.columns)]]
        rows += [[line.what, *line.cells] for line in table.lines]
        parts.append(f"**{table.title}**\n\n" + "\n".join(f"| {' | '.join(r)} |" for r in rows))
        if table.note:
            parts.append(table.note)
    return "\n\n".join(parts) + "\n"


def into(file: Path, text: str) -> None:
    """Put a text between the two marks of a file.

    Raises
    ------
    ValueError
        If the file has not each of them once, in order.
    """
    whole = file.read_text(encoding="utf-8")
    before, begin, rest = whole.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end) or BEGIN in rest or END in after:
        raise ValueError(f"{file}: {BEGIN} and, after it, {END} are needed, once each")
    file.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}", encoding="utf-8")


def print_tables(tables: list[Table], console: Console) -> None:
    """Print tables one below the other."""
    for table in tables:
        console.print(shown(table))
        console.print()
