"""Pictures of a stance's body space: a plane of body wrenches, and accelerations in two planes."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hand_models.base import Array, draw_arrow, panel_grid, write_picture
from planner.capability import OTHER_COMPONENTS, WRENCH_COMPONENTS, BodySection, BodySpace, Polygon
from planner.pictures.settings import PICTURE_SETTINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_polygon", "plot_body_space", "symbol_of"]


class _View(NamedTuple):
    """A plane of B, its x up: what is across in it, as an axis of B, and its label."""

    title: str
    across: Array
    xlabel: str


def plot_body_space(space: BodySpace, section: BodySection, path: Path, title: str) -> None:
    """Draw a section of the body space, and the feasible accelerations from rest, to a file.

    Accelerations are left out where they cannot be computed, or the body is infeasible at rest.

    Parameters
    ----------
    space : BodySpace
        Body space of the stance.
    section : BodySection
        Section of that body space, from `BodySpace.section`.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
        Title of the picture.
    """
    behind = _View(
        "accelerations, seen from behind the robot",
        np.array([0.0, -1.0, 0.0]),
        "to the right, along −y of B [m/s²]",
    )
    right = _View(
        "accelerations, seen from its right",
        np.array([0.0, 0.0, -1.0]),
        "toward its belly, along −z of B [m/s²]",
    )
    views = (behind, right) if space.accelerates else ()
    outlines = [_accelerations(space, view) for view in views]
    drawn = [(view, outline) for view, outline in zip(views, outlines, strict=True) if outline]
    count = 1 + len(drawn)
    # in rows of two, which a page has room for without making texts small
    columns = min(count, 2)
    size = 3.6 * columns, 0.5 + 3.9 * -(-count // 2)
    figure, (first, *others) = panel_grid(count, columns, size)
    _draw_section(first, space, section)
    for axes, (view, outline) in zip(others, drawn, strict=True):
        _draw_accelerations(axes, space, view, outline)
    used = space.plan.utilisation
    asked = "" if used is None else f", utilisation {used:.2f}"
    about = f"the body wrench asked for: {space.plan.status}{asked}"
    if not space.exact:
        about += "; floating hands' sets linearised where the plan puts their wrists"
    about = textwrap.fill(about, 52 * columns)
    figure.suptitle(f"{title}: what the body can bear\n{about}", fontsize=9, parse_math=False)
    write_picture(figure, path, 120)


def _accelerations(space: BodySpace, view: _View) -> Polygon | None:
    turn = space.question.stance.body.rotation
    return space.acceleration_section(turn @ view.across, turn[:, 0], 64)


def symbol_of(axis: str) -> tuple[str, str]:
    """Return the mathematical symbol and the unit of a body wrench's component.

    Parameters
    ----------
    axis : str
        One of `WRENCH_COMPONENTS`, such as ``fx``.
    """
    return f"${axis[0].upper()}_{axis[1]}$", "N" if axis.startswith("f") else "N·m"


def _draw_section(axes: Axes, space: BodySpace, section: BodySection) -> None:
    indices = [WRENCH_COMPONENTS.index(axis) for axis in section.axes]
    (across, across_unit), (up, up_unit) = map(symbol_of, section.axes)
    held, gravity, asked = PICTURE_SETTINGS.held, PICTURE_SETTINGS.gravity, PICTURE_SETTINGS.asked
    if section.polygon is None:
        axes.text(0.5, 0.5, "nothing is held", transform=axes.transAxes, ha="center", color=held)
    else:
        draw_polygon(axes, section.polygon)
    beside = ", beside this plane" if section.others == "zero" else ""
    weight = space.weight
    moves = weight is not None and not np.allclose(weight, space.needed, rtol=1e-9, atol=1e-6)
    if weight is not None:
        place = weight[indices]
        if np.linalg.norm(place) > 0.0:
            axes.plot(*np.vstack([np.zeros(2), place]).T, color=gravity, linewidth=1.2)
        label = ("" if moves else "asked for: ") + "holds the weight" + beside
        axes.plot(*place, "o", color=gravity, markersize=9, fillstyle="none", label=label)
    if weight is None or moves:
        label = "asked for" + beside
        axes.plot(*space.needed[indices], "x", color=asked, markersize=9, mew=2.0, label=label)
    axes.axhline(0.0, color="0.5", linewidth=0.8)
    axes.axvline(0.0, color="0.5", linewidth=0.8)
    axes.set(
        title=f"body wrenches, {OTHER_COMPONENTS[section.others]}",
        xlabel=f"{across} of the rock on the robot, in B [{across_unit}]",
        ylabel=f"{up} of the rock on the robot, in B [{up_unit}]",
    )
    _finish(axes, equal=across_unit == up_unit)


def _draw_accelerations(axes: Axes, space: BodySpace, view: _View, outline: Polygon) -> None:
    draw_polygon(axes, outline)
    into_body = space.question.stance.body.rotation.T

    def flat(vector: Array) -> Array:
        inside = into_body @ vector
        return np.array([view.across @ inside, inside[0]])

    gravity = flat(space.question.stance.gravity)
    axes.plot(0.0, 0.0, "o", color=PICTURE_SETTINGS.asked, markersize=5, label="at rest")
    if np.linalg.norm(gravity) > 1e-3:
        colour = PICTURE_SETTINGS.gravity
        draw_arrow(axes, (0.0, 0.0), gravity, colour, linewidth=1.6)
        axes.plot([], [], color=colour, label="gravity")
        axes.plot(*gravity, alpha=0.0)
    asked = flat(np.array(space.question.load.acceleration))
    if np.linalg.norm(asked) > 0.0:
        style: dict[str, Any] = {"color": PICTURE_SETTINGS.asked, "markersize": 9, "mew": 2.0}
        axes.plot(*asked, "x", label="asked for", **style)
    axes.set(title=view.title, xlabel=view.xlabel, ylabel="ahead, along x of B [m/s²]")
    _finish(axes, equal=True)


def _finish(axes: Axes, *, equal: bool) -> None:
    """Draw a grid, and a legend below the panel; with equal scales across and up, or not."""
    if equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.grid(alpha=0.3)
    axes.title.set_fontsize(9)
    axes.tick_params(labelsize=8)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_fontsize(8)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=2)


def draw_polygon(axes: Axes, polygon: Polygon) -> None:
    """Draw what is held, and the outline beyond which nothing is; a point as a point.

    Parameters
    ----------
    axes : Axes
        Axes to draw on.
    polygon : Polygon
        Inner and outer polygon, in the units of the axes.
    """
    colour = PICTURE_SETTINGS.held
    inner = np.vstack([polygon.inner, polygon.inner[:1]])
    outer = np.vstack([polygon.outer, polygon.outer[:1]])
    if len(polygon.inner) > 2:
        axes.fill(*inner.T, color=colour, alpha=0.3, linewidth=0.0, label="held")
    else:
        marker = "s" if len(polygon.inner) == 1 else ""
        axes.plot(*inner.T, color=colour, linewidth=5.0, marker=marker, alpha=0.5, label="held")
    axes.plot(*outer.T, color=colour, linewidth=1.2, label="nothing is held beyond")
