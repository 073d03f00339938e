"""Pictures of survival.

Of a stance: a cascade as a timeline, survival over load, predicted over simulated. Of a climb:
survival stage by stage.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, write_picture
from planner.result import Survival, SurvivalShare
from planner.route import RouteSurvival

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_route_survival", "plot_survival"]

DRAWN_SHARES = (
    ("holds", COLOUR_OF["blue"], "all hands hold, tensions fixed"),
    ("replanned", COLOUR_OF["green"], "all hands hold, new set-points after each slip"),
)
"""Shares that are drawn, with their colours."""


MOST_SLIPS: Final = 24
"""Largest number of rows of a drawn cascade, for which there is room at eight points."""


def plot_survival(
    found: Survival, over_load: Sequence[tuple[float, Survival]], path: Path, title: str
) -> None:
    """Draw a cascade, survival over the load, and predicted against simulated slips, to a file.

    Parameters
    ----------
    found : Survival
        Survival at the load that was asked for; slips were simulated.
    over_load : sequence of (float, Survival)
        Multiples of that load, in rising order, and survival there.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
    """
    figure = Figure(figsize=(11.5, 5.6), layout="constrained")
    timeline, curves, agreement = figure.subplots(1, 3, width_ratios=(1.25, 1.1, 0.9))
    _draw_cascade(timeline, found)
    _draw_curves(curves, over_load)
    _draw_agreement(agreement, over_load)
    for axes in (timeline, curves, agreement):
        axes.title.set_fontsize(9)
        axes.xaxis.label.set_fontsize(9)
    strengths = f"strengths {found.strength:g} times those assumed"
    scatter = f"scatter of holds {found.hold_scatter:g}, of the rock {found.rock_scatter:g}"
    lines = (
        f"{title}: when tiles slip",
        f"Weibull modulus {found.moduli}",
        f"{strengths}; {scatter}",
    )
    figure.suptitle("\n".join(lines), fontsize=11, parse_math=False)
    write_picture(figure, path, 120)


def _draw_cascade(axes: Axes, found: Survival) -> None:
    """Draw which tile slips at each step, and the largest load over strength that is left.

    Of a long cascade the first slips and the last ones, with a row between them.
    """
    drawn, more = dict(enumerate(found.cascade)), len(found.cascade) + 1 - MOST_SLIPS
    if more > 1:
        first = MOST_SLIPS // 2
        last = enumerate(found.cascade[first + more :], start=first + 1)
        drawn = dict(enumerate(found.cascade[:first])) | dict(last)
    names = {i: " ".join(filter(None, (s.limb, s.finger, s.phalanx))) for i, s in drawn.items()}
    style: dict[str, Any] = {"height": 0.55, "color": COLOUR_OF["red"], "alpha": 0.75}
    loads = [slip.load for slip in drawn.values()]
    axes.barh(np.array(list(drawn)), loads, label="the weakest, which slips", **style)
    left = np.array([(s.most, i + 0.4) for i, s in drawn.items() if s.most is not None])
    if len(left):
        label = "the weakest of those left, afterwards"
        axes.plot(*left.T, "D", color="black", markersize=5, label=label)
    axes.axvline(1.0, color="0.4", linewidth=1.0, linestyle="--")
    if more > 1:
        names[MOST_SLIPS // 2] = f"… {more} more …"
    rows = sorted(names)
    axes.set_yticks(rows, [names[row] for row in rows], fontsize=8)
    axes.set_ylim(max(len(rows), 1) - 0.3, -0.7)
    end = "then all hands hold" if found.cascade_holds else "then the stance is lost"
    axes.set(
        title="one cascade at fixed tensions, read downward",
        xlabel=f"load over strength; {end if rows else 'nothing slips'}",
    )
    if rows:
        _legend_below(axes)


def _legend_below(axes: Axes) -> None:
    """Draw the legend where it covers nothing."""
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.1), frameon=False)


def _draw_curves(axes: Axes, over_load: Sequence[tuple[float, Survival]]) -> None:
    """Draw the probabilities over the load, with their intervals."""
    loads = [load for load, _ in over_load]
    formula = [s.no_slip for _, s in over_load]
    axes.plot(loads, formula, color="black", label="no tile or palm slips")
    for name, colour, label in DRAWN_SHARES:
        shares = _shares(over_load, name)
        if shares:
            at, (middle, low, high) = list(shares), _ends(shares.values())
            axes.plot(at, middle, "o-", color=colour, label=f"{label}; {_draws(shares)}")
            axes.fill_between(at, low, high, color=colour, alpha=0.2, linewidth=0.0)
    axes.axvline(1.0, color="0.6", linewidth=0.8)
    axes.set(title="survival, with its interval of 95 %", xlabel="load over the one asked for",
             ylabel="probability", ylim=(-0.02, 1.02))  # fmt: skip
    axes.grid(alpha=0.3)
    _legend_below(axes)


def _shares(found: Iterable[tuple[float, Any]], name: str) -> dict[float, SurvivalShare]:
    """Return the shares of a name that are known, by load or by stage."""
    known = ((place, getattr(each, name)) for place, each in found)
    return {place: share for place, share in known if isinstance(share, SurvivalShare)}


def _ends(shares: Iterable[SurvivalShare]) -> Array:
    """Return the probabilities of shares, and the low and high ends of their intervals."""
    return np.array([(s.probability, s.low, s.high) for s in shares]).reshape(-1, 3).T


def _wide(ends: Array) -> Array:
    """Return how far intervals go down and up from their probabilities."""
    return np.maximum([ends[0] - ends[1], ends[2] - ends[0]], 0.0)


def _draws(shares: Mapping[float, SurvivalShare]) -> str:
    """Return how many draws the shares have, at the load asked for and at the others."""
    here = {share.draws for load, share in shares.items() if load == 1.0}
    others = {share.draws for load, share in shares.items() if load != 1.0}
    said = "draws" if here == others else f"draws at load 1, {_span(others)} at others"
    return f"{_span(here)} {said}"


def _span(numbers: set[int]) -> str:
    return "–".join(str(each) for each in sorted({min(numbers), max(numbers)})) if numbers else "no"


def _draw_agreement(axes: Axes, over_load: Sequence[tuple[float, Survival]]) -> None:
    """Draw the simulated share without a slip over the formula's."""
    known = [(s.no_slip, s.slipped) for _, s in over_load if s.slipped is not None]
    formula = [no_slip for no_slip, _ in known]
    none = 1.0 - _ends(slipped for _, slipped in known)[[0, 2, 1]]
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=0.8)
    axes.errorbar(formula, none[0], yerr=_wide(none), fmt="o", markersize=4, capsize=2.5)
    axes.set(title="no tile or palm slips", xlabel="by the formula", ylabel="simulated")
    axes.set_aspect("equal")
    axes.grid(alpha=0.3)


def plot_route_survival(found: RouteSurvival, path: Path) -> None:
    """Draw the survival of a climb's stages, with that of all together, to a file.

    Parameters
    ----------
    found : RouteSurvival
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    """
    names = [" ".join(filter(None, (f"{s.move}", s.phase, s.limb))) for s in found.stages]
    figure = Figure(figsize=(max(7.0, 2.5 + 0.5 * len(names)), 6.2), layout="constrained")
    axes = figure.subplots()
    known = [(i, s.survival) for i, s in enumerate(found.stages) if s.survival is not None]
    axes.plot([i for i, _ in known], [s.no_slip for _, s in known], "o", color="black",
              markersize=4, label=_of_climb("no tile or palm slips", found.no_slip))  # fmt: skip
    for shift, (name, colour, label) in zip((-0.12, 0.12), DRAWN_SHARES, strict=True):
        shares = _shares(known, name)
        if not shares:
            continue
        whole = getattr(found, name)
        label = _of_climb(label, None if whole is None else whole.all_stages.probability)
        ends, at = _ends(shares.values()), [place + shift for place in shares]
        style: dict[str, Any] = {"color": colour, "markersize": 5, "capsize": 2.5}
        axes.errorbar(at, ends[0], yerr=_wide(ends), fmt="s", label=label, **style)
    for stage in found.stages:
        if stage.survival is None:
            axes.axvspan(stage.index - 0.5, stage.index + 0.5, color="0.85", linewidth=0.0)
            axes.text(stage.index, 0.5, stage.status, rotation=90, ha="center", va="center")
    axes.axvline(found.worst, color=COLOUR_OF["red"], linewidth=6.0, alpha=0.15)
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.get_xticklabels()[found.worst].set_fontweight("bold")
    axes.set(xlim=(-0.6, len(names) - 0.4), ylim=(-0.02, 1.02), xlabel="move, phase and limb",
             ylabel="probability, with its interval of 95 %")  # fmt: skip
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", fontsize=8)
    title = f"{found.route}: when tiles slip, stage by stage; worst {names[found.worst]}"
    figure.suptitle(title, fontsize=11, parse_math=False)
    write_picture(figure, path, 120)


def _of_climb(label: str, value: float | None) -> str:
    """Return a label with the probability of the whole climb, if it is known."""
    return label if value is None else f"{label}; in all stages {value:.3f}"
