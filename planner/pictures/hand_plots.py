"""Pictures of one hand on its hold, and of the wrenches that it can exert.

Each finger is drawn in its own plane with the rock's section; the palm and these planes are drawn
from above; the wrench space is drawn in three projections.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import scipy
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from hand_models.base import COLOUR_OF, Array, draw_arrow, write_picture
from hand_models.finger import PHALANGES
from hand_models.hand import FINGERS, NAIL, SettledHand
from hand_models.sections import Section
from hand_models.wrench_spaces import WRENCH_SCALE, WrenchSpace
from planner.capability import WRENCH_COMPONENTS, SupportPoint, enclose
from planner.pictures.body_plots import symbol_of
from planner.pictures.settings import NOTE_STYLE, PICTURE_SETTINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

__all__ = ["direction_in_words", "draw_fingers", "draw_wrench_space", "plot_wrench_space"]

CONTACT_STYLES: Final = {
    "face": (COLOUR_OF["green"], "tile's face"),
    "edge": (COLOUR_OF["purple"], "tile's edge"),
    "frame": (COLOUR_OF["amber"], "bare frame"),
    "slipped": (COLOUR_OF["sky"], "slipped tile"),
    "nail": (COLOUR_OF["red"], "fingernail"),
    "none": ("0.75", "no contact"),
}


def plot_wrench_space(
    settled: SettledHand,
    space: WrenchSpace | None,
    path: Path,
    title: str,
    preload: Array | None = None,
    *,
    outlined: bool = False,
) -> None:
    """Draw a hand on its hold, and three projections of its wrench space, to a file.

    Parameters
    ----------
    settled : SettledHand
        The hand, closed on its hold.
    space : WrenchSpace or None
        Wrench space, not empty at utilisation 1; None draws the hand only.
    path : Path
        Picture file; its suffix, PNG, PDF or SVG, is the format.
    title : str
        Title of the picture.
    preload : ndarray, shape (4,), optional
        For a floating hand, the tendon tensions at which its motors are held [N]; ``space`` is then
        its wrench space linearised at rest.
    outlined : bool, optional
        Whether projections are computed from the support function, for a space with too many
        vertices.
    """
    figure = draw_wrench_space(settled, space, title, preload, outlined=outlined)
    write_picture(figure, path, 110)


def draw_wrench_space(
    settled: SettledHand,
    space: WrenchSpace | None,
    title: str,
    preload: Array | None = None,
    *,
    outlined: bool = False,
) -> Figure:
    """Draw a hand on its hold, and three projections of its wrench space, as a figure.

    Parameters
    ----------
    settled : SettledHand
        The hand, closed on its hold.
    space : WrenchSpace or None
        Wrench space, not empty at utilisation 1; None draws the hand only.
    title : str
        Title of the picture.
    preload : ndarray, shape (4,), optional
        Preload of a floating hand's tendons [N]; tile forces are then those at this preload, not at
        the closing tension.
    outlined : bool, optional
        Whether projections are computed from the support function, not from vertices.
    """
    tensions = np.full(len(FINGERS), settled.closing_tension) if preload is None else preload
    figure = Figure(figsize=(11.5, 6.2 if space is None else 9.8), layout="constrained")
    heights = [1.0] if space is None else [1.0, 0.6]
    rows = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)
    upper = rows[0, 0]
    # apart, as panels that share a grid crowd each other where they keep their aspect
    left, right = upper.subfigures(1, 2, width_ratios=(2.0, 1.4))
    draw_fingers(left.subplots(2, 2).ravel().tolist(), settled, tensions)
    _draw_from_above(right.subplots(), settled)
    seating = settled.seating.rule.replace("_", " ")
    held = f"closing tension of {settled.closing_tension:g} N"
    if preload is not None:
        listed = ", ".join(f"{tension:g}" for tension in preload[: 4 if np.ptp(preload) else 1])
        held = f"preload of {listed} N, wrist floating, at rest"
    upper.suptitle(
        f"{title}: {settled.hold.shape}, {seating}; tile forces on the rock at the {held}",
        parse_math=False,
    )
    if space is not None:
        vertices = None if outlined else space.vertices()
        if preload is not None:
            rows[1, 0].suptitle("the set linearised at rest, before the wrist has moved")
        for axes, (i, j) in zip(rows[1, 0].subplots(1, 3), ((0, 2), (0, 4), (1, 5)), strict=True):
            points = _outline(space, i, j) if vertices is None else vertices[:, [i, j]]
            _draw_projection(axes, points, i, j)
    return figure


# Fingers in their planes ------------------------------------------------------------------------


def draw_fingers(panels: list[Axes], settled: SettledHand, tensions: Array) -> None:
    """Draw each finger in its own plane, with the forces of its tiles.

    Parameters
    ----------
    panels : list of Axes
        For inner_left, outer_left, inner_right and outer_right.
    settled : SettledHand
        The hand, closed on its hold.
    tensions : ndarray, shape (4,)
        Tendon tensions that load the tiles, in the order of `FINGERS` [N].
    """
    loads = settled.tile_loads(tensions)
    largest = max(float(np.hypot(loads[:, 0], loads[:, 1]).max()), 1.0)
    # beside the fingers, before and behind, along and across them [mm]
    before, behind = np.array([[62.0, 34.0], [30.0, 40.0]])
    chains = 1e3 * np.vstack([finger.chain for finger in settled.fingers])
    limits = chains.min(axis=0) - before, chains.max(axis=0) + behind
    limits[1][1] = max(limits[1][1], limits[0][1] + 130.0)
    # left over right, the inner finger beside the outer one
    for axes, name in zip(
        panels, ("inner_left", "outer_left", "inner_right", "outer_right"), strict=True
    ):
        _draw_finger(axes, settled, FINGERS.index(name), loads, largest, limits)
    shown = [kind for kind in CONTACT_STYLES if any(tile.contact == kind for tile in settled.tiles)]
    named = [(*CONTACT_STYLES[kind], 4) for kind in shown] + [(PICTURE_SETTINGS.palm, "palm", 3)]
    handles = [Line2D([], [], color=c, label=label, linewidth=w) for c, label, w in named]
    panels[0].legend(handles=handles, loc="lower left", fontsize=8)


def _draw_finger(
    axes: Axes,
    settled: SettledHand,
    index: int,
    loads: Array,
    largest: float,
    limits: tuple[Array, Array],
) -> None:
    """Draw a finger and the rock in its plane, from its proximal joint."""
    frame = settled.hand.frames(settled.grasp.outer_rotation)[index]
    finger = settled.fingers[index]
    model = finger.model
    low, high = limits
    name, pose = FINGERS[index], settled.seating.pose
    section = settled.hand.section(name, settled.hold, settled.grasp, pose)
    if section is not None:
        _draw_rock(axes, section, low, high)
    _draw_line(axes, finger.chain, marker="o", color="0.25", markersize=5, linewidth=2.0)
    _draw_base(axes, settled, index)
    rows = np.flatnonzero(settled.finger_of == index)
    tiles = dict(zip([settled.tiles[i].phalanx for i in rows], rows.tolist(), strict=True))
    for phalanx, contact in zip(PHALANGES, finger.contacts, strict=True):
        flush = [replace(contact, along=along, rise=0.0) for along in model.tile_range]
        _draw_tile(axes, contact.kind, [end.point(model.tile_height) for end in flush])
        if contact.kind != "none":
            place = 1e3 * np.array(contact.point(model.tile_height))
            _draw_force(axes, place, contact.angle, loads[tiles[phalanx]], largest)
    if NAIL in tiles:
        row, angle = tiles[NAIL], float(settled.nail_angles[index])
        reach = settled.hand.nail.length * np.array([math.cos(angle), math.sin(angle)])
        kind = settled.tiles[row].contact
        colour = CONTACT_STYLES[kind][0]
        _draw_line(axes, [finger.pin, finger.pin + reach], color=colour, linewidth=3)
        if kind == NAIL:
            away = settled.positions[row] - frame.joint
            place = 1e3 * np.array([away @ frame.along, away[2]])
            _draw_force(axes, place, angle, loads[row], largest)
    red, (x, y), length = COLOUR_OF["red"], low + 8.0, PICTURE_SETTINGS.longest_force
    draw_arrow(axes, (x, y), (x + length, y), red, shrinkA=2.0, shrinkB=2.0)
    axes.text(x, y + 3.0, f"{largest:.0f} N", va="top", color=red, fontsize=8)
    axes.set(
        title=f"{name.replace('_', ' ')}: plane {direction_in_words(frame.along)}",
        xlabel="along the finger, from its proximal joint [mm]",
        ylabel="into the rock, from the joint [mm]",
        xlim=(low[0], high[0]),
        ylim=(high[1], low[1]),
    )
    for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
        text.set_fontsize(9)
    axes.set_aspect("equal", adjustable="box")


def _draw_line(axes: Axes, points: Any, **style: Any) -> None:
    """Draw a line through points in (x, z) of F [m], on axes in millimetres."""
    axes.plot(*1e3 * np.transpose(points), **style)


def _draw_tile(axes: Axes, kind: str, ends: Sequence[ArrayLike]) -> None:
    """Draw a tile, from end to end in (x, z) of F [m], in the colour of its contact."""
    _draw_line(axes, ends, color=CONTACT_STYLES[kind][0], linewidth=4, solid_capstyle="butt")


def _draw_rock(axes: Axes, section: Section, low: Array, high: Array) -> None:
    s, t = (np.linspace(a, b, n) for a, b, n in zip(low, high, (110, 80), strict=True))
    clearance = section.clearances((s + 1j * t[:, None]) / 1e3)
    if clearance.min() < 0.0:
        axes.contourf(s, t, clearance, levels=[-np.inf, 0.0], colors=["0.88"])
        if clearance.max() > 0.0:
            axes.contour(s, t, clearance, levels=[0.0], colors=["0.4"], linewidths=1.0)


def _draw_base(axes: Axes, settled: SettledHand, index: int) -> None:
    """Draw the tile on an outer finger's base, or the palm behind an inner finger."""
    hand = settled.hand
    if FINGERS[index].startswith("inner"):
        (x, z), half = -hand.inner_joint[[0, 2]], 0.5 * hand.palm_length
        _draw_line(axes, [(x - half, z), (x + half, z)], color=PICTURE_SETTINGS.palm, lw=3)
        return
    tile = next(t for t, row in zip(settled.tiles, settled.finger_of, strict=True) if row == index)
    middle, half = hand.base_tile_reach - hand.outer_reach, 0.5 * hand.finger.tile_length
    height = hand.base_tile_surface - hand.outer_axis[2]
    _draw_tile(axes, tile.contact, [(middle - half, height), (middle + half, height)])
    _draw_line(axes, [(-hand.outer_reach, 0.0), (0.0, 0.0)], color="0.25", lw=2.0)


def _draw_force(axes: Axes, place: Array, angle: float, load: Array, largest: float) -> None:
    """Draw where a tile meets the rock, and what it does there."""
    axes.plot(*place, "o", color="black", markersize=4, zorder=5)
    u = np.array([math.cos(angle), math.sin(angle)])
    force = -load[0] * u + load[1] * np.array([-u[1], u[0]])
    end = place + PICTURE_SETTINGS.longest_force * force / largest
    if np.hypot(*force) > 0.02 * largest:
        draw_arrow(axes, place, end, COLOUR_OF["red"])


def direction_in_words(along: Array) -> str:
    """Return words for a direction in the plane of the palm, such as ``along x of H``.

    Parameters
    ----------
    along : ndarray, shape (3,)
        Direction in hand frame H; its z component is ignored.
    """
    angle = math.degrees(math.atan2(float(along[1]), float(along[0])))
    for name, where in (("x", 0.0), ("y", 90.0), ("−y", -90.0)):
        if abs(angle - where) < 0.05:
            return f"along {name} of H"
    if abs(angle) > 179.95:
        return "along −x of H"
    return f"{abs(angle):.0f}° from x toward {'y' if angle > 0.0 else '−y'} of H"


# From above ---------------------------------------------------------------------------------------


def _draw_from_above(axes: Axes, settled: SettledHand) -> None:
    """Draw the rock's depth, the palm's tiles and the fingers in x and y of H."""
    hand, centre = settled.hand, np.array([0.03, 0.0])
    around = 0.19  # half the side of the view [m]
    x, y = (c + np.linspace(-around, around, 41) for c in centre)
    in_hold = settled.seating.pose.inverse()
    into_rock = in_hold.rotation[:, 2]
    depth = np.array(
        [[settled.hold.entry(in_hold.apply((a, b, 0.0)), into_rock) for b in y] for a in x]
    )
    depth = 1e3 * np.ma.masked_invalid(np.where(depth > 2.0 * around, np.nan, depth))
    if depth.count():
        low = math.floor(float(depth.min()))
        # 15 shades at most, each of a whole number of millimetres
        step = max(1, math.ceil((float(depth.max()) - low) / 15))
        levels = low + step * np.arange(15 + 1)
        shades = axes.contourf(1e3 * y, 1e3 * x, depth, levels=levels, cmap="Greys", alpha=0.6)
        bar: dict[str, Any] = {"location": "bottom", "shrink": 0.8}
        axes.figure.colorbar(shades, ax=axes, label="z of H of the rock [mm]", **bar)

    def seen(points: Array) -> Array:
        """Return points in H [m] across and up the picture [mm]."""
        return 1e3 * points[..., [1, 0]]

    size = seen(hand.palm_tile_size)
    for i, tile in enumerate(hand.palm_tiles):
        corner = seen(tile) - 0.5 * size
        colour = CONTACT_STYLES["face" if i in settled.palm.engaged else "none"][0]
        axes.add_patch(Rectangle(tuple(corner), *size, facecolor=colour, alpha=0.6, ec="0.3"))
    frames = hand.frames(settled.grasp.outer_rotation)
    for name, frame, finger in zip(FINGERS, frames, settled.fingers, strict=True):
        ends = frame.joint + np.outer([-0.06, 0.16], frame.along)
        axes.plot(*seen(ends).T, "--", color=COLOUR_OF["blue"], lw=1.0)
        places = seen(frame.joint + np.outer(finger.chain[:, 0], frame.along))
        axes.plot(*places.T, "o-", color="0.25", markersize=4, lw=2.5)
        outward = places[-1] - places[0]
        shift = tuple(18.0 * outward / max(float(np.hypot(*outward)), 1.0))
        style = NOTE_STYLE | {"color": COLOUR_OF["blue"], "textcoords": "offset points"}
        axes.annotate(name.replace("_", "\n"), tuple(places[-1]), xytext=shift, **style)
    for tile, place in zip(settled.tiles, settled.positions, strict=True):
        axes.plot(*seen(place), "o", color=CONTACT_STYLES[tile.contact][0], ms=6, mec="k")
    (left, bottom), (right, top) = seen(centre - around), seen(centre + around)
    axes.set(xlabel="y of H [mm]", ylabel="x of H [mm]", xlim=(left, right), ylim=(bottom, top))
    axes.set_title("from the arm, into the rock; green palm tiles are engaged", fontsize=10)
    axes.set_aspect("equal", adjustable="box")


# The wrench space ---------------------------------------------------------------------------------


def _outline(space: WrenchSpace, i: int, j: int) -> Array:
    """Return points, shape (n, 2), of which the hull is a set's projection or all but that."""
    units = WRENCH_SCALE[[i, j]]

    def touching(normal: Array) -> SupportPoint:
        direction = np.zeros(6)
        direction[[i, j]] = normal * units
        point = space.extreme(direction)[[i, j]] * units
        return SupportPoint(normal, point)

    polygon = enclose(touching, 40)
    return np.zeros((1, 2)) if polygon is None else polygon.inner / units


def _draw_projection(axes: Axes, points: Array, i: int, j: int) -> None:
    try:
        outline = points[scipy.spatial.ConvexHull(points).vertices]
    except scipy.spatial.QhullError:
        outline = points[np.lexsort(points.T)][[0, -1]]
    axes.fill(*outline.T, alpha=0.35, color=COLOUR_OF["blue"])
    axes.plot(*np.vstack([outline, outline[:1]]).T, color=COLOUR_OF["blue"])
    axes.axhline(0.0, color="0.5", linewidth=0.8)
    axes.axvline(0.0, color="0.5", linewidth=0.8)
    (a, unit_a), (b, unit_b) = symbol_of(WRENCH_COMPONENTS[i]), symbol_of(WRENCH_COMPONENTS[j])
    axes.set(
        title=f"all wrenches on the rock, in {a} and {b}",
        xlabel=f"{a} in H [{unit_a}]",
        ylabel=f"{b} in H [{unit_b}]",
    )
    # a set narrower than this along an axis is drawn as a line [N] or [N·m]
    flat = 1e-6
    for name, values in zip(("xlim", "ylim"), points.T, strict=True):
        if np.ptp(values) < flat:
            axes.set(**{name: (values[0] - 1.0, values[0] + 1.0)})
    axes.grid(alpha=0.3)
