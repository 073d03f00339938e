"""Looks at the scene of a plan: what is drawn alike in axes of two and of three dimensions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb

from hand_models.base import Array
from planner.pictures.plan_scene import DrawnCapsules, DrawnHand, DrawnLimb, Scene

__all__ = ["COLOURS", "UTILISATION", "View", "capsule_outlines", "draw_scene"]

COLOURS: Final = LinearSegmentedColormap.from_list(
    "load", ["#1a9850", "#e6a117", "#d73027"]
).with_extremes(over="#7b1fa2")
"""Of a utilisation; beyond 1 another one."""

UTILISATION: Final = Normalize(0.0, 1.0)

GREYS: Final = (0.6, 0.92)
"""Of rock along the light, and across it."""

LIGHT: Final = np.array([-0.5, -0.3, 0.8])
"""Where light comes from, in W."""

LIMB: Final = "#4a6a8a"

BODY: Final = (*to_rgb(LIMB), 0.16)
"""Of the body, through which hands and rock are seen."""

ROUND: Final = 16
"""Points of half a circle."""

LOAD: Final = "tab:blue"

NEAR_TIPS: Final = 0.05
"""How near to each other tips of arrows are that share a note, in the views from a side [m]."""

NEAR_NAMES: Final = 0.25
"""How near to each other hands are whose names become one note there [m]."""

STEP_ASIDE: Final = 0.5
"""How far a note is moved at a time, over its height."""

STEPS_ASIDE: Final = 10
"""Of these, at most, to each side."""

STEPS_UP: Final = 8
"""Of these, at most, up and down."""

COVERED: Final = 0.6
"""What a covered dot of a line or an arrow weighs, in steps aside."""

HEAD: Final = 12
"""As so many dots weighs the head of an arrow."""

PADDING: Final = 1.0
"""Around a note [printer's points]."""

SPACING: Final = 4.0
"""Of the dots of what is drawn, for what notes cover [printer's points]."""

POINTS_PER_INCH: Final = 72.0

MOVES: Final = np.array(
    [
        (float(i), float(j))
        for i in range(-STEPS_ASIDE, STEPS_ASIDE + 1)
        for j in range(-STEPS_UP, STEPS_UP + 1)
    ]
)
"""Moves of a note that are tried, shape (n, 2), in steps."""

FARNESS: Final = np.hypot(*MOVES.T)
"""Of these moves, shape (n,), in steps."""

FORBIDDEN: Final = 1e3
"""What it weighs to leave the frame, in steps; twice that to lie on another note."""


@dataclass(frozen=True)
class View:
    """One look at a scene: where its axes draw places of W.

    Attributes
    ----------
    axes : Axes or Axes3D
    place : callable
        Coordinates of places (n, 3) in the axes, (n, 2) or (n, 3).
    flat : callable
        Places as they are seen, (n, 2), for arrows and notes.
    polygons : callable
        Makes the collection of polygons that these axes show.
    look : ndarray, shape (3,)
        Direction in W of looking.
    deep : bool
        Whether the axes know of depth.
    seen : list of ndarray, shape (n, 2)
        Lines and arrows drawn so far, as they are seen.
    """

    axes: Any
    place: Callable[[Array], Array]
    flat: Callable[[Array], Array]
    polygons: Callable[..., Any]
    look: Array
    deep: bool
    seen: list[Array] = field(default_factory=list)

    def line(self, points: Array, **style: Any) -> None:
        self.axes.plot(*self.place(points).T, clip_on=False, **style)
        spots = self.flat(points)
        # marks alone are joined by nothing
        self.seen.extend(spots[:, None] if style.get("linestyle") == "none" else [spots])

    def fill(self, polygons: Array, **style: Any) -> None:
        if len(polygons):
            corners = self.place(np.reshape(polygons, (-1, 3)))
            shape = (*np.shape(polygons)[:2], corners.shape[1])
            drawn = self.polygons(corners.reshape(shape), clip_on=False, **style)
            self.axes.add_collection(drawn)

    def back_to_front(self, polygons: Array) -> Array:
        """Return polygons (n, k, 3) of W in the order in which they are to be drawn."""
        if self.deep:
            return polygons
        return np.asarray(polygons[np.argsort(-(polygons @ self.look).mean(axis=1))])

    def arrow(self, start: Array, step: Array, colour: Any) -> tuple[Array, Array]:
        """Draw an arrow, and return where it is seen to begin and to end, shape (2,) each."""
        begin, tip = self.flat(np.array([start, start + step]))
        self.seen.extend([np.array([begin, tip]), *np.repeat(tip[None, None], HEAD, axis=0)])
        style = {"arrowstyle": "-|>", "color": colour, "lw": 2.0, "shrinkA": 0.0, "shrinkB": 0.0}
        ends = tuple(tip), tuple(begin)
        self.axes.annotate("", *ends, arrowprops=style, annotation_clip=False, zorder=7)
        return begin, tip

    def merged(
        self, spots: Iterable[Array], texts: Iterable[str], between: str, near: float
    ) -> list[tuple[Array, str]]:
        """Return notes with seen places; from a side, those that are near each other joined."""
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
        """Write beyond the tip of an arrow that is seen as a step (2,)."""
        size = float(np.linalg.norm(step))
        x, y = step / size if size > 0.0 else (0.0, 1.0)
        ha = "left" if x > 0.5 else "right" if x < -0.5 else "center"
        va = "bottom" if y > 0.5 else "top" if y < -0.5 else "center"
        self.note(text, tip, (5.0 * x, 5.0 * y), ha=ha, va=va, **style)

    def note(self, text: str, spot: Array, shift: tuple[float, float], **style: Any) -> None:
        """Write next to a seen place (2,), shifted by so many printer's points."""
        box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": PADDING}
        style = {"fontsize": 8, "ha": "center", "va": "center", "zorder": 8, "bbox": box, **style}
        where = (float(spot[0]), float(spot[1]))
        place = {"xytext": shift, "textcoords": "offset points", "annotation_clip": False}
        self.axes.annotate(text, where, **place, **style)

    def untangle(self) -> None:
        """Move notes off each other, and off what is drawn where they can, once all is drawn.

        They stay near where they were, and from a side within the frame.
        """
        self.axes.apply_aspect()
        figure = self.axes.figure
        renderer = figure.canvas.get_renderer()
        point = figure.dpi / POINTS_PER_INCH
        dots = self._dots(SPACING * point)
        frame = figure.bbox if self.deep else self.axes.bbox
        placed = np.zeros((0, 4))
        for note in self.axes.texts:
            if not note.get_text():
                continue
            box = note.get_window_extent(renderer)
            shifts = STEP_ASIDE * box.height / (note.get_text().count("\n") + 1) * MOVES
            moved = box.padded(PADDING * point).extents + np.tile(shifts, 2)
            apart = (moved[:, None, :2] >= placed[:, 2:]) | (moved[:, None, 2:] <= placed[:, :2])
            free = apart.any(axis=2).all(axis=1)
            inside = (moved[:, :2] >= frame.min).all(axis=1) & (moved[:, 2:] <= frame.max).all(
                axis=1
            )
            under = (dots[None] > moved[:, None, :2]) & (dots[None] < moved[:, None, 2:])
            costs = FARNESS + COVERED * under.all(axis=2).sum(axis=1)
            best = int(np.argmin(costs + FORBIDDEN * (2.0 * ~free + ~inside)))
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


def draw_scene(view: View, scene: Scene) -> None:
    """Draw rock, hands, limbs, forces and names."""
    rock = view.back_to_front(np.concatenate([hand.rock for hand in scene.hands]))
    shades = _shades(rock)
    view.fill(rock, facecolors=shades, edgecolors=shades, linewidth=0.8, zorder=1)
    for hand in scene.hands:
        _draw_hand(view, hand)
    _draw_body(view, scene)
    for limb in scene.limbs:
        _draw_limb(view, limb)
    _name_hands(view, scene)
    _draw_forces(view, scene)
    origin = view.flat(scene.body.position[None])[0]
    view.line(scene.body.position[None], color="black", marker="+", ms=10, zorder=6)
    view.note("B", origin, (-8.0, 6.0), bbox=None)
    view.untangle()


def _shades(triangles: Array) -> Array:
    """Return the greys of lit triangles, shape (n, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)
    lit = np.abs(normals @ LIGHT) / (size * math.sqrt(LIGHT @ LIGHT))
    return np.repeat(GREYS[0] + (GREYS[1] - GREYS[0]) * lit[:, None], 3, axis=1)


def _draw_hand(view: View, hand: DrawnHand) -> None:
    view.fill(hand.palm[None], facecolor="0.7", edgecolor="0.2", linewidth=1.0, zorder=2)
    for chain in hand.fingers:
        view.line(chain, color="0.2", linewidth=1.5, zorder=3)
    if len(hand.touching):
        view.line(hand.touching, color="black", linestyle="none", marker=".", ms=4, zorder=3)


def _draw_body(view: View, scene: Scene) -> None:
    """Draw capsules as they are seen; the hull of the shoulders if the body has none."""
    for capsules, edge in ((scene.link_capsules, "none"), (scene.body_capsules, LIMB)):
        outlines = capsule_outlines(capsules, view.look)
        view.fill(outlines, facecolor=BODY, edgecolor=edge, linewidth=0.5, zorder=4)
    width = 1.0 if len(scene.torso) == 1 else 0.0
    view.fill(scene.torso, facecolor=BODY, edgecolor=LIMB, linewidth=width, zorder=4)


def capsule_outlines(capsules: DrawnCapsules, look: Array) -> Array:
    """Return the outlines of capsules as seen in parallel along a direction.

    Parameters
    ----------
    capsules : DrawnCapsules
    look : ndarray, shape (3,)
        Unit direction.

    Returns
    -------
    ndarray, shape (n, 2 · `ROUND`, 3)
        Half a circle about each end, across the direction [m].
    """
    ends, radii = capsules
    across = np.linalg.svd(look[None])[2][1:]
    steps = (ends[:, 1] - ends[:, 0]) @ across.T
    along = np.arctan2(steps[:, 1], steps[:, 0])
    turn = along[:, None] + np.linspace(-math.pi / 2.0, math.pi / 2.0, ROUND)
    half = np.stack([np.cos(turn), np.sin(turn)], axis=-1) @ across * radii[:, None, None]
    return np.concatenate([ends[:, None, 1] + half, ends[:, None, 0] - half], axis=1)


def _draw_limb(view: View, limb: DrawnLimb) -> None:
    """Draw a limb's links, and its joints in the colours of their utilisation."""
    view.line(limb.chain, color=LIMB, linewidth=4.0, solid_capstyle="round", zorder=5)
    joints = limb.chain[:-1]
    if limb.utilisations is None:
        view.line(joints, color="white", mec=LIMB, marker="o", ms=5, linestyle="none", zorder=6)
        return
    for i in np.argsort(limb.utilisations, kind="stable"):
        colour = COLOURS(UTILISATION(limb.utilisations[i]))
        view.line(joints[i : i + 1], color=colour, mec="0.2", marker="o", ms=6, zorder=6)


def _name_hands(view: View, scene: Scene) -> None:
    """Write the limbs' names beside their hands, away from the body."""
    held = {hand.limb for hand in scene.hands}
    named = [(hand.limb + " (floats)" * hand.floats, hand.place) for hand in scene.hands]
    named += [(f"{limb} (free)", chain[-1]) for limb, chain, _ in scene.limbs if limb not in held]
    names, places = zip(*((name.replace("_", " "), place) for name, place in named), strict=True)
    spots = view.flat(np.array(places))
    middle = view.flat(scene.body.position[None])[0]
    for spot, text in view.merged(spots, names, ",\n", NEAR_NAMES):
        outward = 1.0 if spot[0] >= middle[0] else -1.0
        view.note(text, spot, (14.0 * outward, -14.0), ha="left" if outward > 0.0 else "right")


def _draw_forces(view: View, scene: Scene) -> None:
    """Draw the hands' forces on the robot in the colours of their utilisation, and the load."""
    arrows = []
    for hand in scene.hands:
        if hand.force is not None and hand.utilisation is not None:
            colour = COLOURS(UTILISATION(hand.utilisation))
            begin, tip = view.arrow(hand.place, scene.scale * hand.force, colour)
            arrows.append((tip, f"{np.linalg.norm(hand.force):.0f} N", tip - begin))
    steps = {tuple(tip): step for tip, _, step in arrows}
    tips, sizes = [tip for tip, _, _ in arrows], [size for _, size, _ in arrows]
    for tip, text in view.merged(tips, sizes, ", ", NEAR_TIPS):
        view.beyond(text, tip, steps[tuple(tip)])
    load = scene.load
    view.line(load.place[None], color=LOAD, marker="o", ms=8, zorder=6)
    begin, tip = view.arrow(load.place, scene.scale * load.force, LOAD)
    text = f"{'weight' if load.weight else 'load'} {np.linalg.norm(load.force):.0f} N"
    moment = f"{np.linalg.norm(load.moment):.0f}"
    if moment != "0" and not load.weight:
        text += f"\nand {moment} N·m"
    view.beyond(text, tip, tip - begin, color=LOAD)
