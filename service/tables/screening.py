"""Print stances that were screened, ranked by load factor, and give them as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from planner import Screened
from service.tables.command_line import note
from service.tables.layout import name, number, print_rows

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["note_faults", "print_screening", "screening_json"]


def print_screening(found: Screened, names: Sequence[str], out: Console) -> None:
    """Print the best stances as a table, and how many programs were solved.

    Parameters
    ----------
    found : Screened
    names : sequence of str
        Name of each candidate.
    out : Console
        Console to print on.
    """
    shown = 20  # rows: the others are in the JSON
    rows = [row for row in _rows(found, names) if row["fault"] is None]
    columns = (
        name("stance", "candidate"),
        number("load factor", "load_factor", ".4f"),
        number("at most", "bound", ".4f"),
        number("utilisation", "utilisation", ".4f"),
    )
    left = len(rows) - shown
    legend = [f"and {left} more, whose bounds are lower; --json has all"] if left > 0 else []
    print_rows(rows[:shown], columns, out, legend=legend)
    solved = f"{found.programs} of {len(names)} stances needed a program"
    out.print(f"{solved}; bounds rest on {found.directions} directions")
    if not len(found.best):
        out.print("no stance has a load factor")
    elif found.proven:
        first = int(found.best[0])
        factor = found.load_factors[first]
        out.print(f"{names[first]} is the best: no other has a load factor above {factor:.4f}")
    else:
        out.print(f"not proven: another may have a load factor larger by {found.gap:.4f}")


def screening_json(
    found: Screened, names: Sequence[str], wrong: Mapping[str, str]
) -> dict[str, Any]:
    """Return what was found as JSON has it, stances ranked, best first.

    Parameters
    ----------
    found : Screened
    names : sequence of str
        Name of each candidate.
    wrong : mapping of str to str
        What is wrong with stances that cannot be planned, by name.
    """
    return {
        "v": 1,
        "candidates": len(set(names) | set(wrong)),
        "programs": found.programs,
        "directions": found.directions,
        "best": [names[i] for i in found.best.tolist()],
        "proven": bool(found.proven),
        "ranking": [row for row in _rows(found, names) if row["fault"] is None],
        "faults": dict(wrong),
    }


def note_faults(wrong: Mapping[str, str]) -> None:
    """Say on standard error which stance cannot be planned, and how many more there are."""
    if wrong:
        first, why = next(iter(wrong.items()))
        more = f"; {len(wrong) - 1} more cannot be planned" if len(wrong) > 1 else ""
        note(f"{first}: {why}{more}")


def _rows(found: Screened, names: Sequence[str]) -> list[dict[str, Any]]:
    return [
        {
            "candidate": names[i],
            "load_factor": _finite(found.load_factors[i]),
            "bound": _finite(found.bounds[i]),
            "utilisation": _finite(found.utilisations[i]),
            "fault": found.faults.get(i),
        }
        for i in found.order.tolist()
    ]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
