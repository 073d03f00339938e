"""Fig. 7: the effect of friction with four tiles on one tendon, for every sequence of springs."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any, Final

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Progress
from hand_models.experiments import PalmExperiment, StudyResult, StudyText, panels, track
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["plot", "run"]

ROD_VARIANTS: Final = {
    "tiles": (False, COLOUR_OF["blue"]),
    "tiles and palm": (True, COLOUR_OF["green"]),
}
"""Which pulleys are fixed rods: True if the palm's pulleys are rods, too, and the colour."""

Loaded = list[dict[str, Any]]
"""Configurations of springs, each a dictionary with its loads and gains."""


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the palm's maximum load for every sequence of springs, with and without friction.

    A sequence and its mirror image count once. The gains are also computed for other preload
    stiffnesses k_p.
    """
    experiment = PalmExperiment.from_tables(hand)
    numbers = range(1, len(experiment.springs) + 1)
    tried = experiment_table().vector("load_sharing", "springs_tried")
    others = [replace(experiment, preload_stiffness=stiffness) for stiffness in tried]
    configurations, *for_others = (_loaded(each) for each in track(progress, [experiment, *others]))
    unlike = _unlike(configurations)
    data: dict[str, Any] = {
        "contact_springs": experiment.springs,
        "preload_stiffness": experiment.preload_stiffness,
        "friction": experiment.friction,
        "configurations": configurations,
        "variants": _gains(unlike),
        "by_number_of_softest_tiles": [
            {
                "softest_tiles": count,
                "variants": _gains(
                    [c for c in unlike if c["springs"].count(min(c["springs"])) == count]
                ),
            }
            for count in range(1, STUDY_SETTINGS.fig07_tiles)
        ],
        # of each pair of springs there are eight
        "eight_of_two_springs": [
            {
                "springs": pair,
                "variants": _gains([c for c in unlike if set(c["springs"]) == set(pair)]),
            }
            for pair in itertools.combinations(numbers, 2)
        ],
        "sensitivity": [
            {"preload_stiffness": stiffness, "variants": _gains(_unlike(found))}
            for stiffness, found in zip(tried, for_others, strict=True)
        ],
    }
    text, printed = StudyText("fig07"), STUDY_SETTINGS.fig07_printed_gain
    for name, summary in data["variants"].items():
        least, largest = (100.0 * summary[end] for end in ("least", "largest"))
        count = f"{summary['reach_printed']} of {summary['configurations']}"
        given = f"{least:+.0f} to {largest:+.0f} %; {count} reach 24 %"
        text.check("gain", given, summary["least"] >= printed, rods=name)
        hurt = ", ".join("".join(map(str, s)) for s in summary["hurts"]) or "none"
        given = f"least {least:+.1f} %; hurt: {hurt}"
        text.check("helpful", given, summary["least"] >= 0.0, rods=name)
        found = _discrepancy_correlations(experiment, unlike, name)
        given = ", ".join(f"{what} {r:+.2f}" for what, (r, _) in found.items())
        # a correlation counts if its probability by chance is below 5 %
        significant = all(r > 0.0 and p < 0.05 for r, p in found.values())
        text.check("discrepancies", given, significant, rods=name)
    return text.result(data)


def _loaded(experiment: PalmExperiment) -> Loaded:
    """Return every sequence of springs, mirror images once."""
    numbers, mu = range(1, len(experiment.springs) + 1), experiment.friction
    found = []
    for sequence in itertools.product(numbers, repeat=STUDY_SETTINGS.fig07_tiles):
        if sequence <= sequence[::-1]:
            without = experiment.load(sequence, 0.0)
            loads = {
                name: experiment.load(sequence, mu, mu * own)
                for name, (own, _) in ROD_VARIANTS.items()
            }
            found.append({
                "springs": sequence,
                "load_without_friction": without,
                "load_with_friction": loads,
                "gain": {name: load / without - 1.0 for name, load in loads.items()},
            })  # fmt: skip
    return found


def _unlike(configurations: Loaded) -> Loaded:
    return [c for c in configurations if len(set(c["springs"])) > 1]


def _gains(configurations: Loaded) -> dict[str, Any]:
    """Return the range of gains, how many reach the printed one, and where friction hurts."""
    summaries = {}
    for name in ROD_VARIANTS:
        gains = np.array([c["gain"][name] for c in configurations])
        summaries[name] = {
            "configurations": len(gains),
            "least": gains.min(),
            "median": np.median(gains),
            "largest": gains.max(),
            "reach_printed": int((gains >= STUDY_SETTINGS.fig07_printed_gain).sum()),
            "hurts": [c["springs"] for c in configurations if c["gain"][name] < 0.0],
        }
    return summaries


def _discrepancy_correlations(
    experiment: PalmExperiment, configurations: Loaded, variant: str
) -> dict[str, tuple[float, float]]:
    """Return Spearman's rank correlation of gain with two measures of discrepancy, and its p.

    Gains that are all alike, as those of pulleys without friction are, correlate with nothing.
    """
    gains = [c["gain"][variant] for c in configurations]
    k = np.array(experiment.springs)[np.array([c["springs"] for c in configurations]) - 1]
    measures = {
        "mean/softest": k.mean(axis=1) / k.min(axis=1),
        "deviation/mean": k.std(axis=1) / k.mean(axis=1),
    }
    if np.ptp(gains) <= 1e-9:
        return dict.fromkeys(measures, (0.0, 1.0))
    answers = {what: scipy.stats.spearmanr(values, gains) for what, values in measures.items()}
    return {what: (answer.statistic, answer.pvalue) for what, answer in answers.items()}


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the maximum loads and gains of all sequences, and the gains over springs and k_p."""
    return {
        "fig07": _draw_sequences(result.data),
        "fig07-dependence": _draw_dependence(result.data),
    }


def _draw_sequences(data: dict[str, Any]) -> Figure:
    shown = sorted(data["configurations"], key=lambda c: float(c["gain"]["tiles"]))
    places, text = np.arange(len(shown)), StudyText("fig07")
    figure, (loads, gains) = panels(2, 1, (14.0, 7.5), grid="y", sharex=True)
    without = [1e-3 * c["load_without_friction"] for c in shown]
    loads.bar(places - 0.28, without, 0.28, color="0.7", label="bearings everywhere, μ = 0")
    for shift, (name, (_, colour)) in zip((0.0, 0.28), ROD_VARIANTS.items(), strict=True):
        height = [1e-3 * c["load_with_friction"][name] for c in shown]
        label = f"rods at {name}, μ = {data['friction']:g}"
        loads.bar(places + shift, height, 0.28, color=colour, label=label)
        gain = [100.0 * c["gain"][name] for c in shown]
        gains.plot(places, gain, "o", color=colour, label=f"rods at {name}")
    text.label(loads, "loads", stiffness=1e-3 * data["preload_stiffness"])
    loads.set_ylim(top=1.35 * loads.get_ylim()[1])
    loads.legend(loc="upper left", ncols=3)
    printed = 100.0 * STUDY_SETTINGS.fig07_printed_gain
    gains.axhline(printed, color=COLOUR_OF["red"], linewidth=1.0, label="printed, at least")
    gains.axhline(0.0, color="black", linewidth=0.8)
    gains.set_xticks(places, ["".join(map(str, c["springs"])) for c in shown], rotation=90)
    gains.set_xlim(-0.8, len(shown) - 0.2)
    text.label(gains, "gains", springs=", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"]))
    gains.legend(loc="upper left")
    return figure


def _draw_dependence(data: dict[str, Any]) -> Figure:
    text = StudyText("fig07")
    figure, both = panels(1, 2, (11.0, 4.4), grid="y", sharey=True)
    of = (
        ("by_number_of_softest_tiles", "softest_tiles", 1.0),
        ("sensitivity", "preload_stiffness", 1e-3),
    )
    for axes, (entries, key, scale), apart in zip(both, of, (0.1, 0.015), strict=True):
        for side, (name, (_, colour)) in zip((-1.0, 1.0), ROD_VARIANTS.items(), strict=True):
            x = np.array([scale * entry[key] + side * apart for entry in data[entries]])
            ranges = [entry["variants"][name] for entry in data[entries]]
            low, middle, high = (
                100.0 * np.array([r[end] for r in ranges]) for end in ("least", "median", "largest")
            )
            bar = {"color": colour, "capsize": 4.0, "label": f"rods at {name}"}
            axes.errorbar(x, middle, (middle - low, high - middle), fmt="o", **bar)
            for place, spot, r in zip(x, middle, ranges, strict=True):
                reached = f"{r['reach_printed']}/{r['configurations']}"
                style = {"xytext": (6, 3), "textcoords": "offset points", "fontsize": 8}
                axes.annotate(reached, (place, spot), **style)
        axes.axhline(
            100.0 * STUDY_SETTINGS.fig07_printed_gain, color=COLOUR_OF["red"], linewidth=1.0
        )
        axes.axhline(0.0, color="black", linewidth=0.8)
    softest, springs = both
    softest.set_xticks(range(1, STUDY_SETTINGS.fig07_tiles))
    softest.set_xlim(0.6, STUDY_SETTINGS.fig07_tiles - 0.4)
    springs.margins(x=0.12)
    text.label(softest, "softest")
    text.label(springs, "preload")
    softest.legend(loc="upper right")
    return figure
