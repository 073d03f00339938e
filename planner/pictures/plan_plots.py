"""Picture of a plan: the robot on the rock, the forces of its hands, and all utilisations.

The robot is drawn from behind in W and from two sides: its body as the capsules of its file, its
limbs where the joints are known.
"""

from __future__ import annotations

import math
import textwrap
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator
from mpl_toolkits.mplot3d import proj3d

from hand_models.base import Array, write_picture
from planner.pictures.plan_scene import (
    WORLD_UP,
    DrawnScene,
    ViewDirections,
    drawn_scene,
    joint_utilisations,
    view_directions,
)
from planner.pictures.plan_tables import (
    draw_answers,
    draw_bar,
    draw_joints,
    draw_shortfall,
    draw_spread,
    draw_tiles,
)
from planner.pictures.plan_views import View, draw_scene
from planner.question import Question
from planner.result import Plan

__all__ = ["draw_plan", "plot_plan"]


def plot_plan(plan: Plan, question: Question, path: Path) -> None:
    """Draw a plan to a file.

    Parameters
    ----------
    plan : Plan
        Any status; without loads only hands, holds and limbs are drawn.
    question : Question
        Question that the plan answers.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    """
    write_picture(draw_plan(plan, question), path, 130)


def draw_plan(plan: Plan, question: Question) -> Figure:
    """Draw a plan as a figure: views of the robot, and tables of utilisations or shortfalls.

    Parameters
    ----------
    plan : Plan
        Any status; without loads only hands, holds and limbs are drawn.
    question : Question
        Question that the plan answers.
    """
    scene, seen = drawn_scene(plan, question), view_directions(question.stance)
    rows = sum(len(hand.fingers) for hand in plan.hands or ())
    joints = joint_utilisations(plan, question.stance)
    # edges of the panels, over the picture's height
    bottom, top = 0.075, 0.875
    # inches, of which a row of a table needs an eighth
    needed = 0.118 * (rows + len(joints)) / (top - bottom)
    figure = Figure(figsize=(12.0, max(7.2, needed)))
    FigureCanvasAgg(figure)  # which measures texts
    places = {"bottom": bottom, "top": top}
    under = 0.0
    if plan.spread is not None and plan.spread.load_factor is not None:
        draw_spread(figure.add_axes((0.045, bottom, 0.14, 0.11)), plan.spread, plan.load_factor)
        draw_answers(figure.add_axes((0.265, bottom, 0.09, 0.11)), plan.spread)
        under = 0.34
    space = figure.add_gridspec(1, 1, left=0.02, right=0.37, bottom=under, top=top)
    _draw_space(figure, space[0], scene, seen)
    sides = figure.add_gridspec(2, 1, left=0.425, right=0.605, hspace=0.3, **places)
    _draw_sides(figure.add_subplot(sides[0]), figure.add_subplot(sides[1]), scene, seen)
    parts = (max(rows, 4), len(joints) + 0.5) if joints else (1.0,)
    places |= {"left": 0.75, "right": 0.93, "hspace": 0.3}
    tables = figure.add_gridspec(len(parts), 1, height_ratios=parts, **places)
    if plan.hands:
        draw_tiles(figure.add_subplot(tables[0]), plan, question)
    else:
        draw_shortfall(figure.add_axes((0.64, bottom, 0.34, top - bottom)), plan)
    if joints:
        draw_joints(figure.add_subplot(tables[1]), joints)
    if plan.hands:
        own = figure.add_axes((0.94, 0.3, 0.01, 0.4))
        draw_bar(figure, "utilisation: load / capacity [1]", cax=own)
    _write_title(figure, plan)
    return figure


def _write_title(figure: Figure, plan: Plan) -> None:
    title: str = plan.status
    if plan.utilisation is not None:
        title += f": utilisation {plan.utilisation:.2f}"
    if plan.load_factor is not None:
        title += f", load factor {plan.load_factor:.2f}"
    elif plan.load_factor_unbounded:
        title += ", load factor unbounded"
    reason = textwrap.fill(plan.reason, 180, max_lines=2, placeholder=" …")
    figure.suptitle(title, fontsize=12)
    # inches from the upper edge
    lower = 1.0 - 0.4 / figure.get_size_inches()[1]
    figure.text(0.5, lower, reason, fontsize=9, ha="center", va="top")


# Views ------------------------------------------------------------------------------------------


def _draw_space(figure: Figure, place: Any, scene: DrawnScene, seen: ViewDirections) -> None:
    """Draw the scene in the axes of W, from behind the robot."""
    axes: Any = figure.add_subplot(place, projection="3d", computed_zorder=False)
    axes.set_proj_type("ortho")
    points = scene.points
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    step = MaxNLocator(5).tick_values(0.0, float((high - low).max()))[1]
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MultipleLocator(step))
    right = np.cross(seen.ahead, WORLD_UP)
    # less under a ceiling and on a floor, so that the body is seen between the hands
    aside = math.radians(12.0) if seen.steep else math.radians(32.0)
    camera = -math.cos(aside) * seen.ahead + math.sin(aside) * right
    lean = math.asin(np.clip(seen.into[2], -1.0, 1.0))
    # from above at a wall, raised over a slab, lowered under an overhang
    elevation = math.radians(20.0) - 0.6 * lean
    axes.view_init(math.degrees(elevation), math.degrees(math.atan2(camera[1], camera[0])))
    sides = np.maximum(high - low, 1e-3)
    axes.set_box_aspect(sides)
    axes.apply_aspect()
    corners = np.array(list(product(*zip(low, high, strict=True))))
    drawn = proj3d.proj_transform(*corners.T, axes.get_proj())[:2]
    in_axes = axes.transData - axes.transAxes
    across = np.ptp(in_axes.transform(np.column_stack(drawn)), axis=0)
    axes.set_box_aspect(sides, zoom=float((np.array((0.77, 1.1)) / across).min()))
    projection = axes.get_proj()

    def flat(points: Array) -> Array:
        return np.column_stack(proj3d.proj_transform(*points.T, projection)[:2])

    height = np.array([0.0, 0.0, math.sin(elevation)])
    look = -math.cos(elevation) * camera - height
    draw_scene(View(axes, lambda points: points, flat, look, deep=True), scene)
    axes.set(xlabel="x of W [m]", ylabel="y of W [m]", zlabel="z of W [m]")


def _draw_sides(facing: Any, side: Any, scene: DrawnScene, seen: ViewDirections) -> None:
    """Draw the scene facing the rock, and from the side."""
    ahead = "toward the rock" if seen.toward else "ahead"
    _draw_side(side, scene, seen.ahead, WORLD_UP, (ahead, "up"), "the side")
    up, word, seen_from = WORLD_UP, "up", "behind"
    right = np.cross(seen.ahead, WORLD_UP)
    if seen.steep:
        up, word, seen_from = seen.ahead, ahead, "below" if seen.into[2] > 0.0 else "above"
        right *= -1.0 if seen_from == "below" else 1.0
    _draw_side(facing, scene, right, up, ("to the right", word), seen_from)


def _draw_side(
    axes: Any, scene: DrawnScene, right: Array, up: Array, words: tuple[str, str], seen_from: str
) -> None:
    plane = np.column_stack([right, up])

    def flat(points: Array) -> Array:
        return (np.asarray(points) - scene.origin) @ plane

    axes.set_title(f"seen from {seen_from}", fontsize=10)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.2, 0.15)
    axes.update_datalim(flat(scene.points))
    axes.grid(alpha=0.3)
    axes.set(xlabel=f"{words[0]}, from B [m]", ylabel=f"{words[1]}, from B [m]")
    draw_scene(View(axes, flat, flat, np.cross(up, right), deep=False), scene)
