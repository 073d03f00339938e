"""Pictures of scanned rock: seen from outside, coloured by height, lit from the upper left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator

from hand_models.base import COLOUR_OF, Array, Indices, Pose, draw_arrow, write_picture
from hand_models.rock import Triangles
from hand_models.scans.rock import ScannedRock

__all__ = ["plot_holds", "plot_rock"]


def plot_rock(rock: ScannedRock, path: Path, title: str = "") -> None:
    """Draw rock as the scanner saw it, holes left white, and write the picture to a file.

    Parameters
    ----------
    rock : ScannedRock
    path : Path
        File of the picture; its ending chooses the format.
    title : str
    """
    axes, colours = _paint(rock.vertices, rock.faces, "viridis", title)
    axes.plot(0.0, 0.0, "+", color="red", markersize=14, markeredgewidth=2, label="origin")
    _name_holes(axes, rock)
    if rock.holes:
        axes.plot([], [], " ", label="in red: widths of the widest holes")
    _write(axes, colours, "height over the origin, against z [mm]", path)


def _name_holes(axes: Axes, rock: ScannedRock) -> None:
    """Write the widths of the widest holes beside them, but none over that of a wider one."""
    # of widths that are written, sideways and upward, as part of the rock's longer side
    apart = np.array([0.11, 0.04]) * float(np.ptp(rock.vertices[:, :2], axis=0).max())
    named: list[Array] = []
    for hole in rock.holes[:12]:
        spot = hole.place[[1, 0]] + [0.0, 0.5 * hole.width]  # above it
        if any((np.abs(spot - other) < apart).all() for other in named):
            continue
        named.append(spot)
        style: dict[str, Any] = {"color": "red", "fontsize": 8, "ha": "center", "va": "bottom"}
        style["bbox"] = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none"}
        x, y = spot.tolist()
        axes.text(x, y, f"{1e3 * hole.width:.0f} mm", **style)


def plot_holds(
    rock: Triangles,
    points: Array,
    values: Array,
    refused: Mapping[str, Array],
    best: Sequence[Pose],
    path: Path,
    title: str,
    label: str,
) -> None:
    """Draw rock, what the best hand holds at points, and the directions of the best hands.

    Parameters
    ----------
    rock : Triangles
        Surface of the rock, in the rock's frame [m].
    points : ndarray, shape (n, 3)
        Points with a hand, in the rock's frame [m].
    values : ndarray, shape (n,)
        What the best hand at each point holds, in the unit that ``label`` names.
    refused : mapping of str to ndarray, shape (m, 3)
        Points without a hold [m], by the kind of reason; each kind has a marker of its own.
    best : sequence of Pose
        Hand frames H of the best hands in the rock's frame, the best first.
    path : Path
        File of the picture; its ending chooses the format.
    title : str
        Title of the picture.
    label : str
        Meaning of the values, with their unit.
    """
    axes, _ = _paint(*rock, "gray", title)
    style: dict[str, Any] = {"s": 36, "cmap": "plasma", "edgecolors": "white", "linewidths": 0.5}
    shown = axes.scatter(points[:, 1], points[:, 0], c=values, norm=_scale(values), **style)
    for marker, (kind, at) in zip(cycle("xs^Dv+o*p"), refused.items(), strict=False):
        size: dict[str, Any] = {"markersize": 6, "markeredgewidth": 1.5, "fillstyle": "none"}
        axes.plot(at[:, 1], at[:, 0], marker, color=COLOUR_OF["sky"], label=kind, **size)
    _rank(axes, best, 0.06 * float(np.ptp(rock.vertices[:, :2], axis=0).max()))
    _write(axes, shown, label, path)


def _write(axes: Axes, colours: Any, label: str, path: Path) -> None:
    """Write the picture, with a legend if anything has a label and what colours mean."""
    figure: Any = axes.figure
    labels = axes.get_legend_handles_labels()[1]
    if labels:
        wide = max(map(len, labels)) > 40  # two columns of so many letters fill the picture
        figure.legend(loc="outside lower center", ncols=1 if wide else 2)
    figure.colorbar(colours, ax=axes, shrink=0.7, label=label)
    write_picture(figure, path, 150)


def _rank(axes: Axes, best: Sequence[Pose], length: float) -> None:
    """Draw which way the inner fingers of hands point, with the hands' ranks at the tips."""
    labels: list[tuple[Array, list[str]]] = []
    for rank, pose in enumerate(best, start=1):
        start, way = pose.position[[1, 0]], length * pose.rotation[[1, 0], 0]
        draw_arrow(axes, start, start + way, "red")
        tip = start + 1.35 * way
        near = [ranks for at, ranks in labels if np.hypot(*(at - tip)) < 0.5 * length]
        if near:
            near[0].append(str(rank))
        else:
            labels.append((tip, [str(rank)]))
    for (x, y), ranks in labels:
        style: dict[str, Any] = {"color": "white", "fontsize": 8, "ha": "center", "va": "center"}
        style["bbox"] = {"boxstyle": "round,pad=0.2", "facecolor": "red", "edgecolor": "none"}
        axes.text(x, y, ", ".join(ranks), **style)
    if best:
        axes.plot([], [], color="red", label="the best, ranked: x of H, where inner fingers point")


def _paint(
    vertices: Array, faces: Indices, palette: str, title: str
) -> tuple[Axes, ScalarMappable]:
    """Draw triangles as the scanner saw them, and return what their colours mean: heights [mm]."""
    from hand_models.scans.compiled_pictures import seen_triangles

    axes = Figure(figsize=(8.0, 7.0), layout="constrained").add_subplot()
    axes.set_title(title, parse_math=False)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    pixel = (high - low)[:2].max() / 1200  # of the longer side, the picture has about as many
    rows, columns = np.ceil((high - low)[:2] / pixel).astype(int) + 1
    corners = vertices[faces]
    place = (corners - low) / [pixel, pixel, 1.0]
    seen = seen_triangles(place, int(rows), int(columns))
    corners = corners[seen[seen >= 0]]
    heights = -1e3 * corners[:, :, 2].mean(axis=1)
    scale = _scale(np.percentile(heights, [0.5, 99.5]) if len(heights) else heights)
    colours = ScalarMappable(scale, palette)
    painted = np.ones((*seen.shape, 4))
    painted[seen >= 0] = colours.to_rgba(heights)
    painted[seen >= 0, :3] *= _brightness(corners)[:, None]
    left, bottom = low[[1, 0]] - 0.5 * pixel
    right, top = left + columns * pixel, bottom + rows * pixel
    axes.imshow(painted, origin="lower", extent=(left, right, bottom, top))
    margin = 0.03 * (high - low)[:2].max()
    for axis, size in ((axes.xaxis, high[1] - low[1]), (axes.yaxis, high[0] - low[0])):
        count = round(8 * size / (high - low)[:2].max())
        axis.set_major_locator(MaxNLocator(count) if count > 1 else FixedLocator([0.0]))
    axes.set(
        xlim=(low[1] - margin, high[1] + margin),
        ylim=(low[0] - margin, high[0] + margin),
        aspect="equal",
        xlabel="y of the rock's frame [m]",
        ylabel="x of the rock's frame [m]",
    )
    return axes, colours


def _scale(values: Array) -> Normalize:
    """Return the scale of colours of numbers, which are not spread where they are all but alike."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    middle = 0.5 * (low + high)
    half = max(0.5 * (high - low), 1e-2 * max(abs(middle), 1.0))
    return Normalize(middle - half, middle + half)


def _brightness(corners: Array) -> Array:
    """Return how bright each triangle is, shape (m,)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)
    light = np.array([0.5, -0.5, -0.7]) / np.linalg.norm([0.5, -0.5, -0.7])
    dark = 0.35  # brightness of rock that is turned away from the light
    return np.asarray(dark + (1.0 - dark) * np.clip(normal @ light / length, 0.0, 1.0))
