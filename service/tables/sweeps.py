"""Print a sweep as tables of text: points, feasible ranges, and borders of feasibility."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from rich.console import Console

from service.sweeping import Held, Sweep, SweepRow, held, word_of
from service.tables.layout import in_order, joined, name, number, print_rows, text

__all__ = ["print_sweep"]


ItemT = TypeVar("ItemT")


def print_sweep(sweep: Sweep, out: Console) -> None:
    """Print a sweep: points over one variable, or feasible ranges over two; counts and borders.

    Over other variables, the points of least and largest utilisation are printed.

    Parameters
    ----------
    sweep : Sweep
        Results of the sweep.
    out : Console
        Console to print on.
    """
    design = sweep.design
    varying = design.varying
    numbers = [i for i in varying if design.variations[i].numbers]
    if len(varying) == 1:
        _print_points(sweep, varying[0], out)
    elif len(varying) == 2 and numbers and not design.sampled:
        _print_held(sweep, numbers[0], sum(varying) - numbers[0], out)
    elif sweep.extremes:
        _print_extremes(sweep, out)
    counts = ", ".join(f"{count} {status}" for status, count in sweep.counts.items() if count)
    lines = [f"{len(sweep.rows)} points: {counts}"]
    lines += [border.words for border in sweep.borders]
    if design.number is not None and not sweep.borders:
        lines.append(_everywhere(sweep, design.number))
    if complaint := next((row.complaint for row in sweep.rows if row.complaint), None):
        lines.append(f"no answer at some points; the first: {complaint}")
    for line in lines:
        out.print(line, soft_wrap=line is not lines[0])


def _everywhere(sweep: Sweep, x: int) -> str:
    """Return in a sentence that all points with a plan or a proof hold, or none: no border."""
    rows = sorted((row for row in sweep.rows if row.state != "error"), key=_at(x))
    if not rows:
        return "no point has an answer"
    low, high = (word_of(row.point[x]) for row in (rows[0], rows[-1]))
    ends = f"{f'at {low}' if low == high else f'from {low} to {high}'} of {sweep.design.labels[x]}"
    holding = sum(row.holds for row in rows)
    words = "holds" if holding == len(rows) else "holds nowhere" if not holding else "holds in part"
    return f"{words} {ends}"


def _at(place: int) -> Any:
    """Return the key by which a row is sorted: its value of a variation."""
    return lambda row: row.point[place]


def _print_points(sweep: Sweep, x: int, out: Console) -> None:
    """Print points in the order of a number, or in their own order."""
    rows = sorted(sweep.rows, key=_at(x)) if sweep.design.variations[x].numbers else sweep.rows
    columns = (
        name("value", lambda row: word_of(row.point[x])),
        name("status"),
        number("utilisation", form=".3f"),
        number("load factor", _factor),
        text("limited by", _limit),
    )
    shown = _thinned(rows)
    left = len(rows) > len(shown)
    legend = [f"{len(shown)} of {len(rows)} points are shown"] if left else []
    print_rows(shown, columns, out, sweep.design.labels[x], legend=legend)


def _factor(row: SweepRow) -> str | None:
    """Return a load factor in words."""
    if row.load_factor_unbounded:
        return "any"
    return None if row.load_factor is None else f"{row.load_factor:.3f}"


def _limit(row: SweepRow) -> str | None:
    """Return the limit of a plan, or the error of a point."""
    if row.error is not None:
        return row.error.kind
    limit = row.limiting
    if limit is None:
        return None
    return joined(limit.limb, limit.phalanx, limit.joint, limit.limit)


def _print_held(sweep: Sweep, x: int, y: int, out: Console) -> None:
    """Print for each value of one variable the range of the other that holds."""

    def where(value: Any) -> str:
        rows = sorted((row for row in sweep.rows if row.point[y] == value), key=_at(x))
        known = [row for row in rows if row.state != "error"]
        words = ", ".join(map(_interval, held(known, x))) or "none"
        missing = len(rows) - len(known)
        return f"{words} ({missing} without an answer)" if missing else words

    values: list[Any] = list(sweep.design.variations[y].values)
    if sweep.design.variations[y].numbers:
        values.sort()
    columns = name(_head(sweep, y), word_of), text(f"holds for {sweep.design.labels[x]}", where)
    legend = ["between points by interpolation of the utilisation, halfway where there is none"]
    print_rows(_thinned(values), columns, out, legend=legend)


def _interval(held: Held) -> str:
    low, high = held
    if low is None:
        return "all" if high is None else f"up to {high:.4g}"
    return f"from {low:.4g}" + ("" if high is None else f" to {high:.4g}")


def _print_extremes(sweep: Sweep, out: Console) -> None:
    """Print the points of least and most utilisation."""
    ends = sweep.extremes
    lines = [
        (_head(sweep, i), *(word_of(row.point[i]) for row in ends))
        for i in range(len(sweep.design.variations))
    ]
    lines.append(("utilisation", *(f"{row.utilisation:.3f}" for row in ends)))
    lines.append(("load factor", *(_factor(row) or "-" for row in ends)))
    print_rows(lines, in_order([""], ("least used", "most used")), out)


def _head(sweep: Sweep, place: int) -> str:
    """Return a path and its unit; only the end of a long path."""
    label = sweep.design.labels[place]
    most = 30
    return label if len(label) <= most else f"…{label[1 - most :]}"


def _thinned(items: Sequence[ItemT]) -> list[ItemT]:
    """Return 24 items at most, evenly spaced from the first to the last: the lines of a table."""
    places = np.linspace(0, len(items) - 1, min(len(items), 24))
    return [items[round(i)] for i in places]
