"""Calibration: fit the gripper's parameters to Figs. 12 to 14, and find what else the data allow.

Parameters of the gripper that are not published are searched, each within its plausible range, by
CMA-ES (Hansen, *The CMA evolution strategy: a tutorial*, 2016) from several starts: the recorded
set, and sets at random. The objective to minimise is

    (Σ r_i⁸)^(1/8) + 0.2 √(mean r_i²),

with r the residuals of `GripperFit` in tolerances, so that the worst count most. Every set met on
the way whose misfit is at most one meets the data as well as can be known. Of these sets those
farthest apart are kept as samples (``draws.toml``): their range of a parameter is what the data
leave of its plausible range, and a plan's spread over them shows how sure the plan is.

Then the search begins again at the best set, with a parameter held fixed or a datum required more
closely, to find what each of these costs.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import Claim, GripperFit, StudyResult, panels
from hand_models.parameters import ParameterTable
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.tile import Surface

__all__ = ["Met", "as_draws", "global_search", "plot", "run"]

SEARCH_VARIANTS: Final = (
    ("no friction of pressed tiles, T ≥ 0", "friction", 0.0),
    ("side view of Fig. 13 within 2 N", "pull-off at F_x = 40 N", 0.3),
)
"""Text of each variant of the search; the parameter held and its value, or the datum required more
closely and the share of its tolerance.
"""


@dataclass(frozen=True, eq=False)
class Met:
    """Sets of parameters that a search has met, each as shares of plausible ranges.

    Attributes
    ----------
    best : ndarray, shape (n,)
        The set with the least objective.
    sets : ndarray, shape (k, n)
        All sets that meet the data: misfit at most one.
    """

    best: Array
    sets: Array


def global_search(
    fit: GripperFit,
    start: Array,
    spread: float,
    evaluations: int,
    seed: int,
    tick: Callable[[], None],
    closer: Array | None = None,
    held: dict[int, float] | None = None,
) -> Met:
    """Search the parameters of a gripper that fit the data best, by CMA-ES.

    Parameters
    ----------
    fit : GripperFit
    start : ndarray, shape (n,)
        First set, as shares 0 to 1 of plausible ranges.
    spread : float
        First standard deviation, as a share of plausible ranges.
    evaluations : int
        Approximate number of sets to try.
    seed : int
        Seed of the random numbers, above 0.
    tick : callable
        Called without arguments for each set tried.
    closer : ndarray, shape (k,), optional
        Factor on the tolerance of each of the k data, to require some more closely; 1 by default.
    held : dict of int to float, optional
        Parameters that are held fixed: their values as shares, by their indices.
    """
    # a second's work to load, which only this study needs
    import cma

    share = np.ones(len(fit.data)) if closer is None else closer
    held = held or {}
    free = [i for i in range(len(start)) if i not in held]
    best, least = np.clip(start, 0.0, 1.0), np.inf
    for i, value in held.items():
        best[i] = value
    sets: list[Array] = []

    def cost(part: Array) -> float:
        nonlocal best, least
        tick()
        x = best.copy()
        x[free] = np.clip(part, 0.0, 1.0)
        off = fit.residuals(x)
        worst, even = np.linalg.norm(off / share, 8), np.sqrt((off**2).mean())
        # beyond its range, a number costs 100 times the square of the excess in ranges
        found = float(worst + 0.2 * even + 100.0 * ((part - x[free]) ** 2).sum())
        if fit.misfit(off) <= 1.0:
            sets.append(x)
        if found < least:
            best, least = x, found
        return found

    cost(best[free])
    left = evaluations
    # 16 sets a generation
    options = {"popsize": 16, "verbose": -9, "seed": seed}
    while left > 0:
        strategy = cma.CMAEvolutionStrategy(best[free], spread, {**options, "maxfevals": left})
        while not strategy.stop():
            tried = strategy.ask()
            strategy.tell(tried, [cost(part) for part in tried])
        left -= int(strategy.result.evaluations)
        # where it has converged with evaluations left, it begins again there
        spread, options["seed"] = STUDY_SETTINGS.calibrate_spread, options["seed"] + 1
    return Met(best, np.array(sets).reshape(-1, len(start)))


def farthest_apart(sets: Array, count: int) -> list[int]:
    """Return the indices of sets far apart: the first set, then each farthest from those before.

    Parameters
    ----------
    sets : ndarray, shape (k, n)
        Sets as shares of plausible ranges.
    count : int
        Largest number of indices.
    """
    chosen = [0]
    gaps = np.linalg.norm(sets - sets[0], axis=1)
    while len(chosen) < min(count, len(sets)):
        chosen.append(int(gaps.argmax()))
        gaps = np.minimum(gaps, np.linalg.norm(sets - sets[chosen[-1]], axis=1))
    return chosen


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Fit the gripper's parameters to Figs. 12 to 14, and keep sets that meet the data.

    The data of the result are the best set's residuals, the kept sets, and the variants of the
    search with a parameter held or a datum required more closely.
    """
    fit = GripperFit(gripper_table(hand))
    n, effort = len(fit.numbers), STUDY_SETTINGS
    searched = effort.calibrate_starts * effort.calibrate_evaluations
    total = searched + len(SEARCH_VARIANTS) * effort.calibrate_refits + effort.calibrate_looks + 1
    done = 0

    def tick() -> None:
        nonlocal done
        done = min(done + 1, total - 1)
        progress(done, total)

    rng = np.random.default_rng(0)
    starts = [fit.start(), *rng.uniform(0.2, 0.8, (effort.calibrate_starts - 1, n))]
    # the first standard deviation, in plausible ranges: wide from a start at random
    spreads = [effort.calibrate_spread] + [0.25] * (len(starts) - 1)
    met = [
        global_search(fit, start, spread, effort.calibrate_evaluations, k, tick)
        for k, (start, spread) in enumerate(zip(starts, spreads, strict=True), start=1)
    ]
    ends = [fit.residuals(each.best, fine=True) for each in met]
    kept = _kept(fit, met, tick)
    # what was looked at on the fine hull; where the search found nothing better, the recorded set
    looked = [fit.start(), *(each.best for each in met), *(each["at"] for each in kept)]
    misfits = [fit.misfit(fit.residuals(at, fine=True)) for at in looked]
    x = looked[int(np.argmin(misfits))]
    after = fit.residuals(x, fine=True)
    data: dict[str, Any] = {
        "residuals": _table(fit, x, after),
        "starts": [
            {"misfit": fit.misfit(end), "values": fit.values(each.best), "met": len(each.sets)}
            for each, end in zip(met, ends, strict=True)
        ],
        "misfit": fit.misfit(after),
        "misfit_of_recorded": misfits[0],
        "sets": kept,
        "variants": [_variant(fit, x, *each, tick) for each in SEARCH_VARIANTS],
    }
    data["numbers"] = _numbers(fit, x, np.array([each["at"] for each in kept]))
    progress(total, total)
    claims = tuple(
        Claim(
            f"{row['datum']} ({row['figure']})",
            row["wanted"],
            row["model"],
            abs(row["tolerances_off"]) <= 1.0,
            role="calibration",
        )
        for row in data["residuals"]
        if row["first"]
    )
    return StudyResult("calibrate", "one set of numbers for Figs. 12 to 14", data, claims)


def _table(fit: GripperFit, x: Array, off: Array) -> list[dict[str, Any]]:
    """Return each datum, and what a set of numbers has for it."""
    model = fit.wanted + off * fit.tolerance
    return [
        {
            "datum": datum.label,
            "figure": _figure(datum.label),
            "unit": datum.unit,
            "wanted": datum.wanted,
            "model": got,
            "tolerance": datum.tolerance,
            "tolerances_off": tolerances,
            "first": datum.first,
        }
        for datum, got, tolerances in zip(fit.data, model.tolist(), off.tolist(), strict=True)
    ]


def _figure(label: str) -> str:
    if label.startswith("M_y : F_x"):
        return "Fig. 14"
    return "Fig. 13" if label.startswith(("extent", "edge", "pull-off")) else "Fig. 12"


def _kept(fit: GripperFit, met: list[Met], tick: Callable[[], None]) -> list[dict[str, Any]]:
    """Return sets from all valleys that meet the data on the fine hull, and are far apart."""
    found = []
    for valley, each in enumerate(met, start=1):
        if not len(each.sets):
            continue
        for i in farthest_apart(each.sets, STUDY_SETTINGS.calibrate_looks // len(met)):
            tick()
            misfit = fit.misfit(fit.residuals(each.sets[i], fine=True))
            if misfit <= 1.0:
                found.append({"valley": valley, "misfit": misfit, "at": each.sets[i]})
    most = STUDY_SETTINGS.calibrate_sets
    if len(found) > most:
        far = farthest_apart(np.array([each["at"] for each in found]), most)
        found = [found[i] for i in far]
    return [{**each, "values": fit.values(each["at"])} for each in found]


def _variant(
    fit: GripperFit, x: Array, words: str, name: str, value: float, tick: Callable[[], None]
) -> dict[str, Any]:
    """Return what is found where a number is held, or a datum asked for more closely."""
    labels = [datum.label for datum in fit.data]
    closer, held = np.ones(len(labels)), {}
    if name in labels:
        closer[labels.index(name)] = value
    else:
        i = fit.names.index(name)
        held[i] = (value - fit.low[i]) / fit.width[i]
    spread, tried = STUDY_SETTINGS.calibrate_spread, STUDY_SETTINGS.calibrate_refits
    met = global_search(fit, x, spread, tried, 1, tick, closer, held)
    off = fit.residuals(met.best, fine=True)
    worst = int(np.abs(np.where(fit.first, off, 0.0)).argmax())
    return {
        "variant": words,
        "misfit": fit.misfit(off),
        "worst": labels[worst],
        "root_mean_square": float(np.sqrt((off**2).mean())),
        "residuals": off,
        "values": fit.values(met.best),
    }


def _numbers(fit: GripperFit, x: Array, kept: Array) -> list[dict[str, Any]]:
    """Return each number: what was found, recorded, plausible, and what the sets leave of it."""
    recorded = fit.values(fit.start())
    some = kept if len(kept) else x[None]
    low, high = fit.values(some.min(axis=0)), fit.values(some.max(axis=0))
    return [
        {
            "name": number.name if number.index is None else f"{number.name}[{number.index}]",
            "unit": number.unit,
            "recorded": recorded[i],
            "fitted": fit.values(x)[i],
            "plausible": number.values,
            "of_sets": [low[i], high[i]],
            "left_of_range": (high[i] - low[i]) / fit.width[i],
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
    sets = data["sets"]
    columns = dict(zip((n["name"] for n in data["numbers"]), _columns(sets), strict=True))
    angle = Surface.named("sandpaper-36").pull_off_angle
    slopes = np.array(columns["pull_off_slope"])
    ratios = 1.0 / (np.cos(angle) + slopes * np.sin(angle))
    lines = ["# How the sets came about.", "[fit]"]

    def entry(name: str, values: Iterable[float], unit: str, note: str) -> None:
        listed = ", ".join(f"{value:.4g}" for value in values)
        lines.append(
            f'{name} = {{ value = [{listed}], unit = "{unit}", source = "calibrated", '
            f'note = "{note}" }}'
        )

    misfit = "the largest of how far the data are off, over their tolerances (study calibrate)"
    entry("misfit", [each["misfit"] for each in sets], "1", misfit)
    entry("valley", [each["valley"] for each in sets], "1", "which start of the search led there")
    # of the gripper's set, what the hand has as well
    of_hand = {
        "finger": {"pulley_radii[1]": "m", "pulley_radii[2]": "m"},  # middle and distal
        "tile": {
            **{f"engagement[{i}]": "1" for i in range(3)},
            **{f"contact_stiffness[{i}]": "N/m" for i in range(3)},
        },
    }
    for section, names in of_hand.items():
        lines += ["", f"[{section}]"]
        for name, unit in names.items():
            quoted = f'"{name}"' if "[" in name else name
            entry(quoted, columns[name], unit, "of the gripper's set")
    lines += ["", "# The law of a tile, and its strength on sandpaper.", "[defaults]"]
    entry("pull_off_ratio", ratios, "1", "of T + k P = T_max, at pull_off_angle")
    entry("friction", columns["friction"], "1", "of the gripper's set")
    lines += ["", "[sandpaper-36]"]
    entry("shear_limit", columns["shear_limit"], "N", "T_max of the gripper's set")
    return "\n".join(lines) + "\n"


def _columns(sets: Sequence[Mapping[str, Any]]) -> list[list[float]]:
    """Return the sets' values, number by number."""
    columns: list[list[float]] = np.array([each["values"] for each in sets]).T.tolist()
    return columns


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the residuals, each parameter's range over the kept sets, and the variants' misfits."""
    figure, (left, middle, right) = panels(
        1, 3, (17.0, 7.0), grid="x", width_ratios=(1.1, 1.2, 0.8)
    )
    residuals = result.data["residuals"]
    places = np.arange(len(residuals))[::-1]
    colours = ["tab:blue" if row["first"] else "0.6" for row in residuals]
    left.barh(places, [row["tolerances_off"] for row in residuals], color=colours)
    left.set_yticks(places, [row["datum"] for row in residuals])
    for side in (-1.0, 1.0):
        left.axvline(side, color="tab:red", linestyle="--", linewidth=1.0)
    left.set(xlabel="model less figure [tolerances]", title="residuals; grey: where they can")
    numbers = result.data["numbers"]
    rows = np.arange(len(numbers))[::-1]
    for row, number in zip(rows, numbers, strict=True):
        low, high = number["plausible"]
        least, most = ((end - low) / (high - low) for end in number["of_sets"])
        fitted, recorded = ((number[k] - low) / (high - low) for k in ("fitted", "recorded"))
        middle.plot([least, most], [row, row], color="tab:blue", linewidth=5.0, alpha=0.35)
        middle.plot(fitted, row, "o", color="tab:blue")
        middle.plot(recorded, row, "D", markerfacecolor="none", markeredgecolor="black")
    middle.set_yticks(rows, [number["name"] for number in numbers])
    middle.set(
        xlabel="share of the plausible range [1]; diamonds: recorded",
        title=f"numbers; bars: {len(result.data['sets'])} sets that meet the data",
        xlim=(-0.05, 1.05),
    )
    variants = result.data["variants"]
    lines = np.arange(len(variants) + 1)[::-1]
    worst = [result.data["misfit"], *(each["misfit"] for each in variants)]
    right.barh(lines, worst, color=["tab:blue"] + ["0.6"] * len(variants))
    right.set_yticks(lines, ["all free", *(each["variant"] for each in variants)], wrap=True)
    right.axvline(1.0, color="tab:red", linestyle="--", linewidth=1.0)
    right.set(xlabel="largest residual [tolerances]", title="what else was asked for")
    return {"calibrate": figure}


if __name__ == "__main__":
    given = argparse.ArgumentParser()
    given.add_argument("calibrated", type=argparse.FileType(), help="the study's result.json")
    sys.stdout.write(as_draws(json.load(given.parse_args().calibrated)["data"]))
