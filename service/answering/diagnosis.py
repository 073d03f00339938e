"""Answer requests for the tile that has probably slipped."""

from __future__ import annotations

import numpy as np
from msgspec.structs import asdict

import planner
from hand_models.base import InvalidInputError
from service.answering.answers import placed_poses
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.questions import question
from service.replies import DiagnosisReply, SuspectReply
from service.requests import DiagnosisRequest, PlanRequest

__all__ = ["answer_diagnosis"]


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
    data = {
        kind: {limb: np.array(own) for limb, own in getattr(request, kind).items()}
        for kind in ("tensions", "currents", "turns")
    }
    found = diagnosis.diagnose(**data)
    return DiagnosisReply(
        id=request.id,
        poses=placed_poses(asked.stance),
        seen=found.seen,
        tiles=[
            SuspectReply(**asdict(each.tile), probability=each.probability, expected=each.expected)
            for each in found.tiles
        ],
        suspects=list(found.suspects),
        ambiguous=[list(pair) for pair in diagnosis.ambiguous(held=not request.turns)],
        reason=found.reason,
    )
