"""Which changes together make a stance hold: directions leave out what does not hold, only that."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec import convert
from scipy.optimize import Bounds, LinearConstraint, milp

from planner import advice
from planner.advice import changed
from planner.advice.changes import SETTINGS
from planner.advice.combinations import Choice, CombinationSearch
from planner.advice.trials import Trials
from planner.solving import plan as planned, try_stance
from service import answering
from service.answering import advised, question
from service.requests import PlanRequest
from tests.suite.helpers.random_questions import BEYOND_HELP
from tests.suite.helpers.random_requests import random_request
from tests.suite.helpers.stances import random_question

GIVEN, OWN = 45, 154
"""Seeds of a stance under a wrench that is given, and of one that is far overloaded by itself."""

ENDED = 124
"""Seed of a stance whose search comes to choices that are worth more, but do not give enough."""

LATE = 119
"""Seed of a stance for which no combination that holds is found with the plans that are usual."""

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


class Whole(CombinationSearch):
    """A search that leaves nothing out but what cannot be, and that HiGHS goes on with."""

    def __init__(self, trials: Trials) -> None:
        super().__init__(trials)
        self.impossible: list[Choice] = []
        self.met: set[Choice] = set()
        self.planned: set[Choice] = set()

    def _forbid(self, choice: Choice) -> None:
        slots = self.slots
        super()._forbid(choice)
        gone = set(np.concatenate(slots)) - set(np.concatenate(self.slots))
        if any(self.trials.possible(self._variants[i].change) for i in gone):
            # only together with the others it cannot be
            self.slots = slots
            self.impossible.append(choice)

    def _climbed(self, start: Choice, smallest: bool) -> tuple[float, Choice]:
        worth, choice = super()._climbed(start, smallest)
        self.met.add(choice)
        return worth, choice

    def change(self, choice: Choice):
        self.planned.add(choice)
        return super().change(choice)

    def enough(self) -> Choice | None:
        """A choice that gives enough along all directions found; None if there is none."""
        v, s = len(self.sizes), len(self.shift_sizes)
        gives, rows, least, most = self.gives.copy(), [], [], []

        def row(variants, shifts, low: float, high: float) -> None:
            """What is chosen of some variants and shifts has a sum within bounds."""
            both = np.zeros(v), np.zeros(s)
            both[0][variants], both[1][shifts] = 1.0, 1.0
            rows.append(np.concatenate(both))
            least.append(low)
            most.append(high)

        for slot in self.slots:
            row(slot, [], 1.0, 1.0)
            # more than is needed whatever the others give is no better
            others = [each for each in self.slots if each is not slot]
            rest = sum(gives[:, each].min(axis=1) for each in others)
            ample = 1.0 + self.needs.max(axis=1) - rest
            gives[:, slot] = np.minimum(gives[:, slot], ample[:, None])
        row([], slice(None), 1.0, 1.0)
        left = np.concatenate(self.slots)
        for i in left:
            row(i, ~self.reached[i], 0.0, 1.0)
            for slot in self.slots:
                if i not in slot:
                    row([i, *slot[~self.together[i, slot]]], [], 0.0, 1.0)
        for choice in self.impossible:
            row([*choice.hands], choice.shift, 0.0, float(len(choice.hands)))
        rows += np.hstack([gives, -self.needs]).tolist()
        least += [1.0 - 1e-6] * len(gives)
        most += [np.inf] * len(gives)
        allowed = np.ones(v + s)
        allowed[:v] = np.isin(np.arange(v), left)
        found = milp(
            np.zeros(v + s),
            constraints=LinearConstraint(np.array(rows), least, most),
            integrality=np.ones(v + s),
            bounds=Bounds(0.0, allowed),
        )
        # optimal, or infeasible
        assert found.status in (0, 2), found.message
        if found.x is None:
            return None
        hands = tuple(int(slot[found.x[slot].argmax()]) for slot in self.slots)
        return Choice(hands, int(found.x[v:].argmax()))


@pytest.mark.slow
@pytest.mark.parametrize("seed", BEYOND_HELP)
def test_no_combination_holds_where_none_is_told(seed):
    """HiGHS goes on where the search ends, and finds that no choice gives enough at last."""
    trials = Trials(random_question(seed).bare(), try_stance)
    search = Whole(trials)
    assert search.find(0, smallest=False) is None
    assert trials.left > 0
    while (choice := search.enough()) is not None:
        assert choice not in search.planned
        change = search.change(choice)
        trial = None if change is None else trials.one(change)
        if trial is None:
            search._forbid(choice)
            continue
        assert not trials.holds(trial.utilisation)
        directions = len(search.gives)
        search.learn(trial, choice.shift)
        assert len(search.gives) > directions
    assert len(search.gives) > 1


@pytest.mark.slow
def test_with_more_plans_a_combination_is_told_that_holds():
    asked = random_question(LATE)
    usual, _ = advice.advise(asked, try_stance)
    assert not any(each.holds for each in usual if each.kind not in SETTINGS.kinds_of_other_task)
    told, _ = advice.advise(asked, try_stance, 120)
    assert told[0].kind == "combination"
    assert told[0].holds
    there = planned(changed(asked, told[0].changes))
    assert there.utilisation == pytest.approx(told[0].utilisation, abs=1e-6)


@pytest.mark.slow
def test_a_search_does_not_end_while_it_knows_a_choice_that_gives_enough():
    trials = Trials(random_question(ENDED).bare(), try_stance)
    search = Whole(trials)
    assert search.find(0, smallest=False) is None
    assert trials.left > 0
    assert all(search.part(choice) < 1.0 for choice in search.met - search.planned)


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
