"""Fig. 10: the limit curve of one tile on 36-grit sandpaper, simulated, and the laws fitted to it.

Seventy tiles of the spine array are pulled until they fail, five in each of fourteen directions
of the finger plane, as in Section 6.1. The straight lines of the paper, in φ (Eq. 21) and in
Cartesian coordinates, are fitted to them and to the array's mean, and compared with the planner's
law. The study also has the measured strengths from which the array's asperities come, and the
surface out of the finger plane.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.experiments import StudyResult, StudyText, panels
from hand_models.parameters import ParameterTable
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.tile import (
    LEAST_SPINES,
    SpineArray,
    Surface,
    bounds_gap,
    directional_strength,
    fit_lateral,
    fit_line,
    inner_half_planes,
    measured_tile_shear,
    statistics,
    within_law,
)

__all__ = ["plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Simulate pulls of tiles on sandpaper, fit the limit curve to them, and check the claims.

    All of this concerns one tile's spines and the rock, so no parameter of ``hand`` has an effect.
    """
    surface, array = Surface.named("sandpaper-36"), SpineArray.named("sandpaper-36")
    progress(0, 1)
    limit = surface.pull_off_angle
    # loading angles φ of the trials and of the curves; "each point represents data of at least 5
    # measurements"
    angles, repeats = np.radians(np.linspace(-30.0, 67.5, 14)), 5
    curve = np.radians(np.linspace(-30.0, 90.0, 121))
    seed, tiles = STUDY_SETTINGS.fig10_seed, STUDY_SETTINGS.fig10_tiles
    rng = np.random.default_rng(seed)
    trials = np.stack([array.simulate(rng, repeats, angle) for angle in angles])
    drag = statistics(array.simulate_drag(np.random.default_rng(seed + 1), tiles))
    spread = statistics(array.simulate(np.random.default_rng(seed + 1), tiles, curve))
    mean = drag.mean * array.share(curve)
    data: dict[str, Any] = {
        "surface": "sandpaper-36",
        "trials": {"angle": angles, "strength": trials},
        "array": {
            "angle": curve,
            "mean": mean,
            "deviation": spread.deviation,
            "quantiles_5_50_95": spread.quantiles,
        },
        "planner": {
            "law": surface.strength(curve),
            "half_plane": directional_strength(inner_half_planes(surface), _directions(curve, 0.0)),
            "shear_limit": surface.shear_limit,
            "pull_off_limit": surface.pull_off_limit,
            "pull_off_angle": limit,
            "shear_scatter": surface.shear_scatter,
        },
        "fit_of_trials": fit_line(np.repeat(angles, repeats), trials.ravel(), limit)._asdict(),
        "fit_of_mean": fit_line(curve, mean, limit)._asdict(),
        "cartesian_line_of_mean": _cartesian_line(curve, mean, limit),
        "tile_shear": _table(),
        "lateral_fit": fit_lateral(array, limit)._asdict(),
        "bounds": _gaps(surface),
        "hull_over_surface": hull_over_surface(surface),
    }
    progress(1, 1)
    text = StudyText("fig10")
    _check(text, surface, array, data)
    return text.result(data)


def _directions(angle: Array | float, azimuth: Array | float) -> Array:
    """Return unit loads (shear, normal, lateral) at loading angles and azimuths, shape (..., 3)."""
    along, aside = np.cos(angle) * np.cos(azimuth), np.cos(angle) * np.sin(azimuth)
    return np.stack(np.broadcast_arrays(along, -np.sin(angle), aside), axis=-1)


def _cartesian_line(angles: Array, strengths: Array, pull_off_angle: float) -> dict[str, float]:
    """Fit T + k P = T_0 to the curve up to φ_max, by least squares of the distance."""
    within = within_law(angles, pull_off_angle)
    points = (strengths * [np.cos(angles), np.sin(angles)]).T[within]
    centre = points.mean(axis=0)
    spread = points - centre
    normal = np.linalg.svd(spread)[2][1]
    distance = spread @ normal
    return {
        "slope": float(normal[1] / normal[0]),
        "shear_limit": float(normal @ centre / normal[0]),
        "worst": float(np.abs(distance).max()),
        "r_squared": 1.0 - float(distance @ distance) / float(np.sum(spread**2)),
    }


def _table() -> list[dict[str, Any]]:
    """Simulate every cell of the measured table."""
    cells = []
    for concrete in ("fine", "coarse"):
        array = SpineArray.named(f"concrete-{concrete}")
        for cell in measured_tile_shear(concrete):
            tile = replace(array, spines=cell.spines, backlash=cell.backlash)
            rng = np.random.default_rng(STUDY_SETTINGS.fig10_seed)
            found = statistics(tile.simulate_drag(rng, STUDY_SETTINGS.fig10_tiles))
            simulated = {"simulated_mean": found.mean, "simulated_deviation": found.deviation}
            cells.append({"concrete": concrete, **cell._asdict(), **simulated})
    return cells


def _gaps(surface: Surface) -> list[dict[str, float]]:
    """Return, for numbers of half-planes, how far they are inside and outside the law."""
    rng = np.random.default_rng(STUDY_SETTINGS.fig10_seed)
    directions = np.abs(rng.normal(size=(100_000, 3)))  # for volumes
    directions *= (1.0, -1.0, 1.0)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    sideways = np.array([[0.0, 0.0, 1.0]])
    gaps = []
    for count in (1, 2, 4, 8):
        pieces = replace(surface, half_planes=count)
        reach = float(directional_strength(inner_half_planes(pieces), sideways)[0])
        gap = bounds_gap(pieces, directions)._asdict()
        gaps.append({"half_planes": count, "lateral_reach": reach / surface.shear_limit, **gap})
    return gaps


def hull_over_surface(surface: Surface) -> float:
    """Return the ratio of the volume of a limit surface's convex hull to the surface's volume.

    Both volumes are of the part with shear T ≥ 0 and normal load N ≤ 0 (pull-off).

    Parameters
    ----------
    surface : Surface
    """
    angle, azimuth = np.meshgrid(
        np.linspace(0.0, math.pi / 2, 181), np.linspace(-math.pi / 2, math.pi / 2, 181)
    )
    radius = surface.strength(angle, azimuth)
    points = radius[..., None] * _directions(angle, azimuth)
    rows = np.trapezoid(radius**3 * np.cos(angle) / 3.0, angle, axis=1)
    own = float(np.trapezoid(rows, azimuth[:, 0]))
    return float(scipy.spatial.ConvexHull(points.reshape(-1, 3)).volume) / own


def _check(text: StudyText, surface: Surface, array: SpineArray, data: dict[str, Any]) -> None:
    limit, curve = surface.pull_off_angle, data["array"]["angle"]
    # what the mean of the measurements in one direction is known to
    repeats = data["trials"]["strength"].shape[1]
    error = np.mean(data["array"]["deviation"][within_law(curve, limit)]) / math.sqrt(repeats)
    for name, key in (("linear_in_angle", "fit_of_mean"), ("straight", "cartesian_line_of_mean")):
        text.check(name, data[key]["worst"] <= error, error=error, **data[key])
    fitted, planned = data["fit_of_trials"]["shear_limit"], surface.shear_limit
    text.check("shear_limit", abs(fitted - planned) <= error, got=fitted, claimed=planned)
    ratio, at_limit = surface.pull_off_limit / planned, float(array.share(limit))
    text.check("ratio", abs(at_limit - ratio) <= 0.01 * ratio, got=at_limit, claimed=ratio)
    # beyond φ_max the planner's law, which it holds there, is compared with the array at 60°
    far = math.radians(60.0)
    kept, beyond = float(surface.strength(far) / planned), float(array.share(far))
    text.check("beyond", beyond >= kept, got=beyond, claimed=kept)
    pressed = curve[curve < 0.0]
    force, friction = array.share(pressed), array.tile_friction
    gained = float(np.polyfit(-force * np.sin(pressed), force * np.cos(pressed), 1)[0])
    text.check("friction", abs(gained - friction) <= 1e-6, got=gained, claimed=friction)
    for preset in ("concrete-coarse", "rock"):
        times = Surface.named(preset).shear_limit / planned
        text.check(f"times_on_{preset}", 2.0 <= times <= 5.0, got=times)
    enough = [cell for cell in data["tile_shear"] if cell["spines"] >= LEAST_SPINES]
    few = [cell for cell in data["tile_shear"] if cell["spines"] < LEAST_SPINES]
    for cells, name in ((enough, "strength_of_many"), (few, "strength_of_few")):
        off = [abs(cell["simulated_mean"] - cell["mean"]) / cell["error"] for cell in cells]
        within = sum(each <= 1.0 for each in off)
        text.check(name, max(off) <= 1.0, within=within, of=len(off), most=max(off))
    for concrete in ("fine", "coarse"):
        cells = [cell for cell in enough if cell["concrete"] == concrete]
        ratios = [cell["simulated_deviation"] / cell["error"] for cell in cells]
        least, most = min(ratios), max(ratios)
        holds = least >= 0.5 and most <= 1.5
        text.check("scatter", holds, concrete=concrete, least=least, most=most)
    text.check("not_convex", data["hull_over_surface"] > 1.01, got=data["hull_over_surface"])


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the limit curve of a tile, the table of strengths, and the limit surface."""
    return {
        "fig10": _draw_curve(result.data),
        "fig10_tile_shear": _draw_table(result.data),
        "fig10_surface": _draw_surface(),
    }


def _draw_curve(data: dict[str, Any]) -> Figure:
    """Draw the limit curve over the loading angle, and in Cartesian coordinates."""
    figure, (polar, cartesian) = panels(1, 2, (13.0, 5.0))
    text, blue = StudyText("fig10"), COLOUR_OF["blue"]
    fit, planner, array = data["fit_of_trials"], data["planner"], data["array"]
    fitted = np.linspace(0.0, planner["pull_off_angle"], 46)
    ends = fit["shear_limit"], fit["pull_off_limit"]
    line = np.interp(fitted, fitted[[0, -1]], ends)
    low, _, high = array["quantiles_5_50_95"]
    strengths, curve = data["trials"]["strength"], array["angle"]
    at = np.repeat(data["trials"]["angle"], strengths.shape[1])
    polar.axvspan(-30.0, 0.0, color="0.9")
    polar.fill_between(np.degrees(curve), low, high, color=blue, alpha=0.15, linewidth=0.0)
    cartesian.axhspan(0.0, -20.0, color="0.9")
    dots = {"marker": ".", "ls": "", "color": blue, "alpha": 0.6}
    for angles, strength, label, of_points, style in (
        (at, strengths.ravel(), None, "70 simulated trials", dots),
        (fitted, line, "Eq. 21 fitted to the trials", None, {"color": COLOUR_OF["red"]}),
        (curve, array["mean"], "spine array, mean", None, {"color": blue}),
        (curve, planner["law"], "planner, Eq. 21", None, {"color": "k"}),
        (curve, planner["half_plane"], "planner, half-planes", None, {"color": "k", "ls": ":"}),
    ):
        polar.plot(np.degrees(angles), strength, label=label, **style)
        shear, pull_off = strength * np.cos(angles), strength * np.sin(angles)
        cartesian.plot(shear, pull_off, label=of_points, **style)
    text.label(polar, "polar")
    text.label(cartesian, "cartesian")
    polar.legend()
    cartesian.legend()
    return figure


def _draw_table(data: dict[str, Any]) -> Figure:
    """Draw the measured and the simulated strengths over the number of spines."""
    figure, both = panels(1, 2, (11.0, 4.4), sharey=True)
    highest = 1.3 * max(cell["mean"] + cell["error"] for cell in data["tile_shear"])
    for axes, concrete in zip(both, ("fine", "coarse"), strict=True):
        cells = [cell for cell in data["tile_shear"] if cell["concrete"] == concrete]
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
        StudyText("fig10").label(axes, "concrete", concrete=concrete)
        axes.set_ylim(0.0, highest)
        axes.legend(loc="upper left")
    both[0].set_ylabel("tile's strength in shear [N]; bars and bands: scatter")
    return figure


def _draw_surface() -> Figure:
    """Draw the strength over the azimuth at three loading angles."""
    surface, array = Surface.named("sandpaper-36"), SpineArray.named("sandpaper-36")
    figure, shown = panels(1, 3, (13.0, 4.6))
    azimuth = np.radians(np.linspace(-90.0, 90.0, 181))
    for axes, part in zip(shown, (0.0, 0.5, 1.0), strict=True):
        angle = part * surface.pull_off_angle
        directions = _directions(angle, azimuth)
        drag = float(surface.strength(angle)) / float(array.share(angle))
        one, four = (
            directional_strength(inner_half_planes(replace(surface, half_planes=n)), directions)
            for n in (1, 4)
        )
        own = drag * array.share(angle, azimuth)
        for radius, colour, style, label in (
            (own, COLOUR_OF["blue"], "-", "spine array, to its level"),
            (surface.strength(angle, azimuth), "k", "-", "planner's surface"),
            (one, "k", ":", "half-planes: 1"),
            (four, "k", "--", "half-planes: 4"),
        ):
            shear, _, lateral = radius * directions.T
            axes.plot(shear, lateral, color=colour, linestyle=style, label=label)
        StudyText("fig10").label(axes, "azimuth", angle=math.degrees(angle))
        axes.set_aspect("equal")
    handles, labels = shown[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure
