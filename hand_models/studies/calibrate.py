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

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import Claim, StudyResult, save_picture
from hand_models.parameters import ParameterTable, hand_table
from hand_models.studies.gripper_fit import Fit
from hand_models.tile import Surface

__all__ = ["plot", "run"]

FITS: Final = 25
REFITS: Final = 10
"""Evaluations of the Jacobian at most, of the fit and of those with a number held."""

BEFOREHAND: Final = 1.0 / np.sqrt(12.0)
"""Standard deviation of a number that may be anywhere in its plausible range, over that range."""

FIXED: Final = 0.5
"""A number counts as fixed by the data if they leave this share of what was unknown beforehand."""


SANDPAPER: Final = "sandpaper-36"

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


def _own(fit: Fit) -> Array:
    """Return the numbers as plans have them, of the hand and of sandpaper, shape (n,)."""
    hand = hand_table()
    joints = hand.vector("fingers", "inner_joint")
    axis, reach = hand.vector("fingers", "outer_axis"), hand.scalar("fingers", "outer_reach")
    own = {
        "base_half_spacing": 0.5 * (joints[0] - (axis[0] - reach)),
        "added_radius": 0.0,
        "origin_height": -joints[2],
        "tile_height": hand.scalar("finger", "tile_height"),
        "seated_contact": hand.scalar("finger", "seated_contact"),
    }
    own |= {f"contact_stiffness[{i}]": hand.scalar("tile", "contact_stiffness") for i in range(3)}
    for entry, section in (
        ("pulley_radii", "finger"),
        ("engagement", "tile"),
    ):
        own |= {f"{entry}[{i}]": v for i, v in enumerate(hand.vector(section, entry))}
    paper = Surface.named(SANDPAPER)
    own["shear_limit"] = paper.shear_limit
    # T + k P = T_max goes through f_min at its angle
    angle = paper.pull_off_angle
    own["pull_off_slope"] = (paper.shear_limit / paper.pull_off_limit - math.cos(angle)) / math.sin(
        angle
    )
    return np.array([own[number.label] for number in fit.numbers])


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Fit the gripper's numbers again, and see which of them the data fix."""
    fit = Fit(gripper_table(hand))
    n = len(fit.numbers)
    total = FITS * (n + 1) + 2 * n + len(HELD) * REFITS * n
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        progress(min(done, total - 1), total)

    start = fit.start()
    before = fit.residuals(start)
    x = fit.fitted(start, (), FITS, tick)
    after = fit.residuals(x)
    if np.abs(after).max() > np.abs(before).max():
        x, after = start, before
    done = FITS * (n + 1)
    jacobian = fit.jacobian(x)
    spread = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian + np.eye(n) / BEFOREHAND**2)))
    values = np.linalg.svd(jacobian, compute_uv=False)
    own = _own(fit)
    held = []
    for k, labels in enumerate(HELD):
        done = FITS * (n + 1) + 2 * n + k * REFITS * n
        those = tuple(i for i, number in enumerate(fit.numbers) if number.label in labels)
        fixed = x.copy()
        fixed[list(those)] = ((own - fit.low) / fit.width)[list(those)]
        again = fit.fitted(fixed, those, REFITS, tick)
        found = fit.residuals(again)
        held.append(
            {
                "held": list(labels),
                "at": [float(own[i]) for i in those],
                "worst": float(np.abs(found).max()),
                "datum": fit.labels[int(np.abs(found).argmax())],
                "root_mean_square": float(np.sqrt((found**2).mean())),
            }
        )
    progress(total, total)
    at = fit.values(x)
    hand_residuals = fit.residuals((own - fit.low) / fit.width)
    data: dict[str, Any] = {
        "residuals": [
            {"datum": label, "wanted": w, "model": w + r * t, "tolerances_off": r}
            for label, w, t, r in zip(
                fit.labels,
                fit.wanted.tolist(),
                fit.tolerance.tolist(),
                after.tolist(),
                strict=True,
            )
        ],
        "numbers": [
            {
                "name": number.label,
                "unit": number.unit,
                "recorded": float(was),
                "fitted": float(value),
                "hand": float(mine),
                "plausible": [number.low, number.high],
                "standard_error": float(error * width),
                "share_of_range": float(error),
                "left_unknown": float(error / BEFOREHAND),
                "fixed_by_data": bool(error <= FIXED * BEFOREHAND),
            }
            for number, was, value, mine, error, width in zip(
                fit.numbers, fit.values(start), at, own, spread, fit.width, strict=True
            )
        ],
        "singular_values": values.tolist(),
        "held": held,
        "worst_before": float(np.abs(before).max()),
        "worst_after": float(np.abs(after).max()),
        "worst_with_the_hands_numbers": float(np.abs(hand_residuals).max()),
    }
    claims = tuple(
        Claim(
            f"{label} ({'Fig. 13' if label.startswith('extent') else 'Fig. 12'})",
            float(w),
            float(w + r * t),
            bool(abs(r) <= 1.0),
            role="calibration",
        )
        for label, w, t, r in zip(fit.labels, fit.wanted, fit.tolerance, after, strict=True)
    )
    return StudyResult("calibrate", "one set of numbers for Figs. 12 and 13", data, claims)


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw residuals, what the data fix, and what they exclude."""
    figure = Figure(figsize=(16.0, 6.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.2, 1.0))
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
        at = (number["fitted"] - low) / (high - low)
        own = (number["hand"] - low) / (high - low)
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
    for axes in (left, middle, right):
        axes.grid(axis="x", alpha=0.3)
    return [save_picture(figure, folder / "calibrate.png")]
