"""Fifteen data of Figs. 12 and 13, and a gripper's numbers fitted to them by least squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.optimize import brentq, least_squares

from hand_models.base import Array, CruxError, SolverError
from hand_models.compliance import Gripper, boundary, linear_box
from hand_models.experiments import clipped_vertices, extents, in_paper_signs
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, Quantity, experiment_table

__all__ = ["Fit", "FreeParameter", "numbers", "pulled_pose"]

FORCE_TOLERANCE: Final = 0.3
RELATIVE_TOLERANCE: Final = 0.1
MOMENT_TOLERANCE: Final = 0.25
"""Of Fig. 12's values [N] and relative; of the extents in force; of that in moment."""

RAYS: Final = 3000
"""Of the wrench space's boundary."""

POWER: Final = 3
"""To which residuals are raised, sign kept."""

STEP: Final = 2e-3
"""Of finite differences, in plausible ranges."""

HOPELESS: Final = 30.0
"""Residual where a set of numbers gives no gripper that holds."""


@dataclass(frozen=True)
class FreeParameter:
    """One number to be found: its entry in the gripper's table, and its plausible range."""

    label: str
    section: str
    entry: str
    index: int | None
    low: float
    high: float
    unit: str


def numbers() -> tuple[FreeParameter, ...]:
    """Return the numbers to be found."""
    ranges = experiment_table().sections["calibration"]

    def of(label: str, section: str, entry: str, index: int | None, name: str) -> FreeParameter:
        quantity = ranges[name]
        assert isinstance(quantity.value, list)
        low, high = quantity.value
        return FreeParameter(label, section, entry, index, low, high, quantity.unit)

    found = [
        of(name, "gripper", name, None, name)
        for name in ("base_half_spacing", "added_radius", "origin_height")
    ]
    found += [of(name, "finger", name, None, name) for name in ("tile_height", "seated_contact")]
    found += [
        of(f"pulley_radii[{i}]", "finger", "pulley_radii", i, name)
        for i, name in ((1, "middle_radius"), (2, "distal_radius"))
    ]
    for section, entry in (
        ("tile", "engagement"),
        ("gripper", "contact_stiffness"),
    ):
        found += [of(f"{entry}[{i}]", section, entry, i, entry) for i in range(len(PHALANGES))]
    return (*found, *(of(n, "gripper", n, None, n) for n in ("shear_limit", "pull_off_slope")))


class Fit:
    """Residuals of the fifteen data over the numbers, each in plausible ranges from 0 to 1."""

    def __init__(self, table: ParameterTable) -> None:
        self.table = table
        self.numbers = numbers()
        self.low = np.array([number.low for number in self.numbers])
        self.width = np.array([number.high for number in self.numbers]) - self.low
        data = experiment_table()
        self.tension = data.scalar("fig12", "tension")
        self.diameter = data.scalar("fig12", "diameter")
        self.pull = data.scalar("fig12", "pull")
        self.labels: list[str] = []
        values: list[float] = []
        for end in ("unloaded", "pulled"):
            for kind in ("shear", "normal"):
                values += data.vector("fig12", f"{kind}_{end}")
                self.labels += [f"{phalanx} {kind}, {end}" for phalanx in PHALANGES]
        forces = np.array(values)
        far = [data.scalar("fig13", name) for name in ("force_x", "force_z", "moment")]
        self.labels += ["extent of F_x", "extent of F_z", "extent of M_y"]
        self.wanted = np.concatenate([forces, far])
        share = np.array([RELATIVE_TOLERANCE, RELATIVE_TOLERANCE, MOMENT_TOLERANCE])
        self.tolerance = np.concatenate(
            [
                np.maximum(RELATIVE_TOLERANCE * np.abs(forces), FORCE_TOLERANCE),
                share * np.abs(np.array(far)),
            ]
        )

    def start(self) -> Array:
        """Return where the table is."""
        now = [_value(self.table, number) for number in self.numbers]
        return np.asarray(np.clip((np.array(now) - self.low) / self.width, 0.0, 1.0))

    def values(self, x: Array) -> Array:
        """Return the numbers in SI units."""
        return np.asarray(self.low + self.width * x)

    def gripper(self, x: Array) -> Gripper:
        """Return the gripper of some numbers."""
        table = self.table
        for number, value in zip(self.numbers, self.values(x).tolist(), strict=True):
            table = _with(table, number, value)
        return Gripper(self.diameter, self.tension, table=table)

    def model(self, x: Array) -> Array:
        """Return what the model has for the fifteen data, shape (15,) [N, N·m].

        Raises
        ------
        CruxError
            If the fingers do not lie on the surface, or nothing holds.
        """
        gripper = self.gripper(x)
        found: list[float] = []
        for pull in (0.0, self.pull):
            loads, _ = gripper.finger_loads(pulled_pose(gripper, pull)[None])
            found += [*loads.shears[0], *loads.normals[0]]
        space = boundary(gripper, linear_box(gripper), RAYS)
        return np.array([*found, *extents(clipped_vertices(in_paper_signs(space.wrenches)))])

    def residuals(self, x: Array) -> Array:
        """Return how many tolerances each datum is off, shape (15,)."""
        try:
            return np.asarray((self.model(x) - self.wanted) / self.tolerance)
        except CruxError:
            return np.full(len(self.wanted), HOPELESS)

    def jacobian(self, x: Array) -> Array:
        """Return the residuals' slopes over plausible ranges, shape (15, n)."""
        columns = []
        for i in range(len(x)):
            ends = [np.clip(x[i] + side * STEP, 0.0, 1.0) for side in (1.0, -1.0)]
            there = [self.residuals(np.concatenate([x[:i], [end], x[i + 1 :]])) for end in ends]
            columns.append((there[0] - there[1]) / (ends[0] - ends[1]))
        return np.column_stack(columns)

    def fitted(self, x: Array, held: tuple[int, ...], rounds: int, tick: Any) -> Array:
        """Return the numbers that fit best, some of them held."""
        free = np.array([i for i in range(len(x)) if i not in held])

        def cubes(part: Array) -> Array:
            tick()
            whole = x.copy()
            whole[free] = part
            found = self.residuals(whole)
            return np.asarray(np.sign(found) * np.abs(found) ** POWER)

        best = least_squares(
            cubes,
            np.clip(x[free], STEP, 1.0 - STEP),
            bounds=(0.0, 1.0),
            diff_step=np.full(len(free), STEP),
            max_nfev=rounds,
        )
        whole = x.copy()
        whole[free] = best.x
        return whole


def pulled_pose(gripper: Gripper, pull: float) -> Array:
    """Return the pose (x, z, ω_y) at which a symmetric pull along −z is balanced, shape (3,).

    Raises
    ------
    SolverError
        If no pose does.
    """

    def excess(z: float) -> float:
        return float(gripper.evaluate(np.array([[0.0, z, 0.0]])).wrenches[0, 2]) + pull

    reach = 1e-3 / 8.0
    for _ in range(6):
        low, high = excess(-reach), excess(0.5 * reach)
        if low * high < 0.0:
            return np.array([0.0, float(brentq(excess, -reach, 0.5 * reach, xtol=1e-12)), 0.0])
        reach *= 2.0
    raise SolverError(f"no pose of the gripper balances a pull of {pull:g} N")


def _value(table: ParameterTable, number: FreeParameter) -> float:
    if number.index is None:
        return table.scalar(number.section, number.entry)
    return table.vector(number.section, number.entry)[number.index]


def _with(table: ParameterTable, number: FreeParameter, value: float) -> ParameterTable:
    old = table.quantity(number.section, number.entry)
    new: float | list[float] = value
    if number.index is not None:
        new = list(table.vector(number.section, number.entry))
        new[number.index] = value
    quantity = Quantity(new, old.unit, "calibrated", "study calibrate")
    return table.replaced(ParameterTable({number.section: {number.entry: quantity}}))
