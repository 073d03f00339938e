"""Pictures of Fig. 10: the limit curve, the table of strengths, and the surface."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array
from hand_models.experiments import panels
from hand_models.tile import SpineArray, Surface, directional_strength, inner_half_planes

__all__ = ["draw_curve", "draw_surface", "draw_table"]


def draw_curve(data: dict[str, Any], repeats: int) -> Figure:
    """Draw the limit curve over the loading angle, and in Cartesian coordinates.

    ``repeats``: trials in each direction.
    """
    figure, (polar, cartesian) = panels(1, 2, (13.0, 5.0))
    angles = data["array"]["angle"]
    curves = (
        (data["array"]["mean"], "tab:blue", "-", "spine array, mean"),
        (data["planner"]["law"], "k", "-", "planner, Eq. 21"),
        (data["planner"]["half_plane"], "k", ":", "planner, half-planes"),
    )
    fit, limit = data["fit_of_trials"], data["planner"]["pull_off_angle"]
    fitted = np.linspace(0.0, limit, 46)
    line = fit["shear_limit"] + (fit["pull_off_limit"] - fit["shear_limit"]) * fitted / limit
    low, _, high = data["array"]["quantiles_5_50_95"]
    of_trials = np.repeat(data["trials"]["angle"], repeats)
    strengths = data["trials"]["strength"].ravel()
    polar.axvspan(-30.0, 0.0, color="0.9")
    polar.fill_between(np.degrees(angles), low, high, color="tab:blue", alpha=0.15, linewidth=0.0)
    polar.plot(np.degrees(of_trials), strengths, ".", color="tab:blue", alpha=0.6)
    polar.plot(np.degrees(fitted), line, color="tab:red", label="Eq. 21 fitted to the trials")
    cartesian.axhspan(0.0, -20.0, color="0.9")
    cartesian.plot(
        strengths * np.cos(of_trials),
        strengths * np.sin(of_trials),
        ".",
        color="tab:blue",
        alpha=0.6,
        label="70 simulated trials",
    )
    cartesian.plot(line * np.cos(fitted), line * np.sin(fitted), color="tab:red")
    for strength, colour, style, label in curves:
        polar.plot(np.degrees(angles), strength, style, color=colour, label=label)
        cartesian.plot(strength * np.cos(angles), strength * np.sin(angles), style, color=colour)
    polar.set(
        xlabel="loading angle φ from shear toward pull-off [°]; grey: pressed",
        ylabel="largest force [N]; band: 5 to 95 % of tiles",
        title="over the loading angle",
        xlim=(-30.0, 90.0),
        ylim=(0.0, 60.0),
    )
    cartesian.set(
        xlabel="shear [N]",
        ylabel="pull-off [N]; grey: pressed",
        title="in Cartesian coordinates",
        xlim=(0.0, 50.0),
        ylim=(-20.0, 20.0),
    )
    polar.legend()
    cartesian.legend()
    return figure


def draw_table(data: dict[str, Any]) -> Figure:
    """Draw the measured and the simulated strengths over the number of spines."""
    figure, both = panels(1, 2, (11.0, 4.4), sharey=True)
    highest = 1.3 * max(cell["mean"] + cell["error"] for cell in data["tile_shear"])
    for axes, concrete in zip(both, ("fine", "coarse"), strict=True):
        cells = [cell for cell in data["tile_shear"] if cell["concrete"] == concrete]
        ordered = itertools.groupby(cells, key=lambda cell: cell["backlash"])
        for (backlash, group), colour in zip(ordered, ("tab:blue", "tab:orange"), strict=True):
            rows = list(group)
            spines, mean, error, simulated, deviation = (
                np.array([row[key] for row in rows])
                for key in ("spines", "mean", "error", "simulated_mean", "simulated_deviation")
            )
            name = f"{1e3 * backlash:g} mm of play"
            axes.errorbar(
                spines, mean, error, fmt="o", color=colour, capsize=3, label=f"measured, {name}"
            )
            axes.plot(spines, simulated, color=colour, label=f"simulated, {name}")
            axes.fill_between(
                spines, simulated - deviation, simulated + deviation, color=colour, alpha=0.15
            )
        axes.set(xlabel="spines of a tile [1]", title=f"{concrete} concrete", ylim=(0.0, highest))
        axes.legend(loc="upper left")
    both[0].set_ylabel("tile's strength in shear [N]; bars and bands: scatter")
    return figure


def draw_surface(preset: str) -> Figure:
    """Draw the strength over the azimuth at three loading angles."""
    surface, array = Surface.named(preset), SpineArray.named(preset)
    figure, shown = panels(1, 3, (13.0, 4.6))
    azimuth = np.radians(np.linspace(-90.0, 90.0, 181))
    for axes, part in zip(shown, (0.0, 0.5, 1.0), strict=True):
        angle = part * surface.pull_off_angle
        along, aside = np.cos(angle) * np.cos(azimuth), np.cos(angle) * np.sin(azimuth)
        directions = np.column_stack([along, np.full(len(along), -math.sin(angle)), aside])
        drag = float(surface.strength(angle)) / float(array.share(angle))
        radii: list[tuple[Array, str, str, str]] = [
            (drag * array.share(angle, azimuth), "tab:blue", "-", "spine array, to its level"),
            (surface.strength(angle, azimuth), "k", "-", "planner's surface"),
        ]
        for count, style in ((1, ":"), (4, "--")):
            pieces = inner_half_planes(replace(surface, half_planes=count))
            radii.append(
                (directional_strength(pieces, directions), "k", style, f"half-planes: {count}")
            )
        for radius, colour, style, label in radii:
            axes.plot(radius * along, radius * aside, style, color=colour, label=label)
        axes.set(
            xlabel="shear [N]",
            ylabel="lateral load [N]",
            title=f"pulled at φ = {math.degrees(angle):g}°",
            aspect="equal",
        )
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure
