"""Survival of a climb: a hand that stays keeps its strengths, and one that is placed draws anew."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner import (
    Move,
    RouteResult,
    RouteSurvival,
    SurvivalSettings,
    evaluate,
    find_route_survival,
    find_survival,
    hand_space,
)
from planner.route import OutOfReach
from service.answering import questions
from service.commands.stances import read_route

FEW = SurvivalSettings(draws=100, replanned=0, strength=1.3)


@cache
def climbed() -> RouteResult:
    """A climb of one move, which puts a hand on the hold that it had, with the body where it is."""
    route = questions.route_of(read_route("six-moves"))
    hand = next(each for each in route.start.hands if each.limb == "front_left")
    return evaluate(replace(route, moves=(Move(hand, body=route.start.body),), explain=False))


@cache
def survival() -> RouteSurvival:
    return find_route_survival(climbed(), FEW, workers=1)


@pytest.mark.slow
def test_a_hand_that_stays_keeps_its_strengths():
    start, shift, _, place = (stage.survival for stage in survival().stages)
    assert start == shift
    # the same plan, but one hand is on a new hold
    assert start.no_slip == pytest.approx(place.no_slip, abs=1e-9)
    assert start.first != place.first


def test_no_slip_of_a_climb_is_worked_by_hand():
    settings = SurvivalSettings(draws=1, replanned=0, hold_scatter=0.0, rock_scatter=0.0)
    found = find_route_survival(climbed(), settings, workers=1)
    law = found.stages[0].survival.surfaces[0]
    result, used = climbed(), {}
    for i in (0, 2, 3):
        for hand in result.plans[i].hands:
            on = [tile.contact in ("face", "edge") for tile in hand.tiles]
            key = hand.limb, i == 3 and hand.limb == "front_left"
            settled, _ = hand_space(result.stages[i].question.stance, hand.limb)
            # a shear of the whole palm counts as that of one tile
            palm = -hand.palm.force[0] / settled.palm.shear_limit
            own = np.array([*(hand.tile_utilisations * on), palm])
            used[key] = np.maximum(used.get(key, own), own)
    assert len(used) == 5
    unit = math.gamma(1.0 + 1.0 / law.modulus) / law.mean
    hazard = sum(float(((np.maximum(u, 0.0) * unit) ** law.modulus).sum()) for u in used.values())
    assert found.no_slip == pytest.approx(math.exp(-hazard), rel=1e-9)


def test_the_climb_lies_between_its_worst_stage_and_stages_that_draw_anew():
    found = survival()
    alone = [stage.survival for stage in found.stages]
    assert math.prod(each.no_slip for each in alone) < found.no_slip
    assert found.no_slip < min(each.no_slip for each in alone)
    shares = [each.holds.probability for each in alone]
    assert found.holds.least == min(shares) < 1.0
    assert found.holds.product == pytest.approx(math.prod(shares))
    assert found.holds.product <= found.holds.all_stages.probability <= found.holds.least
    assert found.holds.all_stages.draws == FEW.draws
    assert found.worst == 2
    assert found.stages[2].phase == "lift"
    assert found.replanned is found.reason is None


def test_a_climb_of_one_stage_is_its_stance():
    result = climbed()
    route = replace(result.route, moves=())
    alone = RouteResult(route, result.stages[:1], result.plans[:1])
    several = SurvivalSettings(draws=800, replanned=0, strength=1.3)
    found = find_route_survival(alone, several, workers=1)
    stance = find_survival(result.stages[0].question, result.plans[0].hands, several)
    assert found.no_slip == pytest.approx(stance.no_slip, rel=1e-12)
    assert found.strength_99 == pytest.approx(stance.strength_99, rel=1e-12)
    share, other = found.stages[0].survival.holds, stance.holds
    # own draws of the same distribution: apart by four deviations at most
    deviation = math.sqrt(2.0 * other.probability * (1.0 - other.probability) / 800)
    assert abs(share.probability - other.probability) < 4.0 * deviation
    assert found.holds.all_stages == share


@pytest.mark.slow
def test_processes_find_the_same():
    done: list[tuple[int, int]] = []
    found = find_route_survival(climbed(), FEW, 2, lambda *each: done.append(each))
    assert found == survival()
    assert done == [(i, 4) for i in range(1, 5)]


def test_a_climb_with_a_stage_that_has_no_plan_says_so():
    result = climbed()
    far = (*result.plans[:2], OutOfReach("rear_left does not reach its hold"), result.plans[3])
    found = find_route_survival(replace(result, plans=far), FEW, workers=1)
    assert found.status == "unreachable"
    assert found.holds is found.no_slip is None
    without = [stage.index for stage in found.stages if stage.survival is None]
    assert without == [2]
    assert found.worst == 2
    assert found.reason == "stage 2 has no plan"
