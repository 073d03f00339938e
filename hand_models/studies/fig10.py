"""Fig. 10: the limit curve of one tile on 36-grit sandpaper, simulated, and the laws fitted to it.

Seventy tiles of the spine array are pulled until they fail, five in each of fourteen directions
of the finger plane, as in Section 6.1. The straight lines of the paper, in φ (Eq. 21) and in
Cartesian coordinates, are fitted to them and to the array's mean, and compared with the planner's
law. The study also has the measured strengths from which the array's asperities come, and the
surface out of the finger plane.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models import tile
from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.experiments import StudyResult, StudyText, panels
from hand_models.parameters import ParameterTable
from hand_models.studies.limit_surface import draw_surface, half_plane_gaps, hull_over_surface
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.studies.tile_strengths import check_cells, draw_cells, simulated_cells
from hand_models.tile import SpineArray, Surface

__all__ = ["hull_over_surface", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Simulate pulls of tiles on sandpaper, fit the limit curve to them, and check the claims.

    All of this concerns one tile's spines and the rock, so no parameter of ``hand`` has an effect.
    """
    surface, array = Surface.named("sandpaper-36"), SpineArray.named("sandpaper-36")
    progress(0, 1)
    limit = surface.pull_off_angle
    # loading angles φ of the trials, each with "at least 5 measurements", and of the curves
    angles, repeats = np.radians(np.linspace(-30.0, 67.5, 14)), 5
    curve = np.radians(np.linspace(-30.0, 90.0, 121))
    loads = np.column_stack([np.cos(curve), -np.sin(curve), 0.0 * curve])
    seed, tiles = STUDY_SETTINGS.fig10_seed, STUDY_SETTINGS.fig10_tiles
    rng = np.random.default_rng(seed)
    trials = np.stack([array.simulate(rng, repeats, angle) for angle in angles])
    drag = tile.statistics(array.simulate_drag(np.random.default_rng(seed + 1), tiles))
    spread = tile.statistics(array.simulate(np.random.default_rng(seed + 1), tiles, curve))
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
            "half_plane": tile.directional_strength(tile.inner_half_planes(surface), loads),
            "shear_limit": surface.shear_limit,
            "pull_off_limit": surface.pull_off_limit,
            "pull_off_angle": limit,
            "shear_scatter": surface.shear_scatter,
        },
        "fit_of_trials": tile.fit_line(np.repeat(angles, repeats), trials.ravel(), limit)._asdict(),
        "fit_of_mean": tile.fit_line(curve, mean, limit)._asdict(),
        "cartesian_line_of_mean": _cartesian_line(curve, mean, limit),
        "tile_shear": simulated_cells(seed, tiles),
        "lateral_fit": tile.fit_lateral(array, limit)._asdict(),
        "bounds": half_plane_gaps(surface, seed),
        "hull_over_surface": hull_over_surface(surface),
    }
    progress(1, 1)
    return _checked(surface, array, data)


def _cartesian_line(angles: Array, strengths: Array, pull_off_angle: float) -> dict[str, float]:
    """Fit T + k P = T_0 to the curve up to φ_max, by least squares of the distance."""
    within = tile.within_law(angles, pull_off_angle)
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


def _checked(surface: Surface, array: SpineArray, data: dict[str, Any]) -> StudyResult:
    text, limit, curve = StudyText("fig10"), surface.pull_off_angle, data["array"]["angle"]
    # what the mean of the measurements in one direction is known to
    repeats = data["trials"]["strength"].shape[1]
    error = np.mean(data["array"]["deviation"][tile.within_law(curve, limit)]) / math.sqrt(repeats)
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
    check_cells(text, data["tile_shear"])
    text.check("not_convex", data["hull_over_surface"] > 1.01, got=data["hull_over_surface"])
    return text.result(data)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the limit curve of a tile, the table of strengths, and the limit surface."""
    return {
        "fig10": _draw_curve(result.data),
        "fig10_tile_shear": draw_cells(result.data["tile_shear"]),
        "fig10_surface": draw_surface(),
    }


def _draw_curve(data: dict[str, Any]) -> Figure:
    """Draw the limit curve over the loading angle, and in Cartesian coordinates."""
    figure, (polar, cartesian) = panels(1, 2, (13.0, 5.0))
    text, blue = StudyText("fig10"), COLOUR_OF["blue"]
    fit, planner, array = data["fit_of_trials"], data["planner"], data["array"]
    fitted = np.linspace(0.0, planner["pull_off_angle"], 46)
    line = np.linspace(fit["shear_limit"], fit["pull_off_limit"], 46)
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
        cartesian.plot(*strength * [np.cos(angles), np.sin(angles)], label=of_points, **style)
    text.label(polar, "polar")
    text.label(cartesian, "cartesian")
    return figure
