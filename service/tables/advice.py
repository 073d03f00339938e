"""What would make a stance hold, for a person: the best of it, a line each."""

from __future__ import annotations

from itertools import islice
from typing import Final

from rich.console import Console

from planner import Advice
from service.replies import PlanReply

__all__ = ["print_advice", "words_of"]

MOST: Final = 3
"""Changes shown; the best first."""


def words_of(advice: Advice, *, holding: bool = False) -> str:
    """Return what one change would do, of a stance that is ``holding`` already, or is not."""
    what = "would be better" if holding else "would hold" if advice.holds else "would help"
    return f"{what}, utilisation {advice.utilisation:.2f}: {advice.sentence}"


def print_advice(reply: PlanReply, out: Console) -> None:
    """Print what would make a plan's stance hold, or be better, where that was looked for."""
    holding = reply.status == "optimal"
    for advice in islice(reply.advice or (), MOST):
        out.print(words_of(advice, holding=holding), markup=False)
    doubtful = any(each.kind == "unit" for each in reply.findings)
    if reply.advice == [] and "advice" not in reply.unfinished and not doubtful:
        out.print("of all changes that were tried none would help")
