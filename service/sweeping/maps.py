"""Utilisation over two things that vary: cells of a grid, or samples, in one scale of colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.colors import Normalize, TwoSlopeNorm
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

MOST: Final = 2.0
"""Of the scale, over the cap: what is beyond is as red as that."""

BORDER: Final = "black"
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
    least = low if low < 0.98 * cap else 0.0
    most = min(high, MOST * cap)
    return TwoSlopeNorm(cap, least, most if most > 1.02 * cap else 1.25 * cap)


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
            axes.pcolor(
                across, up, shown, hatch=hatch, facecolor=colour, edgecolor="0.4", linewidth=0.0
            )
    margins = _numbers(rows, lambda row: row.margin)
    known = margins.compressed()
    if min(margins.shape) > 1 and known.size and known.min() < 1.0 < known.max():
        axes.contour(x.places, y.places, margins, levels=[1.0], colors=BORDER, linewidths=1.8)
    axes.set(xlabel=x.label, ylabel=y.label, xlim=x.span(), ylim=y.span())
    x.tick(axes.xaxis)
    y.tick(axes.yaxis)
    return mesh


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
    margins = [row.margin for row in rows if row.margin is not None]
    handles: list[Any] = []
    if margins and min(margins) < 1.0 < max(margins):
        handles.append(Line2D([], [], color=BORDER, linewidth=1.8, label=_cap_words(rows)))
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
