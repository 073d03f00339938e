"""Lay out tables in 80 columns: rows under a title, each column with its unit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import click

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

__all__ = [
    "VERBOSITY_KEY",
    "PrintedColumn",
    "axis_unit",
    "console",
    "counted",
    "in_colour",
    "in_order",
    "joined",
    "name",
    "number",
    "print_rows",
    "print_warnings",
    "short",
    "text",
    "verbosity",
]

VERBOSITY_KEY: Final = "crux.verbosity"
"""Key of the verbosity in the ``meta`` of a click context: 1 for more output, -1 for less."""


def console(stderr: bool = False) -> Console:
    """Return a rich console on standard output, at least 80 columns wide, or on standard error.

    Parameters
    ----------
    stderr : bool, optional
        True for standard error, with the width of the terminal.
    """
    from rich.console import Console

    # what is in brackets or between colons is units and paths, no style
    screen = Console(highlight=False, markup=False, emoji=False, stderr=stderr)
    # a narrower terminal wraps the lines of a table
    narrowest = 80
    if not stderr and screen.width < narrowest:
        screen.width = narrowest
    return screen


def in_colour(status: str, word: str | None = None) -> Text:
    """Return a status as bold text: green for optimal, red for overloaded, infeasible or failed.

    Parameters
    ----------
    status : str
        Status that determines the colour.
    word : str, optional
        Text in place of the status.
    """
    from rich.text import Text

    bad = status in {"overloaded", "infeasible", "failed"}
    colour = "red" if bad else "green" if status == "optimal" else "default"
    return Text(word or status, f"bold {colour}")


def verbosity() -> int:
    """Return the verbosity of the running command: 1 for more output, 0 by default, -1 for less."""
    context = click.get_current_context(silent=True)
    level: int = 0 if context is None else context.meta.get(VERBOSITY_KEY, 0)
    return level


def print_warnings(warnings: Iterable[str], out: Console) -> None:
    """Print each warning on lines of its own."""
    from rich.text import Text

    for warning in warnings:
        out.print(Text.assemble(("warning:", "bold"), f" {warning}"))


def counted(count: int, one: str, many: str | None = None) -> str:
    """Return a number of things in words, such as ``no moves``, ``1 move`` or ``1,200 moves``.

    Parameters
    ----------
    count : int
    one : str
        The thing.
    many : str, optional
        Several of it; by default with an s.
    """
    things = one if count == 1 else many or f"{one}s"
    return f"{count:,} {things}" if count else f"no {things}"


def joined(*parts: str | None) -> str:
    """Return the parts that are there with spaces between them."""
    return " ".join(filter(None, parts))


def short(value: float, digits: int) -> str:
    """Return a number as text, with fewer decimals if the number is large.

    Parameters
    ----------
    value : float
        The number.
    digits : int
        Maximum number of decimals; a number from 100 on has at most one, from 1000 on none.
    """
    # from 1e4 on, a number has no decimals; from a tenth of it on, it has one
    while digits and abs(value) >= 1e4 / 10.0**digits:
        digits -= 1
    return f"{value:z.{digits}f}"


class PrintedColumn(NamedTuple):
    """Column of a table that is printed.

    Attributes
    ----------
    head : str
        Head of the column, with the unit.
    value : str or callable, optional
        Path of the value in a row (attributes, keys and indices with dots between them), or a
        function of the row. By default the attribute that has the head's name.
    form : str or callable
        Format of numbers, as `format` takes it, or a function that returns their text.
    scale : float, optional
        Factor that converts numbers to the unit in the head.
    kind : {'name', 'number', 'text'}
        Layout: names are not wrapped, numbers are aligned right, texts are wrapped.
    """

    head: str
    value: str | Callable[[Any], Any] | None = None
    form: str | Callable[[Any], str] = ""
    scale: float | None = None
    kind: Literal["name", "number", "text"] = "name"

    def cell(self, row: Any) -> str | Text:
        """Return the text of this column's cell in a row; ``-`` if the row has no value.

        Parameters
        ----------
        row : object
            Struct, mapping or sequence that the path of the value leads into.
        """
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
    """Return columns for rows that are sequences; the i-th column shows the i-th cell.

    Parameters
    ----------
    names : iterable of str
        Heads of the first columns, whose cells are not wrapped.
    numbers : iterable of str, optional
        Heads of the next columns, which have numbers.
    texts : iterable of str, optional
        Heads of the last columns, whose cells are wrapped.
    form : str, optional
        Format of the numbers, as `format` takes it.

    Returns
    -------
    list of PrintedColumn
    """
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
    legend: Sequence[str] = (),
    result: bool = False,
) -> None:
    """Print a table, unless the verbosity is -1.

    Parameters
    ----------
    rows : iterable
        Rows: structs, or sequences of cells.
    columns : iterable of PrintedColumn
        Columns of the table.
    out : Console
        Console to print on.
    title : str, optional
        Title above the table, in bold.
    groups : bool, optional
        True to separate rows with different first cells by a gap.
    style : callable, optional
        Returns the rich style of a row.
    heads : bool, optional
        True to show the heads of the columns.
    padding : int, optional
        Spaces at both sides of a cell; only at the right if the table is wider than the console and
        has no columns of text.
    legend : sequence of str, optional
        Lines below the table that say what it has.
    result : bool, optional
        True for a result that has no sentence: with the verbosity -1, each row becomes a line.
    """
    if verbosity() < 0:
        if result:
            _print_lines(rows, list(columns), out)
        return
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
    _part_heads_between_words(table, columns, out)
    out.print(table)
    for line in legend:
        out.print(line)


def _part_heads_between_words(table: Table, columns: Sequence[PrintedColumn], out: Console) -> None:
    """Part the heads of a table that is too wide between their words, if it then has room."""

    def too_wide() -> bool:
        wide = out.options.update(max_width=1000)
        return out.measure(table, options=wide).maximum > out.width

    if not too_wide() or any(column.kind == "text" for column in columns):
        return
    for shown, column in zip(table.columns, columns, strict=True):
        parted = column.head.split() if column.kind == "number" else [column.head]
        cells = (out.measure(cell).maximum for cell in shown.cells)
        shown.width = max(*cells, *map(len, parted), 0)
    if too_wide():
        for shown in table.columns:
            shown.width = None
        return
    for shown, column in zip(table.columns, columns, strict=True):
        narrow = shown.width or 0
        shown.width = max(narrow, len(column.head))
        if too_wide():
            shown.width = narrow


def _print_lines(rows: Iterable[Any], columns: Sequence[PrintedColumn], out: Console) -> None:
    """Print a line for each row: heads and cells."""
    for row in rows:
        cells = [f"{column.head} {column.cell(row)}".strip() for column in columns]
        out.print(", ".join(cells))


def axis_unit(axis: str) -> str:
    """Return the unit of a wrench's component: N for a force ``fx``, N·m for a moment ``mx``."""
    return "N" if axis.startswith("f") else "N·m"
