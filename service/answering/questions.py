"""Convert requests into the planner's questions and routes, and results of routes into replies."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
from msgspec import UNSET, structs

from hand_models.base import Array, InvalidInputError, Pose, errors_under
from hand_models.parameters import ParameterSample, own_draw
from planner import HandOnHold, Load, Question
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
from service.replies import (
    ClimbFailureReply,
    KnotReply,
    PartReply,
    RouteReply,
    RouteStageReply,
)

if TYPE_CHECKING:
    from planner import Knot, Route, RouteResult, RouteStage

__all__ = [
    "KnotParts",
    "climb",
    "pose_of_request",
    "question",
    "route_of",
    "route_request",
    "stage_replies",
    "stage_request",
]


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
    end = poses_of({"end": request.end}).get("end")
    angles = [joints_of(move.joints) or "solve" for move in request.moves]
    return Route(
        name=request.name,
        start=start,
        moves=tuple(map(Move, hands, map(bodies.get, places), angles)),
        end=end,
        load=request.load or Load(),
        limits=request.limits,
        objective=request.objective,
        explain=request.explain,
        want=frozenset(want for want in request.want if want != "trajectory"),
        draws=_draws(request.draws),
    )


def route_request(asked: requests.ClimbRequest, route: Route) -> requests.RouteRequest:
    """Return the route that was found for a climb as a request, without the climb's rock.

    Parameters
    ----------
    asked : ClimbRequest
    route : Route
        All its hands are on that request's rock, with the pose of the rock in H.

    Returns
    -------
    RouteRequest
        Its hands name the rock ``rock``, which has to be put into ``stance.rocks``.
    """
    start, joints = route.start, route.start.joints
    stance = requests.StanceMessage(
        robot=asked.robot,
        hand=asked.hand,
        gravity=_vector(start.gravity),
        body=pose_of_request(start.body),
        joints=joints if joints is None or isinstance(joints, str) else _lists(joints),
        hands=[_hand(asked, hand) for hand in start.hands],
    )
    return requests.RouteRequest(
        v=1,
        name=route.name,
        stance=stance,
        objective=route.objective,
        limits=route.limits,
        moves=[
            requests.MoveMessage(
                **structs.asdict(_hand(asked, move.hand)),
                body=None if move.body is None else pose_of_request(move.body),
                joints="solve" if isinstance(move.joints, str) else _lists(move.joints),
            )
            for move in route.moves
        ],
        end=None if route.end is None else pose_of_request(route.end),
        explain=route.explain,
    )


def _hand(asked: requests.ClimbRequest, hand: HandOnHold) -> requests.Hand:
    """Return a hand of a request that is on the climb's rock."""
    assert hand.hold_in_hand is not None
    return requests.Hand(
        limb=hand.limb,
        pose=pose_of_request(hand.pose),
        hold=requests.RockReference(rock="rock", pose_in_hand=pose_of_request(hand.hold_in_hand)),
        surface=asked.surface,
        grasp=hand.grasp,
        wrist=hand.wrist,
        wrist_travel=hand.wrist_travel,
    )


def pose_of_request(pose: Pose) -> requests.PoseMessage:
    """Return a pose as a message."""
    x, y, z, w = pose.quaternion().tolist()
    return requests.PoseMessage(position=_vector(pose.position), orientation=(x, y, z, w))


def _vector(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


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
    if stage.move > len(request.moves):
        body = request.end or body
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


def stage_replies(result: RouteResult) -> list[RouteStageReply]:
    """Convert the plans of a route's stages into replies."""
    return [
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
    ]


class KnotParts:
    """Parts of an answer with the knots of a climb: at each call those that are new.

    Parameters
    ----------
    identifier : str or None
        ``id`` of the request.
    report : callable
        Takes each part.
    """

    def __init__(self, identifier: str | None, report: Callable[[PartReply], None]) -> None:
        self._identifier, self._report = identifier, report
        self._count = 0

    def __call__(self, knots: Sequence[Knot]) -> None:
        """Report the knots that were not there at the last call, if any."""
        new, self._count = knots[self._count :], len(knots)
        if new:
            self._report(PartReply(id=self._identifier, knots=[KnotReply.of(each) for each in new]))


def climb(
    request: requests.RouteRequest,
    robots: Robots = BUNDLED_ROBOTS,
    report: Callable[[PartReply], None] | None = None,
) -> RouteReply:
    """Plan all stages of a route in this process, and return the reply with its hardest stage.

    Parameters
    ----------
    request : RouteRequest
        Start stance, moves, load and limits.
    robots : Robots, optional
        Robots that a request may name, with the functions that build them; bundled robots by
        default.
    report : callable, optional
        Takes the parts of the answer that come before the reply, if the request asks for parts.

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

    route, found = route_of(request, robots), None
    parts = None if report is None or not request.parts else KnotParts(request.id, report)
    if "trajectory" in request.want:
        found = plan_climb(route, knots=parts)
        if parts is not None:
            parts(found.knots)
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
        stages=stage_replies(result),
        warnings=list(dict.fromkeys(text for p in result.plans for text in p.warnings)),
        trajectory=UNSET
        if found is None or parts is not None
        else [KnotReply.of(knot) for knot in found.knots],
        failure=UNSET if found is None else ClimbFailureReply.of(found.failure),
    )
