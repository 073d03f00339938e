"""The load factor: how many times the body wrench could be held at utilisation 1."""

from __future__ import annotations

import numpy as np

from planner import deadline, programs
from planner.floating import NO_WRENCH, most_load
from planner.programs import SLACK
from planner.solving.answer import Answer

__all__ = ["find_load_factor"]


def find_load_factor(answer: Answer) -> None:
    """Find how many times the body wrench could be held, if it can be known."""
    if any(used.utilisation > 1.0 + SLACK for used in answer.idle):
        # a limb without a hand cannot bear itself, whatever the body needs
        return
    if not np.abs(answer.data.wrench[:6]).max() > NO_WRENCH:
        # nothing is asked of the hands: any multiple of it can be held, or none
        answer.unbounded = answer.outcome.solved and answer.outcome.value <= 1.0 + SLACK
        return
    if deadline.expired():
        answer.mind_time("load_factor")
        return
    if answer.least_used is not None:
        most = most_load(answer.parts, answer.least_used, answer.known_factor, answer.budget)
        if most is not None:
            answer.load_factor, answer.least_factor = most.factor, not most.sure
        else:
            answer.mind_time("load_factor")
        return
    result = programs.load_factor(answer.data)
    if not result.solved:
        answer.mind_time("load_factor")
    else:
        scaled = answer.data.turned(answer.parts.goal(result.value))
        error = programs.body_wrench(scaled, result.loads) - scaled.wrench
        used = max(
            float(np.max(hand.L @ (y / hand.unit) + hand.l0, initial=0.0))
            for hand, y in zip(answer.data.hands, result.loads, strict=True)
        )
        if np.abs(error).max() <= SLACK and used <= 1.0 + SLACK:
            answer.load_factor = max(result.value, 0.0)
