"""The plan where wrists float: where they go, and what the hands carry there."""

from __future__ import annotations

from planner.floating import least_use
from planner.solving.answer import Answer

__all__ = ["settle_floating"]


def settle_floating(answer: Answer) -> None:
    """Find where floating wrists go, and take the plan there."""
    answer.search, answer.known_factor = least_use(answer.parts, answer.budget)
    answer.least_used = answer.search
    answer.mind_time("wrists")
    answer.outcome = answer.search.outcome
    if answer.search.exact:
        answer.take_search(answer.search)
    else:
        answer.spaces, answer.data = answer.parts.sets(answer.search.point)
