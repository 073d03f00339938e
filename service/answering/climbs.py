"""Climbs: a route's request in, what every stage of it comes to out."""

from __future__ import annotations

from planner import evaluate
from service.answering.own_models import ROBOTS, Robots
from service.answering.questions import route
from service.replies import RouteReply, RouteStage
from service.requests import RouteRequest

__all__ = ["climb"]


def climb(request: RouteRequest, robots: Robots = ROBOTS) -> RouteReply:
    """Answer a route, in this process alone.

    Parameters
    ----------
    request : RouteRequest
    robots : Robots, optional
        Those that may be asked about.

    Raises
    ------
    InvalidInputError
        If the route is impossible; the field is relative to it.
    """
    result = evaluate(route(request, robots), workers=1)
    crux = result.plans[result.crux]
    return RouteReply(
        id=request.id,
        name=request.name,
        status=result.status,
        crux=result.crux,
        utilisation=crux.utilisation,
        load_factor=result.load_factor,
        load_factor_unbounded=result.load_factor_unbounded,
        load_factor_status=result.load_factor_status,
        limiting=crux.limiting,
        stages=[
            RouteStage(
                move=stage.move,
                phase=stage.phase,
                limb=stage.limb,
                status=plan.status,
                utilisation=plan.utilisation,
                load_factor=plan.load_factor,
                load_factor_unbounded=plan.load_factor_unbounded,
                load_factor_status=plan.load_factor_status,
                joint_utilisation=plan.joint_utilisation,
                limiting=plan.limiting,
                reason=plan.reason,
            )
            for stage, plan in zip(result.stages, result.plans, strict=True)
        ],
        warnings=list(dict.fromkeys(text for p in result.plans for text in p.warnings)),
    )
