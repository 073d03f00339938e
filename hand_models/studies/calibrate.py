"""The open question: one set of numbers for Fig. 12 and for the extents of Fig. 13 at once.

Least squares from the recorded set, over what of the gripper is not published, each number within
what is plausible. Residuals are in tolerances: a tenth of a value, or 0.3 N, for the ends of
Fig. 12's lines, a tenth for the extents in force, a quarter for that in moment. Their third powers
are fitted, so that the worst count most.

Which numbers the data fix is read off the Jacobian J at the end: with errors of a tolerance each
and with the plausible ranges as what is known beforehand, the variance of a number is the diagonal
of (JᵀJ + R)⁻¹. Then some numbers are held at the hand's own values and the rest fitted again: what
the data exclude.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hand_models.base import Array, CruxError, Progress, SolverError
from hand_models.compliance import Gripper, boundary, gripper_table, linear_box
from hand_models.experiments import (
    SANDPAPER,
    Axis,
    Claim,
    StudyResult,
    clipped_vertices,
    extents,
    in_paper_signs,
    panels,
    pulled_off_poses,
)
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table, hand_table
from hand_models.studies.fig12 import NEAR_FORCE, NEAR_SHARE
from hand_models.studies.fig13 import NEAR
from hand_models.tile import Surface

__all__ = ["Fit", "plot", "run"]

FITS: Final = 25
REFITS: Final = 10
"""Evaluations of the Jacobian at most, of the fit and of those with a number held."""

BEFOREHAND: Final = 1.0 / np.sqrt(12.0)
"""Standard deviation of a number that may be anywhere in its plausible range, over that range."""

FIXED: Final = 0.5
"""A number counts as fixed by the data if they leave this share of what was unknown beforehand."""

RAYS: Final = 3000
"""Of the wrench space's boundary."""

POWER: Final = 3
"""To which residuals are raised, sign kept."""

STEP: Final = 2e-3
"""Of finite differences, in plausible ranges."""

HOPELESS: Final = 30.0
"""Residual where a set of numbers gives no gripper that holds."""

HELD: Final = (
    ("tile_height",),
    ("added_radius",),
    ("origin_height",),
    ("base_half_spacing",),
    ("engagement[0]", "engagement[1]", "engagement[2]"),
    ("contact_stiffness[0]", "contact_stiffness[1]", "contact_stiffness[2]"),
    ("pulley_radii[1]", "pulley_radii[2]"),
    ("shear_limit", "pull_off_slope"),
)
"""Numbers that are held in turn at what plans have for the hand and for sandpaper."""


def _numbers() -> tuple[Axis, ...]:
    """Return the gripper's numbers to be found, each from the least to the most plausible."""
    one, each = (None,), range(len(PHALANGES))
    places: dict[str, tuple[str, str, Iterable[int | None]]] = {
        "tile_height": ("finger", "tile_height", one),
        "seated_contact": ("finger", "seated_contact", one),
        "middle_radius": ("finger", "pulley_radii", (1,)),
        "distal_radius": ("finger", "pulley_radii", (2,)),
        "engagement": ("tile", "engagement", each),
        "contact_stiffness": ("gripper", "contact_stiffness", each),
    }
    table, found = experiment_table(), []
    for plausible, quantity in table.sections["calibration"].items():
        section, name, indices = places.get(plausible, ("gripper", plausible, one))
        ends = table.vector("calibration", plausible)
        found += [Axis(section, name, index, ends, quantity.unit) for index in indices]
    return tuple(found)


class Fit:
    """Residuals of the fifteen data over the numbers, each in plausible ranges from 0 to 1."""

    def __init__(self, table: ParameterTable) -> None:
        self.table = table
        self.numbers = _numbers()
        self.names = [number.entry.partition(".")[2] for number in self.numbers]
        self.low, high = np.array([number.values for number in self.numbers]).T
        self.width = high - self.low
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
        self.labels += ["extent of F_x", "extent of F_z", "extent of M_y"]
        far = [data.scalar("fig13", name) for name in ("force_x", "force_z", "moment")]
        self.wanted = np.array([*values, *far])
        share = [*[NEAR_SHARE] * len(values), *NEAR]
        least = [*[NEAR_FORCE] * len(values), *[0.0] * len(far)]
        self.tolerance = np.maximum(share * np.abs(self.wanted), least)

    def start(self) -> Array:
        """Return where the table is."""
        now = [number.current(self.table) for number in self.numbers]
        return np.asarray(np.clip((np.array(now) - self.low) / self.width, 0.0, 1.0))

    def values(self, x: Array) -> Array:
        """Return the numbers in SI units."""
        return np.asarray(self.low + self.width * x)

    def gripper(self, x: Array) -> Gripper:
        """Return the gripper of some numbers."""
        table = self.table
        for number, value in zip(self.numbers, self.values(x).tolist(), strict=True):
            table = number.set(table, value)
        return Gripper(self.diameter, self.tension, table=table)

    def model(self, x: Array) -> Array:
        """Return what the model has for the fifteen data, shape (15,) [N, N·m].

        Raises
        ------
        CruxError
            If the fingers do not lie on the surface, or nothing holds.
        """
        gripper = self.gripper(x)
        poses = pulled_off_poses(gripper, np.array([0.0, self.pull]))
        if len(poses) < 2:
            raise SolverError(f"no pose of the gripper balances a pull of {self.pull:g} N")
        loads, _ = gripper.finger_loads(poses)
        space = boundary(gripper, linear_box(gripper), RAYS)
        far = extents(clipped_vertices(in_paper_signs(space.wrenches)))
        return np.array([*np.hstack([loads.shears, loads.normals]).flat, *far])

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

    def fitted(
        self, x: Array, held: NDArray[np.bool_], rounds: int, tick: Callable[[], None]
    ) -> Array:
        """Return the numbers that fit best, some of them held."""
        free = np.flatnonzero(~held)

        def whole(part: Array) -> Array:
            found = x.copy()
            found[free] = part
            return found

        def cubes(part: Array) -> Array:
            tick()
            found = self.residuals(whole(part))
            return np.asarray(np.sign(found) * np.abs(found) ** POWER)

        best = least_squares(
            cubes,
            np.clip(x[free], STEP, 1.0 - STEP),
            bounds=(0.0, 1.0),
            diff_step=np.full(len(free), STEP),
            max_nfev=rounds,
        )
        return whole(best.x)


def _own(fit: Fit) -> Array:
    """Return the numbers as plans have them, of the hand and of sandpaper, shape (n,)."""
    hand = hand_table()
    joints = hand.vector("fingers", "inner_joint")
    axis, reach = hand.vector("fingers", "outer_axis"), hand.scalar("fingers", "outer_reach")
    paper = Surface.named(SANDPAPER)
    angle = paper.pull_off_angle
    of_gripper = {
        "base_half_spacing": 0.5 * (joints[0] - (axis[0] - reach)),
        "added_radius": 0.0,
        "origin_height": -joints[2],
        "contact_stiffness": hand.scalar("tile", "contact_stiffness"),
        "shear_limit": paper.shear_limit,
        # T + k P = T_max goes through f_min at its angle
        "pull_off_slope": (paper.shear_limit / paper.pull_off_limit - math.cos(angle))
        / math.sin(angle),
    }
    return np.array(
        [
            of_gripper[number.name] if number.section == "gripper" else number.current(hand)
            for number in fit.numbers
        ]
    )


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Fit the gripper's numbers again, and see which of them the data fix."""
    fit = Fit(gripper_table(hand))
    n = len(fit.numbers)
    total = FITS * (n + 1) + 2 * n + len(HELD) * REFITS * n

    def ticking(before: int) -> Callable[[], None]:
        counts = itertools.count(before + 1)
        return lambda: progress(min(next(counts), total - 1), total)

    start = fit.start()
    before = fit.residuals(start)
    x = fit.fitted(start, np.zeros(n, dtype=bool), FITS, ticking(0))
    after = fit.residuals(x)
    if np.abs(after).max() > np.abs(before).max():
        x, after = start, before
    jacobian = fit.jacobian(x)
    spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + np.eye(n) / BEFOREHAND**2)))
    own = _own(fit)
    at_own = (own - fit.low) / fit.width
    held = []
    for k, labels in enumerate(HELD):
        those = np.isin(fit.names, labels)
        fixed = np.where(those, at_own, x)
        tick = ticking(FITS * (n + 1) + 2 * n + k * REFITS * n)
        found = fit.residuals(fit.fitted(fixed, those, REFITS, tick))
        held.append(
            {
                "held": labels,
                "at": own[those],
                "worst": np.abs(found).max(),
                "datum": fit.labels[int(np.abs(found).argmax())],
                "root_mean_square": np.sqrt((found**2).mean()),
            }
        )
    progress(total, total)
    hand_residuals = fit.residuals(at_own)
    model = fit.wanted + after * fit.tolerance
    numbers = {
        "name": fit.names,
        "unit": [number.unit for number in fit.numbers],
        "recorded": fit.values(start),
        "fitted": fit.values(x),
        "hand": own,
        "plausible": [number.values for number in fit.numbers],
        "standard_error": spread * fit.width,
        "share_of_range": spread,
        "left_unknown": spread / BEFOREHAND,
        "fixed_by_data": spread <= FIXED * BEFOREHAND,
    }
    data: dict[str, Any] = {
        "residuals": [
            {"datum": label, "wanted": wanted, "model": found, "tolerances_off": off}
            for label, wanted, found, off in zip(
                fit.labels, fit.wanted.tolist(), model.tolist(), after.tolist(), strict=True
            )
        ],
        "numbers": [{key: values[i] for key, values in numbers.items()} for i in range(n)],
        "singular_values": np.linalg.svd(jacobian, compute_uv=False),
        "held": held,
        "worst_before": np.abs(before).max(),
        "worst_after": np.abs(after).max(),
        "worst_with_the_hands_numbers": np.abs(hand_residuals).max(),
    }
    claims = tuple(
        Claim(
            f"{r['datum']} ({'Fig. 13' if r['datum'].startswith('extent') else 'Fig. 12'})",
            r["wanted"],
            r["model"],
            abs(r["tolerances_off"]) <= 1.0,
            role="calibration",
        )
        for r in data["residuals"]
    )
    return StudyResult("calibrate", "one set of numbers for Figs. 12 and 13", data, claims)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw residuals, what the data fix, and what they exclude."""
    figure, (left, middle, right) = panels(
        1, 3, (16.0, 6.0), grid="x", width_ratios=(1.0, 1.2, 1.0)
    )
    residuals = result.data["residuals"]
    places = np.arange(len(residuals))[::-1]
    left.barh(places, [r["tolerances_off"] for r in residuals], color="tab:blue")
    left.set_yticks(places, [r["datum"] for r in residuals])
    for side in (-1.0, 1.0):
        left.axvline(side, color="tab:red", linestyle="--", linewidth=1.0)
    left.set(xlabel="model less figure [tolerances]", title="residuals")
    numbers_found = result.data["numbers"]
    rows = np.arange(len(numbers_found))[::-1]
    for row, number in zip(rows, numbers_found, strict=True):
        low, high = number["plausible"]
        at, own = ((number[which] - low) / (high - low) for which in ("fitted", "hand"))
        share = number["share_of_range"]
        colour = "tab:blue" if number["fixed_by_data"] else "0.6"
        middle.errorbar(at, row, xerr=share, fmt="o", color=colour, capsize=3)
        middle.plot(own, row, "D", markerfacecolor="white", markeredgecolor="black")
    middle.set_yticks(rows, [number["name"] for number in numbers_found])
    middle.set(
        xlabel="share of the plausible range [1]; diamonds: in plans",
        title="numbers; blue: narrowed to half or less by the data",
        xlim=(-0.15, 1.15),
    )
    held = result.data["held"]
    lines = np.arange(len(held) + 1)[::-1]
    worst = [result.data["worst_after"], *(h["worst"] for h in held)]
    right.barh(lines, worst, color=["tab:blue"] + ["0.6"] * len(held))
    names = ["all free", *(h["held"][0].split("[")[0] for h in held)]
    right.set_yticks(lines, names)
    right.axvline(1.0, color="tab:red", linestyle="--", linewidth=1.0)
    right.set(
        xlabel="largest residual [tolerances]",
        title="numbers held as in plans, the rest fitted again",
    )
    return {"calibrate": figure}
