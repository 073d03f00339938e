"""What would make a stance hold, for a person: the best of it, a line each."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice
from typing import Final

from rich.console import Console

from planner import Advice

__all__ = ["print_advice"]

MOST: Final = 3
"""Changes shown; the best first."""


def print_advice(told: Iterable[Advice], out: Console, *, holding: bool = False) -> None:
    """Print what would make a stance hold, or be better where it is ``holding`` already."""
    for advice in islice(told, MOST):
        what = "would be better" if holding else "would hold" if advice.holds else "would help"
        out.print(f"{what}, utilisation {advice.utilisation:.2f}: {advice.sentence}", markup=False)
