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
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import POSTERIOR_SETTINGS, Claim, GripperFit, StudyResult, as_draws
from hand_models.parameters import ParameterTable
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["as_draws", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Find the posterior of the gripper's parameters, with all figures and without each.

    The data of the result are each datum with its interval, the model's discrepancy, the likeliest
    set, and the samples that are kept.
    """
    fit = GripperFit(gripper_table(hand))
    search = experiments.Posterior(fit, POSTERIOR_SETTINGS)
    ticks = iter(range(1, search.evaluations + 1))
    found = search.run(lambda: progress(next(ticks), search.evaluations))
    wide = fit.deviations(search.discrepancy)
    rows = _foretold(fit, {name: each.quantiles(wide) for name, each in found.items()})
    whole, best = found[""], search.likeliest()
    off = np.sqrt((((whole.values - fit.wanted) / wide) ** 2).mean(axis=1))
    kept = [
        {"misfit": float(off[i]), "at": whole.sets[i], "values": fit.values(whole.sets[i])}
        for i in whole.chosen(STUDY_SETTINGS.calibrate_sets)
    ]
    off_by = f"the model is off by {search.discrepancy:.0%} (rms) where a figure is left out"
    data: dict[str, Any] = {
        "discrepancy": search.discrepancy,
        "effective": {name or "all": each.effective for name, each in found.items()},
        "residuals": rows,
        "coverage": {},
        "best": {"values": fit.values(best), "model": fit.model(best)},
        "recorded": {"model": fit.model(fit.start())},
        "sets": kept,
        "numbers": _numbers(fit, best, np.array([each["at"] for each in kept])),
        "summary": [off_by],
    }
    claims = []
    # what is foretold without the figure itself
    for figure, words in (
        ("fig12", "ends of Fig. 12's lines"),
        ("fig13", "points of Fig. 13's outline"),
        ("fig14", "best ratios of Fig. 14"),
    ):
        inside = [row["inside"] for row in rows if row["figure"] == figure]
        data["coverage"][figure] = sum(inside), len(inside)
        got, holds = f"{sum(inside)} of {len(inside)}", sum(inside) >= 0.8 * len(inside)
        claim = f"{words} within the 90 % interval of the other figures"
        claims.append(Claim(claim, "at least 80 %", got, holds))
        data["summary"].append(f"without {figure}: {got} {words}")
    title = "what Figs. 12 to 14 say of the gripper"
    return StudyResult("calibrate", title, data, tuple(claims))


def _foretold(fit: GripperFit, intervals: Mapping[str, Array]) -> list[dict[str, Any]]:
    """Return each datum, and the intervals (3, k) that all figures and the others give it."""
    rows = []
    for i, datum in enumerate(fit.data):
        low, _, high = foretold = intervals[datum.figure][:, i]
        row = {
            "datum": datum.label,
            "figure": datum.figure,
            "unit": datum.unit,
            "wanted": datum.wanted,
            "reading": datum.reading,
            "fitted": intervals[""][:, i],
            "foretold": foretold,
            "inside": bool(low <= datum.wanted <= high),
        }
        rows.append(row)
    return rows


def _numbers(fit: GripperFit, best: Array, kept: Array) -> list[dict[str, Any]]:
    """Return each number: the likeliest, recorded, plausible, and what the samples leave of it."""
    recorded, likeliest = fit.values(fit.start()), fit.values(best)
    low, high = fit.values(kept.min(axis=0)), fit.values(kept.max(axis=0))
    return [
        {
            "name": fit.names[i],
            "unit": number.unit,
            "recorded": recorded[i],
            "best": likeliest[i],
            "plausible": number.values,
            "of_sets": [low[i], high[i]],
        }
        for i, number in enumerate(fit.numbers)
    ]


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw what the other figures foretell of each datum, and each parameter's range."""
    figure, (left, right) = experiments.panels(1, 2, (14.0, 8.0), "x", width_ratios=(1.2, 1.0))
    residuals, numbers, blue = result.data["residuals"], result.data["numbers"], COLOUR_OF["blue"]
    for place, row in enumerate(residuals[::-1]):
        colour = blue if row["inside"] else COLOUR_OF["red"]
        low, middle, high = (value / row["wanted"] for value in row["foretold"])
        left.plot([low, high], [place, place], color=colour, linewidth=5.0, alpha=0.35)
        left.plot(middle, place, "|", color=colour, markersize=9)
        low, _, high = (value / row["wanted"] for value in row["fitted"])
        left.plot([low, high], [place, place], color="black", linewidth=1.0)
    left.set_yticks(range(len(residuals)), [row["datum"] for row in residuals[::-1]])
    left.axvline(1.0, color="black", linestyle="--", linewidth=1.0)
    covered = ", ".join("{} of {}".format(*each) for each in result.data["coverage"].values())
    intervals = "interval of 90 %, over the figure's value [1]; black: fitted to it as well"
    title = f"foretold by the other figures: {covered}"
    left.set(title=title, xlabel=intervals, xlim=(-0.5, 3.0))
    for place, number in enumerate(numbers[::-1]):
        low, high = number["plausible"]
        least, most = ((end - low) / (high - low) for end in number["of_sets"])
        best, recorded = ((number[k] - low) / (high - low) for k in ("best", "recorded"))
        right.plot([least, most], [place, place], color=blue, linewidth=5.0, alpha=0.35)
        right.plot(best, place, "o", color=blue)
        right.plot(recorded, place, "D", markerfacecolor="none", markeredgecolor="black")
    right.set_yticks(range(len(numbers)), [number["name"] for number in numbers[::-1]])
    title = f"numbers; bars: {len(result.data['sets'])} samples of the posterior"
    shares = "share of the plausible range [1]; dot: likeliest, diamond: recorded"
    right.set(title=title, xlabel=shares, xlim=(-0.05, 1.05))
    return {"calibrate": figure}


if __name__ == "__main__":
    given = argparse.ArgumentParser()
    given.add_argument("calibrated", type=argparse.FileType(), help="the study's result.json")
    sys.stdout.write(as_draws(json.load(given.parse_args().calibrated)["data"]))
