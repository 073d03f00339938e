"""What a plan says of palms that carry without the travel of their wrists."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from msgspec import structs

from hand_models.tendon import share_load
from planner.explanation import PALM_WITHOUT_TRAVEL
from planner.prepare import settle_hand
from planner.result import Finding, Plan
from planner.solving import KnownStance, plan
from service.answering.questions import question
from service.commands.stances import read_request
from service.requests import PlanRequest
from tests.suite.helpers.stances import ask, on_wall
from tests.suite.problems import problem


def palms_in(answer: Plan) -> list[Finding]:
    return [each for each in answer.findings if each.kind == PALM_WITHOUT_TRAVEL]


def lacks(hand, settled) -> float:
    """Travel that a palm lacks, from what the plan says and the hand's own numbers [m]."""
    body, engaged = settled.hand, list(settled.palm.engaged)
    assert all(share == 1.0 for share in settled.palm.engagement) or len(settled.palm.layers) > 1
    springs = sum(
        share
        * share_load(
            tuple(body.palm_contact[i] for i in tiles),
            body.palm_spring,
            body.palm_friction,
            body.palm_own_friction,
        ).tile_stiffness.sum()
        for share, tiles in settled.palm.layers
    )
    gap = settled.palm.gaps[engaged].min() if hand.palm.force[2] > 1.0 else 0.0
    return max(-hand.palm.force[0] / springs, gap)


@pytest.mark.parametrize("name", ["wall-300", "overhang"])
def test_the_hand_that_lacks_most_travel_is_named_with_the_millimetres(name):
    asked = question(read_request(name))
    answer = plan(asked)
    (found,) = palms_in(answer)
    each = [
        lacks(hand, settle_hand(place, asked.stance))
        for hand, place in zip(answer.hands, asked.stance.hands, strict=True)
    ]
    assert found.value == pytest.approx(max(each), rel=1e-9)
    worst = int(found.field.removeprefix("stance.hands[").removesuffix("].wrist"))
    assert each[worst] == pytest.approx(max(each), abs=1e-6)
    assert found.message.startswith(f"{asked.stance.hands[worst].limb}: ")
    assert found.message in answer.warnings
    assert found.unit == "m"
    assert "and 3 other hands alike" in found.message
    assert "'wrist': 'compliant'" in found.message


def test_of_wall_300_it_is_what_the_facts_say():
    (found,) = palms_in(plan(question(read_request("wall-300"))))
    assert found.value == pytest.approx(6.5e-3, abs=5e-5)
    assert "103 N of shear, which needs 6.5 mm of travel" in found.message
    assert "228 N of pressing across a gap of 2.6 mm" in found.message


def test_without_palms_or_with_wrists_that_move_there_is_none():
    assert not palms_in(plan(ask(on_wall(palm=False))))
    asked = question(read_request("wall-300"))
    hands = tuple(replace(hand, wrist="compliant") for hand in asked.stance.hands)
    moving = replace(asked, stance=replace(asked.stance, hands=hands))
    assert not palms_in(plan(moving))


def test_less_than_a_millimetre_is_not_worth_a_word():
    asked = question(read_request("wall-300"))
    light = structs.replace(asked.load, mass=1.0)
    answer = plan(replace(asked, load=light))
    each = [
        lacks(hand, settle_hand(place, asked.stance))
        for hand, place in zip(answer.hands, asked.stance.hands, strict=True)
    ]
    assert max(each) < 1e-3
    assert not palms_in(answer)


def test_hands_on_their_nails_are_not_sent_to_compliant_wrists():
    request = msgspec.convert(problem("nails/nails-on-plane").request, PlanRequest)
    asked = question(request)
    (found,) = palms_in(plan(asked))
    worst = next(h for h in asked.stance.hands if found.message.startswith(h.limb))
    assert worst.grasp.fingernail
    assert "compliant" not in found.message


def test_a_known_stance_says_it_of_each_wrench():
    asked = question(read_request("wall-300"))
    answer = plan(asked)
    known = KnownStance(asked)
    assert known.plan(answer.body_wrench).findings == answer.findings
    (less,) = palms_in(known.plan(0.9 * np.asarray(answer.body_wrench)))
    assert less.value != palms_in(answer)[0].value
