"""Fig. 12: forces on the phalanges while the gripper is pulled straight off, and A of Eq. 7.

Two fingers on a round surface are loaded along −z in small increments until a tile exceeds a limit,
as in Section 6.2. The lines of shear and normal force over the pull are compared with values read
off the paper's figure, to which the gripper was calibrated; the shape of the lines, the tile that
fails and the shift of the base are then a test.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import COLOUR_OF, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import Conditions, StudyResult, StudyText, balance_matrix
from hand_models.finger import PHALANGES
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.tile import inner_half_planes

__all__ = ["balance_matrix", "plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Pull the gripper straight off until a tile slips, and record the forces on the phalanges.

    The gripper is also pulled along other directions of (F_x, F_z), for the shift of its base.
    """
    progress(0, 1)
    table, conditions = experiment_table(), Conditions.of_figure("fig12")
    gripper = conditions.gripper(gripper_table(hand))
    rest = experiments.unloaded(gripper)
    slip = experiments.pull(gripper, np.array([[0.0, -1.0, 0.0]]))
    pulled, most = table.scalar("fig12", "pull"), -slip.wrenches[0, 1]
    pulls, further = (np.linspace(0.0, to, STUDY_SETTINGS.fig12_points) for to in (pulled, most))
    poses = experiments.pulled_off_poses(gripper, pulls)
    beyond, at_slip, loads = (
        gripper.finger_loads(at)[0]
        for at in (experiments.pulled_off_poses(gripper, further), slip.poses, poses)
    )
    # of (F_x, F_z), in whose directions the shift of the base is looked at, too
    turns = np.linspace(-np.pi / 2, np.pi / 2, 25)
    around = np.column_stack([np.sin(turns), -np.cos(turns), 0.0 * turns])
    elsewhere = experiments.pull(gripper, around)
    progress(1, 1)
    # of each phalanx, the largest of its limits
    used = [
        (piece.a_shear * at_slip.shears[0] + piece.a_normal * at_slip.normals[0]) / piece.capacity
        for piece in inner_half_planes(gripper.surface)
    ]
    lines = [f"{kind}_{end}" for kind in ("shear", "normal") for end in ("unloaded", "pulled")]
    data: dict[str, Any] = {
        "diameter": conditions.diameter,
        "tension": conditions.tension,
        "phalanges": PHALANGES,
        "pull": pulls[: len(poses)],
        "shear": loads.shears,
        "normal": loads.normals,
        "base": poses[:, 1],
        "condition": np.linalg.cond(balance_matrix(gripper, poses, loads)),
        "pull_of_figure": pulled,
        "read_off": {line: table.vector("fig12", line) for line in lines},
        "condition_printed": table.scalar("fig12", "condition"),
        "until_slip": {"pull": further, "shear": beyond.shears, "normal": beyond.normals},
        "slip": {
            "pull": most,
            "phalanx": slip.phalanx[0],
            "way": slip.way[0],
            "utilisation": gripper.evaluate(slip.poses).utilisation[0],
            "utilisation_by_phalanx": np.max(used, axis=0),
            "shear": at_slip.shears[0],
            "normal": at_slip.normals[0],
            "base_shift": np.linalg.norm((slip.poses[0] - rest)[:2]),
        },
        "base_shift_elsewhere": {
            "force_x": elsewhere.wrenches[:, 0],
            "force_z": elsewhere.wrenches[:, 1],
            "shift": np.linalg.norm((elsewhere.poses - rest)[:, :2], axis=1),
        },
    }
    return _checked(data, table)


def _checked(data: dict[str, Any], table: ParameterTable) -> StudyResult:
    text, tolerances = StudyText("fig12"), experiments.FIT_TOLERANCES
    for kind in ("shear", "normal"):
        for end, where, at in (("unloaded", "without load", 0), ("pulled", "at the end", -1)):
            read, held = np.array(data["read_off"][f"{kind}_{end}"]), data[kind][at]
            near = np.maximum(tolerances.force_share * read, tolerances.least_force)
            there = data["pull"][at]
            arrived = at == 0 or there == data["pull_of_figure"]
            holds = arrived and (np.abs(held - read) <= near).all()
            text.check("ends", holds, kind=kind, where=where, there=there, read=read, held=held)
    for kind, signs, course in (
        ("shear", (1, 1, 1), "shear forces increase gradually on every phalanx"),
        ("normal", (-1, 0, -1), "the normal forces of proximal and distal phalanx decrease"),
        ("normal", (0, 1, 0), "the normal force of the middle phalanx rises"),
    ):
        meant = np.flatnonzero(signs)
        total = (data[kind][-1] - data[kind][0])[meant]
        rising = data[kind][:, meant] * np.array(signs)[meant]
        back = float((np.maximum.accumulate(rising) - rising).max())
        given = experiments.listed(np.array(PHALANGES)[meant], total, "+.2f") + " N"
        given += f"; {back:.1g} N back on the way" if back > 0.0 else ""
        text.check("course", (rising[-1] > rising[0]).all(), got=given, course=course)
    for kind, span in zip(("shear", "normal"), table.vector("fig12", "sensor_range"), strict=True):
        within = table.scalar("fig12", "sensor_accuracy") * span
        # pulls are evenly spaced
        off = float(np.abs(scipy.signal.detrend(data[kind], axis=0)).max())
        text.check("straight", off <= within, kind=kind, within=within, off=off)
    lowest, highest = data["condition"].min(), data["condition"].max()
    printed = data["condition_printed"]
    text.check("condition", lowest > printed, least=printed, lowest=lowest, highest=highest)
    slip, used = data["slip"], data["slip"]["utilisation_by_phalanx"]
    slipping = {**slip, "way": slip["way"].replace("_", " ")}
    text.check("first", slip["phalanx"] in ("proximal", "distal"), **slipping)
    text.check("middle", used[1] < 1.0, got=experiments.listed(PHALANGES, used))
    shift, own = table.scalar("fig12", "base_shift"), slip["base_shift"]
    furthest = data["base_shift_elsewhere"]["shift"].max()
    about = 0.25  # share within which the base's shift is the paper's
    holds = abs(max(own, furthest) - shift) <= about * shift
    shifts = {"own": 1e3 * own, "furthest": 1e3 * furthest, "shift": 1e3 * shift}
    text.check("base", holds, near=100 * about, **shifts)
    return text.result(data)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the phalanges' shear and normal forces over the pull, and the condition number of A."""
    data, slip, text = result.data, result.data["slip"], StudyText("fig12")
    figure, (shear, normal, condition) = experiments.panels(1, 3, (14.0, 4.4))
    for axes, kind in ((shear, "shear"), (normal, "normal")):
        for i, (name, colour) in enumerate(experiments.PHALANX_COLOURS.items()):
            read = [data["read_off"][f"{kind}_{end}"][i] for end in ("unloaded", "pulled")]
            axes.plot(data["pull"], data[kind][:, i], color=colour, label=name)
            axes.plot(data["until_slip"]["pull"], data["until_slip"][kind][:, i], ":", color=colour)
            axes.plot([0.0, data["pull_of_figure"]], read, "o", color=colour, mfc="white")
            axes.plot(slip["pull"], slip[kind][i], "x", color=colour)
        axes.set_ylim(min(0.0, 1.2 * min(slip[kind])), None)
        text.label(axes, "forces", kind=kind, pull=slip["pull"])
    condition.plot(data["pull"], data["condition"], color="k")
    condition.axhline(data["condition_printed"], color=COLOUR_OF["red"], linewidth=1.0)
    text.label(condition, "condition")
    condition.set_ylim(0.0, 1.2 * max(*data["condition"], data["condition_printed"]))
    return {"fig12": figure}
