"""The picture of a climb: utilisation and load factor, stance by stance, with its crux."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import whole_file
from planner.route import RouteResult

__all__ = ["draw_route", "plot_route"]

CUT: Final = 2.0
"""Largest utilisation that a route's picture shows in full."""

HEADROOM: Final = 1.2
"""Height of the utilisations' panel, over the tallest bar or the limit: for the crux's name."""

OVER: Final[dict[str, Any]] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
"""Where the legend is: above what is drawn."""

PHASE_COLOURS: Final = {
    "start": "0.4",
    "shift": "tab:purple",
    "lift": "tab:orange",
    "place": "tab:blue",
}


def plot_route(result: RouteResult, path: Path) -> None:
    """Write the picture of a climb, as `draw_route` draws it."""
    with whole_file(path) as part:
        draw_route(result).savefig(part, dpi=130, bbox_inches="tight", facecolor="white")


def draw_route(result: RouteResult) -> Figure:
    """Draw utilisation and load factor along a climb, with its crux."""
    figure = Figure(figsize=(11.0, 6.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    index = np.arange(len(result.plans))
    used = np.array([np.nan if p.utilisation is None else p.utilisation for p in result.plans])
    cap = result.route.limits.utilisation
    # what is far beyond the limit is cut off and written in, so that the rest can be seen
    height = min(float(np.nanmax(np.append(used, cap))), CUT) * 1.1
    colours = [PHASE_COLOURS[stage.phase] for stage in result.stages]
    upper.bar(index, np.nan_to_num(used), color=colours)
    for i in np.flatnonzero(used > height):
        upper.text(i, 0.9 * height, f"{used[i]:.1f}", ha="center", color="white", weight="bold")
    for i in index[np.isnan(used)]:
        upper.bar(i, height, color="none", edgecolor="tab:red", hatch="//")
        upper.text(i, height / 2, result.plans[i].status, rotation=90, ha="center", va="center")
    upper.axhline(cap, color="tab:red", label=f"limit {cap:g}")
    for phase, colour in PHASE_COLOURS.items():
        if any(stage.phase == phase for stage in result.stages):
            upper.bar(0, 0, color=colour, label=phase)
    crux = result.crux
    upper.annotate(
        "crux",
        (crux, height if np.isnan(used[crux]) else min(used[crux], height)),
        xytext=(0, 14),
        textcoords="offset points",
        ha="center",
        weight="bold",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
        arrowprops={"arrowstyle": "-|>"},
    )
    upper.set(
        ylabel="utilisation [1]; below the limit: margin",
        ylim=(0.0, height * HEADROOM),
    )
    figure.suptitle(result.route.name)
    upper.legend(**OVER, ncols=6, fontsize=8, frameon=False)
    factor = np.array([np.nan if p.load_factor is None else p.load_factor for p in result.plans])
    lower.plot(index, factor, "o-", color="0.2")
    lower.axhline(1.0, color="tab:red")
    lower.set(ylabel="load factor [1]", xlabel="stance")
    lower.set_ylim(0.0, 1.1 * float(np.nanmax(np.append(factor, 1.0))))
    labels = [
        "start" if s.move == 0 else f"{s.move} {s.phase}\n{str(s.limb).replace('_', ' ')}"
        for s in result.stages
    ]
    lower.set_xticks(index, labels, rotation=90, fontsize=8)
    for axes in (upper, lower):
        axes.grid(axis="y", alpha=0.3)
    return figure
