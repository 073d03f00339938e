"""Pictures of a climb: stages, margins along the time, support regions, and its wall."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle, groupby, pairwise
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hand_models.base import (
    COLOUR_OF,
    SERIES_COLOURS,
    Array,
    InvalidInputError,
    Pose,
    write_picture,
)
from hand_models.rock import Mesh
from planner.capability import BodySpace, com_region
from planner.climbs import FoundClimb
from planner.pictures.body_plots import draw_polygon
from planner.pictures.com_plots import axis_words
from planner.pictures.plan_scene import WORLD_UP, drawn_scene, view_directions
from planner.pictures.plan_tables import draw_bar
from planner.pictures.plan_views import View, draw_scene
from planner.pictures.settings import PICTURE_SETTINGS
from planner.programs import WRENCH_UNIT
from planner.result import Plan
from planner.route import Climb, Knot, KnotPhase, RouteResult

__all__ = ["draw_climb", "draw_support", "plot_wall"]

DECIDING_STYLE: Final[dict[str, Any]] = {
    "marker": "*", "linestyle": "none", "color": COLOUR_OF["red"], "markersize": 13,
}  # fmt: skip
"""Style of what decides how good a climb is."""

NOT_FOUND: Final = {
    "none": "proven: no climb holds enough", "blocked": "no moves of a climb have a plan",
}  # fmt: skip
"""What is said instead of load factors, by status."""


def draw_climb(climb: Climb, result: RouteResult) -> Figure:
    """Draw the robot on the rock at each stage, and utilisations and their bounds along the time.

    Parameters
    ----------
    climb : Climb
        Knots of the climb; at least one.
    result : RouteResult
        Plans of the stages of the same route. Of many stages some are shown, the first and the last
        among them.
    """
    shown = _shown(climb)
    figure, panels, lower = _panels(len(shown), below=3.2)
    FigureCanvasAgg(figure)  # which measures texts
    seen = view_directions(result.stages[0].question.stance)
    right = np.cross(seen.ahead, WORLD_UP)
    up = seen.ahead if seen.steep else WORLD_UP
    plane = np.column_stack([right, up])

    def flat(points: Array) -> Array:
        return np.asarray(points @ plane)

    bodies: list[Array] = []
    for axes, knot in zip(panels, shown, strict=True):
        assert knot.stage is not None  # as only these are shown
        answer, question = result.plans[knot.stage], result.stages[knot.stage].question
        axes.set_title(_title(knot, result), fontsize=8)
        axes.set_aspect("equal")
        if isinstance(answer, Plan):
            scene = drawn_scene(replace(answer, joints=knot.joints), question)
            draw_scene(View(axes, flat, flat, np.cross(up, right), deep=False), scene, noted=False)
            bodies += [each.vertices for each in scene.surfaces if each.kind in ("body", "link")]
            for artist in (*axes.lines, *axes.collections):
                artist.set_clip_on(True)
        moving = [hand for each in _swing_to(climb, knot) for hand in each.hands]
        way = np.array([hand.pose.position for hand in moving if hand.limb == knot.limb])
        if len(way) > 1:
            axes.plot(*flat(way).T, ".-", color=COLOUR_OF["purple"], markersize=3, zorder=9)
    places = [hand.pose.position for knot in climb.knots for hand in knot.hands]
    places += [knot.body.position for knot in climb.knots]
    extent, whole = flat(np.array(places)), flat(np.vstack([*bodies, *places]))
    around, edge = 0.3, 0.05  # rock beyond the hands, and air about the bodies [m]
    low = np.minimum(extent.min(axis=0) - around, whole.min(axis=0) - edge)
    high = np.maximum(extent.max(axis=0) + around, whole.max(axis=0) + edge)
    _set_frame(panels, low, high)
    _draw_margins(lower, climb)
    draw_bar(figure, "utilisation of a hand's force, a joint [1]", ax=lower, pad=0.01)
    side = "above" if seen.steep and seen.into[2] < 0.0 else "below" if seen.steep else "behind"
    title = f"{climb.route.name}: seen from {side}, across and up in W [m]; purple: way of the hand"
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def draw_support(climb: Climb, result: RouteResult) -> Figure | None:
    """Draw where the centre of mass may be at each stage, across gravity, and its way to the stage.

    Parameters
    ----------
    climb : Climb
        Knots of the climb; at least one.
    result : RouteResult
        Plans of the stages of the same route.

    Returns
    -------
    Figure or None
        None if the load leaves no such region: without weight, or with an angular acceleration.
    """
    shown = _shown(climb)
    try:
        spaces = [BodySpace(result.stages[k.stage or 0].question) for k in shown]
        regions = [com_region(space) for space in spaces]
    except InvalidInputError:
        return None
    figure, panels, _ = _panels(len(shown), below=0.0)
    places: list[Array] = []
    for axes, knot, region in zip(panels, shown, regions, strict=True):
        if region.polygon is not None:
            draw_polygon(axes, region.polygon)
            places += [*region.polygon.outer]
        for hand in knot.hands:
            style = {} if hand.on_rock else {"markerfacecolor": "none"}
            place = region.axes @ hand.pose.position
            places.append(place)
            axes.plot(*place, "s", color=PICTURE_SETTINGS.limb, markersize=4, **style)
        way = np.array([_com(climb, each) for each in _since_stage(climb, knot)]) @ region.axes.T
        axes.plot(*way.T, "-", color=PICTURE_SETTINGS.asked, linewidth=1.2)
        axes.plot(*way[0], "o", color="white", markeredgecolor="black", markersize=5)
        axes.plot(*way[-1], "o", color=PICTURE_SETTINGS.asked, markersize=4)
        room, margin = "no region", region.margin
        if margin is not None:
            room = f"{1e3 * abs(margin):.0f} mm {'inside' if margin >= 0.0 else 'outside'}"
        axes.set_title(f"{_title(knot, result)}\n{room}", fontsize=8)
        axes.set_aspect("equal")
    extent, edge = np.array(places), 0.1  # around all [m]
    _set_frame(panels, extent.min(axis=0) - edge, extent.max(axis=0) + edge)
    across, up = (axis_words(axis) for axis in regions[0].axes)
    figure.supxlabel(f"{across} of W [m]", fontsize=9)
    figure.supylabel(f"{up} of W [m]", fontsize=9)
    title = f"{climb.route.name}: where the centre of mass may be, across gravity"
    dots = "way from the stage before (white) to the stage (black)"
    text = f"{title}\n{dots}; squares: hands, empty in the air"
    figure.suptitle(text, fontsize=11, parse_math=False)
    return figure


def plot_wall(found: FoundClimb, rock: Mesh, rock_pose: Pose, path: Path) -> None:
    """Draw a wall's placements by what they carry, the climb on them, and its load factors.

    Parameters
    ----------
    found : FoundClimb
    rock : Mesh
        Its frame has x up the rock and z into it.
    rock_pose : Pose
        Of that frame in W.
    path : Path
        Picture file; its suffix is the format.
    """
    wall, into_rock = found.wall, rock_pose.inverse()

    def flat(poses: Sequence[Pose]) -> Array:
        """Return positions across and up the rock, (n, 2) [m]."""
        places = np.array([pose.position for pose in poses]).reshape(-1, 3)
        return np.asarray(into_rock.apply(places)[:, [1, 0]])

    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    axes, lower = figure.subplots(1, 2, width_ratios=(1.3, 1.0))
    vertices = rock.triangles.vertices
    axes.hexbin(*vertices[:, [1, 0]].T, C=-vertices[:, 2], gridsize=60, cmap="gray", linewidths=0.1)
    up = np.eye(6)[2:3]
    lifts = wall.screening.hands.supports(up)[:, 0] * WRENCH_UNIT[2]
    places = flat([each.pose for each in wall.places])
    style: dict[str, Any] = {"cmap": "viridis", "edgecolors": "white", "linewidths": 0.4}
    shown = axes.scatter(*places.T, c=lifts, s=26, **style)
    figure.colorbar(shown, ax=axes, label="largest force upward of a hand [N]", shrink=0.8)
    axes.plot(*flat(wall.bodies).T, "k+", markersize=5, label="poses of the body")
    climb, deciding = found.climb, found.deciding
    if climb is not None:
        hands = [*climb.route.start.hands, *(move.hand for move in climb.route.moves)]
        for limb, colour in zip(wall.robot.limbs, cycle(SERIES_COLOURS), strict=False):
            own = flat([hand.pose for hand in hands if hand.limb == limb])
            style = {"color": colour, "markersize": 9, "markerfacecolor": "none"}
            axes.plot(*own.T, "o-", label=limb.replace("_", " "), **style)
        bodies = flat([knot.body for knot in climb.knots])
        axes.plot(*bodies.T, "--", color="black", linewidth=1.2, label="the body")
        axes.plot(*bodies[0], "s", color="black", markersize=5)
    if deciding is not None:
        at = flat([wall.places[place].pose for place in deciding.placements.values()])
        axes.plot(*at.T, **DECIDING_STYLE, label="hands of the deciding stage")
        axes.plot(*flat([wall.bodies[deciding.body]]).T, "P", color=COLOUR_OF["red"], markersize=8)
    axes.set(aspect="equal", xlabel="across [m]", ylabel="up the rock [m]")
    axes.locator_params(axis="x", nbins=5)  # more numbers of a narrow wall would touch
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=4, frameon=False)
    _draw_factors(lower, found)
    figure.suptitle(f"{len(wall.places)} placements, {len(wall.bodies)} poses of the body")
    write_picture(figure, path, 120)


def _draw_factors(axes: Any, found: FoundClimb) -> None:
    """Draw the load factors of a climb's states and stages, and the bound of other climbs."""
    if math.isfinite(found.bound):
        label = f"no climb has more in all stages: {found.bound:.3f}"
        axes.axhline(found.bound, color=COLOUR_OF["red"], linestyle="--", label=label)
    if found.result is not None:
        known = np.array([plan.load_factor for plan in found.result.plans], float)
        axes.plot(known, ".-", color="black", label="stages as planned")
    if found.deciding is not None:
        here = found.deciding.stage, found.deciding.load_factor
        axes.plot(*here, **DECIDING_STYLE, label=f"decides: {here[1]:.3f}")
    if found.result is None:
        words = NOT_FOUND.get(found.status, "no climb was found in time")
        axes.text(0.5, 0.5, words, ha="center", transform=axes.transAxes)
    axes.axhline(1.0, color="0.6", linewidth=0.8)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set(xlabel="stage", ylabel="load factor [1]", title=found.status.replace("_", " "))
    axes.margins(y=0.08)
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize=8)


def _draw_margins(axes: Any, climb: Climb) -> None:
    """Draw utilisations of knots and the bounds between them, with phases and moves."""
    times = np.array([knot.time for knot in climb.knots])
    red, phases = COLOUR_OF["red"], get_args(KnotPhase)
    # light, so that curves are seen on them
    tints = colormaps["YlGnBu"](np.linspace(0.0, 0.5, len(phases)))
    named: set[str] = set()
    for before, knot in pairwise(climb.knots):
        ends, colour = (before.time, knot.time), tints[phases.index(knot.phase)]
        label: str | None = None if knot.phase in named else knot.phase
        named.add(knot.phase)
        axes.axvspan(*ends, color=colour, linewidth=0.0, label=label)
        if knot.bound is not None:
            label = "bound between knots" if knot.index == climb.knots[1].index else None
            axes.plot(ends, [knot.bound] * 2, color=red, linewidth=1.5, label=label)
    used = [knot.utilisation for knot in climb.knots]
    axes.plot(times, used, ".-", color="black", linewidth=1.0, markersize=4, label="knots")
    cap = climb.route.limits.utilisation
    axes.axhline(cap, color=red, linestyle="--", label=f"limit {cap:g}")
    top = 1.15 * max(cap, *used, *(knot.bound or 0.0 for knot in climb.knots))
    begun = 0.0
    for number, group in groupby(climb.knots, key=lambda knot: knot.move):
        end = max(knot.time for knot in group)
        if number:
            axes.axvline(begun, color="0.4", linewidth=0.8)
            middle = (begun + end) / 2.0
            axes.text(middle, 0.97 * top, str(number), ha="center", va="top", weight="bold")
        begun = end
    if climb.failure is not None:
        text = textwrap.fill(f"move {climb.failure.move} fails: {climb.failure.reason}", 60)
        style: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 8}
        style |= {"multialignment": "left", "bbox": {"facecolor": "white", "edgecolor": red}}
        axes.text(0.98, 0.05, text, transform=axes.transAxes, **style)
    axes.set(xlabel="time [s]", ylabel="utilisation [1]", ylim=(0.0, top))
    axes.set_xlim(times[0], max(times[-1], times[0] + 1e-3))
    axes.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=10, frameon=False)


def _panels(count: int, below: float) -> tuple[Figure, list[Any], Any]:
    """Return a figure with panels in rows, and one axes as wide as all of them below.

    ``below``: height of the axes below, zero for none [inch].
    """
    columns, height = min(count, 6), 2.4  # [inch] of a row
    rows = math.ceil(count / columns)
    size = (max(1.85 * columns, 9.0), height * rows + below + 0.8)
    figure = Figure(figsize=size, layout="constrained")
    ratios = [height] * rows + ([below] if below else [])
    grid = figure.add_gridspec(len(ratios), columns, height_ratios=ratios)
    panels = [figure.add_subplot(grid[i // columns, i % columns]) for i in range(count)]
    return figure, panels, figure.add_subplot(grid[-1, :]) if below else None


def _set_frame(panels: Sequence[Any], low: Array, high: Array) -> None:
    """Show the same part of W in all panels; only the outer ones have numbers."""
    columns = panels[0].get_subplotspec().get_gridspec().ncols
    for i, axes in enumerate(panels):
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.xaxis.set_major_locator(MaxNLocator(4))
        last = i + columns >= len(panels)
        axes.tick_params(labelsize=8, labelleft=i % columns == 0, labelbottom=last)
        axes.grid(alpha=0.3)


def _shown(climb: Climb) -> list[Knot]:
    """Return the knots of stages; of many, as many as can be seen, evenly spread."""
    staged = [knot for knot in climb.knots if knot.stage is not None]
    most = 24
    chosen = np.linspace(0, len(staged) - 1, min(len(staged), most)).round().astype(int)
    return [staged[i] for i in chosen]


def _title(knot: Knot, result: RouteResult) -> str:
    limb = "" if knot.limb is None else f" {knot.limb.replace('_', ' ')}"
    move = f"{knot.move} " if knot.move else ""
    phase = result.stages[knot.stage or 0].phase
    return f"{move}{phase}{limb}\n{knot.time:.1f} s, utilisation {knot.utilisation:.2f}"


def _since_stage(climb: Climb, knot: Knot) -> Sequence[Knot]:
    """Return the knots from the stage before to a stage."""
    staged = [each.index for each in climb.knots if each.stage is not None]
    first = max((index for index in staged if index < knot.index), default=knot.index)
    return [each for each in climb.knots if first <= each.index <= knot.index]


def _swing_to(climb: Climb, knot: Knot) -> Sequence[Knot]:
    """Return the knots of a move up to a knot from which its hand is in the air on."""
    own = [each for each in climb.knots if each.move == knot.move and each.index <= knot.index]
    limb = knot.limb
    air = [k.index for k in own for h in k.hands if h.limb == limb and not h.on_rock]
    return [each for each in own if air and each.index >= air[0]]


def _com(climb: Climb, knot: Knot) -> Array:
    """Return the centre of mass of the load's own mass at a knot, in W [m]."""
    given, robot = climb.route.load.com, climb.route.start.robot
    return knot.body.apply(robot.com_at(knot.joints) if given is None else np.array(given))
