"""Fig. 16: force limits over the pulley radii of the middle and the distal joint.

The gripper closes with 46 N on fine concrete, on 300 mm (A) and on 700 mm (B); the proximal radius
stays. Blue cells fail by closing alone, dark blue ones push themselves off the rock.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import (
    Axis,
    Claim,
    Conditions,
    Measure,
    StudyResult,
    conditions_title,
    draw_map,
    legend,
    panels,
    part,
    radius_axes,
    sweep_cell,
    sweep_map,
)
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["plot", "run"]

POINTS: Final = 16
COARSE_POINTS: Final = 6
"""Radii along an axis, at the printed tension and at the lower one; the latter among the former:
``POINTS - 1`` is a multiple of ``COARSE_POINTS - 1``."""

MEASURES_SHOWN: Final[tuple[Measure, ...]] = ("shear", "normal")
SURFACES: Final = ("A", "B")

STEP: Final = 1e-3
"""Of a radius, relative to itself, for derivatives of the contact forces."""

UNMOVED: Final = 1e-6
"""Newtons per millimetre of radius below which a contact force does not depend on it."""


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the maps of both surfaces, and coarser ones at a lower tension."""
    table = gripper_table(hand)
    usual = dict(zip(SURFACES, Conditions.of_fig16(), strict=True))
    tension = experiment_table().scalar("fig16", "lower_tension")
    lower = {name: replace(conditions, tension=tension) for name, conditions in usual.items()}
    # limits at the lower tension at fewer radii, but whether it holds at all of them
    jobs: list[tuple[str, dict[str, Conditions], int, Sequence[Measure]]] = [
        ("maps", usual, POINTS, MEASURES_SHOWN),
        ("maps_at_lower_tension", lower, COARSE_POINTS, MEASURES_SHOWN),
        ("states_at_lower_tension", lower, POINTS, ()),
    ]
    done, total = 0, sum(n * n * len(surfaces) for _, surfaces, n, _ in jobs)
    data: dict[str, Any] = {}
    for key, surfaces, n, measures in jobs:
        axes, data[key] = radius_axes(table, n), {}
        for name, conditions in surfaces.items():
            tell = part(progress, done, done + n * n, total)
            data[key][name] = sweep_map(table, *axes, conditions, measures, tell)
            done += n * n
    data |= {
        "in_use": {
            name: {
                at: sweep_cell(table, surfaces[name], MEASURES_SHOWN)
                for at, surfaces in (("usual", usual), ("lower", lower))
            }
            for name in SURFACES
        },
        "normal_slopes": _slopes(table, usual["A"]),
        "not_tested": [
            "where the printed maps have their edges: they have no numbers on their axes here"
        ],
    }
    title = "force limits over the middle and distal pulley radii"
    return StudyResult("fig16", title, data, tuple(_claims(data)))


def _slopes(table: ParameterTable, conditions: Conditions) -> Array:
    """Return ∂(normal force of a phalanx)/∂(radius of a pulley) at rest, a row a phalanx [N/m]."""
    columns = []
    for i in range(len(PHALANGES)):
        axis = Axis("finger", "pulley_radii", i, (), "m")
        radius = axis.current(table)
        more, less = (
            conditions.gripper(axis.set(table, radius * (1.0 + sign * STEP)))
            .finger_loads(np.zeros((1, 3)))[0]
            .normals[0]
            for sign in (1.0, -1.0)
        )
        columns.append((more - less) / (2.0 * STEP * radius))
    return np.column_stack(columns)


def _claims(data: dict[str, Any]) -> Iterator[Claim]:
    maps, at_lower = data["maps"], data["states_at_lower_tension"]
    for name, usual in maps.items():
        middle, distal = np.meshgrid(usual["x"]["values"], usual["y"]["values"])
        fails = usual["state"] != "holds"
        above, below = fails[distal > middle], fails[distal <= middle]
        yield Claim(
            "the distal pulley should not be larger than the middle one, as this could lead to "
            f"failure by closing alone (Section 7.1): cells that fail, surface {name}",
            "more where the distal one is larger",
            f"{above.mean():.0%} of those where it is, {below.mean():.0%} of the others",
            bool(above.mean() > below.mean()),
        )
        yield Claim(
            f"every distal radius above the middle one fails by closing alone, surface {name}",
            "all cells",
            f"{above.mean():.0%}",
            bool(above.all()),
        )
    for name in SURFACES:
        cell = data["in_use"][name]["usual"]
        yield Claim(
            f"the radii in use perform adequately on surface {name} (Section 7.1, Fig. 16)",
            "they hold, in shear and in pull-off",
            ", ".join([cell["state"], *(f"{m} {v:.1f} N" for m, v in cell["limits"].items())]),
            cell["state"] == "holds" and all(v > 0.0 for v in cell["limits"].values()),
        )
    for name in SURFACES:
        high, low = maps[name], at_lower[name]
        tension, lower = (found["conditions"]["tension"] for found in (high, low))
        yield Claim(
            f"lowering the tendon force may shrink the failure regions: cells that fail at "
            f"{lower:g} N, surface {name} (Section 7.1)",
            f"fewer than at {tension:g} N",
            f"{low['failing']:.1%}, {high['failing']:.1%} at {tension:g} N",
            low["failing"] < high["failing"],
        )
    for name, measure in itertools.product(SURFACES, MEASURES_SHOWN):
        high, low = maps[name]["limits"][measure], data["maps_at_lower_tension"][name]
        # cell by cell of the coarser map
        every = (len(high) - 1) // (len(low["state"]) - 1)
        thinned = high[::every, ::every]
        ratios = (low["limits"][measure] / thinned)[thinned > 0.0]
        ratios = ratios[np.isfinite(ratios)]
        ratio = float(np.median(ratios)) if len(ratios) else float("nan")
        yield Claim(
            f"but also reduces the limits: {measure}, median over the cells that hold at "
            f"both tensions, surface {name}",
            f"less than at {maps[name]['conditions']['tension']:g} N",
            f"{ratio:.2f} of it ({len(ratios)} cells)",
            ratio < 1.0,
        )
    moved = np.abs(1e-3 * data["normal_slopes"]) > UNMOVED
    yield Claim(
        "a change in only one of the radii adjusts every contact force (Section 7.1)",
        "3 of 3 normal forces for each radius",
        ", ".join(f"{name} {n}" for name, n in zip(PHALANGES, moved.sum(axis=0), strict=True)),
        bool(moved.all()),
    )


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the maps at the printed tension, and at the lower one."""
    return {
        "fig16": _draw(result.data["maps"]),
        "fig16_lower_tension": _draw(result.data["maps_at_lower_tension"]),
    }


def _draw(maps: dict[str, dict[str, Any]]) -> Figure:
    figure, shown = panels(len(MEASURES_SHOWN), len(maps), (12.0, 10.0), grid="none")
    each = itertools.product(MEASURES_SHOWN, maps.items())
    for axes, (measure, (name, data)) in zip(shown, each, strict=True):
        draw_map(axes, data, measure)
        axes.set_title(f"{name}: {conditions_title(data['conditions'])}")
    legend(figure, list(maps.values()))
    return figure
