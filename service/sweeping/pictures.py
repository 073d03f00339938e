"""Plot a sweep: curves over one variable, a map over two, and panels of maps over more."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hand_models.base import COLOUR_OF, SERIES_COLOURS, Array, panel_grid, write_picture
from service.sweeping.results import Sweep
from service.sweeping.rows import State, SweepRow
from service.sweeping.variation import Value, word_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_sweep"]

LINE_STYLES: Final[dict[str, dict[str, Any]]] = {
    "cap": {"color": COLOUR_OF["red"], "linestyle": "--", "linewidth": 1.0},
    "stop": {"color": "0.3", "linestyle": ":", "linewidth": 1.2},
    "border": {"colors": "black", "linewidths": 1.8},
}

Columns = dict[str, Any]
"""Arrays over the rows of a panel: state, utilisation, load factor, margin, x and y."""


class Look(NamedTuple):
    """Style of the points of one state.

    Attributes
    ----------
    marker, colour : str
        Marker and colour of a point.
    words : str
        Text in the legend.
    fill, hatch : str
        Colour and hatch of a map's cell without a utilisation; empty for states that have one.
    """

    marker: str
    colour: str
    words: str
    fill: str = ""
    hatch: str = ""


STATE_LOOKS: Final[dict[State, Look]] = {
    "holds": Look("o", COLOUR_OF["blue"], "holds"),
    "overloaded": Look("s", COLOUR_OF["red"], "overloaded"),
    "infeasible": Look("x", "0.35", "infeasible: nothing balances the body", "0.75", "////"),
    "error": Look("+", COLOUR_OF["purple"], "no answer: see the column error", "white", "xx"),
}
"""Style of each state, from the best state to the worst."""


def plot_sweep(sweep: Sweep, path: Path, title: str, over: Sequence[str] | None = None) -> None:
    """Plot a sweep to a file.

    A grid over one number becomes curves of utilisation and load factor; over a number and words, a
    curve for each word; over two numbers, a map of the utilisation. A grid over more variables
    becomes maps over the first two numbers, for up to six values of the next variable; each cell
    has the worst result over all other variables. Samples become points over two variables; of more
    variables, plots of the utilisation over each.

    Parameters
    ----------
    sweep : Sweep
        Results of the sweep.
    path : Path
        PNG, PDF or SVG file to write.
    title : str
        Title of the figure.
    over : sequence of str, length 2, optional
        Paths of the two variables of the map, in place of the choice above.

    Raises
    ------
    InvalidInputError
        If ``over`` does not name two variables of the sweep.
    """
    design = sweep.design
    varying, sampled = design.varying, design.sampled
    numbers = [i for i in varying if design.variations[i].numbers]
    ordered = [*numbers, *(i for i in varying if i not in numbers)]
    if over is not None:
        figure = _maps(sweep, *design.places_of(over))
    elif len(varying) == 1 or (len(varying) == 2 and len(numbers) == 1 and not sampled):
        place, *series = ordered
        figure = _plots(sweep, [(place, "utilisation"), (place, "load factor")], *series)
    elif sampled and len(varying) > 2:
        figure = _plots(sweep, [(place, "utilisation") for place in varying])
    else:
        figure = _maps(sweep, *(varying if sampled else ordered)[:2])
    holding = sum(row.holds for row in sweep.rows)
    lines = f"{title}: {holding} of {len(sweep.rows)} points hold", figure.get_suptitle()
    figure.suptitle("\n".join(filter(None, lines)), fontsize=11, parse_math=False)
    write_picture(figure, path, 120)


class Side:
    """Axis of a plot, over one variation.

    Attributes
    ----------
    place : int
        Index of the variation.
    label : str
        Path and unit of the variation.
    values : list of Value
        Numbers in ascending order; words in the order given.
    words : list of str
        Tick labels, if the values are words; empty for numbers.
    places : ndarray, shape (values,)
        Coordinate of each value along the axis.
    """

    def __init__(self, sweep: Sweep, place: int) -> None:
        variation = sweep.design.variations[place]
        self.place, self.label = place, sweep.design.labels[place]
        self.values, self.words = list(variation.values), list(map(word_of, variation.values))
        if variation.numbers:
            self.values = sorted({row.point[place] for row in sweep.rows})  # type: ignore[type-var]
            self.words = []
        self.places = np.array(range(len(self.words)) if self.words else self.values, float)

    def of(self, rows: Sequence[SweepRow]) -> Array:
        """Return the coordinates of rows along the axis, shape (rows,)."""
        found = (self.places[self.values.index(row.point[self.place])] for row in rows)
        return np.fromiter(found, float)

    @property
    def edges(self) -> Array:
        """Ends of the values' cells along the axis, halfway between values, shape (values + 1,)."""
        half = 0.5 * (np.diff(self.places) if len(self.places) > 1 else np.ones(1))
        middle = self.places[:-1] + half[: len(self.places) - 1]
        return np.hstack([self.places[0] - half[0], middle, self.places[-1] + half[-1]])

    def label_axis(self, axis: Any) -> None:
        """Set the label of a matplotlib axis, and its tick labels if the values are words."""
        axis.set_label_text(self.label, fontsize=9)
        if self.words:
            turned = sum(map(len, self.words)) > 40 and axis.axis_name == "x"
            style = {"rotation": 30, "ha": "right"} if turned else {}
            axis.set_ticks(self.places, self.words, **style)
            axis.axes.set(**{f"{axis.axis_name}lim": self.edges[[0, -1]]})


def _columns(rows: Sequence[SweepRow], **sides: Side) -> Columns:
    """Return what is drawn of rows, with their coordinates along the sides."""
    names = ("utilisation", "load_factor", "margin")
    found: Columns = {name: np.array([getattr(row, name) for row in rows], float) for name in names}
    found |= {name: side.of(rows) for name, side in sides.items()}
    return found | {"state": np.array([row.state for row in rows])}


def _figure(
    count: int, columns: int, size: tuple[float, float], **shared: bool
) -> tuple[Figure, list[Any]]:
    """Return a figure with so many panels of a size [in]."""
    whole = 0.8 + size[0] * columns, 1.6 + size[1] * math.ceil(count / columns)
    return panel_grid(count, columns, whole, **shared)


def _rows_by(sweep: Sweep, place: int | None, values: Sequence[Value]) -> list[list[SweepRow]]:
    """Return the rows with each of some values of a variation; all rows where there is none."""
    return [
        [row for row in sweep.rows if place is None or row.point[place] == value]
        for value in values
    ]


def _common_cap(rows: Sequence[SweepRow]) -> float | None:
    """Return the cap on the utilisation, if all rows have the same."""
    caps = {row.cap for row in rows}
    return caps.pop() if len(caps) == 1 else None


def _legend(figure: Figure, handles: Sequence[Any], title: str | None = None) -> None:
    """Write a legend below a figure, if there is one."""
    if handles:
        columns = 2 if len(handles) < 5 else 3
        place: Any = {"loc": "outside lower center", "ncols": columns}
        figure.legend(handles=handles, title=title, fontsize=9, **place)


def _looks(rows: Sequence[SweepRow]) -> list[Look]:
    """Return the looks of the states that there are."""
    states = {row.state for row in rows}
    return [look for state, look in STATE_LOOKS.items() if state in states]


def _markers(rows: Sequence[SweepRow], colour: str | None = None) -> list[Any]:
    """Return the legend of the states that there are, in their colours or in one."""
    return [
        Line2D([], [], ls="", marker=look.marker, color=colour or look.colour, label=look.words)
        for look in _looks(rows)
    ]


# Curves -------------------------------------------------------------------------------------------


def _plots(sweep: Sweep, panels: Sequence[tuple[int, str]], series: int | None = None) -> Figure:
    """Draw numbers over variations, each in a panel, as a curve for each value of a series."""
    curves = panels[0][1] != panels[-1][1]
    columns, size = (1, (7.2, 2.5)) if curves else (min(3, len(panels)), (4.0, 3.4))
    figure, every = _figure(len(panels), columns, size, sharex=curves, sharey=not curves)
    design, cap = sweep.design, _common_cap(sweep.rows)
    values: Sequence[Value] = (None,) if series is None else design.variations[series].values
    colours = itertools.cycle([None] if series is None else SERIES_COLOURS)
    named = list(zip(values, _rows_by(sweep, series, values), colours, strict=False))
    for axes, (place, name) in zip(every, panels, strict=True):
        side = Side(sweep, place)
        for _, rows, colour in named:
            heights = name.replace(" ", "_")
            _draw_curve(axes, _columns(rows, x=side), heights, colour, curves and not side.words)
        limit = 1.0 if name == "load factor" else cap
        if limit is not None:
            axes.axhline(limit, **LINE_STYLES["cap"])
        for border in sweep.borders:
            axes.axvline(border.holds, **LINE_STYLES["stop"])
        axes.set_ylabel(f"{name} [1]")
        axes.grid(alpha=0.3)
        axes.margins(y=0.12)
        side.label_axis(axes.xaxis)
        if curves:
            axes.label_outer()
    handles = [Line2D([], [], color=c, label=word_of(v)) for v, _, c in named if c is not None]
    handles += _markers(sweep.rows, None if series is None else "0.3")
    lines = [] if cap is None else [("cap", f"cap on the utilisation: {cap:g}")]
    for border in sweep.borders:
        lines.append(("stop", f"stops holding at {border.holds:.4g} {border.unit or ''}".strip()))
    handles += [Line2D([], [], **LINE_STYLES[kind], label=words) for kind, words in lines]
    _legend(figure, handles, None if series is None else design.labels[series])
    return figure


def _draw_curve(axes: Any, drawn: Columns, name: str, colour: str | None, line: bool) -> None:
    """Draw one number over x, each point as its state; those without a utilisation at the top."""
    order = np.argsort(drawn["x"], kind="stable")
    if line:
        axes.plot(drawn["x"][order], drawn[name][order], color=colour or COLOUR_OF["blue"])
    for state, look in STATE_LOOKS.items():
        there = drawn["state"] == state
        style: dict[str, Any] = {"color": colour or look.colour, "markersize": 4}
        heights = drawn[name][there]
        if look.hatch:
            # in axes, for points without a utilisation
            top = 0.97
            heights, style["transform"] = np.full(there.sum(), top), axes.get_xaxis_transform()
        axes.plot(drawn["x"][there], heights, look.marker, **style)


# Maps ---------------------------------------------------------------------------------------------


def _maps(sweep: Sweep, *pair: int) -> Figure:
    """Draw a map over two variations, or one for each of some values of a third."""
    design = sweep.design
    others = [] if design.sampled else [i for i in design.varying if i not in pair]
    third, values = None, [None]
    if others:
        third, given = others[0], Side(sweep, others[0]).values
        # six panels at most, and so three side by side
        values = [given[round(i)] for i in np.linspace(0, len(given) - 1, min(len(given), 6))]
    columns = math.ceil(math.sqrt(len(values)))
    size = (4.4, 3.9) if others else (7.4, 4.8)
    figure, every = _figure(len(values), columns, size, sharex=True, sharey=True)
    groups = _rows_by(sweep, third, values)
    shown = [row for rows in groups for row in rows]
    x, y = (Side(sweep, place) for place in pair)
    # of points with caps of their own, colours show parts of these
    shade, of = ("margin", "over its cap ") if _common_cap(shown) is None else ("utilisation", "")
    colours, extend = _colours(shown, shade)
    draw, drawn = _draw_samples if design.sampled else _draw_map, None
    for i, (axes, value, rows) in enumerate(zip(every, values, groups, strict=True)):
        columns_of = _columns(rows, x=x, y=y)
        drawn = draw(axes, x, y, columns_of | {"shade": columns_of[shade]}, colours) or drawn
        x.label_axis(axes.xaxis)
        y.label_axis(axes.yaxis)
        axes.label_outer()
        if i + columns >= len(values):
            axes.xaxis.set_tick_params(labelbottom=True)
            axes.set_xlabel(x.label)
        if third is not None:
            target = design.targets[third]
            words = f"{target.path} = {word_of(value)} {target.unit or ''}"
            axes.set_title(words.strip(), fontsize=9)
    if drawn is not None:
        figure.colorbar(drawn, ax=every, label=f"utilisation {of}[1]", extend=extend)
    _legend(figure, _markers(shown) if design.sampled else _map_handles(shown))
    if others[1:]:
        names = ", ".join(design.targets[i].path for i in others[1:])
        figure.suptitle(f"each cell: the worst over {names}")
    return figure


def _colours(rows: Sequence[SweepRow], shade: str) -> tuple[dict[str, Any], str]:
    """Return the scale of a number, the cap in its middle, and whether some are beyond it.

    It is blue where it holds, white at the cap, and red beyond.
    """
    used = [used for row in rows if (used := getattr(row, shade)) is not None]
    cap = _common_cap(rows) or 1.0
    low, high = min(used, default=0.0), max(used, default=cap)
    # at least from 0.5 to 1.5 caps, and at most to 2: what is beyond is as red as that
    top = max(min(high, 2.0 * cap), 1.5 * cap)
    norm = TwoSlopeNorm(cap, min(low, 0.5 * cap), top)
    return {"cmap": "RdBu_r", "norm": norm}, "max" if high > top else "neither"


def _map_handles(rows: Sequence[SweepRow]) -> list[Any]:
    """Return the legend of a map: its border, and cells without a utilisation."""
    handles: list[Any] = []
    if len({row.holds for row in rows if row.state != "error"}) > 1:
        cap = _common_cap(rows)
        words = "" if cap is None else f": utilisation {cap:g}"
        handles.append(Line2D([], [], color="black", lw=1.8, label=f"stops holding{words}"))
    return handles + [
        Patch(facecolor=look.fill, edgecolor="0.4", hatch=look.hatch, label=look.words)
        for look in _looks(rows)
        if look.hatch
    ]


def _draw_map(axes: Any, x: Side, y: Side, drawn: Columns, colours: dict[str, Any]) -> Any:
    """Draw cells, the worst on top, and the border of those that hold; return the cells."""
    names = list(STATE_LOOKS)
    rank = [names.index(state) for state in drawn["state"]]
    order: Any = np.lexsort((np.nan_to_num(drawn["margin"]), rank))
    cells = np.zeros((len(y.places), len(x.places)), int)
    places: Any = np.searchsorted(y.places, drawn["y"]), np.searchsorted(x.places, drawn["x"])
    cells[places[0][order], places[1][order]] = order  # the last, and worst, stays
    states, margins = drawn["state"][cells], np.ma.masked_invalid(drawn["margin"][cells])
    used = np.ma.masked_invalid(drawn["shade"][cells])
    mesh = axes.pcolormesh(x.edges, y.edges, used, **colours)
    for state, look in STATE_LOOKS.items():
        if look.hatch and (states == state).any():
            there = np.ma.masked_where(states != state, np.ones(states.shape))
            style = {"hatch": look.hatch, "cmap": ListedColormap([look.fill]), "edgecolor": "0.4"}
            axes.pcolor(x.edges, y.edges, there, linewidth=0.0, **style)
    known = ~np.ma.getmaskarray(margins)
    if x.words or y.words or not (known.any() and margins.min() < 1.0 < margins.max()):
        known[:] = False
    else:
        axes.contour(x.places, y.places, margins, levels=[1.0], **LINE_STYLES["border"])
    edges = _edges_of_holding(states, known, x.edges, y.edges)
    axes.add_collection(LineCollection(edges, **LINE_STYLES["border"]))
    # a larger map has no dot at each point
    if cells.size <= 600:
        spots = np.meshgrid(x.places, y.places)
        axes.plot(*map(np.ravel, spots), ".", color="0.3", markersize=2.5, clip_on=False)
    for side, name in ((x, "xlim"), (y, "ylim")):
        axes.set(**{name: (side.places if len(side.places) > 1 else side.edges)[[0, -1]]})
    return mesh


def _edges_of_holding(states: Any, known: Any, across: Array, up: Array) -> list[Any]:
    """Return the edges between cells that hold and others, where no contour shows the border.

    A contour needs four neighbouring cells that all have a ``known`` utilisation.
    """
    squares = np.pad(known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:], 1)
    holds, answered = states == "holds", states != "error"
    beside = (holds[:, 1:] != holds[:, :-1]) & answered[:, 1:] & answered[:, :-1]
    above = (holds[1:] != holds[:-1]) & answered[1:] & answered[:-1]
    beside &= ~(squares[:-1, 1:-1] | squares[1:, 1:-1])
    above &= ~(squares[1:-1, :-1] | squares[1:-1, 1:])
    return [
        *([(across[j + 1], up[i + k]) for k in (0, 1)] for i, j in np.argwhere(beside)),
        *([(across[j + k], up[i + 1]) for k in (0, 1)] for i, j in np.argwhere(above)),
    ]


def _draw_samples(axes: Any, x: Side, y: Side, drawn: Columns, colours: dict[str, Any]) -> Any:
    """Draw samples in the colours of their utilisations; return what a colour bar is of."""
    shown = None
    axes.grid(alpha=0.3)
    for state, look in STATE_LOOKS.items():
        there = drawn["state"] == state
        places = drawn["x"][there], drawn["y"][there]
        if look.hatch:
            axes.scatter(*places, marker=look.marker, color=look.colour, s=36)
        elif there.any():
            style = {**colours, "edgecolor": "0.3", "linewidth": 0.6}
            used = drawn["shade"][there]
            shown = axes.scatter(*places, c=used, marker=look.marker, s=40, **style)
    return shown
