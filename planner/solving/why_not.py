"""Why there is no plan, or none within the cap: the proof, or another try."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from planner import programs
from planner.explanation import certify, certify_idle
from planner.programs import SLACK, Outcome
from planner.result import Certificate
from planner.solving.answer import Answer
from planner.solving.effort import settle_effort
from planner.solving.fixed import settle_in_two

__all__ = ["look_again", "overload"]


BALANCED: Final = 1e-7
"""Distance to the nearest body wrench, relative, below which rounding alone is to blame."""


def look_again(answer: Answer) -> None:
    """Tell no balance at all from a solver that failed."""
    nearest = programs.nearest(answer.data)
    far = BALANCED * max(1.0, float(np.linalg.norm(answer.data.wrench)))
    if not nearest.solved or nearest.value > far:
        given = len(answer.data.wrench) > len(answer.wrench)
        if not answer.held_floating:
            answer.certificate = _certify(answer, None, None if given else nearest)
        if answer.certificate is not None:
            answer.mind_explained(answer.certificate)
            answer.outcome = replace(answer.outcome, solved=False)
    elif not answer.outcome.solved and not answer.parts.floating:
        # rounding put the wrench a hair outside: plan for the nearest that can be had
        inside = programs.body_wrench(answer.data, nearest.loads)
        answer.data = answer.data.turned(inside)
        settle_in_two(answer)
        settle_effort(answer)


def _certify(
    answer: Answer, cap: float | None, nearest: Outcome | None = None
) -> Certificate | None:
    """Return the proof that there is no plan: at any utilisation, or within a cap."""
    held, limits = answer.parts.held, answer.question.limits
    stance = answer.data, answer.limbs, answer.spaces, held, limits
    return certify(*stance, cap, nearest=nearest, known=answer.outcome)


def overload(answer: Answer) -> Certificate | None:
    """Return the proof that no plan keeps to the cap on the utilisation; None without one.

    Of floating hands with their sets linearised at the plan.
    """
    cap = answer.question.limits.utilisation
    most = max(answer.idle, key=lambda used: used.utilisation, default=None)
    beyond = [used for used in answer.idle if used.utilisation > cap + SLACK]
    if most is not None and beyond and most.utilisation >= answer.utilisation:
        alone: bool | None = len(beyond) == 1
        if answer.utilisation > cap + SLACK:
            alone = None if answer.unproven else False
        return certify_idle(most, cap, alone)
    if answer.unproven:
        return None
    proof = _certify(answer, cap)
    # what a limb without a hand cannot bear stays in the way, whatever is taken from the hands
    return replace(proof, sufficient=()) if proof is not None and beyond else proof
