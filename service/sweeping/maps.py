"""Utilisation over two things that vary: cells of a grid, or samples, in one scale of colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, Normalize, TwoSlopeNorm
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hand_models.base import Array
from service.sweeping.evaluation import Row, State
from service.sweeping.variation import Value

__all__ = [
    "COLOURS",
    "MARKERS",
    "Side",
    "colours_of",
    "draw_map",
    "draw_samples",
    "map_legend",
    "state_words",
]

SCALE: Final = "RdBu_r"
"""Colours: blue where it holds, white at the cap, red beyond."""

LEAST, LESS_RED, MOST = 0.5, 1.5, 2.0
"""Of the scale, over the cap: it goes at least from the first to the second, and at most to the
last; what is beyond is as red as that."""

MARKED: Final = 600
"""So many points of a map at most have a dot each."""

BORDER: Final = "black"
WIDTH: Final = 1.8
"""Of the border [pt]."""

HATCHES: Final[dict[State, tuple[str, str, str]]] = {
    "infeasible": ("0.75", "////", "infeasible: nothing balances the body"),
    "error": ("white", "xx", "no answer: see the column error"),
}
"""Colour, hatch and legend of cells without a utilisation."""

COLOURS: Final[dict[State, str]] = {
    "holds": "tab:blue",
    "overloaded": "tab:red",
    "infeasible": "0.35",
    "error": "tab:orange",
}
MARKERS: Final[dict[State, str]] = {
    "holds": "o",
    "overloaded": "s",
    "infeasible": "x",
    "error": "+",
}


class Side(NamedTuple):
    """An axis: its label, and what is drawn where. ``words`` has the ticks of what is no number."""

    label: str
    values: tuple[Value, ...]
    words: tuple[str, ...] = ()

    @property
    def numeric(self) -> bool:
        """Whether it has numbers, and not words."""
        return not self.words

    def place(self, value: Value) -> float:
        """Return where a value is along the axis."""
        if self.words:
            return float(self.values.index(value))
        assert isinstance(value, (int, float))
        return float(value)

    @property
    def places(self) -> Array:
        """Where its values are."""
        return np.array([self.place(value) for value in self.values])

    def edges(self) -> Array:
        """Return where the cells of the values begin and end: halfway to the next."""
        centres = self.places
        if len(centres) == 1:
            return np.array([centres[0] - 0.5, centres[0] + 0.5])
        middle = 0.5 * (centres[1:] + centres[:-1])
        ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
        return np.concatenate([ends[:1], middle, ends[1:]])

    def span(self) -> tuple[float, float]:
        """Return the range that is shown: all cells of words, but of numbers what was asked for."""
        shown = self.edges() if self.words or len(self.values) == 1 else self.places
        return float(shown[0]), float(shown[-1])

    def tick(self, axis: Any) -> None:
        """Write words instead of numbers along an axis, if it has words."""
        if self.words:
            axis.axes.set(**{f"{axis.axis_name}lim": self.span()})
            turn = 30 if sum(map(len, self.words)) > 40 and axis.axis_name == "x" else 0
            end = {"rotation": turn, "ha": "right"} if turn else {}
            axis.set_ticks(self.places, self.words, **end)


def colours_of(rows: Sequence[Row]) -> Normalize:
    """Return the scale of utilisations, with the cap in its middle."""
    used = np.array([row.utilisation for row in rows if row.utilisation is not None])
    caps = {row.cap for row in rows}
    cap = caps.pop() if len(caps) == 1 else 1.0
    low, high = (float(used.min()), float(used.max())) if used.size else (0.0, cap)
    return TwoSlopeNorm(cap, min(low, LEAST * cap), max(min(high, MOST * cap), LESS_RED * cap))


def draw_map(axes: Any, x: Side, y: Side, rows: Sequence[Sequence[Row]], colours: Normalize) -> Any:
    """Draw cells, and the border where they stop holding; return what a colour bar is of.

    Parameters
    ----------
    axes : Axes
    x, y : Side
    rows : sequence of sequence of Row
        By the values of y, then of x.
    colours : Normalize
    """
    used = _numbers(rows, lambda row: row.utilisation)
    across, up = x.edges(), y.edges()
    mesh = axes.pcolormesh(across, up, used, cmap=SCALE, norm=colours)
    for state, (colour, hatch, _) in HATCHES.items():
        there = np.array([[row.state == state for row in line] for line in rows])
        if there.any():
            shown = np.ma.masked_where(~there, np.ones(there.shape))
            colour_only = ListedColormap([colour])
            axes.pcolor(
                across, up, shown, hatch=hatch, cmap=colour_only, edgecolor="0.4", linewidth=0.0
            )
    margins = _numbers(rows, lambda row: row.margin)
    if x.numeric and y.numeric and _crossed(margins.compressed()):
        axes.contour(x.places, y.places, margins, levels=[1.0], colors=BORDER, linewidths=WIDTH)
    else:
        margins = np.ma.masked_invalid(np.full(margins.shape, np.nan))
    segments = _edges_of_holding(rows, margins, across, up)
    axes.add_collection(LineCollection(segments, colors=BORDER, linewidths=WIDTH))
    spots = np.array([(a, b) for b in y.places for a in x.places])
    if len(spots) <= MARKED:
        axes.plot(*spots.T, ".", color="0.3", markersize=2.5, clip_on=False)
    axes.set(xlabel=x.label, ylabel=y.label, xlim=x.span(), ylim=y.span())
    x.tick(axes.xaxis)
    y.tick(axes.yaxis)
    return mesh


def _crossed(margins: Array) -> bool:
    """Whether utilisations over their caps are on both sides of 1."""
    return bool(margins.size) and bool(margins.min() < 1.0 < margins.max())


def _edges_of_holding(
    rows: Sequence[Sequence[Row]], margins: Any, across: Array, up: Array
) -> list[list[tuple[float, float]]]:
    """Return the edges between cells that hold and others, where no contour tells the border.

    A contour needs four neighbouring cells that all have a utilisation.
    """
    known = ~np.ma.getmaskarray(margins)
    squares = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    squares = np.pad(squares, 1)
    segments = []
    for i, line in enumerate(rows):
        for j, row in enumerate(line):
            beside = line[j + 1] if j + 1 < len(line) else row
            if _parted(row, beside) and not (squares[i, j + 1] or squares[i + 1, j + 1]):
                segments.append([(across[j + 1], up[i]), (across[j + 1], up[i + 1])])
            above = rows[i + 1][j] if i + 1 < len(rows) else row
            if _parted(row, above) and not (squares[i + 1, j] or squares[i + 1, j + 1]):
                segments.append([(across[j], up[i + 1]), (across[j + 1], up[i + 1])])
    return segments


def _parted(first: Row, second: Row) -> bool:
    return first.holds != second.holds and "error" not in (first.state, second.state)


def _numbers(rows: Sequence[Sequence[Row]], number: Any) -> Any:
    values = [[number(row) for row in line] for line in rows]
    filled = np.array([[np.nan if v is None else v for v in line] for line in values])
    return np.ma.masked_invalid(filled)


def draw_samples(axes: Any, x: Side, y: Side, points: Any, colours: Normalize) -> Any:
    """Draw samples in the colours of their utilisations; return what a colour bar is of.

    Parameters
    ----------
    axes : Axes
    x, y : Side
    points : iterable of (value, value, Row)
    colours : Normalize
    """
    shown: Any = None
    every = list(points)
    for state, marker in MARKERS.items():
        there = [each for each in every if each[2].state == state]
        if not there:
            continue
        across, up = ([side.place(each[i]) for each in there] for i, side in enumerate((x, y)))
        if state in HATCHES:
            axes.scatter(across, up, marker=marker, color=COLOURS[state], s=36)
        else:
            used = [each[2].utilisation for each in there]
            shown = axes.scatter(
                across, up, c=used, cmap=SCALE, norm=colours, marker=marker, s=40,
                edgecolor="0.3", linewidth=0.6,
            )  # fmt: skip
    axes.set(xlabel=x.label, ylabel=y.label)
    x.tick(axes.xaxis)
    y.tick(axes.yaxis)
    axes.grid(alpha=0.3)
    return shown


def map_legend(rows: Sequence[Row]) -> list[Any]:
    """Return the legend of a map: its border, and cells without a utilisation."""
    handles: list[Any] = []
    if len({row.holds for row in rows if row.state != "error"}) > 1:
        handles.append(Line2D([], [], color=BORDER, linewidth=WIDTH, label=_cap_words(rows)))
    handles += [
        Patch(facecolor=colour, edgecolor="0.4", hatch=hatch, label=words)
        for state, (colour, hatch, words) in HATCHES.items()
        if any(row.state == state for row in rows)
    ]
    return handles


def _cap_words(rows: Sequence[Row]) -> str:
    caps = {row.cap for row in rows}
    return f"stops holding: utilisation {caps.pop():g}" if len(caps) == 1 else "stops holding"


def state_words(rows: Sequence[Row]) -> list[Any]:
    """Return the legend of markers that stand for what became of points."""
    words = {state: words for state, (_, _, words) in HATCHES.items()}
    return [
        Line2D([], [], linestyle="", marker=marker, color=COLOURS[state],
               label=words.get(state, state))
        for state, marker in MARKERS.items()
        if any(row.state == state for row in rows)
    ]  # fmt: skip
