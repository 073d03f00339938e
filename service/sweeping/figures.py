"""The picture of a sweep: curves over one variable, a map over two, panels of maps over more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hand_models.base import InvalidInputError, whole_file
from service.sweeping.evaluation import Row
from service.sweeping.maps import (
    COLOURS,
    MARKERS,
    Side,
    colours_of,
    draw_map,
    draw_samples,
    map_legend,
    state_words,
)
from service.sweeping.result import Sweep
from service.sweeping.variation import Value, word_of

__all__ = ["plot_sweep"]

PANELS: Final = 6
"""Of one figure: values of a third variable, evenly chosen."""

COLUMNS: Final = 3

WORST: Final = ("holds", "overloaded", "infeasible", "error")

TOP: Final = 0.97
"""Height, in axes, of marks of points without a utilisation."""


def plot_sweep(sweep: Sweep, path: Path, title: str, over: tuple[str, str] | None = None) -> None:
    """Draw a sweep.

    A grid over one number is drawn as curves of utilisation and load factor, over a number and
    words as a curve for each word, and over two numbers as a map. Over more there is a map over the
    first two numbers for up to six values of the next variable, each cell the worst over all
    others. Two things that are sampled are drawn as points over both; more, as utilisation over
    each.

    Parameters
    ----------
    sweep : Sweep
    path : Path
        PNG, PDF or SVG.
    title : str
    over : tuple of str, optional
        Paths of the two variations over which it is drawn instead.

    Raises
    ------
    InvalidInputError
        If ``over`` does not name two of them.
    """
    chosen = chosen_pair(sweep, over)
    varying = sweep.design.varying
    if chosen is None and len(varying) == 1:
        figure = _curves(sweep, varying[0], None)
    elif sweep.design.sampled:
        pair = chosen or ((varying[0], varying[1]) if len(varying) == 2 else None)
        figure = _each_alone(sweep, varying) if pair is None else _pair(sweep, *pair)
    else:
        numbers = [i for i in varying if sweep.design.variations[i].numbers]
        words = [i for i in varying if i not in numbers]
        if chosen is None and len(numbers) == len(words) == 1:
            figure = _curves(sweep, numbers[0], words[0])
        else:
            x, y = chosen or [*numbers, *words][:2]
            figure = _maps(sweep, x, y, [i for i in varying if i not in (x, y)])
    holding = sum(row.holds for row in sweep.rows)
    figure.suptitle(
        "\n".join(filter(None, (f"{title}: {holding} of {len(sweep.rows)} points hold",
                                figure.get_suptitle()))),
        fontsize=11,
        parse_math=False,
    )  # fmt: skip
    with whole_file(path) as part:
        figure.savefig(part, dpi=120, facecolor="white")


def chosen_pair(sweep: Sweep, over: tuple[str, str] | None) -> tuple[int, int] | None:
    """Return the places of two variations that are named, or None."""
    if over is None:
        return None
    paths = [each.path for each in sweep.design.variations]
    if over[0] == over[1] or not {*over} <= {*paths}:
        raise InvalidInputError(
            f"must be two different ones of {', '.join(paths)}, got {', '.join(over)}",
            field="over",
        )
    return paths.index(over[0]), paths.index(over[1])


def side_of(sweep: Sweep, place: int) -> Side:
    """Return a variation as an axis: numbers in their order, words in the order given."""
    variation, label = sweep.design.variations[place], sweep.design.labels[place]
    if variation.numbers:
        values = {row.point[place] for row in sweep.rows} if sweep.design.sampled else None
        return Side(label, tuple(sorted(values or variation.values)))  # type: ignore[type-var]
    return Side(label, variation.values, tuple(map(word_of, variation.values)))


def _worst(rows: Sequence[Row]) -> Row:
    return max(rows, key=lambda row: (WORST.index(row.state), row.margin or 0.0))


# Over one -----------------------------------------------------------------------------------------


def _curves(sweep: Sweep, x: int, series: int | None) -> Figure:
    figure = Figure(figsize=(8.0, 6.6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    side = side_of(sweep, x)
    lines = [None] if series is None else list(sweep.design.variations[series].values)
    for k, value in enumerate(lines):
        rows = [row for row in sweep.rows if series is None or row.point[series] == value]
        by_value = {v: _worst([row for row in rows if row.point[x] == v]) for v in side.values
                    if any(row.point[x] == v for row in rows)}  # fmt: skip
        places = np.array([side.place(v) for v in by_value])
        style: dict[str, Any] = {"marker": ".", "color": f"C{k}"}
        if side.words:
            style |= {"marker": "o", "linestyle": ""}
        name = "" if series is None else word_of(value)
        for axes, numbers in (
            (upper, [row.utilisation for row in by_value.values()]),
            (lower, [row.load_factor for row in by_value.values()]),
        ):
            shown = np.array([np.nan if number is None else number for number in numbers])
            axes.plot(places, shown, label=name, **style)
        for state in ("infeasible", "error"):
            there = [i for i, row in enumerate(by_value.values()) if row.state == state]
            upper.plot(
                places[there], np.full(len(there), TOP - 0.05 * k), MARKERS[state],
                color=COLOURS[state] if series is None else f"C{k}",
                transform=upper.get_xaxis_transform(),
            )  # fmt: skip
    _finish_curves(sweep, figure, upper, lower, side, series)
    return figure


def _finish_curves(
    sweep: Sweep, figure: Figure, upper: Any, lower: Any, side: Side, series: int | None
) -> None:
    caps = {row.cap for row in sweep.rows}
    handles: list[Any] = []
    if len(caps) == 1:
        upper.axhline(*caps, color="tab:red", linestyle="--", linewidth=1.0)
        handles.append(_cap_line(*caps))
    lower.axhline(1.0, color="tab:red", linestyle="--", linewidth=1.0)
    for border in sweep.borders:
        for axes in (upper, lower):
            axes.axvline(border.holds, color="0.3", linestyle=":", linewidth=1.2)
        unit = "" if border.unit is None else f" {border.unit}"
        words = f"stops holding at {border.holds:.4g}{unit}"
        handles.append(Line2D([], [], color="0.3", linestyle=":", label=words))
    if series is not None:
        handles = [*upper.get_lines()[: 3 * len(sweep.design.variations[series].values) : 3],
                   *handles]  # fmt: skip
    handles += [each for each in state_words(sweep.rows) if each.get_marker() in "x+"]
    upper.set_ylabel("utilisation [1]")
    lower.set(ylabel="load factor [1]", xlabel=side.label)
    side.tick(lower.xaxis)
    for axes in (upper, lower):
        axes.grid(alpha=0.3)
        axes.margins(y=0.12)
    title = None if series is None else sweep.design.labels[series]
    figure.legend(handles=handles, loc="outside lower center", fontsize=9, title=title,
                  ncols=2 if len(handles) < 5 else 3)  # fmt: skip


# Over two -----------------------------------------------------------------------------------------


def _maps(sweep: Sweep, x: int, y: int, others: list[int]) -> Figure:
    """Draw a map, or one for each of some values of the first of the others."""
    across, up = side_of(sweep, x), side_of(sweep, y)
    panel = others[0] if others else None
    values: tuple[Value, ...] = (None,)
    if panel is not None:
        given = side_of(sweep, panel).values
        values = tuple(given[i] for i in _evenly(len(given), PANELS))
    columns = min(COLUMNS, math.ceil(math.sqrt(len(values))))
    lines = math.ceil(len(values) / columns)
    size = (8.2, 6.4) if panel is None else (1.6 + 4.4 * columns, 1.4 + 3.9 * lines)
    figure = Figure(figsize=size, layout="constrained")
    every = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True).ravel()
    cells: dict[tuple[Value, Value, Value], list[Row]] = {}
    for row in sweep.rows:
        key = (None if panel is None else row.point[panel], row.point[y], row.point[x])
        cells.setdefault(key, []).append(row)
    worst = {key: _worst(rows) for key, rows in cells.items()}
    shown = [worst[v, b, a] for v in values for b in up.values for a in across.values]
    colours = colours_of(shown)
    for i, (axes, value) in enumerate(zip(every, values, strict=False)):
        rows = [[worst[value, b, a] for a in across.values] for b in up.values]
        mesh = draw_map(axes, across, up, rows, colours)
        axes.label_outer()
        if i + columns >= len(values):
            axes.xaxis.set_tick_params(labelbottom=True)
            axes.set_xlabel(across.label)
        if panel is not None:
            axes.set_title(_titled(sweep, panel, value), fontsize=9)
    for axes in every[len(values) :]:
        axes.remove()
    beyond = max((row.utilisation or 0.0 for row in shown), default=0.0) > float(colours.vmax or 0)
    figure.colorbar(mesh, ax=list(every[: len(values)]), label="utilisation [1]",
                    extend="max" if beyond else "neither")  # fmt: skip
    if handles := map_legend(shown):
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 2),
                      fontsize=9)  # fmt: skip
    if others[1:]:
        names = ", ".join(sweep.design.variations[i].path for i in others[1:])
        figure.suptitle(f"each cell: the worst over {names}")
    return figure


def _titled(sweep: Sweep, place: int, value: Value) -> str:
    unit = sweep.design.targets[place].unit
    told = word_of(value) if unit is None else f"{word_of(value)} {unit}"
    return f"{sweep.design.variations[place].path} = {told}"


def _evenly(count: int, most: int) -> list[int]:
    """Return so many places at most, evenly from the first to the last."""
    if count <= most:
        return list(range(count))
    return [round(i * (count - 1) / (most - 1)) for i in range(most)]


def _pair(sweep: Sweep, x: int, y: int) -> Figure:
    figure = Figure(figsize=(8.2, 6.4), layout="constrained")
    axes = figure.subplots()
    colours = colours_of(sweep.rows)
    points = [(row.point[x], row.point[y], row) for row in sweep.rows]
    shown = draw_samples(axes, side_of(sweep, x), side_of(sweep, y), points, colours)
    if shown is not None:
        most = max(row.utilisation or 0.0 for row in sweep.rows)
        beyond = most > float(colours.vmax or 0.0)
        figure.colorbar(shown, ax=axes, label="utilisation [1]",
                        extend="max" if beyond else "neither")  # fmt: skip
    figure.legend(handles=state_words(sweep.rows), loc="outside lower center", ncols=2, fontsize=9)
    return figure


def _each_alone(sweep: Sweep, varying: Sequence[int]) -> Figure:
    """Draw utilisation over each of what is sampled."""
    columns = min(COLUMNS, len(varying))
    lines = math.ceil(len(varying) / columns)
    figure = Figure(figsize=(0.8 + 4.0 * columns, 1.6 + 3.4 * lines), layout="constrained")
    every = figure.subplots(lines, columns, squeeze=False, sharey=True).ravel()
    caps = {row.cap for row in sweep.rows}
    for axes, place in zip(every, varying, strict=False):
        side = side_of(sweep, place)
        for state, marker in MARKERS.items():
            rows = [row for row in sweep.rows if row.state == state]
            places = [side.place(row.point[place]) for row in rows]
            known = all(row.utilisation is not None for row in rows)
            heights = [row.utilisation for row in rows] if known else np.full(len(rows), TOP)
            drawn = {} if known else {"transform": axes.get_xaxis_transform()}
            axes.plot(places, heights, marker, color=COLOURS[state], markersize=4, **drawn)
        for cap in caps if len(caps) == 1 else ():
            axes.axhline(cap, color="tab:red", linestyle="--", linewidth=1.0)
        axes.set(xlabel=side.label, ylabel="utilisation [1]")
        axes.xaxis.label.set_size(9)
        axes.yaxis.set_tick_params(labelleft=True)
        side.tick(axes.xaxis)
        axes.grid(alpha=0.3)
        axes.margins(y=0.12)
    for axes in every[len(varying) :]:
        axes.remove()
    handles = state_words(sweep.rows)
    if len(caps) == 1:
        handles.append(_cap_line(*caps))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9)
    return figure


def _cap_line(cap: float) -> Line2D:
    words = f"cap on the utilisation: {cap:g}"
    return Line2D([], [], color="tab:red", linestyle="--", linewidth=1.0, label=words)
