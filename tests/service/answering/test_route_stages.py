"""Stages of a route as plan requests of their own: the plan of each is that of the stage."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

import planner
from planner import evaluate
from service.answering import answer_plan, route_of, stage_request
from service.commands.stances import read_route
from service.requests import PlanRequest
from service.wire import decode_request
from tests.suite.helpers.climbs import climbed

EXACT = {"rtol": 0.0, "atol": 1e-9}


def asked_alone(request: PlanRequest) -> planner.Plan:
    """Plan what a stance file with this request asks for."""
    text = msgspec.json.encode(request)
    return answer_plan(decode_request(text, PlanRequest))


@pytest.mark.parametrize("index", range(6))
def test_a_stage_with_joints_is_planned_alike_alone(index):
    request, climb, result = climbed()
    stage, plan = result.stages[index], result.plans[index]
    reply = asked_alone(stage_request(request, stage))
    assert reply.status == plan.status == "optimal"
    assert [hand.limb for hand in reply.hands] == [hand.limb for hand in plan.hands]
    assert len(reply.hands) == (3 if stage.phase == "lift" else 4)
    assert np.isclose(reply.utilisation, plan.utilisation, **EXACT)
    assert np.isclose(reply.load_factor, plan.load_factor, **EXACT)
    for hand, other in zip(reply.hands, plan.hands, strict=True):
        assert np.allclose([each.tendon_tension for each in hand.fingers], other.tensions, **EXACT)
    (knot,) = (knot for knot in climb.knots if knot.stage == index)
    for limb, angles in knot.joints.items():
        assert np.allclose(reply.joints[limb], angles, **EXACT)
    # a knot is solved from the one before it: the same plan but for what a solver leaves
    near = {"rtol": 0.0, "atol": 1e-6}
    assert np.isclose(reply.utilisation, knot.utilisation, **near)
    loads = {hand.limb: hand for hand in reply.hands}
    for hand in knot.hands:
        if hand.on_rock:
            tensions = [each.tendon_tension for each in loads[hand.limb].fingers]
            assert np.allclose(tensions, hand.tensions, **near)


def test_stages_without_joints_keep_load_limits_and_caps():
    bundled = read_route("six-moves")
    limits = planner.Limits(
        utilisation=0.9, per_hand={"rear_left": planner.ForceCap(largest_force=900.0)}
    )
    load = planner.Load(mass=90.0, com=(0.02, 0.0, -0.03))
    request = msgspec.structs.replace(bundled, limits=limits, load=load)
    route = route_of(request)
    result = evaluate(replace(route, moves=route.moves[:4]))
    for stage, plan in zip(result.stages, result.plans, strict=True):
        reply = asked_alone(stage_request(request, stage))
        assert reply.status == plan.status
        assert np.isclose(reply.utilisation, plan.utilisation, **EXACT)
        for hand, other in zip(reply.hands, plan.hands, strict=True):
            tensions = [each.tendon_tension for each in hand.fingers]
            assert np.allclose(tensions, other.tensions, **EXACT)
