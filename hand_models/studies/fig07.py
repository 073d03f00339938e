"""Fig. 7: the effect of friction with four tiles on one tendon, for every sequence of springs."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.experiments import PalmExperiment, StudyResult, StudyText, listed, panels, track
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS

__all__ = ["plot", "run"]

ROD_VARIANTS: Final = {"tiles": False, "tiles and palm": True}
"""Which pulleys are fixed rods: True if the palm's are, too."""

ROD_COLOURS: Final = (COLOUR_OF["blue"], COLOUR_OF["green"])

Loaded = list[dict[str, Any]]
"""Configurations of springs, each a dictionary with its loads and gains."""


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the palm's maximum load for every sequence of springs, with and without friction.

    A sequence and its mirror image count once. The gains are also computed for other preload
    stiffnesses k_p.
    """
    experiment = PalmExperiment.from_tables(hand)
    tried = experiment_table().vector("load_sharing", "springs_tried")
    others = [replace(experiment, preload_stiffness=stiffness) for stiffness in tried]
    configurations, *for_others = (_loaded(each) for each in track(progress, [experiment, *others]))
    unlike = _unlike(configurations)
    of_number = {
        count: [c for c in unlike if c["springs"].count(min(c["springs"])) == count]
        for count in range(1, STUDY_SETTINGS.fig07_tiles)
    }
    # of each pair of springs there are eight
    of_pair = {
        pair: [c for c in unlike if set(c["springs"]) == set(pair)]
        for pair in itertools.combinations(range(1, len(experiment.springs) + 1), 2)
    }
    of_stiffness = dict(zip(tried, map(_unlike, for_others), strict=True))
    data: dict[str, Any] = {
        "contact_springs": experiment.springs,
        "preload_stiffness": experiment.preload_stiffness,
        "friction": experiment.friction,
        "configurations": configurations,
        "variants": _gains(unlike),
        "by_number_of_softest_tiles": _gains_by("softest_tiles", of_number),
        "eight_of_two_springs": _gains_by("springs", of_pair),
        "sensitivity": _gains_by("preload_stiffness", of_stiffness),
    }
    text, printed = StudyText("fig07"), STUDY_SETTINGS.fig07_printed_gain
    for rods, gains in data["variants"].items():
        found = {end: 100.0 * gains[end] for end in ("least", "largest")}
        found |= {"rods": rods, "reach": gains["reach_printed"], "of": gains["configurations"]}
        text.check("gain", gains["least"] >= printed, **found)
        hurt = ", ".join("".join(map(str, springs)) for springs in gains["hurts"]) or "none"
        text.check("helpful", gains["least"] >= 0.0, hurt=hurt, **found)
        measures, r, p = _discrepancy_correlations(experiment, unlike, rods)
        # a correlation counts if its probability by chance is below 5 %
        significant = all(r > 0.0) and all(p < 0.05)
        text.check("discrepancies", significant, got=listed(measures, r, "+.2f"), rods=rods)
    return text.result(data)


def _loaded(experiment: PalmExperiment) -> Loaded:
    """Return every sequence of springs, mirror images once."""
    numbers, mu = range(1, len(experiment.springs) + 1), experiment.friction
    found = []
    for sequence in itertools.product(numbers, repeat=STUDY_SETTINGS.fig07_tiles):
        if sequence <= sequence[::-1]:
            without = experiment.load(sequence, 0.0)
            held = {
                rods: experiment.load(sequence, mu, mu * own) for rods, own in ROD_VARIANTS.items()
            }
            gain = {rods: load / without - 1.0 for rods, load in held.items()}
            loads = {"load_without_friction": without, "load_with_friction": held}
            found.append({"springs": sequence, **loads, "gain": gain})
    return found


def _unlike(configurations: Loaded) -> Loaded:
    return [c for c in configurations if len(set(c["springs"])) > 1]


def _gains(configurations: Loaded) -> dict[str, Any]:
    """Return the range of gains, how many reach the printed one, and where friction hurts."""
    summaries = {}
    for rods in ROD_VARIANTS:
        gains = np.array([c["gain"][rods] for c in configurations])
        summaries[rods] = {
            "configurations": len(gains),
            "least": gains.min(),
            "median": np.median(gains),
            "largest": gains.max(),
            "reach_printed": int((gains >= STUDY_SETTINGS.fig07_printed_gain).sum()),
            "hurts": [c["springs"] for c in configurations if c["gain"][rods] < 0.0],
        }
    return summaries


def _gains_by(name: str, groups: Mapping[Any, Loaded]) -> list[dict[str, Any]]:
    return [{name: key, "variants": _gains(group)} for key, group in groups.items()]


def _discrepancy_correlations(
    experiment: PalmExperiment, configurations: Loaded, rods: str
) -> tuple[tuple[str, ...], Array, Array]:
    """Return measures of discrepancy, Spearman's rank correlation of gain with each, and its p.

    Gains that are all alike, as those of pulleys without friction are, correlate with nothing.
    """
    gains = [c["gain"][rods] for c in configurations]
    k = np.array(experiment.springs)[np.array([c["springs"] for c in configurations]) - 1]
    measures = k.mean(axis=1) / k.min(axis=1), k.std(axis=1) / k.mean(axis=1)
    answers = [(0.0, 1.0) for _ in measures]
    if np.ptp(gains) > 1e-9:
        answers = [tuple(scipy.stats.spearmanr(values, gains)) for values in measures]
    return ("mean/softest", "deviation/mean"), *np.transpose(answers)


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
    for shift, rods, colour in zip((0.0, 0.28), ROD_VARIANTS, ROD_COLOURS, strict=True):
        height = [1e-3 * c["load_with_friction"][rods] for c in shown]
        label = f"rods at {rods}, μ = {data['friction']:g}"
        loads.bar(places + shift, height, 0.28, color=colour, label=label)
        gain = [100.0 * c["gain"][rods] for c in shown]
        gains.plot(places, gain, "o", color=colour, label=f"rods at {rods}")
    loads.set_ylim(top=1.35 * loads.get_ylim()[1])
    text.label(loads, "loads", stiffness=1e-3 * data["preload_stiffness"])
    _draw_printed_gain(gains, label="printed, at least")
    gains.set_xticks(places, ["".join(map(str, c["springs"])) for c in shown], rotation=90)
    gains.set_xlim(-0.8, len(shown) - 0.2)
    text.label(gains, "gains", springs=", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"]))
    return figure


def _draw_printed_gain(axes: Any, **style: Any) -> None:
    printed = 100.0 * STUDY_SETTINGS.fig07_printed_gain
    axes.axhline(printed, color=COLOUR_OF["red"], linewidth=1.0, **style)
    axes.axhline(0.0, color="black", linewidth=0.8)


def _draw_dependence(data: dict[str, Any]) -> Figure:
    text = StudyText("fig07")
    figure, (softest, preload) = panels(1, 2, (11.0, 4.4), grid="y", sharey=True)
    for axes, entries, key, scale, apart in (
        (softest, "by_number_of_softest_tiles", "softest_tiles", 1.0, 0.1),
        (preload, "sensitivity", "preload_stiffness", 1e-3, 0.015),
    ):
        for side, rods, colour in zip((-1.0, 1.0), ROD_VARIANTS, ROD_COLOURS, strict=True):
            ranges = [entry["variants"][rods] for entry in data[entries]]
            x = np.array([scale * entry[key] + side * apart for entry in data[entries]])
            low, middle, high = (
                100.0 * np.array([r[end] for r in ranges]) for end in ("least", "median", "largest")
            )
            bar = {"color": colour, "capsize": 4.0, "label": f"rods at {rods}"}
            axes.errorbar(x, middle, (middle - low, high - middle), fmt="o", **bar)
            for place, spot, r in zip(x, middle, ranges, strict=True):
                reached = f"{r['reach_printed']}/{r['configurations']}"
                style = {"textcoords": "offset points", "fontsize": 8}
                axes.annotate(reached, (place, spot), (6, 3), **style)
        _draw_printed_gain(axes)
    softest.set_xticks(range(1, STUDY_SETTINGS.fig07_tiles))
    softest.set_xlim(0.6, STUDY_SETTINGS.fig07_tiles - 0.4)
    preload.margins(x=0.12)
    text.label(softest, "softest")
    text.label(preload, "preload")
    return figure
