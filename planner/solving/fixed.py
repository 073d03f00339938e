"""The plan of hands with fixed wrists: least utilisation, of that the least tensions."""

from __future__ import annotations

from planner import deadline, programs
from planner.deadline import Overlap
from planner.solving.answer import Answer
from planner.solving.unique_plan import LeastUtilisation, least_utilisation

__all__ = ["settle_fixed", "settle_in_two"]


def settle_fixed(answer: Answer) -> None:
    """Take the plan of least utilisation, of these that of least tensions.

    One solve has its utilisation, and mostly its active rows, which give its last digits; else
    a second solve has these.
    """
    found = _least(answer)
    answer.outcome = found.outcome
    if found.proven:
        answer.bound = found.bound
        if found.loads is None:
            _settle_tie(answer)
        else:
            answer.take(found.loads)
        if not answer.wrong:
            return
    one, bound = answer.outcome, answer.bound
    settle_in_two(answer)
    if one.solved and not answer.outcome.solved and deadline.expired():
        answer.outcome, answer.bound = one, bound
        answer.take(one.loads)
        answer.mind_time("least_utilisation")


def _least(answer: Answer) -> LeastUtilisation:
    """Solve, and prepare meanwhile what reads and checks the loads."""
    if answer.ready is not None:
        return least_utilisation(answer.data)
    with Overlap(answer.prepare) as answer.preparing:
        return least_utilisation(answer.data)


def settle_in_two(answer: Answer) -> None:
    """Take the plan of least effort among those of the very least utilisation."""
    answer.outcome, answer.bound = programs.margin(answer.data), None
    _settle_tie(answer)


def _settle_tie(answer: Answer) -> None:
    """Take the plan of least tensions among those of least utilisation."""
    if not answer.outcome.solved:
        return
    tidy = programs.least_tensions(answer.data, answer.outcome.value)
    if tidy.solved:
        answer.take(tidy.loads)
    else:
        answer.mind_time("tie_break")
    if not tidy.solved or answer.wrong:
        answer.take(answer.outcome.loads)
