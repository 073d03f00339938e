"""Print the body space of a stance as tables of text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.text import Text

from hand_models.base import Array
from planner import OTHER_COMPONENTS, WRENCH_COMPONENTS
from service import replies
from service.replies import BodySpaceReply
from service.tables.command_line import print_oddities
from service.tables.layout import axis_unit, in_colour, joined, name, number, print_rows, text

__all__ = ["print_body_space", "print_com_region"]


def _limit_words(limit: Any) -> str:
    return joined(limit.limb, limit.joint, limit.finger, limit.phalanx, limit.limit)


LIMIT_COLUMN: Final = text("first to let go", "1.limiting", _limit_words)
"""Column of what lets go first, of rows whose second cell has a limit."""


def print_body_space(reply: BodySpaceReply, out: Console, accelerations: int = 0) -> None:
    """Print the body space of a stance: extents by axis, one section, and largest accelerations.

    If the reply has the region of the centre of mass, only this region is printed.

    Parameters
    ----------
    reply : BodySpaceReply
        Body wrenches that the hands together can exert, in B [N, N·m].
    out : Console
        Console to print on.
    accelerations : int, optional
        Number of accelerations under which the centre of mass was sought; 0 if it was not.
    """
    used = "" if reply.utilisation is None else f"   utilisation {reply.utilisation:.3f}"
    known = f"{used}   {1e3 * reply.time.total:.0f} ms"
    out.print(Text.assemble(in_colour(reply.status, reply.status.upper()), known))
    out.print(reply.reason)
    print_oddities(reply.warnings, reply.findings, out)
    if isinstance(reply.com_region, replies.ComRegionReply):
        print_com_region(reply.com_region, out, accelerations)
        return
    asked = ", ".join(
        f"{axis} {value:z.1f}"
        for axis, value in zip(WRENCH_COMPONENTS, reply.body_wrench, strict=True)
    )
    out.print(f"body wrench asked for (in B): {asked} [N, N·m]")
    axis = name("axis", lambda row: f"{row[0]} {axis_unit(row[0][1:])}")
    ends = [number(part, f"1.{part}", "z.1f") for part in ("more", "pure", "extent")]
    title = "how far body wrenches that are held go along the axes of B"
    legend = (
        "more: beyond the body wrench asked for, and what lets go there first",
        "pure: with every other component zero; extent: with whatever else; -: none",
    )
    print_rows(reply.capability.items(), (axis, *ends, LIMIT_COLUMN), out, title, legend=legend)
    _print_section(reply.section, out)
    _print_accelerations(reply, out)


def print_com_region(region: replies.ComRegionReply, out: Console, accelerations: int = 0) -> None:
    """Print where the centre of mass may be: its range along two axes, and what lets go there.

    Parameters
    ----------
    region : ComRegionReply
        Region of a stance, in W [m].
    out : Console
        Console to print on.
    accelerations : int, optional
        Number of accelerations under which its solid was sought; 0 if it was not.
    """
    names = [_axis_name(axis) for axis in region.axes]
    if not region.inner or region.margin is None or region.gap is None:
        out.print("no centre of mass is held, whatever its place")
        return
    corners, com = np.array(region.inner), np.array(region.axes) @ np.array(region.com)
    inside = "within" if region.margin >= 0.0 else "outside"
    where = ", ".join(f"{axis} {value:z.3f} m" for axis, value in zip(names, com, strict=True))
    out.print(f"centre of mass: {where}; {1e3 * abs(region.margin):.0f} mm {inside} its border")
    if accelerations:
        out.print(_shaken_words(region.solid, accelerations))
    rows = []
    for i, axis in enumerate(names):
        for sign, k in (("+", corners[:, i].argmax()), ("-", corners[:, i].argmin())):
            far, limit = corners[k, i], region.limiting[k]
            rows.append((f"{sign}{axis}", far, far - com[i], limit))
    columns = (
        name("axis", "0"),
        number("farthest m", "1", "z.3f"),
        number("shift m", "2", "z.3f"),
        text("first to let go", "3", _limit_words),
    )
    print_rows(rows, columns, out, "how far the centre of mass may be along axes of W")
    out.print(
        f"{_shape_words(corners)}, at any height; known to {1e3 * max(region.gap, 1e-5):.2g} mm"
    )
    if region.solid is not None:
        spans = np.array(region.solid.inner)
        out.print(
            f"under {len(region.solid.accelerations)} accelerations, a solid: "
            f"{len(spans)} corners, known to {1e3 * region.solid.gap:.2g} mm"
        )
        out.print(_ranges(spans, "xyz", ["m"] * 3, 3))
    if not region.exact:
        out.print("wrists that move: linearised where the plan puts them")


def _shaken_words(solid: replies.ComSolidReply | None, accelerations: int) -> Text:
    """Return whether the centre of mass is held under all of several accelerations."""
    if solid is None:
        held, words = False, f"nothing is held under these {accelerations} accelerations"
    else:
        held = solid.margin >= 0.0
        words = (
            f"{1e3 * abs(solid.margin):.0f} mm {'inside' if held else 'outside'} the solid that "
            f"is held under these {accelerations} accelerations"
        )
    return Text.assemble(in_colour("optimal" if held else "overloaded", "shaken:"), f" {words}")


def _axis_name(axis: replies.Vector) -> str:
    """Return the name of an axis of W, or its components."""
    for letter, unit in zip("xyz", np.eye(3), strict=True):
        if np.allclose(axis, unit, rtol=0.0, atol=1e-9):
            return letter
    return f"({', '.join(f'{value:z.3g}' for value in axis)})"


def _shape_words(corners: Array) -> str:
    """Return the shape of a polygon in words, from its corners."""
    return {1: "a point", 2: "a segment"}.get(len(corners), f"{len(corners)} corners")


def _ranges(points: Array, axes: Iterable[str], units: Iterable[str], digits: int) -> str:
    """Return in words the range of points along each axis."""
    ends = zip(axes, points.min(axis=0), points.max(axis=0), units, strict=True)
    return ", ".join(
        f"{axis} {low:z.{digits}f} to {high:z.{digits}f} {unit}" for axis, low, high, unit in ends
    )


def _print_section(section: replies.BodySectionReply, out: Console) -> None:
    """Print the size of a plane's part that is held."""
    plane = f"plane of {' and '.join(section.axes)}, {OTHER_COMPONENTS[section.others]}"
    if not section.inner or section.gap is None:
        out.print(f"{plane}: nothing is held")
        return
    corners = np.array(section.inner)
    ranges = _ranges(corners, section.axes, map(axis_unit, section.axes), 1)
    over = " (moments over 0.1 m)" if any(axis.startswith("m") for axis in section.axes) else ""
    shape = _shape_words(corners)
    out.print(f"{plane}: {shape}, {ranges}; known to {max(section.gap, 1e-3):.2g} N{over}")


def _print_accelerations(reply: BodySpaceReply, out: Console) -> None:
    """Print the largest accelerations, if the body may move."""
    if reply.acceleration is None:
        return
    rows = [(f"{axis} m/s²", one) for axis, one in reply.acceleration.items()]
    rows += [(f"{axis} rad/s²", one) for axis, one in (reply.angular_acceleration or {}).items()]
    for one in reply.along or ():
        where = ", ".join(f"{value:.3g}" for value in one.direction)
        rows.append((f"({where}) m/s²", one))
    largest = number("largest", "1.acceleration", "z.2f")
    title = "largest accelerations of the body from rest, in W"
    print_rows(rows, (name("along", "0"), largest, LIMIT_COLUMN), out, title)
