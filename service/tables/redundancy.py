"""Print what a stance can lose, as a table of fingers and tiles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import Loss, Redundancy
from service.tables.layout import name, number, print_rows

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["print_redundancy"]


def print_redundancy(redundancy: Redundancy, out: Console, *, holds: bool) -> None:
    """Print the utilisation with all parts, without each of them, and the worst of each kind.

    Parameters
    ----------
    redundancy : Redundancy
    out : Console
        Console to print on.
    holds : bool
        Whether the stance with all parts has a plan within the cap on the utilisation.
    """
    used = redundancy.utilisation
    said = "no plan" if used is None else f"utilisation {used:.3f}"
    beyond = "" if holds or used is None else ", beyond the cap already"
    out.print(f"with all parts: {said}{beyond}")
    rows: dict[tuple[str, str], dict[str, str]] = {}
    for loss in redundancy.losses:
        row = rows.setdefault((loss.limb, loss.finger or "all fingers, palm"), {})
        row[loss.phalanx or "whole"] = _used(loss)
    heads = ("base", "proximal", "middle", "distal", "whole")
    shown = [
        {"hand": limb, "finger": finger} | dict.fromkeys(heads) | row
        for limb in dict.fromkeys(limb for limb, _ in rows)
        for (at, finger), row in rows.items()
        if at == limb
    ]
    columns = [name("hand"), name("finger"), *map(number, heads)]
    print_rows(shown, columns, out, "utilisation without a part; * no plan within the cap")
    for sentence in redundancy.sentences:
        out.print(sentence)


def _used(loss: Loss) -> str:
    """Return the utilisation without a part, with a star if it is beyond the cap."""
    if loss.utilisation is None:
        return "none*"
    return f"{loss.utilisation:.3f}" + ("" if loss.holds else "*")
