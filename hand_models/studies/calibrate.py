"""Calibration: what Figs. 12 to 14 say of the gripper's parameters, and how sure that is.

Parameters of the gripper that are not published have a posterior (`Posterior`): sets that agree
with the figures as far as these can be read and as far as the model goes. Thirty of its samples, as
likely one as the other, are kept (``draws.toml``): a plan's spread over them shows how sure the
plan is.

How far the model goes is tested by leaving out one figure at a time: what the others foretell of
its data, an interval of 90 %, contains so many of them.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import (
    FITTED_FIGURES,
    POSTERIOR_SETTINGS,
    Claim,
    GripperFit,
    Posterior,
    StudyResult,
    panels,
)
from hand_models.parameters import OF_GRIPPER, ParameterTable
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.tile import Surface

__all__ = ["as_draws", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Find the posterior of the gripper's parameters, with all figures and without each.

    The data of the result are each datum with its interval, the model's discrepancy, the likeliest
    set, and the samples that are kept.
    """
    fit = GripperFit(gripper_table(hand))
    search = Posterior(fit, POSTERIOR_SETTINGS)
    done = 0

    def tick() -> None:
        nonlocal done
        done += 1
        progress(done, search.evaluations)

    found = search.run(tick)
    wide = fit.deviations(search.discrepancy)
    rows = _foretold(fit, {name: each.quantiles(wide) for name, each in found.items()})
    whole, everything = found[""], np.ones(len(fit.data), dtype=bool)
    there = np.isfinite(search.values).all(axis=1)
    best = search.sets[there][search.log_likelihood(search.values[there], everything).argmax()]
    off = (whole.values - fit.wanted) / wide
    kept = [
        {
            "misfit": float(np.sqrt((off[i] ** 2).mean())),
            "at": whole.sets[i],
            "values": fit.values(whole.sets[i]),
        }
        for i in whole.chosen(STUDY_SETTINGS.calibrate_sets)
    ]
    data: dict[str, Any] = {
        "discrepancy": search.discrepancy,
        "effective": {name or "all": each.effective for name, each in found.items()},
        "residuals": rows,
        "coverage": {figure: _coverage(rows, figure) for figure in FITTED_FIGURES},
        "best": {"values": fit.values(best), "model": fit.model(best)},
        "recorded": {"model": fit.model(fit.start())},
        "sets": kept,
        "numbers": _numbers(fit, best, np.array([each["at"] for each in kept])),
    }
    # what is foretold without the figure itself
    foretold = {
        "fig12": "ends of Fig. 12's lines",
        "fig13": "points of Fig. 13's outline",
        "fig14": "best ratios of Fig. 14",
    }
    claims = tuple(
        Claim(
            f"{words} within the 90 % interval of the other figures",
            "at least 80 %",
            "{} of {}".format(*data["coverage"][figure]),
            data["coverage"][figure][0] >= 0.8 * data["coverage"][figure][1],
        )
        for figure, words in foretold.items()
    )
    data["summary"] = [
        f"the model is off by {search.discrepancy:.0%} (rms) where a figure is left out",
        *(
            f"without {figure}: {claim.got} {foretold[figure]}"
            for figure, claim in zip(FITTED_FIGURES, claims, strict=True)
        ),
    ]
    return StudyResult("calibrate", "what Figs. 12 to 14 say of the gripper", data, claims)


def _foretold(fit: GripperFit, intervals: Mapping[str, Array]) -> list[dict[str, Any]]:
    """Return each datum, and the intervals (3, k) that all figures and the others give it."""
    return [
        {
            "datum": datum.label,
            "figure": datum.figure,
            "unit": datum.unit,
            "wanted": datum.wanted,
            "reading": datum.reading,
            "fitted": intervals[""][:, i],
            "foretold": intervals[datum.figure][:, i],
            "inside": bool(
                intervals[datum.figure][0, i] <= datum.wanted <= intervals[datum.figure][2, i]
            ),
        }
        for i, datum in enumerate(fit.data)
    ]


def _coverage(rows: list[dict[str, Any]], figure: str) -> tuple[int, int]:
    """Return how many of a figure's data are within what the others foretell, and of how many."""
    inside = [row["inside"] for row in rows if row["figure"] == figure]
    return sum(inside), len(inside)


def _numbers(fit: GripperFit, best: Array, kept: Array) -> list[dict[str, Any]]:
    """Return each number: the likeliest, recorded, plausible, and what the samples leave of it."""
    recorded, likeliest = fit.values(fit.start()), fit.values(best)
    low, high = fit.values(kept.min(axis=0)), fit.values(kept.max(axis=0))
    return [
        {
            "name": number.name if number.index is None else f"{number.name}[{number.index}]",
            "unit": number.unit,
            "recorded": recorded[i],
            "best": likeliest[i],
            "plausible": number.values,
            "of_sets": [low[i], high[i]],
        }
        for i, number in enumerate(fit.numbers)
    ]


def as_draws(data: Mapping[str, Any]) -> str:
    """Return the kept sets of a study's data as text in the form of ``draws.toml``.

    ``python -m hand_models.studies.calibrate DIR/result.json`` prints the text.

    Parameters
    ----------
    data : mapping
        ``data`` of the study's result, read from ``result.json``.
    """
    numbers, sets = data["numbers"], data["sets"]
    values: list[list[float]] = np.array([each["values"] for each in sets]).T.tolist()
    columns = dict(zip((n["name"] for n in numbers), values, strict=True))
    units = {n["name"]: n["unit"] for n in numbers}
    angle = Surface.named("sandpaper-36").pull_off_angle
    slopes = np.array(columns["pull_off_slope"])
    ratios = 1.0 / (np.cos(angle) + slopes * np.sin(angle))
    lines = ["# How far each set is from the data.", "[fit]"]

    def entry(name: str, values: Iterable[float], unit: str, note: str) -> None:
        listed = ", ".join(f"{value:.4g}" for value in values)
        quoted = f'"{name}"' if "[" in name else name
        lines.append(
            f'{quoted} = {{ value = [{listed}], unit = "{unit}", source = "calibrated", '
            f'note = "{note}" }}'
        )

    misfit = "rms of how far the data are off, over their standard deviations (study calibrate)"
    entry("misfit", [each["misfit"] for each in sets], "1", misfit)
    # the gripper's parameters that its hand has as well
    of_tile = [f"{name}[{i}]" for name in ("engagement", "contact_stiffness") for i in range(3)]
    of_hand = {"finger": ["pulley_radii[1]", "pulley_radii[2]"], "tile": of_tile}
    for section, names in of_hand.items():
        lines += ["", f"[{section}]"]
        for name in names:
            entry(name, columns[name], units[name], "of the gripper's set")
    lines += ["", "# Of the gripper alone.", "[gripper]"]
    for name in OF_GRIPPER:
        entry(name, columns[name], units[name], "of the gripper's set")
    lines += ["", "# The law of a tile, and its strength on sandpaper.", "[defaults]"]
    entry("pull_off_ratio", ratios, "1", "of T + k P = T_max, at pull_off_angle")
    entry("friction", columns["friction"], "1", "of the gripper's set")
    lines += ["", "[sandpaper-36]"]
    entry("shear_limit", columns["shear_limit"], "N", "T_max of the gripper's set")
    return "\n".join(lines) + "\n"


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw what the other figures foretell of each datum, and each parameter's range."""
    figure, (left, right) = panels(1, 2, (14.0, 8.0), grid="x", width_ratios=(1.2, 1.0))
    residuals = result.data["residuals"]
    for place, row in enumerate(residuals[::-1]):
        unit = row["wanted"]
        colour = COLOUR_OF["blue"] if row["inside"] else COLOUR_OF["red"]
        low, middle, high = (value / unit for value in row["foretold"])
        left.plot([low, high], [place, place], color=colour, linewidth=5.0, alpha=0.35)
        left.plot(middle, place, "|", color=colour, markersize=9)
        low, _, high = (value / unit for value in row["fitted"])
        left.plot([low, high], [place, place], color="black", linewidth=1.0)
    left.set_yticks(range(len(residuals)), [row["datum"] for row in residuals[::-1]])
    left.axvline(1.0, color="black", linestyle="--", linewidth=1.0)
    covered = ", ".join("{} of {}".format(*each) for each in result.data["coverage"].values())
    left.set(
        xlabel="interval of 90 %, over the figure's value [1]; black: fitted to it as well",
        title=f"foretold by the other figures: {covered}",
        xlim=(-0.5, 3.0),
    )
    numbers = result.data["numbers"]
    rows = np.arange(len(numbers))[::-1]
    for row, number in zip(rows, numbers, strict=True):
        low, high = number["plausible"]
        least, most = ((end - low) / (high - low) for end in number["of_sets"])
        best, recorded = ((number[k] - low) / (high - low) for k in ("best", "recorded"))
        right.plot([least, most], [row, row], color=COLOUR_OF["blue"], linewidth=5.0, alpha=0.35)
        right.plot(best, row, "o", color=COLOUR_OF["blue"])
        right.plot(recorded, row, "D", markerfacecolor="none", markeredgecolor="black")
    right.set_yticks(rows, [number["name"] for number in numbers])
    right.set(
        xlabel="share of the plausible range [1]; dot: likeliest, diamond: recorded",
        title=f"numbers; bars: {len(result.data['sets'])} samples of the posterior",
        xlim=(-0.05, 1.05),
    )
    return {"calibrate": figure}


if __name__ == "__main__":
    given = argparse.ArgumentParser()
    given.add_argument("calibrated", type=argparse.FileType(), help="the study's result.json")
    sys.stdout.write(as_draws(json.load(given.parse_args().calibrated)["data"]))
