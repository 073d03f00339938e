"""Least distances as a table for a person."""

from __future__ import annotations

from rich.console import Console

from planner import Clearance, Distance
from service.tables.layout import show, table_of

__all__ = ["print_clearance"]


def print_clearance(clearance: Clearance, out: Console) -> None:
    """Print the least distances, and what was not measured."""
    table = table_of("", numbers=["mm"], words=["between", "and"])
    for name in ("link_rock", "link_link", "hand_hand", "hand_body", "body_rock"):
        near: Distance | None = getattr(clearance, name)
        if near is not None:
            table.add_row(name.replace("_", " "), f"{1e3 * near.distance:.0f}", *near.between)
    show("least distances; below zero: how deep one is in the other", table, out)
    for missing in clearance.unchecked:
        out.print(f"not measured: {missing}", markup=False)
