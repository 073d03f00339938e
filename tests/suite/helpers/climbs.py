"""A climb of two moves with joints, and knots made by hand of the plans of its stages."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import msgspec
import numpy as np

from hand_models.base import Pose
from planner import Climb, HandKnot, Knot, Plan, RouteResult, RouteStage, evaluate
from service.answering import route_of
from service.commands.stances import read_route
from service.requests import RouteRequest


class Climbed(NamedTuple):
    """A route as it is asked for, its stages' plans, and knots of them."""

    request: RouteRequest
    result: RouteResult
    climb: Climb


def two_moves() -> RouteRequest:
    """Return a route: one hand moves, then the body shifts, and another hand moves."""
    bundled = read_route("six-moves")
    start = msgspec.structs.replace(bundled.stance, joints="solve")
    move = msgspec.convert(msgspec.to_builtins(bundled.moves[2]), type(bundled.moves[2]))
    hand = next(each for each in start.hands if each.limb == "front_right")
    second = msgspec.structs.replace(
        move, pose=_raised(hand.pose, 0.03), hold=hand.hold, body=_raised(start.body, 0.01)
    )
    return msgspec.structs.replace(bundled, stance=start, moves=[bundled.moves[0], second])


def _raised(pose, by: float):
    x, y, z = pose.position
    return msgspec.structs.replace(pose, position=(x, y, z + by))


@cache
def climbed() -> Climbed:
    """Plan the stages of the two moves, with a knot at each and one in the middle of each swing."""
    request = two_moves()
    route = route_of(request)
    result = evaluate(route)
    knots: list[Knot] = []
    for stage, plan in zip(result.stages, result.plans, strict=True):
        assert isinstance(plan, Plan)
        knot = _knot(stage, plan, knots)
        if stage.phase == "place":
            knots.append(_swing(knots[-1], knot))
            knot = replace(knot, index=knot.index + 1)
        knots.append(knot)
    return Climbed(request, result, Climb(route, tuple(knots)))


def _knot(stage: RouteStage, plan: Plan, before: list[Knot]) -> Knot:
    phase = {"start": "start", "shift": "shift", "lift": "open", "place": "load"}[stage.phase]
    return Knot(
        index=len(before),
        move=stage.move,
        phase=phase,
        limb=stage.limb,
        stage=stage.index,
        time=2.0 * stage.index,
        body=stage.question.stance.body,
        joints=plan.joints,
        joint_torque=plan.joint_torque,
        hands=tuple(_hands(stage, plan, before)),
        utilisation=plan.utilisation,
        bound=max(plan.utilisation, before[-1].utilisation) if before else None,
        limiting=plan.limiting,
        verified=plan.verified,
    )


def _hands(stage: RouteStage, plan: Plan, before: list[Knot]):
    poses = {hand.limb: hand.pose for hand in stage.question.stance.hands}
    loads = {hand.limb: hand for hand in plan.hands}
    last = {hand.limb: hand for hand in before[-1].hands} if before else {}
    for limb in last or poses:
        if limb in loads:
            hand = loads[limb]
            yield HandKnot(
                limb=limb,
                pose=poses[limb],
                on_rock=True,
                tensions=hand.tensions,
                winch_angles=hand.drives[2],
                wrench=hand.wrench,
            )
        else:
            off = last[limb].pose.apply([0.0, 0.0, -0.05])
            pose = Pose(off, last[limb].pose.rotation)
            yield HandKnot(
                limb=limb,
                pose=pose,
                on_rock=False,
                tensions=np.zeros(4),
                winch_angles=np.zeros(4),
                wrench=np.zeros(6),
            )


def _swing(start: Knot, end: Knot) -> Knot:
    """Return a knot between two with the tensions of the first, the hand away from the rock."""
    hands = tuple(
        hand
        if hand.on_rock
        else replace(
            hand,
            pose=Pose(
                (hand.pose.position + other.pose.position) / 2.0 - [0.05, 0.0, 0.0],
                hand.pose.rotation,
            ),
        )
        for hand, other in zip(start.hands, end.hands, strict=True)
    )
    joints = {limb: (start.joints[limb] + end.joints[limb]) / 2.0 for limb in start.joints}
    return replace(
        start,
        index=start.index + 1,
        phase="swing",
        stage=None,
        time=(start.time + end.time) / 2.0,
        joints=joints,
        hands=hands,
        bound=start.utilisation,
    )
