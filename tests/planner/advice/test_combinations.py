"""Which changes together make a stance hold: directions leave out what does not hold, only that."""

from __future__ import annotations

import pytest
from msgspec import convert

from planner import advice
from planner.advice import changed
from planner.advice.changes import SETTINGS
from planner.advice.combinations import CombinationSearch
from planner.advice.trials import Trials
from planner.solving import plan as planned, try_stance
from service import answering
from service.answering import advised, question
from service.requests import PlanRequest
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.stances import random_question

GIVEN, OWN = 45, 154
"""Seeds of a stance under a wrench that is given, and of one that is far overloaded by itself."""

ALONE = 376
"""Seed of a request with a single hand that all others help."""


given_and_own = pytest.mark.parametrize("seed", [GIVEN, OWN])


@pytest.mark.slow
@given_and_own
def test_the_direction_of_a_plan_leaves_it_out_exactly_where_it_does_not_hold(seed):
    trials = Trials(random_question(seed).bare(), try_stance)
    search, seen = CombinationSearch(trials), 0
    while seen < 6:
        for choice in search.anywhere():
            change = search.change(choice)
            trial = None if change is None else trials.one(change)
            if trial is None:
                continue
            seen += 1
            search.learn(trial, choice.shift)
            holds = trials.holds(trial.utilisation)
            assert (search.part(choice) < 1.0 - 1e-6) == (not holds)


@pytest.mark.slow
@given_and_own
def test_no_direction_leaves_out_what_holds(seed):
    trials = Trials(random_question(seed).bare(), try_stance)
    search = CombinationSearch(trials)
    found = search.find(0, smallest=False)
    assert found is not None
    assert len(search.gives) > 3
    assert search.part(found) >= 1.0 - 1e-6
    # nor is anything put where limbs do not reach, or another hand is
    assert search.reached[list(found.hands), found.shift].all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [GIVEN, OWN])
def test_a_stance_that_no_single_change_helps_is_told_some_that_hold_together(seed):
    asked = random_question(seed)
    assert (asked.body_wrench is None) == (seed == OWN)
    told, whole = advice.advise(asked, try_stance)
    assert whole
    several = ("pair", "combination", *SETTINGS.kinds_of_other_task)
    assert not any(each.holds for each in told if each.kind not in several)
    first = told[0]
    assert first.kind in ("pair", "combination")
    assert first.holds
    assert first.sentence.count("; and ") >= 1 + (first.kind == "combination")
    there = planned(changed(asked, first.changes))
    assert there.utilisation == pytest.approx(first.utilisation, abs=1e-6)
    assert all(each.size >= first.size for each in told if each.holds)


@pytest.mark.slow
def test_hands_of_several_free_limbs_are_put_together():
    message = convert(random_request(ALONE), PlanRequest)
    asked = question(message)
    (hand,) = asked.stance.hands
    told, _ = advice.advise(asked, try_stance)
    first = told[0]
    assert first.holds
    assert len(set(first.limbs) - {hand.limb}) > 1
    there = changed(asked, first.changes)
    assert [each.limb for each in there.stance.hands] == [
        hand.limb,
        *(each for each in first.limbs if each != hand.limb),
    ]
    assert planned(there).utilisation == pytest.approx(first.utilisation, abs=1e-6)
    written = answering.answer_plan(advised(message, first))
    assert written.utilisation == pytest.approx(first.utilisation, abs=1e-6)
