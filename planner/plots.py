"""Pictures of plans and climbs.

Figures are built without a display and written to a file; every axis says what it shows in which
unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from hand_models.frames import Array, Pose
from hand_models.hand import NAIL, SettledHand
from planner.plan import Plan
from planner.route import RouteResult
from planner.solve import settle
from planner.stance import Stance

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot_plan", "plot_route"]

COLOURS: Final = LinearSegmentedColormap.from_list("load", ["#1a9850", "#e6a117", "#d73027"])
UTILISATION: Final = Normalize(0.0, 1.0)
PHALANX_COLUMNS: Final = ("base", "proximal", "middle", "distal")
ARROW: Final = 0.5
"""Length of the longest force arrow in a picture [m]."""


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=130, bbox_inches="tight", facecolor="white")


# A plan -----------------------------------------------------------------------------------------


def plot_plan(plan: Plan, stance: Stance, path: Path) -> None:
    """Draw a plan: hands, holds and hand forces from two sides, and the utilisation of every tile.

    Parameters
    ----------
    plan : Plan
        Any status; without loads only hands and holds are drawn.
    stance : Stance
        That it answers.
    path : Path
        PNG, PDF or SVG.
    """
    figure = Figure(figsize=(14.0, 6.2), layout="constrained")
    front, side, table = figure.subplots(1, 3, width_ratios=(1.0, 0.85, 1.05))
    body = stance.body.inverse()
    places = [body @ hand.pose for hand in stance.hands]
    _draw_view(front, plan, stance, places, across=(1, -1.0), up=0)
    front.set(
        title="seen from behind the robot",
        xlabel="to the right, −y of B [m]",
        ylabel="ahead, x of B [m]",
    )
    _draw_view(side, plan, stance, places, across=(2, -1.0), up=0)
    side.set(
        title="seen from its right",
        xlabel="into the rock, −z of B [m]",
        ylabel="ahead, x of B [m]",
    )
    _draw_tiles(table, plan)
    factor = "none" if plan.load_factor is None else f"{plan.load_factor:.2f}"
    used = "none" if plan.utilisation is None else f"{plan.utilisation:.2f}"
    figure.suptitle(
        f"{plan.status}: utilisation {used}, load factor {factor}\n{plan.reason}", fontsize=11
    )
    _save(figure, path)


def _draw_view(
    axes: Axes,
    plan: Plan,
    stance: Stance,
    places: Sequence[Pose],
    across: tuple[int, float],
    up: int,
) -> None:
    """Draw hands, holds and the forces on the robot in two axes of B."""
    index, sign = across

    def flat(v: Array) -> Array:
        v = np.asarray(v, dtype=float)
        return np.stack([sign * v[..., index], v[..., up]], axis=-1)

    hands = plan.hands or ()
    weight = float(np.linalg.norm(stance.gravity)) * stance.robot.mass
    longest = max([float(np.linalg.norm(hand.wrench[:3])) for hand in hands] + [weight, 1.0])
    labels: dict[tuple[float, float], str] = {}
    for hand, place in zip(stance.hands, places, strict=True):
        settled = settle(hand, stance)
        corners = place.apply(_palm_outline(settled))
        axes.fill(*flat(corners).T, facecolor="0.85", edgecolor="0.3", linewidth=1.0)
        for chain in _finger_chains(settled):
            axes.plot(*flat(place.apply(chain)).T, color="0.3", linewidth=1.5)
        touching = settled.positions[settled.holding]
        if len(touching):
            axes.plot(*flat(place.apply(touching)).T, ".", color="black", markersize=4)
        x, y = flat(place.position)
        spot = (round(float(x), 2), round(float(y), 2))
        name = hand.limb.replace("_", " ") + (" (floats)" if hand.wrist == "floating" else "")
        labels[spot] = f"{labels[spot]},\n{name}" if spot in labels else name
    for spot, text in labels.items():
        _write(axes, text, spot, (0.0, -26.0), va="top")
    for hand_plan, place in zip(hands, places, strict=False):
        force = -place.rotation @ hand_plan.wrench[:3]
        start, step = flat(place.position), flat(force) / longest * ARROW
        _arrow(axes, start, step, COLOURS(UTILISATION(hand_plan.utilisation)))
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
        size = f"{np.linalg.norm(force):.0f} N"
        _write(axes, size, start + step, (0.0, 4.0), va="bottom", bbox=box)
    com = flat(stance.robot.com)
    axes.plot(*com, marker="o", color="tab:blue", markersize=8)
    gravity = flat(stance.body.rotation.T @ stance.gravity)
    pull = gravity * stance.robot.mass / longest * ARROW
    _arrow(axes, com, pull, "tab:blue")
    label = f"robot's weight\n{weight:.0f} N"
    _write(axes, label, com + pull / 2, (5.0, 0.0), color="tab:blue", ha="left")
    axes.plot(*flat(np.zeros(3)), marker="+", color="black", markersize=10)
    _write(axes, "B", flat(np.zeros(3)), (-8.0, 4.0))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.15)
    axes.grid(alpha=0.3)


def _arrow(axes: Axes, start: Array, step: Array, colour: Any) -> None:
    (x, y), (u, v) = start, start + step
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (float(u), float(v)), (float(x), float(y)), arrowprops=style)


def _write(
    axes: Axes,
    text: str,
    spot: Sequence[float] | Array,
    shift: tuple[float, float],
    **style: Any,
) -> None:
    """Write next to a point, shifted by so many printer's points."""
    x, y = float(spot[0]), float(spot[1])
    style = {"fontsize": 8, "ha": "center", **style}
    axes.annotate(text, (x, y), xytext=shift, textcoords="offset points", **style)


def _palm_outline(settled: SettledHand) -> Array:
    hand = settled.hand
    half = np.abs(hand.palm_tiles[:, :2]).max(axis=0) + hand.palm_tile_size / 2.0
    x, y = half
    return np.array([(x, y, 0.0), (x, -y, 0.0), (-x, -y, 0.0), (-x, y, 0.0)])


def _finger_chains(settled: SettledHand) -> list[Array]:
    """Return each finger as a line through its joints to its tip, in H, shape (4, 3) each."""
    chains = []
    up = np.array([0.0, 0.0, 1.0])
    frames = settled.hand.frames(settled.grasp.outer_rotation)
    for frame, finger in zip(frames, settled.fingers, strict=True):
        flat = finger.chain
        chains.append(frame.joint + flat[:, :1] * frame.along + flat[:, 1:] * up)
    return chains


def _draw_tiles(axes: Axes, plan: Plan) -> None:
    """Draw the utilisation of every tile and palm as a table of colours."""
    hands = plan.hands or ()
    clings = any(f.tiles[-1].phalanx == NAIL for hand in hands for f in hand.fingers)
    columns = (*PHALANX_COLUMNS, NAIL) if clings else PHALANX_COLUMNS
    names, rows = [], []
    for hand in hands:
        for finger in hand.fingers:
            used = {tile.phalanx: tile for tile in finger.tiles}
            row = [
                used[p].utilisation if p in used and used[p].contact != "none" else np.nan
                for p in columns
            ]
            rows.append([*row, np.nan])
            names.append(
                f"{hand.limb.replace('_', ' ')}  {finger.name.replace('_', ' ')}"
                f"  {finger.tendon_tension:3.0f} N"
            )
        rows[-len(hand.fingers)][-1] = hand.palm.utilisation if hand.palm.engaged else np.nan
    if not rows:
        axes.text(0.5, 0.5, "no plan, no loads", ha="center", va="center")
        axes.set_axis_off()
        return
    values = np.array(rows)
    top = Normalize(0.0, float(np.nanmax(values, initial=1.0)))
    image = axes.imshow(
        np.ma.masked_invalid(values), cmap=COLOURS, norm=top, aspect="auto", interpolation="none"
    )
    axes.set_xticks(range(len(columns) + 1), [*columns, "palm"])
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.tick_params(length=0)
    for (i, j), value in np.ndenumerate(values):
        if np.isfinite(value):
            axes.text(j, i, f"{value:.2f}", ha="center", va="center", fontsize=8)
    for line in range(4, len(names), 4):
        axes.axhline(line - 0.5, color="black", linewidth=1.0)
    axes.set_title("utilisation of each tile; tension of each tendon")
    axes.figure.colorbar(image, ax=axes, label="load / capacity", shrink=0.6)


# A climb ----------------------------------------------------------------------------------------

CUT: Final = 2.0
"""Largest utilisation that a route's picture shows in full."""

PHASE_COLOURS: Final = {
    "start": "0.4",
    "shift": "tab:purple",
    "lift": "tab:orange",
    "place": "tab:blue",
}


def plot_route(result: RouteResult, path: Path) -> None:
    """Draw utilisation and load factor along a climb, with its crux."""
    figure = Figure(figsize=(11.0, 6.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    index = np.arange(len(result.plans))
    used = np.array([np.nan if p.utilisation is None else p.utilisation for p in result.plans])
    cap = result.route.limits.utilisation
    # what is far beyond the limit is cut off and written in, so that the rest can be seen
    height = min(float(np.nanmax(np.append(used, cap))), CUT) * 1.1
    colours = [PHASE_COLOURS[stage.phase] for stage in result.stages]
    upper.bar(index, np.nan_to_num(used), color=colours)
    for i in np.flatnonzero(used > height):
        upper.text(i, 0.9 * height, f"{used[i]:.1f}", ha="center", color="white", weight="bold")
    for i in index[np.isnan(used)]:
        upper.bar(i, height, color="none", edgecolor="tab:red", hatch="//")
        upper.text(i, height / 2, result.plans[i].status, rotation=90, ha="center", va="center")
    upper.axhline(cap, color="tab:red", label=f"limit {cap:g}")
    for phase, colour in PHASE_COLOURS.items():
        if any(stage.phase == phase for stage in result.stages):
            upper.bar(0, 0, color=colour, label=phase)
    crux = result.crux
    upper.annotate(
        "crux",
        (crux, height if np.isnan(used[crux]) else min(used[crux], height)),
        xytext=(0, 14),
        textcoords="offset points",
        ha="center",
        weight="bold",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
        arrowprops={"arrowstyle": "-|>"},
    )
    upper.set(
        ylabel="utilisation [1]; below the limit: margin",
        ylim=(0.0, height * 1.12),
        title=result.route.name,
    )
    upper.legend(loc="upper left", ncols=6, fontsize=8)
    factor = np.array([np.nan if p.load_factor is None else p.load_factor for p in result.plans])
    lower.plot(index, factor, "o-", color="0.2")
    lower.axhline(1.0, color="tab:red")
    lower.set(ylabel="load factor [1]", xlabel="stance")
    lower.set_ylim(bottom=0.0)
    labels = [
        "start" if s.move == 0 else f"{s.move} {s.phase}\n{str(s.limb).replace('_', ' ')}"
        for s in result.stages
    ]
    lower.set_xticks(index, labels, rotation=90, fontsize=8)
    for axes in (upper, lower):
        axes.grid(axis="y", alpha=0.3)
    _save(figure, path)
