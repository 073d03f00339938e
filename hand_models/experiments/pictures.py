"""Helpers for the pictures of studies: panels, solids of wrenches, maps of sweeps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, Final, Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from trimesh.remesh import subdivide

from hand_models.base import COLOUR_OF, Array
from hand_models.experiments.force_limits import MEASURE_UNITS, Measure
from hand_models.experiments.wrench_hull import PLANAR_SCALE
from hand_models.finger import PHALANGES
from hand_models.wrench_spaces import hull

__all__ = [
    "PHALANX_COLOURS",
    "conditions_title",
    "draw_map",
    "draw_solid",
    "entry_name",
    "label_solid",
    "legend",
    "panels",
]

PHALANX_COLOURS: Final = {
    phalanx: COLOUR_OF[name]
    for phalanx, name in zip(PHALANGES, ("red", "green", "blue"), strict=True)
}
"""Colour of each phalanx in every picture; for failures the paper also uses red and blue."""

STATE_COLOURS: Final = {
    "contact fails": (COLOUR_OF["blue"], "closing alone overloads a tile"),
    "ejects": ("navy", "the gripper ejects itself"),
    "no grasp": ("0.6", "no such grasp"),
}
"""Colour and legend of a map's cells without limits, by state."""


def panels(
    rows: int,
    columns: int,
    size: tuple[float, float],
    grid: Literal["x", "y", "both", "none"] = "both",
    solids: Collection[int] = (),
    **options: Any,
) -> tuple[Figure, list[Any]]:
    """Return a figure with a grid of axes.

    Parameters
    ----------
    rows, columns : int
        Numbers of rows and columns of axes.
    size : tuple of float
        Width and height of the figure [inches].
    grid : {'x', 'y', 'both', 'none'}
        Grid lines of the axes in the plane.
    solids : collection of int
        Places of axes in three dimensions, row by row.
    **options
        Keyword arguments of `matplotlib.figure.Figure.subplot_mosaic`.

    Returns
    -------
    tuple of (Figure, list of Axes)
        The axes row by row.
    """
    figure = Figure(figsize=size, layout="constrained")
    places: Any = np.arange(rows * columns).reshape(rows, columns).tolist()
    solid: Any = {place: {"projection": "3d"} for place in solids}
    axes = figure.subplot_mosaic(places, per_subplot_kw=solid, **options)
    for place, each in axes.items() if grid != "none" else ():
        if place not in solids:
            each.grid(axis=grid, alpha=0.3)
    return figure, list(axes.values())


def label_solid(axes: Any, title: str) -> None:
    """Label three-dimensional axes (F_x, M_y, F_z), with F_z downward so that pull-off is up."""
    axes.set(xlabel="F_x [N]", ylabel="M_y [N·m]", zlabel="F_z [N]", title=title)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(5))
        axis.labelpad = 8.0
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        corner = 0.1 * (high - low)
        ticks = MaxNLocator(4).tick_values(low, high)
        axis.set_ticks(ticks[(ticks >= low + corner) & (ticks <= high - corner)])
    axes.invert_zaxis()
    axes.set_box_aspect(None, zoom=0.85)
    axes.view_init(elev=25.0, azim=-50.0)


def draw_solid(axes: Any, points: Array, title: str) -> None:
    """Draw the part F_z < 0 of the hull of wrenches (n, 3), coloured by F_z, and label its axes."""
    simplices = hull(points * PLANAR_SCALE).simplices
    # those below F_z = 0, not on it; each is subdivided for its colours
    triangles = simplices[points[simplices, 1].min(axis=1) < -1e-6]
    corners = points
    for _ in range(4):
        corners, triangles = subdivide(corners, triangles)
    faces = corners[triangles]
    colours = colormaps["viridis"](faces[:, :, 1].mean(axis=1) / points[:, 1].min())
    drawn = Poly3DCollection(faces[:, :, [0, 2, 1]], facecolors=colours, edgecolor=colours, lw=0.2)
    axes.add_collection3d(drawn)
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[2], high[2]), zlim=(low[1], 0.0))
    label_solid(axes, title)


def conditions_title(conditions: dict[str, Any]) -> str:
    """Return a title such as ``300 mm, tendons at 46 N, concrete-fine``.

    Parameters
    ----------
    conditions : dict
        The fields of `Conditions`: ``diameter`` [m], ``tension`` [N] and ``surface``.
    """
    diameter, tension, surface = (conditions[key] for key in ("diameter", "tension", "surface"))
    return f"{1e3 * diameter:g} mm, tendons at {tension:g} N, {surface}"


def entry_name(entry: str) -> str:
    """Return an entry in words: ``middle pulley radius`` for ``finger.pulley_radii[1]``."""
    section, _, name = entry.partition(".")
    name, _, place = name.partition("[")
    words = {"pulley_radii": "pulley radius"}.get(name, name.replace("_", " "))
    whose = (
        PHALANGES[int(place[:-1])] if place else "" if section in ("finger", "gripper") else section
    )
    return f"{whose} {words}".strip()


def draw_map(axes: Axes, data: dict[str, Any], measure: Measure) -> None:
    """Draw a map of a measure over two parameters; a white diamond marks the table's values.

    Cells without limits have the colour of their state (`STATE_COLOURS`).

    Parameters
    ----------
    axes : Axes
    data : dict
        Result of `sweep_map`.
    measure : str
        A key of ``data["limits"]``.
    """
    states, values = data["state"], data["limits"][measure]
    handier = {"m": (1e3, "mm"), "N/m": (1e-3, "N/mm")}
    sides, labels = [], []
    for side in (data["x"], data["y"]):
        scale, unit = handier.get(side["unit"], (1.0, side["unit"]))
        sides.append((scale * np.array(side["values"]), scale * side["current"]))
        labels.append(f"{entry_name(side['entry'])} [{unit}]")
    (x, current_x), (y, current_y) = sides
    mesh = axes.pcolormesh(x, y, values, cmap="YlOrRd", vmin=0.0, shading="nearest")
    for state, (colour, _) in STATE_COLOURS.items():
        if (states == state).any():
            shown = np.ma.masked_where(states != state, np.ones(states.shape))
            axes.pcolormesh(x, y, shown, cmap=ListedColormap([colour]), shading="nearest")
    axes.plot(current_x, current_y, "D", color="white", markeredgecolor="k", markersize=11)
    # the range that was asked for: half of each cell at its ends is beyond
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    unit = MEASURE_UNITS[measure]
    name = measure if measure == "volume" else f"{measure} limit"
    axes.figure.colorbar(mesh, ax=axes, label=f"{name} [{unit}]")
    axes.set(xlabel=labels[0], ylabel=labels[1])


def legend(figure: Figure, maps: Sequence[dict[str, Any]]) -> None:
    """Draw a legend of the states' colours and of the diamond below the maps of a figure.

    Parameters
    ----------
    figure : Figure
    maps : sequence of dict
        Results of `sweep_map` in the figure.
    """
    met = {state for data in maps for state in data["state"].flat}
    handles: list[Any] = [
        Patch(color=colour, label=text)
        for state, (colour, text) in STATE_COLOURS.items()
        if state in met
    ]
    handles.append(
        Line2D([], [], marker="D", color="white", markeredgecolor="k", linestyle="", label="in use")
    )
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=True)
