"""A sweep in words: how many points hold, and where over what varies they stop."""

from __future__ import annotations

from typing import Final, TypeVar

from rich.console import Console
from rich.markup import escape

from service.sweeping import Held, Row, Sweep, border_in_words, held, word_of
from service.tables.layout import show, table_of

__all__ = ["print_sweep"]

T = TypeVar("T")

LINES: Final = 24
"""Of a table: what is more is left out evenly."""

LARGEST: Final = 30
"""Characters of a path at the head of a column."""


def print_sweep(sweep: Sweep, out: Console) -> None:
    """Print a table of a sweep: of its points over one variable, of its border over two."""
    design = sweep.design
    varying = sweep.design.varying
    numbers = [i for i in varying if design.variations[i].numbers]
    if len(varying) == 1:
        _print_points(sweep, varying[0], out)
    elif len(varying) == 2 and numbers and not design.sampled:
        x = numbers[0]
        (y,) = (i for i in varying if i != x)
        _print_held(sweep, x, y, out)
    else:
        _print_extremes(sweep, out)
    counts = ", ".join(f"{count} {status}" for status, count in sweep.counts.items() if count)
    out.print(f"{len(sweep.rows)} points: {counts}", markup=False)
    for border in sweep.borders:
        out.print(border_in_words(border), markup=False, soft_wrap=True)
    if len(varying) == 1 and numbers and not sweep.borders:
        out.print(_everywhere(sweep, varying[0]), markup=False, soft_wrap=True)
    if complaint := next((row.complaint for row in sweep.rows if row.complaint), None):
        words = f"no answer at some points; the first: {complaint}"
        out.print(words, markup=False, soft_wrap=True)


def _everywhere(sweep: Sweep, x: int) -> str:
    """Say that there is no border: among the points with a plan or a proof that there is none."""
    rows = [row for row in sweep.rows if row.state != "error"]
    if not rows:
        return "no point has an answer"
    values = sorted(row.point[x] for row in rows)  # type: ignore[type-var]
    low, high = word_of(values[0]), word_of(values[-1])
    ends = f"{f'at {low}' if low == high else f'from {low} to {high}'} of {sweep.design.labels[x]}"
    holding = sum(row.holds for row in rows)
    words = "holds" if holding == len(rows) else "holds nowhere" if not holding else "holds in part"
    return f"{words} {ends}"


def _print_points(sweep: Sweep, x: int, out: Console) -> None:
    figures = ("utilisation", "load factor")
    table = table_of("value", "status", numbers=figures, words=("limited by",))
    rows = list(sweep.rows)
    if sweep.design.variations[x].numbers:
        rows.sort(key=lambda row: row.point[x])  # type: ignore[arg-type, return-value]
    for row in _thinned(rows):
        table.add_row(escape(word_of(row.point[x])), row.status, *_figures(row), _limit(row))
    show(escape(sweep.design.labels[x]), table, out)
    if len(rows) > LINES:
        out.print(f"{LINES} of {len(rows)} points are shown")


def _figures(row: Row) -> tuple[str, str]:
    factor = "-" if row.load_factor is None else f"{row.load_factor:.3f}"
    used = "-" if row.utilisation is None else f"{row.utilisation:.3f}"
    return used, "any" if row.load_factor_unbounded else factor


def _limit(row: Row) -> str:
    if row.error is not None:
        return row.error.kind
    if row.limiting is None:
        return "-"
    limit = row.limiting
    return " ".join(name for name in (limit.limb, limit.phalanx, limit.joint, limit.limit) if name)


def _print_held(sweep: Sweep, x: int, y: int, out: Console) -> None:
    """Print for each value of one variable where over the other it holds."""
    table = table_of(_head(sweep, y), words=(escape(f"holds for {sweep.design.labels[x]}"),))
    values = list(sweep.design.variations[y].values)
    if sweep.design.variations[y].numbers:
        values.sort()
    for value in _thinned(values):
        rows = sorted(
            (row for row in sweep.rows if row.point[y] == value),
            key=lambda row: row.point[x],  # type: ignore[arg-type, return-value]
        )
        known = [row for row in rows if row.state != "error"]
        words = ", ".join(_interval(each) for each in held(known, x)) or "none"
        if len(known) < len(rows):
            words += f" ({len(rows) - len(known)} without an answer)"
        table.add_row(escape(word_of(value)), words)
    out.print(table)
    out.print("between points by interpolation of the utilisation, halfway where there is none")


def _interval(held: Held) -> str:
    low, high = held
    if low is None and high is None:
        return "all"
    if low is None:
        return f"up to {high:.4g}"
    return f"from {low:.4g}" + ("" if high is None else f" to {high:.4g}")


def _print_extremes(sweep: Sweep, out: Console) -> None:
    """Print the points of least and most utilisation."""
    rows = [row for row in sweep.rows if row.utilisation is not None]
    if not rows:
        return
    ends = [pick(rows, key=lambda row: row.utilisation or 0.0) for pick in (min, max)]
    table = table_of("", numbers=("least used", "most used"))
    for i in range(len(sweep.design.variations)):
        table.add_row(_head(sweep, i), *(escape(word_of(row.point[i])) for row in ends))
    table.add_row("utilisation", *(_figures(row)[0] for row in ends))
    table.add_row("load factor", *(_figures(row)[1] for row in ends))
    out.print(table)


def _head(sweep: Sweep, place: int) -> str:
    """Return a path and its unit in little room: its end, where it is long."""
    label = sweep.design.labels[place]
    return escape(label if len(label) <= LARGEST else f"…{label[1 - LARGEST :]}")


def _thinned(items: list[T]) -> list[T]:
    if len(items) <= LINES:
        return items
    return [items[round(i * (len(items) - 1) / (LINES - 1))] for i in range(LINES)]
