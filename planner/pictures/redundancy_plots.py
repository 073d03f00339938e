"""Picture of a stance's redundancy: the utilisation without each tile, finger and hand."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from hand_models.base import panel_grid, write_picture
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS
from planner.pictures.plan_views import ink_on
from planner.result import Loss, Redundancy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_redundancy"]

GRID_COLUMNS: Final = ("base", *PHALANGES, "whole finger")
"""Columns of a hand's grid."""


def plot_redundancy(redundancy: Redundancy, path: Path, title: str) -> None:
    """Draw the utilisation without each part to a file, a grid of fingers and tiles for each hand.

    Parameters
    ----------
    redundancy : Redundancy
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
    """
    limbs = list(dict.fromkeys(loss.limb for loss in redundancy.losses))
    whole = "no plan" if redundancy.utilisation is None else f"{redundancy.utilisation:.3f}"
    # the more the darker, as greys too; what is beyond the cap is bold
    colours = ScalarMappable(Normalize(0.5, 1.5), "YlOrBr")
    size = 8.0, 1.1 + 2.1 * -(-len(limbs) // 2)
    figure, grid = panel_grid(len(limbs), min(len(limbs), 2), size)
    for axes, limb in zip(grid, limbs, strict=True):
        _hand(axes, [loss for loss in redundancy.losses if loss.limb == limb], colours)
    figure.suptitle(f"{title}: utilisation without a part ({whole} with all; bold: beyond the cap)")
    figure.colorbar(colours, ax=grid, label="utilisation [1]", extend="both", shrink=0.9)
    write_picture(figure, path)


def _hand(axes: Axes, losses: list[Loss], colours: ScalarMappable) -> None:
    """Draw the losses of one hand."""
    for loss in losses:
        if loss.finger is None:
            axes.set_title(f"{loss.limb}; without the hand {_number(loss)}", fontsize=10)
            continue
        x = GRID_COLUMNS.index(loss.phalanx or GRID_COLUMNS[-1])
        y = FINGERS.index(loss.finger)
        used = np.inf if loss.utilisation is None else loss.utilisation
        colour = colours.to_rgba(np.array([used]))[0]
        axes.fill([x, x + 1, x + 1, x], [y, y, y + 1, y + 1], color=colour, ec="white", lw=2.0)
        style: dict[str, Any] = {"ha": "center", "va": "center", "color": ink_on(colour)}
        style["weight"] = "normal" if loss.holds else "bold"
        axes.text(x + 0.5, y + 0.5, _number(loss), **style)
    axes.set(xlim=(0, len(GRID_COLUMNS)), ylim=(len(FINGERS), 0))
    names = [name.replace(" ", "\n") for name in GRID_COLUMNS]
    axes.set_xticks([x + 0.5 for x in range(len(GRID_COLUMNS))], names, fontsize=8)
    axes.set_yticks([y + 0.5 for y in range(len(FINGERS))], FINGERS, fontsize=8)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)


def _number(loss: Loss) -> str:
    return "no plan" if loss.utilisation is None else f"{loss.utilisation:.2f}"
