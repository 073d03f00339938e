"""Map the force limits of the gripper over any two entries of its table (parameter sweep).

Fig. 16 is such a map, over the pulley radii of the middle and the distal joint.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import EmptySetError, InvalidInputError, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments.force_limits import (
    MEASURE_UNITS,
    HullPoints,
    Measure,
    rest_state,
    sharpened,
)
from hand_models.experiments.pictures import conditions_title, draw_map, legend, panels
from hand_models.experiments.study_result import StudyResult, track
from hand_models.experiments.sweep_axis import Axis, Conditions
from hand_models.experiments.wrench_hull import clipped_vertices, volume
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["GripperSweep", "plot", "radius_axes", "run", "sweep_cell", "sweep_map"]


def sweep_cell(
    table: ParameterTable, conditions: Conditions, measures: Sequence[Measure]
) -> dict[str, Any]:
    """Return the state and the force limits of a gripper with the parameters of a table.

    Parameters
    ----------
    table : ParameterTable
        Parameters of the gripper.
    conditions : Conditions
    measures : sequence of str
        Keys of `MEASURE_UNITS`.

    Returns
    -------
    dict
        ``state``: 'holds', 'contact fails' or 'ejects' (`rest_state`), or 'no grasp' where the
        fingers do not lie on the rock. ``limits`` by measure, in the unit of `MEASURE_UNITS`: empty
        unless the state is 'holds'.
    """
    limits: dict[Measure, float] = {}
    try:
        grasp = conditions.gripper(table)
    except InvalidInputError:
        return {"state": "no grasp", "limits": limits}
    state = rest_state(grasp)
    if state != "holds" or not measures:
        return {"state": state, "limits": limits}
    try:
        # so fine that limits come out within 5 %, nearly all within 1 %
        points = HullPoints.explored(grasp, rays=300)
        for measure in measures:
            if measure != "volume":
                points, end = sharpened(grasp, points, measure, cuts=4, starts=2)
                limits[measure] = end.value
    except EmptySetError:
        return {"state": "contact fails", "limits": {}}
    if "volume" in measures:
        below = clipped_vertices(points.wrenches)
        limits["volume"] = volume(below) if len(below) else 0.0
    return {"state": state, "limits": limits}


def sweep_map(
    table: ParameterTable,
    x: Axis,
    y: Axis,
    conditions: Conditions,
    measures: Sequence[Measure],
    progress: Progress,
) -> dict[str, Any]:
    """Return the states and force limits of a gripper on a grid over two of its parameters.

    Parameters
    ----------
    table : ParameterTable
        Parameters of the gripper.
    x, y : Axis
        Parameters of the columns and of the rows.
    conditions : Conditions
    measures : sequence of str
        Keys of `MEASURE_UNITS`.
    progress : Progress

    Returns
    -------
    dict
        ``state``: array of str, a row for each value of y, a column for each of x. ``limits`` by
        measure: arrays of that shape, NaN in cells without limits. ``failing``: share of cells not
        in the state 'holds'. ``conditions``, ``x`` and ``y``: the inputs, as dictionaries.

    Raises
    ------
    InvalidInputError
        If the gripper has no grasp with the table's values.
    """
    conditions.gripper(table)
    cells = [
        sweep_cell(y.set(x.set(table, across), up), conditions, measures)
        for up, across in track(progress, list(itertools.product(y.values, x.values)))
    ]
    shape = len(y.values), len(x.values)
    state = np.array([cell["state"] for cell in cells]).reshape(shape)
    sides = {
        name: {
            "entry": axis.entry,
            "unit": axis.unit,
            "values": axis.values,
            "current": axis.current(table),
        }
        for name, axis in (("x", x), ("y", y))
    }
    limits = {m: np.array([cell["limits"].get(m, np.nan) for cell in cells]) for m in measures}
    return {
        "conditions": asdict(conditions),
        **sides,
        "state": state,
        "limits": {measure: values.reshape(shape) for measure, values in limits.items()},
        "failing": float((state != "holds").mean()),
    }


def radius_axes(table: ParameterTable, points: int = 15) -> tuple[Axis, Axis]:
    """Return the axes of Fig. 16: radii of the middle and the distal pulley.

    Parameters
    ----------
    table : ParameterTable
        Parameters of the gripper, for the unit of the radii.
    points : int, optional
        Number of radii on each axis.

    Returns
    -------
    tuple of (Axis, Axis)
        Axis for the middle joint, and for the distal joint.
    """
    low, high = experiment_table().vector("fig16", "radii")
    values = tuple(np.linspace(low, high, points).tolist())
    unit = table.quantity("finger", "pulley_radii").unit
    middle, distal = (Axis("finger", "pulley_radii", i, values, unit) for i in (1, 2))
    return middle, distal


@dataclass(frozen=True)
class GripperSweep:
    """A caller's map of force limits, as a study.

    Attributes
    ----------
    x, y : str, optional
        Text for `Axis.parse`; the axes of Fig. 16 by default.
    conditions : Conditions, optional
        The first of Fig. 16 by default.
    measures : tuple of str
        Keys of `MEASURE_UNITS`.
    """

    x: str | None = None
    y: str | None = None
    conditions: Conditions | None = None
    measures: tuple[Measure, ...] = ("shear", "normal")

    def run(self, progress: Progress, hand: ParameterTable) -> StudyResult:
        """Compute the map of force limits, with the parameters of a hand.

        Raises
        ------
        InvalidInputError
            If a measure, entry or surface is unknown, a range is not possible, or there is no
            grasp.
        """
        for measure in self.measures:
            if measure not in MEASURE_UNITS:
                raise InvalidInputError(
                    f"unknown measure {measure!r}; known are {', '.join(MEASURE_UNITS)}",
                    field="--measure",
                )
        table = gripper_table(hand)
        conditions = self.conditions or Conditions.of_fig16()[0]
        least, most = experiment_table().vector("parameter_studies", "diameter_range")
        if not least <= conditions.diameter <= most:
            raise InvalidInputError(
                f"must be from {least:g} to {most:g} m, got {conditions.diameter:g}",
                field="--diameter",
            )
        strongest = table.scalar("tendon", "maximum_tension")
        if not 0.0 < conditions.tension <= strongest:
            raise InvalidInputError(
                f"must be above 0 and at most tendon.maximum_tension, {strongest:g} N, got "
                f"{conditions.tension:g} N",
                field="--tension",
            )
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
            raise InvalidInputError(f"must differ from --x, got {x.entry} for both", field="--y")
        found = sweep_map(table, x, y, conditions, self.measures, progress)
        if (found["state"] == "no grasp").all():
            # raises the reason
            conditions.gripper(y.set(x.set(table, x.values[0]), y.values[0]))
        data = {
            **found,
            "tile_shear_limit": grasp.surface.shear_limit,
            "current": sweep_cell(table, conditions, self.measures),
            "summary": _summary(found),
        }
        return StudyResult("sweep", f"{x.entry} and {y.entry}: what the gripper holds", data, ())

    def plot(self, result: StudyResult) -> dict[str, Figure]:
        """Draw a map of force limits for each measure, side by side.

        Returns
        -------
        dict of str to Figure
            One figure, ``sweep``.
        """
        data = result.data
        measures: list[Measure] = list(data["limits"])
        figure, shown = panels(1, len(measures), (6.2 * len(measures), 5.6), grid="none")
        for axes, measure in zip(shown, measures, strict=True):
            draw_map(axes, data, measure)
        legend(figure, [data])
        figure.suptitle(conditions_title(data["conditions"]))
        return {"sweep": figure}


run, plot = GripperSweep().run, GripperSweep().plot
"""Run and plot the study without options: the axes and the conditions of Fig. 16."""


def _summary(found: dict[str, Any]) -> list[str]:
    """Return in words where a map works and where it is best."""
    lines = [f"{found['failing']:.0%} of the cells fail before any load"]
    for measure, limits in found["limits"].items():
        held = [(v, i, j) for (j, i), v in np.ndenumerate(limits) if np.isfinite(v)]
        if held:
            best, *place = max(held)
            there = ", ".join(
                f"{side['entry']} = {side['values'][k]:.4g} {side['unit']}"
                for side, k in zip((found["x"], found["y"]), place, strict=True)
            )
            lines.append(f"most {measure}: {best:.4g} {MEASURE_UNITS[measure]} at {there}")
    return lines
