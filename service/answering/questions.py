"""Convert requests into the planner's questions and routes, and results of routes into replies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from msgspec import UNSET, structs

from hand_models.base import Array, InvalidInputError, errors_under
from hand_models.parameters import ParameterSample, own_draw
from planner import Load, Question
from service import requests
from service.answering.own_models import BUNDLED_ROBOTS, Robots
from service.answering.stances import (
    array_of,
    hands_on_rocks,
    joints_of,
    poses_of,
    stance,
    with_rocks,
)
from service.replies import ClimbFailureReply, KnotReply, RouteReply, RouteStageReply

if TYPE_CHECKING:
    from planner import Route, RouteStage

__all__ = ["climb", "question", "route_of", "stage_request"]


def question(request: requests.PlanRequest, robots: Robots = BUNDLED_ROBOTS) -> Question:
    """Convert a plan request into the planner's question.

    Parameters
    ----------
    request : PlanRequest
        Decoded request.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    Question
        Stance with hands closed on their holds, and load, limits, objective and extras.

    Raises
    ------
    InvalidInputError
        If a part of the request is impossible. The error's ``field`` is a path in the request.
    """
    if request.body_wrench is not None and request.load is not None:
        raise InvalidInputError("give body_wrench or load, not both", field="body_wrench")
    return Question(
        stance=stance(request.stance, robots),
        body_wrench=array_of(request.body_wrench),
        load=request.load or Load(),
        limits=request.limits,
        want=frozenset(
            [
                want
                for want in request.want
                if want != "redundancy" and want != "survival" and want != "com_region"
            ]
        ),
        objective=request.objective,
        present={limb: np.array(tensions) for limb, tensions in request.present.items()},
        deadline=request.deadline,
        draws=_draws(request.draws),
        explain=request.explain,
        body_range=request.body_range,
        open_loop=request.open_loop,
        tolerance=request.tolerance,
    )


def route_of(request: requests.RouteRequest, robots: Robots = BUNDLED_ROBOTS) -> Route:
    """Convert a route request into the planner's route: a start stance and a sequence of moves.

    Parameters
    ----------
    request : RouteRequest
        Decoded route file.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    Route
        Stances, load, limits and objective of the climb.

    Raises
    ------
    InvalidInputError
        If a part of the route is impossible. The error's ``field`` is a path in the route file.
    """
    from planner import Move, Route

    start, rocks = with_rocks(request.stance, robots)
    hands = hands_on_rocks(request.moves, start.robot.hand, rocks, "moves")
    places = [f"moves[{i}].body" for i in range(len(request.moves))]
    bodies = poses_of({at: each.body for at, each in zip(places, request.moves, strict=True)})
    angles = [joints_of(move.joints) or "solve" for move in request.moves]
    return Route(
        name=request.name,
        start=start,
        moves=tuple(map(Move, hands, map(bodies.get, places), angles)),
        load=request.load or Load(),
        limits=request.limits,
        objective=request.objective,
        explain=request.explain,
        want=frozenset(want for want in request.want if want != "trajectory"),
        draws=_draws(request.draws),
    )


def stage_request(
    request: requests.RouteRequest, stage: RouteStage, joints: Mapping[str, Array] | None = None
) -> requests.PlanRequest:
    """Return the plan request of one stage of a route, whose plan is that of the stage.

    Parameters
    ----------
    request : RouteRequest
        The route.
    stage : RouteStage
        A stage of that route.
    joints : mapping of str to ndarray, optional
        Joint angles of the limbs that were planned with [rad]. Without them those of the stage's
        question, which may be ``solve``.

    Returns
    -------
    PlanRequest
        Hands, holds, body, joints, load and limits of the stage; it wants the load factor.
    """
    hands, body = {hand.limb: hand for hand in request.stance.hands}, request.stance.body
    for number, move in enumerate(request.moves[: stage.move], start=1):
        body = move.body or body
        if number < stage.move or stage.phase == "place":
            fields = {name: getattr(move, name) for name in requests.Hand.__struct_fields__}
            hands[move.limb] = requests.Hand(**fields)
    asked = stage.question
    angles = asked.stance.joints if joints is None else joints
    stance = structs.replace(
        request.stance,
        hands=[hands[hand.limb] for hand in asked.stance.hands],
        body=body,
        joints=angles if angles is None or isinstance(angles, str) else _lists(angles),
    )
    return requests.PlanRequest(
        v=1,
        stance=stance,
        load=request.load,
        objective=request.objective,
        limits=asked.limits,
        explain=request.explain,
        want=["load_factor", *(want for want in request.want if want != "trajectory")],
        draws=request.draws,
    )


def _lists(
    angles: Mapping[str, Array | Literal["solve"]],
) -> dict[str, list[float] | Literal["solve"]]:
    return {limb: each if isinstance(each, str) else each.tolist() for limb, each in angles.items()}


def _draws(messages: Sequence[requests.Draw]) -> tuple[ParameterSample, ...] | None:
    """Return a caller's own draws; None for the bundled ones."""
    found = []
    for i, message in enumerate(messages):
        with errors_under(f"draws[{i}]"):
            found.append(own_draw({"hand": message.hand, "surfaces": message.surfaces}))
    return tuple(found) or None


def climb(request: requests.RouteRequest, robots: Robots = BUNDLED_ROBOTS) -> RouteReply:
    """Plan all stages of a route in this process, and return the reply with its hardest stage.

    Parameters
    ----------
    request : RouteRequest
        Start stance, moves, load and limits.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.

    Returns
    -------
    RouteReply
        Status and numbers of each stage, and the index of the crux, the hardest stage; if wanted,
        the trajectory, with whose joint angles the stages are planned.

    Raises
    ------
    InvalidInputError
        If the route is impossible. The error's ``field`` is a path in the request.
    """
    from planner import evaluate, plan_climb

    route = route_of(request, robots)
    found = plan_climb(route) if "trajectory" in request.want else None
    result = evaluate(route, workers=1, climb=found)
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
            RouteStageReply(
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
        trajectory=UNSET if found is None else [KnotReply.of(knot) for knot in found.knots],
        failure=UNSET if found is None else ClimbFailureReply.of(found.failure),
    )
