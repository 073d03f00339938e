"""Fig. 16: force limits over the pulley radii of the middle and the distal joint.

The gripper closes with 46 N on fine concrete, on 300 mm (A) and on 700 mm (B); the proximal radius
is fixed. In blue cells closing alone overloads a tile; in dark blue cells the gripper ejects
itself.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import Axis, Conditions, Measure, StudyResult, StudyText
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["plot", "run"]

MEASURES_SHOWN: Final[tuple[Measure, ...]] = ("shear", "normal")


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute maps of the force limits over the pulley radii, on two surfaces at two tensions."""
    table = gripper_table(hand)
    usual = dict(zip(("A", "B"), Conditions.of_fig16(), strict=True))
    tension = experiment_table().scalar("fig16", "lower_tension")
    lower = {name: replace(conditions, tension=tension) for name, conditions in usual.items()}
    # limits at the lower tension at fewer radii, but whether it holds at all of them
    points, fewer = STUDY_SETTINGS.fig16_points, STUDY_SETTINGS.fig16_coarse_points
    jobs: list[tuple[str, dict[str, Conditions], int, Sequence[Measure]]] = [
        ("maps", usual, points, MEASURES_SHOWN),
        ("maps_at_lower_tension", lower, fewer, MEASURES_SHOWN),
        ("states_at_lower_tension", lower, points, ()),
    ]
    done, total = 0, sum(n * n * len(surfaces) for _, surfaces, n, _ in jobs)
    data: dict[str, Any] = {}
    for key, surfaces, n, measures in jobs:
        axes, data[key] = experiments.radius_axes(table, n), {}
        for name, conditions in surfaces.items():
            report = experiments.part(progress, done, done + n * n, total)
            data[key][name] = experiments.sweep_map(table, *axes, conditions, measures, report)
            done += n * n
    data["in_use"] = {
        name: {
            at: experiments.sweep_cell(table, surfaces[name], MEASURES_SHOWN)
            for at, surfaces in (("usual", usual), ("lower", lower))
        }
        for name in usual
    }
    data["normal_slopes"] = _slopes(table, usual["A"])
    text = StudyText("fig16")
    _check(text, data)
    return text.result(data)


def _slopes(table: ParameterTable, conditions: Conditions) -> Array:
    """Return ∂(normal force of a phalanx)/∂(radius of a pulley) at rest, a row a phalanx [N/m]."""
    columns, step = [], 1e-3  # relative to a radius, for derivatives of the contact forces
    for i in range(len(PHALANGES)):
        axis = Axis("finger", "pulley_radii", i, (), "m")
        radius = axis.current(table)
        more, less = (
            conditions.gripper(axis.set(table, radius * (1.0 + sign * step)))
            .finger_loads(np.zeros((1, 3)))[0]
            .normals[0]
            for sign in (1.0, -1.0)
        )
        columns.append((more - less) / (2.0 * step * radius))
    return np.column_stack(columns)


def _check(text: StudyText, data: dict[str, Any]) -> None:
    maps, states = data["maps"], data["states_at_lower_tension"]
    for name, usual in maps.items():
        middle, distal = np.meshgrid(usual["x"]["values"], usual["y"]["values"])
        fails = usual["state"] != "holds"
        above, below = fails[distal > middle], fails[distal <= middle]
        shares = {"above": above.mean(), "below": below.mean()}
        text.check("distal_larger", above.mean() > below.mean(), surface=name, **shares)
        text.check("every_larger", above.all(), surface=name, **shares)
    for name in maps:
        cell = data["in_use"][name]["usual"]
        given = ", ".join([cell["state"], *(f"{m} {v:.1f} N" for m, v in cell["limits"].items())])
        holds = cell["state"] == "holds" and all(v > 0.0 for v in cell["limits"].values())
        text.check("in_use", holds, got=given, surface=name)
    for name in maps:
        high, low = maps[name], states[name]
        tension, lower = (found["conditions"]["tension"] for found in (high, low))
        found = {"fewer": low["failing"], "more": high["failing"]}
        fewer = low["failing"] < high["failing"]
        text.check("lower_tension", fewer, surface=name, tension=tension, lower=lower, **found)
    for name, measure in itertools.product(maps, MEASURES_SHOWN):
        high, low = maps[name]["limits"][measure], data["maps_at_lower_tension"][name]
        # cell by cell of the coarser map
        every = (len(high) - 1) // (len(low["state"]) - 1)
        thinned = high[::every, ::every]
        ratios = (low["limits"][measure] / thinned)[thinned > 0.0]
        ratios = ratios[np.isfinite(ratios)]
        ratio = float(np.median(ratios)) if len(ratios) else float("nan")
        tension = maps[name]["conditions"]["tension"]
        found = {"ratio": ratio, "cells": len(ratios), "tension": tension}
        text.check("lower_limits", ratio < 1.0, surface=name, measure=measure, **found)
    # a contact force depends on a radius by more than 1e-6 N/mm
    moved = np.abs(1e-3 * data["normal_slopes"]) > 1e-6
    given = experiments.listed(PHALANGES, moved.sum(axis=0), "")
    text.check("every_force", moved.all(), got=given)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the maps of force limits at the printed tension, and at the lower one."""
    return {
        "fig16": _draw(result.data["maps"]),
        "fig16_lower_tension": _draw(result.data["maps_at_lower_tension"]),
    }


def _draw(maps: dict[str, dict[str, Any]]) -> Figure:
    figure, shown = experiments.panels(len(MEASURES_SHOWN), len(maps), (12.0, 10.0), grid="none")
    each = itertools.product(MEASURES_SHOWN, maps.items())
    for axes, (measure, (name, data)) in zip(shown, each, strict=True):
        experiments.draw_map(axes, data, measure)
        axes.set_title(f"{name}: {experiments.conditions_title(data['conditions'])}")
    experiments.legend(figure, list(maps.values()))
    return figure
