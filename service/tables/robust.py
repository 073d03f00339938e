"""What is left of a hand where it is a little elsewhere, as a table."""

from __future__ import annotations

from rich.console import Console

from service.replies import AXES, RobustCapability
from service.tables.plans import table_of, unit_of

__all__ = ["print_robust"]


def print_robust(robust: RobustCapability, out: Console) -> None:
    """Print what is left of each component where the hand is a little elsewhere."""
    numbers = ("worst least", "worst most", "9 in 10 least", "9 in 10 most")
    table = table_of("axis", numbers=numbers)
    for axis in AXES:
        ends = [(way[f"-{axis}"], way[f"+{axis}"]) for way in (robust.worst, robust.tenth)]
        cells = [
            "-" if end is None else f"{sign * end:z.2f}"
            for pair in ends
            for sign, end in zip((-1.0, 1.0), pair, strict=True)
        ]
        table.add_row(f"{axis} {unit_of(axis)}", *cells)
    out.print(
        f"\n[bold]what is left of that at {robust.draws - robust.without} of {robust.draws} places "
        f"within {1e3 * robust.position:g} mm and {1e3 * robust.angle:g} mrad[/bold]"
    )
    out.print(table)
    if robust.without:
        out.print(f"at {robust.without} of them the hand cannot be, or holds nothing")
