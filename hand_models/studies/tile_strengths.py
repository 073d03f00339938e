"""Strength of tiles in shear on concrete, measured ([16], Fig. 7) and simulated: a part of Fig. 10.

The array's asperities come from these measurements.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF
from hand_models.experiments import StudyText, panels
from hand_models.tile import LEAST_SPINES, SpineArray, measured_tile_shear, statistics

__all__ = ["check_cells", "draw_cells", "simulated_cells"]


def simulated_cells(seed: int, tiles: int) -> list[dict[str, Any]]:
    """Simulate every cell of the measured table, with a number of tiles each."""
    cells = []
    for concrete in ("fine", "coarse"):
        array = SpineArray.named(f"concrete-{concrete}")
        for cell in measured_tile_shear(concrete):
            tile = replace(array, spines=cell.spines, backlash=cell.backlash)
            rng = np.random.default_rng(seed)
            found = statistics(tile.simulate_drag(rng, tiles))
            simulated = {"simulated_mean": found.mean, "simulated_deviation": found.deviation}
            cells.append({"concrete": concrete, **cell._asdict(), **simulated})
    return cells


def check_cells(text: StudyText, cells: list[dict[str, Any]]) -> None:
    """Hold the simulated strengths and their scatter against the measured ones."""
    enough = [cell for cell in cells if cell["spines"] >= LEAST_SPINES]
    few = [cell for cell in cells if cell["spines"] < LEAST_SPINES]
    for name, group in (("strength_of_many", enough), ("strength_of_few", few)):
        off = [abs(cell["simulated_mean"] - cell["mean"]) / cell["error"] for cell in group]
        within = sum(each <= 1.0 for each in off)
        text.check(name, max(off) <= 1.0, within=within, of=len(off), most=max(off))
    for concrete in ("fine", "coarse"):
        group = [cell for cell in enough if cell["concrete"] == concrete]
        ratios = [cell["simulated_deviation"] / cell["error"] for cell in group]
        least, most = min(ratios), max(ratios)
        holds = least >= 0.5 and most <= 1.5
        text.check("scatter", holds, concrete=concrete, least=least, most=most)


def draw_cells(tile_shear: list[dict[str, Any]]) -> Figure:
    """Draw the measured and the simulated strengths over the number of spines."""
    figure, both = panels(1, 2, (11.0, 4.4), sharey=True)
    highest = 1.3 * max(cell["mean"] + cell["error"] for cell in tile_shear)
    for axes, concrete in zip(both, ("fine", "coarse"), strict=True):
        cells = [cell for cell in tile_shear if cell["concrete"] == concrete]
        ordered = itertools.groupby(cells, key=lambda cell: cell["backlash"])
        colours = COLOUR_OF["blue"], COLOUR_OF["green"]
        for (backlash, group), colour in zip(ordered, colours, strict=True):
            keys = ("spines", "mean", "error", "simulated_mean", "simulated_deviation")
            found = np.array([[row[key] for key in keys] for row in group])
            spines, mean, error, simulated, deviation = found.T
            name = f"{1e3 * backlash:g} mm of play"
            measured = {"fmt": "o", "capsize": 3, "color": colour, "label": f"measured, {name}"}
            axes.errorbar(spines, mean, error, **measured)
            axes.plot(spines, simulated, color=colour, label=f"simulated, {name}")
            band = simulated - deviation, simulated + deviation
            axes.fill_between(spines, *band, color=colour, alpha=0.15)
        axes.set_ylim(0.0, highest)
        StudyText("fig10").label(axes, "concrete", concrete=concrete)
    both[0].set_ylabel("tile's strength in shear [N]; bars and bands: scatter")
    return figure
