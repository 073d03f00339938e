"""Lay out tables in 80 columns: rows of structs under a title, each column with its unit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

__all__ = [
    "PrintedColumn",
    "axis_unit",
    "console",
    "in_colour",
    "in_order",
    "name",
    "number",
    "print_rows",
    "print_warnings",
    "short",
    "text",
]


def console(stderr: bool = False) -> Console:
    """Return the console on standard output, or on standard error."""
    from rich.console import Console

    screen = Console(highlight=False, stderr=stderr)
    # a narrower terminal wraps the lines of a table
    narrowest = 80
    if not stderr and screen.width < narrowest:
        screen.width = narrowest
    return screen


def in_colour(status: str, word: str | None = None) -> Text:
    """Return a status, or a word in its place, in bold and in its colour."""
    from rich.text import Text

    bad = status in {"overloaded", "infeasible", "failed"}
    colour = "red" if bad else "green" if status == "optimal" else "default"
    return Text(word or status, f"bold {colour}")


def print_warnings(warnings: Iterable[str], out: Console) -> None:
    """Print warnings, one below the other."""
    from rich.text import Text

    for warning in warnings:
        out.print(Text.assemble(("warning:", "bold"), f" {warning}"))


def short(value: float, digits: int) -> str:
    """Return a number with at most so many decimals, fewer if it is large."""
    # from 1e4 on, a number has no decimals; from a tenth of it on, it has one
    while digits and abs(value) >= 1e4 / 10.0**digits:
        digits -= 1
    return f"{value:z.{digits}f}"


class PrintedColumn(NamedTuple):
    """A column of a table.

    Attributes
    ----------
    head : str
        Head of the column, with the unit.
    value : str or callable, optional
        Path of the value in a row (attributes, keys and indices with dots between them), or a
        function of the row; by default the attribute of the head's name.
    form : str or callable
        Format of numbers, as `format` takes it, or a function that returns their text.
    scale : float, optional
        Factor of the numbers, for their unit.
    kind : {'name', 'number', 'text'}
        Names are not wrapped, numbers are aligned right, texts are wrapped.
    """

    head: str
    value: str | Callable[[Any], Any] | None = None
    form: str | Callable[[Any], str] = ""
    scale: float | None = None
    kind: Literal["name", "number", "text"] = "name"

    def cell(self, row: Any) -> str | Text:
        """Return the text of a row's cell; ``-`` if there is no value."""
        from rich.text import Text

        found = self.value(row) if callable(self.value) else self._found(row)
        if found is None or isinstance(found, Text):
            return found or "-"
        found = found if self.scale is None else self.scale * found
        return self.form(found) if callable(self.form) else format(found, self.form)

    def _found(self, row: Any) -> Any:
        """Return the value at the end of the path; None if a part of it is None."""
        assert not callable(self.value)
        for step in (self.head if self.value is None else self.value).split("."):
            if isinstance(row, Mapping):
                row = row[step]
            elif row is not None:
                row = row[int(step)] if step.isdecimal() else getattr(row, step)
        return row


name = PrintedColumn
number = partial(PrintedColumn, kind="number")
text = partial(PrintedColumn, kind="text")


def in_order(
    names: Iterable[str], numbers: Iterable[str] = (), texts: Iterable[str] = (), form: str = ""
) -> list[PrintedColumn]:
    """Return columns of rows that are sequences: names, numbers in one form, and texts."""
    columns = [*map(name, names), *map(partial(number, form=form), numbers), *map(text, texts)]
    return [column._replace(value=str(i)) for i, column in enumerate(columns)]


def print_rows(
    rows: Iterable[Any],
    columns: Iterable[PrintedColumn],
    out: Console,
    title: str = "",
    *,
    groups: bool = False,
    style: Callable[[Any], str] | None = None,
    heads: bool = True,
    padding: int = 1,
) -> None:
    """Print a table.

    Parameters
    ----------
    rows : iterable
        Structs, or sequences of cells.
    columns : iterable of PrintedColumn
    out : Console
    title : str, optional
        Printed above it, in bold.
    groups : bool, optional
        True if a gap separates rows with different first cells.
    style : callable, optional
        Returns the style of a row.
    heads : bool, optional
        True if the columns' heads are shown.
    padding : int, optional
        Spaces at either side of a cell; at one side if a table without texts is wider than the
        console.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, padding=(0, padding), pad_edge=False, show_header=heads)
    columns = list(columns)
    for column in columns:
        side: Any = {"justify": "right", "overflow": "fold"} if column.kind == "number" else {}
        table.add_column(Text(column.head), no_wrap=column.kind == "name", **side)
    last = None
    for row in rows:
        cells = [column.cell(row) for column in columns]
        if groups and last not in (None, cells[0]):
            table.add_section()
        last = cells[0]
        shown = (cell if isinstance(cell, Text) else Text(cell) for cell in cells)
        table.add_row(*shown, style=None if style is None else style(row))
    if title:
        out.print(Text(f"\n{title}", style="bold"))
    # any table fits in 1000 characters
    widest = out.measure(table, options=out.options.update(max_width=1000)).maximum
    if widest > out.width and not any(column.kind == "text" for column in columns):
        table.padding = (0, padding, 0, 0)
    out.print(table)


def axis_unit(axis: str) -> str:
    """Return the unit of a component of a wrench."""
    return "N" if axis.startswith("f") else "N·m"
