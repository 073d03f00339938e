"""Picture of a hand that opens: its wrench over the tension, and the tiles that let go."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, SERIES_COLOURS, write_picture
from planner.capability import WRENCH_COMPONENTS

if TYPE_CHECKING:
    from hand_models.opening import HandPath

__all__ = ["plot_opening"]


def plot_opening(opening: HandPath, path: Path, title: str) -> None:
    """Draw the force and the moment of a hand that opens, and when its tiles let go, to a file.

    Parameters
    ----------
    opening : HandPath
        From `hand_models.opening.opening_path`.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
    """
    names = [f"{each.finger} {each.phalanx}" for each in opening.events]
    figure = Figure(figsize=(7.5, 5.6 + 0.2 * len(names)), layout="constrained")
    forces, moments, tiles = figure.subplots(
        3, 1, sharex=True, height_ratios=(3.0, 2.0, 1.0 + 0.22 * len(names))
    )
    tension = opening.tensions[:, 0]
    for k, component in enumerate(WRENCH_COMPONENTS):
        style: dict[str, Any] = {"color": SERIES_COLOURS[k % 3], "marker": "os^"[k % 3]}
        axes = forces if k < 3 else moments
        axes.plot(tension, opening.wrenches[:, k], markersize=4, label=component, **style)
    for axes, unit in ((forces, "force on the rock, in H [N]"), (moments, "moment [N·m]")):
        axes.set_ylabel(unit)
        axes.axhline(0.0, color="0.7", linewidth=0.8)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    for row, event in enumerate(opening.events):
        tiles.plot([tension[0], event.tension], [row, row], color=COLOUR_OF["blue"], linewidth=3.0)
        tiles.plot(event.tension, row, "x", color=COLOUR_OF["red"])
        for axes in (forces, moments):
            axes.axvline(event.tension, color="0.85", linewidth=0.8, zorder=0)
    tiles.set_yticks(range(len(names)), names, fontsize=8)
    tiles.set_ylim(len(names) - 0.4, -0.6)
    tiles.set_xlabel("tension of all tendons, lowered from left to right [N]; × the tile lets go")
    tiles.set_xlim(1.02 * tension[0], -0.02 * tension[0])
    said = [jam.reason for jam in opening.jammed]
    if opening.resting:
        said.append(f"pressed on the rock by springs at the end: {', '.join(opening.resting)}")
    figure.suptitle("\n".join([f"{title}: the hand opens", *said]), fontsize=11, parse_math=False)
    write_picture(figure, path, 110)
