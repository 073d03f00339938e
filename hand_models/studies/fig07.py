"""Fig. 7: four tiles on one tendon, every sequence of springs; where friction helps, where not."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from hand_models.base import Progress
from hand_models.experiments import Claim, PalmExperiment, StudyResult, save_picture
from hand_models.parameters import ParameterTable, experiment_table

__all__ = ["plot", "run"]

TILES: Final = 4
PRINTED_GAIN: Final = 0.24
"""Section 4.2: at least this in all 8 configurations."""

VARIANTS: Final = {"tiles": False, "tiles and palm": True}
"""Where the pulleys are fixed rods, and whether that is the palm's own too."""

SIGNIFICANT: Final = 0.05
"""Probability by chance below which a rank correlation counts."""

ALIKE: Final = 1e-9
"""Gains that differ by less are the same."""

Sequence4 = tuple[int, ...]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Load every sequence (mirror images once) with and without friction, for several k_p."""
    experiment = PalmExperiment.from_tables(hand)
    numbers = range(1, len(experiment.springs) + 1)
    sequences = [s for s in itertools.product(numbers, repeat=TILES) if s <= s[::-1]]
    tried = experiment_table().vector("load_sharing", "springs_tried")
    steps = 1 + len(tried)
    progress(0, steps)
    configurations = [_configuration(experiment, sequence) for sequence in sequences]
    sensitivity = []
    for done, stiffness in enumerate(tried):
        progress(1 + done, steps)
        sensitivity.append(_sensitivity(experiment.with_preload(stiffness), sequences))
    progress(steps, steps)
    unlike = [c for c in configurations if len(set(c["springs"])) > 1]
    data: dict[str, Any] = {
        "contact_springs": list(experiment.springs),
        "preload_stiffness": experiment.preload_stiffness,
        "friction": experiment.friction,
        "configurations": configurations,
        "variants": {name: _summary(unlike, name) for name in VARIANTS},
        "by_number_of_softest_tiles": _by_softest(unlike),
        "eight_of_two_springs": _of_two_springs(unlike, len(experiment.springs)),
        "sensitivity": sensitivity,
        "not_tested": [
            "which eight configurations Fig. 7 has, and their loads: in the picture only",
        ],
    }
    return StudyResult(
        "fig07", "four tiles sharing a load", data, _claims(experiment, data, unlike)
    )


def _configuration(experiment: PalmExperiment, sequence: Sequence4) -> dict[str, Any]:
    mu = experiment.friction
    loads = {name: experiment.load(sequence, mu, mu * own) for name, own in VARIANTS.items()}
    without = experiment.load(sequence, 0.0)
    return {
        "springs": list(sequence),
        "load_without_friction": without,
        "load_with_friction": loads,
        "gain": {name: load / without - 1.0 for name, load in loads.items()},
    }


def _sensitivity(experiment: PalmExperiment, sequences: list[Sequence4]) -> dict[str, Any]:
    unlike = [_configuration(experiment, s) for s in sequences if len(set(s)) > 1]
    return {
        "preload_stiffness": experiment.preload_stiffness,
        "variants": {name: _summary(unlike, name) for name in VARIANTS},
    }


def _summary(configurations: list[dict[str, Any]], variant: str) -> dict[str, Any]:
    """Return the range of gains, how many reach the printed one, and where friction hurts."""
    gains = np.array([c["gain"][variant] for c in configurations])
    return {
        "configurations": len(gains),
        "least": float(gains.min()),
        "median": float(np.median(gains)),
        "largest": float(gains.max()),
        "reach_printed": int((gains >= PRINTED_GAIN).sum()),
        "hurts": [c["springs"] for c in configurations if c["gain"][variant] < 0.0],
    }


def _by_softest(configurations: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the gains by how many of the tiles have the softest contact."""
    groups = []
    for count in range(1, TILES):
        group = [c for c in configurations if c["springs"].count(min(c["springs"])) == count]
        summaries = {name: _summary(group, name) for name in VARIANTS}
        groups.append({"softest_tiles": count, "variants": summaries})
    return groups


def _of_two_springs(configurations: list[dict[str, Any]], springs: int) -> list[dict[str, Any]]:
    """Return the gains of the sequences of just two springs: of each pair there are eight."""
    sets = []
    for pair in itertools.combinations(range(1, springs + 1), 2):
        group = [c for c in configurations if set(c["springs"]) == set(pair)]
        summaries = {name: _summary(group, name) for name in VARIANTS}
        sets.append({"springs": list(pair), "variants": summaries})
    return sets


def _claims(
    experiment: PalmExperiment, data: dict[str, Any], unlike: list[dict[str, Any]]
) -> tuple[Claim, ...]:
    claims = []
    for name in VARIANTS:
        summary = data["variants"][name]
        range_text = f"{100 * summary['least']:+.0f} to {100 * summary['largest']:+.0f} %"
        count = f"{summary['reach_printed']} of {summary['configurations']}"
        claims.append(
            Claim(
                "friction improves the load in all 8 configurations by at least 24 %; here all "
                f"unlike sequences, as the 8 are not known; rods at {name}",
                ">= 24 %",
                f"{range_text}; {count} reach 24 %",
                summary["least"] >= PRINTED_GAIN,
            )
        )
        hurt = ", ".join("".join(map(str, s)) for s in summary["hurts"]) or "none"
        claims.append(
            Claim(
                f"friction is helpful (Section 4.2); rods at {name}",
                "no loss",
                f"least {100 * summary['least']:+.1f} %; hurt: {hurt}",
                summary["least"] >= 0.0,
            )
        )
        correlations = _discrepancy_correlations(experiment, unlike, name)
        text = ", ".join(f"{what} {r:+.2f}" for what, (r, _) in correlations.items())
        claims.append(
            Claim(
                "particularly with substantial discrepancies in contact quality: rank correlation "
                f"of the gain; rods at {name}",
                "positive",
                text,
                all(r > 0.0 and p < SIGNIFICANT for r, p in correlations.values()),
            )
        )
    return tuple(claims)


def _discrepancy_correlations(
    experiment: PalmExperiment, configurations: list[dict[str, Any]], variant: str
) -> dict[str, tuple[float, float]]:
    """Return Spearman's rank correlation of gain with two measures of discrepancy, and its p.

    Gains that are all alike, as those of pulleys without friction are, correlate with nothing.
    """
    gains = [c["gain"][variant] for c in configurations]
    springs = np.array(experiment.springs)
    stiffness = [springs[np.array(c["springs"]) - 1] for c in configurations]
    measures = {
        "mean/softest": [k.mean() / k.min() for k in stiffness],
        "deviation/mean": [k.std() / k.mean() for k in stiffness],
    }
    if np.ptp(gains) <= ALIKE:
        return dict.fromkeys(measures, (0.0, 1.0))
    found = {}
    for what, values in measures.items():
        answer = spearmanr(values, gains)
        found[what] = (float(answer.statistic), float(answer.pvalue))
    return found


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw loads and gains of all sequences, and what the gains depend on."""
    return [_plot_sequences(result, folder), _plot_dependence(result, folder)]


COLOURS: Final = {"tiles": "tab:blue", "tiles and palm": "tab:orange"}


def _plot_sequences(result: StudyResult, folder: Path) -> Path:
    data = result.data
    shown = sorted(data["configurations"], key=lambda c: float(c["gain"]["tiles"]))
    places = np.arange(len(shown))
    figure = Figure(figsize=(14.0, 7.5), layout="constrained")
    loads, gains = figure.subplots(2, 1, sharex=True)
    without = [1e-3 * c["load_without_friction"] for c in shown]
    loads.bar(places - 0.28, without, 0.28, color="0.7", label="bearings everywhere, μ = 0")
    for shift, name in zip((0.0, 0.28), VARIANTS, strict=True):
        height = [1e-3 * c["load_with_friction"][name] for c in shown]
        label = f"rods at {name}, μ = {data['friction']:g}"
        loads.bar(places + shift, height, 0.28, color=COLOURS[name], label=label)
        gain = [100.0 * c["gain"][name] for c in shown]
        gains.plot(places, gain, "o", color=COLOURS[name], label=f"rods at {name}")
    stiffness = ", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"])
    loads.set(
        ylabel="maximum load over the stop's travel [N/mm]",
        title=f"four tiles, k_p = {1e-3 * data['preload_stiffness']:g} N/mm, a hard stop on the "
        "softest contacts; all sequences, mirror images once",
    )
    loads.set_ylim(top=1.35 * loads.get_ylim()[1])
    loads.legend(loc="upper left", ncols=3)
    gains.axhline(100.0 * PRINTED_GAIN, color="tab:red", linewidth=1.0, label="printed, at least")
    gains.axhline(0.0, color="black", linewidth=0.8)
    names = ["".join(map(str, c["springs"])) for c in shown]
    gains.set_xticks(places, names, rotation=90)
    gains.set(
        ylabel="gain by friction [%]",
        xlabel=f"springs of the contacts from the left; 1, 2, 3: {stiffness} N/mm",
        xlim=(-0.8, len(shown) - 0.2),
    )
    gains.legend(loc="upper left")
    for axes in (loads, gains):
        axes.grid(axis="y", alpha=0.3)
    return save_picture(figure, folder / "fig07.png")


def _plot_dependence(result: StudyResult, folder: Path) -> Path:
    data = result.data
    figure = Figure(figsize=(11.0, 4.4), layout="constrained")
    softest, springs = figure.subplots(1, 2, sharey=True)
    for shift, name in zip((-0.1, 0.1), VARIANTS, strict=True):
        for axes, entries, key, scale, offset in (
            (softest, data["by_number_of_softest_tiles"], "softest_tiles", 1.0, shift),
            (springs, data["sensitivity"], "preload_stiffness", 1e-3, 0.15 * shift),
        ):
            x = np.array([scale * entry[key] + offset for entry in entries])
            ranges = [entry["variants"][name] for entry in entries]
            middle = 100.0 * np.array([r["median"] for r in ranges])
            low = middle - 100.0 * np.array([r["least"] for r in ranges])
            high = 100.0 * np.array([r["largest"] for r in ranges]) - middle
            bar = {"color": COLOURS[name], "capsize": 4.0, "label": f"rods at {name}"}
            axes.errorbar(x, middle, (low, high), fmt="o", **bar)
            for place, spot, r in zip(x, middle, ranges, strict=True):
                text = f"{r['reach_printed']}/{r['configurations']}"
                style = {"xytext": (6, 3), "textcoords": "offset points", "fontsize": 8}
                axes.annotate(text, (place, spot), **style)
    softest.set_xticks(range(1, TILES))
    softest.set_xlim(0.6, TILES - 0.4)
    springs.margins(x=0.12)
    softest.set(
        xlabel="tiles with the softest contact [1]",
        ylabel="gain by friction [%]: least, median, largest",
        title="friction helps most where one tile is weak",
    )
    springs.set(
        xlabel="preload springs, k_p [N/mm]",
        title="n/m: how many of the sequences reach the printed 24 %",
    )
    for axes in (softest, springs):
        axes.axhline(100.0 * PRINTED_GAIN, color="tab:red", linewidth=1.0)
        axes.axhline(0.0, color="black", linewidth=0.8)
        axes.grid(axis="y", alpha=0.3)
    softest.legend(loc="upper right")
    return save_picture(figure, folder / "fig07-dependence.png")
