"""Fig. 6: the effect of friction on the palm's maximum load, two tiles on one tendon (Eqs. 1–3)."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.experiments import PalmExperiment, StudyResult, StudyText, panels, track
from hand_models.parameters import ParameterTable
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.tendon import share_load

__all__ = ["plot", "run"]

Pair = tuple[int, int]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the palm's maximum load for every pair of springs, with and without friction.

    The gain by friction is also computed over the friction coefficient and over the preload
    stiffness.
    """
    experiment = PalmExperiment.from_tables(hand)
    numbers = range(1, len(experiment.springs) + 1)
    pairs = list(itertools.combinations(numbers, 2))
    loaded = [order for pair in pairs for order in (pair, pair[::-1])]
    loaded += [(number, number) for number in numbers]
    frictions = np.linspace(0.0, 1.5, 151)
    stiffnesses = np.linspace(0.0, 3000.0, 61)  # k_p [N/m]
    data = {
        "contact_springs": experiment.springs,
        "preload_stiffness": experiment.preload_stiffness,
        "friction": experiment.friction,
        "configurations": [
            {
                "springs": pair,
                "load_without_friction": experiment.load(pair, 0.0),
                "load_with_friction": experiment.load(pair, experiment.friction),
                "gain": experiment.gain(pair),
            }
            for pair in track(progress, loaded)
        ],
        "curves": [_curve(experiment, pair, frictions, stiffnesses) for pair in pairs],
        "friction_axis": frictions,
        "preload_axis": stiffnesses,
        "preload_stiffness_at_printed_gain": _least_gain_is_printed(experiment, pairs, stiffnesses),
    }
    text = StudyText("fig06")
    _check(text, experiment, pairs, data)
    return text.result(data)


def _curve(
    experiment: PalmExperiment, pair: Pair, frictions: Array, stiffnesses: Array
) -> dict[str, Any]:
    """Return load over μ and gain over k_p of a pair, and where μ is best by Eq. 2."""
    k2, k1 = sorted(experiment.springs[number - 1] for number in pair)
    others = [replace(experiment, preload_stiffness=kp) for kp in stiffnesses]
    return {
        "springs": pair,
        "best_friction": 2.0 * (k1 - k2) / (k1 + k2),
        "load_over_friction": np.array([experiment.load(pair, mu) for mu in frictions]),
        "gain_over_preload_stiffness": np.array([other.gain(pair) for other in others]),
    }


def _least_gain_is_printed(
    experiment: PalmExperiment, pairs: list[Pair], stiffnesses: Array
) -> float | None:
    """Return the k_p at which the least gain of all pairs is the printed one [N/m], if any is."""

    def excess(stiffness: float) -> float:
        softer = replace(experiment, preload_stiffness=stiffness)
        return min(softer.gain(pair) for pair in pairs) - STUDY_SETTINGS.fig06_printed_gain

    softest, stiffest = stiffnesses[0], stiffnesses[-1]
    if excess(softest) < 0.0 or excess(stiffest) > 0.0:
        return None
    return float(scipy.optimize.brentq(excess, softest, stiffest))


def _check(
    text: StudyText, experiment: PalmExperiment, pairs: list[Pair], data: dict[str, Any]
) -> None:
    gains = {c["springs"]: c["gain"] for c in data["configurations"]}
    printed, frictions = STUDY_SETTINGS.fig06_printed_gain, data["friction_axis"]
    exact = 1e-9  # a relative difference that still counts as the same
    listed = ", ".join(f"{a}-{b} {100 * gains[a, b]:.1f} %" for a, b in pairs)
    text.check("gain", listed, min(gains[pair] for pair in pairs) >= printed - exact)
    differences = np.array([_against_equations(experiment, pair) for pair in pairs])
    for i, name in enumerate(("equation_1", "equation_3")):
        off = differences[:, i].max()
        text.check(name, f"differ by {off:.0e}", off <= exact)
    # how far the first friction of the largest load is from Eq. 2
    step = frictions[1] - frictions[0]
    loads = np.array([curve["load_over_friction"] for curve in data["curves"]])
    first = (loads >= loads.max(axis=1, keepdims=True) * (1.0 - exact)).argmax(axis=1)
    off = np.abs(frictions[first] - [curve["best_friction"] for curve in data["curves"]]).max()
    given = f"first at it within {off:.3f}, curves' step {step:.2f}"
    text.check("equation_2", given, off <= step)
    softer = experiment.springs[0]
    matched = share_load([2.0 * softer, softer], experiment.preload_stiffness, 2.0 / 3.0)
    shares = float(matched.tile_stiffness[0] / matched.tile_stiffness[1])
    text.check("matched", shares, abs(shares - 2.0) <= exact)
    shifted = differences[:, 2].min()
    given = f"its share grows by {100 * shifted:.1f} % of the load or more"
    text.check("shift", given, shifted > 0.0)
    off = max(abs(gains[a, b] - gains[b, a]) for a, b in pairs)
    text.check("order", f"differ by {off:.0e}", off <= exact)


def _against_equations(experiment: PalmExperiment, pair: Pair) -> tuple[float, float, float]:
    """Return how far a pair is off Eqs. 1 and 3, relatively, and what of its load friction shifts.

    The load shifted is that which the stiffer contact carries more.
    """
    k2, k1 = sorted(experiment.springs[number - 1] for number in pair)
    kp, mu = experiment.preload_stiffness, experiment.friction
    loads, without = (share_load([k1, k2], kp, friction).tile_stiffness for friction in (mu, 0.0))
    below = (2.0 - mu) * k1 + (2.0 + mu) * k2 + 4.0 * kp
    signs, own = np.array([1.0, -1.0]), np.array([k1, k2])
    by_1 = (2.0 * (2.0 + signs * mu) * k1 * k2 + 4.0 * kp * own) / below
    by_3 = (4.0 * k1 * k2 + 2.0 * kp * (k1 + k2)) / ((2.0 - mu) * k1 + 2.0 * kp)
    return (
        float(np.abs(loads / by_1 - 1.0).max()),
        abs(experiment.load(pair, mu) / by_3 - 1.0),
        float(loads[0] / loads.sum() - without[0] / without.sum()),
    )


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the maximum loads as bars, and the gain over friction and preload stiffness."""
    data, text = result.data, StudyText("fig06")
    figure, (bars, over_friction, over_springs) = panels(
        1, 3, (14.0, 4.6), grid="y", width_ratios=(1.2, 1.0, 1.0)
    )
    shown = [c for c in data["configurations"] if c["springs"][0] != c["springs"][1]]
    for place, c in enumerate(shown):
        without, held = (1e-3 * c[f"load_{key}_friction"] for key in ("without", "with"))
        bars.bar(place - 0.2, without, 0.4, color="0.7")
        bars.bar(place + 0.2, held, 0.4, color=COLOUR_OF["blue"])
        gain = f"{100 * c['gain']:+.0f} %"
        bars.text(place + 0.2, held, gain, ha="center", va="bottom", color=COLOUR_OF["red"])
    bars.set_xticks(range(len(shown)), ["-".join(map(str, c["springs"])) for c in shown])
    bars.set_ylim(0.0, 1.2e-3 * max(c["load_with_friction"] for c in shown))
    names = ("bearings, μ = 0", f"fixed rods, μ = {data['friction']:g}")
    bars.legend(bars.containers[:2], names, loc="upper left")
    # springs 1-3 and 2-3 gain alike: by Eq. 3 the gain depends on the stiffer one alone
    for curve, style in zip(data["curves"], itertools.cycle(("-", "-", "--")), strict=False):
        name, loads = "-".join(map(str, curve["springs"])), curve["load_over_friction"]
        (line,) = over_friction.plot(data["friction_axis"], loads / loads[0], style, label=name)
        colour = line.get_color()
        over_friction.axvline(curve["best_friction"], color=colour, linestyle=":", linewidth=1.0)
        gains = 100.0 * curve["gain_over_preload_stiffness"]
        over_springs.plot(1e-3 * data["preload_axis"], gains, style, color=colour, label=name)
    over_springs.axhline(
        100.0 * STUDY_SETTINGS.fig06_printed_gain, color=COLOUR_OF["red"], linewidth=1.0
    )
    used = 1e-3 * data["preload_stiffness"]
    over_springs.axvline(used, color="0.4", linestyle="--", linewidth=1.0)
    over_springs.set_ylim(0.0, None)
    text.label(bars, "bars", springs=", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"]))
    text.label(over_friction, "friction")
    text.label(over_springs, "preload", friction=data["friction"])
    for axes in (over_friction, over_springs):
        axes.legend(title="springs")
    return {"fig06": figure}
