"""Picture of a stance's support region: where the centre of mass may be, seen along gravity."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patheffects import withStroke

from hand_models.base import COLOUR_OF, Array, panel_grid, write_picture
from planner.capability import BodySpace, ComRegion, ComSolid
from planner.pictures.body_plots import draw_polygon
from planner.pictures.settings import PICTURE_SETTINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["axis_words", "draw_com_region", "plot_com_region"]


def plot_com_region(
    space: BodySpace,
    region: ComRegion,
    path: Path,
    title: str,
    solid: ComSolid | None = None,
    accelerations: int = 0,
) -> None:
    """Draw where the centre of mass may be, with the hands and the body's origin, to a file.

    Parameters
    ----------
    space : BodySpace
        Body space of the stance.
    region : ComRegion
        Region of that stance, from `planner.capability.com_region`.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
        Title of the picture.
    solid : ComSolid or None, optional
        Solid of that stance, from `planner.capability.com_solid`: its section at the height of the
        centre of mass is drawn, too.
    accelerations : int, optional
        Number of accelerations under which the solid was sought; 0 if it was not.
    """
    figure = draw_com_region(space, region, title, solid, accelerations)
    write_picture(figure, path, 120)


def draw_com_region(
    space: BodySpace,
    region: ComRegion,
    title: str,
    solid: ComSolid | None = None,
    accelerations: int = 0,
) -> Figure:
    """Return the figure of `plot_com_region`."""
    figure, (axes,) = panel_grid(1, 1, (7.2, 7.2))
    margin = region.margin
    if region.polygon is None or margin is None:
        about = "no centre of mass is held"
    else:
        draw_polygon(axes, region.polygon)
        inside = "within" if margin >= 0.0 else "outside"
        about = f"centre of mass {1e3 * abs(margin):.0f} mm {inside} its border"
    if accelerations and region.polygon is not None:
        about += f"\n{_draw_solid(axes, region, solid, accelerations)}"
    named: dict[tuple[float, float], list[str]] = {}
    for hand in space.question.stance.hands:
        x, y = (region.axes @ hand.pose.position).tolist()
        axes.plot(x, y, "s", color=PICTURE_SETTINGS.limb, markersize=6)
        # hands above each other share a label
        named.setdefault((round(x, 2), round(y, 2)), []).append(hand.limb)
    height = float((region.axes @ region.com)[1])
    for place, limbs in named.items():
        # away from the centre of mass, and readable across the border
        above = place[1] >= height
        style: dict[str, Any] = {"ha": "center", "fontsize": 8, "color": PICTURE_SETTINGS.limb}
        style |= {"xytext": (0.0, 8.0 if above else -8.0), "textcoords": "offset points"}
        style["va"] = "bottom" if above else "top"
        label = axes.annotate(", ".join(limbs), place, **style)
        label.set_path_effects([withStroke(linewidth=3.0, foreground="white")])
    axes.plot([], [], "s", color=PICTURE_SETTINGS.limb, label="hands")
    origin = region.axes @ space.question.stance.body.position
    axes.plot(*origin, "+", color="0.4", markersize=9, label="origin of B")
    held = margin is not None and margin >= 0.0
    held = held and (not accelerations or (solid is not None and solid.margin >= 0.0))
    mark, asked = "o" if held else "x", PICTURE_SETTINGS.asked
    axes.plot(*(region.axes @ region.com), mark, color=asked, label="centre of mass asked for")
    across, up = (axis_words(axis) for axis in region.axes)
    axes.set(xlabel=f"{across} of W [m]", ylabel=f"{up} of W [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=3)
    moves = np.any(space.question.load.acceleration)
    seen = "seen against gravity and acceleration" if moves else "seen from above"
    if not space.exact:
        about += "; moving hands' sets linearised where the plan puts their wrists"
    text = f"{title}: where the centre of mass may be, {seen}\n{about}"
    figure.suptitle(text, fontsize=11, parse_math=False)
    return figure


def _draw_solid(axes: Axes, region: ComRegion, solid: ComSolid | None, accelerations: int) -> str:
    """Draw the solid at the height of the centre of mass, and return whether it is inside."""
    if solid is None:
        return f"nothing is held under these {accelerations} accelerations"
    corners = solid.section(region)
    if corners is not None:
        outline, colour = np.vstack([corners, corners[:1]]), COLOUR_OF["purple"]
        label = f"held under {accelerations} accelerations, at its height"
        axes.fill(*corners.T, facecolor="none", edgecolor=colour, hatch="//", alpha=0.4)
        axes.plot(*outline.T, color=colour, label=label)
    inside = "inside" if solid.margin >= 0.0 else "outside"
    height = "" if corners is not None else ", which does not reach its height"
    what = f"the solid that is held under {accelerations} accelerations{height}"
    return f"{1e3 * abs(solid.margin):.0f} mm {inside} {what}"


def axis_words(axis: Array) -> str:
    """Return the name of an axis of W with its sign, or the direction."""
    part = int(np.abs(axis).argmax())
    if np.allclose(np.abs(axis), np.eye(3)[part], rtol=0.0, atol=1e-9):
        return f"{'+' if axis[part] > 0.0 else '−'}{'xyz'[part]}"
    return f"along ({', '.join(f'{value:g}' for value in axis.round(3) + 0.0)})"
