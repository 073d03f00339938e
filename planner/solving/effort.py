"""The plan of least effort within the cap on the utilisation."""

from __future__ import annotations

from planner import deadline, programs
from planner.floating import WristSolution, least_effort, with_room
from planner.programs import SLACK
from planner.solving.answer import Answer

__all__ = ["settle_effort"]


def settle_effort(answer: Answer) -> None:
    """Take the plan of least effort, if it is asked for and any is within the cap."""
    if answer.question.objective != "min_effort" or not answer.outcome.solved or answer.wrong:
        return
    cap = answer.question.limits.utilisation
    if answer.search is not None:
        _settle_floating_effort(answer, answer.search, cap)
        return
    if answer.outcome.value > cap + SLACK:
        return
    # where the least utilisation is the cap itself, rounding must not empty the set
    answer.cap = max(cap, answer.outcome.value + 0.5 * SLACK)
    found = programs.effort(answer.data, answer.cap)
    if not found.solved and deadline.expired():
        answer.mind_time("least_effort")
        return
    answer.least_effort = found
    if answer.least_effort.solved:
        answer.take(answer.least_effort.loads)
    else:
        answer.wrong = [f"least effort: {answer.least_effort.status}"]


def _settle_floating_effort(answer: Answer, plan: WristSolution, cap: float) -> None:
    """Take the plan of least effort that floating wrists come to from that of least use."""
    used = plan.measure.utilisation
    if used > cap + SLACK:
        return
    answer.cap = with_room(cap, used)
    found = least_effort(answer.parts, plan, answer.cap, answer.budget)
    answer.mind_time("least_effort")
    if not found.outcome.solved and deadline.expired():
        return
    answer.least_effort = found.outcome if found.outcome.solved else None
    answer.take_search(found)
