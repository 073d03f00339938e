"""What a stance can hold, as tables for a person."""

from __future__ import annotations

from typing import Final

import numpy as np
from rich.console import Console
from rich.markup import escape

from planner import COMPONENTS, OTHERS, LimitName
from service import replies
from service.replies import BodySpaceReply
from service.tables.layout import in_colour, show, table_of, unit_of

__all__ = ["print_body_space"]

FINEST: Final = 1e-3
"""A gap below this is told as this [N]."""


def print_body_space(reply: BodySpaceReply, out: Console) -> None:
    """Print what a stance can hold."""
    used = "" if reply.utilisation is None else f"   utilisation {reply.utilisation:.3f}"
    out.print(
        f"{in_colour(reply.status, reply.status.upper())}{used}   {1e3 * reply.time.total:.0f} ms"
    )
    out.print(reply.reason, markup=False)
    for warning in reply.warnings:
        out.print(f"[bold]warning:[/bold] {escape(warning)}")
    asked = ", ".join(
        f"{axis} {value:z.1f}" for axis, value in zip(COMPONENTS, reply.body_wrench, strict=True)
    )
    out.print(f"body wrench asked for (in B): {asked} [N, N·m]", markup=False)
    _print_capability(reply, out)
    _print_section(reply.section, out)
    _print_accelerations(reply, out)


def _print_capability(reply: BodySpaceReply, out: Console) -> None:
    table = table_of("axis", numbers=("more", "pure", "extent"), words=["first to let go"])
    for name, end in reply.capability.items():
        cells = [
            "-" if cell is None else f"{cell:z.1f}" for cell in (end.more, end.pure, end.extent)
        ]
        table.add_row(f"{name} {unit_of(name[1:])}", *cells, _words(end.limiting))
    show("how far body wrenches that are held go along the axes of B", table, out)
    out.print("more: beyond the body wrench asked for, and what lets go there first")
    out.print("pure: with every other component zero; extent: with whatever else; -: none")


def _print_section(section: replies.BodySection, out: Console) -> None:
    plane = f"plane of {' and '.join(section.axes)}, {OTHERS[section.others]}"
    if not section.inner or section.gap is None:
        out.print(f"{plane}: nothing is held", markup=False)
        return
    corners = np.array(section.inner)
    ranges = ", ".join(
        f"{axis} {low:z.1f} to {high:z.1f} {unit_of(axis)}"
        for axis, low, high in zip(
            section.axes, corners.min(axis=0), corners.max(axis=0), strict=True
        )
    )
    over = " (moments over 0.1 m)" if any(axis.startswith("m") for axis in section.axes) else ""
    shape = {1: "a point", 2: "a segment"}.get(len(corners), f"{len(corners)} corners")
    out.print(
        f"{plane}: {shape}, {ranges}; known to {max(section.gap, FINEST):.2g} N{over}", markup=False
    )


def _print_accelerations(reply: BodySpaceReply, out: Console) -> None:
    if reply.acceleration is None:
        return
    table = table_of("along", numbers=["largest"], words=["first to let go"])
    turning = reply.angular_acceleration or {}
    for unit, found in (("m/s²", reply.acceleration), ("rad/s²", turning)):
        for name, one in found.items():
            table.add_row(f"{name} {unit}", f"{one.acceleration:z.2f}", _words(one.limiting))
    for one in reply.along or ():
        where = ", ".join(f"{value:.3g}" for value in one.direction)
        table.add_row(f"({where}) m/s²", f"{one.acceleration:z.2f}", _words(one.limiting))
    show("largest accelerations of the body from rest, in W", table, out)


def _words(name: LimitName | None) -> str:
    if name is None:
        return "-"
    parts = (name.limb, name.joint, name.finger, name.phalanx, name.limit)
    return " ".join(part for part in parts if part is not None)
