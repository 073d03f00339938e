"""Views of a plan's scene in matplotlib: what two- and three-dimensional pictures share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np
import scipy
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from hand_models.base import Array
from planner.pictures.plan_scene import DrawnScene
from planner.pictures.settings import NOTE_STYLE, PICTURE_SETTINGS

__all__ = [
    "UTILISATION_COLOURS",
    "UTILISATION_NORM",
    "View",
    "colour_of",
    "draw_scene",
    "ink_on",
    "silhouette",
]

UTILISATION_COLOURS: Final = LinearSegmentedColormap.from_list(
    "load", PICTURE_SETTINGS.utilisation
).with_extremes(over=PICTURE_SETTINGS.overload)
"""Colour map of utilisations from 0 to 1, with a separate colour above 1."""

UTILISATION_NORM: Final = Normalize(0.0, 1.0)
"""Range of utilisations that the colour map covers: 0 to 1."""


def colour_of(utilisation: Any) -> Any:
    """Return the colours of utilisations, which may be a number or an array."""
    return UTILISATION_COLOURS(UTILISATION_NORM(utilisation))


def ink_on(colour: Any) -> str:
    """Return in which colour text is written on a colour of matplotlib: black or white."""
    red, green, blue = to_rgb(colour)
    # of the colour as a grey, by which either has the same contrast with it, about
    middle = 0.5
    return "black" if 0.299 * red + 0.587 * green + 0.114 * blue > middle else "white"


LIMB_COLOUR: Final = PICTURE_SETTINGS.limb
SEEN_THROUGH: Final = (*to_rgb(LIMB_COLOUR), 0.16)
"""Colour of limbs, and of what is seen through them and the body."""

SCENE_STYLES: Final[dict[str, dict[str, Any]]] = {
    # convex surfaces; hands and rock are seen through the body
    "palm": {"facecolor": "0.7", "edgecolor": "0.2", "linewidth": 1.0, "zorder": 2},
    "link": {"facecolor": SEEN_THROUGH, "edgecolor": "none", "linewidth": 0.5, "zorder": 4},
    "body": {"facecolor": SEEN_THROUGH, "edgecolor": LIMB_COLOUR, "linewidth": 0.5, "zorder": 4},
    # lines
    "finger": {"color": "0.2", "linewidth": 1.5, "zorder": 3},
    "limb": {"color": LIMB_COLOUR, "linewidth": 4.0, "solid_capstyle": "round", "zorder": 5},
    # dots
    "contact": {"color": "black", "marker": ".", "ms": 4, "zorder": 3},
    "joint": {"color": "white", "mec": LIMB_COLOUR, "marker": "o", "ms": 5, "zorder": 6},
    "load": {"color": PICTURE_SETTINGS.load, "marker": "o", "ms": 8, "zorder": 6},
    "origin": {"color": "black", "marker": "+", "ms": 10, "zorder": 6},
}
"""Styles of what a scene has, by kind."""


@dataclass(frozen=True)
class View:
    """Matplotlib axes that show a scene from one direction, with methods that draw into these axes.

    Attributes
    ----------
    axes : Axes or Axes3D
        Matplotlib axes, two- or three-dimensional.
    place : callable
        Maps points in world frame W, shape (n, 3), to coordinates of the axes, shape (n, 2) or (n,
        3).
    flat : callable
        Maps points in W, shape (n, 3), to their projection in the picture, shape (n, 2), for arrows
        and notes.
    look : ndarray, shape (3,)
        Viewing direction in W.
    deep : bool
        Whether the axes are three-dimensional.
    seen : list of ndarray, shape (n, 2)
        Projections of the lines, dots and arrows drawn so far; notes avoid them.
    """

    axes: Any
    place: Callable[[Array], Array]
    flat: Callable[[Array], Array]
    look: Array
    deep: bool
    seen: list[Array] = field(default_factory=list)

    def line(self, points: Array, **style: Any) -> None:
        """Draw a polyline.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            The points, in world frame W [m].
        **style
            Line properties of matplotlib.
        """
        self.axes.plot(*self.place(points).T, clip_on=False, **style)
        self.seen.append(self.flat(points))

    def dots(self, points: Array, **style: Any) -> None:
        """Draw markers at points.

        Parameters
        ----------
        points : ndarray, shape (n, 3)
            The points, in world frame W [m].
        **style
            Line properties of matplotlib.
        """
        if len(points):
            self.axes.plot(*self.place(points).T, clip_on=False, linestyle="none", **style)
            self.seen.extend(self.flat(points)[:, None])

    def fill(self, polygons: Array, **style: Any) -> None:
        """Fill polygons.

        Parameters
        ----------
        polygons : ndarray, shape (n, k, 3)
            k corners of each of n polygons, in world frame W [m].
        **style
            Properties of matplotlib's polygon collections.
        """
        if len(polygons):
            corners = self.place(polygons.reshape(-1, 3)).reshape(*polygons.shape[:2], -1)
            collection = Poly3DCollection if self.deep else PolyCollection
            self.axes.add_collection(collection(list(corners), clip_on=False, **style))

    def rock(self, triangles: Array) -> None:
        """Draw the triangles of one rock, shaded by a light source, the farthest first.

        Those seen from inside the rock come before all others: where a long triangle of the back
        is drawn over the front, it would leave a streak.

        Parameters
        ----------
        triangles : ndarray, shape (n, 3, 3)
            Corners in world frame W [m], counterclockwise from outside.
        """
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        size = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)
        light = np.array([-0.5, -0.3, 0.8])  # from which it comes, in W
        lit = np.abs(normals @ light) / (size * math.sqrt(light @ light))
        # greys along the light, and across it
        dark, bright = 0.6, 0.92
        shades = np.repeat(dark + (bright - dark) * lit[:, None], 3, axis=1)
        order = np.argsort(-(triangles @ self.look).mean(axis=1))
        away = normals @ self.look > 0.0
        for part in (order[away[order]], order[~away[order]]):
            # edges of the same colour close the gaps that smoothing leaves between triangles
            style: dict[str, Any] = {"facecolors": shades[part], "edgecolors": shades[part]}
            self.fill(triangles[part], linewidth=0.8, joinstyle="round", zorder=1, **style)

    def arrow(self, start: Array, step: Array, colour: Any) -> tuple[Array, Array]:
        """Draw an arrow.

        Parameters
        ----------
        start : ndarray, shape (3,)
            Start of the arrow, in world frame W [m].
        step : ndarray, shape (3,)
            Vector from start to tip, in W [m].
        colour : colour of matplotlib
            Colour of the arrow.

        Returns
        -------
        begin, tip : ndarray, shape (2,)
            Projections of both ends in the picture.
        """
        begin, tip = self.flat(np.array([start, start + step]))
        # its head weighs as much as a dozen dots
        self.seen.extend([np.array([begin, tip]), *np.repeat(tip[None, None], 12, axis=0)])
        style = {"arrowstyle": "-|>", "color": colour, "lw": 2.0, "shrinkA": 0.0, "shrinkB": 0.0}
        ends = tuple(tip), tuple(begin)
        self.axes.annotate("", *ends, arrowprops=style, annotation_clip=False, zorder=7)
        return begin, tip

    def merged(
        self, spots: Iterable[Array], texts: Iterable[str], between: str, near: float
    ) -> list[tuple[Array, str]]:
        """Return texts with their positions; in side views, texts close together become one note.

        Parameters
        ----------
        spots : iterable of ndarray, shape (2,)
            Projected position of each text.
        texts : iterable of str
            Texts of the notes.
        between : str
            Separator of joined texts.
        near : float
            Distance below which texts are joined, in the coordinates of ``spots``.

        Returns
        -------
        list of (ndarray, str)
            Position, shape (2,), and text of each note.
        """
        found: list[tuple[Array, str]] = []
        for spot, text in zip(spots, texts, strict=True):
            for i, (known, before) in enumerate(found):
                if not self.deep and np.linalg.norm(spot - known) < near:
                    found[i] = known, before + between + text
                    break
            else:
                found.append((spot, text))
        return found

    def beyond(self, text: str, tip: Array, step: Array, **style: Any) -> None:
        """Write a text beyond the tip of an arrow.

        Parameters
        ----------
        text : str
            Text to write.
        tip : ndarray, shape (2,)
            Projection of the tip.
        step : ndarray, shape (2,)
            Projected arrow, from start to tip.
        **style
            Text properties of matplotlib.
        """
        size = float(np.linalg.norm(step))
        x, y = step / size if size > 0.0 else (0.0, 1.0)
        ha = "left" if x > 0.5 else "right" if x < -0.5 else "center"
        va = "bottom" if y > 0.5 else "top" if y < -0.5 else "center"
        self.note(text, tip, (5.0 * x, 5.0 * y), ha=ha, va=va, **style)

    def note(self, text: str, spot: Array, shift: tuple[float, float], **style: Any) -> None:
        """Write a text near a point of the picture.

        Parameters
        ----------
        text : str
            Text to write.
        spot : ndarray, shape (2,)
            Projection of the point.
        shift : (float, float)
            Offset of the text to the right and up [printer's points].
        **style
            Text properties of matplotlib.
        """
        style = {"zorder": 8, **NOTE_STYLE, **style}
        where = (float(spot[0]), float(spot[1]))
        place = {"xytext": shift, "textcoords": "offset points", "annotation_clip": False}
        self.axes.annotate(text, where, **place, **style)

    def untangle(self) -> None:
        """Move notes so that they overlap neither each other nor, if possible, drawn lines.

        To be called once everything is drawn. Notes stay near their positions and, in a side view,
        within the frame.
        """
        self.axes.apply_aspect()
        figure = self.axes.figure
        renderer = figure.canvas.get_renderer()
        # pixels in a printer's point
        point = figure.dpi / 72.0
        dots = self._dots(4.0 * point)
        frame = figure.bbox if self.deep else self.axes.bbox
        placed = np.zeros((0, 4))
        # shifts that are tried, in steps of half a line's height
        moves = np.array([(float(i), float(j)) for i in range(-10, 11) for j in range(-8, 9)])
        for note in self.axes.texts:
            if not note.get_text():
                continue
            box = note.get_window_extent(renderer)
            shifts = 0.5 * box.height / (note.get_text().count("\n") + 1) * moves
            moved = box.padded(PICTURE_SETTINGS.note_padding * point).extents + np.tile(shifts, 2)
            apart = (moved[:, None, :2] >= placed[:, 2:]) | (moved[:, None, 2:] <= placed[:, :2])
            free = apart.any(axis=2).all(axis=1)
            inside = ((moved[:, :2] >= frame.min) & (moved[:, 2:] <= frame.max)).all(axis=1)
            near = (dots > moved[:, :2].min(axis=0)) & (dots < moved[:, 2:].max(axis=0))
            near = dots[near.all(axis=1)]
            under = (near > moved[:, None, :2]) & (near < moved[:, None, 2:])
            # in steps: a covered dot, leaving the frame, and lying on another note
            costs = np.hypot(*moves.T) + 0.6 * under.all(axis=2).sum(axis=1)
            best = int(np.argmin(costs + 1e3 * (2.0 * ~free + ~inside)))
            note.xyann = tuple(np.add(note.xyann, shifts[best] / point))
            placed = np.vstack([placed, moved[best]])

    def _dots(self, spacing: float) -> Array:
        """Return dots on all lines and arrows, so far apart, shape (n, 2) [pixel]."""
        found = []
        for line in self.seen:
            pixels = self.axes.transData.transform(line)
            found.append(pixels)
            for begin, end in pairwise(pixels):
                count = 1 + int(np.linalg.norm(end - begin) / spacing)
                found.append(begin + np.outer(np.arange(1, count) / count, end - begin))
        return np.concatenate(found) if found else np.zeros((0, 2))


def draw_scene(view: View, scene: DrawnScene, *, noted: bool = True) -> None:
    """Draw rock, hands, limbs, forces and, if ``noted``, names and sizes of a scene into a view."""
    rocks = [s.triangles for s in scene.surfaces if s.kind == "rock" and len(s.faces)]
    for triangles in sorted(rocks, key=lambda each: -float((each @ view.look).mean())):
        view.rock(triangles)
    for kind in ("palm", "link", "body"):
        drawn = [s.vertices for s in scene.surfaces if s.kind == kind]
        outlines = [silhouette(vertices, view.look) for vertices in drawn]
        # of one length, the last corner as often as it takes
        corners = np.arange(max(map(len, outlines), default=0))
        alike = [each[np.minimum(corners, len(each) - 1)] for each in outlines]
        view.fill(np.array(alike), **SCENE_STYLES[kind])
    for line in scene.lines:
        view.line(line.points, **SCENE_STYLES[line.kind])
    for dots in scene.dots:
        if dots.utilisations is None:
            view.dots(dots.points, **SCENE_STYLES[dots.kind])
            continue
        for i in np.argsort(dots.utilisations, kind="stable"):
            colour = colour_of(dots.utilisations[i])
            style = SCENE_STYLES[dots.kind] | {"color": colour, "mec": "0.2", "ms": 6}
            view.dots(dots.points[i : i + 1], **style)
    if noted:
        _write_names(view, scene)
    _draw_arrows(view, scene, noted)
    view.untangle()


def silhouette(vertices: Array, look: Array) -> Array:
    """Return the outline of a convex surface in parallel projection.

    Parameters
    ----------
    vertices : ndarray, shape (n, 3)
        Vertices of the surface [m].
    look : ndarray, shape (3,)
        Unit viewing direction.

    Returns
    -------
    ndarray, shape (m, 3)
        Those vertices that are corners of the outline (convex hull of the projection), in order
        [m]; the two end points of a surface seen edge-on.
    """
    flat = vertices @ np.linalg.svd(look[None])[2][1:].T
    try:
        return np.asarray(vertices[scipy.spatial.ConvexHull(flat).vertices])
    except scipy.spatial.QhullError:
        along = flat @ np.linalg.svd(flat - flat.mean(axis=0))[2][0]
        return np.asarray(vertices[[along.argmin(), along.argmax()]])


def _write_names(view: View, scene: DrawnScene) -> None:
    """Write the limbs' names beside their hands, away from the body, and that of B."""
    middle = view.flat(scene.origin[None])[0]
    names = [label for label in scene.labels if label.kind == "limb"]
    spots = view.flat(np.array([label.place for label in names]))
    texts = [label.text for label in names]
    for spot, text in view.merged(spots, texts, ",\n", 0.25):
        outward = 1.0 if spot[0] >= middle[0] else -1.0
        view.note(text, spot, (14.0 * outward, -14.0), ha="left" if outward > 0.0 else "right")
    for label in scene.labels:
        if label.kind == "origin":
            view.note(label.text, middle, (-8.0, 6.0), bbox=None)


def _draw_arrows(view: View, scene: DrawnScene, noted: bool) -> None:
    """Draw forces of hands in the colours of their utilisation, and the load."""
    load, steps, tips, texts = PICTURE_SETTINGS.load, {}, [], []
    for arrow in scene.arrows:
        colour = load if arrow.utilisation is None else colour_of(arrow.utilisation)
        begin, tip = view.arrow(arrow.start, scene.scale * arrow.force, colour)
        if not noted:
            continue
        if arrow.kind == "load":
            view.beyond(arrow.text, tip, tip - begin, color=load)
            continue
        steps[tuple(tip)] = tip - begin
        tips.append(tip)
        texts.append(arrow.text)
    for tip, text in view.merged(tips, texts, ", ", 0.05):
        view.beyond(text, tip, steps[tuple(tip)])
