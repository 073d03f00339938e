"""Answer what slips mean: how likely a plan is to hold them, and which tile has slipped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

import planner
from hand_models.base import Array, InvalidInputError, errors_under
from planner import Plan
from service.answering.answers import placed_poses
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.questions import question
from service.replies import DiagnosisReply, PlanReply, SuspectReply
from service.requests import DiagnosisRequest, PlanRequest

__all__ = ["add_survival", "answer_diagnosis", "check_survival"]


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
    reply: PlanReply, asked: planner.Question, plan: Plan, settings: planner.SurvivalSettings
) -> None:
    """Add the survival of a plan to its reply, with the draws that the deadline leaves time for.

    Parameters
    ----------
    reply : PlanReply
    asked : Question
    plan : Plan
        The question's plan; without hands there is no survival.
    settings : SurvivalSettings

    Raises
    ------
    DeadlineError
        If the deadline leaves no time for any draw.
    """
    if plan.hands is None:
        return
    with errors_under("survival"):
        found = planner.find_survival(asked, plan.hands, settings)
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


def answer_diagnosis(request: DiagnosisRequest, robots: Robots = BUNDLED_ROBOTS) -> DiagnosisReply:
    """Find the tile that has probably slipped from a plan, by the data of motors.

    Parameters
    ----------
    request : DiagnosisRequest
        The plan's stance and load, and the data.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Raises
    ------
    InvalidInputError
        If the request is impossible, or nothing balances the body. The error's ``field`` is a path
        in the request.
    """
    planned = PlanRequest(
        v=1,
        stance=request.stance,
        body_wrench=request.body_wrench,
        load=request.load,
        objective=request.objective,
        tolerance=request.tolerance,
        limits=request.limits,
        explain=False,
    )
    asked = question(planned, robots)
    plan = planner.plan(asked)
    if plan.hands is None:
        raise InvalidInputError(
            f"there is no plan from which a tile could have slipped: {plan.reason}", field="stance"
        )
    diagnosis = planner.SlipDiagnosis(planner.prepare_stance(asked), plan.hands)
    found = diagnosis.diagnose(
        tensions=_arrays(request.tensions),
        currents=_arrays(request.currents),
        turns=_arrays(request.turns),
    )
    return DiagnosisReply(
        id=request.id,
        poses=placed_poses(asked.stance),
        seen=found.seen,
        tiles=[
            SuspectReply(
                limb=each.tile.limb,
                finger=each.tile.finger,
                phalanx=each.tile.phalanx,
                probability=each.probability,
                expected=each.expected,
            )
            for each in found.tiles
        ],
        suspects=list(found.suspects),
        ambiguous=[list(pair) for pair in diagnosis.ambiguous(held=not request.turns)],
        reason=found.reason,
    )


def _arrays(data: Mapping[str, Sequence[float]]) -> dict[str, Array]:
    return {limb: np.array(own) for limb, own in data.items()}
