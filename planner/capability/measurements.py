"""Rank measurements on a real hand by how much they narrow the spread of load factors.

The Monte Carlo samples of uncertain parameters (`hand_models.parameters.draws`) stand for all
possible hands. Each sample in turn is taken as the truth: a measurement with standard deviation σ
that gives m* there and m_i in sample i leaves sample i the weight

    w_i = exp(−Σ (m_i − m*)² / (2 σ²)),

summed over the numbers of that measurement. A measurement is better, the narrower the weighted 5 to
95 % interval of the load factor is, averaged over the truths; its *width* is that average over the
interval's width with equal weights. Weights leave few samples, whose interval is narrower by
chance: so each width is compared with `chance`, the mean width with the measured numbers of other
samples (all cyclic shifts), and measurements are ranked by the difference. (A ratio would say most
where a measurement leaves next to one sample.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import COLOUR_OF, Array, EmptySetError, InvalidInputError, Progress
from hand_models.compliance import Gripper, gripper_table
from hand_models.experiments import StudyResult, panels, pull, pulled_off_poses, track
from hand_models.parameters import (
    ParameterSample,
    ParameterTable,
    bundled_draws,
    experiment_table,
    own_hand,
    own_surfaces,
)
from hand_models.tile import Surface
from planner.question import Question
from planner.result import SPREAD_SETTINGS
from planner.robots import robosimian
from planner.solving import plan

__all__ = ["MeasurementStudy", "measured", "widths"]


def measured(draw: ParameterSample, hand: ParameterTable) -> dict[str, Array]:
    """Return the exact results of all measurements on the hand of one parameter sample.

    Parameters
    ----------
    draw : ParameterSample
        Sampled parameters.
    hand : ParameterTable
        All parameters of the hand, of which the sample replaces some.

    Returns
    -------
    dict of str to ndarray, shape (k,)
        k numbers for each measurement, by its name, in the units of ``[measurements]`` of the
        experiments' parameter file; a pull is zero where the gripper cannot grip.
    """
    numbers, surfaces = own_hand(draw.hand, hand), own_surfaces(draw.surfaces)
    tile, rock = (Surface.named(name, surfaces) for name in ("sandpaper-36", "rock"))
    _, middle, distal = numbers.vector("finger", "pulley_radii")
    closing = numbers.scalar("tendon", "closing_tension")
    single = {
        "tile_on_sandpaper": tile.shear_limit,
        "tile_on_rock": rock.shear_limit,
        "tile_at_45": float(tile.strength(np.pi / 4)),
        "middle_radius": middle,
        "distal_radius": distal,
        "seated_contact": numbers.scalar("finger", "seated_contact"),
    }
    return {
        **_on_gripper(draw, hand, tile),
        **{name: np.array([value]) for name, value in single.items()},
        "contact_stiffness": np.array(numbers.vector("tile", "contact_stiffness")),
        "engagement": closing * np.array(numbers.vector("tile", "engagement")),
    }


def _on_gripper(draw: ParameterSample, hand: ParameterTable, tile: Surface) -> dict[str, Array]:
    """Return what the paper's gripper gives with a draw's fingers: its frame is the rig's own."""
    kept = {
        section: {name: each for name, each in entries.items() if name != "seated_contact"}
        for section, entries in draw.hand.sections.items()
    }
    table, experiment = gripper_table(own_hand(ParameterTable(kept), hand)), experiment_table()
    table = table if draw.gripper is None else table.replaced(draw.gripper)
    # what the model is wrong by in common, and in a grasp of its own, which no limb has
    factor = float(np.prod([*draw.discrepancy[:1], *draw.discrepancy[-1:]]))
    angles = (0, 45, 90)  # of pulls, from shear to pull-off [°]
    found = {f"pull_{angle}": np.zeros(1) for angle in angles}
    normals = np.zeros(3)
    try:
        gripper = Gripper(
            experiment.scalar("fig12", "diameter"),
            experiment.scalar("fig12", "tension"),
            tile,
            table,
        )
        turns = np.radians(angles)
        ways = np.column_stack([np.cos(turns), -np.sin(turns), np.zeros(len(turns))])
        for angle, wrench in zip(angles, pull(gripper, ways).wrenches, strict=True):
            found[f"pull_{angle}"] = np.array([factor * np.hypot(wrench[0], wrench[1])])
        pulls = np.linspace(0.0, experiment.scalar("measured_gripper", "pull"), 11)
        poses = pulled_off_poses(gripper, pulls)
        normals = np.asarray(gripper.finger_loads(poses[-1:])[0].normals[0], dtype=float)
    except (EmptySetError, InvalidInputError):
        pass  # no such grasp, or it lets go before any load
    return {**found, "normal_forces": normals}


def widths(values: Array, factors: Array, accuracy: float) -> tuple[float, float]:
    """Return the relative width of the load factor's interval after a measurement, and by chance.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        Results of the measurement, k numbers in each of n samples.
    factors : ndarray, shape (n,)
        Load factor of a stance in each sample [1].
    accuracy : float
        Standard deviation σ of the measurement, in the unit of the values.

    Returns
    -------
    width : float
        Mean width of the weighted 5 to 95 % interval, over the width without a measurement [1].
    chance : float
        The same with load factors shifted to other samples [1].
    """
    away = ((values[:, None] - values) ** 2).sum(axis=2)
    weights, count = np.exp(-away / (2.0 * accuracy**2)), len(factors)
    whole = _weighted_width(np.ones((1, count)), factors)
    shifted = [_weighted_width(weights, np.roll(factors, shift)) for shift in range(count)]
    return shifted[0] / whole, float(np.mean(shifted[1:])) / whole


def _weighted_width(weights: Array, factors: Array) -> float:
    """Return the mean width from 5 to 95 %, one row of weights (m, n) for each truth.

    A quantile is the least load factor up to which there is that share of the weight.
    """
    order = factors.argsort(kind="stable")
    shares = weights[:, order].cumsum(axis=1)
    shares /= shares[:, -1:]
    low, high = (factors[order][(shares < end - 1e-12).sum(axis=1)] for end in (0.05, 0.95))
    return float(np.mean(high - low))


@dataclass(frozen=True, eq=False)
class MeasurementStudy:
    """Study that ranks measurements by how much they narrow the load factors of some stances.

    Attributes
    ----------
    stances : mapping of str to Question
        Stances by name; all have the same weight.
    """

    stances: Mapping[str, Question]

    def run(self, progress: Progress, hand: ParameterTable) -> StudyResult:
        """Plan all stances and compute all measurements with each parameter sample, and rank them.

        Parameters
        ----------
        progress : callable
            Called as the study proceeds.
        hand : ParameterTable
            Parameters of the hand.

        Returns
        -------
        StudyResult
            ``data["measurements"]`` has a row for each measurement, the best first.
        """
        draws = bundled_draws(hand)
        values: list[dict[str, Array]] = []
        factors: dict[str, Array] = {}
        robot = robosimian(hand)
        jobs: list[str | ParameterSample] = [*self.stances, *draws]
        for job in track(progress, jobs):
            if isinstance(job, str):
                asked = self.stances[job]
                stance = replace(asked.stance, robot=robot)
                wanted = replace(
                    asked,
                    stance=stance,
                    want=frozenset(["spread"]),
                    draws=None,
                    open_loop=None,
                    explain=False,
                )
                spread = plan(wanted).spread
                found = [] if spread is None else spread.load_factors
                factors[job] = np.array([np.nan if f is None else f for f in found])
            else:
                values.append(measured(job, hand))
        rows = [_ranked(quantity, values, factors) for quantity in _accuracies()]
        rows.sort(key=lambda each: each["against_chance"])
        data: dict[str, Any] = {
            "draws": len(draws),
            "stances": list(factors),
            "load_factors": factors,
            "measurements": rows,
            "summary": _summary(rows),
        }
        title = "which measurement would narrow the spread of load factors most"
        return StudyResult("measure", title, data, ())

    def plot(self, result: StudyResult) -> dict[str, Figure]:
        """Draw the relative width of the load factor's interval for each measurement.

        Parameters
        ----------
        result : StudyResult
            Result of `run`.

        Returns
        -------
        dict of str to Figure
            The figure, with the key ``measure``.
        """
        rows = result.data["measurements"][::-1]
        places = np.arange(len(rows))
        figure, (axes,) = panels(1, 1, (8.5, 0.38 * len(rows) + 1.8), grid="x")
        axes.barh(
            places,
            [each["width"] for each in rows],
            color=COLOUR_OF["blue"],
            label="measured",
        )
        chance = [each["chance"] for each in rows]
        axes.plot(chance, places, "k|", markersize=14, label="with unrelated numbers, by chance")
        for name in result.data["stances"]:
            at = [each["widths"].get(name) for each in rows]
            axes.plot(at, places, ".", color="0.6", markersize=5)
        axes.plot([], [], ".", color="0.6", label="each stance")
        axes.set_yticks(places, [each["name"].replace("_", " ") for each in rows])
        axes.set(
            xlabel="5 to 95 % of the load factor, over that without a measurement [1]",
            ylabel="measurement",
            title=f"{result.data['draws']} draws, {len(result.data['stances'])} stances; "
            "the best against chance on top",
        )
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8)
        return {"measure": figure}


def _accuracies() -> list[tuple[str, float, str]]:
    """Return what could be measured: name, accuracy and unit."""
    section = experiment_table().sections["measurements"]
    return [
        (name, experiment_table().positive("measurements", name), quantity.unit)
        for name, quantity in section.items()
    ]


def _ranked(
    quantity: tuple[str, float, str],
    values: list[dict[str, Array]],
    factors: Mapping[str, Array],
) -> dict[str, Any]:
    """Return what a measurement does to each stance's load factor, and to all."""
    name, accuracy, unit = quantity
    given = np.array([each[name] for each in values])
    found: dict[str, tuple[float, float]] = {}
    for stance, each in factors.items():
        there = np.isfinite(each)
        # what all draws agree on no measurement narrows
        varies = there.sum() > 1 and np.ptp(np.percentile(each[there], [5.0, 95.0]))
        if varies > SPREAD_SETTINGS.least_variation * np.abs(each[there]).max():
            found[stance] = widths(given[there], each[there], accuracy)
    width, chance = np.mean(list(found.values()), axis=0).tolist() if found else (1.0, 1.0)
    return {
        "name": name,
        "unit": unit,
        "accuracy": accuracy,
        "drawn": np.percentile(given, [5.0, 95.0], axis=0).T,
        "widths": {stance: each[0] for stance, each in found.items()},
        "width": width,
        "chance": chance,
        "against_chance": width - chance,
    }


def _summary(rows: list[dict[str, Any]]) -> list[str]:
    """Return a line for each measurement, the best first."""
    return [
        "of the load factors' width from 5 to 95 % is left, the best first:",
        *(
            f"{each['width']:4.0%} (by chance {each['chance']:4.0%})  "
            f"{each['name'].replace('_', ' ')} ± {each['accuracy']:g} {each['unit']}"
            for each in rows
        ),
    ]
