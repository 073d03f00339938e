"""Searches that begin at the plan of similar hands."""

from __future__ import annotations

import pytest

from hand_models.fixed_wrist import closed_about, scattered_places
from hand_models.hand import SettledHand
from planner.deadline import Budget
from planner.floating import least_use
from planner.prepare import prepare_stance
from service.answering import questions
from service.commands.stances import read_request
from tests.suite.helpers.stances import complying

PLACES = (9, 46, 8, 29)
"""Of the 64 places of each hand on `overhang`, of a combination that is overloaded. From the plan
of the given hands no step down to a smaller load ended in a balance."""


@pytest.mark.slow
def test_an_overloaded_stance_near_another_has_a_load_factor() -> None:
    prepared = prepare_stance(complying(questions.question(read_request("overhang"))))
    hand = prepared.question.stance.robot.hand
    usual, _ = least_use(prepared.hands, Budget(640))
    closed: list[SettledHand] = []
    for limb, own, at in zip(prepared.limbs, prepared.batch.hands, PLACES, strict=True):
        where = scattered_places(limb, 64, 0)[[at]]
        for found in closed_about(hand, own, where, hand.seat_scatter):
            closed += [each for each in found if isinstance(each, SettledHand)]
    moved = prepared.with_hands(closed)
    plan, most = least_use(moved.hands, Budget(640), usual)
    assert plan.exact
    assert plan.measure.utilisation > 1.0
    assert most is not None
    assert most.sure
    assert most.factor < 1.0
    # along the way that the load takes, its utilisation rises about in proportion
    assert most.factor * plan.measure.utilisation > 1.0 - 0.05
