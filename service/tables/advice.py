"""What would make a stance hold, for a person: the best of it, a line each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

from planner.result import Advice

__all__ = ["advice_lines"]

MOST: Final = 3
"""Changes shown; the best first."""


def advice_lines(told: Iterable[Advice]) -> Iterator[str]:
    """Yield what would make a stance hold, or hold more."""
    for advice in islice(told, MOST):
        what = "would hold" if advice.holds else "would help"
        yield f"{what}, utilisation {advice.utilisation:.2f}: {advice.sentence}"
