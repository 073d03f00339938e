"""What two numbers of the gripper do to what it holds: maps over any two entries of its table.

Fig. 16 is such a map, over the pulley radii of the middle and the distal joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import EmptySetError, InvalidInputError, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments.force_limits import MEASURES, Measure, force_limits, rest_state
from hand_models.experiments.study_result import StudyResult, save_picture
from hand_models.experiments.sweep_axis import Axis, Conditions
from hand_models.experiments.sweep_picture import NO_GRASP, conditions_title, draw_map, legend
from hand_models.parameters import ParameterTable, experiment_table

__all__ = [
    "Cell",
    "Sweep",
    "failing",
    "map_data",
    "plot",
    "radius_axes",
    "run",
    "sweep_cell",
    "sweep_grid",
]

RAYS: Final = 300
CUTS: Final = 4
STARTS: Final = 2
"""How finely the hull of a cell is found: limits come out within 5 %, nearly all within 1 %."""

POINTS: Final = 15
"""Values along an axis where nothing else is asked for."""


class Cell(NamedTuple):
    """What a gripper holds.

    Attributes
    ----------
    state : str
        Of `force_limits.State`, or ``no grasp`` where the fingers do not lie on the rock.
    limits : dict
        By measure; empty unless the state is ``holds``.
    """

    state: str
    limits: dict[Measure, float]


def sweep_cell(table: ParameterTable, conditions: Conditions, measures: Sequence[Measure]) -> Cell:
    """Return what a gripper of some numbers holds."""
    try:
        grasp = conditions.gripper(table)
    except InvalidInputError:
        return Cell(NO_GRASP, {})
    state = rest_state(grasp)
    if state != "holds" or not measures:
        return Cell(state, {})
    try:
        return Cell(state, force_limits(grasp, RAYS, measures, CUTS, STARTS))
    except EmptySetError:
        return Cell("contact fails", {})


def sweep_grid(
    table: ParameterTable,
    x: Axis,
    y: Axis,
    conditions: Conditions,
    measures: Sequence[Measure],
    tell: Progress,
) -> list[list[Cell]]:
    """Return the cells of a map, a row for each value of ``y``.

    Raises
    ------
    InvalidInputError
        If there is no grasp with the table's own values.
    """
    conditions.gripper(table)
    total = len(x.values) * len(y.values)
    rows: list[list[Cell]] = []
    for j, up in enumerate(y.values):
        row = []
        for i, across in enumerate(x.values):
            tell(j * len(x.values) + i, total)
            row.append(sweep_cell(y.set(x.set(table, across), up), conditions, measures))
        rows.append(row)
    tell(total, total)
    return rows


def failing(rows: Sequence[Sequence[Cell]]) -> float:
    """Return the share of a map's cells without limits."""
    states = [cell.state != "holds" for row in rows for cell in row]
    return sum(states) / len(states)


def radius_axes(table: ParameterTable, points: int = POINTS) -> tuple[Axis, Axis]:
    """Return the axes of Fig. 16: radii of the middle and the distal pulley."""
    low, high = experiment_table().vector("fig16", "radii")
    values = tuple(np.linspace(low, high, points).tolist())
    unit = table.quantity("finger", "pulley_radii").unit
    middle, distal = (Axis("finger", "pulley_radii", i, values, unit) for i in (1, 2))
    return middle, distal


@dataclass(frozen=True)
class Sweep:
    """A map that a caller asks for, as a study.

    Attributes
    ----------
    x, y : str, optional
        As `Axis.parse` reads them; the axes of Fig. 16 by default.
    conditions : Conditions, optional
        Those of Fig. 16 by default, on the first of its surfaces.
    measures : tuple of str
        Of `force_limits.MEASURES`.
    """

    x: str | None = None
    y: str | None = None
    conditions: Conditions | None = None
    measures: tuple[Measure, ...] = ("shear", "normal")

    def run(self, progress: Progress, hand: ParameterTable) -> StudyResult:
        """Compute the map.

        Raises
        ------
        InvalidInputError
            If there is no such measure, entry or surface, a range cannot be, or there is no grasp.
        """
        for measure in self.measures:
            if measure not in MEASURES:
                raise InvalidInputError(
                    f"{measure!r}: valid are {', '.join(MEASURES)}", field="--measure"
                )
        table = gripper_table(hand)
        conditions = self.conditions or Conditions.of_fig16()[0]
        conditions.check(table)
        grasp = conditions.gripper(table)
        axes = list(radius_axes(table))
        for i, (text, option) in enumerate(((self.x, "--x"), (self.y, "--y"))):
            if text is not None:
                try:
                    axes[i] = Axis.parse(text, table, conditions.surface)
                except InvalidInputError as error:
                    raise InvalidInputError(str(error), field=option) from None
        x, y = axes
        if x.entry == y.entry:
            raise InvalidInputError(f"must not be that of --x, {x.entry}", field="--y")
        rows = sweep_grid(table, x, y, conditions, self.measures, progress)
        if all(cell.state == NO_GRASP for row in rows for cell in row):
            # tells why
            conditions.gripper(y.set(x.set(table, x.values[0]), y.values[0]))
        current = sweep_cell(table, conditions, self.measures)
        data = {
            **map_data(table, x, y, conditions, self.measures, rows),
            "tile_shear_limit": grasp.surface.shear_limit,
            "current": current._asdict(),
            "summary": _summary(x, y, rows, self.measures),
        }
        return StudyResult("sweep", f"{x.entry} and {y.entry}: what the gripper holds", data, ())

    def plot(self, result: StudyResult, folder: Path) -> list[Path]:
        """Draw a map for each measure."""
        data = result.data
        measures: list[Measure] = list(data["limits"])
        figure = Figure(figsize=(6.2 * len(measures), 5.6), layout="constrained")
        for axes, measure in zip(
            figure.subplots(1, len(measures), squeeze=False)[0], measures, strict=True
        ):
            draw_map(axes, data, measure)
        legend(figure, [data])
        figure.suptitle(conditions_title(data["conditions"]))
        return [save_picture(figure, folder / "sweep.png")]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the map of the default axes and conditions."""
    return Sweep().run(progress, hand)


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw a map for each measure."""
    return Sweep().plot(result, folder)


def map_data(
    table: ParameterTable,
    x: Axis,
    y: Axis,
    conditions: Conditions,
    measures: Sequence[Measure],
    rows: Sequence[Sequence[Cell]],
) -> dict[str, Any]:
    """Return a map as JSON can write it, enough to draw it again; a limit is null where none is."""
    return {
        "conditions": asdict(conditions),
        "x": {"entry": x.entry, "unit": x.unit, "values": x.values, "current": x.current(table)},
        "y": {"entry": y.entry, "unit": y.unit, "values": y.values, "current": y.current(table)},
        "state": [[cell.state for cell in row] for row in rows],
        "limits": {m: [[cell.limits.get(m) for cell in row] for row in rows] for m in measures},
        "failing": failing(rows),
    }


def _summary(
    x: Axis, y: Axis, rows: Sequence[Sequence[Cell]], measures: Sequence[Measure]
) -> list[str]:
    """Return in words where the map works and where it is best."""
    lines = [f"{failing(rows):.0%} of the cells fail before any load"]
    cells = [(cell, i, j) for j, row in enumerate(rows) for i, cell in enumerate(row)]
    for measure in measures:
        held = [(cell.limits[measure], i, j) for cell, i, j in cells if cell.limits]
        if held:
            best, i, j = max(held)
            lines.append(
                f"most {measure}: {best:.4g} {MEASURES[measure]} at {x.entry} = {x.values[i]:.4g} "
                f"{x.unit}, {y.entry} = {y.values[j]:.4g} {y.unit}"
            )
    return lines
