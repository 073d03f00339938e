"""Fig. 16: force limits over the pulley radii of the middle and the distal joint.

The gripper closes with 46 N on fine concrete, on 300 mm (A) and on 700 mm (B); the proximal radius
stays. Blue cells fail by closing alone, dark blue ones push themselves off the rock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import (
    Axis,
    Cell,
    Claim,
    Conditions,
    Measure,
    StudyResult,
    conditions_title,
    draw_map,
    failing,
    legend,
    map_data,
    radius_axes,
    save_picture,
    sweep_cell,
    sweep_grid,
)
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["plot", "run"]

POINTS: Final = 16
COARSE_POINTS: Final = 6
"""Radii along an axis, at the printed tension and at the lower one; the latter among the former."""

MEASURES_SHOWN: Final[tuple[Measure, ...]] = ("shear", "normal")
SURFACES: Final = ("A", "B")

STEP: Final = 1e-3
"""Of a radius, relative to itself, for derivatives of the contact forces."""

UNMOVED: Final = 1e-6
"""Newtons per millimetre of radius below which a contact force does not depend on it."""


def run(
    progress: Progress, hand: ParameterTable, points: int = POINTS, coarse: int = COARSE_POINTS
) -> StudyResult:
    """Compute the maps of both surfaces, and coarser ones at a lower tension.

    Parameters
    ----------
    progress : Progress
    hand : ParameterTable
    points, coarse : int, optional
        Radii along an axis at the printed tension and at the lower one; the coarse radii must be
        among the others to be compared: ``points - 1`` a multiple of ``coarse - 1``.
    """
    table = gripper_table(hand)
    usual = Conditions.of_fig16()
    lower = experiment_table().scalar("fig16", "lower_tension")
    fewer = tuple(replace(conditions, tension=lower) for conditions in usual)
    # limits at the lower tension at fewer radii, but whether it holds at all of them
    jobs: list[tuple[Conditions, int, Sequence[Measure]]] = [
        *((conditions, points, MEASURES_SHOWN) for conditions in usual),
        *((conditions, coarse, MEASURES_SHOWN) for conditions in fewer),
        *((conditions, points, ()) for conditions in fewer),
    ]
    total = sum(n * n for _, n, _ in jobs)
    maps: list[dict[str, Any]] = []
    grids: list[list[list[Cell]]] = []
    for conditions, n, measures in jobs:
        before = sum(len(rows) * len(rows) for rows in grids)
        x, y = radius_axes(table, n)
        tell = partial(_tell, progress, before, total)
        rows = sweep_grid(table, x, y, conditions, measures, tell)
        grids.append(rows)
        maps.append(map_data(table, x, y, conditions, measures, rows))
    in_use = [sweep_cell(table, conditions, MEASURES_SHOWN) for conditions in (*usual, *fewer)]
    slopes = _slopes(table, usual[0])
    count = len(usual)
    data: dict[str, Any] = {
        "maps": dict(zip(SURFACES, maps[:count], strict=True)),
        "maps_at_lower_tension": dict(zip(SURFACES, maps[count : 2 * count], strict=True)),
        "states_at_lower_tension": dict(zip(SURFACES, maps[2 * count :], strict=True)),
        "in_use": {
            name: {"usual": a._asdict(), "lower": b._asdict()}
            for name, a, b in zip(SURFACES, in_use[:count], in_use[count:], strict=True)
        },
        "normal_slopes": slopes.tolist(),
        "not_tested": [
            "where the printed maps have their edges: they have no numbers on their axes here"
        ],
    }
    skipped = (points - 1) // (coarse - 1)
    thinned = [[row[::skipped] for row in rows[::skipped]] for rows in grids[:count]]
    axes = radius_axes(table, points)
    claims = (
        *_claims_of_the_radii(axes, grids[:count]),
        *_claims_in_use(in_use[:count]),
        *_claims_of_failure(grids[:count], grids[2 * count :], usual[0].tension, lower),
        *_claims_of_the_tension(thinned, grids[count : 2 * count], usual[0].tension),
        _claim_of_the_slopes(slopes),
    )
    return StudyResult(
        "fig16", "force limits over the middle and distal pulley radii", data, claims
    )


def _tell(progress: Progress, before: int, total: int, done: int, _: int) -> None:
    """Pass on how much of one map is done."""
    progress(before + done, total)


def _slopes(table: ParameterTable, conditions: Conditions) -> Array:
    """Return ∂(normal force of a phalanx)/∂(radius of a pulley) at rest, a row a phalanx [N/m]."""
    columns = []
    for i in range(len(table.vector("finger", "pulley_radii"))):
        axis = Axis("finger", "pulley_radii", i, (), "m")
        radius = axis.current(table)
        ends = [
            _normals(conditions.gripper(axis.set(table, radius * (1.0 + sign * STEP))))
            for sign in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1]) / (2.0 * STEP * radius))
    return np.column_stack(columns)


def _normals(grasp: Gripper) -> Array:
    return np.asarray(grasp.finger_loads(np.zeros((1, 3)))[0].normals[0])


def _claims_of_the_radii(
    axes: tuple[Axis, Axis], grids: Sequence[Sequence[Sequence[Cell]]]
) -> list[Claim]:
    middle, distal = np.meshgrid(axes[0].values, axes[1].values)
    claims = []
    for name, rows in zip(SURFACES, grids, strict=True):
        fails = np.array([[cell.state != "holds" for cell in row] for row in rows])
        above, below = fails[distal > middle], fails[distal <= middle]
        claims.append(
            Claim(
                "the distal pulley should not be larger than the middle one, as this could lead to "
                f"failure by closing alone (Section 7.1): cells that fail, surface {name}",
                "more where the distal one is larger",
                f"{above.mean():.0%} of those where it is, {below.mean():.0%} of the others",
                bool(above.mean() > below.mean()),
            )
        )
        claims.append(
            Claim(
                f"every distal radius above the middle one fails by closing alone, surface {name}",
                "all cells",
                f"{above.mean():.0%}",
                bool(above.all()),
            )
        )
    return claims


def _claims_in_use(in_use: Sequence[Cell]) -> list[Claim]:
    return [
        Claim(
            f"the radii in use perform adequately on surface {name} (Section 7.1, Fig. 16)",
            "they hold, in shear and in pull-off",
            ", ".join([cell.state, *(f"{m} {v:.1f} N" for m, v in cell.limits.items())]),
            cell.state == "holds" and all(v > 0.0 for v in cell.limits.values()),
        )
        for name, cell in zip(SURFACES, in_use, strict=True)
    ]


def _claims_of_failure(
    usual: Sequence[Sequence[Sequence[Cell]]],
    lower: Sequence[Sequence[Sequence[Cell]]],
    tension: float,
    lower_tension: float,
) -> list[Claim]:
    return [
        Claim(
            f"lowering the tendon force may shrink the failure regions: cells that fail at "
            f"{lower_tension:g} N, surface {name} (Section 7.1)",
            f"fewer than at {tension:g} N",
            f"{failing(low):.1%}, {failing(high):.1%} at {tension:g} N",
            failing(low) < failing(high),
        )
        for name, high, low in zip(SURFACES, usual, lower, strict=True)
    ]


def _claims_of_the_tension(
    usual: Sequence[Sequence[Sequence[Cell]]],
    lower: Sequence[Sequence[Sequence[Cell]]],
    tension: float,
) -> list[Claim]:
    """Hold the limits at two tensions against each other, cell by cell of the coarser map."""
    claims = []
    for name, high, low in zip(SURFACES, usual, lower, strict=True):
        pairs = [
            (a.limits, b.limits)
            for row_a, row_b in zip(high, low, strict=True)
            for a, b in zip(row_a, row_b, strict=True)
            if a.limits and b.limits
        ]
        for measure in MEASURES_SHOWN:
            ratios = [b[measure] / a[measure] for a, b in pairs if a[measure] > 0.0]
            ratio = float(np.median(ratios)) if ratios else float("nan")
            claims.append(
                Claim(
                    f"but also reduces the limits: {measure}, median over the cells that hold at "
                    f"both tensions, surface {name}",
                    f"less than at {tension:g} N",
                    f"{ratio:.2f} of it ({len(ratios)} cells)",
                    ratio < 1.0,
                )
            )
    return claims


def _claim_of_the_slopes(slopes: Array) -> Claim:
    moved = np.abs(1e-3 * slopes) > UNMOVED
    names = ("proximal", "middle", "distal")
    return Claim(
        "a change in only one of the radii adjusts every contact force (Section 7.1)",
        "3 of 3 normal forces for each radius",
        ", ".join(f"{name} {int(n)}" for name, n in zip(names, moved.sum(axis=0), strict=True)),
        bool(moved.all()),
    )


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw the maps at the printed tension, and at the lower one."""
    return [
        save_picture(_draw(result.data["maps"]), folder / "fig16.png"),
        save_picture(
            _draw(result.data["maps_at_lower_tension"]), folder / "fig16_lower_tension.png"
        ),
    ]


def _draw(maps: dict[str, dict[str, Any]]) -> Figure:
    figure = Figure(figsize=(12.0, 10.0), layout="constrained")
    grid = figure.subplots(len(MEASURES_SHOWN), len(maps))
    for row, measure in zip(grid, MEASURES_SHOWN, strict=True):
        for axes, (name, data) in zip(row, maps.items(), strict=True):
            draw_map(axes, data, measure)
            axes.set_title(f"{name}: {conditions_title(data['conditions'])}")
    legend(figure, list(maps.values()))
    return figure
