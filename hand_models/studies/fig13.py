"""Fig. 13: the wrench space of the gripper on 300 mm, by the procedure of Fig. 9.

The study computes the hull of the wrenches at all poses of the wrist that hold, and its part
F_z ≤ 0, which the paper shows; how well the set linearised at rest represents the hull; and, since
the set itself is not convex, the share of the hull that a load along a straight direction reaches
before a tile exceeds a limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from trimesh.remesh import subdivide

from hand_models.base import COLOUR_OF, Array, Progress
from hand_models.compliance import PLANAR_COMPONENTS, Gripper, gripper_table, linear_extreme, pieces
from hand_models.experiments import (
    FIT_TOLERANCES,
    PLANAR_SCALE,
    Conditions,
    Extents,
    StudyResult,
    StudyText,
    clipped_vertices,
    distance_along,
    edge,
    even_pulls,
    explored,
    extents,
    held_wrenches,
    in_paper_signs,
    label_solid,
    part,
    section,
    unloaded,
    vertices,
)
from hand_models.parameters import ParameterTable, experiment_table
from hand_models.studies.settings import STUDY_SETTINGS
from hand_models.wrench_spaces import hull

__all__ = ["plot", "run"]


def run(progress: Progress, hand: ParameterTable) -> StudyResult:
    """Compute the hull of the gripper's wrenches over poses of the wrist, and pulls to failure."""
    table = experiment_table()
    conditions, numbers = Conditions.of_figure("fig13"), gripper_table(hand)
    gripper = conditions.gripper(numbers)
    # of progress: steps at the end of the pulls, of the list of sets, and in all
    after_pulls, after_list, steps = 300, 980, 1000
    report = part(progress, 0, after_pulls, steps)
    found, pulled, whole = explored(gripper, STUDY_SETTINGS.fig13_pulls, report)
    size = np.abs(clipped_vertices(in_paper_signs(found.wrenches))).max(axis=0)
    full, shown = vertices(whole), clipped_vertices(whole)
    # those that press no more than the paper's surface
    pressing_less = conditions.gripper(numbers, table.scalar("fig13", "top"))
    held = np.vstack([held_wrenches(pressing_less), pulled.wrenches])
    over = np.linalg.norm(pulled.wrenches * PLANAR_SCALE, axis=1)
    filled = distance_along(full, pulled.wrenches / over[:, None]) / over
    force_x, moment = (np.linspace(-1.0, 1.0, 81) * size[i] for i in (0, 2))
    edge_at, side_at = table.vector("fig13", "edge_force_x"), table.scalar("fig13", "side_force_x")
    report = part(progress, after_pulls, after_list, steps)
    data: dict[str, Any] = {
        "diameter": conditions.diameter,
        "tension": conditions.tension,
        "poses_tried": found.tried,
        "poses_held": found.held,
        "hull_vertices": shown,
        "full_hull_vertices": full,
        "extents": extents(shown)._asdict(),
        "extents_of_wrenches": extents(held)._asdict(),
        "edge": {
            "force_x": edge_at,
            "moment": edge(held[:, [0, 2]], np.array(edge_at)),
            "printed": table.vector("fig13", "edge_moment"),
        },
        "side": {
            "force_x": side_at,
            # the least F_z there, seen along M_y
            "force_z": -float(edge(held[:, [0, 1]] * (1.0, -1.0), np.array([side_at]))[0]),
            "printed": table.scalar("fig13", "side_force_z"),
        },
        "extents_of_pulls": extents(pulled.wrenches)._asdict(),
        "pulls": {
            "wrenches": pulled.wrenches,
            "poses": pulled.poses,
            "phalanx": pulled.phalanx,
            "way": pulled.way,
            "hull_over_pull": _spread(filled),
        },
        "asymmetry": _asymmetry(shown, size),
        "pull_off": {
            "force_x": force_x,
            "moment": moment,
            "force_z": _pull_off(full, force_x, moment),
        },
        "positive_moment": _positive_moment(full, force_x),
        "linearised": _linearised(gripper, full, size),
        "linear_pieces": _linear_pieces(gripper, full, size, report),
    }
    progress(steps, steps)
    text = StudyText("fig13")
    _check(text, data, table)
    return text.result(data)


def _spread(values: Array) -> dict[str, float]:
    return {"mean": values.mean(), "least": values.min(), "most": values.max()}


def _asymmetry(points: Array, size: Array) -> float:
    """Return how far a hull is off its image (−F_x, F_z, −M_y), as a share of its extents."""
    sphere = _sphere(STUDY_SETTINGS.fig13_supports) / size
    here = (points @ sphere.T).max(axis=0)
    there = (points * (-1.0, 1.0, -1.0) @ sphere.T).max(axis=0)
    return float(np.abs(here - there).max())


def _sphere(count: int) -> Array:
    """Return unit vectors, evenly spread and symmetric."""
    half = even_pulls(count // 2, np.ones(3))
    return np.vstack([half, -half])


def _pull_off(points: Array, force_x: Array, moment: Array) -> Array:
    """Return the least F_z of a hull over (F_x, M_y), a row for each M_y; no number outside."""
    x, m = np.meshgrid(force_x, moment)
    start = np.column_stack([x.ravel(), 0.0 * x.ravel(), m.ravel()])
    down = np.tile([0.0, -1.0, 0.0], (len(start), 1))
    return -distance_along(points, down, start).reshape(x.shape)


def _positive_moment(points: Array, force_x: Array) -> dict[str, Array]:
    """Return, for each F_x > 0, the best M_y for pulling off, the strength there and at M_y = 0."""
    found = []
    for force in force_x[force_x > 0.0]:
        at = np.array([force, 0.0, 0.0])
        slice_ = section(points - at, (1.0, 0.0, 0.0))
        if not len(slice_) or slice_[:, 1].min() >= 0.0:
            break
        _, least, best = slice_[slice_[:, 1].argmin()]
        without = distance_along(points, np.array([[0.0, -1.0, 0.0]]), at)[0]
        found.append((force, best, -least, without))
    names = ("force_x", "best_moment", "strength", "strength_without")
    return dict(zip(names, np.reshape(found, (-1, len(names))).T, strict=True))


def _linear_pieces(
    gripper: Gripper, full: Array, size: Array, progress: Progress
) -> dict[str, Any]:
    """Return a list of linearised sets, and its union's error in support against the hull.

    Half of the directions are those that the list was made for. Supports are from the wrench at
    rest.
    """
    ways = _sphere(STUDY_SETTINGS.fig13_piece_directions) / size
    directions = np.zeros((len(ways), 6))
    directions[:, PLANAR_COMPONENTS] = ways * (1.0, 1.0, -1.0)
    found = pieces(gripper, directions[::2], progress=progress)
    rest = gripper.evaluate(np.zeros((1, len(PLANAR_COMPONENTS)))).wrenches[0]
    reached = [max(linear_extreme(piece.space, d)[1] for piece in found.pieces) for d in directions]
    exact = (full @ ways.T).max(axis=0)
    off = (np.array(reached) - directions @ rest) / (exact - directions @ rest) - 1.0
    return {
        "poses": [piece.twist for piece in found.pieces],
        "within": [piece.within for piece in found.pieces],
        "worst_looked_at": np.abs(off[::2]).max(),
        "worst_elsewhere": np.abs(off[1::2]).max(),
        "mean": off.mean(),
    }


def _linearised(gripper: Gripper, full: Array, size: Array) -> dict[str, Any]:
    """Return the error of the set linearised at rest, and where nothing loads, in its support."""
    directions = _sphere(STUDY_SETTINGS.fig13_supports) / size
    support = (full @ directions.T).max(axis=0)
    pulling = directions[:, 1] < 0.0
    result = {}
    for name, at in (("at_rest", np.zeros(3)), ("unloaded", unloaded(gripper))):
        points = in_paper_signs(gripper.linearised(at).vertices())
        error = (points @ directions.T).max(axis=0) / support - 1.0
        result[name] = {
            "error": _spread(error),
            "mean_size_of_error": np.abs(error).mean(),
            "error_pulling": _spread(error[pulling]),
            "mean_size_of_error_pulling": np.abs(error[pulling]).mean(),
            "extents": extents(clipped_vertices(points))._asdict(),
        }
    return result


def _check(text: StudyText, data: dict[str, Any], table: ParameterTable) -> None:
    names = zip(Extents._fields, ("largest F_x", "least F_z", "largest M_y"), strict=True)
    for (name, extent), unit in zip(names, ("N", "N", "N·m"), strict=True):
        read, got = table.scalar("fig13", name), data["extents_of_wrenches"][name]
        whole, pulled = data["extents"][name], data["extents_of_pulls"][name]
        given = (
            f"{got:.3g} {unit} ({100 * (got / read - 1):+.0f} %); of straight pulls {pulled:.3g}, "
            f"of the whole hull's part F_z ≤ 0 {whole:.3g}"
        )
        near = FIT_TOLERANCES.force_share
        holds, near = abs(got / read - 1.0) <= near, 100 * near
        text.check("extent", given, holds, extent=extent, near=near, read=read, unit=unit)
    off = np.abs(np.array(data["edge"]["moment"]) - data["edge"]["printed"])
    given = f"off by {off.max():.2f} at most, {off.mean():.2f} on average"
    near_everywhere = off.max() <= FIT_TOLERANCES.edge
    near_on_average = off.mean() <= FIT_TOLERANCES.edge_on_average
    text.check("edge", given, near_everywhere and near_on_average)
    force_x, force_z, printed = data["side"].values()
    holds = abs(force_z / printed - 1.0) <= 0.25  # share by which it may be off the figure's
    text.check("side", f"{force_z:.3g} N", holds, force_x=force_x, printed=printed)
    off = data["asymmetry"]
    text.check("skew_symmetric", f"{off:.1g} of its extents", off <= 1e-6)
    forces, best, strength, without = data["positive_moment"].values()
    share = float((best > 0.0).sum() / max(len(best), 1))
    middle = len(forces) // 2
    given = (
        f"for {100 * share:.0f} % of F_x up to {forces.max(initial=0.0):.1f} N; strength at half "
        f"of that from {np.nan_to_num(without[middle]):.1f} to {strength[middle]:.1f} N"
    )
    text.check("positive_moment", given, share == 1.0)


def plot(result: StudyResult) -> dict[str, Figure]:
    """Draw the hull of wrenches from the side, from above and along F_x, and the pull-off map."""
    data, text = result.data, StudyText("fig13")
    figure = Figure(figsize=(14.0, 10.0), layout="constrained")
    points, pulled = data["hull_vertices"], data["pulls"]["wrenches"]
    _draw_solid(figure.add_subplot(2, 2, 1, projection="3d"), points)
    top, side, strength = (figure.add_subplot(2, 2, k) for k in (2, 3, 4))
    edge_x, _, edge_moment = data["edge"].values()
    side_x, _, side_z = data["side"].values()
    # the surface is skew symmetric: what was read off on one side is on both
    for axes, name, second, x, y in (
        (top, "top", 2, np.array(edge_x), np.array(edge_moment)),
        (side, "side", 1, np.array([side_x]), np.array([side_z])),
    ):
        outline = points[hull(points[:, [0, second]]).vertices]
        axes.fill(outline[:, 0], outline[:, second], color=COLOUR_OF["blue"], alpha=0.2)
        axes.plot(pulled[:, 0], pulled[:, second], ".", color="0.4", markersize=3)
        mirrored = y if second == 1 else -y
        axes.plot([*x, *-x], [*y, *mirrored], "x", color=COLOUR_OF["red"], label="read off Fig. 13")
        text.label(axes, name)
        axes.grid(alpha=0.3)
        axes.legend(loc="lower right")
    _draw_strength(strength, data)
    text.label(strength, "strength")
    return {"fig13": figure}


def _draw_solid(axes: Any, points: Array) -> None:
    simplices = hull(points * PLANAR_SCALE).simplices
    # those below F_z = 0, not on it; each is subdivided for its colours
    triangles = simplices[points[simplices, 1].min(axis=1) < -1e-6]
    corners = points
    for _ in range(4):
        corners, triangles = subdivide(corners, triangles)
    faces = corners[triangles]
    colours = colormaps["viridis"](faces[:, :, 1].mean(axis=1) / points[:, 1].min())
    axes.add_collection3d(
        Poly3DCollection(faces[:, :, [0, 2, 1]], facecolors=colours, edgecolor=colours, lw=0.2)
    )
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[2], high[2]), zlim=(low[1], 0.0))
    label_solid(axes, "hull, F_z ≤ 0, F_z downward, the paper's signs")


def _draw_strength(axes: Any, data: dict[str, Any]) -> None:
    field = data["pull_off"]
    values = -field["force_z"]
    filled = axes.contourf(
        field["force_x"], field["moment"], np.maximum(values, 0.0), levels=12, cmap="viridis"
    )
    axes.figure.colorbar(filled, ax=axes, label="largest pull-off, −F_z [N]")
    best = data["positive_moment"]
    # the line ends where the map does: its cells at the hull's edge are not drawn
    drawn = np.isfinite(values)
    columns = np.searchsorted(field["force_x"], best["force_x"])
    above = np.clip(np.searchsorted(field["moment"], best["best_moment"]), 1, len(drawn) - 1)
    inside = drawn[above, columns] & drawn[above - 1, columns]
    line = np.where(inside, best["best_moment"], np.nan)
    axes.plot(best["force_x"], line, color=COLOUR_OF["red"], label="best M_y for each F_x")
    axes.legend(loc="upper left")
