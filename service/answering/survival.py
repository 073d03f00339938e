"""Add to the reply of a plan how likely it is to hold while tiles slip."""

from __future__ import annotations

import planner
from hand_models.base import InvalidInputError, errors_under
from planner import DeadlineError, Plan
from service.replies import PlanReply
from service.requests import PlanRequest

__all__ = ["add_survival", "check_survival"]


def check_survival(request: PlanRequest) -> None:
    """Refuse draws of strengths that nobody wants.

    Raises
    ------
    InvalidInputError
        If the request has ``survival`` but does not want it.
    """
    if request.survival is not None and "survival" not in request.want:
        raise InvalidInputError(
            "requires 'survival' in want; add it, or remove survival", field="survival"
        )


def add_survival(
    reply: PlanReply, question: planner.Question, plan: Plan, settings: planner.SurvivalSettings
) -> None:
    """Add the survival of a plan to its reply, with the draws that the deadline leaves time for.

    Parameters
    ----------
    reply : PlanReply
    question : Question
    plan : Plan
        The question's plan; without hands there is no survival.
    settings : SurvivalSettings
    """
    if plan.hands is None:
        return
    try:
        with errors_under("survival"):
            found = planner.find_survival(question, plan.hands, settings)
    except DeadlineError as error:
        reply.unfinished.append("survival")
        reply.warnings.append(planner.deadline.late_sentence(error.seconds, ("survival",)))
        return
    reply.survival, reply.survival_probability = found, found.no_slip
    fixed, anew = (0 if each is None else each.draws for each in (found.holds, found.replanned))
    if found.reason is None and (fixed < settings.draws or anew < settings.replanned):
        reply.unfinished.append("survival")
        late = planner.deadline.late_sentence(planner.deadline.seconds() or 0.0, ("survival",))
        reply.warnings.append(
            f"{late}: {fixed} of {settings.draws} at fixed tensions, {anew} of "
            f"{settings.replanned} with new set-points"
        )
    if found.tail is not None:
        reply.warnings.append(found.tail)
