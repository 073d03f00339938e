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
        "preload_stiffness_at_printed_gain": _of_printed_gain(experiment, pairs, stiffnesses),
    }
    return _checked(experiment, data)


def _curve(experiment: PalmExperiment, pair: Pair, mu: Array, kp: Array) -> dict[str, Any]:
    """Return load over μ and gain over k_p of a pair, and where μ is best by Eq. 2."""
    k2, k1 = sorted(experiment.springs[number - 1] for number in pair)
    others = [replace(experiment, preload_stiffness=stiffness) for stiffness in kp]
    return {
        "springs": pair,
        "best_friction": 2.0 * (k1 - k2) / (k1 + k2),
        "load_over_friction": np.array([experiment.load(pair, friction) for friction in mu]),
        "gain_over_preload_stiffness": np.array([other.gain(pair) for other in others]),
    }


def _of_printed_gain(experiment: PalmExperiment, pairs: list[Pair], kp: Array) -> float | None:
    """Return the k_p at which the least gain of all pairs is the printed one [N/m], if any is."""

    def excess(stiffness: float) -> float:
        softer = replace(experiment, preload_stiffness=stiffness)
        return min(softer.gain(pair) for pair in pairs) - STUDY_SETTINGS.fig06_printed_gain

    if excess(kp[0]) < 0.0 or excess(kp[-1]) > 0.0:
        return None
    return float(scipy.optimize.brentq(excess, kp[0], kp[-1]))


def _checked(experiment: PalmExperiment, data: dict[str, Any]) -> StudyResult:
    text, pairs = StudyText("fig06"), [curve["springs"] for curve in data["curves"]]
    gains = {c["springs"]: c["gain"] for c in data["configurations"]}
    exact = 1e-9  # a relative difference that still counts as the same
    printed = ", ".join(f"{a}-{b} {100 * gains[a, b]:.1f} %" for a, b in pairs)
    least = min(gains[pair] for pair in pairs)
    text.check("gain", least >= STUDY_SETTINGS.fig06_printed_gain - exact, got=printed)
    by_1, by_3, shifted = np.transpose([_against_equations(experiment, pair) for pair in pairs])
    for name, differences in (("equation_1", by_1), ("equation_3", by_3)):
        text.check(name, differences.max() <= exact, off=differences.max())
    # how far the first friction of the largest load is from Eq. 2
    frictions = data["friction_axis"]
    step = frictions[1] - frictions[0]
    loads = np.array([curve["load_over_friction"] for curve in data["curves"]])
    first = (loads >= loads.max(axis=1, keepdims=True) * (1.0 - exact)).argmax(axis=1)
    off = np.abs(frictions[first] - [curve["best_friction"] for curve in data["curves"]]).max()
    text.check("equation_2", off <= step, off=off, step=step)
    softer = experiment.springs[0]
    matched = share_load([2.0 * softer, softer], experiment.preload_stiffness, 2.0 / 3.0)
    shares = float(matched.tile_stiffness[0] / matched.tile_stiffness[1])
    text.check("matched", abs(shares - 2.0) <= exact, got=shares)
    text.check("shift", shifted.min() > 0.0, grown=100 * shifted.min())
    off = max(abs(gains[a, b] - gains[b, a]) for a, b in pairs)
    text.check("order", off <= exact, off=off)
    return text.result(data)


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
    off_1 = float(np.abs(loads / by_1 - 1.0).max())
    off_3 = abs(experiment.load(pair, mu) / by_3 - 1.0)
    return off_1, off_3, float(loads[0] / loads.sum() - without[0] / without.sum())


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the maximum loads as bars, and the gain over friction and preload stiffness."""
    data, text = result.data, StudyText("fig06")
    figure, (bars, friction, preload) = panels(1, 3, (14.0, 4.6), "y", width_ratios=(1.2, 1, 1))
    shown = [c for c in data["configurations"] if c["springs"][0] != c["springs"][1]]
    places, red = np.arange(len(shown)), COLOUR_OF["red"]
    held = [1e-3 * c["load_with_friction"] for c in shown]
    without = [1e-3 * c["load_without_friction"] for c in shown]
    bars.bar(places - 0.2, without, 0.4, color="0.7", label="bearings, μ = 0")
    rods = f"fixed rods, μ = {data['friction']:g}"
    drawn = bars.bar(places + 0.2, held, 0.4, color=COLOUR_OF["blue"], label=rods)
    bars.bar_label(drawn, [f"{100 * c['gain']:+.0f} %" for c in shown], color=red)
    bars.set_xticks(places, ["-".join(map(str, c["springs"])) for c in shown])
    bars.set_ylim(0.0, 1.2 * max(held))
    # springs 1-3 and 2-3 gain alike: by Eq. 3 the gain depends on the stiffer one alone
    for curve, style in zip(data["curves"], itertools.cycle(("-", "-", "--")), strict=False):
        name, loads = "-".join(map(str, curve["springs"])), curve["load_over_friction"]
        (line,) = friction.plot(data["friction_axis"], loads / loads[0], style, label=name)
        colour = line.get_color()
        friction.axvline(curve["best_friction"], color=colour, linestyle=":", linewidth=1.0)
        gains = 100.0 * curve["gain_over_preload_stiffness"]
        preload.plot(1e-3 * data["preload_axis"], gains, style, color=colour, label=name)
    preload.axhline(100.0 * STUDY_SETTINGS.fig06_printed_gain, color=red, linewidth=1.0)
    preload.axvline(1e-3 * data["preload_stiffness"], color="0.4", linestyle="--", linewidth=1.0)
    preload.set_ylim(0.0, None)
    text.label(bars, "bars", springs=", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"]))
    text.label(friction, "friction")
    text.label(preload, "preload", friction=data["friction"])
    return {"fig06": figure}
