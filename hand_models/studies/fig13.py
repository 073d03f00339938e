"""Fig. 13: the wrench space of the gripper on 300 mm, by the procedure of Fig. 9.

The study computes the hull of the wrenches at all poses of the wrist that hold, and its part
F_z ≤ 0, which the paper shows; how well the set linearised at rest represents the hull; and, since
the set itself is not convex, the share of the hull that a load along a straight direction reaches
before a tile exceeds a limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hand_models import experiments
from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.compliance import gripper_table
from hand_models.experiments import FIT_TOLERANCES, PLANAR_SCALE, Conditions, StudyResult, StudyText
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.wrench_spaces import hull

__all__ = ["plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the hull of the gripper's wrenches over poses of the wrist, and pulls to failure."""
    table, numbers = experiment_table(), gripper_table(hand)
    conditions, settings = Conditions.of_figure("fig13"), STUDY_SETTINGS
    gripper = conditions.gripper(numbers)
    after_pulls, steps = 300, 1000  # of progress: at the end of the pulls, and in all
    report = experiments.part(progress, 0, after_pulls, steps)
    found, pulled, whole = experiments.explored(gripper, settings.fig13_pulls, report)
    searched = experiments.clipped_vertices(experiments.in_paper_signs(found.wrenches))
    size = np.abs(searched).max(axis=0)
    full, shown = experiments.vertices(whole), experiments.clipped_vertices(whole)
    # those that press no more than the paper's surface
    pressing_less = conditions.gripper(numbers, table.scalar("fig13", "top"))
    held = np.vstack([experiments.held_wrenches(pressing_less), pulled.wrenches])
    over = np.linalg.norm(pulled.wrenches * PLANAR_SCALE, axis=1)
    filled = experiments.distance_along(full, pulled.wrenches / over[:, None]) / over
    force_x, _, moment = (np.linspace(-1.0, 1.0, 81) * extent for extent in size)
    edge_at, side_at = table.vector("fig13", "edge_force_x"), table.scalar("fig13", "side_force_x")
    # the least F_z there, seen along M_y
    side = -float(experiments.edge(held[:, [0, 1]] * (1.0, -1.0), np.array([side_at]))[0])
    supports = experiments.even_directions(settings.fig13_supports, size)
    few = experiments.even_directions(settings.fig13_piece_directions, size)
    report = experiments.part(progress, after_pulls, steps, steps)
    data: dict[str, Any] = {
        "diameter": conditions.diameter,
        "tension": conditions.tension,
        "poses_tried": found.tried,
        "poses_held": found.held,
        "hull_vertices": shown,
        "full_hull_vertices": full,
        "extents": experiments.extents(shown)._asdict(),
        "extents_of_wrenches": experiments.extents(held)._asdict(),
        "edge": {
            "force_x": edge_at,
            "moment": experiments.edge(held[:, [0, 2]], np.array(edge_at)),
            "printed": table.vector("fig13", "edge_moment"),
        },
        "side": {
            "force_x": side_at,
            "force_z": side,
            "printed": table.scalar("fig13", "side_force_z"),
        },
        "extents_of_pulls": experiments.extents(pulled.wrenches)._asdict(),
        "pulls": {
            "wrenches": pulled.wrenches,
            "poses": pulled.poses,
            "phalanx": pulled.phalanx,
            "way": pulled.way,
            "hull_over_pull": experiments.spread(filled),
        },
        "asymmetry": experiments.asymmetry(shown, supports),
        "pull_off": experiments.pull_off_map(full, force_x, moment),
        "positive_moment": experiments.best_moments(full, force_x),
        "linearised": experiments.linearised(gripper, full, supports),
        "linear_pieces": experiments.linear_pieces(gripper, full, few, report),
    }
    return _checked(data, table)


def _checked(data: dict[str, Any], table: ParameterTable) -> StudyResult:
    text, near = StudyText("fig13"), FIT_TOLERANCES
    for name, extent, unit in (
        ("force_x", "largest F_x", "N"),
        ("force_z", "least F_z", "N"),
        ("moment", "largest M_y", "N·m"),
    ):
        read, held = table.scalar("fig13", name), data["extents_of_wrenches"][name]
        off, share = held / read - 1.0, near.force_share
        found = {"held": held, "read": read, "off": 100 * off, "near": 100 * share}
        found |= {"whole": data["extents"][name], "pulled": data["extents_of_pulls"][name]}
        text.check("extent", abs(off) <= share, extent=extent, unit=unit, **found)
    off = np.abs(np.array(data["edge"]["moment"]) - data["edge"]["printed"])
    most, mean = off.max(), off.mean()
    text.check("edge", most <= near.edge and mean <= near.edge_on_average, most=most, mean=mean)
    # share by which it may be off the figure's
    holds = abs(data["side"]["force_z"] / data["side"]["printed"] - 1.0) <= 0.25
    text.check("side", holds, **data["side"])
    text.check("skew_symmetric", data["asymmetry"] <= 1e-6, off=data["asymmetry"])
    forces, best, strength, without = data["positive_moment"].values()
    share, middle = float((best > 0.0).sum() / max(len(best), 1)), len(forces) // 2
    half = {"strength": strength[middle], "without": np.nan_to_num(without[middle])}
    largest = forces.max(initial=0.0)
    text.check("positive_moment", share == 1.0, share=100 * share, largest=largest, **half)
    return text.result(data)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the hull of wrenches from the side, from above and along F_x, and the pull-off map."""
    data, text = result.data, StudyText("fig13")
    figure, all_axes = experiments.panels(2, 2, (14.0, 10.0), grid="none", solids=(0,))
    solid, top, side, strength = all_axes
    points, pulled = data["hull_vertices"], data["pulls"]["wrenches"]
    experiments.draw_solid(solid, points, "hull, F_z ≤ 0, F_z downward, the paper's signs")
    edge_x, _, edge_moment = data["edge"].values()
    side_x, _, side_z = data["side"].values()
    # the surface is skew symmetric: what was read off on one side is on both
    for axes, name, second, x, y, mirrored in (
        (top, "top", 2, np.array(edge_x), np.array(edge_moment), -np.array(edge_moment)),
        (side, "side", 1, np.array([side_x]), np.array([side_z]), np.array([side_z])),
    ):
        outline = points[hull(points[:, [0, second]]).vertices]
        axes.fill(outline[:, 0], outline[:, second], color=COLOUR_OF["blue"], alpha=0.2)
        axes.plot(pulled[:, 0], pulled[:, second], ".", color="0.4", markersize=3)
        axes.plot([*x, *-x], [*y, *mirrored], "x", color=COLOUR_OF["red"], label="read off Fig. 13")
        axes.grid(alpha=0.3)
        text.label(axes, name)
    _draw_strength(strength, data["pull_off"], data["positive_moment"])
    text.label(strength, "strength")
    return {"fig13": figure}


def _draw_strength(axes: Any, field: dict[str, Array], best: dict[str, Array]) -> None:
    values = -field["force_z"]
    grid = field["force_x"], field["moment"]
    filled = axes.contourf(*grid, np.maximum(values, 0.0), levels=12, cmap="viridis")
    axes.figure.colorbar(filled, ax=axes, label="largest pull-off, −F_z [N]")
    # the line ends where the map does: its cells at the hull's edge are not drawn
    drawn = np.isfinite(values)
    columns = np.searchsorted(field["force_x"], best["force_x"])
    above = np.clip(np.searchsorted(field["moment"], best["best_moment"]), 1, len(drawn) - 1)
    inside = drawn[above, columns] & drawn[above - 1, columns]
    line = np.where(inside, best["best_moment"], np.nan)
    axes.plot(best["force_x"], line, color=COLOUR_OF["red"], label="best M_y for each F_x")
