"""Picture of a stance's support region: where the centre of mass may be, seen along gravity."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from hand_models.base import whole_file
from planner.capability import BodySpace, ComRegion
from planner.pictures.body_plots import draw_polygon
from planner.pictures.settings import PICTURE_SETTINGS

__all__ = ["plot_com_region"]


def plot_com_region(space: BodySpace, region: ComRegion, path: Path, title: str) -> None:
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
    """
    figure = Figure(figsize=(7.2, 7.2), layout="constrained")
    axes = figure.subplots()
    margin = region.margin
    if region.polygon is None or margin is None:
        about = "no centre of mass is held"
    else:
        draw_polygon(axes, region.polygon)
        inside = "within" if margin >= 0.0 else "outside"
        about = f"centre of mass {1e3 * abs(margin):.0f} mm {inside} its border"
    named: dict[tuple[float, float], list[str]] = {}
    for hand in space.question.stance.hands:
        x, y = (region.axes @ hand.pose.position).tolist()
        axes.plot(x, y, "s", color=PICTURE_SETTINGS.limb, markersize=6)
        # hands above each other share a label
        named.setdefault((round(x, 2), round(y, 2)), []).append(hand.limb)
    for place, limbs in named.items():
        axes.annotate(
            ", ".join(limbs),
            place,
            xytext=(0.0, 8.0),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color=PICTURE_SETTINGS.limb,
        )
    axes.plot([], [], "s", color=PICTURE_SETTINGS.limb, label="hands")
    origin = region.axes @ space.question.stance.body.position
    axes.plot(*origin, "+", color="0.4", markersize=9, label="origin of B")
    mark, asked = "o" if margin is not None and margin >= 0.0 else "x", PICTURE_SETTINGS.asked
    axes.plot(*(region.axes @ region.com), mark, color=asked, label="centre of mass asked for")
    along = [", ".join(f"{value:g}" for value in axis.round(3) + 0.0) for axis in region.axes]
    axes.set(xlabel=f"along ({along[0]}) of W [m]", ylabel=f"along ({along[1]}) of W [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=3)
    seen = "seen against gravity and acceleration" if _moves(space) else "seen from above"
    if not space.exact:
        about += "; moving hands' sets linearised where the plan puts their wrists"
    figure.suptitle(
        f"{title}: where the centre of mass may be, {seen}\n{about}", fontsize=11, parse_math=False
    )
    with whole_file(path) as part:
        figure.savefig(part, dpi=120, facecolor="white")


def _moves(space: BodySpace) -> bool:
    return bool(np.any(space.question.load.acceleration))
