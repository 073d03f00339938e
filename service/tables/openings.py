"""Print how a hand lets go of its hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from service.replies import WRENCH_AXES, OpeningReply
from service.tables.layout import axis_unit, in_order, name, number, print_rows

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["print_opening"]


def print_opening(opening: OpeningReply, out: Console) -> None:
    """Print the knots of a hand that opens, the tiles that let go, jams, and the retreat.

    Parameters
    ----------
    opening : OpeningReply
    out : Console
        Console to print on.
    """
    heads = [f"{axis} {axis_unit(axis)}" for axis in WRENCH_AXES]
    rows = [(f"{knot.tensions[0]:.2f}", *knot.wrench) for knot in opening.knots]
    title = "wrench on the rock, in H, as all tendons are lowered"
    print_rows(rows, in_order(["tension N"], heads, form="z.2f"), out, title)
    if opening.events:
        columns = (name("finger"), name("phalanx"), number("tension N", "tension", "z.2f"))
        print_rows(opening.events, columns, out, "tiles let go in this order")
    for jam in opening.jammed:
        out.print(f"jammed: {jam.reason}")
    if opening.resting:
        names = ", ".join(opening.resting)
        out.print(f"at zero tension springs press these fingers on the rock: {names}")
    out.print(f"spines let go below {opening.friction:.3g} N of shear for a newton of pull")
    if opening.retreat is None:
        out.print("no retreat by a finger's length clears the straight fingers of the rock")
    elif opening.retreat == 0.0:
        out.print("straight fingers are clear of the rock without a retreat")
    else:
        far = 1e3 * opening.retreat
        out.print(f"straight fingers are clear of the rock after a retreat of {far:.1f} mm")
