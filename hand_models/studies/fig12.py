"""Fig. 12: forces on the phalanges while the gripper is pulled straight off, and A of Eq. 7.

Two fingers on a round surface are loaded along −z in small increments until a tile lets go, as in
Section 6.2. The lines of shear and normal force over the pull are held against values read off the
paper's figure, to which the gripper was calibrated; how they run, which tile lets go and how far
the base moves is then a test.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import Array, Progress
from hand_models.compliance import FingerLoads, Gripper, gripper_table
from hand_models.experiments import (
    BALANCED,
    Claim,
    StudyResult,
    pull,
    save_picture,
    unloaded,
    wrist_poses,
)
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.tile import inner_half_planes

__all__ = ["balance_matrix", "plot", "run"]

STRAIGHT_OFF: Final = np.array([[0.0, -1.0, 0.0]])
"""Direction of the pull, (F_x, F_z, M_y)."""

POINTS: Final = 45
"""Of the lines, from no load to the pull of the figure."""

SIDEWAYS: Final = 24
"""Directions of (F_x, F_z) in which the shift of the base is looked at, too."""

NEAR_SHARE: Final = 0.1
NEAR_FORCE: Final = 0.3
"""A force is that of the figure within this share of it, or these newtons."""

NEAR_SHIFT: Final = 0.25
"""The base's shift is the paper's within this share of it."""


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Pull the gripper straight off, and in other directions of (F_x, F_z)."""
    steps = 3
    progress(0, steps)
    table = experiment_table()
    diameter, tension = table.scalar("fig12", "diameter"), table.scalar("fig12", "tension")
    gripper = Gripper(diameter, tension, table=gripper_table(hand))
    rest = unloaded(gripper)
    slip = pull(gripper, STRAIGHT_OFF)
    progress(1, steps)
    pulls = np.linspace(0.0, table.scalar("fig12", "pull"), POINTS)
    poses = _poses(gripper, pulls)
    pulls = pulls[: len(poses)]
    further = np.linspace(0.0, float(-slip.wrenches[0, 1]), POINTS)
    beyond = gripper.finger_loads(_poses(gripper, further))[0]
    loads = gripper.finger_loads(poses)[0]
    conditions = np.linalg.cond(balance_matrix(gripper, poses, loads))
    at_slip = gripper.finger_loads(slip.poses)[0]
    progress(2, steps)
    turns = np.linspace(-np.pi / 2, np.pi / 2, SIDEWAYS + 1)
    around = np.column_stack([np.sin(turns), -np.cos(turns), np.zeros(len(turns))])
    elsewhere = pull(gripper, around)
    shifts = np.linalg.norm((elsewhere.poses - rest)[:, :2], axis=1)
    progress(3, steps)
    used = gripper.evaluate(slip.poses)
    data: dict[str, Any] = {
        "diameter": diameter,
        "tension": tension,
        "phalanges": list(PHALANGES),
        "pull": pulls.tolist(),
        "shear": loads.shears.tolist(),
        "normal": loads.normals.tolist(),
        "base": poses[:, 1].tolist(),
        "condition": conditions.tolist(),
        "pull_of_figure": table.scalar("fig12", "pull"),
        "read_off": _read_off(table),
        "condition_printed": table.scalar("fig12", "condition"),
        "until_slip": {
            "pull": further.tolist(),
            "shear": beyond.shears.tolist(),
            "normal": beyond.normals.tolist(),
        },
        "slip": {
            "pull": float(-slip.wrenches[0, 1]),
            "phalanx": slip.phalanx[0],
            "way": slip.way[0],
            "utilisation": float(used.utilisation[0]),
            "utilisation_by_phalanx": _utilisations(gripper, at_slip),
            "shear": at_slip.shears[0].tolist(),
            "normal": at_slip.normals[0].tolist(),
            "base_shift": float(np.linalg.norm((slip.poses[0] - rest)[:2])),
        },
        "base_shift_elsewhere": {
            "force_x": elsewhere.wrenches[:, 0].tolist(),
            "force_z": elsewhere.wrenches[:, 1].tolist(),
            "shift": shifts.tolist(),
        },
        "not_tested": [
            "the measured lines: they are printed in a picture only, one trial, with oscillations"
        ],
    }
    claims = (*_claims_of_ends(data), *_claims_of_lines(data, table), *_claims_of_slip(data, table))
    return StudyResult("fig12", "forces on the phalanges under a pull straight off", data, claims)


def _poses(gripper: Gripper, pulls: Array) -> Array:
    """Return the wrist's pose at each pull straight off, up to the last that can be balanced."""
    at, poses = unloaded(gripper)[None], []
    for force in pulls:
        at, residual = wrist_poses(gripper, force * STRAIGHT_OFF, at)
        if not residual[0] <= BALANCED:
            break
        poses.append(at[0])
    return np.array(poses)


def _read_off(table: ParameterTable) -> dict[str, list[float]]:
    names = ("shear_unloaded", "shear_pulled", "normal_unloaded", "normal_pulled")
    return {name: list(table.vector("fig12", name)) for name in names}


def _utilisations(gripper: Gripper, loads: FingerLoads) -> list[float]:
    """Return the largest utilisation of each phalanx's limits, at one pose."""
    pieces = inner_half_planes(gripper.surface)
    shears, normals = loads.shears[0], loads.normals[0]
    return [
        float(max((p.a_shear * t + p.a_normal * n) / p.capacity for p in pieces))
        for t, n in zip(shears, normals, strict=True)
    ]


def balance_matrix(gripper: Gripper, poses: Array, loads: FingerLoads) -> Array:
    """Return A of Eq. 7 for one finger, A f_c = b, in SI units, shape (m, 6, 6).

    f_c is the force of each of three contacts on the rock, (x, z) in F, proximal first. A takes it
    to the torques of three joints (Jᵀ; from x toward z) [m], and to the three components along the
    phalanges (P_x) [1]. Rows of two units: its condition depends on them.

    Parameters
    ----------
    gripper : Gripper
    poses : ndarray, shape (m, 3)
        Without turn or shift along x.
    loads : FingerLoads
        There.
    """
    count = len(PHALANGES)
    spacing = gripper.finger.model.joint_spacing
    u = np.asarray(loads.directions, dtype=float)
    base = np.column_stack([np.zeros(len(poses)), poses[:, 1]])[:, None]
    joints = base + np.concatenate([0.0 * base, spacing * np.cumsum(u[:, :-1], axis=1)], axis=1)
    A = np.zeros((len(poses), 2 * count, 2 * count))
    for j in range(count):
        A[:, count + j, 2 * j : 2 * j + 2] = u[:, j]
        for i in range(j + 1):
            d = loads.points[:, j] - joints[:, i]
            A[:, i, 2 * j : 2 * j + 2] = np.column_stack([-d[:, 1], d[:, 0]])
    return A


def _claims_of_ends(data: dict[str, Any]) -> list[Claim]:
    """Return a claim for shears and normals at both ends of the lines."""
    claims = []
    for kind in ("shear", "normal"):
        for end, words, at in (("unloaded", "without load", 0), ("pulled", "at the end", -1)):
            read, got = np.array(data["read_off"][f"{kind}_{end}"]), np.array(data[kind][at])
            near = np.maximum(NEAR_SHARE * read, NEAR_FORCE)
            there = data["pull"][at]
            claims.append(
                Claim(
                    f"{kind} of proximal, middle, distal {words}, within 10 % or 0.3 N (Fig. 12)",
                    f"{_listed(read)} N",
                    f"{_listed(got)} N; pulled by {there:g} N",
                    (at == 0 or there == data["pull_of_figure"])
                    and bool((np.abs(got - read) <= near).all()),
                    role="calibration",
                )
            )
    return claims


def _claims_of_lines(data: dict[str, Any], table: ParameterTable) -> list[Claim]:
    pulls = np.array(data["pull"])
    claims = []
    for kind, signs, words in (
        ("shear", (1, 1, 1), "shear forces increase gradually on every phalanx"),
        ("normal", (-1, 0, -1), "the normal forces of proximal and distal phalanx decrease"),
        ("normal", (0, 1, 0), "the normal force of the middle phalanx rises"),
    ):
        lines = np.array(data[kind])
        told = [i for i, sign in enumerate(signs) if sign]
        total = lines[-1] - lines[0]
        back = np.array([_way_back(signs[i] * lines[:, i]) for i in told])
        listed = ", ".join(f"{PHALANGES[i]} {total[i]:+.2f}" for i in told)
        reverse = f"; {back.max():.1g} N back on the way" if back.max() > 0.0 else ""
        claims.append(
            Claim(
                f"under the pull {words} (Section 6.2 and Fig. 12)",
                "from one end to the other",
                f"{listed} N{reverse}",
                all(signs[i] * total[i] > 0.0 for i in told),
            )
        )
    ranges = table.vector("fig12", "sensor_range")
    accuracy = table.scalar("fig12", "sensor_accuracy")
    for kind, span in zip(("shear", "normal"), ranges, strict=True):
        lines = np.array(data[kind])
        within = accuracy * span
        off = _off_straight(pulls, lines)
        claims.append(
            Claim(
                f"the grasp model is linear (Section 6.2): {kind} is straight over the pull",
                f"off by less than the sensors' accuracy, {within:.2g} N",
                f"off by up to {off:.2g} N",
                off <= within,
            )
        )
    condition = np.array(data["condition"])
    least = data["condition_printed"]
    claims.append(
        Claim(
            "cond(A) > 270 in all trials (Section 5.4.2); here in SI units",
            f"> {least:g}",
            f"{condition.min():.0f} to {condition.max():.0f}",
            bool(condition.min() > least),
        )
    )
    return claims


def _way_back(line: Array) -> float:
    """Return how far a line that rises falls on its way, at most."""
    return float((np.maximum.accumulate(line) - line).max())


def _off_straight(pulls: Array, lines: Array) -> float:
    """Return how far lines (n, 3) over the pull are off their best straight lines, at most."""
    fitted = np.polynomial.polynomial.polyfit(pulls, lines, 1)
    straight = np.polynomial.polynomial.polyval(pulls, fitted).T
    return float(np.abs(lines - straight).max())


def _claims_of_slip(data: dict[str, Any], table: ParameterTable) -> list[Claim]:
    slip = data["slip"]
    used = slip["utilisation_by_phalanx"]
    shift = table.scalar("fig12", "base_shift")
    furthest = max(data["base_shift_elsewhere"]["shift"])
    listed = ", ".join(f"{name} {u:.2f}" for name, u in zip(PHALANGES, used, strict=True))
    return [
        Claim(
            "proximal or distal contacts are likely to exceed their limits first (Section 6.2)",
            "proximal or distal",
            f"{slip['phalanx']}, at {slip['pull']:.1f} N ({slip['way'].replace('_', ' ')})",
            slip["phalanx"] in ("proximal", "distal"),
        ),
        Claim(
            "the middle phalanx stays within safe loading: utilisation when a tile lets go",
            "middle < 1",
            listed,
            used[1] < 1.0,
        ),
        Claim(
            "the base shifts by up to 5 mm, as the model predicts (Section 6.2): until it lets go",
            f"{1e3 * shift:g} mm within {100 * NEAR_SHIFT:g} %",
            f"{1e3 * slip['base_shift']:.2f} mm; pulled aside, up to {1e3 * furthest:.2f} mm",
            abs(max(slip["base_shift"], furthest) - shift) <= NEAR_SHIFT * shift,
        ),
    ]


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


COLOURS: Final = ("tab:red", "tab:green", "tab:blue")
"""Of proximal, middle and distal phalanx, in every picture."""


def plot(result: StudyResult, folder: Path) -> list[Path]:
    """Draw shear and normal forces over the pull, and the condition of A."""
    data = result.data
    figure = Figure(figsize=(14.0, 4.4), layout="constrained")
    shear, normal, condition = figure.subplots(1, 3)
    pulls = np.array(data["pull"])
    for axes, kind in ((shear, "shear"), (normal, "normal")):
        lines = np.array(data[kind])
        for i, (name, colour) in enumerate(zip(PHALANGES, COLOURS, strict=True)):
            axes.plot(pulls, lines[:, i], color=colour, label=name)
            further = [row[i] for row in data["until_slip"][kind]]
            axes.plot(data["until_slip"]["pull"], further, ":", color=colour)
            read = [data["read_off"][f"{kind}_{end}"][i] for end in ("unloaded", "pulled")]
            axes.plot(
                [0.0, data["pull_of_figure"]], read, "o", color=colour, markerfacecolor="white"
            )
            axes.plot(data["slip"]["pull"], data["slip"][kind][i], "x", color=colour)
        axes.set(
            xlabel="pull straight off, −F_z [N]",
            ylabel=f"{kind} force on the rock [N]",
            title=f"{kind}: lines; read off Fig. 12: circles",
            ylim=(min(0.0, 1.2 * min(data["slip"][kind])), None),
        )
        axes.grid(alpha=0.3)
        axes.legend(title=f"×: a tile lets go, {data['slip']['pull']:.1f} N")
    condition.plot(pulls, data["condition"], color="k")
    condition.axhline(data["condition_printed"], color="tab:red", linewidth=1.0)
    condition.set(
        xlabel="pull straight off, −F_z [N]",
        ylabel="cond(A) of Eq. 7, SI units [1]",
        title="condition of the balance; red: printed, above",
        ylim=(0.0, 1.2 * max(*data["condition"], data["condition_printed"])),
    )
    condition.grid(alpha=0.3)
    return [save_picture(figure, folder / "fig12.png")]
