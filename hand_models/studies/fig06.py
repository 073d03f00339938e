"""Fig. 6: two tiles on one tendon; what friction does to the palm's maximum load (Eqs. 1–3)."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models.base import Progress
from hand_models.experiments import Claim, PalmExperiment, StudyResult, panels, track
from hand_models.parameters import ParameterTable
from hand_models.tendon import share_load

__all__ = ["plot", "run"]

PRINTED_GAIN: Final = 0.14
"""Section 4.2: friction improves the maximum load by at least this."""

FRICTIONS: Final = np.linspace(0.0, 1.5, 151)
"""For the curves of load over μ."""

SPRING_RANGE: Final = np.linspace(0.0, 3000.0, 61)
"""For the curves of gain over k_p [N/m]."""

EXACT: Final = 1e-9
"""Relative difference that still counts as the same."""

Pair = tuple[int, int]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Load every pair of springs with and without friction."""
    experiment = PalmExperiment.from_tables(hand)
    numbers = range(1, len(experiment.springs) + 1)
    pairs = list(itertools.combinations(numbers, 2))
    ordered = [order for pair in pairs for order in (pair, pair[::-1])]
    loaded = [*ordered, *((number, number) for number in numbers)]
    jobs = [
        *(partial(_configuration, experiment, pair) for pair in loaded),
        *(partial(_curve, experiment, pair) for pair in pairs),
    ]
    found = [job() for job in track(progress, jobs)]
    data = {
        "contact_springs": experiment.springs,
        "preload_stiffness": experiment.preload_stiffness,
        "friction": experiment.friction,
        "configurations": found[: len(loaded)],
        "curves": found[len(loaded) :],
        "friction_axis": FRICTIONS,
        "preload_axis": SPRING_RANGE,
        "preload_stiffness_at_printed_gain": _least_gain_is_printed(experiment, pairs),
        "not_tested": [
            "the measurements match the model within 5 %: they are printed in a picture only",
            "loads in newtons: the travel of the hard stop is not printed",
        ],
    }
    claims = tuple(_claims(experiment, pairs, data))
    return StudyResult("fig06", "two tiles sharing a load", data, claims)


def _configuration(experiment: PalmExperiment, pair: Pair) -> dict[str, Any]:
    return {
        "springs": pair,
        "load_without_friction": experiment.load(pair, 0.0),
        "load_with_friction": experiment.load(pair, experiment.friction),
        "gain": experiment.gain(pair),
    }


def _curve(experiment: PalmExperiment, pair: Pair) -> dict[str, Any]:
    """Return load over μ and gain over k_p of a pair, and where μ is best by Eq. 2."""
    k2, k1 = sorted(experiment.springs[number - 1] for number in pair)
    return {
        "springs": pair,
        "best_friction": 2.0 * (k1 - k2) / (k1 + k2),
        "load_over_friction": np.array([experiment.load(pair, mu) for mu in FRICTIONS]),
        "gain_over_preload_stiffness": np.array(
            [replace(experiment, preload_stiffness=kp).gain(pair) for kp in SPRING_RANGE]
        ),
    }


def _least_gain_is_printed(experiment: PalmExperiment, pairs: list[Pair]) -> float | None:
    """Return the k_p at which the least gain of all pairs is the printed one [N/m], if any is."""

    def excess(stiffness: float) -> float:
        softer = replace(experiment, preload_stiffness=stiffness)
        return min(softer.gain(pair) for pair in pairs) - PRINTED_GAIN

    softest, stiffest = SPRING_RANGE[0], SPRING_RANGE[-1]
    if excess(softest) < 0.0 or excess(stiffest) > 0.0:
        return None
    return float(scipy.optimize.brentq(excess, softest, stiffest))


def _claims(experiment: PalmExperiment, pairs: list[Pair], data: dict[str, Any]) -> Iterator[Claim]:
    gains = {c["springs"]: c["gain"] for c in data["configurations"]}
    listed = ", ".join(f"{a}-{b} {100 * gains[a, b]:.1f} %" for a, b in pairs)
    differences = np.array([_against_equations(experiment, pair) for pair in pairs])
    (off_1, off_3, _), shifted = differences.max(axis=0), differences[:, 2].min()
    order = max(abs(gains[a, b] - gains[b, a]) for a, b in pairs)
    step = FRICTIONS[1] - FRICTIONS[0]
    off_2 = max(_off_equation_2(curve) for curve in data["curves"])
    softer = experiment.springs[0]
    matched = share_load([2.0 * softer, softer], experiment.preload_stiffness, 2.0 / 3.0)
    shares = float(matched.tile_stiffness[0] / matched.tile_stiffness[1])
    yield Claim(
        "friction improves the maximum load by at least 14 % (Section 4.2)",
        ">= 14 %",
        listed,
        min(gains[pair] for pair in pairs) >= PRINTED_GAIN - EXACT,
        role="calibration",
    )
    for words, off in (
        ("tile loads are those of Eq. 1", off_1),
        ("the load at the softer tile's travel is that of Eq. 3", off_3),
    ):
        yield Claim(words, "same", f"differ by {off:.0e}", bool(off <= EXACT))
    yield Claim(
        "mu = 2 (k1 - k2)/(k1 + k2) is best (Eq. 2); here: more adds nothing",
        "largest load there",
        f"first at it within {off_2:.3f}, curves' step {step:.2f}",
        bool(off_2 <= step),
    )
    yield Claim(
        "at force limits of 2:1, mu = 2/3 shares the load 2:1 (Section 4.1)",
        2.0,
        shares,
        abs(shares - 2.0) <= EXACT,
    )
    yield Claim(
        "friction shifts load to the stiffer contact (Section 4.1)",
        "more",
        f"its share grows by {100 * shifted:.1f} % of the load or more",
        bool(shifted > 0.0),
    )
    yield Claim(
        "the order of the springs does not matter (Fig. 6 has each pair once)",
        "same",
        f"differ by {order:.0e}",
        order <= EXACT,
    )


def _against_equations(experiment: PalmExperiment, pair: Pair) -> tuple[float, float, float]:
    """Return how far a pair is off Eqs. 1 and 3, relatively, and what of its load friction shifts.

    The load shifted is that which the stiffer contact carries more.
    """
    k2, k1 = sorted(experiment.springs[number - 1] for number in pair)
    kp, mu = experiment.preload_stiffness, experiment.friction
    loads, without = (share_load([k1, k2], kp, friction).tile_stiffness for friction in (mu, 0.0))
    below = (2.0 - mu) * k1 + (2.0 + mu) * k2 + 4.0 * kp
    by_1 = np.array(
        [
            2.0 * (2.0 + mu) * k1 * k2 + 4.0 * kp * k1,
            2.0 * (2.0 - mu) * k1 * k2 + 4.0 * kp * k2,
        ]
    )
    by_3 = (4.0 * k1 * k2 + 2.0 * kp * (k1 + k2)) / ((2.0 - mu) * k1 + 2.0 * kp)
    return (
        float(np.abs(loads * below / by_1 - 1.0).max()),
        abs(experiment.load(pair, mu) / by_3 - 1.0),
        float(loads[0] / loads.sum() - without[0] / without.sum()),
    )


def _off_equation_2(curve: dict[str, Any]) -> float:
    """Return how far the first μ of the largest load is from Eq. 2."""
    loads = curve["load_over_friction"]
    first = np.argmax(loads >= loads.max() * (1.0 - EXACT))
    return float(abs(FRICTIONS[first] - curve["best_friction"]))


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the paper's bars, and what the gain depends on."""
    data = result.data
    figure, (bars, over_friction, over_springs) = panels(
        1, 3, (14.0, 4.6), grid="y", width_ratios=(1.2, 1.0, 1.0)
    )
    _draw_bars(bars, data)
    # springs 1-3 and 2-3 gain alike: by Eq. 3 the gain depends on the stiffer one alone
    for curve, style in zip(data["curves"], itertools.cycle(("-", "-", "--")), strict=False):
        name = "-".join(map(str, curve["springs"]))
        loads = curve["load_over_friction"]
        (line,) = over_friction.plot(FRICTIONS, loads / loads[0], style, label=name)
        colour = line.get_color()
        over_friction.axvline(curve["best_friction"], color=colour, linestyle=":", linewidth=1.0)
        gains = 100.0 * curve["gain_over_preload_stiffness"]
        over_springs.plot(1e-3 * SPRING_RANGE, gains, style, color=colour, label=name)
    over_friction.set(
        xlabel="friction of a tile's pulley, μ [1]; dotted: Eq. 2",
        ylabel="maximum load over that without friction [1]",
        title="more friction than Eq. 2 adds nothing",
    )
    over_springs.axhline(100.0 * PRINTED_GAIN, color="tab:red", linewidth=1.0)
    used = 1e-3 * data["preload_stiffness"]
    over_springs.axvline(used, color="0.4", linestyle="--", linewidth=1.0)
    over_springs.set(
        xlabel="preload springs, k_p [N/mm]; dashed: the hand's",
        ylabel="gain by friction [%]; red: printed",
        title=f"gain at μ = {data['friction']:g}",
        ylim=(0.0, None),
    )
    for axes in (over_friction, over_springs):
        axes.legend(title="springs")
    return {"fig06": figure}


def _draw_bars(axes: Any, data: dict[str, Any]) -> None:
    shown = [c for c in data["configurations"] if c["springs"][0] != c["springs"][1]]
    places = np.arange(len(shown))
    for shift, key, label, colour in (
        (-0.2, "load_without_friction", "bearings, μ = 0", "0.7"),
        (0.2, "load_with_friction", f"fixed rods, μ = {data['friction']:g}", "tab:blue"),
    ):
        axes.bar(places + shift, [1e-3 * c[key] for c in shown], 0.4, label=label, color=colour)
    for place, c in zip(places, shown, strict=True):
        height = 1e-3 * c["load_with_friction"]
        text = f"{100 * c['gain']:+.0f} %"
        axes.text(place + 0.2, height, text, ha="center", va="bottom", color="tab:red")
    stiffness = ", ".join(f"{1e-3 * k:g}" for k in data["contact_springs"])
    axes.set_xticks(places, ["-".join(map(str, c["springs"])) for c in shown])
    axes.set(
        xlabel=f"springs of the two contacts; 1, 2, 3: {stiffness} N/mm",
        ylabel="maximum load over the stop's travel [N/mm]",
        title="two tiles, a hard stop on the softer contact",
        ylim=(0.0, 1.2e-3 * max(c["load_with_friction"] for c in shown)),
    )
    axes.legend(loc="upper left")
